// Tests what the C interface answers to calls that are wrong. C99. Usage: misuse_test ASSETS_FOLDER
#include "c_test.h"

// Grants some allocations, then none.
static int grants_left;

static void* grant(void* user, size_t bytes, size_t alignment) {
  (void)user;
  if (grants_left-- <= 0) return NULL;
  return allocate_aligned(bytes, alignment);
}

static void give_back(void* user, void* memory, size_t bytes, size_t alignment) {
  (void)user;
  (void)bytes;
  (void)alignment;
  free_aligned(memory);
}

// Null for a scene, and for what there must be.
static void test_nulls(tandem_asset* cube) {
  const tandem_instance body = at(0, 0, 0);
  size_t count = 7;
  uint32_t number = 7;
  CHECK_STATUS(tandem_scene_create(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_set_assets(NULL, &cube, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_set_threads(NULL, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_place(NULL, &body, 1, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_add(NULL, &body, NULL, &number), TANDEM_NULL_ARGUMENT);
  CHECK(number == TANDEM_NO_INDEX);
  CHECK_STATUS(tandem_scene_move(NULL, &number, &body.pose, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_set_motion(NULL, 0, TANDEM_FIXED), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_remove(NULL, 0), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_find_pairs(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_find_contacts(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_find_manifolds(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_find_contained(NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_find_distances(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_find_impacts(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_find_verdicts(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_find(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_get_counters(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK(tandem_scene_contacts(NULL, &count) == NULL && count == 0);
  CHECK(tandem_scene_pairs(NULL, TANDEM_CONTACTS, NULL) == NULL && tandem_scene_where(NULL) == 0);
  CHECK(tandem_scene_manifolds(NULL, &count) == NULL && tandem_scene_points(NULL, NULL) == NULL);
  CHECK(tandem_scene_contained(NULL, &count) == NULL && tandem_scene_instances(NULL, &count) == NULL);
  CHECK(tandem_scene_distances(NULL, &count) == NULL && count == 0);
  CHECK(tandem_scene_impacts(NULL, &count) == NULL && tandem_scene_verdicts(NULL, &count) == NULL);
  CHECK_STATUS(tandem_asset_get_info(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_asset_get_info(cube, NULL), TANDEM_NULL_ARGUMENT);
  tandem_asset* none = cube;
  CHECK_STATUS(tandem_asset_open(NULL, NULL, NULL, &none, NULL), TANDEM_NULL_ARGUMENT);
  CHECK(none == NULL && tandem_asset_data(NULL, &count) == NULL && count == 0);
  none = cube;
  CHECK_STATUS(tandem_asset_build(NULL, NULL, NULL, &none, NULL), TANDEM_NULL_ARGUMENT);
  CHECK(none == NULL);
  CHECK_STATUS(tandem_pose_at(NULL, NULL, 0, NULL), TANDEM_NULL_ARGUMENT);
  tandem_asset_retain(NULL);
  tandem_asset_release(NULL);
  tandem_scene_destroy(NULL);
  tandem_excluded_pairs_destroy(NULL);
}

static void test_lists_that_are_not_there(tandem_asset* cube) {
  const tandem_instance body = at(0, 0, 0);
  uint32_t number = 7;
  tandem_asset* holes[3] = {cube, cube, NULL};
  tandem_scene* scene = scene_of(&cube, 1, NULL);
  CHECK_STATUS(tandem_scene_set_assets(scene, holes, 3), TANDEM_NULL_ARGUMENT);
  CHECK(tandem_scene_where(scene) == 2);
  CHECK_STATUS(tandem_scene_place(scene, &body, 1, NULL), TANDEM_UNKNOWN_ASSET);
  CHECK_STATUS(tandem_scene_set_assets(scene, NULL, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_set_assets(scene, NULL, 0), TANDEM_OK);
  CHECK_STATUS(tandem_scene_place(scene, NULL, 1, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_place(scene, NULL, 0, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
  const tandem_contact_options holes_in_pairs = {sizeof holes_in_pairs, 0, 0, 0, 0, 0, 0, NULL, 3};
  CHECK_STATUS(tandem_scene_find_contacts(scene, &holes_in_pairs), TANDEM_NULL_ARGUMENT);
  tandem_distance_options distances = {sizeof distances, 0, 0, 0, 0, NULL, 1, NULL, 0};
  CHECK_STATUS(tandem_scene_find_distances(scene, &distances), TANDEM_NULL_ARGUMENT);
  const tandem_impact_options impacts = {sizeof impacts, 0, 1, 0, NULL, 1, NULL, 0};
  CHECK_STATUS(tandem_scene_find_impacts(scene, &impacts), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_find(scene, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_add(scene, NULL, NULL, &number), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_add(scene, &body, NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_move(scene, NULL, &body.pose, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_move(scene, &number, NULL, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_scene_move(scene, NULL, NULL, 0), TANDEM_OK);
  CHECK_STATUS(tandem_scene_place(scene, &body, 1, NULL), TANDEM_UNKNOWN_ASSET);
  CHECK(tandem_scene_where(scene) == 0);
  tandem_scene_destroy(scene);
}

static void test_struct_sizes(tandem_asset* cube) {
  tandem_scene* scene = scene_of(&cube, 1, NULL);
  const tandem_instance bodies[2] = {at(0, 0, 0), at(0.5, 0, 0)};
  CHECK_STATUS(tandem_scene_place(scene, bodies, 2, NULL), TANDEM_OK);
  // Options of a later version: what this one does not know is zero, or is refused.
  struct {
    tandem_contact_options options;
    uint64_t later[2];
  } grown;
  memset(&grown, 0, sizeof grown);
  grown.options.struct_size = sizeof grown;
  size_t count = 0;
  CHECK_STATUS(tandem_scene_find_contacts(scene, &grown.options), TANDEM_OK);
  CHECK(contact_count(scene) > 0);
  grown.later[1] = 1;
  CHECK_STATUS(tandem_scene_find_contacts(scene, &grown.options), TANDEM_BAD_STRUCT_SIZE);
  // After an error there are no results.
  CHECK(tandem_scene_contacts(scene, &count) == NULL && count == 0);
  CHECK(tandem_scene_pairs(scene, TANDEM_CONTACTS, &count) == NULL && count == 0);
  const uint32_t wrong[] = {0, 4, sizeof(tandem_contact_options) - 1, 1u << 20, 0xCDCDCDCDu};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
    grown.options.struct_size = wrong[i];
    CHECK_STATUS(tandem_scene_find_contacts(scene, &grown.options), TANDEM_BAD_STRUCT_SIZE);
  }
  // Each struct of options has its own check.
  const tandem_pair_options pairs = {0, 0, 0};
  const tandem_manifold_options manifolds = {0, 0, 0, 0, 0};
  const tandem_distance_options distances = {0, 0, 0, 0, 0, NULL, 0, NULL, 0};
  const tandem_impact_options impacts = {0, 0, 0, 0, NULL, 0, NULL, 0};
  const tandem_tolerance_options verdicts = {0, 0, 0, NULL, 0};
  const tandem_questions questions = {.struct_size = 0};
  CHECK_STATUS(tandem_scene_find_pairs(scene, &pairs), TANDEM_BAD_STRUCT_SIZE);
  CHECK_STATUS(tandem_scene_find_manifolds(scene, &manifolds), TANDEM_BAD_STRUCT_SIZE);
  CHECK_STATUS(tandem_scene_find_distances(scene, &distances), TANDEM_BAD_STRUCT_SIZE);
  CHECK_STATUS(tandem_scene_find_impacts(scene, &impacts), TANDEM_BAD_STRUCT_SIZE);
  CHECK_STATUS(tandem_scene_find_verdicts(scene, &verdicts), TANDEM_BAD_STRUCT_SIZE);
  CHECK_STATUS(tandem_scene_find(scene, &questions), TANDEM_BAD_STRUCT_SIZE);
  // A struct that is filled, of a later version: the rest becomes zero.
  struct {
    tandem_asset_info info;
    uint64_t later;
  } filled;
  memset(&filled, 0xFF, sizeof filled);
  filled.info.struct_size = sizeof filled;
  CHECK_STATUS(tandem_asset_get_info(cube, &filled.info), TANDEM_OK);
  CHECK(filled.later == 0 && filled.info.struct_size == sizeof filled && filled.info.source_faces == 12);
  filled.info.struct_size = 8;
  CHECK_STATUS(tandem_asset_get_info(cube, &filled.info), TANDEM_BAD_STRUCT_SIZE);
  tandem_counters counters;
  counters.struct_size = 0;
  CHECK_STATUS(tandem_scene_get_counters(scene, &counters), TANDEM_BAD_STRUCT_SIZE);
  tandem_scene_destroy(scene);
}

// Choices that there are not, and reserved fields that are set.
static void test_bad_options(tandem_asset* cube) {
  tandem_scene* scene = scene_of(&cube, 1, NULL);
  const tandem_instance bodies[2] = {at(0, 0, 0), at(0.5, 0, 0)};
  CHECK_STATUS(tandem_scene_place(scene, bodies, 2, NULL), TANDEM_OK);
  tandem_contact_options options = {sizeof options, 3, 0, 0, 0, 0, 0, NULL, 0};
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_BAD_OPTION);
  options.mode = TANDEM_EXACT;
  options.self_pairs = 2;
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_BAD_OPTION);
  options.self_pairs = 0;
  options.leave_out_rings = 9;
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_BAD_OPTION);
  const tandem_pair_options unlike = {sizeof unlike, 2, 0};
  CHECK_STATUS(tandem_scene_find_pairs(scene, &unlike), TANDEM_BAD_OPTION);
  CHECK(pair_count(scene, TANDEM_PAIRS) == 0);
  const tandem_manifold_options many = {sizeof many, 8, 0, 0, 0}, twice = {sizeof twice, 0, 2, 0, 0};
  tandem_manifold_options kept = {sizeof kept, 0, 0, 2, 0};
  CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_manifolds(scene, &many), TANDEM_BAD_OPTION);
  CHECK_STATUS(tandem_scene_set_threads(scene, 1025), TANDEM_BAD_OPTION);
  CHECK_STATUS(tandem_scene_set_threads(scene, UINT32_MAX), TANDEM_BAD_OPTION);
  CHECK(tandem_scene_where(scene) == 0 && tandem_status_subject(TANDEM_BAD_OPTION) == NULL);
  CHECK_STATUS(tandem_scene_find_manifolds(scene, &twice), TANDEM_BAD_OPTION);
  CHECK_STATUS(tandem_scene_find_manifolds(scene, &kept), TANDEM_BAD_OPTION);
  kept.keep = 1;
  CHECK_STATUS(tandem_scene_find_manifolds(scene, &kept), TANDEM_CONTACTS_MISSING);
  const double tolerances[2] = {0, 0};
  tandem_moved_options moved = {sizeof moved, 0, 0, NULL, 2, NULL, 0};
  CHECK_STATUS(tandem_scene_find_moved(scene, &moved), TANDEM_NULL_ARGUMENT);
  moved.tolerance_of_pair = tolerances;
  CHECK_STATUS(tandem_scene_find_moved(scene, &moved), TANDEM_BAD_OPTION);
  moved.tolerance_count = 0;
  moved.reserved = 1;
  CHECK_STATUS(tandem_scene_find_moved(scene, &moved), TANDEM_BAD_OPTION);
  tandem_distance_options distances = {sizeof distances, 2, 0, 0, 0, NULL, 0, NULL, 0};
  CHECK_STATUS(tandem_scene_find_distances(scene, &distances), TANDEM_BAD_OPTION);
  const tandem_impact_options impacts = {sizeof impacts, 1, 0, 0, NULL, 0, NULL, 0};
  CHECK_STATUS(tandem_scene_find_impacts(scene, &impacts), TANDEM_BAD_OPTION);
  CHECK_STATUS(tandem_scene_find_impacts(scene, NULL), TANDEM_MOTION_MISMATCH);
  const tandem_tolerance_options reserved = {sizeof reserved, 1, 0, NULL, 0};
  CHECK_STATUS(tandem_scene_find_verdicts(scene, &reserved), TANDEM_BAD_OPTION);
  const tandem_questions questions = {.struct_size = sizeof questions, .contained = 2};
  CHECK_STATUS(tandem_scene_find(scene, &questions), TANDEM_BAD_OPTION);
  CHECK(tandem_scene_pairs(scene, 5, NULL) == NULL && tandem_scene_pairs(scene, ~0u, NULL) == NULL);
  CHECK_STATUS(tandem_scene_set_motion(scene, 0, 4), TANDEM_BAD_MOTION);
  tandem_open_options opening = {sizeof opening, 2, 0, 0};
  tandem_asset* asset = NULL;
  CHECK_STATUS(tandem_asset_open("x", &opening, NULL, &asset, NULL), TANDEM_BAD_OPTION);

  tandem_pair_filter filter;
  const uint8_t motion[2] = {TANDEM_MOVING, 4};
  uint32_t number = 0;
  memset(&filter, 0, sizeof filter);
  CHECK_STATUS(tandem_scene_place(scene, bodies, 2, &filter), TANDEM_BAD_STRUCT_SIZE);
  CHECK_STATUS(tandem_scene_add(scene, bodies, &filter, &number), TANDEM_BAD_STRUCT_SIZE);
  filter.struct_size = sizeof filter;
  CHECK_STATUS(tandem_scene_place(scene, bodies, 2, &filter), TANDEM_OK);
  filter.motion = motion;
  CHECK_STATUS(tandem_scene_place(scene, bodies, 2, &filter), TANDEM_FILTER_MISMATCH);
  filter.count = 2;
  CHECK_STATUS(tandem_scene_add(scene, bodies, &filter, &number), TANDEM_FILTER_MISMATCH);
  CHECK_STATUS(tandem_scene_place(scene, bodies, 2, &filter), TANDEM_BAD_MOTION);
  CHECK(tandem_scene_where(scene) == 1);
  filter.motion = motion + 1;
  filter.count = 1;
  CHECK_STATUS(tandem_scene_add(scene, bodies, &filter, &number), TANDEM_BAD_MOTION);
  const tandem_object_pair joint = {0, 1};
  CHECK_STATUS(tandem_excluded_pairs_create(&joint, 1, NULL, (tandem_excluded_pairs**)&filter.excluded),
               TANDEM_OK);
  filter.motion = motion;
  CHECK_STATUS(tandem_scene_add(scene, bodies, &filter, &number), TANDEM_BAD_OPTION);
  filter.motion = NULL;
  CHECK_STATUS(tandem_scene_place(scene, bodies, 1, &filter), TANDEM_UNKNOWN_INSTANCE);
  tandem_excluded_pairs_destroy((tandem_excluded_pairs*)filter.excluded);
  tandem_scene_destroy(scene);
}

// The asset goes before the scene, and the scene before its results are looked at no more.
static void test_lifetimes(const char* folder) {
  tandem_asset* cube = build_obj(folder, "box_12.obj", NULL);
  tandem_asset* shown = NULL;
  CHECK_STATUS(tandem_asset_levels_from(cube, 0, 0, &shown), TANDEM_OK);
  tandem_asset* none = NULL;
  CHECK_STATUS(tandem_asset_levels_from(cube, 1, 0, &none), TANDEM_UNKNOWN_LEVEL);
  tandem_asset* list[3] = {cube, shown, cube};
  tandem_scene* scene = scene_of(list, 3, NULL);
  tandem_asset_release(cube);
  tandem_asset_release(shown);
  tandem_instance bodies[3] = {at(0, 0, 0), at(0.9, 0, 0), at(1.8, 0, 0)};
  bodies[1].asset = 1;
  bodies[2].asset = 2;
  size_t count = 0;
  CHECK_STATUS(tandem_scene_place(scene, bodies, 3, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_contacts(scene, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_manifolds(scene, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_distances(scene, NULL), TANDEM_OK);
  (void)tandem_scene_manifolds(scene, &count);
  CHECK(count == 2);
  // Its own assets again, and none: results are gone, and bodies.
  CHECK_STATUS(tandem_scene_set_assets(scene, NULL, 0), TANDEM_OK);
  CHECK(tandem_scene_manifolds(scene, &count) == NULL && count == 0);
  CHECK(tandem_scene_distances(scene, &count) == NULL && tandem_scene_contacts(scene, &count) == NULL);
  CHECK(tandem_scene_instances(scene, &count) == NULL && count == 0);
  CHECK_STATUS(tandem_scene_place(scene, bodies, 3, NULL), TANDEM_UNKNOWN_ASSET);
  tandem_scene_destroy(scene);
}

static void test_allocators(const char* folder) {
  tandem_allocator allocator = {sizeof allocator, 0, NULL, refuse, take_back};
  tandem_scene* scene = NULL;
  tandem_excluded_pairs* excluded = NULL;
  CHECK_STATUS(tandem_scene_create(&allocator, &scene), TANDEM_OUT_OF_MEMORY);
  CHECK_STATUS(tandem_excluded_pairs_create(NULL, 0, &allocator, &excluded), TANDEM_OUT_OF_MEMORY);
  CHECK(scene == NULL && excluded == NULL);
  allocator.deallocate = NULL;
  CHECK_STATUS(tandem_scene_create(&allocator, &scene), TANDEM_NULL_ARGUMENT);
  allocator.struct_size = 8;
  CHECK_STATUS(tandem_scene_create(&allocator, &scene), TANDEM_BAD_STRUCT_SIZE);

  // However many allocations are granted, a call succeeds or says that memory is out, and nothing is lost.
  const tandem_allocator granting = {sizeof granting, 0, NULL, grant, give_back};
  tandem_asset* cube = build_obj(folder, "box_12.obj", NULL);
  size_t bytes = 0;
  const void* data = tandem_asset_data(cube, &bytes);
  const tandem_instance bodies[2] = {at(0, 0, 0), at(0.5, 0, 0)};
  const tandem_pair_options pairs = {sizeof pairs, 0, 0};
  const tandem_contact_options contacts = {sizeof contacts, 0, 0, 0, 0, 0, 0, NULL, 0};
  const tandem_manifold_options manifolds = {sizeof manifolds, 0, 0, 0, 0};
  const tandem_distance_options distances = {sizeof distances, 0, 0, 0, 0, NULL, 0, NULL, 0};
  const tandem_motion still[3] = {{{0}, {0}, {0}}, {{0}, {0}, {0}}, {{0}, {0}, {0}}};
  const tandem_impact_options impacts = {sizeof impacts, 0, 1, 0, still, 3, NULL, 0};
  const tandem_tolerance_options verdicts = {sizeof verdicts, 0, 0, NULL, 0};
  const double place[3] = {2, 0, 0}, along[3] = {-1, 0, 0};
  const tandem_closest_options closest = {
      .struct_size = sizeof closest, .sides = 1, .points = place, .point_count = 1};
  const tandem_ray_options rays = {sizeof rays, TANDEM_ALL_HITS, 0, 0, 0, place, along, 1};
  const uint32_t moving[1] = {1};
  const tandem_pose there = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.5, 0, 0}};
  const tandem_configuration_options configurations = {sizeof configurations, 1, moving, 1, &there, 1, 0, 0, 0};
  const tandem_questions all = {sizeof all, 1,         &pairs, &contacts,       &manifolds, &distances,
                                &impacts,   &verdicts, NULL,   &configurations, &closest,   &rays};
  int succeeded = 0, refused = 0;
  for (int granted = 0; granted < 300 && succeeded == 0; ++granted) {
    grants_left = granted;
    uint32_t number = 0;
    tandem_asset* asset = NULL;
    tandem_status status = tandem_asset_from_memory(data, bytes, NULL, &granting, &asset, NULL);
    scene = NULL;
    if (status == TANDEM_OK) status = tandem_scene_create(&granting, &scene);
    if (status == TANDEM_OK) status = tandem_scene_set_threads(scene, 2);
    if (status == TANDEM_OK) status = tandem_scene_set_assets(scene, &asset, 1);
    if (status == TANDEM_OK) status = tandem_scene_place(scene, bodies, 2, NULL);
    if (status == TANDEM_OK) status = tandem_scene_add(scene, bodies, NULL, &number);
    if (status == TANDEM_OK) status = tandem_scene_find(scene, &all);
    succeeded += status == TANDEM_OK;
    refused += status == TANDEM_OUT_OF_MEMORY || status == TANDEM_CANNOT_START_THREAD;
    CHECK(succeeded + refused == granted + 1);
    tandem_scene_destroy(scene);
    tandem_asset_release(asset);
  }
  CHECK(succeeded == 1 && refused > 10);
  tandem_asset_release(cube);
}

int main(int argc, char** argv) {
  if (argc != 2) return printf("usage: misuse_test ASSETS_FOLDER\n"), 1;
  tandem_asset* cube = build_obj(argv[1], "box_12.obj", NULL);
  test_nulls(cube);
  test_lists_that_are_not_there(cube);
  test_struct_sizes(cube);
  test_bad_options(cube);
  test_lifetimes(argv[1]);
  test_allocators(argv[1]);
  tandem_asset_release(cube);
  printf("%d failures\n", failures);
  return failures != 0;
}
