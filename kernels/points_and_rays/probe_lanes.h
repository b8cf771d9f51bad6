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
  explicit RayWalkBy(RayTask& task) : task_(task), ray_(probe::ray_in_frame<Four>(task.ray)) {}

  void run() {
    WaitingNode stack[kMostWaitingNodes];
    std::uint32_t height = 0, block_number = 0;
    float limit = task_.limit;
    while (true) {
      const Block& block = task_.tree->blocks[block_number];
      ++task_.blocks;
      Four near;
      unsigned mask = nodes(block, limit, near);
      if (mask != 0) {
        if (block.is_leaf_block()) {
          limit = take(block, mask, near, limit);
          if (limit < 0) return;
        } else {
          if ((mask & (mask - 1)) == 0) {
            block_number = block.index[lowest_bit(mask)];
            continue;
          }
          push_nodes(task_.tree->blocks, block, near, mask, stack, height);
        }
      }
      do {
        if (height == 0) return;
        --height;
      } while (stack[height].near > limit);
      block_number = stack[height].block;
    }
  }

 private:
  /// The nodes that the ray may meet up to the limit, and where at the earliest.
  unsigned nodes(const Block& block, float limit, Four& near) const {
    const NodeLanes<Four> lanes = node_lanes<Four>(block);
    return (!probe::misses_box(ray_, lanes.centre, lanes.half_extent, limit, near)).mask();
  }

  float take(const Block& block, unsigned mask, const Four& near, float limit) {
    const std::uint32_t first = block.index[0];
    ++task_.blocks;
    const FourCorners<Four> corners = four_triangles<Four>(*task_.tree, first, leaf_count(block));
    mask &= (!probe::passes_triangle(task_.ray, ray_.o, corners.corner)).mask();
    while (mask != 0) {
      // The nearest box is taken first.
      int next = lowest_bit(mask);
      for (unsigned left = mask & (mask - 1); left != 0; left &= left - 1) {
        if (near.v[lowest_bit(left)] < near.v[next]) next = lowest_bit(left);
      }
      mask &= ~(1u << next);
      if (near.v[next] > limit) return limit;
      limit = std::min(limit, task_.take(task_.context, first + static_cast<std::uint32_t>(next)));
      if (limit < 0) return limit;
    }
    return limit;
  }

  RayTask& task_;
  probe::RayInFrame<Four> ray_;
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
  RayWalkBy<Four>(task).run();
}

template <typename Four>
void point_walk_by(PointTask& task) {
  PointWalkBy<Four>(task).run();
}

}  // namespace
}  // namespace tandem
