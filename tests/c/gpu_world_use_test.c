// Moves bodies on a GPU by the C interface: they come to rest as those of a world on the CPU do, what is
// asked of them, and the same bytes twice. C99. Usage: gpu_world_use_test ASSETS_FOLDER   Exit code 77: there
// is no GPU.
#include <math.h>

#include "gpu_c_test.h"

enum { kBodies = 9 };

static tandem_asset* box;

/// A fixed box, and above it boxes that fall on it and on each other, turned about no axis and off by a bit.
static void place(tandem_instance* bodies, uint8_t* motion) {
  for (int i = 0; i < kBodies; ++i) {
    bodies[i] = at(0.01 * i, 0.02 * i, 1.02 * i);
    motion[i] = i == 0 ? TANDEM_FIXED : TANDEM_MOVING;
  }
}

static tandem_gpu_world* world_of_boxes(const tandem_world_options* options) {
  tandem_instance bodies[kBodies];
  uint8_t motion[kBodies];
  const tandem_pair_filter filter = {.struct_size = sizeof filter, .count = kBodies, .motion = motion};
  tandem_gpu_world* world = NULL;
  place(bodies, motion);
  CHECK_STATUS(tandem_gpu_world_create(options, NULL, &world), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_set_assets(world, &box, 1, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_set_bodies(world, bodies, kBodies, &filter, NULL), TANDEM_OK);
  return world;
}

static const tandem_body_motion* bodies_of(tandem_gpu_world* world) {
  const tandem_body_motion* bodies = NULL;
  size_t count = 0;
  CHECK_STATUS(tandem_gpu_world_bodies(world, &bodies, &count), TANDEM_OK);
  CHECK(count == kBodies && bodies != NULL);
  if (count != kBodies) exit(1);
  return bodies;
}

static tandem_gpu_body_state* copy_states(const tandem_gpu_world* world) {
  size_t count = 0;
  const tandem_gpu_body_state* states = tandem_gpu_world_states(world, &count);
  CHECK(count == kBodies && states != NULL);
  return (tandem_gpu_body_state*)from_gpu(states, kBodies * sizeof *states);
}

// A body that falls freely does as on the CPU.
static void test_a_fall_is_that_of_the_cpu(void) {
  const tandem_instance body = at(0, 0, 5);
  const double velocity[] = {1, 0, 2}, turning[] = {0, 0.5, 1};
  const tandem_body_start start = {
      .struct_size = sizeof start, .count = 1, .velocity = velocity, .angular_velocity = turning};
  tandem_gpu_world* world = NULL;
  tandem_world* expected = NULL;
  CHECK_STATUS(tandem_gpu_world_create(NULL, NULL, &world), TANDEM_OK);
  CHECK_STATUS(tandem_world_create(NULL, NULL, &expected), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_set_assets(world, &box, 1, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_world_set_assets(expected, &box, 1), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_set_bodies(world, &body, 1, NULL, &start), TANDEM_OK);
  CHECK_STATUS(tandem_world_set_bodies(expected, &body, 1, NULL, &start), TANDEM_OK);
  CHECK(tandem_gpu_world_mass(world, 0) == tandem_world_mass(expected, 0));
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 30), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(expected, 1.0 / 60, 30), TANDEM_OK);
  CHECK(tandem_gpu_world_time(world) == tandem_world_time(expected));
  const tandem_body_motion* moved = NULL;
  CHECK_STATUS(tandem_gpu_world_bodies(world, &moved, NULL), TANDEM_OK);
  const tandem_body_motion* theirs = tandem_world_bodies(expected, NULL);
  for (int k = 0; k < 3; ++k) {
    CHECK(fabs(moved->centre[k] - theirs->centre[k]) < 1e-9);
    CHECK(fabs(moved->velocity[k] - theirs->velocity[k]) < 1e-9);
    CHECK(fabs(moved->angular_velocity[k] - theirs->angular_velocity[k]) < 1e-9);
    for (int j = 0; j < 3; ++j) CHECK(fabs(moved->pose.rotation[k][j] - theirs->pose.rotation[k][j]) < 1e-9);
  }
  tandem_gpu_world_destroy(world);
  tandem_world_destroy(expected);
}

