#pragma once
#include "kernels/manifold/patch.h"

namespace tandem::manifold {

/// An area vector below this part of length times largest coordinate is rounding: the surfaces only touch.
inline constexpr double kNoArea = 0x1p-40;

/// A curve whose ends are apart by less than this part of its length closes.
inline constexpr double kClosed = 1e-6;

/// Faces in so few directions on both sides make a patch one of flat faces; otherwise it is a smooth one.
inline constexpr int kMostDirections = 5;

/// Adding this number to one below 1 and taking it off again leaves some 12 bits behind the point.
inline constexpr float kAbout = 2048;

/// Faces whose normals have more than this cosine lie across one line.
inline constexpr float kSameLine = 1 - 1e-6f;

/// A smooth patch lies on a face if this part of its curve lies in the face's plane.
inline constexpr double kBearing = 0.9;

/// A patch pushes along the normal of a face only if the cosine of its angle to the area vector is this at
/// least.
inline constexpr double kLeastAlong = 0.1;

/// A triangle turns its back on a direction if the cosine of its normal is below this, but for rounding.
inline constexpr float kBesidePlane = 1e-5f;

/// Faces of two bodies are flush, as seen from a to b, where the cosine of their normals is below this.
inline constexpr double kFlush = -0.9995;

/// Measures a curve, and finds the direction in which its patch pushes.
template <typename Team>
class NormalFinder {
 public:
  TANDEM_HD NormalFinder(const Team& team, const BodyPair& bodies, const PieceMemory& memory,
                         const PieceSummary& summary, std::uint32_t curve, NormalMemory& shared)
      : team_(team),
        bodies_(bodies),
        memory_(memory),
        shared_(shared),
        summary_(summary),
        begin_(memory.start[curve]),
        end_(memory.start[curve + 1]) {}

  TANDEM_HD CurveMeasure measure();

  /// Condition: measure(), whose result this is.
  TANDEM_HD PatchNormal find(const CurveMeasure& curve);

  /// Gathers in NormalMemory::tried the directions along which a deep patch may push: that of the area
  /// vector, or of the triangles of sheets, and normals of faces of both bodies. Result: how many. Where the
  /// area says which way a patch pushes, they point that way; else NormalMemory::both_ways is true.
  /// reach: of the curve, from its middle.
  TANDEM_HD_CALLED int gather_for_deep(const CurveMeasure& curve, double reach);

  /// Returns the distance of the piece's end that is furthest from a point.
  TANDEM_HD_CALLED double reach_from(const Vector3& middle) const;

 private:
  static constexpr int kMost = kMostTried;
  static constexpr float kApart = 4.1f * kSameFace;
  static_assert(kMost == 2 * kMostDirections + 3);

