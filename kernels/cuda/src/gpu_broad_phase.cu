#include "tandem/kernels/gpu_broad_phase.h"

#include <algorithm>
#include <bit>
#include <cub/device/device_radix_sort.cuh>
#include <new>

#include "broad_phase_boxes.cuh"
#include "broad_phase_direct.cuh"
#include "broad_phase_keys.cuh"
#include "broad_phase_limits.h"
#include "broad_phase_tree.cuh"
#include "broad_phase_walk.cuh"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_status.h"

namespace tandem {
namespace {

// ---------------------------------------------------------------------------------------------------------
// The tree. A block of 1,024 threads writes as many leaves, the 32 nodes above them and the one above those.

__global__ void __launch_bounds__(kFanOut* kFanOut)
    build_lower_levels(const WorldBox* boxes, const Key* sorted, int index_bits, const Survey* survey,
                       const __grid_constant__ Tree tree) {
  __shared__ Node above[kFanOut];
  gpu::wait_for_kernel_before();
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  const std::uint32_t lane = threadIdx.x % kFanOut, warp = threadIdx.x / kFanOut;
  Node node = nothing();
  if (i < tree.count[0]) {
    const Scale scale = scale_of(*survey);
    node.box = static_cast<std::uint32_t>(sorted[i] & ((1ull << index_bits) - 1));
    const WorldBox box = load(boxes, node.box);
    for (int k = 0; k < 3; ++k) {
      node.lo[k] = scale(box.lo[k], k);
      node.hi[k] = scale(box.hi[k], k);
    }
    tree.level(0)[i] = node;
  }
  node = union_of_warp(node);
  const std::uint32_t parent = i / kFanOut;
  if (lane == 0) {
    above[warp] = node;
    if (parent < tree.count[1]) tree.level(1)[parent] = node;
  }
  if (tree.top < 2) return;
  __syncthreads();
  if (warp != 0) return;
  node = union_of_warp(above[lane]);
  if (lane == 0) tree.level(2)[blockIdx.x] = node;
}

__global__ void __launch_bounds__(kFanOut* kFanOut) build_upper_levels(const __grid_constant__ Tree tree) {
  gpu::wait_for_kernel_before();
  const std::uint32_t lane = threadIdx.x % kFanOut, warp = threadIdx.x / kFanOut;
  for (int level = 3; level <= tree.top; ++level) {
    for (std::uint32_t i = warp; i < tree.count[level]; i += kFanOut) {
      const std::uint32_t child = i * kFanOut + lane;
      const Node node =
          union_of_warp(child < tree.count[level - 1] ? tree.level(level - 1)[child] : nothing());
      if (lane == 0) tree.level(level)[i] = node;
    }
    __syncthreads();
  }
}

// ---------------------------------------------------------------------------------------------------------
// The end.

__global__ void report_pairs(const __grid_constant__ Output output) {
  gpu::wait_for_kernel_before();
  write_report(output, output.counters->found);
}

// Keys of no pair: they come last, because of two numbers of so many bits that a < b not both are all ones.
__global__ void fill_rest(unsigned long long* keys, std::uint32_t capacity,
                          const GpuBroadPhaseReport* report) {
  gpu::wait_for_kernel_before();
  const std::uint64_t i = static_cast<std::uint64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i >= report->count && i < capacity) keys[i] = ~0ull;
}

__global__ void unpack_keys(const unsigned long long* keys, std::uint32_t capacity, int bits,
                            ObjectPair* pairs, const GpuBroadPhaseReport* report) {
  gpu::wait_for_kernel_before();
  const std::uint64_t i = static_cast<std::uint64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i >= report->count || i >= capacity) return;
  const unsigned long long key = keys[i];
  pairs[i] = {static_cast<std::uint32_t>(key >> bits),
              static_cast<std::uint32_t>(key & ((1ull << bits) - 1))};
}

// ---------------------------------------------------------------------------------------------------------
// How work is cut.

std::uint32_t blocks_for(std::uint64_t threads, std::uint32_t size) {
  return static_cast<std::uint32_t>((threads + size - 1) / size);
}

// So many blocks at most share the tests of each against each.
constexpr std::uint32_t kMostDirectBlocks = 2048;

