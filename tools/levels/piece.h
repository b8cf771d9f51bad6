#pragma once
#include <cstdint>
#include <span>

#include "levels/nearest_triangle.h"
#include "tandem/formats/view.h"

namespace tandem::levels {

/// A corner of a piece and the triangle of the other surface that is nearest to it.
struct Corner {
  Point point;
  double distance;  ///< as computed
  std::uint32_t nearest;
};

/// A triangle that is a part of a triangle of one surface, or a segment that such a part is near to, and a
/// bound of how far the part's points are from the other surface, without the slack that rounding asks for.
struct Piece {
  Corner corner[3];  ///< of a segment: its ends, the second one twice
  double bound;
  double excess;        ///< how far points of the part are from the segment; 0 of triangles
  std::uint16_t depth;  ///< cuts that led to it from the whole triangle
  std::uint8_t side;    ///< whose triangle it is a part of: 0 or 1
  bool is_segment;
};

/// A cut of a piece makes at most so many.
inline constexpr int kMostParts = 3;

/// Pieces are cut so often at most.
inline constexpr int kDeepest = 100;

/// Returns the most that rounding adds to a bound of a piece's points, where no coordinate of either surface
/// is larger: 2^-42 of that. The proof is in docs/level_error.md.
inline double rounding_slack(double largest_coordinate) {
  return 0x1p-42 * largest_coordinate;
}

/// Lowers piece.bound by what the given triangles and those nearest to its corners tell, until it is at most
/// `enough` or they tell no more.
void tighten(const LevelView& other, std::span<const std::uint32_t> triangles, double enough, Piece& piece);

/// Makes a segment of a triangle of which no point is farther than `tolerance` from its longest edge. Else
/// thin triangles would be cut into fans of thinner ones.
void flatten(Piece& piece, double tolerance);

/// Says how a piece is cut: at points of its edges. An edge runs from corner `edge` to corner `edge + 1`, and
/// the point is at `along` of it. A segment has edge 0 alone.
struct Cut {
  int edges;  ///< 1 or 2
  int edge[2];
  double along[2];
};

/// Chooses where to cut a piece whose middle is nearest to this triangle: where the triangle ends, if the
/// piece is not much larger, or in the middle of its longest edge. Excursions over the triangle's end of less
/// than `negligible` don't count.
Cut choose_cut(const Piece& piece, const Triangle& nearest, double negligible);

/// The point of a cut.
Point point_of(const Piece& piece, const Cut& cut, int i);

/// The parts of a piece, given the cut's points. Their bounds are infinite. Returns how many.
int cut_piece(const Piece& piece, const Cut& cut, const Corner (&point)[2], Piece (&parts)[kMostParts]);

}  // namespace tandem::levels
