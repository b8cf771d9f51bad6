// Tests worlds in C: bodies come to rest, wrong calls get their statuses, and threads change no byte. C99.
// Usage: world_use_test ASSETS_FOLDER
#include <math.h>

#include "c_test.h"

static tandem_asset* box;

/// A world of boxes of unit length about 0.
static tandem_world* world_of(const tandem_world_options* options) {
  tandem_world* world = NULL;
  CHECK_STATUS(tandem_world_create(options, NULL, &world), TANDEM_OK);
  CHECK_STATUS(tandem_world_set_assets(world, &box, 1), TANDEM_OK);
  return world;
}

static const tandem_body_motion* body_of(const tandem_world* world, size_t body) {
  size_t count = 0;
  const tandem_body_motion* bodies = tandem_world_bodies(world, &count);
  CHECK(body < count);
  if (body >= count) exit(1);
  return &bodies[body];
}

/// Body 0 is fixed, body 1 lies above it, off by a quarter, and so high.
static void place_two(tandem_world* world, double gap) {
  static const uint8_t motion[] = {TANDEM_FIXED, TANDEM_MOVING};
  const tandem_instance bodies[] = {at(0, 0, 0), at(0.25, 0.1, 1 + gap)};
  tandem_pair_filter filter = {.struct_size = sizeof filter, .count = 2, .motion = motion};
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, &filter, NULL), TANDEM_OK);
}

static void test_rest(void) {
  tandem_world* world = world_of(NULL);
  place_two(world, 0.5);
  CHECK(tandem_world_mass(world, 0) == 0 && fabs(tandem_world_mass(world, 1) - 1000) < 1e-3);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 120), TANDEM_OK);
  CHECK(fabs(tandem_world_time(world) - 2) < 1e-9);
  const tandem_body_motion* body = body_of(world, 1);
  CHECK(fabs(body->pose.translation[2] - 1) < 1e-3 && fabs(body->pose.translation[0] - 0.25) < 1e-3);
  CHECK(fabs(body->centre[2] - 1) < 1e-3 && body->sleeps == 1 && body_of(world, 0)->sleeps == 0);
  // What holds it up in a step is its weight.
  double held = 0;
  size_t count = 0;
  place_two(world, 0);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 10), TANDEM_OK);
  const tandem_world_contact* contacts = tandem_world_contacts(world, &count);
  for (size_t i = 0; i < count; ++i) {
    CHECK(contacts[i].a == 0 && contacts[i].b == 1 && contacts[i].normal[2] > 0.99);
    held += contacts[i].impulse[2];
  }
  CHECK(count >= 3 && fabs(held - 1000 * 9.81 / 60) < 1);
  // It is pushed off, and put back.
  const double impulse[] = {3000, 0, 0}, point[] = {0.25, 0.1, 1};
  CHECK_STATUS(tandem_world_push(world, 1, impulse, point), TANDEM_OK);
  CHECK_STATUS(tandem_world_push(world, 0, impulse, point), TANDEM_OK);
  CHECK(fabs(body_of(world, 1)->velocity[0] - 3) < 0.01 && body_of(world, 0)->velocity[0] == 0);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 60), TANDEM_OK);
  CHECK(body_of(world, 1)->pose.translation[2] < 0.5);
  tandem_body_motion back = *body_of(world, 1);
  back.pose = at(0.25, 0.1, 1).pose;
  memset(back.velocity, 0, sizeof back.velocity);
  memset(back.angular_velocity, 0, sizeof back.angular_velocity);
  CHECK_STATUS(tandem_world_set_body(world, 1, &back), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 60), TANDEM_OK);
  CHECK(fabs(body_of(world, 1)->pose.translation[2] - 1) < 1e-3);
  tandem_world_destroy(world);
}

