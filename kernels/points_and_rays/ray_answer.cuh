#pragma once
#include "kernels/points_and_rays/ray_rows.h"
#include "kernels/points_and_rays/tree_walk.cuh"

// The search for the hits of one ray through all bodies, by a thread. Decide: what decides about a ray and
// triangles, each answer no, yes or unsure: meets(ray, corner, meeting) whether the ray meets a triangle
// within reach, and comes_before(ray, x, body of x, y, body of y) whether hit x comes before hit y.
namespace tandem::gpu {
namespace {

struct RaySearch {
  WorldRay ray;
  double last;  ///< the greatest parameter of the world's ray that counts
  ray::FoundHit best;
  bool found, sure;
  std::uint32_t hits;                                ///< that were listed, where all are asked for
  Counter all_hits = 0, blocks = 0, by_float64 = 0;  ///< of all rays that this searched for
};

/// Puts a hit on the list of all hits, in no order; those without room are counted.
__device__ inline void list_hit(const RayArgs& args, const ray::FoundHit& hit, std::uint32_t number,
                                bool exact) {
  const Counter place = atomicAdd(&args.counts->found, Counter{1});
  if (place < args.capacity.hits) args.listed[place] = {hit, number, exact ? 1u : 0u};
}

/// Looks at a triangle. False: the search is over, as it has its answer or is not sure of it.
template <typename Decide>
__device__ bool take(const RayArgs& args, std::uint32_t number, std::uint32_t body, std::uint32_t triangle,
                     const Decide& decide, RaySearch& search) {
  ++search.by_float64;
  ray::FoundHit hit;
  hit.body = body;
  hit.triangle = triangle;
  double corner[3][3];
  corners_of(args.bodies[body], triangle, corner);
  ray::Answer answer = decide.meets(search.ray, corner, hit.meeting);
  if (answer == ray::Answer::no) return true;
  search.sure = answer == ray::Answer::yes;
  if (!search.sure) return false;
  if (args.asked.hits == RayHits::all) {
    ++search.hits;
    list_hit(args, hit, number, Decide::kExact);
    return true;
  }
  answer = search.found ? decide.comes_before(search.ray, hit, args.bodies[body], search.best,
                                              args.bodies[search.best.body])
                        : ray::Answer::yes;
  search.sure = answer != ray::Answer::unsure;
  if (answer == ray::Answer::yes) {
    search.best = hit;
    if (hit.meeting.t.upper < search.last) search.last = hit.meeting.t.upper;
  }
  search.found = true;
  return search.sure && args.asked.hits != RayHits::any;
}

/// Searches one body. False: the search is over.
template <typename Decide>
__device__ bool search_body(const RayArgs& args, std::uint32_t number, std::uint32_t of, const Decide& decide,
                            RaySearch& search) {
  const ProbedBody& body = args.bodies[of];
  LocalRay local;
  const RayReach reach = local_ray(body.frame, search.ray, search.last, local);
  if (reach == RayReach::misses) return true;
  if (reach == RayReach::in_frame) {
    return walk_ray(body, local, search.blocks, [&](std::uint32_t triangle, float& limit) {
      if (!take(args, number, of, triangle, decide, search)) return false;
      const float left = local_limit(search.ray, local, search.last);
      if (left < limit) limit = left;
      return true;
    });
  }
  bool goes_on = true;
  search.blocks += probe::walk_world_boxes(
      body.pose, body.blocks,
      [&](const WorldBox& box) {
        double first = 0, last = search.last / search.ray.factor;
        return meets_box(search.ray, box.lo, box.hi, first, last);
      },
      [&](std::uint32_t triangle) { return goes_on = take(args, number, of, triangle, decide, search); });
  return goes_on;
}

/// Notes how many hits of a ray were listed, and which walk has them.
template <typename Decide>
__device__ void note_all_hits(const RayArgs& args, std::uint32_t number, const RaySearch& search) {
  args.by_exact[number] = !search.sure || Decide::kExact ? 1 : 0;
  args.hits_of[number] = search.sure ? search.hits : 0;
  args.placed[number] = 0;
}

__device__ inline RaySearch search_for(const RayArgs&) {
  return {};
}

/// Writes the row of a ray, but where all hits are asked for. False: it is not decided, and not written.
template <typename Decide>
__device__ bool answer(const RayArgs& args, std::uint32_t number, const Decide& decide, RaySearch& search) {
  search.ray = world_ray(args.asked.origins + std::uint64_t{3} * number,
                         args.asked.directions + std::uint64_t{3} * number, args.asked.reach);
  search.last = args.asked.reach;
  search.found = false;
  search.sure = true;
  search.hits = 0;
  bool goes_on = true;
  double limit = search.last / search.ray.factor;
  const auto first_in = [&](const WorldBox& box) {
    double first = 0, last = limit;
    return meets_box(search.ray, box.lo, box.hi, first, last) ? first : INFINITY;
  };
  const auto visit = [&](std::uint32_t body) {
    if (!goes_on) return;
    goes_on = search_body(args, number, body, decide, search);
    // This is rounded up, as a bound of a box that is just as far may be.
    limit = search.last / search.ray.factor * (1 + 0x1p-50);
  };
  if (args.instances.count != 0) visit_bodies(PlacesOfBodies{args}, first_in, limit, visit);
  const bool all = args.asked.hits == RayHits::all;
  if (all) note_all_hits<Decide>(args, number, search);
  if (!search.sure) return false;
  search.all_hits += all ? search.hits : search.found ? 1 : 0;
  if (all) return true;
  args.rows[number] =
      search.found ? row_of(number, search.best,
                            args.bodies[search.best.body].triangles[search.best.triangle].source_face())
                   : row_without_hit(number);
  return true;
}

__device__ inline void add_counts(const RayArgs& args, const RaySearch& search) {
  add_up(args.counts->hits, search.all_hits);
  add_up(args.counts->blocks, search.blocks);
  add_up(args.counts->by_float64, search.by_float64);
}

}  // namespace
}  // namespace tandem::gpu
