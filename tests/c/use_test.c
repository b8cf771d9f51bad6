// Does all that the C interface does, with meshes of assets/, and compares with numbers that are known. C99.
// Usage: use_test ASSETS_FOLDER WORK_FOLDER
#define _POSIX_C_SOURCE 200112L
#include <pthread.h>

#include "c_test.h"

static const char *assets_folder, *work_folder;

// An allocator that counts.
typedef struct Counted {
  long blocks, ever;
  size_t bytes;
} Counted;

static int near(double x, double y) {
  return x - y < 1e-9 && y - x < 1e-9;
}

static pthread_mutex_t counting = PTHREAD_MUTEX_INITIALIZER;

static void* counted_allocate(void* user, size_t bytes, size_t alignment) {
  Counted* counted = (Counted*)user;
  void* memory = NULL;
  if (posix_memalign(&memory, alignment < sizeof(void*) ? sizeof(void*) : alignment, bytes) != 0) return NULL;
  pthread_mutex_lock(&counting);
  ++counted->blocks;
  ++counted->ever;
  counted->bytes += bytes;
  pthread_mutex_unlock(&counting);
  return memory;
}

static void counted_deallocate(void* user, void* memory, size_t bytes, size_t alignment) {
  Counted* counted = (Counted*)user;
  (void)alignment;
  free(memory);
  pthread_mutex_lock(&counting);
  --counted->blocks;
  counted->bytes -= bytes;
  pthread_mutex_unlock(&counting);
}

static tandem_allocator counting_allocator(Counted* counted) {
  tandem_allocator allocator = {sizeof allocator, 0, NULL, counted_allocate, counted_deallocate};
  counted->blocks = counted->ever = 0;
  counted->bytes = 0;
  allocator.user = counted;
  return allocator;
}

static void test_version_and_statuses(void) {
  CHECK(tandem_version() == 100 * TANDEM_VERSION_MINOR + TANDEM_VERSION_PATCH + 10000 * TANDEM_VERSION_MAJOR);
  CHECK(strcmp(tandem_status_name(TANDEM_CHILD_SHARED), "ChildShared") == 0);
  CHECK(strcmp(tandem_status_explain(TANDEM_CHILD_SHARED), "a block has two parents") == 0);
  CHECK(strcmp(tandem_status_subject(TANDEM_CHILD_SHARED), "block") == 0);
  CHECK(tandem_status_subject(TANDEM_OK) == NULL);
  CHECK(strcmp(tandem_status_name(TANDEM_NULL_ARGUMENT), "NullArgument") == 0);
  CHECK(strcmp(tandem_status_name(9999), "Unnamed") == 0 && tandem_status_explain(9999) != NULL);
}

// Builds, writes, opens in both ways, reads from memory in both ways: always the same asset.
static int releases = 0;
static void count_release(void* user) {
  releases += *(int*)user;
}

