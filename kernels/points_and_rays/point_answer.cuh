#pragma once
#include "kernels/points_and_rays/closest_search.h"
#include "kernels/points_and_rays/tree_walk.cuh"

// The search of one point through all bodies, by a thread. Decide: distance(pair, tolerance, out) decides a
// distance, see ClosestSearch.
namespace tandem::gpu {
namespace {

/// The walk of a point, whose search has the body.
template <typename Source>
class PointWalk {
 public:
  __device__ PointWalk(const ProbedBody& body, const LocalPoint& point, const Source& source,
                       ClosestSearch& search)
      : body_(body), point_(point), source_(source), search_(search) {
    take_limits();
  }

  /// False: the source left an answer to somebody else.
  __device__ bool run(Counter& looked_at) {
    const bool ended = walk(
        body_.blocks, looked_at,
        [&](const float(&centre)[3], const float(&half_extent)[3]) {
          const float bound = probe::box_bound(point_.q, point_.slack, centre, half_extent);
          return bound < limit_ ? bound : INFINITY;
        },
        [&](float bound) { return bound < limit_; }, [&](std::uint32_t triangle) { return take(triangle); });
    return ended && settle();
  }

 private:
  static constexpr std::uint32_t kMostCandidates = 16;

  __device__ void take_limits() {
    limit_ = distance::limit_of(body_.frame, search_.upper);
    length_ = probe::length_limit_of(body_.frame, search_.upper);
  }

  __device__ bool take(std::uint32_t triangle) {
    frame::Point<float> corner[3];
    load_corners(body_.triangles[triangle], corner);
    const auto interval = probe::triangle_interval(point_.q, point_.error, corner);
    if (!(interval.lower < length_)) return true;
    const double upper = probe::world_upper_of(body_.frame, interval.upper);
    if (upper < search_.upper) {
      search_.upper = upper;
      take_limits();
    }
    if (count_ == kMostCandidates) {
      keep_those_that_count();
      if (count_ > kMostCandidates / 2 && !settle()) return false;
    }
    candidates_[count_++] = {interval.lower, triangle};
    return true;
  }

  __device__ void keep_those_that_count() {
    std::uint32_t left = 0;
    for (std::uint32_t i = 0; i < count_; ++i) {
      if (candidates_[i].lower < length_) candidates_[left++] = candidates_[i];
    }
    count_ = left;
  }

  __device__ bool settle() {
    keep_those_that_count();
    const std::uint32_t left = count_;
    count_ = 0;
    if (left > 0 && !search_.settle(source_, candidates_, left, body_.frame)) return false;
    take_limits();
    return true;
  }

  const ProbedBody& body_;
  const LocalPoint& point_;
  const Source& source_;
  ClosestSearch& search_;
  float limit_, length_;
  std::uint32_t count_ = 0;
  ClosestCandidate candidates_[kMostCandidates];
};

/// The bodies, and what decides distances.
template <typename Decide>
struct BodySource {
  const ProbedBody* bodies;
  const Decide& decide;

  __device__ void corners(std::uint32_t body, std::uint32_t triangle, double (&out)[3][3]) const {
    corners_of(bodies[body], triangle, out);
  }
  __device__ bool distance(const TrianglePair& pair, const DistanceTolerance& tolerance,
                           TriangleDistance& out) const {
    return decide.distance(pair, tolerance, out);
  }
};

/// Searches one body. False: it is not decided.
template <typename Source>
__device__ bool search_body(const ProbedBody& body, const Source& source, ClosestSearch& search) {
  LocalPoint local;
  if (local_point(body.frame, search.point, local)) {
    Counter blocks = 0;
    PointWalk<Source> walk(body, local, source, search);
    const bool decided = walk.run(blocks);
    search.blocks += blocks;
    return decided;
  }
  bool decided = true;
  search.blocks += probe::walk_world_boxes(
      body.pose, body.blocks,
      [&](const WorldBox& box) { return probe::distance_to(box, search.point) < search.upper; },
      [&](std::uint32_t triangle) { return decided = search.settle(source, triangle); });
  return decided;
}

__device__ inline ClosestSearch search_for(const PointArgs&) {
  return {};
}

/// Writes the row of a point, but for its sides. False: it is not decided, and not written.
template <typename Decide>
__device__ bool answer(const PointArgs& args, std::uint32_t number, const Decide& decide,
                       ClosestSearch& search) {
  search.tolerance = args.asked.tolerance;
  search.begin(args.asked.points + std::uint64_t{3} * number, beyond(args.asked.reach));
  if (!probe::is_in_range(search.point)) return true;
  const BodySource<Decide> source = {args.bodies, decide};
  bool decided = true;
  if (args.instances.count != 0) {
    visit_bodies(
        PlacesOfBodies{args}, [&](const WorldBox& box) { return probe::distance_to(box, search.point); },
        search.upper,
        [&](std::uint32_t body) {
          search.body = body;
          if (decided) decided = search_body(args.bodies[body], source, search);
        });
  }
  if (!decided) return false;
  ClosestPoint row = search.row(args.asked.reach);
  if (row.body != kNoIndex) row.face = args.bodies[row.body].triangles[row.triangle].source_face();
  args.rows[number] = row;
  return true;
}

__device__ inline void add_counts(const PointArgs& args, const ClosestSearch& search) {
  add_up(args.counts->blocks, search.blocks);
  add_up(args.counts->by_float64, search.by_float64);
}

}  // namespace
}  // namespace tandem::gpu
