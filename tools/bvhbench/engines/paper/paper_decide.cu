#include "kernels/contact/candidate.h"
#include "paper_engine_data.h"

// These kernels do what comes before the traversal, and the last stages of the triangle test. They are
// compiled without fused operations, which their float64 arithmetic relies on.
namespace tandem::bench::paper {
namespace {

using gpu::Subject;

__device__ void report_error(const QueryArgs& args, Subject subject, Counter where, Status status) {
  atomicMax(&args.outcome->error, gpu::packed_error(subject, where, status));
}

__device__ void prepare_pair(const QueryArgs& args, std::uint32_t index) {
  const ObjectPair pair = args.given.pairs[index];
  if (const Status status = check_pair(pair, args.instances.count); status != Status::kOk)
    return report_error(args, Subject::pair, index, status);
  const std::uint32_t asset_a = args.instances.asset[pair.a], asset_b = args.instances.asset[pair.b];
  if (asset_a >= args.asset_count || asset_b >= args.asset_count) return;  // reported with the instance
  args.records[index] = gpu::make_record(args.instances, args.assets, pair, gpu::BlockKind::axis_aligned);
  if (args.records[index].in_frame == 0) report_error(args, Subject::reach, index, Status::kOutOfRange);
}

__global__ void __launch_bounds__(kThreads)
    prepare_all(const __grid_constant__ QueryArgs args, Entry* first_level) {
  const std::uint32_t first = blockIdx.x * kThreads + threadIdx.x, step = gridDim.x * kThreads;
  const std::uint32_t given = *args.given.count;
  const std::uint32_t room = min(args.record_room, args.given.capacity);
  for (std::uint32_t i = first; i < min(given, room); i += step) {
    prepare_pair(args, i);
    first_level[i] = {i, 0, 0};
  }
  for (std::uint32_t i = first; i < args.instances.count; i += step) {
    const Status status = gpu::check_instance(args.instances, args.assets, args.asset_count, i);
    if (status != Status::kOk) report_error(args, Subject::instance, i, status);
  }
}

__device__ TrianglePair posed_pair(const QueryArgs& args, const Entry& candidate) {
  const PairRecord& record = args.records[candidate.pair];
  return tandem::posed_pair(
      gpu::stored_pose(args.instances, args.assets, record.instance_a), record.triangles_a[candidate.a],
      gpu::stored_pose(args.instances, args.assets, record.instance_b), record.triangles_b[candidate.b]);
}

/// float32 corners in the frame of the first instance.
__device__ TrianglePair framed_pair(const QueryArgs& args, const Entry& candidate) {
  const PairRecord& record = args.records[candidate.pair];
  return tandem::framed_pair(gpu::pose_of(record), record.triangles_a[candidate.a],
                             record.triangles_b[candidate.b]);
}

template <bool kFast>
__global__ void __launch_bounds__(kThreads)
    decide_by_float64(const __grid_constant__ QueryArgs args,
                      const __grid_constant__ TriangleArgs triangles) {
  const std::uint64_t total = min(args.outcome->undecided, static_cast<Counter>(triangles.undecided_room));
  const std::uint64_t step = std::uint64_t{gridDim.x} * kThreads;
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * kThreads; first < total; first += step) {
    const std::uint64_t i = first + threadIdx.x;
    const bool mine = i < total;
    const Entry candidate = triangles.undecided[mine ? i : first];
    const Verdict verdict =
        kFast ? decide_fast(framed_pair(args, candidate)) : decide_float64(posed_pair(args, candidate));
    const bool unresolved = mine && verdict == Verdict::undecided;
    const Counter place = place_for(unresolved, &args.outcome->unresolved);
    if (unresolved) triangles.unresolved[place] = candidate;
    place_for(mine && !kFast && !unresolved, &args.outcome->decided_by_float64);
    add_contact(args, triangles, candidate, mine && verdict == Verdict::contact);
  }
}

/// Apart from the others: it needs 3 KB of stack a thread.
__global__ void __launch_bounds__(kThreads)
    decide_exactly(const __grid_constant__ QueryArgs args, const __grid_constant__ TriangleArgs triangles) {
  const std::uint64_t total = args.outcome->unresolved, step = std::uint64_t{gridDim.x} * kThreads;
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * kThreads; first < total; first += step) {
    const std::uint64_t i = first + threadIdx.x;
    const bool mine = i < total;
    const Entry candidate = triangles.unresolved[mine ? i : first];
    const bool contact = mine && decide_exact(posed_pair(args, candidate)) == Verdict::contact;
    add_contact(args, triangles, candidate, contact);
  }
}

/// Thread blocks that fill the GPU a few times over.
cudaError_t block_count(unsigned& blocks) {
  int device = 0, processors = 0;
  cudaError_t error = cudaGetDevice(&device);
  if (error == cudaSuccess)
    error = cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device);
  blocks = static_cast<unsigned>(processors) * 8;
  return error;
}

}  // namespace

cudaError_t prepare(const QueryArgs& args, Entry* first_level, cudaStream_t stream) {
  unsigned blocks = 0;
  if (const cudaError_t error = block_count(blocks); error != cudaSuccess) return error;
  prepare_all<<<blocks, kThreads, 0, stream>>>(args, first_level);
  return cudaGetLastError();
}

cudaError_t decide_rest(const QueryArgs& args, const TriangleArgs& triangles, QueryMode mode,
                        cudaStream_t stream) {
  unsigned blocks = 0;
  if (const cudaError_t error = block_count(blocks); error != cudaSuccess) return error;
  const auto kernel = mode == QueryMode::fast ? decide_by_float64<true> : decide_by_float64<false>;
  kernel<<<blocks, kThreads, 0, stream>>>(args, triangles);
  if (mode == QueryMode::exact) decide_exactly<<<blocks, kThreads, 0, stream>>>(args, triangles);
  return cudaGetLastError();
}

}  // namespace tandem::bench::paper