  template <typename Visit>
  TANDEM_HD void for_each_piece(const Visit& visit) const {
    for (std::uint32_t i = begin_ + team_.rank(); i < end_; i += team_.size()) {
      const std::uint32_t at = memory_.order[i];
      visit(memory_.pieces[at], memory_.normals + 6 * std::size_t{at});
    }
  }
  /// Marks that pieces have for the time being. Each is seen by one of the team alone.
  TANDEM_HD std::uint32_t& mark(std::uint32_t i) const { return memory_.curve[i]; }
  TANDEM_HD_CALLED bool has_free_end() const;
  TANDEM_HD_CALLED Vector3 plain_middle() const;
  TANDEM_HD_CALLED Vector3 sum_of_normals(bool of_a, bool of_b) const;
  TANDEM_HD bool has_many_directions(int side) const;
  TANDEM_HD LeastPiece least_unmarked(int side, const FloatVector& known) const;
  TANDEM_HD bool gather_directions(int side, bool keep_if_many);
  TANDEM_HD_CALLED Vector3 longest_line(const Vector3& middle, double reach) const;
  TANDEM_HD_CALLED void gather_unlike(int side, const Vector3& line, const Vector3& push);
  TANDEM_HD_CALLED Vector3 way_out(int side, const Vector3& line, const Vector3& push);
  TANDEM_HD void find_faces_along(const Vector3& smooth, std::uint32_t (&holder)[2]) const;
  TANDEM_HD void sum_lengths_on_faces(const FloatVector (&face)[2], const std::uint32_t (&holder)[2],
                                      ExactSum (&within)[2]) const;
  TANDEM_HD void find_bearing_faces(const Vector3& smooth, double length);
  TANDEM_HD void spread_along(int count) const;
  TANDEM_HD Vector3 face_nearest(const Vector3& smooth, double length);
  TANDEM_HD double height_along(const Vector3& n) const;
  /// Returns how far b must move along a direction until a plane lies between all triangles of the region.
  TANDEM_HD_CALLED double separation_along(const Vector3& n) const;
  TANDEM_HD_CALLED int find_for_touch(Vector3& n);
  TANDEM_HD_CALLED int find_crossing_edges(Vector3& n) const;
  TANDEM_HD Vector3 crossing_edges(const Piece& piece, int number) const;
  /// Returns whether a piece's triangle of a body does not turn its back on the other body, which lies along
  /// n as seen from a.
  TANDEM_HD bool faces_other(std::uint32_t piece, int side, const FloatVector& n) const {
    const float* const normals = memory_.normals + 6 * std::size_t{piece};
    return !bodies_[side].shape->closed || dot(turned_normal(normals, side), n) > -kBesidePlane;
  }
  TANDEM_HD bool is_outside(const Vector3& n) const;
  /// Returns the normal that points from a towards b.
  TANDEM_HD static FloatVector turned_normal(const float* normals, int side) {
    const float sign = side == 0 ? 1.0f : -1.0f;
    return {{sign * normals[3 * side], sign * normals[3 * side + 1], sign * normals[3 * side + 2]}};
  }
  /// The normal, from a towards b, of a piece's triangle.
  TANDEM_HD Vector3 direction_of(int side, std::uint32_t piece) const {
    const Vector3 n = bodies_[side].triangle(memory_.pieces[piece].triangle[side]).normal;
    return side == 0 ? n : -n;
  }
  TANDEM_HD static FloatVector rounded(const Vector3& n) {
    return {{static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)}};
  }
  TANDEM_HD static bool same_face(const FloatVector& p, const FloatVector& q) {
    return distance_square(p, q) < kSameFace;
  }
  TANDEM_HD static float distance_square(const FloatVector& p, const FloatVector& q) {
    const float x = p.x[0] - q.x[0], y = p.x[1] - q.x[1], z = p.x[2] - q.x[2];
    return x * x + y * y + z * z;
  }
  TANDEM_HD static bool same_direction(const Vector3& p, const Vector3& q) { return dot(p, q) > 1 - 1e-7; }

  const Team& team_;
  const BodyPair& bodies_;
  const PieceMemory& memory_;
  NormalMemory& shared_;
  const PieceSummary& summary_;
  std::uint32_t begin_, end_;
  LeastPiece least_;  // of those that this one of the team sees
  int directions_ = 0;
  bool surrounds_hole_ = false;  ///< the curve, and none is joined with it that surrounds it
  bool several_faces_ = false;   ///< face_nearest() had to choose between faces
  double separation_ = 0;        ///< then, how far b must move until a plane lies between all triangles
  bool is_face_ = false;         ///< face_nearest() chose that of a face
};