static void test_options_start_and_filter(void) {
  // Without gravity and at a speed; half as heavy.
  tandem_world_options options = {.struct_size = sizeof options, .no_gravity = 1, .no_sleeping = 1};
  const double density[] = {500}, velocity[] = {0, 0, 2}, turning[] = {0, 0, 1};
  tandem_body_start start = {.struct_size = sizeof start,
                             .count = 1,
                             .density = density,
                             .velocity = velocity,
                             .angular_velocity = turning};
  const tandem_instance bodies[] = {at(0, 0, 0), at(0, 0, 0.9)};
  tandem_world* world = world_of(&options);
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 1, NULL, &start), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 0.01, 100), TANDEM_OK);
  CHECK(fabs(body_of(world, 0)->centre[2] - 2) < 1e-9 && fabs(tandem_world_mass(world, 0) - 500) < 1e-3);
  CHECK(fabs(body_of(world, 0)->angular_velocity[2] - 1) < 1e-9);
  // A kinematic body keeps its velocity; what is excluded does not meet it.
  static const uint8_t motion[] = {TANDEM_KINEMATIC, TANDEM_MOVING};
  static const double speeds[] = {0, 0, 1, 0, 0, 0};
  const tandem_object_pair pair = {1, 0};
  tandem_excluded_pairs* excluded = NULL;
  CHECK_STATUS(tandem_excluded_pairs_create(&pair, 1, NULL, &excluded), TANDEM_OK);
  tandem_pair_filter filter = {sizeof filter, 0, 2, motion, NULL, NULL, NULL, excluded};
  start = (tandem_body_start){.struct_size = sizeof start, .count = 2, .velocity = speeds};
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, &filter, &start), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 0.01, 50), TANDEM_OK);
  CHECK(fabs(body_of(world, 0)->pose.translation[2] - 0.5) < 1e-9);
  CHECK(body_of(world, 1)->pose.translation[2] == 0.9);
  filter.excluded = NULL;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, &filter, &start), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 0.01, 50), TANDEM_OK);
  CHECK(body_of(world, 1)->pose.translation[2] > 1.4);
  tandem_excluded_pairs_destroy(excluded);
  tandem_world_destroy(world);
}

static void test_state(void) {
  tandem_world *world = world_of(NULL), *other = world_of(NULL);
  tandem_world_state* state = NULL;
  place_two(world, 0.5);
  place_two(other, 0.5);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 10), TANDEM_OK);
  CHECK_STATUS(tandem_world_save(world, &state), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 40), TANDEM_OK);
  const tandem_body_motion then = *body_of(world, 1);
  CHECK_STATUS(tandem_world_restore(world, state), TANDEM_OK);
  CHECK(fabs(tandem_world_time(world) - 10.0 / 60) < 1e-9 &&
        body_of(world, 1)->pose.translation[2] != then.pose.translation[2]);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 40), TANDEM_OK);
  CHECK(memcmp(&then, body_of(world, 1), sizeof then) == 0);
  CHECK_STATUS(tandem_world_restore(other, state), TANDEM_KEPT_MISMATCH);
  place_two(world, 0.5);
  CHECK_STATUS(tandem_world_restore(world, state), TANDEM_KEPT_MISMATCH);
  tandem_world_destroy(world);
  CHECK_STATUS(tandem_world_restore(other, state), TANDEM_KEPT_MISMATCH);
  CHECK_STATUS(tandem_world_restore(other, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_save(other, NULL), TANDEM_NULL_ARGUMENT);
  tandem_world_state_destroy(state);
  CHECK_STATUS(tandem_world_save(NULL, &state), TANDEM_NULL_ARGUMENT);
  CHECK(state == NULL);
  tandem_world_state_destroy(state);
  tandem_world_destroy(other);
}