// Bits of an index of a box.
int index_bits(std::uint32_t boxes) {
  return static_cast<int>(std::bit_width(std::max(boxes, 2u) - 1));
}

// The lowest bit that keys are sorted by. Eight bits cost one pass of the sort; the fewer boxes, the less it
// matters that some lie in one cell of the curve.
int first_bit(std::uint32_t boxes) {
  const int passes = boxes <= 1u << 14 ? 3 : boxes <= 1u << 18 ? 4 : 6;
  return std::max(64 - 8 * passes, index_bits(boxes));
}

// Warps that share a group: so many that small scenes fill a GPU too.
std::uint32_t split_of(std::uint32_t groups) {
  constexpr std::uint32_t kEnoughWarps = 8192;
  std::uint32_t split = 1;
  while (split < 8 && groups * split < kEnoughWarps) split *= 2;
  return split;
}

}  // namespace

struct GpuBroadPhase::State {
  GpuArray<WorldBox> boxes;
  GpuArray<Key> keys[2];
  GpuArray<Node> nodes;
  GpuArray<unsigned long long> pairs, sorted_pairs;
  GpuArray<unsigned char> sorting;  // CUB's
  GpuArray<Survey> survey;
  GpuArray<Counters> counters;
  bool counters_are_fresh = false;  // a search that ends leaves them so
  GpuArray<GpuBroadPhaseReport> report;
  PinnedArray<GpuBroadPhaseReport> host_report;
  GpuBroadPhaseCapacity capacity;
  gpu::DeviceLimits limits = {};
  cudaError_t error = cudaSuccess;

  // Of a call: true, or what went wrong is kept.
  bool ok(cudaError_t result) {
    if (result == cudaSuccess) return true;
    error = result;
    static_cast<void>(cudaGetLastError());  // later calls must not report it again
    return false;
  }
  Status failure() const { return status_of(error); }

  bool reserve_fixed();
  bool reserve_boxes(std::uint32_t count);
  bool reserve_pairs(std::uint32_t count, bool sorted);
  bool reserve_sorting();
  Status refusal(std::uint32_t count, const GpuBroadPhaseOptions& options) const;
  Output output(std::uint32_t count, bool sorted);
  template <typename... Parameters, typename... Arguments>
  bool launch(std::uint32_t blocks, std::uint32_t threads, cudaStream_t stream, void (*kernel)(Parameters...),
              const Arguments&... arguments);
  bool refresh(cudaStream_t stream);
  bool begin(cudaStream_t stream) { return counters_are_fresh || refresh(stream); }
  void end(bool queued, cudaStream_t stream);
  template <typename Boxes>
  bool test_all(const Boxes& from, std::uint32_t count, bool sorted, cudaStream_t stream);
  template <typename Boxes>
  bool make_tree(const Boxes& from, const WorldBox* given, const Tree& tree, cudaStream_t stream);
  bool collect(const WorldBox* given, const Tree& tree, bool sorted, cudaStream_t stream);
  bool sort_pairs(std::uint32_t count, cudaStream_t stream);
  template <typename Boxes>
  bool run(const Boxes& from, const WorldBox* given, std::uint32_t count, bool sorted, cudaStream_t stream);
  template <typename Enqueue>
  Status find(GpuBroadPhase& self, GpuBroadPhaseCapacity wanted, const GpuBroadPhaseOptions& options,
              cudaStream_t stream, const Enqueue& enqueue);
};

bool GpuBroadPhase::State::refresh(cudaStream_t stream) {
  return ok(cudaMemcpyAsync(counters.data(), &kFreshCounters, sizeof kFreshCounters, cudaMemcpyHostToDevice,
                            stream));
}

// What is captured has not run: the counters are as before.
void GpuBroadPhase::State::end(bool queued, cudaStream_t stream) {
  cudaStreamCaptureStatus capture = cudaStreamCaptureStatusNone;
  static_cast<void>(cudaStreamIsCapturing(stream, &capture));
  if (capture == cudaStreamCaptureStatusNone) counters_are_fresh = queued;
}

