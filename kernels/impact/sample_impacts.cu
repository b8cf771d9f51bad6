#include "kernels/impact/impact_data.h"

// These kernels pose pairs at some times of the step. They are compiled without fused operations, as all that
// makes records of pairs.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 128;

__device__ void list_pair(const ImpactArgs& args, const ImpactBlockPair& entry) {
  const std::uint32_t part = part_named(args, entry.part);
  if (part == kNoIndex) return;
  const std::uint32_t pair = args.parts[part].pair;
  // Looked at before it is written: most block pairs are of a pair that is listed.
  if (*static_cast<volatile std::uint32_t*>(&args.is_sampled[pair]) != 0) return;
  if (atomicExch(&args.is_sampled[pair], 1u) == 0)
    args.sampled_pairs[atomicAdd(&args.state->sampled_pairs, 1u)] = pair;
}

__global__ void __launch_bounds__(kThreads) list_pairs(const __grid_constant__ ImpactArgs args) {
  wait_for_kernel_before();
  const AppendList<ImpactBlockPair> left = args.frontier.round(kSampledRound);
  const std::uint32_t count = stored_in(left);
  for (std::uint32_t i = first_of_thread(); i < count; i += threads_of_grid())
    list_pair(args, left.entries[i]);
}

/// Returns how many samples each pair has: what there is room for in any query that has room for all pairs.
__device__ std::uint32_t samples_of_pair(const ImpactArgs& args) {
  const Counter pairs = *args.given.count, all = kImpactSamplesPerPair * pairs + kFewestImpactSamples,
                room = all < args.most_samples ? all : args.most_samples;
  return static_cast<std::uint32_t>(min(room / max(args.state->sampled_pairs, 1u), Counter{kMostSamples}));
}

/// The first that met, of a pair's; `count` where none did.
__device__ std::uint32_t first_met(const std::uint32_t* met, std::uint32_t count) {
  std::uint32_t first = 0;
  while (first < count && met[first] == 0) ++first;
  return first;
}

/// Time `i` of `count` of the first time: they end with the step.
__device__ double time_of_sample(std::uint32_t i, std::uint32_t count) {
  return static_cast<double>(i + 1) / count;
}

/// The second time: between the last of the first that did not meet before the one that did, and that one.
__device__ double time_of_sample(std::uint32_t i, std::uint32_t met, std::uint32_t count) {
  const double begin = static_cast<double>(met) / count;
  return begin + (time_of_sample(met, count) - begin) * (i + 1) / (count + 1);
}

__device__ Pose pose_of_sample(const impact::MovingBody& body, double time) {
  const manifold::Vector3 &v = body.displacement, &w = body.turn, &c = body.centre;
  return pose_at(body.start, {{v.x, v.y, v.z}, {w.x, w.y, w.z}, {c.x, c.y, c.z}}, time);
}

__device__ void pose_sample(const ImpactArgs& args, std::uint32_t which, std::uint32_t sample,
                            std::uint32_t count) {
  const std::uint32_t place = sample / count, i = sample % count;
  const std::uint32_t met = which == 0 ? 0 : first_met(args.met[0] + place * count, count);
  args.met[which][sample] = 0;
  if (met == count) {
    args.samples[sample].in_frame = 0;  // nothing to walk
    return;
  }
  const double time = which == 0 ? time_of_sample(i, count) : time_of_sample(i, met, count);
  const std::uint32_t index = args.sampled_pairs[place];
  const ObjectPair& pair = args.given.pairs[index];
  const impact::PairMotion& motion = args.pairs[index].motion;
  args.samples[sample] = make_record(
      pair, args.assets[args.instances.asset[pair.a]], pose_of_sample(*motion.a, time),
      args.assets[args.instances.asset[pair.b]], pose_of_sample(*motion.b, time), BlockKind::oriented);
}

__global__ void __launch_bounds__(kThreads)
    pose(const __grid_constant__ ImpactArgs args, std::uint32_t which) {
  wait_for_kernel_before();
  const std::uint32_t count = samples_of_pair(args), all = count * args.state->sampled_pairs;
  if (first_of_thread() == 0) args.state->samples = all;
  for (std::uint32_t i = first_of_thread(); i < all; i += threads_of_grid())
    pose_sample(args, which, i, count);
}

/// No impact of a pair is later than a time at which a walk that is never wrong about contacts finds one
/// between its triangles as pose_at() makes them: the rounds say *apart* of these triangles too, with
/// pose_error() of displacement and turn, which are what is posed here. So where a pair has such a time,
/// something stops it before, or then, and what the rounds leave out is later.
__global__ void __launch_bounds__(kThreads) end(const __grid_constant__ ImpactArgs args) {
  wait_for_kernel_before();
  const std::uint32_t count = samples_of_pair(args), pairs = args.state->sampled_pairs;
  for (std::uint32_t place = first_of_thread(); count != 0 && place < pairs; place += threads_of_grid()) {
    const std::uint32_t met = first_met(args.met[0] + place * count, count);
    if (met == count) continue;
    const std::uint32_t then = first_met(args.met[1] + place * count, count);
    args.sought[args.sampled_pairs[place]] =
        then == count ? time_of_sample(met, count) : time_of_sample(then, met, count);
  }
}

Grid grid_of(const ImpactArgs& args, cudaStream_t stream) {
  return {args.limits.processors * 4, kThreads, 0, stream, args.limits.early_launch};
}

}  // namespace

cudaError_t list_sampled_pairs(const ImpactArgs& args, cudaStream_t stream) {
  return launch_after(grid_of(args, stream), list_pairs, args);
}

cudaError_t pose_samples(const ImpactArgs& args, std::uint32_t which, cudaStream_t stream) {
  return launch_after(grid_of(args, stream), pose, args, which);
}

cudaError_t end_at_samples(const ImpactArgs& args, cudaStream_t stream) {
  return launch_after(grid_of(args, stream), end, args);
}

}  // namespace tandem::gpu