static void test_rest(void) {
  tandem_gpu_world* world = world_of_boxes(NULL);
  size_t count = 7;
  const tandem_world_touch *touching = NULL, *began = NULL;
  const tandem_object_pair* ended = (const tandem_object_pair*)&count;
  const tandem_world_contact* contacts = (const tandem_world_contact*)&count;
  CHECK_STATUS(tandem_gpu_world_contacts(world, &contacts, &count), TANDEM_OK);
  CHECK(contacts == NULL && count == 0);
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 20), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_contacts(world, &contacts, &count), TANDEM_OK);
  CHECK(count > 0);
  for (size_t i = 0; i < count; ++i)
    CHECK(contacts[i].a < contacts[i].b && contacts[i].b < kBodies && contacts[i].normal[2] > 0.9);
  CHECK_STATUS(tandem_gpu_world_touching(world, &touching, &count), TANDEM_OK);
  CHECK(count > 0 && touching[0].a == 0 && touching[0].b == 1 && touching[0].impulse > 0);
  CHECK_STATUS(tandem_gpu_world_began(world, &began, &count), TANDEM_OK);
  CHECK(count > 0 && began[0].a == 0 && began[0].b == 1 && began[0].speed > 0.1);
  CHECK_STATUS(tandem_gpu_world_step_more(world, 1.0 / 60, 5), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_began(world, &began, &count), TANDEM_OK);
  CHECK(count > 0 && began[0].a == 0 && began[0].b == 1);
  CHECK_STATUS(tandem_gpu_world_ended(world, &ended, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 0), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_began(world, &began, &count), TANDEM_OK);
  CHECK(began == NULL && count == 0);
  CHECK(tandem_gpu_world_bytes(world) > 10000);
  const tandem_body_motion* bodies = bodies_of(world);
  CHECK(fabs(bodies[1].centre[2] - 1) < 0.02 && bodies[0].centre[2] == 0);
  tandem_gpu_world_destroy(world);
}

static void test_the_same_bytes_twice(void) {
  tandem_gpu_body_state* first = NULL;
  for (int run = 0; run < 2; ++run) {
    tandem_gpu_world* world = world_of_boxes(NULL);
    for (int i = 0; i < 60; ++i) CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 1 + run), TANDEM_OK);
    if (run == 0) CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 60), TANDEM_OK);
    tandem_gpu_body_state* states = copy_states(world);
    if (run == 0) first = states;
    CHECK(memcmp(states, first, kBodies * sizeof *states) == 0);
    if (run == 1) free(states);
    tandem_gpu_world_destroy(world);
  }
  free(first);
}

// What is written to the states moves the bodies.
static void test_states_in_place(void) {
  const tandem_world_options floating = {.struct_size = sizeof floating, .no_gravity = 1};
  tandem_gpu_world* world = world_of_boxes(&floating);
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 60), TANDEM_OK);
  tandem_gpu_body_state* const on_gpu = tandem_gpu_world_states(world, NULL);
  tandem_gpu_body_state* states = copy_states(world);
  const double before = states[8].position[2];
  states[8].velocity[2] = 3;
  cuda_must(cudaMemcpy(on_gpu, states, kBodies * sizeof *states, cudaMemcpyHostToDevice));
  CHECK_STATUS(tandem_gpu_world_wake(world), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 60), TANDEM_OK);
  CHECK(tandem_gpu_world_states(world, NULL) == on_gpu);
  CHECK(fabs(bodies_of(world)[8].centre[2] - before - 3) < 1e-6);
  free(states);
  // A body is pushed, pulled and put elsewhere.
  const double mass = tandem_gpu_world_mass(world, 8);
  const double impulse[] = {0, 0, -3 * mass}, force[] = {0, mass, 0}, none[] = {0, 0, 0};
  tandem_body_motion motion = bodies_of(world)[8];
  CHECK_STATUS(tandem_gpu_world_push(world, 8, impulse, motion.centre), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_set_force(world, 8, force, none), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_step(world, 0.01, 100), TANDEM_OK);
  CHECK(fabs(bodies_of(world)[8].velocity[1] - 1) < 1e-6 && fabs(bodies_of(world)[8].velocity[2]) < 1e-6);
  motion.pose = at(5, 5, 5).pose;
  memset(motion.velocity, 0, sizeof motion.velocity);
  CHECK_STATUS(tandem_gpu_world_set_body(world, 8, &motion), TANDEM_OK);
  CHECK(fabs(bodies_of(world)[8].centre[0] - 5) < 1e-9 && bodies_of(world)[8].velocity[1] == 0);
  tandem_gpu_world_destroy(world);
}