template <typename Team>
TANDEM_HD CurveMeasure NormalFinder<Team>::measure() {
  const double unit = summary_.unit, one_by_unit = 1 / unit;
  const bool may_be_free = !summary_.degenerate && !(bodies_.a.shape->closed && bodies_.b.shape->closed);
  CurveSums sums;
  if constexpr (HasLanes<Team>) {
    team_.lanes().sum_pieces(memory_, begin_, end_, summary_.origin, one_by_unit, sums);
  } else {
    for (std::uint32_t i = begin_ + team_.rank(); i < end_; i += team_.size())
      sums.add(memory_, memory_.order[i], summary_.origin, one_by_unit);
  }
  add_up(team_, sums.area.x, sums.area.y, sums.area.z, sums.gap.x, sums.gap.y, sums.gap.z, sums.middle.x,
         sums.middle.y, sums.middle.z, sums.length);
  CurveMeasure out;
  least_ = sums.least;
  out.key = team_.least(least_.key);
  out.area = sums.area.value(unit * unit);
  out.length = sums.length.value(unit);
  const double of_points = bodies_.tolerance() * (end_ - begin_);
  const bool rounding = norm(out.area) <= of_points * unit;
  out.point = out.length <= of_points && rounding;  // polygons have area alone
  out.closed = !(may_be_free && has_free_end()) && norm(sums.gap.value(unit)) <= kClosed * out.length;
  out.middle =
      summary_.origin + (out.length > 0 ? (unit / out.length) * sums.middle.value(unit) : plain_middle());
  out.by_area = out.closed && !rounding;
  if (!out.by_area) {
    const bool sheet_a = !bodies_.a.shape->closed, sheet_b = !bodies_.b.shape->closed;
    out.sheet_normal = sum_of_normals(sheet_a || !sheet_b, sheet_b || !sheet_a);
  }
  out.by_area = out.by_area || (out.closed && !(norm(out.sheet_normal) > kNoArea * out.length));
  return out;
}

template <typename Team>
TANDEM_HD_CALLED bool NormalFinder<Team>::has_free_end() const {
  bool is_free = false;
  for_each_piece([&](const Piece& piece, const float*) {
    if (piece.kind() == MeetingKind::polygon) return;
    for (int end = 0; end < 2; ++end) {
      const TriangleFeature f = piece.feature(end);
      const std::uint32_t flags = bodies_[f.of_b].shape->topology[piece.triangle[f.of_b]].flags;
      is_free = is_free || is_boundary(flags, f.number);
    }
  });
  return team_.any(is_free);
}

/// Returns the middle of pieces without length, from the origin on.
template <typename Team>
TANDEM_HD_CALLED Vector3 NormalFinder<Team>::plain_middle() const {
  ExactVectorSum sum;
  for_each_piece([&](const Piece& piece, const float*) {
    const Vector3 from = piece.end[0] - summary_.origin;
    const bool polygon = piece.kind() == MeetingKind::polygon;
    sum.add(polygon ? from : 0.5 * (from + (piece.end[1] - summary_.origin)), 1 / summary_.unit);
  });
  add_up(team_, sum.x, sum.y, sum.z);
  return (1.0 / (end_ - begin_)) * sum.value(summary_.unit);
}

/// Returns the sum of the normals of the pieces' triangles, from a towards b, times lengths.
template <typename Team>
TANDEM_HD_CALLED Vector3 NormalFinder<Team>::sum_of_normals(bool of_a, bool of_b) const {
  const double unit = summary_.unit, one_by_unit = 1 / unit;
  ExactVectorSum sum;
  for_each_piece([&](const Piece& piece, const float* normals) {
    if (piece.kind() == MeetingKind::polygon) return;
    const double size = norm(piece.weight() * (piece.end[1] - piece.end[0]));
    if (of_a) sum.add(size * Vector3{normals[0], normals[1], normals[2]}, one_by_unit);
    if (of_b) sum.add(-(size * Vector3{normals[3], normals[4], normals[5]}), one_by_unit);
  });
  add_up(team_, sum.x, sum.y, sum.z);
  return sum.value(unit);
}

