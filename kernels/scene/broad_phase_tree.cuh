#pragma once
#include <cstddef>
#include <cstdint>

#include "tandem/formats/status.h"
#include "tandem/kernels/pair_filter.h"
#include "tandem/kernels/world_box.h"

// The kernels of the broad phase share this: boxes in float32, a tree of them, and what kernels hand on.
namespace tandem {
namespace {

constexpr std::uint32_t kFanOut = 32;  // lanes of a warp
constexpr std::uint32_t kFanOutBits = 5;
constexpr int kMostLevels = 8;  // 32^7 > 2^32 boxes
constexpr std::uint32_t kAllLanes = 0xFFFFFFFFu;

// Boxes are sorted by this. From the highest bit down it has the world where there are several, the class of
// size and the position on the curve, and the box's index takes the place of the lowest bits.
using Key = std::uint64_t;
constexpr int kAxisBits = 16, kClassBits = 4;
constexpr int kUnusedBits = 64 - kClassBits - 3 * kAxisBits;
constexpr std::uint32_t kCells = 1u << kAxisBits;

constexpr unsigned long long kNoError = ~0ull;

__device__ std::uint32_t lane_index() {
  return threadIdx.x % kFanOut;
}
__device__ std::uint32_t lanes_below() {
  return (1u << lane_index()) - 1;
}
__device__ std::uint32_t count_of(std::uint32_t lanes) {
  return static_cast<std::uint32_t>(__popc(lanes));
}
__device__ std::uint32_t lowest(std::uint32_t bits) {
  return static_cast<std::uint32_t>(__ffs(static_cast<int>(bits)) - 1);
}

// ---------------------------------------------------------------------------------------------------------
// Boxes in float32.
//
// float(x) = fl32(fl(fl(x - origin) * scale)), the same for all boxes. Each step is monotone, so x <= y
// implies float(x) <= float(y): boxes that meet still do, and no margin is needed; minima and maxima of
// floats are exact, so a node contains what is below it. And float(x) < float(y) implies x < y: where all six
// comparisons of two boxes hold strictly, the float64 boxes meet. Only where floats are equal must float64
// decide. What overflows becomes an infinity, which the same comparisons serve. NaN stands for nothing: it
// meets no box and changes no union.

//
// A node above the leaves has the worlds of what is below it, and may_meet() leaves them aside: where there
// is one world, nobody asks.

struct alignas(16) Node {
  float lo[3];
  std::uint32_t first;  // of a leaf the box, else the lowest world
  float hi[3];
  std::uint32_t last;  // of a leaf the world, else the highest one

  __device__ std::uint32_t box() const { return first; }
  __device__ WorldRange leaf_worlds() const { return WorldRange::of(last); }
  __device__ WorldRange worlds() const { return {first, last}; }
  __device__ void set_worlds(const WorldRange& range) {
    first = range.first;
    last = range.last;
  }
};

__device__ Node nothing() {
  const float nan = __int_as_float(0x7FFFFFFF);
  return {{nan, nan, nan}, kNoIndex, {nan, nan, nan}, 0};
}

__device__ bool may_meet(const Node& a, const Node& b) {
  return (a.lo[0] <= b.hi[0]) & (b.lo[0] <= a.hi[0]) & (a.lo[1] <= b.hi[1]) & (b.lo[1] <= a.hi[1]) &
         (a.lo[2] <= b.hi[2]) & (b.lo[2] <= a.hi[2]);
}

__device__ bool surely_meet(const Node& a, const Node& b) {
  return (a.lo[0] < b.hi[0]) & (b.lo[0] < a.hi[0]) & (a.lo[1] < b.hi[1]) & (b.lo[1] < a.hi[1]) &
         (a.lo[2] < b.hi[2]) & (b.lo[2] < a.hi[2]);
}

// The union of the warp's boxes, in every lane; worlds: of the lane's own box.
__device__ Node union_of_warp(Node node, const WorldRange& worlds) {
  node.set_worlds({__reduce_min_sync(kAllLanes, worlds.first), __reduce_max_sync(kAllLanes, worlds.last)});
  for (int k = 0; k < 3; ++k) {
    for (int step = kFanOut / 2; step > 0; step /= 2) {
      node.lo[k] = fminf(node.lo[k], __shfl_xor_sync(kAllLanes, node.lo[k], step));
      node.hi[k] = fmaxf(node.hi[k], __shfl_xor_sync(kAllLanes, node.hi[k], step));
    }
  }
  return node;
}

// ---------------------------------------------------------------------------------------------------------
// A complete tree: level 0 the sorted boxes, each further level 32 times smaller, the top one of at most 32.

struct Tree {
  Node* nodes;
  std::size_t begin[kMostLevels];  // of each level, in nodes
  std::uint32_t count[kMostLevels];
  int top;

  __device__ Node* level(int i) const { return nodes + begin[i]; }
};

std::uint32_t parents_of(std::uint32_t count) {
  return (count + kFanOut - 1) / kFanOut;
}

Tree tree_over(std::uint32_t boxes, Node* nodes) {
  Tree tree = {};
  tree.nodes = nodes;
  tree.count[0] = boxes;
  do {
    ++tree.top;
    tree.begin[tree.top] = tree.begin[tree.top - 1] + tree.count[tree.top - 1];
    tree.count[tree.top] = parents_of(tree.count[tree.top - 1]);
  } while (tree.count[tree.top] > kFanOut);
  return tree;
}

std::size_t nodes_of(const Tree& tree) {
  return tree.begin[tree.top] + tree.count[tree.top];
}

// ---------------------------------------------------------------------------------------------------------
// Kernels hand these to each other in GPU memory.

struct Counters {
  unsigned long long found;
  unsigned long long error;  // the least of where << 32 | status; kNoError
};

constexpr Counters kFreshCounters = {0, kNoError};

// Tells where the boxes are and how large they are, by a sample of them. Outliers don't move it.
struct Survey {
  double median[3];  // of centres
  double reach[3];   // most centres are as close to the median
  double edge;       // median of longest edges
};

__device__ void blame(Counters* counters, std::uint32_t where, Status status) {
  atomicMin(&counters->error,
            static_cast<unsigned long long>(where) << 32 | static_cast<unsigned long long>(status));
}

// Condition: `boxes` at a multiple of 16 bytes.
__device__ WorldBox load(const WorldBox* boxes, std::uint32_t i) {
  const auto* halves = reinterpret_cast<const double2*>(boxes) + 3ull * i;
  const double2 x = halves[0], y = halves[1], z = halves[2];
  return {{x.x, x.y, y.x}, {y.y, z.x, z.y}};
}

__device__ double centre(const WorldBox& box, int axis) {
  return 0.5 * box.lo[axis] + 0.5 * box.hi[axis];
}

__device__ double longest_edge(const WorldBox& box) {
  return fmax(fmax(box.hi[0] - box.lo[0], box.hi[1] - box.lo[1]), box.hi[2] - box.lo[2]);
}

}  // namespace
}  // namespace tandem