static void test_wrong_calls(void) {
  tandem_gpu_world* world = world_of_boxes(NULL);
  tandem_instance bodies[2] = {at(0, 0, 0), at(0, 0, 2)};
  const double none[] = {0, 0, 0}, much[] = {1e300, 0, 0};
  size_t count = 7;
  tandem_body_motion motion = bodies_of(world)[1];
  CHECK_STATUS(tandem_gpu_world_step(world, 0, 1), TANDEM_BAD_DURATION);
  CHECK_STATUS(tandem_gpu_world_push(world, kBodies, none, none), TANDEM_UNKNOWN_INSTANCE);
  CHECK(tandem_gpu_world_where(world) == kBodies);
  CHECK_STATUS(tandem_gpu_world_push(world, 1, much, none), TANDEM_OUT_OF_RANGE);
  CHECK_STATUS(tandem_gpu_world_push(world, 1, NULL, none), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_set_force(world, 1, much, none), TANDEM_OUT_OF_RANGE);
  motion.pose.rotation[0][0] = 2;
  CHECK_STATUS(tandem_gpu_world_set_body(world, 1, &motion), TANDEM_POSE_NOT_RIGID);
  CHECK(tandem_gpu_world_where(world) == 1);
  CHECK_STATUS(tandem_gpu_world_set_material(world, 1, NAN, 0, 0), TANDEM_OUT_OF_RANGE);
  CHECK_STATUS(tandem_gpu_world_set_gravity_scale(world, kBodies, 1), TANDEM_UNKNOWN_INSTANCE);
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 1), TANDEM_OK);
  CHECK(tandem_gpu_world_where(world) == 0);
  // A body that becomes too fast, in the third step; the steps before are kept.
  const double force[] = {4e9 * tandem_gpu_world_mass(world, 5), 0, 0};
  motion.pose = at(100, 0, 1000).pose;
  CHECK_STATUS(tandem_gpu_world_set_body(world, 5, &motion), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_set_force(world, 5, force, none), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_step(world, 1, 5), TANDEM_OUT_OF_RANGE);
  CHECK(tandem_gpu_world_where(world) == 5);
  CHECK(tandem_gpu_world_time(world) > 1.9 && tandem_gpu_world_time(world) < 2.1);
  // A caller writes what is no number where the steps read it.
  tandem_gpu_body_state* states = copy_states(world);
  states[3].velocity[1] = NAN;
  cuda_must(cudaMemcpy(tandem_gpu_world_states(world, NULL), states, kBodies * sizeof *states,
                       cudaMemcpyHostToDevice));
  free(states);
  CHECK_STATUS(tandem_gpu_world_set_force(world, 5, none, none), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 1), TANDEM_OUT_OF_RANGE);
  CHECK(tandem_gpu_world_where(world) == 3);
  const double density[] = {1000, -1};
  tandem_joint joint = {.kind = TANDEM_BALL, .a = 0, .b = 1};
  tandem_body_start start = {.struct_size = sizeof start, .count = 2, .density = density};
  CHECK_STATUS(tandem_gpu_world_set_bodies(world, bodies, 2, NULL, &start), TANDEM_NO_MASS);
  CHECK(tandem_gpu_world_where(world) == 1);
  CHECK(tandem_gpu_world_states(world, &count) == NULL && count == 0);
  joint.b = 0;
  start = (tandem_body_start){.struct_size = sizeof start, .joints = &joint, .joint_count = 1};
  CHECK_STATUS(tandem_gpu_world_set_bodies(world, bodies, 2, NULL, &start), TANDEM_JOINS_NOTHING);
  bodies[1].asset = 1;
  CHECK_STATUS(tandem_gpu_world_set_bodies(world, bodies, 2, NULL, NULL), TANDEM_UNKNOWN_ASSET);
  CHECK_STATUS(tandem_gpu_world_set_bodies(world, NULL, 0, NULL, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 1), TANDEM_OK);
  tandem_gpu_world_destroy(world);
}