/// Returns whether a sample of pieces proves that gather_directions() is false: of more than kMostDirections
/// normals each is more than twice as far from the others as normals of one direction are from it, so no
/// direction has two of them.
template <typename Team>
TANDEM_HD bool NormalFinder<Team>::has_many_directions(int side) const {
  constexpr std::uint32_t kSample = 32;
  const std::uint32_t step = (end_ - begin_ + kSample - 1) / kSample;
  if constexpr (HasWarps<Team>) {
    // Each warp does it alone, each of its lanes with one piece.
    const std::uint32_t own = begin_ + team_.lane() * step;
    const float* n = memory_.normals + 6 * std::size_t{memory_.order[own < end_ ? own : begin_]} + 3 * side;
    std::uint32_t left = team_.ballot(own < end_);
    for (int count = 0; left != 0; ++count) {
      if (count == kMostDirections) return true;
      const std::uint32_t first = team_.first_bit(left);
      const FloatVector known = {
          {team_.from_lane(n[0], first), team_.from_lane(n[1], first), team_.from_lane(n[2], first)}};
      left &= team_.ballot(distance_square({{n[0], n[1], n[2]}}, known) > kApart);
    }
    return false;
  } else {
    FloatVector known[kMostDirections];
    int count = 0;
    for (std::uint32_t i = begin_; i < end_; i += step) {
      const float* n = memory_.normals + 6 * std::size_t{memory_.order[i]} + 3 * side;
      const FloatVector normal = {{n[0], n[1], n[2]}};
      bool apart = true;
      for (int k = 0; k < count; ++k) apart = apart && distance_square(normal, known[k]) > kApart;
      if (!apart) continue;
      if (count == kMostDirections) return true;
      known[count++] = normal;
    }
  }
  return false;
}

/// Marks pieces whose normals are of the face of a known one. Result: the least of those without a mark.
template <typename Team>
TANDEM_HD LeastPiece NormalFinder<Team>::least_unmarked(int side, const FloatVector& known) const {
  if constexpr (HasLanes<Team>) return team_.lanes().least_unmarked(memory_, begin_, end_, side, known);
  LeastPiece least;
  for (std::uint32_t i = begin_ + team_.rank(); i < end_; i += team_.size()) {
    if (mark(i) != 0) continue;
    const std::uint32_t at = memory_.order[i];
    const float* n = memory_.normals + 6 * std::size_t{at} + 3 * side;
    if (same_face({{n[0], n[1], n[2]}}, known))
      mark(i) = 1;
    else
      least.take(memory_.pieces[at].key(), at);
  }
  return least;
}

/// Adds the directions of faces of one body, from the least piece on; of more than kMostDirections the first
/// ones, if they are to be kept. False where there are more. Normals closer than half a milliradian are one.
template <typename Team>
TANDEM_HD bool NormalFinder<Team>::gather_directions(int side, bool keep_if_many) {
  if (!keep_if_many && has_many_directions(side)) return false;
  for (std::uint32_t i = begin_ + team_.rank(); i < end_; i += team_.size()) mark(i) = 0;
  LeastPiece own = least_;
  int found = 0;
  bool all = false;
  for (;; ++found) {
    const std::uint64_t key = team_.least(own.key);
    all = key == ~std::uint64_t{0};
    if (all || found == kMostDirections) break;
    const std::uint32_t holder = team_.least(own.key == key ? own.piece : kNoIndex);
    if (team_.rank() == 0) shared_.direction[directions_ + found].piece = holder;
    const float* n = memory_.normals + 6 * std::size_t{holder} + 3 * side;
    own = least_unmarked(side, {{n[0], n[1], n[2]}});
  }
  if (!all && !keep_if_many) return false;
  team_.sync();
  for (int i = static_cast<int>(team_.rank()); i < found; i += static_cast<int>(team_.size())) {
    Direction& direction = shared_.direction[directions_ + i];
    direction.n = direction_of(side, direction.piece);
  }
  directions_ += found;
  team_.sync();
  return all;
}