static void test_assets(void) {
  tandem_asset* built = build_obj(assets_folder, "cow_1500.obj", NULL);
  size_t bytes = 0;
  const void* data = tandem_asset_data(built, &bytes);
  char path[4096];
  snprintf(path, sizeof path, "%s/cow.bvh", work_folder);
  FILE* file = fopen(path, "wb");
  CHECK(file != NULL && fwrite(data, 1, bytes, file) == bytes && fclose(file) == 0);

  void* aligned = NULL;
  CHECK(posix_memalign(&aligned, 128, bytes) == 0);
  memcpy(aligned, data, bytes);
  tandem_asset* all[5] = {built, NULL, NULL, NULL, NULL};
  int one = 1;
  tandem_open_options reading = {sizeof reading, TANDEM_ACCESS_READ, TANDEM_CHECK_QUICK, 0};
  tandem_memory_options borrowing = {sizeof borrowing, TANDEM_CHECK_FULL, 1, 0, count_release, NULL};
  borrowing.user = &one;
  CHECK_STATUS(tandem_asset_open(path, NULL, NULL, &all[1], NULL), TANDEM_OK);
  CHECK_STATUS(tandem_asset_open(path, &reading, NULL, &all[2], NULL), TANDEM_OK);
  CHECK_STATUS(tandem_asset_from_memory(data, bytes, NULL, NULL, &all[3], NULL), TANDEM_OK);
  CHECK_STATUS(tandem_asset_from_memory(aligned, bytes, &borrowing, NULL, &all[4], NULL), TANDEM_OK);
  CHECK(tandem_asset_data(all[4], NULL) == aligned);
  for (int i = 0; i < 5; ++i) {
    tandem_asset_info info = {sizeof info, 0, 0, 0, 0, 0, 0, {0}, 0, {0}, {0}};
    tandem_level level;
    level.struct_size = sizeof level;
    CHECK_STATUS(tandem_asset_get_info(all[i], &info), TANDEM_OK);
    CHECK(info.struct_size == sizeof info && info.level_count == 1 && info.file_bytes == bytes);
    CHECK(info.source_faces == 1500 && info.part_count == 1 && info.hash != 0);
    CHECK_STATUS(tandem_asset_get_level(all[i], 0, &level), TANDEM_OK);
    CHECK(level.triangle_count == 1500 && level.leaf_block_count == 375 && level.error_bound == 0);
    CHECK(level.closed == 1 && level.has_topology == 1 && level.has_oriented_blocks == 1);
    CHECK(level.vertex_count > 700 && level.vertex_count < 800 && level.component_count >= 1);
    uint64_t faces = 0;
    for (uint32_t t = 0; t < level.triangle_count; ++t) {
      faces += level.triangles[t].corner[0].w;
      for (int k = 0; k < 3; ++k) {
        const float* p = level.triangles[t].corner[k].position;
        for (int x = 0; x < 3; ++x) CHECK(p[x] >= info.lower[x] && p[x] <= info.upper[x]);
      }
    }
    CHECK(faces == 1499 * 1500 / 2);
    size_t text = 0;
    const char* json = tandem_asset_provenance(all[i], &text);
    CHECK(text > 0 && json[0] == '{' && json[text - 1] == '}');
    tandem_part part;
    part.struct_size = sizeof part;
    CHECK_STATUS(tandem_asset_get_part(all[i], 0, &part), TANDEM_OK);
    CHECK(part.first_face == 0 && part.face_count == 1500 && part.name_bytes == 0);
    CHECK(tandem_asset_coarsest_level(all[i], 1) == 0);
  }
  // Levels of an asset keep the bytes.
  tandem_asset* shown = NULL;
  CHECK_STATUS(tandem_asset_levels_from(all[4], 0, 1, &shown), TANDEM_OK);
  for (int i = 0; i < 5; ++i) tandem_asset_release(all[i]);
  CHECK(releases == 0);
  CHECK(tandem_asset_data(shown, NULL) == aligned);
  tandem_asset_release(shown);
  CHECK(releases == 1);

  // A byte that changed, and a file that is none.
  ((char*)aligned)[bytes / 2] ^= 1;
  uint64_t where = 0;
  tandem_asset* none = NULL;
  CHECK_STATUS(tandem_asset_from_memory(aligned, bytes, NULL, NULL, &none, &where), TANDEM_CONTENT_CHANGED);
  CHECK_STATUS(tandem_asset_from_memory(aligned, bytes, &borrowing, NULL, &none, &where),
               TANDEM_CONTENT_CHANGED);
  CHECK(none == NULL && releases == 1);
  CHECK_STATUS(tandem_asset_open("/nowhere/cow.bvh", NULL, NULL, &none, &where), TANDEM_FILE_NOT_FOUND);
  free(aligned);
}

static uint32_t end_soon(void* user, double share) {
  *(double*)user = share;
  return 1;
}