static void test_materials_forces_and_touches(void) {
  static const uint8_t motion[] = {TANDEM_FIXED, TANDEM_MOVING, TANDEM_MOVING};
  const tandem_pair_filter filter = {.struct_size = sizeof filter, .count = 3, .motion = motion};
  const tandem_instance bodies[] = {at(0, 0, 0), at(0, 0, 1), at(0, 0, 3)};
  const double friction[] = {0.2, 0.8, -1}, restitution[] = {-1, 0, -1}, resistance[] = {0, 0.1, 0};
  const double scale[] = {1, 1, 0};
  const tandem_body_start start = {.struct_size = sizeof start,
                                   .count = 3,
                                   .friction = friction,
                                   .restitution = restitution,
                                   .rolling_resistance = resistance,
                                   .gravity_scale = scale};
  const double weak[] = {0.9 * 0.4 * 9810, 0, 0}, strong[] = {0.5 * 9810, 0, 0}, none[] = {0, 0, 0};
  tandem_world* world = world_of(NULL);
  size_t count = 7;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 3, &filter, &start), TANDEM_OK);
  CHECK(tandem_world_touching(world, &count) == NULL && count == 0);
  CHECK_STATUS(tandem_world_set_force(world, 1, weak, none), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 60), TANDEM_OK);
  CHECK(fabs(body_of(world, 1)->centre[0]) < 1e-3 && body_of(world, 2)->centre[2] == 3);
  const tandem_world_touch* began = tandem_world_began(world, &count);
  CHECK(count == 1 && began[0].a == 0 && began[0].b == 1 && fabs(began[0].position[2] - 0.5) < 1e-3);
  CHECK(began[0].speed >= 0 && began[0].speed < 0.1);
  CHECK(began[0].impulse > 0.99 * 9810 / 60 && began[0].impulse < 1.2 * 9810 / 60);
  CHECK(tandem_world_ended(world, &count) == NULL && count == 0);
  CHECK_STATUS(tandem_world_step_more(world, 1.0 / 60, 2), TANDEM_OK);
  CHECK(tandem_world_began(world, &count) != NULL && count == 1);
  CHECK_STATUS(tandem_world_step_more(world, 0, 2), TANDEM_BAD_DURATION);
  CHECK_STATUS(tandem_world_step_more(NULL, 1, 2), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_set_force(world, 1, strong, none), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 30), TANDEM_OK);
  CHECK(fabs(body_of(world, 1)->velocity[0] - 0.5 * 0.1 * 9.81) < 0.01);
  CHECK(tandem_world_touching(world, &count) != NULL && count == 1);
  CHECK(tandem_world_began(world, &count) == NULL && count == 0);
  // Its material changes, and whether it falls.
  const double half[] = {0.5 * 0.15 * 9810, 0, 0};
  CHECK_STATUS(tandem_world_set_force(world, 1, half, none), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 60), TANDEM_OK);
  CHECK(fabs(body_of(world, 1)->velocity[0]) < 1e-6);
  CHECK_STATUS(tandem_world_set_material(world, 1, 0.0005, 0, 0), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 6), TANDEM_OK);
  CHECK(fabs(body_of(world, 1)->velocity[0] - 0.1 * (0.075 - 0.01) * 9.81) < 0.01);
  CHECK_STATUS(tandem_world_set_gravity_scale(world, 2, 2), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 6), TANDEM_OK);
  CHECK(fabs(body_of(world, 2)->velocity[2] + 0.2 * 9.81) < 1e-6);
  CHECK_STATUS(tandem_world_set_material(world, 1, NAN, 0, 0), TANDEM_OUT_OF_RANGE);
  CHECK_STATUS(tandem_world_set_material(world, 3, 0, 0, 0), TANDEM_UNKNOWN_INSTANCE);
  CHECK_STATUS(tandem_world_set_gravity_scale(world, 1, INFINITY), TANDEM_OUT_OF_RANGE);
  CHECK_STATUS(tandem_world_set_gravity_scale(world, 3, 0), TANDEM_UNKNOWN_INSTANCE);
  CHECK_STATUS(tandem_world_set_material(NULL, 1, 0, 0, 0), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_set_gravity_scale(NULL, 1, 0), TANDEM_NULL_ARGUMENT);
  // It is pulled up.
  const double up[] = {0, 0, 3 * 9810};
  CHECK_STATUS(tandem_world_set_force(world, 1, up, none), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 10), TANDEM_OK);
  const tandem_object_pair* ended = tandem_world_ended(world, &count);
  CHECK(count == 1 && ended[0].a == 0 && ended[0].b == 1 && tandem_world_touching(world, NULL) == NULL);
  tandem_world_destroy(world);
}

static void check_options(tandem_world_options options, tandem_status expected) {
  tandem_world* world = NULL;
  if (options.struct_size == 0) options.struct_size = sizeof options;
  CHECK_STATUS(tandem_world_create(&options, NULL, &world), expected);
  CHECK((world == NULL) == (expected != TANDEM_OK));
  tandem_world_destroy(world);
}