/// Finds the face of each body that lies most across the smooth normal. holder: the least piece that has it,
/// or kNoIndex.
template <typename Team>
TANDEM_HD void NormalFinder<Team>::find_faces_along(const Vector3& smooth, std::uint32_t (&holder)[2]) const {
  const FloatVector up = rounded(smooth);
  FaceAlong most[2];
  if constexpr (HasLanes<Team>) {
    for (int side = 0; side < 2; ++side)
      team_.lanes().find_face_along(memory_, begin_, end_, side, up, most[side]);
  } else {
    for (std::uint32_t i = begin_ + team_.rank(); i < end_; i += team_.size()) {
      const std::uint32_t at = memory_.order[i];
      for (int side = 0; side < 2; ++side) {
        const float along = dot(turned_normal(memory_.normals + 6 * std::size_t{at}, side), up);
        most[side].take(along, memory_.pieces[at].key(), at);
      }
    }
  }
  float greatest[2] = {most[0].along, most[1].along};
  team_.greatest_ones(greatest);
  std::uint64_t key[2];
  for (int side = 0; side < 2; ++side) {
    if (most[side].along != greatest[side]) most[side].least = {};
    key[side] = most[side].least.key;
  }
  team_.least_ones(key);
  for (int side = 0; side < 2; ++side)
    holder[side] = most[side].least.key == key[side] ? most[side].least.piece : kNoIndex;
  team_.least_ones(holder);
}

/// Adds up how much of the curve lies in the plane of each body's face. holder: kNoIndex of a body without.
template <typename Team>
TANDEM_HD void NormalFinder<Team>::sum_lengths_on_faces(const FloatVector (&face)[2],
                                                        const std::uint32_t (&holder)[2],
                                                        ExactSum (&within)[2]) const {
  if constexpr (HasLanes<Team>) {
    for (int side = 0; side < 2; ++side) {
      if (holder[side] == kNoIndex) continue;
      team_.lanes().sum_length_on_face(memory_, begin_, end_, face[side], 1 / summary_.unit, within[side]);
    }
  } else {
    for_each_piece([&](const Piece& piece, const float* normals) {
      if (piece.kind() == MeetingKind::polygon) return;
      const double size = norm(piece.weight() * (piece.end[1] - piece.end[0]));
      for (int side = 0; side < 2; ++side) {
        if (same_face(turned_normal(normals, 0), face[side]) ||
            same_face(turned_normal(normals, 1), face[side]))
          within[side].add(size, 1 / summary_.unit);
      }
    });
  }
  add_up(team_, within[0], within[1]);
}

/// Finds the faces of bodies of many faces that a patch lies on, as where prisms stand on each other: of each
/// body the face that lies most across the smooth normal, if nearly all of the curve lies in the plane of
/// such a face.
template <typename Team>
TANDEM_HD void NormalFinder<Team>::find_bearing_faces(const Vector3& smooth, double length) {
  directions_ = 0;
  std::uint32_t holder[2];
  find_faces_along(smooth, holder);
  if (holder[0] == kNoIndex && holder[1] == kNoIndex) return;
  Vector3 n[2];
  FloatVector face[2] = {};
  for (int side = 0; side < 2; ++side) {
    if (holder[side] == kNoIndex) continue;
    n[side] = direction_of(side, holder[side]);
    face[side] = rounded(n[side]);
  }
  ExactSum within[2];
  sum_lengths_on_faces(face, holder, within);
  for (int side = 0; side < 2; ++side) {
    if (holder[side] == kNoIndex || !(within[side].value(summary_.unit) >= kBearing * length)) continue;
    if (team_.rank() == 0) shared_.direction[directions_] = {n[side], holder[side]};
    ++directions_;
  }
  team_.sync();
}