static void test_building(void) {
  // Two triangles of a square, one without area, one that names no vertex; quads as faces, in two parts.
  const double positions[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 0, 0};
  const uint32_t triangles[] = {0, 1, 2, 0, 2, 3, 0, 1, 4, 0, 1, 9};
  const uint32_t faces[] = {0, 0, 1, 2};
  const tandem_mesh_part parts[] = {{"square", "scene/square", 1}, {"rest", NULL, 2}};
  tandem_mesh mesh = {.struct_size = sizeof mesh,
                      .positions = positions,
                      .vertex_count = 5,
                      .triangles = triangles,
                      .triangle_count = 4,
                      .faces = faces,
                      .parts = parts,
                      .part_count = 2};
  tandem_build_report report = {.struct_size = sizeof report};
  tandem_asset* asset = NULL;
  CHECK_STATUS(tandem_asset_build(&mesh, NULL, NULL, &asset, &report), TANDEM_OK);
  CHECK(report.degenerate == 1 && report.index_out_of_range == 1 && report.vertices_welded == 0);
  tandem_level level;
  level.struct_size = sizeof level;
  CHECK_STATUS(tandem_asset_get_level(asset, 0, &level), TANDEM_OK);
  CHECK(level.triangle_count == 2 && level.closed == 0);
  CHECK(level.triangles[0].corner[0].w == 0 && level.triangles[1].corner[0].w == 0);
  tandem_part part;
  part.struct_size = sizeof part;
  CHECK_STATUS(tandem_asset_get_part(asset, 0, &part), TANDEM_OK);
  CHECK(part.name_bytes == 6 && memcmp(part.name, "square", 6) == 0 && part.path_bytes == 12);
  CHECK_STATUS(tandem_asset_get_part(asset, 2, &part), TANDEM_UNKNOWN_LEVEL);
  CHECK_STATUS(tandem_asset_get_level(asset, 1, &level), TANDEM_UNKNOWN_LEVEL);
  tandem_asset_release(asset);

  mesh.part_count = 1;
  CHECK_STATUS(tandem_asset_build(&mesh, NULL, NULL, &asset, NULL), TANDEM_BAD_PART);
  const tandem_mesh_part many[] = {{"a", NULL, 0xFFFFFFFE}, {"b", NULL, 1}};
  mesh.parts = many;
  CHECK_STATUS(tandem_asset_build(&mesh, NULL, NULL, &asset, NULL), TANDEM_OK);
  tandem_asset_release(asset);
  mesh.part_count = 2;
  CHECK_STATUS(tandem_asset_build(&mesh, NULL, NULL, &asset, NULL), TANDEM_BAD_PART);
  mesh.part_count = 0;
  const uint32_t last_faces[] = {0, 0, 1, 0xFFFFFFFD}, beyond[] = {0, 0, 1, 0xFFFFFFFE};
  mesh.faces = last_faces;
  CHECK_STATUS(tandem_asset_build(&mesh, NULL, NULL, &asset, NULL), TANDEM_OK);
  tandem_asset_release(asset);
  mesh.faces = beyond;
  CHECK_STATUS(tandem_asset_build(&mesh, NULL, NULL, &asset, NULL), TANDEM_TOO_MANY_TRIANGLES);
  mesh.faces = faces;
  mesh.triangles = triangles + 6;
  mesh.triangle_count = 2;
  CHECK_STATUS(tandem_asset_build(&mesh, NULL, NULL, &asset, &report), TANDEM_NO_TRIANGLE);
  CHECK(asset == NULL && report.degenerate == 1 && report.index_out_of_range == 1);

  // The options, and the same bytes whatever the threads.
  Triangles cow = read_obj(assets_folder, "cow_1500.obj");
  mesh = mesh_of(&cow);
  tandem_build_options options;
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.effort = TANDEM_EFFORT_FAST;
  options.no_gpu_blocks = options.no_topology = options.threads = 1;
  options.provenance = "{\"from\":\"C\"}";
  tandem_asset* other = NULL;
  CHECK_STATUS(tandem_asset_build(&mesh, &options, NULL, &asset, NULL), TANDEM_OK);
  options.threads = 4;
  CHECK_STATUS(tandem_asset_build(&mesh, &options, NULL, &other, NULL), TANDEM_OK);
  size_t bytes = 0, other_bytes = 0;
  const void* data = tandem_asset_data(asset, &bytes);
  const void* other_data = tandem_asset_data(other, &other_bytes);
  CHECK(bytes == other_bytes && memcmp(data, other_data, bytes) == 0);
  CHECK_STATUS(tandem_asset_get_level(asset, 0, &level), TANDEM_OK);
  CHECK(level.has_topology == 0 && level.has_oriented_blocks == 0);
  size_t text = 0;
  const char* json = tandem_asset_provenance(asset, &text);
  CHECK(text == 12 && memcmp(json, options.provenance, text) == 0);
  tandem_asset_release(asset);
  tandem_asset_release(other);

  // The best tree until the caller has seen enough.
  double done = -1;
  options.effort = TANDEM_EFFORT_BEST;
  options.provenance = NULL;
  options.progress = end_soon;
  options.user = &done;
  CHECK_STATUS(tandem_asset_build(&mesh, &options, NULL, &asset, NULL), TANDEM_OK);
  json = tandem_asset_provenance(asset, &text);
  char said[512] = {0};
  memcpy(said, json, text < sizeof said ? text : sizeof said - 1);
  CHECK(done >= 0 && done < 1 && strstr(said, "\"interrupted\":true") != NULL);
  CHECK(strstr(said, "\"imaginary\":\"minimal\",\"effort\":\"best\"") != NULL);
  tandem_asset_release(asset);
  free_mesh(&cow);
}