static void test_bad_options(void) {
  typedef tandem_world_options Options;
  check_options((Options){.no_friction = 1, .no_slop = 1, .no_rolling_resistance = 1}, TANDEM_OK);
  check_options((Options){.friction = 0.1, .slop = 1e-3, .gravity = {1, 0, 0}}, TANDEM_OK);
  check_options((Options){.struct_size = 8}, TANDEM_BAD_STRUCT_SIZE);
  const Options bad[] = {{.friction = -1},
                         {.friction = NAN},
                         {.restitution = 1.5},
                         {.restitution = NAN},
                         {.slop = -1},
                         {.slop = 1e7},
                         {.substeps = 10001},
                         {.threads = 1025},
                         {.continuous = 2},
                         {.no_sleeping = 2},
                         {.reserved = 1},
                         {.gravity = {0, 0, NAN}},
                         {.no_gravity = 2},
                         {.no_friction = 2},
                         {.no_slop = 2},
                         {.no_rolling_resistance = 2},
                         {.no_friction = 1, .friction = 0.5},
                         {.rolling_resistance = -1},
                         {.no_gravity = 1, .gravity = {0, 0, -1}}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) check_options(bad[i], TANDEM_BAD_OPTION);
}

static void test_bad_bodies(void) {
  tandem_world* world = world_of(NULL);
  tandem_instance bodies[] = {at(0, 0, 0), at(3, 0, 0)};
  size_t count = 7;
  double numbers[] = {0, 0, 0, 0, NAN, 0};
  uint8_t motion[] = {TANDEM_FIXED, TANDEM_MOVING};
  tandem_pair_filter filter = {.struct_size = sizeof filter, .count = 2, .motion = motion};
  tandem_body_start start = {.struct_size = sizeof start, .count = 2, .velocity = numbers};
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, &filter, &start), TANDEM_OUT_OF_RANGE);
  CHECK(tandem_world_where(world) == 1 && tandem_world_bodies(world, &count) == NULL && count == 0);
  start.velocity = NULL;
  numbers[0] = 2;
  start.restitution = numbers;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, &filter, &start), TANDEM_OUT_OF_RANGE);
  CHECK(tandem_world_where(world) == 0);
  start.restitution = NULL;
  numbers[0] = 1000;
  numbers[1] = -1;
  start.density = numbers;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, &filter, &start), TANDEM_NO_MASS);
  CHECK(tandem_world_where(world) == 1);
  motion[1] = TANDEM_FIXED;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, &filter, &start), TANDEM_OK);
  CHECK(tandem_world_where(world) == 0);
  motion[1] = 4;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, &filter, NULL), TANDEM_BAD_MOTION);
  filter.count = 1;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, &filter, NULL), TANDEM_FILTER_MISMATCH);
  start.count = 1;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, NULL, &start), TANDEM_MOTION_MISMATCH);
  start.struct_size = 0;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, NULL, &start), TANDEM_BAD_STRUCT_SIZE);
  bodies[1].asset = 1;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, NULL, NULL), TANDEM_UNKNOWN_ASSET);
  CHECK(tandem_world_where(world) == 1);
  bodies[1].asset = 0;
  bodies[1].pose.rotation[0][0] = 2;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, NULL, NULL), TANDEM_POSE_NOT_RIGID);
  CHECK_STATUS(tandem_world_set_bodies(world, NULL, 2, NULL, NULL), TANDEM_NULL_ARGUMENT);
  const tandem_object_pair pairs[] = {{0, 1}, {2, 0}};
  tandem_excluded_pairs* excluded = NULL;
  CHECK_STATUS(tandem_excluded_pairs_create(pairs, 2, NULL, &excluded), TANDEM_OK);
  filter = (tandem_pair_filter){.struct_size = sizeof filter, .excluded = excluded};
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, &filter, NULL), TANDEM_UNKNOWN_INSTANCE);
  CHECK(tandem_world_where(world) == 1);
  tandem_excluded_pairs_destroy(excluded);

  // A mesh without topology has no mass. An open one is a shell.
  const double positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const uint32_t triangle[] = {0, 1, 2};
  const tandem_mesh mesh = {.struct_size = sizeof mesh,
                            .positions = positions,
                            .vertex_count = 3,
                            .triangles = triangle,
                            .triangle_count = 1};
  tandem_build_options plain = {.struct_size = sizeof plain, .no_topology = 1};
  tandem_asset* assets[] = {box, NULL, NULL};
  CHECK_STATUS(tandem_world_set_assets(world, assets, 2), TANDEM_NULL_ARGUMENT);
  CHECK(tandem_world_where(world) == 1);
  CHECK_STATUS(tandem_asset_build(&mesh, &plain, NULL, &assets[1], NULL), TANDEM_OK);
  plain.no_topology = 0;
  CHECK_STATUS(tandem_asset_build(&mesh, &plain, NULL, &assets[2], NULL), TANDEM_OK);
  CHECK_STATUS(tandem_world_set_assets(world, assets, 3), TANDEM_OK);
  bodies[1] = at(0, 0, 3);
  bodies[1].asset = 2;
  bodies[0].asset = 1;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 1, NULL, NULL), TANDEM_NO_TOPOLOGY);
  CHECK(tandem_world_where(world) == 1);
  bodies[0].asset = 0;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, NULL, NULL), TANDEM_OK);
  CHECK(tandem_world_mass(world, 1) > 0);
  for (int i = 1; i < 3; ++i) tandem_asset_release(assets[i]);
  tandem_world_destroy(world);
}