bool GpuBroadPhase::State::reserve_fixed() {
  if (host_report.data() != nullptr) return true;
  if (!ok(gpu::limits_of_device(limits)) || !ok(survey.reserve(1)) || !ok(counters.reserve(1)) ||
      !ok(report.reserve(1)) || !ok(cudaMemset(report.data(), 0, report.bytes())) || !refresh(nullptr) ||
      !ok(cudaStreamSynchronize(nullptr)) || !ok(host_report.reserve(1)))
    return false;
  *host_report = {};
  counters_are_fresh = true;
  return true;
}

bool GpuBroadPhase::State::reserve_boxes(std::uint32_t count) {
  if (count <= capacity.boxes) return true;
  capacity.boxes = 0;
  for (int i = 0; i < 2; ++i) {
    if (!ok(keys[i].reserve(count))) return false;
  }
  if (!ok(nodes.reserve(nodes_of(tree_over(count, nullptr))))) return false;
  capacity.boxes = count;
  return reserve_sorting();
}

bool GpuBroadPhase::State::reserve_pairs(std::uint32_t count, bool sorted) {
  const std::uint32_t before = capacity.pairs;
  if (count > before) {
    capacity.pairs = 0;
    if (!ok(pairs.reserve(count))) return false;
    capacity.pairs = count;
  }
  if (!sorted || sorted_pairs.room() >= capacity.pairs) return true;
  return ok(sorted_pairs.reserve(capacity.pairs)) && reserve_sorting();
}

// As much as sorting up to the capacity takes: CUB asks for a part that does not depend on the number, and
// one that grows with it.
bool GpuBroadPhase::State::reserve_sorting() {
  std::size_t bytes = 0, pair_bytes = 0;
  cub::DoubleBuffer<Key> key(keys[0].data(), keys[1].data());
  if (!ok(cub::DeviceRadixSort::SortKeys(nullptr, bytes, key, capacity.boxes))) return false;
  if (sorted_pairs.room() != 0) {
    cub::DoubleBuffer<unsigned long long> pair(pairs.data(), sorted_pairs.data());
    if (!ok(cub::DeviceRadixSort::SortKeys(nullptr, pair_bytes, pair, capacity.pairs))) return false;
  }
  return ok(sorting.reserve(std::max(bytes, pair_bytes)));
}

// Why a call cannot be queued.
Status GpuBroadPhase::State::refusal(std::uint32_t count, const GpuBroadPhaseOptions& options) const {
  const bool enough = count <= capacity.boxes && (!options.sorted || sorted_pairs.room() >= capacity.pairs);
  return enough ? Status::kOk : Status::kOutOfRange;
}

Output GpuBroadPhase::State::output(std::uint32_t count, bool sorted) {
  return {pairs.data(),  capacity.pairs,    sorted ? index_bits(count) : 0, sorted ? 0 : 32, counters.data(),
          report.data(), host_report.data()};
}

template <typename... Parameters, typename... Arguments>
bool GpuBroadPhase::State::launch(std::uint32_t blocks, std::uint32_t threads, cudaStream_t stream,
                                  void (*kernel)(Parameters...), const Arguments&... arguments) {
  return ok(gpu::launch_after({blocks, threads, 0, stream, limits.early_launch}, kernel, arguments...));
}

template <typename Boxes>
bool GpuBroadPhase::State::test_all(const Boxes& from, std::uint32_t count, bool sorted,
                                    cudaStream_t stream) {
  const std::uint32_t tiles = std::max(blocks_for(count, kTile), 1u), tasks = tiles * (tiles + 1) / 2,
                      tasks_each = blocks_for(tasks, kMostDirectBlocks);
  return launch(blocks_for(tasks, tasks_each), kTileThreads, stream, collect_directly<Boxes>, from, count,
                output(count, sorted), tasks_each, tasks);
}

// from: where the boxes come from; given: where they lie once they have been taken.
template <typename Boxes>
bool GpuBroadPhase::State::make_tree(const Boxes& from, const WorldBox* given, const Tree& tree,
                                     cudaStream_t stream) {
  const std::uint32_t count = tree.count[0];
  const int bits = index_bits(count);
  if (!launch(4, kSamples * kThreadsPerSample, stream, survey_boxes<Boxes>, from, count, survey.data()) ||
      !launch(blocks_for(count, 256), 256, stream, make_keys<Boxes>, from, count, bits, survey.data(),
              keys[0].data(), counters.data()))
    return false;
  cub::DoubleBuffer<Key> key(keys[0].data(), keys[1].data());
  std::size_t bytes = sorting.room();
  if (!ok(cub::DeviceRadixSort::SortKeys(sorting.data(), bytes, key, count, first_bit(count), 64, stream)))
    return false;
  constexpr std::uint32_t kThreads = kFanOut * kFanOut;
  return launch(blocks_for(count, kThreads), kThreads, stream, build_lower_levels, given, key.Current(), bits,
                survey.data(), tree) &&
         (tree.top <= 2 || launch(1, kThreads, stream, build_upper_levels, tree));
}