// The row of cubes of docs/queries.md.
static void test_contacts(const tandem_allocator* allocator) {
  tandem_asset* cube = build_obj(assets_folder, "box_12.obj", allocator);
  tandem_scene* scene = scene_of(&cube, 1, allocator);
  tandem_asset_release(cube);  // the scene has one of its own
  tandem_instance row[10];
  const double spacing[] = {1.5, 1, 0.5};
  const size_t expected_pairs[] = {0, 9, 17}, expected_contacts[] = {0, 558, 964};
  size_t count = 0;
  for (int step = 0; step < 3; ++step) {
    for (int i = 0; i < 10; ++i) row[i] = at(spacing[step] * i, 0, 0);
    CHECK_STATUS(tandem_scene_place(scene, row, 10, NULL), TANDEM_OK);
    for (uint32_t threads = 0; threads < 4; ++threads) {
      CHECK_STATUS(tandem_scene_set_threads(scene, threads), TANDEM_OK);
      CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
      CHECK(pair_count(scene, TANDEM_CONTACTS) == expected_pairs[step]);
      const tandem_contact* contacts = tandem_scene_contacts(scene, &count);
      CHECK(count == expected_contacts[step]);
      if (count > 0) CHECK(contacts[0].pair == 0 && contacts[0].face_a == 10 && contacts[0].face_b == 10);
    }
  }
  tandem_counters counters;
  counters.struct_size = sizeof counters;
  CHECK_STATUS(tandem_scene_get_counters(scene, &counters), TANDEM_OK);
  CHECK(counters.contacts.object_pairs == 17 && counters.contacts.contacts == 964);
  CHECK(counters.contacts.block_pairs > 0 && counters.distances.object_pairs == 0);

  // First contacts, given pairs, candidates, clearance, a body with itself.
  tandem_contact_options options = {sizeof options, TANDEM_EXACT, 1, 0, 0, 0, 0, NULL, 0};
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_OK);
  CHECK(contact_count(scene) == 17);
  options.first_contact_only = 0;
  const tandem_object_pair pair = {1, 0};
  options.pairs = &pair;
  options.pair_count = 1;
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_OK);
  const tandem_object_pair* pairs = tandem_scene_pairs(scene, TANDEM_CONTACTS, &count);
  CHECK(count == 1 && pairs[0].a == 1 && pairs[0].b == 0);
  const size_t exact = contact_count(scene);
  options.mode = TANDEM_BOXES;
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_OK);
  CHECK(exact > 0 && contact_count(scene) >= exact);
  options.pair_count = 0;  // given, but none
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_OK);
  CHECK(pair_count(scene, TANDEM_CONTACTS) == 0);
  options.mode = TANDEM_EXACT;
  options.pairs = NULL;
  for (int i = 0; i < 10; ++i) row[i] = at(1.25 * i, 0, 0);
  CHECK_STATUS(tandem_scene_place(scene, row, 10, NULL), TANDEM_OK);
  options.within = 0.25;
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_OK);
  CHECK(pair_count(scene, TANDEM_CONTACTS) == 9 && contact_count(scene) >= 9 * 4);
  options.within = 0.2499;
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_OK);
  CHECK(contact_count(scene) == 0);
  options.within = 0;
  options.self_pairs = 1;
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_OK);
  CHECK(pair_count(scene, TANDEM_CONTACTS) == 10);
  tandem_pair_options reaching = {sizeof reaching, 0, 0};
  CHECK_STATUS(tandem_scene_find_pairs(scene, NULL), TANDEM_OK);
  CHECK(pair_count(scene, TANDEM_PAIRS) == 0);
  reaching.reach = 0.25;
  CHECK_STATUS(tandem_scene_find_pairs(scene, &reaching), TANDEM_OK);
  CHECK(pair_count(scene, TANDEM_PAIRS) == 9);
  reaching.self_pairs = 1;
  CHECK_STATUS(tandem_scene_find_pairs(scene, &reaching), TANDEM_OK);
  CHECK(pair_count(scene, TANDEM_PAIRS) == 19);

  // The pairs that the scene found, without the first, are given to it.
  for (int i = 0; i < 10; ++i) row[i] = at(0.5 * i, 0, 0);
  CHECK_STATUS(tandem_scene_place(scene, row, 10, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_pairs(scene, NULL), TANDEM_OK);
  pairs = tandem_scene_pairs(scene, TANDEM_PAIRS, &count);
  CHECK(count == 17);
  options.pairs = pairs + 1;
  options.pair_count = count - 1;
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_OK);
  pairs = tandem_scene_pairs(scene, TANDEM_CONTACTS, &count);
  CHECK(count == 16 && pairs[0].a == 0 && pairs[0].b == 2);
  CHECK(contact_count(scene) == 964 - 52 && pair_count(scene, TANDEM_PAIRS) == 17);
  // Those of a question are given to the same question.
  options.pairs = pairs + 15;
  options.pair_count = 1;
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_OK);
  pairs = tandem_scene_pairs(scene, TANDEM_CONTACTS, &count);
  CHECK(count == 1 && pairs[0].b == 9);
  tandem_scene_destroy(scene);
}

