#pragma once
#include <algorithm>

#include "kernels/common/lanes.h"
#include "kernels/common/traversal.h"
#include "kernels/geometry/frame_probe.h"
#include "kernels/points_and_rays/probe_walk.h"

// The walks that all variants share: four nodes or four triangles at a time, whatever the machine's vectors.
// Included by files that are compiled for different machines: internal linkage, see lanes.h.
namespace tandem {
namespace {

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

/// What waits to be visited: on each level three nodes beside the one that is taken next, and four on the
/// last.
struct WaitingNode {
  std::uint32_t block;
  float near;
};

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
template <typename Four>
inline void push_nodes(const Block* blocks, const Block& block, const Four& near, unsigned mask,
                       WaitingNode* stack, std::uint32_t& height) {
  const std::uint32_t bottom = height;
  for (; mask != 0; mask &= mask - 1) {
    const int i = lowest_bit(mask);
    const WaitingNode next = {block.index[i], near.v[i]};
    fetch_block(blocks + next.block);
    std::uint32_t at = height++;
    for (; at > bottom && stack[at - 1].near < next.near; --at) stack[at] = stack[at - 1];
    stack[at] = next;
  }
}

template <typename Four>
class RayWalkBy {
 public:
  /// Begins with task().
  void begin() {
    ray_ = probe::ray_in_frame<Four>(task_.ray);
    height_ = block_number_ = leaf_mask_ = 0;
    limit_ = task_.limit;
  }

  RayTask& task() { return task_; }

  /// Looks at one block, or at the triangles of one. False: there is no other.
  bool step() {
    if (leaf_mask_ != 0) {
      take();
      return limit_ >= 0 && pop();
    }
    const Block& block = task_.tree->blocks[block_number_];
    ++task_.blocks;
    Four near;
    const unsigned mask = nodes(block, near);
    if (mask == 0) return pop();
    if (block.is_leaf_block()) {
      const Triangle* const triangles = task_.tree->triangles + block.index[0];
      fetch_triangles(triangles);
      leaf_mask_ = mask;
      leaf_near_ = near;
      return true;
    }
    if ((mask & (mask - 1)) == 0) {
      block_number_ = block.index[lowest_bit(mask)];
      fetch_block(task_.tree->blocks + block_number_);
      return true;
    }
    push_nodes(task_.tree->blocks, block, near, mask, stack_, height_);
    block_number_ = stack_[--height_].block;
    return true;
  }

 private:
  /// The next block that waits and counts. False: none.
  bool pop() {
    do {
      if (height_ == 0) return false;
      --height_;
    } while (stack_[height_].near > limit_);
    block_number_ = stack_[height_].block;
    return true;
  }

  /// The nodes that the ray may meet up to the limit, and where at the earliest.
  unsigned nodes(const Block& block, Four& near) const {
    const NodeLanes<Four> lanes = node_lanes<Four>(block);
    return (!probe::misses_box(ray_, lanes.centre, lanes.half_extent, limit_, near)).mask();
  }

  /// Takes the triangles of the leaf, that of the nearest box first.
  void take() {
    const Block& block = task_.tree->blocks[block_number_];
    const std::uint32_t first = block.index[0];
    ++task_.blocks;
    const FourCorners<Four> corners = four_triangles<Four>(*task_.tree, first, leaf_count(block));
    unsigned mask = leaf_mask_ & (!probe::passes_triangle(task_.ray, ray_.o, corners.corner)).mask();
    leaf_mask_ = 0;
    while (mask != 0) {
      int next = lowest_bit(mask);
      for (unsigned left = mask & (mask - 1); left != 0; left &= left - 1) {
        if (leaf_near_.v[lowest_bit(left)] < leaf_near_.v[next]) next = lowest_bit(left);
      }
      mask &= ~(1u << next);
      if (leaf_near_.v[next] > limit_) return;
      limit_ = std::min(limit_, task_.take(task_.context, first + static_cast<std::uint32_t>(next)));
      if (limit_ < 0) return;
    }
  }

  probe::RayInFrame<Four> ray_;
  Four leaf_near_;
  float limit_;
  unsigned leaf_mask_;  ///< of the triangles of the block that are to be looked at next; 0: its nodes are
  std::uint32_t block_number_, height_;
  RayTask task_;
  WaitingNode stack_[kMostWaitingNodes];
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
    WaitingNode stack[kMostWaitingNodes];
    std::uint32_t height = 0, block_number = 0;
    while (true) {
      const Block& block = task_.tree->blocks[block_number];
      ++task_.blocks;
      const Four bound = bounds(block);
      const unsigned mask = less(bound, Four{} + limit_).mask();
      if (mask != 0) {
        if (block.is_leaf_block()) {
          take(block, mask);
        } else {
          push_nodes(task_.tree->blocks, block, bound, mask, stack, height);
        }
      }
      do {
        if (height == 0) return settle();
        --height;
      } while (!(stack[height].near < limit_));
      block_number = stack[height].block;
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
  RayWalkBy<Four> walk;
  walk.task() = task;
  walk.begin();
  while (walk.step()) {
  }
  task.blocks = walk.task().blocks;
}

template <typename Four>
void ray_stream_by(const RayStream& stream) {
  RayWalkBy<Four> walks[kRaysAtOnce];
  std::uint32_t active[kRaysAtOnce], count = 0;
  const auto begin = [&](std::uint32_t walk) {
    if (!stream.next(stream.context, walk, walks[walk].task())) return false;
    walks[walk].begin();
    return true;
  };
  for (std::uint32_t walk = 0; walk < kRaysAtOnce; ++walk) {
    if (begin(walk)) active[count++] = walk;
  }
  while (count > 0) {
    for (std::uint32_t i = 0; i < count;) {
      if (walks[active[i]].step() || begin(active[i]))
        ++i;
      else
        active[i] = active[--count];
    }
  }
}

template <typename Four>
void point_walk_by(PointTask& task) {
  PointWalkBy<Four>(task).run();
}

}  // namespace
}  // namespace tandem
