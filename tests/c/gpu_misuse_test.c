// Tests what the C interface to a GPU answers to calls that are wrong, and where there is no GPU. Run it with
// CUDA_VISIBLE_DEVICES set to nothing. C99. Usage: gpu_misuse_test ASSETS_FOLDER
#include <tandem/tandem_cuda.h>

#include "c_test.h"

static void test_an_upload(tandem_asset* cube) {
  tandem_asset* const list[2] = {cube, NULL};
  tandem_upload_options options = {sizeof options, TANDEM_CONTENTS_ALL};
  tandem_gpu_assets* assets = (tandem_gpu_assets*)cube;
  uint64_t where = 7;
  CHECK(tandem_cuda_error() == 0);
  CHECK_STATUS(tandem_gpu_assets_upload(&cube, 1, NULL, NULL, NULL, NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_assets_upload(NULL, 1, NULL, NULL, NULL, &assets, &where), TANDEM_NULL_ARGUMENT);
  CHECK(assets == NULL && where == 0);
  CHECK_STATUS(tandem_gpu_assets_upload(list, 2, NULL, NULL, NULL, &assets, &where), TANDEM_NULL_ARGUMENT);
  CHECK(where == 1);
  options.contents = 3;
  CHECK_STATUS(tandem_gpu_assets_upload(&cube, 1, &options, NULL, NULL, &assets, NULL), TANDEM_BAD_OPTION);
  options.struct_size = 3;
  CHECK_STATUS(tandem_gpu_assets_upload(&cube, 1, &options, NULL, NULL, &assets, NULL),
               TANDEM_BAD_STRUCT_SIZE);
  tandem_allocator none = {sizeof none, 0, NULL, refuse, take_back};
  CHECK_STATUS(tandem_gpu_assets_upload(&cube, 1, NULL, NULL, &none, &assets, NULL), TANDEM_OUT_OF_MEMORY);
  CHECK(tandem_cuda_error() == 0);
  CHECK_STATUS(tandem_gpu_assets_upload(&cube, 1, NULL, NULL, NULL, &assets, &where), TANDEM_NO_GPU);
  CHECK(assets == NULL && where == 0 && tandem_cuda_error() != 0);
  tandem_gpu_assets_retain(NULL);
  tandem_gpu_assets_release(NULL);
  CHECK(tandem_gpu_assets_count(NULL) == 0 && tandem_gpu_assets_bytes(NULL) == 0);
  tandem_gpu_excluded_pairs* excluded = NULL;
  const tandem_object_pair pair = {0, 1}, unknown = {0, TANDEM_NO_INDEX};
  CHECK_STATUS(tandem_gpu_excluded_pairs_create(&pair, 1, NULL, NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_excluded_pairs_create(NULL, 1, NULL, NULL, &excluded), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_excluded_pairs_create(&unknown, 1, NULL, NULL, &excluded), TANDEM_UNKNOWN_INSTANCE);
  CHECK_STATUS(tandem_gpu_excluded_pairs_create(&pair, 1, NULL, NULL, &excluded), TANDEM_NO_GPU);
  CHECK(excluded == NULL);
  tandem_gpu_excluded_pairs_destroy(NULL);
}

// Functions of assets that deform refuse what is wrong before they look at a GPU.
static void test_deforming(void) {
  tandem_gpu_assets* made = (tandem_gpu_assets*)&made;
  tandem_gpu_deform_report report = {TANDEM_INTERNAL_ERROR, 7, 7};
  uint64_t where = 7;
  const uint32_t first = 0;
  CHECK_STATUS(tandem_gpu_assets_create_deforming(NULL, &first, 1, 0, NULL, NULL, NULL, NULL),
               TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_assets_create_deforming(NULL, &first, 1, 0, NULL, NULL, &made, &where),
               TANDEM_NULL_ARGUMENT);
  CHECK(made == NULL && where == 0 && tandem_gpu_assets_deforming_count(NULL) == 0);
  CHECK_STATUS(tandem_gpu_assets_enqueue_deform(NULL, NULL, NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_assets_deform(NULL, NULL, NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_assets_get_report(NULL, &report), TANDEM_NULL_ARGUMENT);
  CHECK(report.status == TANDEM_OK && report.body == 0 && report.where == 0);
  CHECK(tandem_gpu_assets_device_report(NULL) == NULL);
}

static const tandem_gpu_instances bodies = {NULL, NULL, 0, 0};
static const tandem_gpu_pairs pairs = {NULL, NULL, 0, 0};

// Tests a kind of query without a handle, without an allocator that gives, and without assets.
#define TEST_HANDLE(kind, use, room, result)                                  \
  do {                                                                        \
    kind* handle = NULL;                                                      \
    kind##_capacity_t capacity;                                               \
    tandem_allocator half = {sizeof half, 0, NULL, refuse, NULL};             \
    tandem_allocator none = {sizeof none, 0, NULL, refuse, take_back};        \
    memset(&capacity, 0, sizeof capacity);                                    \
    CHECK_STATUS(kind##_create(NULL, NULL), TANDEM_NULL_ARGUMENT);            \
    CHECK_STATUS(kind##_create(&half, &handle), TANDEM_NULL_ARGUMENT);        \
    CHECK_STATUS(kind##_create(&none, &handle), TANDEM_OUT_OF_MEMORY);        \
    CHECK(handle == NULL && result == NULL);                                  \
    CHECK_STATUS(use, TANDEM_NULL_ARGUMENT);                                  \
    CHECK_STATUS(room, TANDEM_NULL_ARGUMENT);                                 \
    CHECK_STATUS(kind##_get_report(handle, NULL), TANDEM_NULL_ARGUMENT);      \
    CHECK(kind##_device_report(handle) == NULL && kind##_bytes(handle) == 0); \
    CHECK_STATUS(kind##_create(NULL, &handle), TANDEM_OK);                    \
    CHECK(handle != NULL && result == NULL);                                  \
    CHECK_STATUS(use, TANDEM_ASSETS_MISSING);                                 \
    CHECK_STATUS(room, TANDEM_ASSETS_MISSING);                                \
    CHECK_STATUS(kind##_get_report(handle, NULL), TANDEM_ASSETS_MISSING);     \
    CHECK(kind##_device_report(handle) == NULL && kind##_bytes(handle) == 0); \
    kind##_destroy(handle);                                                   \
    kind##_destroy(NULL);                                                     \
  } while (0)

typedef tandem_gpu_broad_phase_capacity tandem_gpu_broad_phase_capacity_t;
typedef tandem_gpu_query_capacity tandem_gpu_contact_query_capacity_t;
typedef tandem_gpu_manifold_capacity tandem_gpu_manifolds_capacity_t;
typedef tandem_gpu_containment_capacity tandem_gpu_containment_query_capacity_t;
typedef tandem_gpu_distance_capacity tandem_gpu_distance_query_capacity_t;
typedef tandem_gpu_impact_capacity tandem_gpu_impact_query_capacity_t;
typedef tandem_gpu_tolerance_capacity tandem_gpu_tolerance_query_capacity_t;
typedef tandem_gpu_probe_capacity tandem_gpu_probe_query_capacity_t;

static void test_handles(void) {
  tandem_gpu_contact_query* query = NULL;
  CHECK_STATUS(tandem_gpu_contact_query_create(NULL, &query), TANDEM_OK);
  TEST_HANDLE(tandem_gpu_broad_phase, tandem_gpu_broad_phase_find(handle, &bodies, NULL, NULL),
              tandem_gpu_broad_phase_reserve(handle, &capacity, NULL),
              tandem_gpu_broad_phase_pairs(handle).pairs);
  TEST_HANDLE(tandem_gpu_broad_phase, tandem_gpu_broad_phase_enqueue(handle, &bodies, NULL, NULL),
              tandem_gpu_broad_phase_keep_fixed(handle, &bodies, NULL, NULL, NULL),
              tandem_gpu_broad_phase_pairs(handle).count);
  TEST_HANDLE(tandem_gpu_contact_query, tandem_gpu_contact_query_find(handle, &bodies, &pairs, NULL, NULL),
              tandem_gpu_contact_query_reserve(handle, &capacity, NULL),
              tandem_gpu_contact_query_contacts(handle));
  TEST_HANDLE(tandem_gpu_contact_query, tandem_gpu_contact_query_enqueue(handle, &bodies, &pairs, NULL, NULL),
              tandem_gpu_contact_query_reserve(handle, NULL, NULL),
              tandem_gpu_contact_query_groups(handle).first_contact);
  CHECK(tandem_gpu_contact_query_met(query) == NULL);
  TEST_HANDLE(tandem_gpu_manifolds, tandem_gpu_manifolds_find(handle, &bodies, &pairs, query, NULL, NULL),
              tandem_gpu_manifolds_reserve(handle, &capacity), tandem_gpu_manifolds_manifolds(handle));
  TEST_HANDLE(tandem_gpu_manifolds, tandem_gpu_manifolds_enqueue(handle, &bodies, &pairs, query, NULL, NULL),
              tandem_gpu_manifolds_reserve(handle, &capacity), tandem_gpu_manifolds_points(handle));
  TEST_HANDLE(tandem_gpu_containment_query,
              tandem_gpu_containment_query_find(handle, &bodies, &pairs, query, NULL),
              tandem_gpu_containment_query_reserve(handle, &capacity),
              tandem_gpu_containment_query_contained(handle));
  TEST_HANDLE(tandem_gpu_distance_query, tandem_gpu_distance_query_find(handle, &bodies, &pairs, NULL, NULL),
              tandem_gpu_distance_query_reserve(handle, &capacity),
              tandem_gpu_distance_query_distances(handle));
  TEST_HANDLE(
      tandem_gpu_impact_query, tandem_gpu_impact_query_find(handle, &bodies, NULL, 1, NULL, NULL, NULL),
      tandem_gpu_impact_query_reserve(handle, &capacity, NULL), tandem_gpu_impact_query_impacts(handle));
  TEST_HANDLE(tandem_gpu_tolerance_query, tandem_gpu_tolerance_query_find(handle, &bodies, &pairs, 0, NULL),
              tandem_gpu_tolerance_query_reserve(handle, &capacity),
              tandem_gpu_tolerance_query_verdicts(handle));
  TEST_HANDLE(tandem_gpu_probe_query, tandem_gpu_probe_query_find_closest(handle, &bodies, NULL, NULL),
              tandem_gpu_probe_query_reserve(handle, &capacity), tandem_gpu_probe_query_closest(handle));
  TEST_HANDLE(tandem_gpu_probe_query, tandem_gpu_probe_query_enqueue_closest(handle, &bodies, NULL, NULL),
              tandem_gpu_probe_query_reserve(handle, &capacity), tandem_gpu_probe_query_closest(handle));
  TEST_HANDLE(tandem_gpu_probe_query, tandem_gpu_probe_query_find_rays(handle, &bodies, NULL, NULL),
              tandem_gpu_probe_query_reserve(handle, &capacity), tandem_gpu_probe_query_rays(handle));
  TEST_HANDLE(tandem_gpu_probe_query, tandem_gpu_probe_query_enqueue_rays(handle, &bodies, NULL, NULL),
              tandem_gpu_probe_query_reserve(handle, &capacity), tandem_gpu_probe_query_rays(handle));
  CHECK_STATUS(tandem_gpu_contact_query_set_assets(query, NULL, NULL), TANDEM_NULL_ARGUMENT);
  tandem_gpu_contact_query_destroy(query);
}

int main(int argc, char** argv) {
  if (argc != 2) return printf("usage: gpu_misuse_test ASSETS_FOLDER\n"), 1;
  tandem_asset* cube = build_obj(argv[1], "box_12.obj", NULL);
  test_an_upload(cube);
  test_deforming();
  test_handles();
  tandem_asset_release(cube);
  return failures != 0;
}