/// The heights of the patch's triangles along the directions that are tried, from the patch's origin on: a's
/// highest corner and b's lowest.
template <typename Team>
TANDEM_HD void NormalFinder<Team>::spread_along(int count) const {
  if constexpr (HasLanes<Team>) {
    return team_.lanes().spread_along(bodies_, memory_, begin_, end_, summary_.origin, shared_.tried, count,
                                      shared_.spread);
  }
  constexpr int kAtOnce = 4;  // so that they stay in registers
  for (int first = 0; first < count; first += kAtOnce) {
    Vector3 along[kAtOnce];
    double furthest[2 * kAtOnce];  // of a, of b the other way
    for (int i = 0; i < kAtOnce; ++i) {
      along[i] = shared_.tried[first + i < count ? first + i : first];
      furthest[2 * i] = furthest[2 * i + 1] = -INFINITY;
    }
    std::uint32_t seen_a = kNoIndex, seen_b = kNoIndex;
    for_each_piece([&](const Piece& piece, const float*) {
      for (int k = 0; k < 3 && piece.triangle[0] != seen_a; ++k) {
        const Vector3 p = bodies_.a.corner(piece.triangle[0], k) - summary_.origin;
        for (int i = 0; i < kAtOnce; ++i) furthest[2 * i] = greater(furthest[2 * i], dot(along[i], p));
      }
      for (int k = 0; k < 3 && piece.triangle[1] != seen_b; ++k) {
        const Vector3 q = bodies_.b.corner(piece.triangle[1], k) - summary_.origin;
        for (int i = 0; i < kAtOnce; ++i)
          furthest[2 * i + 1] = greater(furthest[2 * i + 1], -dot(along[i], q));
      }
      seen_a = piece.triangle[0], seen_b = piece.triangle[1];
    });
    team_.greatest_ones(furthest);
    for (int i = 0; i < kAtOnce; ++i) {
      if (team_.rank() == 0 && first + i < count)
        shared_.spread[first + i] = {furthest[2 * i], -furthest[2 * i + 1]};
    }
  }
  team_.sync();
}

/// If few flat faces meet, as boxes do, the curve's own normal leans a little, by depth over length. Along
/// the face normal that separates the patch's triangles soonest they stay upright. How far b must move until
/// a plane lies between all of the triangles counts, not how deep the overlap is: the tip of a pyramid in the
/// ground is narrower than it is deep, yet the ground goes on. A body whose triangles in the patch all face
/// one way is such a ground, and nothing else is to be compared; unless the other body has a face there that
/// lies flush with it, facing the same way: of what sticks out of the ground there the tip is outside.
template <typename Team>
TANDEM_HD Vector3 NormalFinder<Team>::face_nearest(const Vector3& smooth, double length) {
  directions_ = 0;
  int of_a = 0, of_b = 0, first_of_b = 0;
  TANDEM_ROLLED
  for (int side = 0; side < 2; ++side) {
    first_of_b = directions_;
    const bool all = gather_directions(side, false);
    (side == 0 ? of_a : of_b) = all ? directions_ - first_of_b : kMost;
  }
  if ((of_a == 1) != (of_b == 1)) {
    const Vector3 n = shared_.direction[of_a == 1 ? 0 : first_of_b].n;
    bool flush = false;
    for (int i = 0; i < directions_; ++i) flush = flush || dot(shared_.direction[i].n, n) < kFlush;
    is_face_ = !flush && dot(n, smooth) > 0;
    if (!flush) return is_face_ ? n : smooth;
  }
  if (of_a == kMost || of_b == kMost) find_bearing_faces(smooth, length);
  int count = 0;
  const auto add = [&](const Vector3& n) {
    if (team_.rank() == 0) shared_.tried[count] = n;
    ++count;
  };
  add(smooth);
  for (int i = 0; i < directions_; ++i) {
    const Vector3 n = shared_.direction[i].n;
    if (dot(n, smooth) >= kLeastAlong) add(n);
  }
  if (count == 1) return smooth;
  several_faces_ = of_a != kMost && of_b != kMost;
  team_.sync();
  spread_along(count);
  const auto separation = [&](int i) { return shared_.spread[i].highest_a - shared_.spread[i].lowest_b; };
  int best = 0;
  double least = separation(0) * (1 + 1e-9);
  for (int i = 1; i < count; ++i) {
    if (separation(i) < least) best = i, least = separation(i) * (1 - 1e-9);
  }
  separation_ = separation(best);
  for (int i = 0; i < directions_; ++i)
    is_face_ = is_face_ || same_direction(shared_.tried[best], shared_.direction[i].n);
  return shared_.tried[best];
}

