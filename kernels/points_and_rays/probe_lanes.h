#pragma once
#include <algorithm>
#include <bit>

#include "kernels/common/lanes.h"
#include "kernels/common/traversal.h"
#include "kernels/geometry/frame_probe.h"
#include "kernels/points_and_rays/probe_walk.h"

// The walks that all variants share: four nodes or four triangles at a time, whatever the machine's vectors.
// Included by files that are compiled for different machines: internal linkage, see lanes.h.
namespace tandem {
namespace {

#ifdef TANDEM_HAVE_LANES
#define TANDEM_ALWAYS_INLINE TANDEM_INLINE
#else
#define TANDEM_ALWAYS_INLINE inline
#endif

/// Four numbers, as a compiler without vectors has them.
struct PlainFour;

struct PlainMask {
  unsigned bits;

  friend PlainMask operator&(PlainMask a, PlainMask b) { return {a.bits & b.bits}; }
  friend PlainMask operator|(PlainMask a, PlainMask b) { return {a.bits | b.bits}; }
  friend PlainMask operator!(PlainMask a) { return {~a.bits & 15u}; }
  unsigned mask() const { return bits; }
};

struct PlainFour {
  static constexpr int kLanes = 4;
  struct Values {
    float x[4];
    float& operator[](int i) { return x[i]; }
    float operator[](int i) const { return x[i]; }
  } v;

  template <typename Operation>
  static PlainFour each(const Operation& operation) {
    PlainFour out;
    for (int i = 0; i < 4; ++i) out.v[i] = operation(i);
    return out;
  }
  friend PlainFour operator+(const PlainFour& a, const PlainFour& b) {
    return each([&](int i) { return a.v[i] + b.v[i]; });
  }
  friend PlainFour operator+(const PlainFour& a, float b) {
    return each([&](int i) { return a.v[i] + b; });
  }
  friend PlainFour operator-(const PlainFour& a, const PlainFour& b) {
    return each([&](int i) { return a.v[i] - b.v[i]; });
  }
  friend PlainFour operator*(const PlainFour& a, const PlainFour& b) {
    return each([&](int i) { return a.v[i] * b.v[i]; });
  }
  friend PlainFour operator*(float a, const PlainFour& b) {
    return each([&](int i) { return a * b.v[i]; });
  }
  friend PlainFour operator/(const PlainFour& a, const PlainFour& b) {
    return each([&](int i) { return a.v[i] / b.v[i]; });
  }
  friend PlainMask less(const PlainFour& a, const PlainFour& b) {
    unsigned bits = 0;
    for (int i = 0; i < 4; ++i) bits |= static_cast<unsigned>(a.v[i] < b.v[i]) << i;
    return {bits};
  }
  friend PlainFour magnitude(const PlainFour& a) {
    return each([&](int i) { return std::fabs(a.v[i]); });
  }
  friend PlainFour square_root(const PlainFour& a) {
    return each([&](int i) { return std::sqrt(a.v[i]); });
  }
  friend PlainFour select(PlainMask mask, const PlainFour& a, const PlainFour& b) {
    return each([&](int i) { return (mask.bits >> i & 1) != 0 ? a.v[i] : b.v[i]; });
  }
  friend PlainFour larger(const PlainFour& a, const PlainFour& b) {
    return each([&](int i) { return a.v[i] < b.v[i] ? b.v[i] : a.v[i]; });
  }
  friend PlainFour lesser(const PlainFour& a, const PlainFour& b) {
    return each([&](int i) { return b.v[i] < a.v[i] ? b.v[i] : a.v[i]; });
  }
};

inline void transpose(PlainFour (&rows)[4]) {
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < i; ++j) std::swap(rows[i].v[j], rows[j].v[i]);
  }
}

template <typename Four>
inline Four load_four(const float* four) {
  Four out;
  __builtin_memcpy(&out, four, sizeof out);
  return out;
}

