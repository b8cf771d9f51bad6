// What the C interface answers to calls that are wrong. C99. Usage: misuse_test ASSETS_FOLDER
#define _POSIX_C_SOURCE 200112L
#include "c_test.h"

static void* refuse(void* user, size_t bytes, size_t alignment) {
  (void)user;
  (void)bytes;
  (void)alignment;
  return NULL;
}

static void take_back(void* user, void* memory, size_t bytes, size_t alignment) {
  (void)user;
  (void)memory;
  (void)bytes;
  (void)alignment;
  ++failures;  // it gave none
}

// Grants some allocations, then none.
static int grants_left;

static void* grant(void* user, size_t bytes, size_t alignment) {
  void* memory = NULL;
  (void)user;
  if (grants_left-- <= 0) return NULL;
  return posix_memalign(&memory, alignment, bytes) == 0 ? memory : NULL;
}

static void give_back(void* user, void* memory, size_t bytes, size_t alignment) {
  (void)user;
  (void)bytes;
  (void)alignment;
  free(memory);
}

static void test_null_handles(tandem_asset* cube) {
  tandem_instance body = at(0, 0, 0);
  size_t count = 7;
  tandem_contact_query* query = NULL;
  CHECK_STATUS(tandem_contact_query_create(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_contact_query_set_assets(NULL, &cube, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_contact_query_find_contacts(NULL, &body, 1, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_contact_query_find_contacts_of_pairs(NULL, &body, 1, NULL, 0, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_contact_query_make_manifolds(NULL, &body, 1, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_contact_query_find_contained(NULL, &body, 1, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_contact_query_keep_fixed(NULL, &body, NULL, 0, 1), TANDEM_NULL_ARGUMENT);
  CHECK(tandem_contact_query_contacts(NULL, &count) == NULL && count == 0);
  CHECK(tandem_contact_query_pairs(NULL, NULL) == NULL && tandem_contact_query_where(NULL) == 0);
  CHECK(tandem_contact_query_manifolds(NULL, &count) == NULL && tandem_contact_query_points(NULL, NULL) == NULL);
  CHECK(tandem_contact_query_contained(NULL, &count) == NULL);
  CHECK_STATUS(tandem_distance_query_find(NULL, &body, 1, NULL), TANDEM_NULL_ARGUMENT);
  CHECK(tandem_distance_query_distances(NULL, &count) == NULL && count == 0);
  CHECK_STATUS(tandem_impact_query_find(NULL, &body, NULL, 0, 1, NULL), TANDEM_NULL_ARGUMENT);
  CHECK(tandem_impact_query_impacts(NULL, &count) == NULL);
  CHECK_STATUS(tandem_tolerance_query_decide(NULL, &body, 1, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_asset_get_info(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_asset_get_info(cube, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_asset_open(NULL, NULL, NULL, &cube, NULL), TANDEM_NULL_ARGUMENT);
  CHECK(cube == NULL && tandem_asset_data(NULL, &count) == NULL && count == 0);
  CHECK_STATUS(tandem_asset_build(NULL, NULL, NULL, &cube, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_pose_at(NULL, NULL, 0, NULL), TANDEM_NULL_ARGUMENT);
  tandem_asset_retain(NULL);
  tandem_asset_release(NULL);
  tandem_contact_query_destroy(NULL);
  tandem_distance_query_destroy(NULL);
  tandem_impact_query_destroy(NULL);
  tandem_tolerance_query_destroy(NULL);
  tandem_excluded_pairs_destroy(NULL);

  // Lists that are not there.
  CHECK_STATUS(tandem_contact_query_create(NULL, &query), TANDEM_OK);
  tandem_asset* holes[2] = {cube, NULL};
  CHECK_STATUS(tandem_contact_query_set_assets(query, holes, 2), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_contact_query_set_assets(query, NULL, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_contact_query_set_assets(query, NULL, 0), TANDEM_OK);
  CHECK_STATUS(tandem_contact_query_find_contacts(query, NULL, 1, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_contact_query_find_contacts(query, NULL, 0, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_contact_query_find_contacts_of_pairs(query, NULL, 0, NULL, 3, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_contact_query_find_contacts(query, &body, 1, NULL), TANDEM_UNKNOWN_ASSET);
  CHECK(tandem_contact_query_where(query) == 0);
  tandem_contact_query_destroy(query);
}

static void test_struct_sizes(tandem_asset* cube) {
  tandem_contact_query* query = NULL;
  CHECK_STATUS(tandem_contact_query_create(NULL, &query), TANDEM_OK);
  CHECK_STATUS(tandem_contact_query_set_assets(query, &cube, 1), TANDEM_OK);
  const tandem_instance bodies[2] = {at(0, 0, 0), at(0.5, 0, 0)};
  // Options of a later version: what this one does not know is zero, or is refused.
  struct {
    tandem_query_options options;
    uint64_t later[2];
  } grown;
  memset(&grown, 0, sizeof grown);
  grown.options.struct_size = sizeof grown;
  size_t count = 0;
  CHECK_STATUS(tandem_contact_query_find_contacts(query, bodies, 2, &grown.options), TANDEM_OK);
  (void)tandem_contact_query_contacts(query, &count);
  CHECK(count > 0);
  grown.later[1] = 1;
  CHECK_STATUS(tandem_contact_query_find_contacts(query, bodies, 2, &grown.options), TANDEM_BAD_STRUCT_SIZE);
  // After an error there are no results.
  CHECK(tandem_contact_query_contacts(query, &count) == NULL && count == 0);
  CHECK(tandem_contact_query_pairs(query, &count) == NULL && count == 0);
  const uint32_t wrong[] = {0, 4, sizeof(tandem_query_options) - 1, 1u << 20, 0xCDCDCDCDu};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
    grown.options.struct_size = wrong[i];
    CHECK_STATUS(tandem_contact_query_find_contacts(query, bodies, 2, &grown.options), TANDEM_BAD_STRUCT_SIZE);
  }
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
  tandem_query_counters counters;
  counters.struct_size = 0;
  CHECK_STATUS(tandem_contact_query_get_counters(query, &counters), TANDEM_BAD_STRUCT_SIZE);

  // Choices that there are not.
  tandem_query_options options = {sizeof options, 3, 0, 0, 1, 0, 0, NULL};
  CHECK_STATUS(tandem_contact_query_find_contacts(query, bodies, 2, &options), TANDEM_BAD_OPTION);
  options.mode = TANDEM_EXACT;
  options.self_pairs = 2;
  CHECK_STATUS(tandem_contact_query_find_contacts(query, bodies, 2, &options), TANDEM_BAD_OPTION);
  options.self_pairs = 0;
  options.within = -1;
  CHECK_STATUS(tandem_contact_query_find_contacts(query, bodies, 2, &options), TANDEM_OUT_OF_RANGE);
  options.within = 0;
  tandem_pair_filter filter;
  const uint8_t motion[2] = {TANDEM_MOVING, 4};
  memset(&filter, 0, sizeof filter);
  options.filter = &filter;
  CHECK_STATUS(tandem_contact_query_find_contacts(query, bodies, 2, &options), TANDEM_BAD_STRUCT_SIZE);
  filter.struct_size = sizeof filter;
  CHECK_STATUS(tandem_contact_query_find_contacts(query, bodies, 2, &options), TANDEM_OK);
  filter.motion = motion;
  CHECK_STATUS(tandem_contact_query_find_contacts(query, bodies, 2, &options), TANDEM_FILTER_MISMATCH);
  filter.count = 2;
  CHECK_STATUS(tandem_contact_query_find_contacts(query, bodies, 2, &options), TANDEM_BAD_OPTION);
  CHECK(tandem_contact_query_where(query) == 1);
  CHECK_STATUS(tandem_contact_query_keep_fixed(query, bodies, motion, 2, 1), TANDEM_BAD_OPTION);
  tandem_open_options opening = {sizeof opening, 2, 0, 0};
  tandem_asset* asset = NULL;
  CHECK_STATUS(tandem_asset_open("x", &opening, NULL, &asset, NULL), TANDEM_BAD_OPTION);

  // Results name the instance, and the pair, to blame.
  tandem_instance bent[2] = {bodies[0], bodies[1]};
  bent[1].pose.rotation[0][0] = 1.1;
  CHECK_STATUS(tandem_contact_query_find_contacts(query, bent, 2, NULL), TANDEM_POSE_NOT_RIGID);
  CHECK(tandem_contact_query_where(query) == 1);
  const tandem_object_pair pairs[3] = {{0, 1}, {0, 1}, {0, 2}};
  CHECK_STATUS(tandem_contact_query_find_contacts_of_pairs(query, bodies, 2, pairs, 3, NULL), TANDEM_UNKNOWN_INSTANCE);
  CHECK(tandem_contact_query_where(query) == 2);
  CHECK_STATUS(tandem_contact_query_find_contacts(query, bodies, 2, NULL), TANDEM_OK);
  CHECK(tandem_contact_query_where(query) == 0);
  CHECK_STATUS(tandem_contact_query_find_contained(query, bodies, 1, 1), TANDEM_UNKNOWN_INSTANCE);
  tandem_contact_query_destroy(query);
}

// The asset goes before the query, and the query before its results are looked at no more.
static void test_lifetimes(const char* folder) {
  tandem_asset* cube = build_obj(folder, "box_12.obj", NULL);
  tandem_asset* shown = NULL;
  CHECK_STATUS(tandem_asset_levels_from(cube, 0, 0, &shown), TANDEM_OK);
  tandem_asset* none = NULL;
  CHECK_STATUS(tandem_asset_levels_from(cube, 1, 0, &none), TANDEM_UNKNOWN_LEVEL);
  tandem_asset* list[3] = {cube, shown, cube};
  tandem_contact_query* query = NULL;
  CHECK_STATUS(tandem_contact_query_create(NULL, &query), TANDEM_OK);
  CHECK_STATUS(tandem_contact_query_set_assets(query, list, 3), TANDEM_OK);
  tandem_asset_release(cube);
  tandem_asset_release(shown);
  tandem_instance bodies[3] = {at(0, 0, 0), at(0.9, 0, 0), at(1.8, 0, 0)};
  bodies[1].asset = 1;
  bodies[2].asset = 2;
  size_t count = 0;
  CHECK_STATUS(tandem_contact_query_find_contacts(query, bodies, 3, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_contact_query_make_manifolds(query, bodies, 3, NULL), TANDEM_OK);
  (void)tandem_contact_query_manifolds(query, &count);
  CHECK(count == 2);
  // Its own assets again, and none: results are gone.
  CHECK_STATUS(tandem_contact_query_set_assets(query, NULL, 0), TANDEM_OK);
  CHECK(tandem_contact_query_manifolds(query, &count) == NULL && count == 0);
  CHECK_STATUS(tandem_contact_query_find_contacts(query, bodies, 3, NULL), TANDEM_UNKNOWN_ASSET);
  tandem_contact_query_destroy(query);
}

static void test_allocators(const char* folder) {
  tandem_allocator allocator = {sizeof allocator, 0, NULL, refuse, take_back};
  tandem_contact_query* query = NULL;
  tandem_distance_query* distances = NULL;
  tandem_excluded_pairs* excluded = NULL;
  CHECK_STATUS(tandem_contact_query_create(&allocator, &query), TANDEM_OUT_OF_MEMORY);
  CHECK_STATUS(tandem_distance_query_create(&allocator, &distances), TANDEM_OUT_OF_MEMORY);
  CHECK_STATUS(tandem_excluded_pairs_create(NULL, 0, &allocator, &excluded), TANDEM_OUT_OF_MEMORY);
  CHECK(query == NULL && distances == NULL && excluded == NULL);
  allocator.deallocate = NULL;
  CHECK_STATUS(tandem_contact_query_create(&allocator, &query), TANDEM_NULL_ARGUMENT);
  allocator.struct_size = 8;
  CHECK_STATUS(tandem_contact_query_create(&allocator, &query), TANDEM_BAD_STRUCT_SIZE);

  // However many allocations are granted, a call succeeds or says that memory is out, and nothing is lost.
  const tandem_allocator granting = {sizeof granting, 0, NULL, grant, give_back};
  tandem_asset* cube = build_obj(folder, "box_12.obj", NULL);
  size_t bytes = 0;
  const void* data = tandem_asset_data(cube, &bytes);
  const tandem_instance bodies[2] = {at(0, 0, 0), at(0.5, 0, 0)};
  const tandem_query_options options = {sizeof options, TANDEM_EXACT, 0, 0, 2, 0, 0, NULL};
  int succeeded = 0, refused = 0;
  for (int granted = 0; granted < 100 && succeeded == 0; ++granted) {
    grants_left = granted;
    tandem_asset* asset = NULL;
    tandem_status status = tandem_asset_from_memory(data, bytes, NULL, &granting, &asset, NULL);
    query = NULL;
    if (status == TANDEM_OK) status = tandem_contact_query_create(&granting, &query);
    if (status == TANDEM_OK) status = tandem_contact_query_set_assets(query, &asset, 1);
    if (status == TANDEM_OK) status = tandem_contact_query_find_contacts(query, bodies, 2, &options);
    if (status == TANDEM_OK) status = tandem_contact_query_make_manifolds(query, bodies, 2, NULL);
    if (status == TANDEM_OK) status = tandem_contact_query_find_contained(query, bodies, 2, 1);
    succeeded += status == TANDEM_OK;
    refused += status == TANDEM_OUT_OF_MEMORY || status == TANDEM_CANNOT_START_THREAD;
    CHECK(succeeded + refused == granted + 1);
    tandem_contact_query_destroy(query);
    tandem_asset_release(asset);
  }
  CHECK(succeeded == 1 && refused > 10);
  tandem_asset_release(cube);
}

int main(int argc, char** argv) {
  if (argc != 2) return printf("usage: misuse_test ASSETS_FOLDER\n"), 1;
  tandem_asset* cube = build_obj(argv[1], "box_12.obj", NULL);
  test_null_handles(cube);
  test_struct_sizes(cube);
  test_lifetimes(argv[1]);
  test_allocators(argv[1]);
  tandem_asset_release(cube);
  printf("%d failures\n", failures);
  return failures != 0;
}
