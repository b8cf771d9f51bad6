// What scripts/dynamics_peers asks of an engine that has no Python package. Each engine is one source file
// here, built into a library of its own by CMakeLists.txt.
#pragma once

#ifdef __cplusplus
extern "C" {
#endif

// A convex body that has its centre of mass at its origin. Metres, kilograms, seconds, radians.
struct PeerBody {
  double position[3], quaternion[4];  // of the body's origin; x y z w
  double velocity[3], angular_velocity[3];
  double half[3];  // of a box; the first is 0 for the hull of `points`
  double density;  // 0: the body is fixed
  double friction;
  const double* points;  // [point_count][3]
  long point_count;
};

const char* peer_version(void);

// Returns those defaults of the engine that decide cost and accuracy, and what is not its default.
const char* peer_settings(void);

// Makes the only world of this process, in place of the one before. Gravity acts against z, one thread
// solves, and no body falls asleep.
void peer_create(double gravity, const struct PeerBody* bodies, long count);
void peer_step(double seconds);
void peer_positions(double* positions);  // of the origins of all bodies, [count][3]

#ifdef __cplusplus
}
#endif
