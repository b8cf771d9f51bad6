#include "levels/piece.h"

#include "kernels/geometry/triangle_distance.h"

namespace tandem::levels {
namespace {

constexpr int kMostCandidates = 6;

/// Distances of a piece's corners from a triangle.
using Row = double[3];

double greatest(const Row& row) {
  return std::max({row[0], row[1], row[2]});
}

/// The largest of x row + (1 - x) other.
double greatest_mixed(const Row& row, const Row& other, double x) {
  double most = 0;
  for (int k = 0; k < 3; ++k) most = std::max(most, x * row[k] + (1 - x) * other[k]);
  return most * (1 + 0x1p-50);
}

/// The least that a mixture of two rows has for its largest entry: it is where two entries are alike.
double least_mixed(const Row& row, const Row& other) {
  double least = INFINITY;
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3;
    const double slope = (row[k] - other[k]) - (row[l] - other[l]);
    const double x = (other[l] - other[k]) / slope;
    if (x > 0 && x < 1) least = std::min(least, greatest_mixed(row, other, x));
  }
  return least;
}

double square_length(const Piece& piece, int edge) {
  return square_distance(piece.corner[edge].point, piece.corner[(edge + 1) % 3].point);
}

int longest_edge(const Piece& piece) {
  int longest = 0;
  for (int e = 1; e < 3; ++e) {
    if (square_length(piece, e) > square_length(piece, longest)) longest = e;
  }
  return longest;
}

/// Finds how far the corners are beyond the plane through edge e of the triangle that is normal to the
/// triangle. False: the triangle is flat.
bool excursions(const Piece& piece, const Triangle& triangle, int e, Row& beyond) {
  const Point from = corner_of(triangle, e), along = minus(corner_of(triangle, (e + 1) % 3), from);
  const Point inward = distance::without_part(minus(corner_of(triangle, (e + 2) % 3), from), along);
  const double length = std::sqrt(dot(inward, inward));
  if (!(length > 0)) return false;
  for (int k = 0; k < 3; ++k) beyond[k] = -dot(minus(piece.corner[k].point, from), inward) / length;
  return true;
}

/// The cut between the corners that are beyond a plane and those that are on its near side. False: all are on
/// one side.
bool cut_at_plane(const Row& beyond, int edges, double negligible, Cut& cut) {
  cut.edges = 0;
  for (int e = 0; e < edges; ++e) {
    const double from = beyond[e], to = beyond[(e + 1) % 3];
    if (std::fabs(from) <= negligible || std::fabs(to) <= negligible || (from > 0) == (to > 0)) continue;
    cut.edge[cut.edges] = e;
    cut.along[cut.edges++] = std::clamp(from / (from - to), 0.0, 1.0);
  }
  return cut.edges > 0;
}

}  // namespace

void tighten(const LevelView& other, std::span<const std::uint32_t> triangles, double enough, Piece& piece) {
  std::uint32_t candidate[kMostCandidates];
  Row row[kMostCandidates];
  int count = 0;
  const auto offer = [&](double bound) { piece.bound = std::min(piece.bound, bound + piece.excess); };
  const auto add = [&](std::uint32_t triangle) {
    for (int i = 0; i < count; ++i) {
      if (candidate[i] == triangle) return;
    }
    for (int k = 0; k < 3; ++k) {
      const Corner& corner = piece.corner[k];
      row[count][k] = corner.nearest == triangle
                          ? corner.distance
                          : std::sqrt(square_distance(corner.point, other.triangles[triangle]));
    }
    offer(greatest(row[count]));
    candidate[count++] = triangle;
  };
  for (const std::uint32_t triangle : triangles) {
    if (piece.bound > enough) add(triangle);
  }
  for (const Corner& corner : piece.corner) {
    if (piece.bound > enough) add(corner.nearest);
  }
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < i && piece.bound > enough; ++j) offer(least_mixed(row[i], row[j]));
  }
}

void flatten(Piece& piece, double tolerance) {
  const int e = longest_edge(piece);
  const Corner from = piece.corner[e], to = piece.corner[(e + 1) % 3];
  Point foot;
  const double height = std::sqrt(
      nearest_on_edge(piece.corner[(e + 2) % 3].point, from.point, minus(to.point, from.point), foot));
  if (!(height <= tolerance)) return;
  piece.corner[0] = from;
  piece.corner[1] = piece.corner[2] = to;
  piece.excess += height;
  piece.is_segment = true;
}

Cut choose_cut(const Piece& piece, const Triangle& nearest, double negligible) {
  const int longest = longest_edge(piece);
  double size = 0;
  for (int e = 0; e < 3; ++e)
    size = std::max(size, square_distance(corner_of(nearest, e), corner_of(nearest, (e + 1) % 3)));
  Cut best = {1, {longest, 0}, {0.5, 0}};
  if (square_length(piece, longest) > 4 * size) return best;
  double farthest = negligible;
  for (int e = 0; e < 3; ++e) {
    Row beyond;
    Cut cut;
    if (!excursions(piece, nearest, e, beyond) || !(greatest(beyond) > farthest) ||
        !cut_at_plane(beyond, piece.is_segment ? 1 : 3, negligible, cut))
      continue;
    farthest = greatest(beyond);
    best = cut;
  }
  return best;
}

Point point_of(const Piece& piece, const Cut& cut, int i) {
  return between(piece.corner[cut.edge[i]].point, piece.corner[(cut.edge[i] + 1) % 3].point, cut.along[i]);
}

int cut_piece(const Piece& piece, const Cut& cut, const Corner (&point)[2], Piece (&parts)[kMostParts]) {
  const auto part = [&](int i, const Corner& x, const Corner& y, const Corner& z) {
    parts[i] = piece;
    parts[i].corner[0] = x;
    parts[i].corner[1] = y;
    parts[i].corner[2] = z;
    parts[i].bound = INFINITY;
    ++parts[i].depth;
  };
  if (piece.is_segment) {
    part(0, piece.corner[0], point[0], point[0]);
    part(1, point[0], piece.corner[1], piece.corner[1]);
    return 2;
  }
  if (cut.edges == 1) {
    const int e = cut.edge[0], f = (e + 1) % 3, apex = (e + 2) % 3;
    part(0, piece.corner[e], point[0], piece.corner[apex]);
    part(1, point[0], piece.corner[f], piece.corner[apex]);
    return 2;
  }
  // The corner that both edges have is cut off; the quadrangle behind is halved.
  const bool adjacent = cut.edge[1] == cut.edge[0] + 1;  // else edges 0 and 2, which have corner 0
  const Corner &in = point[adjacent ? 0 : 1], &out = point[adjacent ? 1 : 0];
  const int off = adjacent ? cut.edge[1] : 0, after = (off + 1) % 3, before = (off + 2) % 3;
  part(0, in, piece.corner[off], out);
  part(1, in, out, piece.corner[after]);
  part(2, in, piece.corner[after], piece.corner[before]);
  return 3;
}

}  // namespace tandem::levels
