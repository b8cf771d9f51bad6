#pragma once
#include "kernels/manifold/patch_normal.h"

/// How NormalFinder looks for the direction in which two bodies touch.
namespace tandem::manifold {

template <typename Team>
TANDEM_HD Vector3 NormalFinder<Team>::crossing_edges(const Piece& piece, int number) const {
  const int i = number / 6, j = number / 2 % 3;
  const Vector3 e = bodies_.a.corner(piece.triangle[0], (i + 1) % 3) - bodies_.a.corner(piece.triangle[0], i),
                f = bodies_.b.corner(piece.triangle[1], (j + 1) % 3) - bodies_.b.corner(piece.triangle[1], j);
  const Vector3 n = cross(e, f);
  const double length = norm(n);
  if (!(length > 1e-6 * norm(e) * norm(f))) return {};
  return ((number % 2 == 0 ? 1 : -1) / length) * n;
}

/// Looks for a direction across an edge of each body that separates all triangles of the patch. Returns how
/// many there are, as find_for_touch().
template <typename Team>
TANDEM_HD_CALLED int NormalFinder<Team>::find_crossing_edges(Vector3& n) const {
  constexpr std::uint32_t kMostPieces = 16, kDirections = 18;  // each of 3 x 3 edges, both ways
  if (end_ - begin_ > kMostPieces) return 0;
  const double tolerance = kNoArea * bodies_.reach();
  const auto separates = [&](const Vector3& direction, const Vector3& x) {
    bool outside[2] = {};
    for (std::uint32_t i = begin_; i < end_; ++i) {
      const Piece& piece = memory_.pieces[memory_.order[i]];
      for (int side = 0; side < 2; ++side)
        outside[side] = outside[side] || faces_other(memory_.order[i], side, rounded(direction));
      for (int k = 0; k < 3; ++k) {
        if (!(dot(direction, bodies_.a.corner(piece.triangle[0], k) - x) <= tolerance)) return false;
        if (!(dot(direction, bodies_.b.corner(piece.triangle[1], k) - x) >= -tolerance)) return false;
      }
    }
    return outside[0] && outside[1];
  };
  const std::uint32_t tries = kDirections * (end_ - begin_);
  std::uint64_t key = ~std::uint64_t{0};
  bool found = false;
  for (std::uint32_t at = team_.rank(); at < tries; at += team_.size()) {
    const Piece& piece = memory_.pieces[memory_.order[begin_ + at / kDirections]];
    const Vector3 direction = crossing_edges(piece, static_cast<int>(at % kDirections));
    if (dot(direction, direction) == 0 || !separates(direction, piece.end[0])) continue;
    found = true;
    key = piece.key() < key ? piece.key() : key;
  }
  key = team_.least(key);
  if (!team_.any(found)) return 0;
  // The first direction of the least piece counts, if no other piece has another one.
  std::uint32_t first = kDirections;
  for (std::uint32_t at = team_.rank(); at < tries; at += team_.size()) {
    const Piece& piece = memory_.pieces[memory_.order[begin_ + at / kDirections]];
    if (piece.key() != key) continue;
    const Vector3 direction = crossing_edges(piece, static_cast<int>(at % kDirections));
    if (dot(direction, direction) == 0 || !separates(direction, piece.end[0])) continue;
    first = at % kDirections < first ? at % kDirections : first;
  }
  first = team_.least(first);
  for (std::uint32_t i = begin_; i < end_; ++i) {
    const Piece& piece = memory_.pieces[memory_.order[i]];
    if (piece.key() == key) n = crossing_edges(piece, static_cast<int>(first));
  }
  bool other = false;
  for (std::uint32_t at = team_.rank(); at < tries; at += team_.size()) {
    const Piece& piece = memory_.pieces[memory_.order[begin_ + at / kDirections]];
    const Vector3 direction = crossing_edges(piece, static_cast<int>(at % kDirections));
    if (dot(direction, direction) == 0 || same_direction(direction, n)) continue;
    other = other || separates(direction, piece.end[0]);
  }
  return team_.any(other) ? 2 : 1;
}

/// Returns whether bodies that a plane separates touch from outside: a body that lies in another one may
/// touch its surface from behind.
template <typename Team>
TANDEM_HD bool NormalFinder<Team>::is_outside(const Vector3& n) const {
  const FloatVector along = rounded(n);
  bool outside[2] = {};
  for (std::uint32_t i = begin_ + team_.rank(); i < end_; i += team_.size()) {
    for (int side = 0; side < 2; ++side)
      outside[side] = outside[side] || faces_other(memory_.order[i], side, along);
  }
  return team_.any(outside[0]) && team_.any(outside[1]);
}

/// Looks for a direction, of faces there and else of crossings of edges, that has all of a's triangles there
/// on one side and b's on the other. Returns how many there are: 0, 1 or, of several, 2. Where several do,
/// corners or edges lie on each other: nothing to lean on.
template <typename Team>
TANDEM_HD_CALLED int NormalFinder<Team>::find_for_touch(Vector3& n) {
  directions_ = 0;
  gather_directions(0, true);
  gather_directions(1, true);
  for (int i = static_cast<int>(team_.rank()); i < directions_; i += static_cast<int>(team_.size()))
    shared_.tried[i] = shared_.direction[i].n;
  team_.sync();
  spread_along(directions_);
  const double tolerance = kNoArea * bodies_.reach();
  int found = 0;
  for (int i = 0; i < directions_; ++i) {
    const Vector3 tried = shared_.tried[i];
    const Spread spread = shared_.spread[i];
    // Its plane goes through the piece that has it.
    const double height = dot(tried, memory_.pieces[shared_.direction[i].piece].end[0] - summary_.origin);
    if (!(spread.highest_a - height <= tolerance && spread.lowest_b - height >= -tolerance)) continue;
    if (found > 0 && same_direction(n, tried)) continue;
    if (!is_outside(tried)) continue;
    if (found == 0) n = tried;
    ++found;
  }
  return found == 0 ? find_crossing_edges(n) : lesser(found, 2);
}

}  // namespace tandem::manifold
