#pragma once
#include <cstdint>

#include "kernels/geometry/local_frame.h"
#include "tandem/formats/view.h"
#include "tandem/kernels/detail/buffer.h"

// Walks of one tree by a point or a ray in its frame. They name the triangles that float32 does not rule out.
namespace tandem {

/// Walks of rays that are made at once: while one waits for memory, others go on.
inline constexpr std::uint32_t kRaysAtOnce = 8;

/// Rays that are made ready and taken into a body's frame at once, coordinate by coordinate.
inline constexpr std::uint32_t kRaysOfGroup = 8;

struct alignas(64) RayGroup {
  double origin[3][kRaysOfGroup], direction[3][kRaysOfGroup];
  double scaled[3][kRaysOfGroup], inverse[3][kRaysOfGroup], factor[kRaysOfGroup];  ///< as WorldRay has them
  double reach;                                                                    ///< of all
};

/// Rays as LocalRay has them.
struct alignas(64) LocalRayGroup {
  double start[kRaysOfGroup];
  float o[3][kRaysOfGroup], d[3][kRaysOfGroup], inverse[3][kRaysOfGroup];
  float slack[kRaysOfGroup], length[kRaysOfGroup], edge_factor[kRaysOfGroup], least_bound[kRaysOfGroup];
};

/// Bit i is for ray i. A ray of neither mask is out of range.
struct RayGroupReach {
  unsigned misses, in_frame;
};

/// The steps before walks, for all rays of a group.
struct RayGroupWays {
  /// Makes rays ready that have origins, directions and a reach.
  void (*make_ready)(RayGroup& group);
  /// Finds where rays enter a box. Result: the rays that may meet it.
  unsigned (*place)(const RayGroup& group, const WorldBox& bounds, double (&place)[3][kRaysOfGroup]);
  /// Takes rays into a frame that is in range.
  RayGroupReach (*take_into_frame)(const RayGroup& group, const LocalFrame& frame, LocalRayGroup& out);
};

/// Takes the triangles that a ray may meet, in no order. Result: the parameter, of the local ray, up to which
/// others count; below 0: none does.
struct RayTask {
  const LevelView* tree;
  LocalRay ray;
  float limit;  ///< the parameter of the local ray up to which triangles count
  float (*take)(void* context, std::uint32_t triangle);
  void* context;
  std::uint64_t blocks = 0;  ///< that were looked at
};

/// Rays one after another, for kRaysAtOnce walks.
struct RayStream {
  /// Makes the next task of a walk, which has ended the one before. False: this walk has no more.
  bool (*next)(void* context, std::uint32_t walk, RayTask& task);
  void* context;
};

/// A triangle whose distance from a point is at least so much, by float32: a length in the body's frame.
struct ClosestCandidate {
  float lower;
  std::uint32_t triangle;
};

/// A search of a tree for the point that is closest.
struct PointTask {
  const LevelView* tree;
  LocalPoint point;
  const FrameLengths* lengths;
  double upper;  ///< what is at least so far away, in the world, does not count; the walk makes it less
  /// Takes candidates that may be closer than `upper`; makes that less.
  void (*take)(PointTask& task, const ClosestCandidate* candidates, std::uint32_t count);
  void* context;
  std::uint64_t blocks = 0;
};

using RayWalk = void (*)(RayTask&);
using RayStreamWalk = void (*)(const RayStream&);
using PointWalk = void (*)(PointTask&);

// These functions are compiled once for any machine, and called by the variants.

/// The limits of box bounds and of lengths in a body's frame, for a distance in the world.
float bound_limit(const FrameLengths& lengths, double distance);
float length_limit(const FrameLengths& lengths, double distance);

/// The distance in the world that a length in a body's frame is at most.
double world_upper(const FrameLengths& lengths, float length);

}  // namespace tandem
