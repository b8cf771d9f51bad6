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

static void check_options(tandem_world_options options, tandem_status expected) {
  tandem_gpu_world* world = NULL;
  if (options.struct_size == 0) options.struct_size = sizeof options;
  CHECK_STATUS(tandem_gpu_world_create(&options, NULL, &world), expected);
  CHECK((world == NULL) == (expected != TANDEM_OK));
  tandem_gpu_world_destroy(world);
}

// A world needs a GPU once it is given assets, and not before.
static void test_a_world(tandem_asset* cube) {
  typedef tandem_world_options Options;
  tandem_gpu_world* world = NULL;
  tandem_allocator none = {sizeof none, 0, NULL, refuse, take_back};
  CHECK_STATUS(tandem_gpu_world_create(NULL, NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_create(NULL, &none, &world), TANDEM_OUT_OF_MEMORY);
  check_options((Options){.no_friction = 1, .substeps = 10000, .threads = 1024}, TANDEM_OK);
  check_options((Options){.struct_size = 8}, TANDEM_BAD_STRUCT_SIZE);
  check_options((Options){.continuous = 1}, TANDEM_OK);
  check_options((Options){.substeps = 10001}, TANDEM_BAD_OPTION);
  check_options((Options){.threads = 1025}, TANDEM_BAD_OPTION);
  check_options((Options){.friction = -1}, TANDEM_BAD_OPTION);

  CHECK_STATUS(tandem_gpu_world_create(NULL, NULL, &world), TANDEM_OK);
  tandem_asset* const list[2] = {cube, NULL};
  CHECK_STATUS(tandem_gpu_world_set_assets(world, NULL, 1, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_set_assets(world, list, 2, NULL), TANDEM_NULL_ARGUMENT);
  CHECK(tandem_gpu_world_where(world) == 1);
  CHECK_STATUS(tandem_gpu_world_set_assets(world, list, 1, NULL), TANDEM_NO_GPU);
  CHECK(tandem_gpu_world_where(world) == 0 && tandem_cuda_error() != 0);
  const tandem_instance body = at(0, 0, 0);
  tandem_joint joint = {.kind = 9};
  tandem_body_start start = {.struct_size = sizeof start, .joints = &joint, .joint_count = 1};
  CHECK_STATUS(tandem_gpu_world_set_bodies(world, &body, 1, NULL, NULL), TANDEM_UNKNOWN_ASSET);
  CHECK_STATUS(tandem_gpu_world_set_bodies(world, NULL, 1, NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_set_bodies(world, &body, 1, NULL, &start), TANDEM_BAD_JOINT);
  joint.kind = TANDEM_BALL;
  CHECK_STATUS(tandem_gpu_world_set_bodies(world, &body, 1, NULL, &start), TANDEM_UNKNOWN_ASSET);

  const tandem_body_motion* bodies = (const tandem_body_motion*)&body;
  const tandem_world_contact* contacts = NULL;
  const tandem_world_touch* touching = NULL;
  const tandem_object_pair* ended = NULL;
  const tandem_world_joint* joints = NULL;
  const uint32_t* broken = NULL;
  uint32_t place = 0;
  tandem_gpu_world_state* state = NULL;
  const double vector[] = {0, 0, 0};
  const tandem_body_motion motion = {.pose = body.pose};
  size_t count = 7;
  CHECK_STATUS(tandem_gpu_world_bodies(world, &bodies, &count), TANDEM_OK);
  CHECK(bodies == NULL && count == 0);
  CHECK_STATUS(tandem_gpu_world_bodies(world, NULL, &count), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_contacts(world, &contacts, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_touching(world, &touching, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_began(world, &touching, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_ended(world, &ended, NULL), TANDEM_OK);
  CHECK(touching == NULL && ended == NULL);
  CHECK_STATUS(tandem_gpu_world_joints(world, &joints, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_broken(world, &broken, NULL), TANDEM_OK);
  CHECK(joints == NULL && broken == NULL);
  CHECK_STATUS(tandem_gpu_world_add_joint(world, &joint, &place), TANDEM_UNKNOWN_INSTANCE);
  CHECK_STATUS(tandem_gpu_world_add_joint(world, NULL, &place), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_remove_joint(world, 0), TANDEM_BAD_JOINT);
  CHECK_STATUS(tandem_gpu_world_set_motor(world, 4, 1, 1), TANDEM_BAD_JOINT);
  CHECK(tandem_gpu_world_where(world) == 4);
  count = 7;
  CHECK(tandem_gpu_world_states(world, &count) == NULL && count == 0);
  CHECK_STATUS(tandem_gpu_world_step(world, 0, 1), TANDEM_BAD_DURATION);
  CHECK_STATUS(tandem_gpu_world_step(world, 1, 1), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_step_more(world, 0, 1), TANDEM_BAD_DURATION);
  CHECK_STATUS(tandem_gpu_world_step_more(world, 1, 1), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_save(world, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_save(world, &state), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_restore(world, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_restore(world, state), TANDEM_OK);
  tandem_gpu_world_state_destroy(state);
  CHECK_STATUS(tandem_gpu_world_set_material(world, 2, 0, 0, 0), TANDEM_UNKNOWN_INSTANCE);
  CHECK_STATUS(tandem_gpu_world_set_gravity_scale(world, 2, 0), TANDEM_UNKNOWN_INSTANCE);
  CHECK_STATUS(tandem_gpu_world_wake(world), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_push(world, 3, vector, vector), TANDEM_UNKNOWN_INSTANCE);
  CHECK(tandem_gpu_world_where(world) == 3);
  CHECK_STATUS(tandem_gpu_world_push(world, 0, NULL, vector), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_set_force(world, 0, vector, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_set_body(world, 0, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_set_body(world, 0, &motion), TANDEM_UNKNOWN_INSTANCE);
  CHECK(tandem_gpu_world_time(world) == 0 && tandem_gpu_world_mass(world, 0) == 0);
  tandem_gpu_world_destroy(world);

  CHECK_STATUS(tandem_gpu_world_set_assets(NULL, list, 1, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_set_bodies(NULL, &body, 1, NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_step(NULL, 1, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_step_more(NULL, 1, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_restore(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_add_joint(NULL, &joint, &place), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_remove_joint(NULL, 0), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_set_motor(NULL, 0, 1, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_bodies(NULL, &bodies, &count), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_wake(NULL), TANDEM_NULL_ARGUMENT);
  CHECK(tandem_gpu_world_states(NULL, &count) == NULL && count == 0);
  CHECK(tandem_gpu_world_time(NULL) == 0 && tandem_gpu_world_mass(NULL, 0) == 0 &&
        tandem_gpu_world_where(NULL) == 0 && tandem_gpu_world_bytes(NULL) == 0);
  tandem_gpu_world_destroy(NULL);
}

int main(int argc, char** argv) {
  if (argc != 2) return printf("usage: gpu_misuse_test ASSETS_FOLDER\n"), 1;
  tandem_asset* cube = build_obj(argv[1], "box_12.obj", NULL);
  test_an_upload(cube);
  test_deforming();
  test_handles();
  test_a_world(cube);
  tandem_asset_release(cube);
  return failures != 0;
}
