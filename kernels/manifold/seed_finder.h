#pragma once
#include "kernels/manifold/overlap_lines.h"
#include "kernels/manifold/search_memory.h"

namespace tandem::manifold {

/// Finds points of an overlap, through which the search for its depth begins.
template <typename Team>
class SeedFinder {
 public:
  TANDEM_HD SeedFinder(const Team& team, const BodyPair& bodies, const PieceMemory& memory,
                       const PieceSummary& summary)
      : team_(team), bodies_(bodies), memory_(memory), summary_(summary) {}

  /// Finds places on the curve that lie far from each other: the nearest to the middle, the furthest from
  /// that, and the furthest off the line of these on either side. wanted: 4 at most.
  TANDEM_HD void find_places(std::uint32_t region, const Vector3& middle, double reach, int wanted,
                             Seeds& out) const;

  /// Goes from such places to points of the overlap beside them. middle: of the curve. The first questions,
  /// `asked`, are others', and are answered too.
  TANDEM_HD void go_inside(Seeds& seeds, const Vector3& middle, std::uint32_t asked,
                           LineMemory& shared) const;

 private:
  const Team& team_;
  const BodyPair& bodies_;
  const PieceMemory& memory_;
  const PieceSummary& summary_;
};

template <typename Team>
TANDEM_HD void SeedFinder<Team>::find_places(std::uint32_t region, const Vector3& middle, double reach,
                                             int wanted, Seeds& out) const {
  const std::uint32_t begin = memory_.start[region], end = memory_.start[region + 1];
  const CurvePlaces<Team> places(team_, memory_);
  Place next = places.nearest_place(begin, end, middle, reach);
  const Vector3 first = next.at;
  Vector3 along, across;
  for (int i = 0;; ++i) {
    if (team_.rank() == 0) out.at[i] = next.at, out.beside[i] = next.piece, out.count = i + 1;
    if (i + 1 == wanted) break;
    if (i == 1) along = normalized(next.at - first);
    if (i == 2) across = -reach * normalized(cross(cross(along, next.at - first), along));
    next = places.furthest_place(begin, end, reach, [&](const Vector3& x) {
      const Vector3 from = x - first;
      if (i == 0) return dot(from, from);
      const Vector3 off = cross(along, from);
      return i == 1 ? dot(off, off) : dot(across, from);
    });
  }
  team_.sync();
}

/// If edges lie in faces, lines from the curve may run along these, or lead out at once. Then lines from
/// half-way to the middle of the curve come first, inwards and back: such places lie within the overlap of
/// convex bodies. If none of these does, a body may lie in the other and touch it from inside, and lines
/// begin half-way to its middle.
template <typename Team>
TANDEM_HD void SeedFinder<Team>::go_inside(Seeds& seeds, const Vector3& middle, std::uint32_t asked,
                                           LineMemory& shared) const {
  const OverlapLines<Team> lines(team_, bodies_, memory_, summary_, shared);
  const int count = seeds.count;
  const std::uint32_t all = (1u << count) - 1;
  const Body& smaller = bodies_[bodies_.a.shape->diagonal < bodies_.b.shape->diagonal ? 0 : 1];
  const double most = greater(bodies_.a.shape->diagonal, bodies_.b.shape->diagonal);
  std::uint32_t found = 0;
  constexpr int kOnCurve = 3;
  TANDEM_ROLLED
  for (int round = summary_.degenerate ? 0 : kOnCurve; round <= kOnCurve && found != all; ++round) {
    if (round == 2 && found != 0) continue;
    team_.sync();  // all are done with the places
    for (int i = static_cast<int>(team_.rank()); i < count; i += static_cast<int>(team_.size())) {
      Vector3 at = seeds.at[i];
      if (round < kOnCurve) at = i == 0 ? middle : 0.5 * (middle + at);
      if (round == 2) at = 0.5 * (smaller.centre + at);
      shared.place[i] = {at, seeds.beside[i]};
    }
    const LineFrom from = round == kOnCurve ? LineFrom::curve
                          : round == 1      ? LineFrom::within_and_back
                                            : LineFrom::within;
    const std::uint32_t is_new = lines.go_inside(count, most, asked, from) & ~found;
    for (int i = static_cast<int>(team_.rank()); i < count; i += static_cast<int>(team_.size())) {
      if ((is_new >> i & 1u) != 0) seeds.at[i] = shared.inside[i];
    }
    found |= is_new;
  }
  team_.sync();
  if (team_.rank() == 0) {
    seeds.count = 0;
    for (int i = 0; i < count; ++i) {
      if ((found >> i & 1u) == 0) continue;
      seeds.at[seeds.count] = seeds.at[i];
      seeds.beside[seeds.count++] = seeds.beside[i];
    }
  }
  team_.sync();
}

}  // namespace tandem::manifold