// A box that a motor turns about a hinge through its middle.
static void test_joints(void) {
  size_t count = 7;
  const tandem_world_options options = {.struct_size = sizeof options, .no_gravity = 1};
  tandem_world* world = world_of(&options);
  const tandem_instance bodies[] = {at(0, 0, 0), at(3, 0, 0)};
  tandem_joint joint = {.kind = TANDEM_HINGE, .a = TANDEM_NO_INDEX, .axis = {0, 0, 2}, .speed = 2, .most_effort = 1e6};
  tandem_body_start start = {.struct_size = sizeof start, .joints = &joint, .joint_count = 1};
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, NULL, &start), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 0.01, 100), TANDEM_OK);
  const tandem_world_joint* joints = tandem_world_joints(world, &count);
  CHECK(count == 1 && fabs(joints[0].speed - 2) < 1e-6 && fabs(joints[0].position - 2) < 0.02);
  CHECK(fabs(tandem_world_bodies(world, NULL)[0].angular_velocity[2] - 2) < 1e-6);
  CHECK_STATUS(tandem_world_set_motor(world, 0, 0, 1e6), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 0.01, 1), TANDEM_OK);
  CHECK(fabs(tandem_world_joints(world, NULL)[0].speed) < 1e-9);
  CHECK_STATUS(tandem_world_set_motor(world, 1, 0, 0), TANDEM_BAD_JOINT);
  CHECK(tandem_world_where(world) == 1);
  // It breaks where its force is larger than it bears, is removed, and another one comes in its place.
  uint32_t place = 7;
  CHECK_STATUS(tandem_world_remove_joint(world, 0), TANDEM_OK);
  CHECK_STATUS(tandem_world_remove_joint(world, 0), TANDEM_BAD_JOINT);
  CHECK(tandem_world_joints(world, &count)[0].holds == 0 && count == 1);
  joint.breaking_force = 6e4;
  CHECK_STATUS(tandem_world_add_joint(world, &joint, &place), TANDEM_OK);
  const double push[] = {500, 0, 0}, more[] = {700, 0, 0};
  CHECK(place == 0 && tandem_world_joints(world, NULL)[0].holds == 1);
  CHECK_STATUS(tandem_world_push(world, 0, push, body_of(world, 0)->centre), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 0.01, 2), TANDEM_OK);
  CHECK(tandem_world_joints(world, NULL)[0].holds == 1 && tandem_world_broken(world, &count) == NULL && count == 0);
  CHECK_STATUS(tandem_world_push(world, 0, more, body_of(world, 0)->centre), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 0.01, 2), TANDEM_OK);
  CHECK(tandem_world_broken(world, &count) != NULL && count == 1 && tandem_world_broken(world, NULL)[0] == 0);
  CHECK(tandem_world_joints(world, NULL)[0].holds == 0 && tandem_world_broken(NULL, NULL) == NULL);
  CHECK_STATUS(tandem_world_set_motor(world, 0, 0, 1), TANDEM_BAD_JOINT);
  joint.breaking_force = -1;
  CHECK_STATUS(tandem_world_add_joint(world, &joint, &place), TANDEM_BAD_JOINT);
  joint.breaking_force = 0, joint.b = 9;
  CHECK_STATUS(tandem_world_add_joint(world, &joint, &place), TANDEM_UNKNOWN_INSTANCE);
  joint.b = 0;
  CHECK_STATUS(tandem_world_add_joint(world, &joint, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_add_joint(world, NULL, &place), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_add_joint(NULL, &joint, &place), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_remove_joint(NULL, 0), TANDEM_NULL_ARGUMENT);
  CHECK(place == 0);
  joint.most = 1;  // without the flag that limits count
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, NULL, &start), TANDEM_BAD_JOINT);
  joint.has_limits = 1;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, NULL, &start), TANDEM_OK);
  joint.axis[2] = 0;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, NULL, &start), TANDEM_NO_AXIS);
  joint.b = TANDEM_NO_INDEX;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, NULL, &start), TANDEM_JOINS_NOTHING);
  CHECK(tandem_world_joints(world, &count) == NULL && count == 0 && tandem_world_joints(NULL, NULL) == NULL);
  start.joints = NULL;
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, 2, NULL, &start), TANDEM_NULL_ARGUMENT);
  tandem_world_destroy(world);
}

