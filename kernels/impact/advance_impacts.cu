#include "kernels/geometry/triangle_distance.h"
#include "kernels/impact/impact_data.h"
#include "kernels/impact/triangle_impact.h"

// Triangles that move, and what stops each pair. Multiplies and adds may be fused, as in the walk; the points
// and the gap that are told are bounded with or without it.
namespace tandem::gpu {
namespace {

using manifold::Vector3;

// Each thread has all the registers that there are for one: nine pairs of corners, with their velocities.
constexpr std::uint32_t kThreads = 64;

__device__ Counter bits_of(double time) {
  return static_cast<Counter>(__double_as_longlong(time));
}

/// Result: whether the triangles are to be advanced.
__device__ bool select(const ImpactArgs& args, const ImpactTrianglePair& leaf, AdvancedPair& out) {
  const ImpactPart& part = args.parts[leaf.part];
  const double end = manifold::lesser(part.time.end, args.sought[part.pair]);
  if (!(leaf.apart < end)) return false;
  const ImpactPair& pair = args.pairs[part.pair];
  const impact::MovingTriangles start =
      moving_triangles(pair.motion, pair.triangles_a[leaf.a], pair.triangles_b[leaf.b]);
  out = {part.pair, leaf.a, leaf.b, true, 0, end};
  out.time = time_to_advance_from(pair.motion, start, place_at(pair.motion, part.time.begin), part.time.begin,
                                  end, leaf.apart, pair.tolerance);
  return out.time < end;
}

__global__ void __launch_bounds__(kThreads) select_triangles(const __grid_constant__ ImpactArgs args) {
  wait_for_kernel_before();
  const std::uint32_t count = stored_in(args.triangle_pairs);
  for (std::uint32_t first = first_of_thread() - lane_id(); first < count; first += threads_of_grid()) {
    const std::uint32_t index = first + lane_id();
    AppendBatch<AdvancedPair, 1> batch;
    AdvancedPair selected;
    if (index < count && select(args, args.triangle_pairs.entries[index], selected)) batch.put(0, selected);
    batch.append_to(args.advanced);
  }
}

__global__ void __launch_bounds__(kThreads) advance_triangles(const __grid_constant__ ImpactArgs args) {
  wait_for_kernel_before();
  const std::uint32_t count = stored_in(args.advanced);
  for (std::uint32_t first = first_of_thread() - lane_id(); first < count; first += threads_of_grid()) {
    const std::uint32_t index = first + lane_id();
    std::uint32_t steps = 0;
    if (index < count) {
      AdvancedPair& mine = args.advanced.entries[index];
      const ImpactPair& pair = args.pairs[mine.pair];
      const impact::MovingTriangles start =
          moving_triangles(pair.motion, pair.triangles_a[mine.a], pair.triangles_b[mine.b]);
      const impact::TriangleStop stop = advance(pair.motion, start, mine.time, mine.end, pair.tolerance);
      mine.time = stop.time;
      mine.converged = stop.converged;
      steps = stop.steps;
      if (stop.time < mine.end) atomicMin(&args.stops[mine.pair], bits_of(stop.time));
    }
    const std::uint32_t sum = __reduce_add_sync(kAllLanes, steps), most = __reduce_max_sync(kAllLanes, steps);
    if (lane_id() == 0) {
      atomicAdd(&args.state->steps, static_cast<Counter>(sum));
      if (most > *static_cast<volatile std::uint32_t*>(&args.state->most_steps))
        atomicMax(&args.state->most_steps, most);
    }
  }
}

/// Chooses the least of the triangles that stop a pair first.
__global__ void __launch_bounds__(kThreads) choose_triangles(const __grid_constant__ ImpactArgs args) {
  wait_for_kernel_before();
  const std::uint32_t count = stored_in(args.advanced);
  for (std::uint32_t i = first_of_thread(); i < count; i += threads_of_grid()) {
    const AdvancedPair& one = args.advanced.entries[i];
    if (!(one.time < one.end) || bits_of(one.time) != args.stops[one.pair]) continue;
    atomicMin(&args.triangles[one.pair], static_cast<Counter>(one.a) << 32 | one.b);
    if (!one.converged) atomicAdd(&args.state->unconverged, 1u);
  }
}

__device__ void store(const Vector3& x, double (&out)[3]) {
  out[0] = x.x;
  out[1] = x.y;
  out[2] = x.z;
}

/// Corners times this have a size that distance_at() takes.
__device__ double scale_of(const impact::TrianglesAt& t) {
  double largest = 0;
  for (int c = 0; c < 3; ++c) {
    const Vector3 u = t.a[c] - t.a[0], v = t.b[c] - t.a[0];
    for (const double x : {u.x, u.y, u.z, v.x, v.y, v.z}) largest = manifold::greater(largest, fabs(x));
  }
  if (largest >= 0x1p-200 && largest <= 0x1p200) return 1;
  return largest > 0 ? exp2(-floor(log2(largest))) : 1;
}

/// Writes what the two triangles tell at a time: an upper bound of their gap in float64, and where it is. As
/// above, lengths are scaled by a power of two where the bound's proof asks for it.
__device__ void tell(const ImpactPair& pair, double time, bool in_contact, Impact& out) {
  const Triangle &of_a = pair.triangles_a[out.triangle_a], &of_b = pair.triangles_b[out.triangle_b];
  const impact::TrianglesAt t =
      triangles_at(pair.motion, moving_triangles(pair.motion, of_a, of_b), place_at(pair.motion, time));
  TrianglePair local = triangle_pair(t), scaled = local;
  const double scale = scale_of(t);
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < 3; ++k) {
      scaled.a[c][k] *= scale;
      scaled.b[c][k] *= scale;
    }
  }
  const distance::LocalPair from_corner = distance::local_pair(scaled);
  TriangleWeights weights = {};
  TriangleDistance found;
  found.interval = distance::bounded_distance(from_corner, {}, weights);
  if (in_contact) distance::find_common_point(from_corner, weights);
  distance::write_points(local, weights, found);
  const Vector3 centre = pair.motion.a->centre + time * pair.motion.a->displacement;
  out.gap = in_contact ? 0 : found.interval.upper / scale;
  store(centre + impact::vector_of(found.point_a), out.point_a);
  store(centre + impact::vector_of(found.point_b), out.point_b);
  out.face_a = of_a.source_face();
  out.face_b = of_b.source_face();
}