/// Returns how high the curve is along a direction.
template <typename Team>
TANDEM_HD double NormalFinder<Team>::height_along(const Vector3& n) const {
  double furthest[2] = {-INFINITY, -INFINITY};
  for_each_piece([&](const Piece& piece, const float*) {
    for (int end = 0; end < (piece.kind() == MeetingKind::polygon ? 1 : 2); ++end) {
      const double height = dot(n, piece.end[end] - summary_.origin);
      furthest[0] = greater(furthest[0], height), furthest[1] = greater(furthest[1], -height);
    }
  });
  team_.greatest_ones(furthest);
  return furthest[0] + furthest[1];
}

template <typename Team>
TANDEM_HD_CALLED double NormalFinder<Team>::separation_along(const Vector3& n) const {
  team_.sync();
  if (team_.rank() == 0) shared_.tried[0] = n;
  team_.sync();
  spread_along(1);
  const double separation = shared_.spread[0].highest_a - shared_.spread[0].lowest_b;
  team_.sync();
  return separation;
}

template <typename Team>
TANDEM_HD_CALLED double NormalFinder<Team>::reach_from(const Vector3& middle) const {
  double most = 0;
  for_each_piece([&](const Piece& piece, const float*) {
    most = greater(norm(piece.end[0] - middle), most);
    if (piece.kind() != MeetingKind::polygon) most = greater(norm(piece.end[1] - middle), most);
  });
  return team_.greatest(most);
}

template <typename Team>
TANDEM_HD PatchNormal NormalFinder<Team>::find(const CurveMeasure& curve) {
  PatchNormal out;
  const bool no_area = !(curve.closed ? norm(curve.area) > kNoArea * bodies_.reach() * curve.length
                                      : norm(curve.sheet_normal) > kNoArea * curve.length);
  if (no_area || curve.point) {
    const int separating = find_for_touch(out.n);
    out.kind = separating == 1 ? PatchKind::touch : separating > 1 ? PatchKind::ambiguous : PatchKind::deep;
    // Points may hide a patch that is smaller than rounding.
    if (no_area || separating == 1) return out;
  }
  const bool joined = memory_.pieces[memory_.order[begin_]].joined != 0;
  // Around a hole that was not joined with what surrounds it, the area points against the faces.
  surrounds_hole_ = !joined && summary_.curves > 1 && curve.closed && curve.by_area &&
                    dot(sum_of_normals(true, true), curve.area) < 0;
  if (joined || surrounds_hole_) {
    out.kind = PatchKind::deep;
    return out;
  }
  out.kind = PatchKind::overlap;
  out.n = face_nearest(normalized(curve.by_area ? curve.area : curve.sheet_normal), curve.length);
  // Triangles say along which face the overlap is removed the shortest way only where it is flat, and they do
  // not reach far beyond it, as those of a corner do.
  if (several_faces_) {
    const double reach = reach_from(curve.middle);
    if (separation_ > 2 * reach || height_along(out.n) > kNotFlat * reach) out.kind = PatchKind::deep;
  }
  // Where corners or edges lie in faces, rounding may leave out a part of the curve, and the area tells
  // little.
  if (summary_.degenerate && (!is_face_ || separation_along(out.n) > 2 * reach_from(curve.middle)))
    out.kind = PatchKind::deep;
  return out;
}

}  // namespace tandem::manifold

#include "kernels/manifold/deep_directions.h"
#include "kernels/manifold/patch_touch.h"
