#include "self_contacts.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "kernels/geometry/triangle_test.h"
#include "parallel/parallel.h"
#include "tandem/formats/box.h"

namespace tandem::build {
namespace {

// Surfaces have some 10 to 30 triangles whose boxes meet that of a triangle; a fan round one edge has all.
constexpr std::uint64_t kMostLooks = 16'000'000, kMostLooksPerTriangle = 64;

// The bounds of a triangle.
struct Range {
  double lower[3], upper[3];

  explicit Range(const Triangle& triangle) {
    for (int k = 0; k < 3; ++k) {
      const auto& [a, b, c] = triangle.corner;
      lower[k] = std::min({a.position[k], b.position[k], c.position[k]});
      upper[k] = std::max({a.position[k], b.position[k], c.position[k]});
    }
  }

  // Returns whether a node's box may have a point of it. What is computed of the gap is off by less than
  // 2^-51 of the magnitudes.
  bool may_meet(const Block& block, int node) const {
    for (int k = 0; k < 3; ++k) {
      const double centre = block.centre[k][node], half_extent = block.half_extent[k][node];
      const double gap = std::max(lower[k] - centre, centre - upper[k]) - half_extent;
      const double magnitude =
          std::max(std::fabs(lower[k]), std::fabs(upper[k])) + std::fabs(centre) + half_extent;
      if (gap > 0x1p-50 * magnitude) return false;
    }
    return true;
  }
};

bool meet_apart_from_corners(const Triangle& a, const Triangle& b) {
  TrianglePair pair;
  for (int i = 0; i < 3; ++i) {
    std::copy_n(a.corner[i].position, 3, pair.a[i]);
    std::copy_n(b.corner[i].position, 3, pair.b[i]);
  }
  return !detail::share_corner(pair) && decide(pair).verdict == Verdict::contact;
}

// Pairs of triangles that were looked at, and those of them that meet.
struct PairCounts {
  std::uint64_t looks = 0, contacts = 0;
};

// Counts the pairs of this triangle with those after it in leaf order; may stop where that is more than
// `most`.
PairCounts count_later(const LevelView& level, std::uint32_t triangle, const PairCounts& most) {
  const Triangle& own = level.triangles[triangle];
  const Range range(own);
  // A block leaves at most three of its four children behind, on each of at most kMaxDepth levels.
  std::uint32_t stack[3 * kMaxDepth + 1] = {0};
  PairCounts counts;
  for (int size = 1; size > 0 && counts.contacts <= most.contacts && counts.looks <= most.looks;) {
    const Block& block = level.blocks[stack[--size]];
    for (int node = 0; node < kNodesPerBlock; ++node) {
      const std::uint32_t index = block.index[node];
      if (block.kind[node] == NodeKind::imaginary || !range.may_meet(block, node)) continue;
      if (block.kind[node] == NodeKind::internal) {
        stack[size++] = index;
      } else if (index > triangle) {
        ++counts.looks;
        counts.contacts += meet_apart_from_corners(own, level.triangles[index]);
      }
    }
  }
  return counts;
}

}  // namespace

std::optional<std::uint64_t> count_self_contacts(const LevelView& level, std::uint64_t most) {
  const PairCounts limit = {kMostLooks + kMostLooksPerTriangle * level.triangle_count, most};
  std::atomic<std::uint64_t> looks = 0, contacts = 0;
  const auto too_many = [&] { return looks > limit.looks || contacts > limit.contacts; };
  parallel::for_parts(level.triangle_count, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t triangle = begin; triangle < end && !too_many(); ++triangle) {
      const PairCounts counts = count_later(level, static_cast<std::uint32_t>(triangle), limit);
      looks += counts.looks;
      contacts += counts.contacts;
    }
  });
  if (too_many()) return std::nullopt;
  return contacts;
}

}  // namespace tandem::build