__device__ Impact impact_of(const ImpactArgs& args, std::uint32_t index) {
  // A time that was not sought is not promised. If there is no impact, all of the step was sought.
  const double sought = args.sought[index];
  Impact out = {
      sought * args.duration, INFINITY, {0, 0, 0}, {0, 0, 0}, kNoIndex, kNoIndex, kNoIndex, kNoIndex,
      ImpactStatus::none};
  const Counter triangles = args.triangles[index];
  if (triangles == kNoTriangles) return out;
  const bool in_contact = sought == 0;
  const double time = in_contact ? 0 : __longlong_as_double(static_cast<long long>(args.stops[index]));
  out.status = in_contact ? ImpactStatus::at_start : ImpactStatus::found;
  out.t_safe = time * args.duration * (1 - 0x1p-51);
  out.triangle_a = static_cast<std::uint32_t>(triangles >> 32);
  out.triangle_b = static_cast<std::uint32_t>(triangles);
  tell(args.pairs[index], time, in_contact, out);
  return out;
}

__device__ std::uint32_t limited(Counter count) {
  return static_cast<std::uint32_t>(count < kNoIndex ? count : kNoIndex);
}

/// Returns the room that is needed; a warp calls it. rounds: those that had block pairs.
__device__ GpuImpactCapacity needed_by(const ImpactArgs& args, std::uint32_t& rounds) {
  const ImpactState& state = *args.state;
  GpuImpactCapacity needed = {args.instances.count,         *args.given.count,    args.query->needed.contacts,
                              args.query->needed.undecided, limited(state.parts), 0,
                              limited(state.triangle_pairs)};
  std::uint32_t mine = 0, most = 0;
  for (std::uint32_t i = lane_id(); i <= kMostImpactRounds; i += 32) {
    if (state.waiting[i] != 0) mine = i + 1;
    most = max(most, limited(state.waiting[i]));
  }
  rounds = __reduce_max_sync(kAllLanes, mine);
  needed.block_pairs = __reduce_max_sync(kAllLanes, most);
  return needed;
}

