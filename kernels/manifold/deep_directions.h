#pragma once
#include "kernels/manifold/patch_normal.h"

/// The directions along which NormalFinder has deep patches measured.
namespace tandem::manifold {

/// Adds the directions of faces of one body that differ most from each other and from a line, whichever way
/// they point, of those that push along a unit vector, or of all where that is 0; of those that differ as
/// much, that of the least triangles comes first. How long their pieces are does not matter: that depends on
/// how faces are cut into triangles.
template <typename Team>
TANDEM_HD_CALLED void NormalFinder<Team>::gather_unlike(int side, const Vector3& line, const Vector3& push) {
  const FloatVector towards = rounded(push);
  const auto least_along = static_cast<float>(kLeastAlong * dot(push, push));
  FloatVector known[kMostDirections + 1] = {rounded(line)};
  int count = 0;
  for (; count < kMostDirections; ++count) {
    float least = 2;
    LeastPiece own;
    for (std::uint32_t i = begin_ + team_.rank(); i < end_; i += team_.size()) {
      const std::uint32_t at = memory_.order[i];
      const float* n = memory_.normals + 6 * std::size_t{at} + 3 * side;
      const FloatVector normal = {{n[0], n[1], n[2]}};
      bool is_new = dot(turned_normal(memory_.normals + 6 * std::size_t{at}, side), towards) >= least_along;
      float alike = 0;
      for (int k = 0; k <= count; ++k) {
        const float along = std::fabs(dot(normal, known[k]));
        alike = greater(along, alike);
        is_new = is_new && (k == 0 || along < kSameLine);
      }
      if (!is_new) continue;
      // Directions that differ as much but for rounding are to have the same number.
      const float about = (alike + kAbout) - kAbout;
      if (about < least) least = about, own = {};
      if (about == least) own.take(memory_.pieces[at].key(), at);
    }
    if (team_.least(least) != least) own = {};
    const std::uint64_t key = team_.least(own.key);
    if (key == ~std::uint64_t{0}) break;
    const std::uint32_t holder = team_.least(own.key == key ? own.piece : kNoIndex);
    const float* n = memory_.normals + 6 * std::size_t{holder} + 3 * side;
    known[count + 1] = {{n[0], n[1], n[2]}};
    if (team_.rank() == 0) shared_.direction[directions_ + count] = {direction_of(side, holder), holder};
  }
  directions_ += count;
  team_.sync();
}

/// Returns the direction that leads away from all faces of one body that do not oppose the push: out of a
/// corner, no face alone is the shortest way. The result is 0 if there is none. It forgets what was gathered.
template <typename Team>
TANDEM_HD_CALLED Vector3 NormalFinder<Team>::way_out(int side, const Vector3& line, const Vector3& push) {
  gather_unlike(side, line, {});
  Vector3 sum;
  for (int i = 0; i < directions_; ++i) {
    const Vector3 n = shared_.direction[i].n;
    if (dot(n, push) > -kLeastAlong) sum = sum + n;
  }
  team_.sync();  // all have read them
  directions_ = 0;
  return norm(sum) > kLeastAlong ? normalized(sum) : Vector3{};
}

template <typename Team>
TANDEM_HD_CALLED int NormalFinder<Team>::gather_for_deep(const CurveMeasure& curve, double reach) {
  directions_ = 0;
  const Vector3 own = curve.push();
  const bool counts = dot(own, own) > 0;
  const bool joined = memory_.pieces[memory_.order[begin_]].joined != 0;
  const bool both_ways = joined || summary_.degenerate || !counts || !curve.by_area || surrounds_hole_;
  const Vector3 line = longest_line(curve.middle, reach), push = both_ways ? Vector3{} : own;
  Vector3 out_of_corner[2];
  for (int side = 0; side < 2 && several_faces_ && !both_ways; ++side)
    out_of_corner[side] = way_out(side, line, own);
  gather_unlike(0, line, push);
  gather_unlike(1, line, push);
  int count = 0;
  const auto add = [&](const Vector3& n) {
    bool is_new = true;
    for (int k = 0; k < count; ++k) is_new = is_new && std::fabs(dot(shared_.tried[k], n)) < 1 - 1e-7;
    if (is_new) shared_.tried[count++] = n;
  };
  team_.sync();
  if (team_.rank() == 0) {
    if (counts) add(own);
    for (int i = 0; i < directions_; ++i) add(shared_.direction[i].n);
    for (const Vector3& way : out_of_corner) {
      if (dot(way, way) > 0) add(way);
    }
    shared_.count = count;
    shared_.both_ways = both_ways;
  }
  team_.sync();
  return shared_.count;
}

/// Returns the way from the middle of the pieces to the furthest of their ends.
template <typename Team>
TANDEM_HD_CALLED Vector3 NormalFinder<Team>::longest_line(const Vector3& middle, double reach) const {
  const Place furthest =
      CurvePlaces<Team>(team_, memory_).furthest_place(begin_, end_, reach, [&](const Vector3& x) {
        return dot(x - middle, x - middle);
      });
  const Vector3 out = furthest.at - middle;
  return norm(out) > 0 ? normalized(out) : Vector3{0, 0, 1};
}

}  // namespace tandem::manifold