bool GpuBroadPhase::State::collect(const WorldBox* given, const Tree& tree, bool sorted,
                                   cudaStream_t stream) {
  const Output out = output(tree.count[0], sorted);
  const std::uint32_t split = split_of(tree.count[1]);
  const std::uint32_t blocks = blocks_for(static_cast<std::uint64_t>(tree.count[1]) * split, kWarps);
  return launch(blocks, kWarps * kFanOut, stream, collect_pairs, tree, split, given, out) &&
         launch(1, 1, stream, report_pairs, out);
}

// Sorts as many keys as there is room for, because the CPU does not know their number.
bool GpuBroadPhase::State::sort_pairs(std::uint32_t count, cudaStream_t stream) {
  if (capacity.pairs == 0) return true;
  const int bits = index_bits(count);
  const std::uint32_t blocks = blocks_for(capacity.pairs, 256);
  if (!launch(blocks, 256, stream, fill_rest, pairs.data(), capacity.pairs, report.data())) return false;
  cub::DoubleBuffer<unsigned long long> key(pairs.data(), sorted_pairs.data());
  std::size_t bytes = sorting.room();
  if (!ok(cub::DeviceRadixSort::SortKeys(sorting.data(), bytes, key, capacity.pairs, 0, 2 * bits, stream)))
    return false;
  return launch(blocks, 256, stream, unpack_keys, key.Current(), capacity.pairs, bits,
                reinterpret_cast<ObjectPair*>(pairs.data()), report.data());
}

template <typename Boxes>
bool GpuBroadPhase::State::run(const Boxes& from, const WorldBox* given, std::uint32_t count, bool sorted,
                               cudaStream_t stream) {
  if (count <= kFewBoxes) {
    if (!test_all(from, count, sorted, stream)) return false;
  } else {
    const Tree tree = tree_over(count, nodes.data());
    if (!make_tree(from, given, tree, stream) || !collect(given, tree, sorted, stream)) return false;
  }
  return !sorted || sort_pairs(count, stream);
}

// The first guess of room is four pairs for each box.
template <typename Enqueue>
Status GpuBroadPhase::State::find(GpuBroadPhase& self, GpuBroadPhaseCapacity wanted,
                                  const GpuBroadPhaseOptions& options, cudaStream_t stream,
                                  const Enqueue& enqueue) {
  std::uint64_t room = capacity.pairs > 0 ? capacity.pairs : 4ull * wanted.boxes + 1024;
  for (;;) {
    wanted.pairs = static_cast<std::uint32_t>(std::min<std::uint64_t>(room, kNoIndex - 1));
    if (const Status status = self.reserve(wanted, options); status != Status::kOk) return status;
    if (const Status status = enqueue(); status != Status::kOk) return status;
    if (!ok(cudaStreamSynchronize(stream))) return failure();
    const GpuBroadPhaseReport& told = *host_report;
    if (told.status != Status::kOk || told.complete != 0) return told.status;
    if (told.found >= kNoIndex) return Status::kTooManyPairs;
    room = told.found + told.found / 4;
  }
}

GpuBroadPhase::GpuBroadPhase() = default;
GpuBroadPhase::GpuBroadPhase(GpuBroadPhase&&) noexcept = default;
GpuBroadPhase& GpuBroadPhase::operator=(GpuBroadPhase&&) noexcept = default;
GpuBroadPhase::~GpuBroadPhase() = default;

bool GpuBroadPhase::provide_state() {
  if (state_ == nullptr) state_.reset(new (std::nothrow) State);
  return state_ != nullptr;
}

