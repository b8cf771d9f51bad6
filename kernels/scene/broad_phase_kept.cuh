#pragma once
#include "kernels/scene/broad_phase_boxes.cuh"
#include "kernels/scene/broad_phase_keys.cuh"
#include "kernels/scene/broad_phase_output.cuh"

// Boxes against the tree of fixed ones that is kept from call to call.
namespace tandem {
namespace {

constexpr std::uint32_t kKeptWarps = 4;          // of a thread block
constexpr std::uint32_t kMostKeptBlocks = 4096;  // so many share the boxes
constexpr std::uint32_t kKeptWaiting = 2 * kFanOut;

// A warp, and one box after another against the tree: the lanes test the 32 children of a node.
template <typename Rule>
class KeptWalk {
 public:
  // boxes: of all, by their numbers, as far as they are in the tree. waiting: kKeptWaiting keys of pairs that
  // the warp holds back.
  __device__ KeptWalk(const Tree& tree, const Scale& scale, const WorldBox* boxes, const Rule& rule,
                      const Output& output, unsigned long long* waiting)
      : tree_(tree), scale_(scale), boxes_(boxes), rule_(rule), output_(output), waiting_(waiting) {}

  // Runs with the same box in every lane.
  __device__ void run(const WorldBox& box, std::uint32_t number) {
    begin(box, number);
    int level = tree_.top;
    std::uint32_t first = 0, pending = children_hit(level, first);
    // Lane i keeps what is left to do at level i.
    std::uint32_t left_first = 0, left_pending = 0;
    for (;;) {
      if (pending == 0) {
        if (level == tree_.top) return;
        ++level;
        first = __shfl_sync(kAllLanes, left_first, level);
        pending = __shfl_sync(kAllLanes, left_pending, level);
        continue;
      }
      const std::uint32_t child = first + lowest(pending);
      pending &= pending - 1;
      if (level == 1) {
        test_leaves(child * kFanOut);
        continue;
      }
      if (lane_index() == static_cast<std::uint32_t>(level)) {
        left_first = first;
        left_pending = pending;
      }
      --level;
      first = child * kFanOut;
      pending = children_hit(level, first);
    }
  }

  // Stores what waits, as far as there is room.
  __device__ void flush() {
    __syncwarp();
    unsigned long long begin = 0;
    if (lane_index() == 0 && count_ > 0)
      begin = atomicAdd(&output_.counters->found, static_cast<unsigned long long>(count_));
    begin = __shfl_sync(kAllLanes, begin, 0);
    for (std::uint32_t i = lane_index(); i < count_; i += kFanOut) {
      if (begin + i < output_.capacity) output_.pairs[begin + i] = waiting_[i];
    }
    __syncwarp();
    count_ = 0;
  }

 private:
  // Takes a box to the tree's own float32 coordinates. broad_phase_tree.cuh needs one monotone function for
  // it and the tree's boxes.
  __device__ void begin(const WorldBox& box, std::uint32_t number) {
    box_ = box;
    number_ = number;
    has_worlds_ = rule_.worlds() != nullptr;
    if (has_worlds_) mine_.last = rule_.worlds()[number];
    for (int k = 0; k < 3; ++k) {
      mine_.lo[k] = scale_(box.lo[k], k);
      mine_.hi[k] = scale_(box.hi[k], k);
    }
  }

  __device__ std::uint32_t children_hit(int level, std::uint32_t first) const {
    const std::uint32_t i = first + lane_index();
    const bool hit = i < tree_.count[level] && may_meet(mine_, tree_.level(level)[i]) &&
                     (!has_worlds_ || mine_.leaf_worlds().meets(tree_.level(level)[i].worlds()));
    return __ballot_sync(kAllLanes, hit);
  }

  __device__ void test_leaves(std::uint32_t first) {
    const std::uint32_t i = first + lane_index();
    bool meet = false;
    unsigned long long key = 0;
    if (i < tree_.count[0]) {
      const Node theirs = tree_.level(0)[i];
      const std::uint32_t a = min(number_, theirs.box()), b = max(number_, theirs.box());
      meet = may_meet(mine_, theirs) &&
             (surely_meet(mine_, theirs) || overlap(box_, load(boxes_, theirs.box()))) && rule_(a, b);
      key = output_.key(a, b);
    }
    const std::uint32_t meeting = __ballot_sync(kAllLanes, meet);
    if (meet) waiting_[count_ + count_of(meeting & lanes_below())] = key;
    count_ += count_of(meeting);
    if (count_ > kKeptWaiting - kFanOut) flush();  // now there is room for those of 32 leaves
  }

  const Tree& tree_;
  const Scale& scale_;
  const WorldBox* boxes_;
  const Rule& rule_;
  const Output& output_;
  unsigned long long* waiting_;
  std::uint32_t count_ = 0, number_ = 0;
  bool has_worlds_ = false;
  WorldBox box_ = {};
  Node mine_ = {};
};

// Boxes that are refused are blamed by who takes them for good.
template <typename Boxes, typename Rule>
__global__ void __launch_bounds__(kKeptWarps* kFanOut)
    collect_kept(const __grid_constant__ Boxes boxes, std::uint32_t count, const __grid_constant__ Tree tree,
                 const Survey* survey, const WorldBox* kept, const __grid_constant__ Rule rule,
                 const __grid_constant__ Output output) {
  __shared__ unsigned long long waiting[kKeptWarps][kKeptWaiting];
  gpu::wait_for_kernel_before();
  const Scale scale = scale_of(*survey);
  KeptWalk<Rule> walk(tree, scale, kept, rule, output, waiting[threadIdx.x / kFanOut]);
  const std::uint64_t warps = static_cast<std::uint64_t>(gridDim.x) * kKeptWarps;
  for (std::uint64_t i = blockIdx.x * kKeptWarps + threadIdx.x / kFanOut; i < count; i += warps) {
    const auto place = static_cast<std::uint32_t>(i);
    WorldBox box;
    if (boxes.get(place, box) == Status::kOk) walk.run(box, boxes.number(place));
  }
  walk.flush();
}

}  // namespace
}  // namespace tandem