static void test_bad_calls(void) {
  size_t count = 7;
  const double numbers[] = {0, 0, NAN};
  const double zeros[] = {0, 0, 0};
  tandem_world* world = NULL;
  CHECK_STATUS(tandem_world_create(NULL, NULL, NULL), TANDEM_NULL_ARGUMENT);
  const tandem_allocator none = {sizeof none, 0, NULL, refuse, take_back};
  CHECK_STATUS(tandem_world_create(NULL, &none, &world), TANDEM_OUT_OF_MEMORY);
  CHECK_STATUS(tandem_world_set_assets(NULL, &box, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_set_bodies(NULL, NULL, 0, NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_step(NULL, 1, 1), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_set_body(NULL, 0, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_push(NULL, 0, zeros, zeros), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_set_force(NULL, 0, zeros, zeros), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_restore(NULL, NULL), TANDEM_NULL_ARGUMENT);
  CHECK(tandem_world_bodies(NULL, &count) == NULL && count == 0 && tandem_world_contacts(NULL, NULL) == NULL);
  CHECK(tandem_world_time(NULL) == 0 && tandem_world_mass(NULL, 0) == 0 && tandem_world_where(NULL) == 0);
  tandem_world_destroy(NULL);

  world = world_of(NULL);
  CHECK_STATUS(tandem_world_step(world, 0.01, 3), TANDEM_OK);
  place_two(world, 0.5);
  const double durations[] = {0, -1, NAN, INFINITY, 1001};
  for (int i = 0; i < 5; ++i) CHECK_STATUS(tandem_world_step(world, durations[i], 1), TANDEM_BAD_DURATION);
  CHECK(tandem_world_time(world) == 0);
  CHECK_STATUS(tandem_world_push(world, 2, zeros, zeros), TANDEM_UNKNOWN_INSTANCE);
  CHECK(tandem_world_where(world) == 2);
  CHECK_STATUS(tandem_world_push(world, 1, numbers, zeros), TANDEM_OUT_OF_RANGE);
  CHECK_STATUS(tandem_world_push(world, 1, zeros, numbers), TANDEM_OUT_OF_RANGE);
  CHECK_STATUS(tandem_world_push(world, 1, NULL, zeros), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_set_force(world, 2, zeros, zeros), TANDEM_UNKNOWN_INSTANCE);
  CHECK_STATUS(tandem_world_set_force(world, 1, zeros, numbers), TANDEM_OUT_OF_RANGE);
  CHECK_STATUS(tandem_world_set_force(world, 1, NULL, zeros), TANDEM_NULL_ARGUMENT);
  tandem_body_motion motion = *body_of(world, 1);
  CHECK_STATUS(tandem_world_set_body(world, 1, NULL), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_world_set_body(world, 2, &motion), TANDEM_UNKNOWN_INSTANCE);
  motion.velocity[0] = NAN;
  CHECK_STATUS(tandem_world_set_body(world, 1, &motion), TANDEM_OUT_OF_RANGE);
  motion.velocity[0] = 0;
  motion.pose.rotation[1][1] = 3;
  CHECK_STATUS(tandem_world_set_body(world, 1, &motion), TANDEM_POSE_NOT_RIGID);
  CHECK(tandem_world_where(world) == 1 && body_of(world, 1)->velocity[0] == 0);
  CHECK(tandem_world_mass(world, 2) == 0);
  // A body that becomes too fast, in the third step; the steps before are kept.
  motion = *body_of(world, 1);
  motion.velocity[0] = 1e300;
  CHECK_STATUS(tandem_world_set_body(world, 1, &motion), TANDEM_OUT_OF_RANGE);
  const double force[3] = {4e6 * tandem_world_mass(world, 1), 0, 0};
  CHECK_STATUS(tandem_world_set_force(world, 1, force, zeros), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 1000, 5), TANDEM_OUT_OF_RANGE);
  CHECK(tandem_world_where(world) == 1 && tandem_world_time(world) < 5000);
  tandem_world_destroy(world);
}

/// A heap of cows after so many steps.
static tandem_world* heap_of(tandem_asset* const* assets, uint32_t threads) {
  enum { kBodies = 13 };
  const tandem_world_options options = {.struct_size = sizeof options, .threads = threads};
  tandem_world* world = NULL;
  tandem_instance bodies[kBodies];
  uint8_t motion[kBodies] = {TANDEM_FIXED};
  const tandem_pair_filter filter = {.struct_size = sizeof filter, .count = kBodies, .motion = motion};
  CHECK_STATUS(tandem_world_create(&options, NULL, &world), TANDEM_OK);
  CHECK_STATUS(tandem_world_set_assets(world, assets, 2), TANDEM_OK);
  bodies[0] = at(0, 0, -1);
  for (int i = 1; i < kBodies; ++i) {
    bodies[i] = at(0.05 * (i % 3), 0.03 * (i % 4), 0.7 * (i - 1));
    bodies[i].asset = 1;
  }
  CHECK_STATUS(tandem_world_set_bodies(world, bodies, kBodies, &filter, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_world_step(world, 1.0 / 60, 45), TANDEM_OK);
  return world;
}

static void test_threads(tandem_asset* cow) {
  tandem_asset* assets[] = {box, cow};
  tandem_world *one = heap_of(assets, 1), *two = heap_of(assets, 2);
  size_t count = 0, other_count = 0;
  const tandem_body_motion* bodies = tandem_world_bodies(one, &count);
  const tandem_body_motion* other_bodies = tandem_world_bodies(two, &other_count);
  CHECK(count == other_count && memcmp(bodies, other_bodies, count * sizeof *bodies) == 0);
  const tandem_world_contact* contacts = tandem_world_contacts(one, &count);
  const tandem_world_contact* other_contacts = tandem_world_contacts(two, &other_count);
  CHECK(count == other_count && count > 0 && memcmp(contacts, other_contacts, count * sizeof *contacts) == 0);
  tandem_world_destroy(one);
  tandem_world_destroy(two);
}

int main(int argc, char** argv) {
  if (argc != 2) return printf("usage: world_use_test ASSETS_FOLDER\n"), 1;
  box = build_obj(argv[1], "box_12.obj", NULL);
  tandem_asset* cow = build_obj(argv[1], "cow_1500.obj", NULL);
  test_rest();
  test_options_start_and_filter();
  test_materials_forces_and_touches();
  test_state();
  test_bad_options();
  test_bad_bodies();
  test_joints();
  test_bad_calls();
  test_threads(cow);
  tandem_asset_release(cow);
  tandem_asset_release(box);
  printf("%d failures\n", failures);
  return failures != 0;
}