// A box that is shot at another one stays on its side where motion is continuous.
static void test_continuous_motion(void) {
  static const uint8_t motion[] = {TANDEM_FIXED, TANDEM_MOVING};
  static const double speeds[] = {0, 0, 0, 0, 0, -900};
  const tandem_instance bodies[] = {at(0, 0, 0), at(0, 0, 5)};
  const tandem_pair_filter filter = {.struct_size = sizeof filter, .count = 2, .motion = motion};
  const tandem_body_start start = {.struct_size = sizeof start, .count = 2, .velocity = speeds};
  for (uint32_t continuous = 0; continuous < 2; ++continuous) {
    const tandem_world_options options = {.struct_size = sizeof options, .continuous = continuous};
    const tandem_body_motion* moved = NULL;
    tandem_gpu_world* world = NULL;
    CHECK_STATUS(tandem_gpu_world_create(&options, NULL, &world), TANDEM_OK);
    CHECK_STATUS(tandem_gpu_world_set_assets(world, &box, 1, NULL), TANDEM_OK);
    CHECK_STATUS(tandem_gpu_world_set_bodies(world, bodies, 2, &filter, &start), TANDEM_OK);
    CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 60), TANDEM_OK);
    CHECK_STATUS(tandem_gpu_world_bodies(world, &moved, NULL), TANDEM_OK);
    CHECK((moved[1].centre[2] > 0.9) == (continuous == 1));
    tandem_gpu_world_destroy(world);
  }
}

static void test_going_back(void) {
  tandem_gpu_world* world = world_of_boxes(NULL);
  tandem_gpu_world_state* state = NULL;
  tandem_gpu_body_state* first = NULL;
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 30), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_save(world, &state), TANDEM_OK);
  for (int run = 0; run < 2; ++run) {
    CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 60), TANDEM_OK);
    tandem_gpu_body_state* states = copy_states(world);
    if (run == 0) first = states;
    CHECK(memcmp(states, first, kBodies * sizeof *states) == 0);
    if (run == 1) free(states);
    // The floor gets slippery, and a box floats away: the state knows of neither.
    CHECK_STATUS(tandem_gpu_world_set_material(world, 0, 0, 0, -1), TANDEM_OK);
    CHECK_STATUS(tandem_gpu_world_set_gravity_scale(world, 8, -1), TANDEM_OK);
    CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 30), TANDEM_OK);
    CHECK(bodies_of(world)[8].velocity[2] > 2);
    CHECK_STATUS(tandem_gpu_world_restore(world, state), TANDEM_OK);
    CHECK(fabs(tandem_gpu_world_time(world) - 0.5) < 1e-9);
  }
  free(first);
  tandem_gpu_world* other = world_of_boxes(NULL);
  CHECK_STATUS(tandem_gpu_world_restore(other, state), TANDEM_KEPT_MISMATCH);
  CHECK_STATUS(tandem_gpu_world_restore(other, NULL), TANDEM_NULL_ARGUMENT);
  tandem_gpu_world_destroy(other);
  tandem_gpu_world_destroy(world);
  tandem_gpu_world_state_destroy(state);
  CHECK_STATUS(tandem_gpu_world_save(NULL, &state), TANDEM_NULL_ARGUMENT);
  CHECK(state == NULL);
  tandem_gpu_world_state_destroy(NULL);
}

// Bodies that are excluded pass through each other, and a kinematic one keeps its velocity.
static void test_a_filter(void) {
  static const uint8_t motion[] = {TANDEM_KINEMATIC, TANDEM_MOVING};
  static const double speeds[] = {0, 0, 1, 0, 0, 0};
  const tandem_world_options floating = {.struct_size = sizeof floating, .no_gravity = 1};
  const tandem_instance bodies[] = {at(0, 0, 0), at(0, 0, 1.3)};
  const tandem_object_pair pair = {0, 1};
  const tandem_body_start start = {.struct_size = sizeof start, .count = 2, .velocity = speeds};
  tandem_excluded_pairs* excluded = NULL;
  tandem_gpu_world* world = NULL;
  CHECK_STATUS(tandem_excluded_pairs_create(&pair, 1, NULL, &excluded), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_create(&floating, NULL, &world), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_set_assets(world, &box, 1, NULL), TANDEM_OK);
  for (int is_excluded = 0; is_excluded < 2; ++is_excluded) {
    const tandem_pair_filter filter = {.struct_size = sizeof filter,
                                       .count = 2,
                                       .motion = motion,
                                       .excluded = is_excluded ? excluded : NULL};
    const tandem_body_motion* moved = NULL;
    CHECK_STATUS(tandem_gpu_world_set_bodies(world, bodies, 2, &filter, &start), TANDEM_OK);
    CHECK_STATUS(tandem_gpu_world_step(world, 0.01, 100), TANDEM_OK);
    CHECK_STATUS(tandem_gpu_world_bodies(world, &moved, NULL), TANDEM_OK);
    CHECK(fabs(moved[0].centre[2] - 1) < 1e-9);
    CHECK((moved[1].centre[2] == 1.3) == (is_excluded == 1));
  }
  tandem_excluded_pairs_destroy(excluded);
  tandem_gpu_world_destroy(world);
}

