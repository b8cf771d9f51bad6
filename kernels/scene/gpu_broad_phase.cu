#include "tandem/kernels/gpu_broad_phase.h"

#include <algorithm>
#include <bit>
#include <cub/device/device_radix_sort.cuh>

#include "kernels/common/check_options.h"
#include "kernels/common/cub_code.cuh"
#include "kernels/common/gpu_host.h"
#include "kernels/scene/broad_phase_boxes.cuh"
#include "kernels/scene/broad_phase_direct.cuh"
#include "kernels/scene/broad_phase_kept.cuh"
#include "kernels/scene/broad_phase_keys.cuh"
#include "kernels/scene/broad_phase_limits.h"
#include "kernels/scene/broad_phase_tree.cuh"
#include "kernels/scene/broad_phase_walk.cuh"
#include "tandem/kernels/detail/buffer.h"

namespace tandem {
namespace {

// ---------------------------------------------------------------------------------------------------------
// The tree. A block of 1,024 threads writes as many leaves, the 32 nodes above them and the one above those.

__global__ void __launch_bounds__(kFanOut* kFanOut)
    build_lower_levels(const WorldBox* boxes, const Key* sorted, int index_bits, const Survey* survey,
                       const std::uint32_t* world, const __grid_constant__ Tree tree) {
  __shared__ Node above[kFanOut];
  gpu::wait_for_kernel_before();
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  const std::uint32_t lane = threadIdx.x % kFanOut, warp = threadIdx.x / kFanOut;
  Node node = nothing();
  WorldRange worlds;
  if (i < tree.count[0]) {
    const Scale scale = scale_of(*survey);
    node.first = static_cast<std::uint32_t>(sorted[i] & ((1ull << index_bits) - 1));
    node.last = world != nullptr ? world[node.box()] : 0;
    worlds = node.leaf_worlds();
    const WorldBox box = load(boxes, node.box());
    for (int k = 0; k < 3; ++k) {
      node.lo[k] = scale(box.lo[k], k);
      node.hi[k] = scale(box.hi[k], k);
    }
    tree.level(0)[i] = node;
  }
  node = union_of_warp(node, worlds);
  const std::uint32_t parent = i / kFanOut;
  if (lane == 0) {
    above[warp] = node;
    if (parent < tree.count[1]) tree.level(1)[parent] = node;
  }
  if (tree.top < 2) return;
  __syncthreads();
  if (warp != 0) return;
  node = union_of_warp(above[lane], above[lane].worlds());
  if (lane == 0) tree.level(2)[blockIdx.x] = node;
}

__global__ void __launch_bounds__(kFanOut* kFanOut) build_upper_levels(const __grid_constant__ Tree tree) {
  gpu::wait_for_kernel_before();
  const std::uint32_t lane = threadIdx.x % kFanOut, warp = threadIdx.x / kFanOut;
  for (int level = 3; level <= tree.top; ++level) {
    for (std::uint32_t i = warp; i < tree.count[level]; i += kFanOut) {
      const std::uint32_t child = i * kFanOut + lane;
      const Node below = child < tree.count[level - 1] ? tree.level(level - 1)[child] : nothing();
      const Node node = union_of_warp(below, below.worlds());
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
// These functions cut the work.

std::uint32_t blocks_for(std::uint64_t threads, std::uint32_t size) {
  return static_cast<std::uint32_t>((threads + size - 1) / size);
}

std::uint64_t nodes_over(std::uint64_t boxes) {
  return nodes_of(tree_over(static_cast<std::uint32_t>(boxes), nullptr));
}

// Keys keep so many bits of a box's number and of its world at most, so that some are left for its place.
constexpr int kMostWorldBits = 24;

// So many blocks at most share the tests of each against each.
constexpr std::uint32_t kMostDirectBlocks = 2048;

// Bits of an index of a box.
int index_bits(std::uint32_t boxes) {
  return static_cast<int>(std::bit_width(std::max(boxes, 2u) - 1));
}

// The lowest bit that keys of so many boxes are sorted by, which have so many bits of an index and begin with
// so many of a world. Eight bits
// cost one pass of the sort; the fewer boxes, the less it matters that some lie in one cell of the curve.
int first_bit(std::uint32_t boxes, int bits, int world_bits) {
  const int passes = boxes <= 1u << 14 ? 3 : boxes <= 1u << 18 ? 4 : 6;
  return std::max(64 - 8 * passes - world_bits, bits);
}

// Warps that share a group: so many that small scenes fill a GPU too.
std::uint32_t split_of(std::uint32_t groups) {
  constexpr std::uint32_t kEnoughWarps = 8192;
  std::uint32_t split = 1;
  while (split < 8 && groups * split < kEnoughWarps) split *= 2;
  return split;
}

template <typename Boxes>
constexpr bool is_listed = false;
template <typename Boxes>
constexpr bool is_listed<Listed<Boxes>> = true;

bool is_none(const PairFilter& filter) {
  return filter.motion == nullptr && filter.group == nullptr && filter.mask == nullptr &&
         filter.world == nullptr && filter.excluded.slots == nullptr;
}

// Says what a call is about: the number of boxes or instances, where their boxes lie once they have been
// taken, where those of them lie that are kept, and how pairs are to be written.
struct Call {
  std::uint32_t numbers;
  const WorldBox* boxes;
  const WorldBox* kept;
  bool sorted;
  cudaStream_t stream;
};

// Says what is kept of fixed boxes.
struct Kept {
  // Stands for the number of boxes once those that were kept are lost; no call has so many boxes.
  static constexpr std::uint32_t kLost = kNoIndex;

  std::uint32_t of = 0;  // so many boxes or instances; 0: nothing is kept
  bool posed = false;    // of instances
  std::uint32_t free_count = 0;
  Tree tree = {};
};

// The kernels write these at their end. Each lies in cache lines of its own.
struct Outcome {
  Counters counters;
  alignas(128) GpuBroadPhaseReport report;
};

}  // namespace

using gpu::Room;
using gpu::RoomArray;

template <>
struct gpu::HostOf<GpuBroadPhaseReport> : gpu::GpuHost<Outcome, GpuBroadPhaseReport> {
  bool counters_are_fresh = false;  // a search that ends leaves them so
  RoomArray<Survey> survey{*this};

  Room<std::uint32_t> of_boxes{*this};
  RoomArray<Key> keys{of_boxes}, other_keys{of_boxes};
  RoomArray<Node> nodes{of_boxes, nodes_over};
  Room<std::uint32_t> of_pairs{*this};
  RoomArray<unsigned long long> pairs{of_pairs};
  RoomArray<unsigned long long> sorted_pairs{*this};
  RoomArray<unsigned char> sorting{*this};  // CUB's
  RoomArray<WorldBox> boxes{*this};         // of instances, or grown ones

  Kept kept;
  RoomArray<std::uint32_t> kept_list{*this};  // of those that are not kept, then of those that are
  RoomArray<Node> kept_nodes{*this};
  RoomArray<Survey> kept_survey{*this};

  bool ok(cudaError_t result) { return GpuHost::keep(result) == Status::kOk; }
  Status failure() const { return status_of(error); }
  GpuBroadPhaseCapacity capacity() const {
    return {of_boxes.count(), of_pairs.count(), static_cast<std::uint32_t>(boxes.room()),
            static_cast<std::uint32_t>(kept_list.room())};
  }

  bool begin(cudaStream_t stream) { return counters_are_fresh || refresh(stream); }

  bool refresh(cudaStream_t stream) {
    return ok(cudaMemcpyAsync(&state->counters, &kFreshCounters, sizeof kFreshCounters,
                              cudaMemcpyHostToDevice, stream));
  }

  // What is captured has not run: the counters are as before.
  void end(bool queued, cudaStream_t stream) {
    cudaStreamCaptureStatus capture = cudaStreamCaptureStatusNone;
    static_cast<void>(cudaStreamIsCapturing(stream, &capture));
    if (capture == cudaStreamCaptureStatusNone) counters_are_fresh = queued;
  }

  bool provide_fixed() {
    const auto provide_rest = [&] {
      const bool done = ok(survey.reserve(1)) &&
                        ok(cudaMemset(&state->report, 0, sizeof(GpuBroadPhaseReport))) && refresh(nullptr) &&
                        ok(cudaStreamSynchronize(nullptr));
      counters_are_fresh = done;
      return done ? Status::kOk : failure();
    };
    return provide_fixed_memory(provide_rest) == Status::kOk;
  }

  bool reserve_boxes(std::uint32_t count) {
    if (count <= of_boxes.count()) return true;
    if (ok(of_boxes.fit(count)) && reserve_sorting()) return true;
    of_boxes.forget();
    return false;
  }

  bool reserve_pairs(std::uint32_t count, bool sorted) {
    if (!ok(of_pairs.fit(count))) return false;
    if (!sorted || sorted_pairs.room() >= of_pairs.count()) return true;
    return ok(sorted_pairs.reserve(of_pairs.count())) && reserve_sorting();
  }

  // Makes room for boxes. If the room grows, the boxes that were kept in it are lost.
  bool reserve_taken(std::uint32_t count) {
    if (count > boxes.room() && kept.of != 0 && kept.posed) kept.of = Kept::kLost;
    return ok(boxes.reserve(count));
  }

  bool reserve_kept(std::uint32_t count, std::uint32_t fixed) {
    return ok(kept_list.reserve(count)) && ok(kept_survey.reserve(1)) &&
           ok(kept_nodes.reserve(nodes_over(fixed)));
  }

  // Reserves what sorting up to the capacity takes: CUB asks for a part that does not depend on the number,
  // and one that grows with it.
  bool reserve_sorting() {
    if (!ok(gpu::load_cub_code())) return false;
    std::size_t bytes = 0, pair_bytes = 0;
    cub::DoubleBuffer<Key> key(keys.data(), other_keys.data());
    if (!ok(cub::DeviceRadixSort::SortKeys(nullptr, bytes, key, of_boxes.count()))) return false;
    if (sorted_pairs.room() != 0) {
      cub::DoubleBuffer<unsigned long long> pair(pairs.data(), sorted_pairs.data());
      if (!ok(cub::DeviceRadixSort::SortKeys(nullptr, pair_bytes, pair, of_pairs.count()))) return false;
    }
    return ok(sorting.reserve(std::max(bytes, pair_bytes)));
  }

  // Why a call cannot be queued.
  Status refusal(std::uint32_t count, bool posed, const GpuBroadPhaseOptions& options) const {
    if (const Status status = check_reach(options.within); status != Status::kOk) return status;
    if (report.data() == nullptr || count > of_boxes.count() ||
        (options.sorted && sorted_pairs.room() < of_pairs.count()) ||
        (options.within > 0 && count > boxes.room()))
      return Status::kOutOfRange;
    if (kept.of != 0 && (kept.of != count || kept.posed != posed)) return Status::kKeptMismatch;
    return options.filter.excluded.instances > count ? Status::kUnknownInstance : Status::kOk;
  }

  Output output(const Call& call) {
    return {pairs.data(),         of_pairs.count(), call.sorted ? index_bits(call.numbers) : 0,
            call.sorted ? 0 : 32, &state->counters, &state->report,
            report.data()};
  }

  template <typename... Parameters, typename... Arguments>
  bool launch(std::uint32_t blocks, std::uint32_t threads, cudaStream_t stream, void (*kernel)(Parameters...),
              const Arguments&... arguments) {
    return ok(gpu::launch_after({blocks, threads, 0, stream, limits.early_launch}, kernel, arguments...));
  }

  template <typename Boxes, typename Rule>
  bool test_all(const Boxes& from, std::uint32_t count, const Rule& rule, const Call& call) {
    const std::uint32_t tiles = std::max(blocks_for(count, kTile), 1u), tasks = tiles * (tiles + 1) / 2,
                        tasks_each = blocks_for(tasks, kMostDirectBlocks);
    return launch(blocks_for(tasks, tasks_each), kTileThreads, call.stream, collect_directly<Boxes, Rule>,
                  from, count, rule, output(call), tasks_each, tasks);
  }

  // from: where the boxes of the tree come from. world: of each box; null: there is one. Where worlds have
  // numbers below that of boxes, keys tell all of them apart.
  template <typename Boxes>
  bool make_tree(const Boxes& from, const std::uint32_t* world, const Tree& tree, Survey* surveyed,
                 const Call& call) {
    const std::uint32_t count = tree.count[0];
    const int bits = index_bits(call.numbers);
    const WorldKeys worlds = {world, world != nullptr ? std::min(bits, kMostWorldBits) : 0};
    if (!launch(4, kSamples * kThreadsPerSample, call.stream, survey_boxes<Boxes>, from, count, surveyed) ||
        !launch(blocks_for(count, 256), 256, call.stream, make_keys<Boxes>, from, count, bits, surveyed,
                worlds, keys.data(), &state->counters))
      return false;
    cub::DoubleBuffer<Key> key(keys.data(), other_keys.data());
    std::size_t bytes = sorting.room();
    if (!ok(cub::DeviceRadixSort::SortKeys(sorting.data(), bytes, key, count,
                                           first_bit(count, bits, worlds.bits), 64, call.stream)))
      return false;
    constexpr std::uint32_t kThreads = kFanOut * kFanOut;
    return launch(blocks_for(count, kThreads), kThreads, call.stream, build_lower_levels, call.boxes,
                  key.Current(), bits, surveyed, world, tree) &&
           (tree.top <= 2 || launch(1, kThreads, call.stream, build_upper_levels, tree));
  }

  template <typename Boxes, typename Rule>
  bool collect_with_kept(const Boxes& from, const Rule& rule, const Call& call) {
    const std::uint32_t blocks = std::min(blocks_for(kept.free_count, kKeptWarps), kMostKeptBlocks);
    return blocks == 0 ||
           launch(blocks, kKeptWarps * kFanOut, call.stream, collect_kept<Boxes, Rule>, from, kept.free_count,
                  kept.tree, kept_survey.data(), call.kept, rule, output(call));
  }

  template <typename Rule>
  bool collect(const Tree& tree, const Rule& rule, const Call& call) {
    const Output out = output(call);
    const std::uint32_t split = split_of(tree.count[1]);
    const std::uint32_t blocks = blocks_for(static_cast<std::uint64_t>(tree.count[1]) * split, kWarps);
    return launch(blocks, kWarps * kFanOut, call.stream, collect_pairs<Rule>, tree, split, call.boxes, rule,
                  out) &&
           launch(1, 1, call.stream, report_pairs, out);
  }

  // Sorts as many keys as there is room for, because the CPU does not know their number.
  bool sort_pairs(const Call& call) {
    const std::uint32_t room = of_pairs.count();
    if (room == 0) return true;
    const int bits = index_bits(call.numbers);
    const std::uint32_t blocks = blocks_for(room, 256);
    if (!launch(blocks, 256, call.stream, fill_rest, pairs.data(), room, device_report())) return false;
    cub::DoubleBuffer<unsigned long long> key(pairs.data(), sorted_pairs.data());
    std::size_t bytes = sorting.room();
    if (!ok(cub::DeviceRadixSort::SortKeys(sorting.data(), bytes, key, room, 0, 2 * bits, call.stream)))
      return false;
    return launch(blocks, 256, call.stream, unpack_keys, key.Current(), room, bits,
                  reinterpret_cast<ObjectPair*>(pairs.data()), device_report());
  }

  // The pairs with what is kept come first, because the last kernel of the others writes the report.
  template <typename Boxes, typename Rule>
  bool find(const Boxes& from, std::uint32_t count, const Rule& rule, const Call& call) {
    if constexpr (is_listed<Boxes>) {
      if (!collect_with_kept(from, rule, call)) return false;
    }
    if (count <= kFewBoxes) {
      if (!test_all(from, count, rule, call)) return false;
    } else {
      const Tree tree = tree_over(count, nodes.data());
      if (!make_tree(from, rule.worlds(), tree, survey.data(), call) || !collect(tree, rule, call))
        return false;
    }
    return !call.sorted || sort_pairs(call);
  }

  // A middling number of instances is posed by a kernel of its own.
  template <typename Boxes, typename Rule>
  bool pose_and_find(const Boxes& from, std::uint32_t count, const Rule& rule, const Call& call) {
    if constexpr (Boxes::kPosed) {
      if (count > kFewPosed && count <= kFewBoxes) {
        return launch(blocks_for(count, 256), 256, call.stream, pose_boxes<Boxes>, from, count,
                      &state->counters) &&
               find(from.lying_at(boxes.data()), count, rule, call);
      }
    }
    return find(from, count, rule, call);
  }

  // Boxes within reach of each other meet when each is larger by half of it; or one by all of it where the
  // other is kept, which is kept for any reach.
  template <typename Boxes, typename Rule>
  bool grow_and_find(const Boxes& from, std::uint32_t count, const Rule& rule, double within, Call call) {
    if (!(within > 0)) return pose_and_find(from, count, rule, call);
    const double margin = is_listed<Boxes> ? within : 0.5 * within;
    call.boxes = boxes.data();
    return (count == 0 || launch(blocks_for(count, 256), 256, call.stream, grow_boxes<Boxes>, from, count,
                                 margin, boxes.data(), &state->counters)) &&
           find(from.lying_at(boxes.data()), count, rule, call);
  }

  // all: boxes or instances, the kept ones included.
  template <typename Boxes>
  Status run(const Boxes& all, const GpuBroadPhaseOptions& options, const Call& call) {
    const Status status = refusal(call.numbers, Boxes::kPosed, options);
    if (status != Status::kOk) return status;
    bool queued = begin(call.stream);
    if (queued && kept.of != 0) {
      queued = grow_and_find(Listed<Boxes>{all, kept_list.data()}, kept.free_count,
                             FilteredPairs{options.filter}, options.within, call);
    } else if (queued && !is_none(options.filter)) {
      queued = grow_and_find(all, call.numbers, FilteredPairs{options.filter}, options.within, call);
    } else if (queued) {
      queued = grow_and_find(all, call.numbers, EveryPair{}, options.within, call);
    }
    end(queued, call.stream);
    return queued ? Status::kOk : failure();
  }

  // Uploads what motions say of which boxes are kept, and waits.
  Status list(std::span<const Motion> motion, cudaStream_t stream) {
    Buffer<std::uint32_t> numbers;
    if (!numbers.resize(motion.size())) return Status::kOutOfMemory;
    std::uint32_t free_end = 0, end = kept.free_count;
    for (std::uint32_t i = 0; i < motion.size(); ++i)
      numbers[motion[i] == Motion::fixed ? end++ : free_end++] = i;
    const bool uploaded = ok(kept_list.upload(numbers.view(), stream)) && ok(cudaStreamSynchronize(stream));
    return uploaded ? Status::kOk : failure();
  }

  // lie: where the boxes of those that are kept are to be found.
  template <typename Boxes>
  Status keep_fixed(const Boxes& all, const WorldBox* lie, std::span<const Motion> motion,
                    const std::uint32_t* world, cudaStream_t stream) {
    const auto count = static_cast<std::uint32_t>(motion.size());
    const auto fixed = static_cast<std::uint32_t>(std::count(motion.begin(), motion.end(), Motion::fixed));
    if (fixed == 0) return Status::kOk;
    kept.free_count = count - fixed;
    if (!provide_fixed() || !reserve_boxes(count) || !reserve_kept(count, fixed)) return failure();
    if (const Status status = list(motion, stream); status != Status::kOk) return status;
    kept.tree = tree_over(fixed, kept_nodes.data());
    const Call call = {count, lie, lie, false, stream};
    const bool queued = begin(stream) &&
                        make_tree(Listed<Boxes>{all, kept_list.data() + kept.free_count}, world, kept.tree,
                                  kept_survey.data(), call) &&
                        launch(1, 1, stream, report_pairs, output(call));
    end(queued, stream);
    if (!queued || !ok(cudaStreamSynchronize(stream))) return failure();
    if (report->status != Status::kOk) return report->status;
    kept.of = count;
    kept.posed = Boxes::kPosed;
    return Status::kOk;
  }

  // The first guess of room is four pairs for each box.
  template <typename Enqueue>
  Status find_all(GpuBroadPhaseCapacity first, const GpuBroadPhaseOptions& options, cudaStream_t stream,
                  const Enqueue& enqueue) {
    const auto pairs_of = [](std::uint64_t room) {
      return static_cast<std::uint32_t>(std::min<std::uint64_t>(room, kNoIndex - 1));
    };
    first.pairs = of_pairs.count() > 0 ? of_pairs.count() : pairs_of(4ull * first.boxes + 1024);
    return gpu::find_until_complete(*this, first, options, stream, enqueue,
                                    [&](const GpuBroadPhaseReport& told, GpuBroadPhaseCapacity& wanted) {
                                      wanted.pairs = pairs_of(told.found + told.found / 4);
                                      return told.found >= kNoIndex ? Status::kTooManyPairs : Status::kOk;
                                    });
  }

  Status reserve(const GpuBroadPhaseCapacity& wanted, const GpuBroadPhaseOptions& options) {
    if (wanted.boxes == kNoIndex) return Status::kOutOfRange;
    const bool enough = provide_fixed() && reserve_boxes(wanted.boxes) &&
                        reserve_pairs(wanted.pairs, options.sorted) &&
                        reserve_taken(std::max(wanted.instances, options.within > 0 ? wanted.boxes : 0));
    return enough ? Status::kOk : failure();
  }
};
template class GpuQuestion<GpuBroadPhaseCapacity, GpuBroadPhaseReport, GpuBroadPhaseOptions>;

Status GpuBroadPhase::keep_fixed(const WorldBox* boxes, std::span<const Motion> motion,
                                 const std::uint32_t* world, cudaStream_t stream) {
  if (host_ == nullptr) return Status::kOutOfMemory;
  host_->kept.of = 0;
  if (motion.size() >= kNoIndex) return Status::kOutOfRange;
  if (reinterpret_cast<std::uintptr_t>(boxes) % 16 != 0) return Status::kMisaligned;
  return host_->keep_fixed(GivenBoxes{boxes}, boxes, motion, world, stream);
}

Status GpuBroadPhase::keep_fixed(const GpuInstances& instances, const GpuAssetBounds& assets,
                                 std::span<const Motion> motion, const std::uint32_t* world,
                                 cudaStream_t stream) {
  if (host_ == nullptr) return Status::kOutOfMemory;
  auto& host = *host_;
  host.kept.of = 0;
  if (motion.size() != instances.count) return Status::kKeptMismatch;
  if (!host.reserve_taken(instances.count)) return host.failure();
  WorldBox* const boxes = host.boxes.data();
  return host.keep_fixed(PosedBoxes{instances, assets, boxes}, boxes, motion, world, stream);
}

Status GpuBroadPhase::enqueue(const WorldBox* boxes, std::uint32_t count, const GpuBroadPhaseOptions& options,
                              cudaStream_t stream) {
  if (host_ == nullptr) return Status::kOutOfRange;
  if (reinterpret_cast<std::uintptr_t>(boxes) % 16 != 0) return Status::kMisaligned;
  return host_->run(GivenBoxes{boxes}, options, {count, boxes, boxes, options.sorted, stream});
}

Status GpuBroadPhase::enqueue(const GpuInstances& instances, const GpuAssetBounds& assets,
                              const GpuBroadPhaseOptions& options, cudaStream_t stream) {
  if (host_ == nullptr || instances.count > host_->boxes.room()) return Status::kOutOfRange;
  WorldBox* const boxes = host_->boxes.data();
  return host_->run(PosedBoxes{instances, assets, boxes}, options,
                    {instances.count, boxes, boxes, options.sorted, stream});
}

Status GpuBroadPhase::find_pairs(const WorldBox* boxes, std::uint32_t count,
                                 const GpuBroadPhaseOptions& options, cudaStream_t stream) {
  if (host_ == nullptr) return Status::kOutOfMemory;
  return host_->find_all({count, 0, 0}, options, stream,
                         [&] { return enqueue(boxes, count, options, stream); });
}

Status GpuBroadPhase::find_pairs(const GpuInstances& instances, const GpuAssetBounds& assets,
                                 const GpuBroadPhaseOptions& options, cudaStream_t stream) {
  if (host_ == nullptr) return Status::kOutOfMemory;
  return host_->find_all({instances.count, 0, instances.count}, options, stream,
                         [&] { return enqueue(instances, assets, options, stream); });
}

GpuPairs GpuBroadPhase::pairs() const {
  return {reinterpret_cast<const ObjectPair*>(host_->pairs.data()), &host_->device_report()->count,
          host_->of_pairs.count()};
}

const WorldBox* GpuBroadPhase::boxes() const {
  return host_->boxes.data();
}

}  // namespace tandem