/// Four numbers of each of some blocks. row_of(block) -> where they are.
template <typename Value, typename RowOf>
TANDEM_ALWAYS_INLINE Value load_fours(const Block* const* blocks, const RowOf& row_of) {
#ifdef TANDEM_HAVE_LANES
  const auto row = [&](int i) { return load(row_of(blocks[i])).v; };
  if constexpr (Value::kLanes == 16) {
    const auto low = __builtin_shufflevector(row(0), row(1), 0, 1, 2, 3, 4, 5, 6, 7);
    const auto high = __builtin_shufflevector(row(2), row(3), 0, 1, 2, 3, 4, 5, 6, 7);
    return {__builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)};
  } else if constexpr (Value::kLanes == 8) {
    return {__builtin_shufflevector(row(0), row(1), 0, 1, 2, 3, 4, 5, 6, 7)};
  } else
#endif
    return load_four<Value>(row_of(blocks[0]));
}

template <typename Four>
struct FourCorners {
  tandem::frame::Point<Four> corner[3];
};

template <typename Four>
struct NodeLanes {
  Four centre[3], half_extent[3];
};

template <typename Four>
inline NodeLanes<Four> node_lanes(const Block& block) {
  NodeLanes<Four> out;
  for (int k = 0; k < 3; ++k) {
    out.centre[k] = load_four<Four>(block.centre[k]);
    out.half_extent[k] = load_four<Four>(block.half_extent[k]);
  }
  return out;
}

/// The corners of four triangles that follow each other, or of as many as there are and the last one again.
template <typename Four>
inline FourCorners<Four> four_triangles(const LevelView& tree, std::uint32_t first, std::uint32_t count) {
  FourCorners<Four> out;
  for (int c = 0; c < 3; ++c) {
    Four rows[4];
    for (std::uint32_t i = 0; i < 4; ++i) {
      const Triangle& triangle = tree.triangles[first + (i < count ? i : count - 1)];
      rows[i] = load_four<Four>(triangle.corner[c].position);
    }
    transpose(rows);
    for (int k = 0; k < 3; ++k) out.corner[c].x[k] = rows[k];
  }
  return out;
}

inline std::uint32_t leaf_count(const Block& block) {
  std::uint32_t count = 1;
  while (count < kNodesPerBlock && block.kind[count] == NodeKind::leaf) ++count;
  return count;
}

/// A block that waits to be visited: its bound in the upper half, its number in the lower. Bounds are not
/// negative, so that the numbers have their order.
using WaitingBlock = std::uint64_t;

inline WaitingBlock waiting_block(float bound, std::uint32_t number) {
  return std::uint64_t{std::bit_cast<std::uint32_t>(bound)} << 32 | number;
}

inline float bound_of(WaitingBlock waiting) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(waiting >> 32));
}

inline std::uint32_t number_of(WaitingBlock waiting) {
  return static_cast<std::uint32_t>(waiting);
}

/// On each level three wait beside the one that is visited next, and four on the last.
inline constexpr std::uint32_t kMostWaitingNodes = 3 * kMaxDepth + 4;

/// Has the machine load a block that is visited soon.
inline void fetch_block([[maybe_unused]] const Block* block) {
#ifdef TANDEM_HAVE_LANES
  __builtin_prefetch(block);
  __builtin_prefetch(reinterpret_cast<const char*>(block) + 64);
#endif
}

inline void fetch_triangles([[maybe_unused]] const Triangle* triangles) {
#ifdef TANDEM_HAVE_LANES
  for (std::size_t i = 0; i < 4 * sizeof(Triangle); i += 64)
    __builtin_prefetch(reinterpret_cast<const char*>(triangles) + i);
#endif
}

/// Pushes the nodes of the mask, the nearest last.
inline void push_nodes(const Block* blocks, const Block& block, const float* bounds, unsigned mask,
                       WaitingBlock*& top) {
  const WaitingBlock* const bottom = top;
  for (; mask != 0; mask &= mask - 1) {
    const int i = lowest_bit(mask);
    const WaitingBlock next = waiting_block(bounds[i], block.index[i]);
    fetch_block(blocks + block.index[i]);
    WaitingBlock* at = top++;
    for (; at > bottom && at[-1] < next; --at) *at = at[-1];
    *at = next;
  }
}