static const tandem_world_joint* joints_of(tandem_gpu_world* world, size_t count) {
  const tandem_world_joint* joints = NULL;
  size_t found = 0;
  CHECK_STATUS(tandem_gpu_world_joints(world, &joints, &found), TANDEM_OK);
  CHECK(found == count && joints != NULL);
  if (found != count) exit(1);
  return joints;
}

static size_t broken_of(tandem_gpu_world* world) {
  const uint32_t* broken = NULL;
  size_t count = 0;
  CHECK_STATUS(tandem_gpu_world_broken(world, &broken, &count), TANDEM_OK);
  CHECK(count == 0 || (broken != NULL && broken[0] == 0));
  return count;
}

// A box turns on a hinge by a motor, hangs on it, and tears it off.
static void test_joints(void) {
  const tandem_instance body = at(0, 0, 5);
  const double up[] = {0, 0, 2e6}, none[] = {0, 0, 0};
  tandem_joint joint = {.kind = TANDEM_HINGE,
                        .a = TANDEM_NO_INDEX,
                        .anchor = {0, 0, 5},
                        .axis = {0, 0, 2},
                        .speed = 2,
                        .most_effort = 1e6};
  const tandem_body_start start = {.struct_size = sizeof start, .joints = &joint, .joint_count = 1};
  tandem_gpu_world* world = NULL;
  uint32_t place = 7;
  CHECK_STATUS(tandem_gpu_world_create(NULL, NULL, &world), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_set_assets(world, &box, 1, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_set_bodies(world, &body, 1, NULL, &start), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 60), TANDEM_OK);
  CHECK(fabs(joints_of(world, 1)->speed - 2) < 1e-3 && fabs(joints_of(world, 1)->position - 2) < 0.05);
  CHECK_STATUS(tandem_gpu_world_set_motor(world, 0, -1, 1e6), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 2), TANDEM_OK);
  CHECK(fabs(joints_of(world, 1)->speed + 1) < 1e-2);
  CHECK_STATUS(tandem_gpu_world_remove_joint(world, 0), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_remove_joint(world, 0), TANDEM_BAD_JOINT);
  CHECK_STATUS(tandem_gpu_world_set_motor(world, 0, 1, 1), TANDEM_BAD_JOINT);
  CHECK(joints_of(world, 1)->holds == 0);
  joint.breaking_force = 1e6;
  CHECK_STATUS(tandem_gpu_world_add_joint(world, &joint, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_world_add_joint(world, &joint, &place), TANDEM_OK);
  CHECK(place == 0 && joints_of(world, 1)->holds == 1);
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 30), TANDEM_OK);
  CHECK(joints_of(world, 1)->holds == 1 && broken_of(world) == 0);
  CHECK_STATUS(tandem_gpu_world_set_force(world, 0, up, none), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 2), TANDEM_OK);
  CHECK(joints_of(world, 1)->holds == 0 && broken_of(world) == 1);
  CHECK_STATUS(tandem_gpu_world_step(world, 1.0 / 60, 1), TANDEM_OK);
  CHECK(broken_of(world) == 0);
  joint.kind = 9;
  CHECK_STATUS(tandem_gpu_world_add_joint(world, &joint, &place), TANDEM_BAD_JOINT);
  tandem_gpu_world_destroy(world);
}

int main(int argc, char** argv) {
  if (argc != 2) return printf("usage: gpu_world_use_test ASSETS_FOLDER\n"), 1;
  if (!has_gpu()) return printf("there is no GPU\n"), NO_GPU;
  box = build_obj(argv[1], "box_12.obj", NULL);
  test_a_fall_is_that_of_the_cpu();
  test_rest();
  test_the_same_bytes_twice();
  test_states_in_place();
  test_continuous_motion();
  test_going_back();
  test_a_filter();
  test_joints();
  test_wrong_calls();
  tandem_asset_release(box);
  return failures != 0;
}