Status GpuBroadPhase::reserve(const GpuBroadPhaseCapacity& capacity, const GpuBroadPhaseOptions& options) {
  if (capacity.boxes == kNoIndex) return Status::kOutOfRange;
  if (!provide_state()) return Status::kOutOfMemory;
  const bool enough = state_->reserve_fixed() && state_->reserve_boxes(capacity.boxes) &&
                      state_->reserve_pairs(capacity.pairs, options.sorted) &&
                      state_->ok(state_->boxes.reserve(capacity.instances));
  return enough ? Status::kOk : state_->failure();
}

Status GpuBroadPhase::enqueue(const WorldBox* boxes, std::uint32_t count, const GpuBroadPhaseOptions& options,
                              cudaStream_t stream) {
  if (state_ == nullptr) return Status::kOutOfRange;
  if (const Status status = state_->refusal(count, options); status != Status::kOk) return status;
  if (reinterpret_cast<std::uintptr_t>(boxes) % 16 != 0) return Status::kMisaligned;
  const bool queued =
      state_->begin(stream) && state_->run(GivenBoxes{boxes}, boxes, count, options.sorted, stream);
  state_->end(queued, stream);
  return queued ? Status::kOk : state_->failure();
}

Status GpuBroadPhase::enqueue(const GpuInstances& instances, const GpuAssetBounds& assets,
                              const GpuBroadPhaseOptions& options, cudaStream_t stream) {
  if (state_ == nullptr || instances.count > state_->boxes.room()) return Status::kOutOfRange;
  State& state = *state_;
  const std::uint32_t count = instances.count;
  if (const Status status = state.refusal(count, options); status != Status::kOk) return status;
  WorldBox* const boxes = state.boxes.data();
  const PosedBoxes posed = {instances, assets, boxes};
  bool queued = state.begin(stream);
  if (queued && (count <= kFewPosed || count > kFewBoxes)) {
    queued = state.run(posed, boxes, count, options.sorted, stream);
  } else if (queued) {
    queued = state.launch(blocks_for(count, 256), 256, stream, pose_boxes, posed, state.counters.data()) &&
             state.run(GivenBoxes{boxes}, boxes, count, options.sorted, stream);
  }
  state.end(queued, stream);
  return queued ? Status::kOk : state.failure();
}

Status GpuBroadPhase::find_pairs(const WorldBox* boxes, std::uint32_t count,
                                 const GpuBroadPhaseOptions& options, cudaStream_t stream) {
  if (!provide_state()) return Status::kOutOfMemory;
  return state_->find(*this, {count, 0, 0}, options, stream,
                      [&] { return enqueue(boxes, count, options, stream); });
}

Status GpuBroadPhase::find_pairs(const GpuInstances& instances, const GpuAssetBounds& assets,
                                 const GpuBroadPhaseOptions& options, cudaStream_t stream) {
  if (!provide_state()) return Status::kOutOfMemory;
  return state_->find(*this, {instances.count, 0, instances.count}, options, stream,
                      [&] { return enqueue(instances, assets, options, stream); });
}

GpuPairs GpuBroadPhase::pairs() const {
  return {reinterpret_cast<const ObjectPair*>(state_->pairs.data()), &state_->report->count,
          state_->capacity.pairs};
}

const WorldBox* GpuBroadPhase::boxes() const {
  return state_->boxes.data();
}
const GpuBroadPhaseReport* GpuBroadPhase::device_report() const {
  return state_->report.data();
}
const GpuBroadPhaseReport& GpuBroadPhase::report() const {
  return *state_->host_report;
}

GpuBroadPhaseCapacity GpuBroadPhase::capacity() const {
  if (state_ == nullptr) return {};
  GpuBroadPhaseCapacity capacity = state_->capacity;
  capacity.instances = static_cast<std::uint32_t>(state_->boxes.room());
  return capacity;
}

std::size_t GpuBroadPhase::bytes() const {
  if (state_ == nullptr) return 0;
  const State& s = *state_;
  return s.boxes.bytes() + s.keys[0].bytes() + s.keys[1].bytes() + s.nodes.bytes() + s.pairs.bytes() +
         s.sorted_pairs.bytes() + s.sorting.bytes() + s.survey.bytes() + s.counters.bytes() +
         s.report.bytes();
}

cudaError_t GpuBroadPhase::cuda_error() const {
  return state_ == nullptr ? cudaSuccess : state_->error;
}

}  // namespace tandem
