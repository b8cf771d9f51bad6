// Does all that the C interface does, with meshes of assets/, and compares with numbers that are known. C99.
// Usage: use_test ASSETS_FOLDER WORK_FOLDER
#define _POSIX_C_SOURCE 200112L
#include <math.h>
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
  void* memory = allocate_aligned(bytes, alignment);
  if (memory == NULL) return NULL;
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
  free_aligned(memory);
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

  void* aligned = allocate_aligned(bytes, 128);
  CHECK(aligned != NULL);
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
    tandem_asset_info info = {.struct_size = sizeof info};
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
  free_aligned(aligned);
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

// Tests what tests/contract/ does not ask: rows that are given back to the scene that has them, options that
// are null, several questions in one call, and poses in between. The memory of all is the allocator's.
static void test_rows_and_calls(const tandem_allocator* allocator) {
  tandem_asset* cube = build_obj(assets_folder, "box_12.obj", allocator);
  tandem_scene* scene = scene_of(&cube, 1, allocator);
  tandem_instance row[10];
  for (int i = 0; i < 10; ++i) row[i] = at(0.5 * i, 0, 0);
  CHECK_STATUS(tandem_scene_set_threads(scene, 0), TANDEM_OK);
  CHECK_STATUS(tandem_scene_place(scene, row, 10, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_pairs(scene, NULL), TANDEM_OK);
  size_t count = 0;
  const tandem_object_pair* pairs = tandem_scene_pairs(scene, TANDEM_PAIRS, &count);
  CHECK(count == 17);
  tandem_contact_options options = {
      .struct_size = sizeof options, .pairs = pairs + 1, .pair_count = count - 1};
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_OK);
  CHECK(contact_count(scene) == 964 - 52 && pair_count(scene, TANDEM_PAIRS) == 17);
  pairs = tandem_scene_pairs(scene, TANDEM_CONTACTS, &count);
  CHECK(count == 16 && pairs[0].a == 0 && pairs[0].b == 2);
  // The pairs of a question are given to the same question.
  options.pairs = pairs + 15;
  options.pair_count = 1;
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_OK);
  pairs = tandem_scene_pairs(scene, TANDEM_CONTACTS, &count);
  CHECK(count == 1 && pairs[0].b == 9);

  // One call asks several questions, or none. Manifolds go when contacts are found again.
  const double points[] = {0.25, 0.5, 0.5, 50, 50, 50};
  const tandem_bodies_at_options at_points = {sizeof at_points, 0, points, 2};
  tandem_questions questions = {.struct_size = sizeof questions, .bodies_at = &at_points};
  const tandem_manifold_options manifolds = {sizeof manifolds, 0, 0, 0, 0};
  CHECK_STATUS(tandem_scene_find(scene, &questions), TANDEM_OK);
  CHECK(contact_count(scene) == 52);
  const tandem_body_at* there = tandem_scene_bodies_at(scene, &count);
  CHECK(count == 2 && there[0].body == 0 && there[1].point == 0 && there[1].body == 1);
  const double along[] = {0, 0, 1, 1, 0, 0};
  const tandem_closest_options closest = {
      .struct_size = sizeof closest, .sides = 1, .points = points, .point_count = 2};
  const tandem_ray_options rays = {sizeof rays, TANDEM_FIRST_HIT, 0, 0, 0, points, along, 2};
  const tandem_questions probes = {.struct_size = sizeof probes, .closest = &closest, .rays = &rays};
  CHECK_STATUS(tandem_scene_find(scene, &probes), TANDEM_OK);
  const tandem_closest_point* nearest = tandem_scene_closest(scene, &count);
  CHECK(count == 2 && nearest[0].upper == 0 && nearest[0].body <= 1 && nearest[1].lower > 50);
  const tandem_ray_hit* hits = tandem_scene_rays(scene, &count);
  CHECK(count == 2 && hits[0].t == 0 && hits[0].body == 0 && hits[1].body == TANDEM_NO_INDEX);
  tandem_scene* alone = NULL;
  CHECK_STATUS(tandem_scene_create(allocator, &alone), TANDEM_OK);
  CHECK_STATUS(tandem_scene_place_alone(alone, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_place_alone(alone, cube), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_rays(alone, &rays), TANDEM_OK);
  hits = tandem_scene_rays(alone, &count);
  CHECK(count == 2 && hits[0].t == 0 && hits[0].body == 0 && hits[1].body == TANDEM_NO_INDEX);
  tandem_scene_destroy(alone);
  tandem_asset_release(cube);
  const uint32_t asked[] = {1, 0, 1};
  const tandem_closest_options of_each = {
      .struct_size = sizeof of_each, .points = points, .point_count = 2, .bodies = asked, .body_count = 3};
  CHECK_STATUS(tandem_scene_find_closest(scene, &of_each), TANDEM_OK);
  nearest = tandem_scene_closest(scene, &count);
  CHECK(count == 6 && nearest[0].body == 1 && nearest[1].body == 0 && nearest[5].body == 1);
  options.pairs = NULL;
  options.pair_count = 0;
  questions.contained = 1;
  questions.contacts = &options;
  questions.manifolds = &manifolds;
  CHECK_STATUS(tandem_scene_find(scene, &questions), TANDEM_OK);
  CHECK(contact_count(scene) == 964 && tandem_scene_manifolds(scene, &count) != NULL && count > 0);
  CHECK(tandem_scene_distances(scene, &count) == NULL && count == 0);
  options.first_contact_only = 1;
  CHECK_STATUS(tandem_scene_find(scene, &questions), TANDEM_CONTACTS_MISSING);
  CHECK(contact_count(scene) == 17 && tandem_scene_contained(scene, &count) == NULL);
  CHECK_STATUS(tandem_scene_find_manifolds(scene, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
  CHECK(tandem_scene_manifolds(scene, &count) == NULL && count == 0);
  CHECK_STATUS(tandem_scene_find_distances(scene, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_verdicts(scene, NULL), TANDEM_OK);
  CHECK(pair_count(scene, TANDEM_DISTANCES) == 45 && pair_count(scene, TANDEM_VERDICTS) == 17);
  // The counters of a question that has no results are 0.
  tandem_counters counters;
  counters.struct_size = sizeof counters;
  CHECK_STATUS(tandem_scene_get_counters(scene, &counters), TANDEM_OK);
  CHECK(counters.contacts.contacts == 964 && counters.verdicts.touching == 17 &&
        counters.impacts.object_pairs == 0);

  // Pairs that have not moved keep their manifolds.
  const double tolerance_of_pair[17] = {0};
  tandem_moved_options tolerant = {.struct_size = sizeof tolerant, .tolerance = 0.01};
  const tandem_manifold_options keep = {sizeof keep, 0, 1, 1, 0};
  size_t manifold_count = 0;
  for (int step = 0; step < 3; ++step) {
    CHECK_STATUS(tandem_scene_find_moved(scene, &tolerant), TANDEM_OK);
    options = (tandem_contact_options){.struct_size = sizeof options};
    options.pairs = tandem_scene_moved(scene, &options.pair_count);
    CHECK(options.pair_count == (step == 1 ? 0 : 17) && pair_count(scene, TANDEM_MOVED) == 17);
    if (options.pairs == NULL) options.pairs = tandem_scene_pairs(scene, TANDEM_MOVED, NULL);
    CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_OK);
    CHECK_STATUS(tandem_scene_find_manifolds(scene, &keep), TANDEM_OK);
    CHECK(tandem_scene_manifolds(scene, &count) != NULL && (step == 0 || count == manifold_count));
    manifold_count = count;
    CHECK_STATUS(tandem_scene_get_counters(scene, &counters), TANDEM_OK);
    CHECK(counters.moved.object_pairs == 17 && counters.moved.kept == (step == 1 ? 17 : 0));
    tolerant.tolerance_of_pair = step == 1 ? tolerance_of_pair : NULL;
    tolerant.tolerance_count = step == 1 ? 17 : 0;
  }
  CHECK_STATUS(tandem_scene_find_moved(scene, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_manifolds(scene, NULL), TANDEM_OK);
  tolerant.tolerance_count = 0;
  tolerant.tolerance_of_pair = NULL;
  CHECK_STATUS(tandem_scene_find_moved(scene, &tolerant), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_manifolds(scene, &keep), TANDEM_KEPT_MISMATCH);
  CHECK(tandem_scene_manifolds(scene, &count) == NULL && count == 0);
  tolerant.tolerance = -1;
  CHECK_STATUS(tandem_scene_find_moved(scene, &tolerant), TANDEM_BAD_TOLERANCE);
  CHECK(tandem_scene_moved(scene, &count) == NULL && count == 0);

  const tandem_pose start = at(3, 0, 0).pose;
  const tandem_motion motion = {{-400, 0, 0}, {0, 0, 0}, {3, 0, 0}};
  tandem_pose stopped;
  CHECK_STATUS(tandem_pose_at(&start, &motion, 0.005, &stopped), TANDEM_OK);
  CHECK(near(stopped.translation[0], 1));
  tandem_scene_destroy(scene);
}

// Two squares, one above the other, of which the lower one is bent upwards.
static void test_deforming(void) {
  const double positions[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  const uint32_t triangles[] = {0, 1, 2, 0, 2, 3};
  const tandem_mesh mesh = {
      .struct_size = sizeof mesh, .positions = positions, .vertex_count = 4, .triangles = triangles, .triangle_count = 2};
  tandem_asset* assets[2];
  CHECK_STATUS(tandem_asset_build(&mesh, NULL, NULL, &assets[0], NULL), TANDEM_OK);
  assets[1] = assets[0];
  // A tree for two more shapes.
  double poses[] = {0, 0, 0, 1, 0, 0, 1, 1, 2, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 5};
  tandem_mesh moving = mesh;
  moving.poses = poses;
  moving.pose_count = 2;
  tandem_asset* moved = NULL;
  CHECK_STATUS(tandem_asset_build(&moving, NULL, NULL, &moved, NULL), TANDEM_OK);
  tandem_asset_release(moved);
  poses[23] = NAN;
  CHECK_STATUS(tandem_asset_build(&moving, NULL, NULL, &moved, NULL), TANDEM_OUT_OF_RANGE);
  moving.poses = NULL;
  CHECK_STATUS(tandem_asset_build(&moving, NULL, NULL, &moved, NULL), TANDEM_NULL_ARGUMENT);
  tandem_asset_info info = {.struct_size = sizeof info};
  CHECK_STATUS(tandem_asset_get_info(assets[0], &info), TANDEM_OK);
  CHECK(info.source_vertices == 4);
  tandem_scene* scene = NULL;
  CHECK_STATUS(tandem_scene_create(NULL, &scene), TANDEM_OK);
  CHECK_STATUS(tandem_scene_set_assets(scene, assets, 2), TANDEM_OK);
  tandem_instance bodies[2] = {at(0, 0, 0), at(0, 0, 1)};
  bodies[1].asset = 1;
  CHECK_STATUS(tandem_scene_place(scene, bodies, 2, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
  CHECK(contact_count(scene) == 0 && tandem_scene_looseness(scene, 0) == 1);
  float bent[] = {0, 0, 0, 1, 0, 0, 1, 1, 2, 0, 1, 0};
  CHECK_STATUS(tandem_scene_deform(scene, 0, bent, 4), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_manifolds(scene, NULL), TANDEM_CONTACTS_MISSING);
  CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
  CHECK(contact_count(scene) == 4 && tandem_scene_looseness(scene, 0) > 0);
  double near[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  near[8] = 1 - 1e-15;  // no float32 number, and still apart
  CHECK_STATUS(tandem_scene_deform_f64(scene, 0, near, 4), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
  CHECK(contact_count(scene) == 0);
  CHECK_STATUS(tandem_scene_find_manifolds(scene, NULL), TANDEM_NOT_FLOAT32);
  CHECK_STATUS(tandem_scene_find_verdicts(scene, NULL), TANDEM_DEFORMED);
  CHECK(tandem_scene_where(scene) == 0);
  bent[7] = NAN;
  CHECK_STATUS(tandem_scene_deform(scene, 1, bent, 4), TANDEM_OUT_OF_RANGE);
  CHECK(tandem_scene_where(scene) == 2);
  CHECK_STATUS(tandem_scene_deform(scene, 1, bent, 3), TANDEM_VERTEX_COUNT_MISMATCH);
  CHECK_STATUS(tandem_scene_deform(scene, 2, bent, 4), TANDEM_UNKNOWN_ASSET);
  CHECK_STATUS(tandem_scene_deform(scene, 1, NULL, 4), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_deform(NULL, 1, bent, 4), TANDEM_NULL_ARGUMENT);
  CHECK(tandem_scene_looseness(NULL, 0) == 1);
  tandem_scene_destroy(scene);
  tandem_asset_release(assets[0]);
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
  assets_folder = argv[1];
  work_folder = argv[2];
  Counted counted;
  const tandem_allocator allocator = counting_allocator(&counted);
  test_version_and_statuses();
  test_assets();
  test_building();
  test_rows_and_calls(NULL);
  test_deforming();
  test_threads();
  // All memory of handles and results is the allocator's, and comes back.
  test_rows_and_calls(&allocator);
  CHECK(counted.blocks == 0 && counted.bytes == 0 && counted.ever > 20);
  printf("%d failures\n", failures);
  return failures != 0;
}