/// Walks of kVectors vectors of rays, which take turns: while one waits for memory, others go on. Each ray of
/// a vector has a block of its own, and the four nodes of each are in the vector's lanes.
template <typename Value, typename Four, int kVectors>
class RayWalks {
 public:
  static constexpr int kRaysOfVector = Value::kLanes / kNodesPerBlock;
  static constexpr int kRays = kRaysOfVector * kVectors;

  explicit RayWalks(const RayStream& stream) : stream_(stream) {
    for (int i = 0; i < kRays; ++i) begin(i);
  }

  void run() {
    while (active_ != 0) {
#pragma GCC unroll 8
      for (int i = 0; i < kVectors; ++i) step(i);
    }
  }

 private:
  static constexpr unsigned kAllOfVector = (1u << kRaysOfVector) - 1, kAllNodes = (1u << kNodesPerBlock) - 1;

  static constexpr Block kNoBlock = {};

  struct Walk {
    RayTask task;
    const Block* blocks;
    WaitingBlock* top;   ///< of the stack
    unsigned leaf_mask;  ///< of the triangles that are to be looked at, where the next block is a leaf's
    float leaf_near[kNodesPerBlock];
    WaitingBlock stack[kMostWaitingNodes];
  };

  /// Begins the next ray of the stream. Without one, the walk is not active any longer: no node is within its
  /// limit.
  void begin(int number) {
    Walk& walk = walks_[number];
    walk.top = walk.stack;
    if (!stream_.next(stream_.context, static_cast<std::uint32_t>(number), walk.task)) {
      active_ &= ~(1u << number);
      block_[number] = &kNoBlock;
      set_limit(number, -1);
      return;
    }
    active_ |= 1u << number;
    walk.blocks = block_[number] = walk.task.tree->blocks;
    auto& rays = rays_[number / kRaysOfVector];
    const int first = number % kRaysOfVector * kNodesPerBlock;
    for (int i = first; i < first + kNodesPerBlock; ++i) {
      for (int k = 0; k < 3; ++k) {
        rays.o[k].v[i] = walk.task.ray.o[k];
        rays.inverse[k].v[i] = walk.task.ray.inverse[k];
        rays.size[k].v[i] = std::fabs(walk.task.ray.inverse[k]);
      }
      rays.slack.v[i] = walk.task.ray.slack;
    }
    set_limit(number, walk.task.limit);
  }

  void set_limit(int number, float limit) {
    walks_[number].task.limit = limit;
    const int first = number % kRaysOfVector * kNodesPerBlock;
    for (int i = first; i < first + kNodesPerBlock; ++i) limits_[number / kRaysOfVector].v[i] = limit;
  }

  /// Goes on with the next block that waits and counts, or with the next ray.
  void pop(int number) {
    Walk& walk = walks_[number];
    const float limit = walk.task.limit;
    while (walk.top > walk.stack) {
      const WaitingBlock next = *--walk.top;
      if (bound_of(next) > limit) continue;
      block_[number] = walk.blocks + number_of(next);
      return;
    }
    if (limit >= 0) begin(number);
  }

  /// Looks at a block of each ray of a vector.
  TANDEM_ALWAYS_INLINE void step(int vector) {
    const int first = vector * kRaysOfVector;
    for (unsigned leaves = leaves_ >> first & kAllOfVector; leaves != 0; leaves &= leaves - 1)
      take(first + lowest_bit(leaves));
    NodeLanes<Value> nodes;
    for (int k = 0; k < 3; ++k) {
      nodes.centre[k] =
          load_fours<Value>(block_ + first, [k](const Block* block) { return block->centre[k]; });
      nodes.half_extent[k] =
          load_fours<Value>(block_ + first, [k](const Block* block) { return block->half_extent[k]; });
    }
    Value bounds;
    unsigned all =
        (!probe::misses_box(rays_[vector], nodes.centre, nodes.half_extent, limits_[vector], bounds)).mask();
    alignas(64) float near[Value::kLanes];
    __builtin_memcpy(near, &bounds, sizeof near);
#pragma GCC unroll 4
    for (int i = 0; i < kRaysOfVector; ++i) {
      ++walks_[first + i].task.blocks;
      if (const unsigned mask = all & kAllNodes; mask != 0)
        enter(first + i, near + i * kNodesPerBlock, mask);
      else
        pop(first + i);
      all >>= kNodesPerBlock;
    }
  }