__device__ bool is_complete(const ImpactArgs& args, const GpuImpactCapacity& needed) {
  const GpuImpactCapacity& room = args.capacity;
  return args.query->complete != 0 && needed.pairs <= room.pairs && needed.pairs <= args.given.capacity &&
         needed.parts <= room.parts && needed.block_pairs <= room.block_pairs &&
         needed.triangle_pairs <= room.triangle_pairs;
}

/// Returns the report; a warp calls it.
__device__ GpuImpactReport make_report(const ImpactArgs& args) {
  const ImpactState& state = *args.state;
  GpuImpactReport report = {};
  if (state.error != 0) {
    report.status = status_in(state.error);
    report.where = where_in(state.error);
    return report;
  }
  if (args.broad_phase != nullptr && args.broad_phase->status != Status::kOk) {
    report.status = args.broad_phase->status;
    report.where = args.broad_phase->where;
    return report;
  }
  if (args.query->status != Status::kOk) {
    report.status = args.query->status;
    report.where = args.query->where;
    return report;
  }
  report.needed = needed_by(args, report.rounds);
  report.complete = is_complete(args, report.needed) ? 1 : 0;
  if (report.complete == 0) return report;
  report.impacts = *args.given.count;
  report.counters = {report.impacts,       state.at_start, state.found, state.walks,      state.visited,
                     state.triangle_pairs, state.advanced, state.steps, state.most_steps, state.unconverged};
  return report;
}

__global__ void __launch_bounds__(kThreads) write(const __grid_constant__ ImpactArgs args) {
  wait_for_kernel_before();
  const std::uint32_t pairs = can_walk(args) ? *args.given.count : 0;
  for (std::uint32_t first = first_of_thread() - lane_id(); first < pairs; first += threads_of_grid()) {
    const std::uint32_t index = first + lane_id();
    ImpactStatus status = ImpactStatus::none;
    if (index < pairs) {
      const Impact impact = impact_of(args, index);
      status = impact.status;
      args.impacts[index] = impact;
    }
    const std::uint32_t found = __ballot_sync(kAllLanes, status == ImpactStatus::found),
                        at_start = __ballot_sync(kAllLanes, status == ImpactStatus::at_start);
    if (lane_id() == 0 && found != 0)
      atomicAdd(&args.state->found, static_cast<std::uint32_t>(__popc(found)));
    if (lane_id() == 0 && at_start != 0)
      atomicAdd(&args.state->at_start, static_cast<std::uint32_t>(__popc(at_start)));
  }
}

__global__ void __launch_bounds__(32) report(const __grid_constant__ ImpactArgs args) {
  wait_for_kernel_before();
  const GpuImpactReport made = make_report(args);
  if (lane_id() != 0) return;
  args.state->report = made;
  *args.host_report = made;
}

Grid grid_of(const ImpactArgs& args, cudaStream_t stream) {
  return {args.limits.processors * 8, kThreads, 0, stream, args.limits.early_launch};
}

}  // namespace

cudaError_t advance_impacts(const ImpactArgs& args, cudaStream_t stream) {
  cudaError_t error = launch_after(grid_of(args, stream), select_triangles, args);
  if (error == cudaSuccess) error = launch_after(grid_of(args, stream), advance_triangles, args);
  return error == cudaSuccess ? launch_after(grid_of(args, stream), choose_triangles, args) : error;
}

cudaError_t write_impacts(const ImpactArgs& args, cudaStream_t stream) {
  const cudaError_t error = launch_after(grid_of(args, stream), write, args);
  return error == cudaSuccess ? launch_after({1, 32, 0, stream, args.limits.early_launch}, report, args)
                              : error;
}

}  // namespace tandem::gpu