// Filters: two fixed, two that a joint connects, two groups.
static void test_filters(const tandem_allocator* allocator) {
  tandem_asset* cube = build_obj(assets_folder, "box_12.obj", allocator);
  tandem_scene* scene = scene_of(&cube, 1, allocator);
  tandem_asset_release(cube);
  tandem_instance row[10];
  for (int i = 0; i < 10; ++i) row[i] = at(0.9 * i, 0, 0);
  uint8_t motion[10] = {TANDEM_FIXED, TANDEM_FIXED, 0, 0, 0, 0, 0, 0, 0, TANDEM_SLEEPING};
  uint32_t group[10] = {1, 1, 1, 1, 1, 2, 2, 2, 2, 2}, mask[10] = {1, 1, 1, 1, 1, 2, 2, 2, 2, 2};
  const tandem_object_pair joint = {3, 2};
  tandem_excluded_pairs* excluded = NULL;
  CHECK_STATUS(tandem_excluded_pairs_create(&joint, 1, allocator, &excluded), TANDEM_OK);
  tandem_pair_filter filter = {.struct_size = sizeof filter,
                               .count = 10,
                               .motion = motion,
                               .group = group,
                               .mask = mask,
                               .excluded = excluded};
  CHECK_STATUS(tandem_scene_place(scene, row, 10, &filter), TANDEM_OK);
  tandem_excluded_pairs_destroy(excluded);  // the scene has them
  memset(motion, 0, sizeof motion);         // and has copied the rest
  size_t count = 0;
  for (int step = 0; step < 2; ++step) {
    CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
    const tandem_object_pair* pairs = tandem_scene_pairs(scene, TANDEM_CONTACTS, &count);
    CHECK(count == 6);  // 9 but 0-1 (fixed), 2-3 (joint) and 4-5 (groups)
    for (size_t i = 0; i < count; ++i) CHECK(pairs[i].a != 0 && pairs[i].a != 2 && pairs[i].a != 4);
    // One that moves goes where it was, past the fixed ones, which the scene keeps.
    const uint32_t mover = 8;
    const tandem_pose away = at(0.9 * 8, 5, 0).pose;
    CHECK_STATUS(tandem_scene_move(scene, &mover, &away, 1), TANDEM_OK);
    CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
    CHECK(pair_count(scene, TANDEM_CONTACTS) == 4);
    CHECK_STATUS(tandem_scene_move(scene, &mover, &row[mover].pose, 1), TANDEM_OK);
  }
  CHECK_STATUS(tandem_scene_set_motion(scene, 1, TANDEM_MOVING), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
  CHECK(pair_count(scene, TANDEM_CONTACTS) == 7);
  CHECK_STATUS(tandem_scene_place(scene, row, 9, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
  CHECK(pair_count(scene, TANDEM_CONTACTS) == 8);
  tandem_scene_destroy(scene);
}

// Bodies come, go and move one by one, as in a scene that is placed anew.
static void test_single_bodies(const tandem_allocator* allocator) {
  tandem_asset* cube = build_obj(assets_folder, "box_12.obj", allocator);
  tandem_scene* scene = scene_of(&cube, 1, allocator);
  tandem_asset_release(cube);
  const double points[] = {0.25, 0.5, 0.5, 50, 50, 50};
  const tandem_bodies_at_options at_points = {
      .struct_size = sizeof at_points, .points = points, .point_count = 2};
  const tandem_questions questions = {.struct_size = sizeof questions, .bodies_at = &at_points};
  uint32_t number = 7;
  size_t count = 0;
  CHECK(tandem_scene_instances(scene, &count) == NULL && count == 0);
  for (uint32_t i = 0; i < 4; ++i) {
    const tandem_instance body = at(0.9 * i, 0, 0);
    CHECK_STATUS(tandem_scene_add(scene, &body, NULL, &number), TANDEM_OK);
    CHECK(number == i);
    CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
    CHECK(pair_count(scene, TANDEM_CONTACTS) == i && contact_count(scene) == 52 * i);
  }
  // Without 1 there are 2-3; its number is free.
  CHECK_STATUS(tandem_scene_remove(scene, 1), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
  const tandem_object_pair* pairs = tandem_scene_pairs(scene, TANDEM_CONTACTS, &count);
  CHECK(count == 1 && pairs[0].a == 2 && pairs[0].b == 3);
  const tandem_instance* instances = tandem_scene_instances(scene, &count);
  CHECK(count == 4 && instances[1].asset == TANDEM_NO_INDEX && instances[2].pose.translation[0] == 1.8);
  CHECK_STATUS(tandem_scene_remove(scene, 1), TANDEM_UNKNOWN_INSTANCE);
  CHECK_STATUS(tandem_scene_set_motion(scene, 1, TANDEM_FIXED), TANDEM_UNKNOWN_INSTANCE);
  const uint32_t two[2] = {3, 1};
  const tandem_pose poses[2] = {at(0, 0, 0).pose, at(0, 0, 0).pose};
  CHECK_STATUS(tandem_scene_move(scene, two, poses, 2), TANDEM_UNKNOWN_INSTANCE);
  CHECK(tandem_scene_where(scene) == 1);
  CHECK(tandem_scene_instances(scene, NULL)[3].pose.translation[0] > 2);  // nothing has changed
  // It comes again, fixed, in a group that meets none but 0.
  const uint8_t fixed = TANDEM_FIXED;
  const uint32_t all = ~0u, none = 0;
  tandem_pair_filter filter = {sizeof filter, 0, 1, &fixed, &all, &none, NULL};
  const tandem_instance body = at(0.9, 0, 0);
  CHECK_STATUS(tandem_scene_add(scene, &body, &filter, &number), TANDEM_OK);
  CHECK(number == 1);
  CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
  CHECK(pair_count(scene, TANDEM_CONTACTS) == 1);
  CHECK_STATUS(tandem_scene_remove(scene, 1), TANDEM_OK);
  filter.mask = &all;
  CHECK_STATUS(tandem_scene_add(scene, &body, &filter, &number), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
  CHECK(number == 1 && pair_count(scene, TANDEM_CONTACTS) == 3);
  // All apart; and nothing is asked.
  const uint32_t numbers[4] = {0, 1, 2, 3};
  tandem_pose apart[4];
  for (int i = 0; i < 4; ++i) apart[i] = at(3 * i, 0, 0).pose;
  CHECK_STATUS(tandem_scene_move(scene, numbers, apart, 4), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find(scene, &questions), TANDEM_OK);
  CHECK(contact_count(scene) == 3 * 52);  // of before
  const tandem_body_at* there = tandem_scene_bodies_at(scene, &count);
  CHECK(count == 1 && there->point == 0 && there->body == 0);
  CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
  CHECK(contact_count(scene) == 0);
  tandem_scene_destroy(scene);
}

static void test_manifolds_and_containment(const tandem_allocator* allocator) {
  tandem_asset* cube = build_obj(assets_folder, "box_12.obj", allocator);
  // A cube of a tenth of the size.
  Triangles small = read_obj(assets_folder, "box_12.obj");
  for (size_t i = 0; i < 3 * small.vertex_count; ++i) small.positions[i] *= 0.125;
  const tandem_mesh mesh = mesh_of(&small);
  tandem_asset* list[2] = {cube, NULL};
  CHECK_STATUS(tandem_asset_build(&mesh, NULL, allocator, &list[1], NULL), TANDEM_OK);
  free_mesh(&small);
  tandem_scene* scene = scene_of(list, 2, allocator);
  tandem_instance bodies[3] = {at(0, 0, 0), at(0.875, 0, 0), at(0.125, 0, 0)};
  bodies[2].asset = 1;  // inside both
  CHECK_STATUS(tandem_scene_place(scene, bodies, 3, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_manifolds(scene, NULL), TANDEM_CONTACTS_MISSING);
  // Contacts, manifolds and contained bodies in one call; the others are not asked.
  tandem_contact_options first = {sizeof first, TANDEM_EXACT, 0, 0, 0, 0, 0, NULL, 0};
  const tandem_manifold_options manifold_options = {sizeof manifold_options, 0, 0, 0};
  const tandem_questions questions = {
      .struct_size = sizeof questions, .contained = 1, .contacts = &first, .manifolds = &manifold_options};
  size_t count = 0, points = 0;
  for (int step = 0; step < 2; ++step) {
    CHECK_STATUS(tandem_scene_find(scene, &questions), TANDEM_OK);
    const tandem_manifold* manifolds = tandem_scene_manifolds(scene, &count);
    const tandem_manifold_point* point = tandem_scene_points(scene, &points);
    CHECK(count == 1 && manifolds[0].point_count == points && points >= 4);
    CHECK(near(manifolds[0].normal[0], 1) && near(manifolds[0].depth, 0.125));
    for (size_t i = 0; i < points; ++i) {
      CHECK(near(point[i].depth, 0.125) && point[i].id != 0 && point[i].manifold == 0);
      CHECK((point[i].previous == TANDEM_NO_INDEX) == (step == 0));
    }
    const tandem_containment* contained = tandem_scene_contained(scene, &count);
    CHECK(count == 1 && contained[0].inner == 1 && contained[0].component == 0);
    CHECK(contained[0].flags == TANDEM_INSIDE);
    const tandem_object_pair* pairs = tandem_scene_pairs(scene, TANDEM_CONTACTS, &count);
    CHECK(contained[0].pair < count && pairs[contained[0].pair].a == 0 && pairs[contained[0].pair].b == 2);
    CHECK(tandem_scene_distances(scene, &count) == NULL && count == 0);
    tandem_counters counters;
    counters.struct_size = sizeof counters;
    CHECK_STATUS(tandem_scene_get_counters(scene, &counters), TANDEM_OK);
    CHECK(counters.manifolds.manifolds == 1 && counters.manifolds.points == points);
    CHECK(counters.contained.inside == 1 && counters.contained.object_pairs == 2);
  }
  // Contacts of bodies that have moved since are not those of the bodies as they stand.
  const uint32_t mover = 2;
  const tandem_pose nearer = at(0.25, 0, 0).pose;
  CHECK_STATUS(tandem_scene_move(scene, &mover, &nearer, 1), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_contained(scene), TANDEM_CONTACTS_MISSING);
  CHECK_STATUS(tandem_scene_find_manifolds(scene, NULL), TANDEM_CONTACTS_MISSING);
  CHECK(tandem_scene_manifolds(scene, &count) == NULL && count == 0 && contact_count(scene) > 0);
  first.first_contact_only = 1;
  CHECK_STATUS(tandem_scene_find(scene, &questions), TANDEM_CONTACTS_MISSING);
  CHECK(contact_count(scene) == 1 && tandem_scene_contained(scene, &count) == NULL);
  CHECK_STATUS(tandem_scene_find_manifolds(scene, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_contacts(scene, &first), TANDEM_OK);
  CHECK(tandem_scene_manifolds(scene, &count) == NULL && count == 0);
  CHECK_STATUS(tandem_scene_find_contained(scene), TANDEM_CONTACTS_MISSING);
  tandem_asset_release(list[0]);
  tandem_asset_release(list[1]);
  tandem_scene_destroy(scene);
}

// The bodies of docs/distance.md and docs/impact.md.
static void test_distances_and_impacts(const tandem_allocator* allocator) {
  tandem_asset* cube = build_obj(assets_folder, "box_12.obj", allocator);
  tandem_scene* scene = scene_of(&cube, 1, allocator);
  tandem_asset_release(cube);
  CHECK_STATUS(tandem_scene_set_threads(scene, 2), TANDEM_OK);
  tandem_instance row[3] = {at(0, 0, 0), at(1.5, 0, 0), at(3, 0, 0)};
  CHECK_STATUS(tandem_scene_place(scene, row, 3, NULL), TANDEM_OK);
  tandem_distance_options options = {.struct_size = sizeof options, .limit_reach = 1, .reach = 2};
  const double expected[3] = {0.5, 2, 0.5};
  size_t count = 0;
  tandem_former_nearest former = {0, 1, 0, 0};
  for (int step = 0; step < 2; ++step) {
    CHECK_STATUS(tandem_scene_find_distances(scene, &options), TANDEM_OK);
    const tandem_distance* found = tandem_scene_distances(scene, &count);
    CHECK(count == 3);
    for (size_t i = 0; i < count; ++i) {
      CHECK(found[i].lower <= expected[i] && expected[i] <= found[i].upper);
      CHECK(found[i].upper - found[i].lower <= 1e-6 * found[i].upper);
    }
    former.triangle_a = found[0].triangle_a;
    former.triangle_b = found[0].triangle_b;
    options.former = &former;
    options.former_count = 1;
  }
  const tandem_object_pair far_pair = {2, 0};
  options.reach = 1;
  options.pairs = &far_pair;
  options.pair_count = 1;
  CHECK_STATUS(tandem_scene_find_distances(scene, &options), TANDEM_OK);
  const tandem_distance* beyond = tandem_scene_distances(scene, &count);
  CHECK(count == 1 && beyond[0].triangle_a == TANDEM_NO_INDEX && beyond[0].lower >= 1);
  CHECK(tandem_scene_pairs(scene, TANDEM_DISTANCES, &count)[0].a == 2);

  tandem_instance bodies[2] = {at(0, 0, 0), at(3, 0, 0)};
  tandem_motion motion[2] = {{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, {{-400, 0, 0}, {0, 0, 0}, {3, 0, 0}}};
  tandem_impact_options moving = {sizeof moving, 0, 1.0 / 60, 0, motion, 2, NULL, 0};
  CHECK_STATUS(tandem_scene_place(scene, bodies, 2, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_impacts(scene, &moving), TANDEM_OK);
  const tandem_impact* found = tandem_scene_impacts(scene, &count);
  CHECK(count == 1 && found[0].status == TANDEM_IMPACT && found[0].t_safe < 0.005);
  CHECK(found[0].t_safe > 0.005 - 1e-8 && found[0].face_a == 3 && found[0].face_b == 11);
  tandem_pose stopped;
  CHECK_STATUS(tandem_pose_at(&bodies[1].pose, &motion[1], found[0].t_safe, &stopped), TANDEM_OK);
  CHECK(stopped.translation[0] > 1 && stopped.translation[0] < 1.00001);
  const tandem_object_pair pair = {1, 0};
  motion[1].velocity[0] = 400;
  moving.duration = 0.25;
  moving.pairs = &pair;
  moving.pair_count = 1;
  CHECK_STATUS(tandem_scene_find_impacts(scene, &moving), TANDEM_OK);
  found = tandem_scene_impacts(scene, &count);
  CHECK(count == 1 && found[0].status == TANDEM_NO_IMPACT && found[0].t_safe == 0.25);
  CHECK(tandem_scene_pairs(scene, TANDEM_IMPACTS, &count)[0].a == 1);
  moving.motion_count = 1;
  CHECK_STATUS(tandem_scene_find_impacts(scene, &moving), TANDEM_MOTION_MISMATCH);
  CHECK(tandem_scene_impacts(scene, &count) == NULL && count == 0);

  // Without coarser levels, a tolerance decides all.
  const tandem_object_pair both[2] = {{0, 1}, {1, 2}};
  row[1] = at(0.75, 0, 0);
  CHECK_STATUS(tandem_scene_place(scene, row, 3, NULL), TANDEM_OK);
  const tandem_tolerance_options by = {sizeof by, 0, 0.1, both, 2};
  CHECK_STATUS(tandem_scene_find_verdicts(scene, &by), TANDEM_OK);
  const tandem_verdict* verdicts = tandem_scene_verdicts(scene, &count);
  CHECK(count == 2 && verdicts[0].verdict == TANDEM_TOUCH && verdicts[1].verdict == TANDEM_APART);
  CHECK_STATUS(tandem_scene_find_verdicts(scene, NULL), TANDEM_OK);
  CHECK(tandem_scene_pairs(scene, TANDEM_VERDICTS, &count)[0].b == 1 && count == 1);
  tandem_counters counters;
  counters.struct_size = sizeof counters;
  CHECK_STATUS(tandem_scene_get_counters(scene, &counters), TANDEM_OK);
  CHECK(counters.verdicts.touching == 1 && counters.verdicts.work.object_pairs == 1);
  CHECK(counters.distances.object_pairs == 1 && counters.impacts.object_pairs == 0);
  tandem_scene_destroy(scene);
}

// Two threads, a scene each, one asset, which goes while they work.
typedef struct Job {
  tandem_asset* asset;
  size_t contacts;
  tandem_status status;
} Job;

static void* work(void* user) {
  Job* job = (Job*)user;
  tandem_scene* scene = NULL;
  job->status = tandem_scene_create(NULL, &scene);
  if (job->status == TANDEM_OK) job->status = tandem_scene_set_threads(scene, 2);
  if (job->status == TANDEM_OK) job->status = tandem_scene_set_assets(scene, &job->asset, 1);
  tandem_asset_release(job->asset);
  tandem_instance bodies[4];
  for (int i = 0; i < 4; ++i) bodies[i] = at(0.1 * i, 0.03 * i, 0);
  for (int step = 0; step < 20 && job->status == TANDEM_OK; ++step) {
    job->status = tandem_scene_place(scene, bodies, 4, NULL);
    if (job->status == TANDEM_OK) job->status = tandem_scene_find_contacts(scene, NULL);
  }
  job->contacts = contact_count(scene);
  tandem_scene_destroy(scene);
  return NULL;
}

static void test_threads(void) {
  Job jobs[2];
  pthread_t threads[2];
  jobs[0].asset = jobs[1].asset = build_obj(assets_folder, "cow_1500.obj", NULL);
  tandem_asset_retain(jobs[1].asset);
  for (int i = 0; i < 2; ++i) CHECK(pthread_create(&threads[i], NULL, work, &jobs[i]) == 0);
  for (int i = 0; i < 2; ++i) CHECK(pthread_join(threads[i], NULL) == 0);
  CHECK(jobs[0].status == TANDEM_OK && jobs[1].status == TANDEM_OK);
  CHECK(jobs[0].contacts > 0 && jobs[0].contacts == jobs[1].contacts);
}

int main(int argc, char** argv) {
  if (argc != 3) return printf("usage: use_test ASSETS_FOLDER WORK_FOLDER\n"), 1;
  if (!has_device()) return printf("there is no GPU\n"), NO_DEVICE;
  assets_folder = argv[1];
  work_folder = argv[2];
  Counted counted;
  const tandem_allocator allocator = counting_allocator(&counted);
  test_version_and_statuses();
  test_assets();
  test_building();
  test_contacts(NULL);
  test_filters(NULL);
  test_single_bodies(NULL);
  test_manifolds_and_containment(NULL);
  test_distances_and_impacts(NULL);
  test_threads();
  // All memory of handles and results is the allocator's, and comes back.
  test_contacts(&allocator);
  test_filters(&allocator);
  test_single_bodies(&allocator);
  CHECK(counted.blocks == 0 && counted.bytes == 0 && counted.ever > 20);
  test_manifolds_and_containment(&allocator);
  test_distances_and_impacts(&allocator);
  CHECK(counted.blocks == 0 && counted.bytes == 0);
  printf("%d failures\n", failures);
  return failures != 0;
}