  /// Goes on with what is below the nodes of the mask.
  TANDEM_ALWAYS_INLINE void enter(int number, const float* near, unsigned mask) {
    Walk& walk = walks_[number];
    const Block& block = *block_[number];
    if (block.is_leaf_block()) return wait_for_leaf(number, near, mask);
    const unsigned others = mask & (mask - 1);
    if ((others & (others - 1)) != 0) {
      push_nodes(walk.blocks, block, near, mask, walk.top);
      block_[number] = walk.blocks + number_of(*--walk.top);
      return;
    }
    // One or two, without a branch: if it is one, it is written to the stack, and does not count there.
    const int i = lowest_bit(mask), j = lowest_bit(others != 0 ? others : mask);
    const WaitingBlock one = waiting_block(near[i], block.index[i]);
    const WaitingBlock other = waiting_block(near[j], block.index[j]);
    const WaitingBlock next = std::min(one, other), later = one ^ other ^ next;
    *walk.top = later;
    walk.top += others != 0;
    block_[number] = walk.blocks + number_of(next);
    fetch_block(block_[number]);
    fetch_block(walk.blocks + number_of(later));
  }

  /// Has the triangles loaded, and looks at them when it is the ray's turn again.
  void wait_for_leaf(int number, const float* near, unsigned mask) {
    Walk& walk = walks_[number];
    fetch_triangles(walk.task.tree->triangles + block_[number]->index[0]);
    walk.leaf_mask = mask;
    for (int i = 0; i < kNodesPerBlock; ++i) walk.leaf_near[i] = near[i];
    leaves_ |= 1u << number;
  }

  /// Takes the triangles of a leaf, that of the nearest box first, and goes on.
  void take(int number) {
    Walk& walk = walks_[number];
    const Block& block = *block_[number];
    RayTask& task = walk.task;
    leaves_ &= ~(1u << number);
    const std::uint32_t first = block.index[0];
    ++task.blocks;
    const FourCorners<Four> corners = four_triangles<Four>(*task.tree, first, leaf_count(block));
    Four o[3];
    for (int k = 0; k < 3; ++k) o[k] = Four{} + task.ray.o[k];
    unsigned mask = walk.leaf_mask & (!probe::passes_triangle(task.ray, o, corners.corner)).mask();
    float limit = task.limit;
    while (mask != 0) {
      int next = lowest_bit(mask);
      for (unsigned left = mask & (mask - 1); left != 0; left &= left - 1) {
        if (walk.leaf_near[lowest_bit(left)] < walk.leaf_near[next]) next = lowest_bit(left);
      }
      mask &= ~(1u << next);
      if (walk.leaf_near[next] > limit) break;
      limit = std::min(limit, task.take(task.context, first + static_cast<std::uint32_t>(next)));
      if (limit < 0) return begin(number);
    }
    if (limit != task.limit) set_limit(number, limit);
    pop(number);
  }

  const RayStream& stream_;
  probe::RayInFrame<Value> rays_[kVectors] = {};
  Value limits_[kVectors] = {};
  unsigned active_ = 0, leaves_ = 0;
  const Block* block_[kRays] = {};
  Walk walks_[kRays];
};

template <typename Four>
class PointWalkBy {
 public:
  explicit PointWalkBy(PointTask& task) : task_(task) {
    for (int k = 0; k < 3; ++k) {
      q_[k] = Four{} + task.point.q[k];
      slack_[k] = Four{} + task.point.slack[k];
    }
    take_limits();
  }

