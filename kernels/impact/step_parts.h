#pragma once
#include <cmath>
#include <cstdint>

#include "kernels/impact/pair_motion.h"

/// Runs of time that two trees are walked through. A piece of the step is one in which no body turns by more
/// than kMostTurnOfPiece. The larger the turn, the less boxes know of where their nodes are after it, so
/// pieces are halved where nodes are small: a block pair that may meet in a part of a piece is tested again
/// in each half, instead of the nodes below it, as long as its nodes are smaller than what they may leave
/// their straight ways by.
namespace tandem::impact {

inline constexpr double kMostTurnOfPiece = 0.5;

/// A piece may be halved this often.
inline constexpr std::uint32_t kHalvings = 6;

/// Parts of a piece have numbers: 1 is the whole piece, 2 p and 2 p + 1 are the halves of part p.
inline constexpr std::uint32_t kPartNumbers = 2u << kHalvings;

/// Begin and end, in parts of the step.
struct Span {
  double begin, end;
};

/// Returns how many pieces of equal length the step has.
TANDEM_HD inline double pieces_of(const PairMotion& pair) {
  const double turns = manifold::greater(pair.a->angle, pair.b->angle) / kMostTurnOfPiece;
  return manifold::greater(1.0, std::ceil(turns));
}

TANDEM_HD inline Span piece_of_step(double number, double pieces) {
  return {number / pieces, (number + 1) / pieces};
}

TANDEM_HD inline Span part_of_piece(const Span& piece, std::uint32_t number) {
  std::uint32_t first = 1;  // of those of its length
  while (2 * first <= number) first *= 2;
  const double length = (piece.end - piece.begin) / first;
  const std::uint32_t place = number - first;
  return {piece.begin + place * length, place + 1 == first ? piece.end : piece.begin + (place + 1) * length};
}

/// No points of the two bodies accelerate more relative to each other.
TANDEM_HD inline double largest_acceleration(const PairMotion& pair) {
  return pair.a->angle * pair.a->fastest + pair.b->angle * pair.b->fastest;
}

/// Returns whether a part with this number and length is halved for two blocks, whose sizes are size_of().
TANDEM_HD inline bool worth_halving(double acceleration, std::uint32_t number, double length, float size_a,
                                    float size_b) {
  constexpr double kOfSize = 0.125;
  return number < kPartNumbers / 2 &&
         acceleration * length * length > kOfSize * (static_cast<double>(size_a) + size_b);
}

}  // namespace tandem::impact
