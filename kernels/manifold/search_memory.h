#pragma once
#include "kernels/manifold/half_spaces.h"
#include "kernels/manifold/overlap_lines.h"

/// The data of the search for the deepest line (kernels/manifold/deepest_line.h).
namespace tandem::manifold {

/// Lines go through so many points of an overlap at most.
inline constexpr int kMostSeeds = 4;

/// A line on which a triangle of a lies above one of b.
struct OverlapLine {
  std::uint32_t triangle[2] = {kNoIndex, kNoIndex};
  Vector2 at;
  double height[2] = {0, 0};  ///< of a, of b

  TANDEM_HD bool found() const { return triangle[0] != kNoIndex && triangle[1] != kNoIndex; }
  TANDEM_HD double depth() const { return height[0] - height[1]; }
};

/// Points of the overlap, and pieces beside which they are.
struct Seeds {
  Vector3 at[kMostSeeds];
  std::uint32_t beside[kMostSeeds];
  int count;
};

/// The memory that a team shares while it looks for the deepest line.
struct SearchMemory {
  Seeds seeds;
  int from;  ///< the seed from which the best line is seen
  PatchFrame frame;
  LineMemory lines;
  HalfSpace learnt[4];  ///< by the lines of a step
  HalfSpaces spaces;
  LineOfTwo proposed;
  OverlapLine best;
  bool is_loose;  ///< the bodies reach the heights of the best line, at least
  int steps;
  double enough;  ///< as it was last seen
};

}  // namespace tandem::manifold