  void run() {
    WaitingBlock stack[kMostWaitingNodes], *top = stack;
    std::uint32_t block_number = 0;
    while (true) {
      const Block& block = task_.tree->blocks[block_number];
      ++task_.blocks;
      const Four bound = bounds(block);
      const unsigned mask = less(bound, Four{} + limit_).mask();
      if (mask != 0) {
        if (block.is_leaf_block()) {
          take(block, mask);
        } else {
          float bounds[kNodesPerBlock];
          __builtin_memcpy(bounds, &bound, sizeof bounds);
          push_nodes(task_.tree->blocks, block, bounds, mask, top);
        }
      }
      do {
        if (top == stack) return settle();
        --top;
      } while (!(bound_of(*top) < limit_));
      block_number = number_of(*top);
    }
  }

 private:
  void take_limits() {
    limit_ = bound_limit(*task_.lengths, task_.upper);
    length_ = length_limit(*task_.lengths, task_.upper);
  }

  /// Squares of lengths that whatever is below the nodes is away from the point, at least.
  Four bounds(const Block& block) const {
    const NodeLanes<Four> lanes = node_lanes<Four>(block);
    return probe::box_bound(q_, slack_, lanes.centre, lanes.half_extent);
  }

  void take(const Block& block, unsigned mask) {
    const std::uint32_t first = block.index[0];
    ++task_.blocks;
    const FourCorners<Four> t = four_triangles<Four>(*task_.tree, first, leaf_count(block));
    const auto interval = probe::triangle_interval(q_, task_.point.error, t.corner);
    for (; mask != 0; mask &= mask - 1) {
      const int i = lowest_bit(mask);
      if (!(interval.lower.v[i] < length_)) continue;
      const double upper = world_upper(*task_.lengths, interval.upper.v[i]);
      if (upper < task_.upper) {
        task_.upper = upper;
        take_limits();
      }
      if (count_ == kMostCandidates) drop();
      candidates_[count_++] = {interval.lower.v[i], first + static_cast<std::uint32_t>(i)};
    }
  }

  /// Makes room: drops what does not count any longer, or else settles all.
  void drop() {
    std::uint32_t left = 0;
    for (std::uint32_t i = 0; i < count_; ++i) {
      if (candidates_[i].lower < length_) candidates_[left++] = candidates_[i];
    }
    count_ = left;
    if (count_ > kMostCandidates / 2) settle();
  }

  void settle() {
    std::uint32_t left = 0;
    for (std::uint32_t i = 0; i < count_; ++i) {
      if (candidates_[i].lower < length_) candidates_[left++] = candidates_[i];
    }
    count_ = 0;
    if (left > 0) task_.take(task_, candidates_, left);
    take_limits();
  }

  static constexpr std::uint32_t kMostCandidates = 64;

  PointTask& task_;
  Four q_[3], slack_[3];
  float limit_, length_;
  ClosestCandidate candidates_[kMostCandidates];
  std::uint32_t count_ = 0;
};

template <typename Four>
void ray_walk_by(RayTask& task) {
  struct One {
    RayTask& task;
    bool begun;
  } one = {task, false};
  const auto next = [](void* context, std::uint32_t, RayTask& of_walk) {
    One& only = *static_cast<One*>(context);
    if (only.begun) {
      only.task.blocks = of_walk.blocks;
      return false;
    }
    of_walk = only.task;
    return only.begun = true;
  };
  const RayStream stream = {next, &one};
  RayWalks<Four, Four, 1>(stream).run();
}

template <typename Value, typename Four>
void ray_stream_by(const RayStream& stream) {
  RayWalks<Value, Four, kRaysAtOnce * kNodesPerBlock / Value::kLanes>(stream).run();
}

template <typename Four>
void point_walk_by(PointTask& task) {
  PointWalkBy<Four>(task).run();
}

}  // namespace
}  // namespace tandem
