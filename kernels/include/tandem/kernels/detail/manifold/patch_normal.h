#pragma once
#include "tandem/kernels/detail/manifold/patch.h"

namespace tandem::manifold {

/// An area vector below this part of length times largest coordinate is rounding: the surfaces only touch.
inline constexpr double kNoArea = 0x1p-40;

/// A curve whose ends are apart by less than this part of its length closes.
inline constexpr double kClosed = 1e-6;

/// Faces in so few directions on both sides make a patch one of flat faces; otherwise it is a smooth one.
inline constexpr int kMostDirections = 5;

/// A smooth patch lies on a face if this part of its curve lies in the face's plane.
inline constexpr double kBearing = 0.9;

/// Measures a curve, and finds the direction in which its patch pushes.
template <typename Team>
class NormalFinder {
 public:
  TANDEM_HD NormalFinder(const Team& team, const BodyPair& bodies, const PieceMemory& memory,
                         const PieceSummary& summary, std::uint32_t curve)
      : team_(team),
        bodies_(bodies),
        memory_(memory),
        summary_(summary),
        begin_(memory.start[curve]),
        end_(memory.start[curve + 1]) {}

  TANDEM_HD CurveMeasure measure();

  /// Condition: measure(), whose result this is.
  TANDEM_HD PatchNormal find(const CurveMeasure& curve);

 private:
  struct Direction {
    Vector3 n;            // from a towards b
    std::uint64_t piece;  // key of the piece whose triangle has it
  };
  static constexpr int kMost = kMostTried;
  static_assert(kMost == 2 * kMostDirections + 1);

  template <typename Visit>
  TANDEM_HD void for_each_piece(const Visit& visit) const {
    for (std::uint32_t i = begin_ + team_.rank(); i < end_; i += team_.size()) {
      const std::uint32_t at = memory_.order[i];
      visit(memory_.pieces[at], memory_.normals + 6 * std::size_t{at});
    }
  }
  /// Marks that pieces have for the time being. Each is seen by one of the team alone.
  TANDEM_HD std::uint32_t& mark(std::uint32_t i) const { return memory_.curve[i]; }
  TANDEM_HD bool has_free_end() const;
  TANDEM_HD Vector3 plain_middle() const;
  TANDEM_HD Vector3 sheet_normal() const;
  TANDEM_HD bool has_many_directions(int side) const;
  TANDEM_HD bool gather_directions(int side, bool keep_if_many);
  TANDEM_HD void find_bearing_faces(const Vector3& smooth, double length);
  TANDEM_HD void spread_along(const Vector3* directions, int count, Spread* spread) const;
  TANDEM_HD Vector3 face_nearest(const Vector3& smooth, double length);
  TANDEM_HD bool find_for_touch(Vector3& n);
  TANDEM_HD bool find_crossing_edges(Vector3& n) const;
  TANDEM_HD Vector3 crossing_edges(const Piece& piece, int number) const;
  /// From a towards b.
  TANDEM_HD static FloatVector turned_normal(const float* normals, int side) {
    const float sign = side == 0 ? 1.0f : -1.0f;
    return {{sign * normals[3 * side], sign * normals[3 * side + 1], sign * normals[3 * side + 2]}};
  }
  /// The normal, from a towards b, of the triangle of a piece.
  TANDEM_HD Vector3 direction_of(int side, std::uint64_t piece) const {
    const Vector3 n =
        bodies_[side].triangle(static_cast<std::uint32_t>(side == 0 ? piece >> 32 : piece)).normal;
    return side == 0 ? n : -n;
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
  const PieceSummary& summary_;
  std::uint32_t begin_, end_;
  std::uint64_t key_ = 0;       // of the least piece
  Direction direction_[kMost];  // of faces of a, then of b
  int directions_ = 0;
};

template <typename Team>
TANDEM_HD CurveMeasure NormalFinder<Team>::measure() {
  const double unit = summary_.unit, one_by_unit = 1 / unit;
  const bool may_be_free = !summary_.degenerate && !(bodies_.a.shape->closed && bodies_.b.shape->closed);
  CurveSums sums;
  if constexpr (HasMeans<Team>) {
    team_.means().sum_pieces(memory_, begin_, end_, summary_.origin, one_by_unit, sums);
  } else {
    for_each_piece([&](const Piece& piece, const float*) { sums.add(piece, summary_.origin, one_by_unit); });
  }
  add_up(team_, {&sums.area.x, &sums.area.y, &sums.area.z, &sums.gap.x, &sums.gap.y, &sums.gap.z,
                 &sums.middle.x, &sums.middle.y, &sums.middle.z, &sums.length});
  CurveMeasure out;
  out.key = key_ = team_.least(sums.key);
  out.area = sums.area.value(unit * unit);
  out.length = sums.length.value(unit);
  out.closed = !(may_be_free && has_free_end()) && norm(sums.gap.value(unit)) <= kClosed * out.length;
  out.middle =
      summary_.origin + (out.length > 0 ? (unit / out.length) * sums.middle.value(unit) : plain_middle());
  if (!out.closed) out.sheet_normal = sheet_normal();
  return out;
}

template <typename Team>
TANDEM_HD bool NormalFinder<Team>::has_free_end() const {
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

/// Of pieces without length, from the origin on.
template <typename Team>
TANDEM_HD Vector3 NormalFinder<Team>::plain_middle() const {
  ExactVectorSum sum;
  for_each_piece([&](const Piece& piece, const float*) {
    const Vector3 from = piece.end[0] - summary_.origin;
    const bool polygon = piece.kind() == MeetingKind::polygon;
    sum.add(polygon ? from : 0.5 * (from + (piece.end[1] - summary_.origin)), 1 / summary_.unit);
  });
  add_up(team_, {&sum.x, &sum.y, &sum.z});
  return (1.0 / (end_ - begin_)) * sum.value(summary_.unit);
}

template <typename Team>
TANDEM_HD Vector3 NormalFinder<Team>::sheet_normal() const {
  const bool sheet_a = !bodies_.a.shape->closed, sheet_b = !bodies_.b.shape->closed;
  const double unit = summary_.unit, one_by_unit = 1 / unit;
  ExactVectorSum sum;
  for_each_piece([&](const Piece& piece, const float* normals) {
    if (piece.kind() == MeetingKind::polygon) return;
    const double size = norm(piece.weight() * (piece.end[1] - piece.end[0]));
    if (sheet_a || !sheet_b) sum.add(size * Vector3{normals[0], normals[1], normals[2]}, one_by_unit);
    if (sheet_b || !sheet_a) sum.add(-(size * Vector3{normals[3], normals[4], normals[5]}), one_by_unit);
  });
  add_up(team_, {&sum.x, &sum.y, &sum.z});
  return sum.value(unit);
}

/// Whether a sample of pieces proves that gather_directions() is false: of more than kMostDirections normals
/// each is more than twice as far from the others as normals of one direction are from it, so no direction
/// has two of them. All of the team come to the same answer.
template <typename Team>
TANDEM_HD bool NormalFinder<Team>::has_many_directions(int side) const {
  constexpr std::uint32_t kSample = 32;
  const std::uint32_t step = (end_ - begin_ + kSample - 1) / kSample;
  FloatVector known[kMostDirections];
  int count = 0;
  for (std::uint32_t i = begin_; i < end_; i += step) {
    const float* n = memory_.normals + 6 * std::size_t{memory_.order[i]} + 3 * side;
    const FloatVector normal = {{n[0], n[1], n[2]}};
    bool apart = true;
    for (int k = 0; k < count; ++k) apart = apart && distance_square(normal, known[k]) > 4.1f * kSameFace;
    if (!apart) continue;
    if (count == kMostDirections) return true;
    known[count++] = normal;
  }
  return false;
}

/// Adds the directions of faces of one body, from the least piece on; of more than kMostDirections the first
/// ones, if they are to be kept. False where there are more. Normals closer than half a milliradian are one.
template <typename Team>
TANDEM_HD bool NormalFinder<Team>::gather_directions(int side, bool keep_if_many) {
  if (!keep_if_many && has_many_directions(side)) return false;
  std::uint64_t first_piece[kMostDirections];
  FloatVector known = {};  // the last direction
  int found = 0;
  bool all = false;
  if constexpr (HasMeans<Team>) {
    for (std::uint32_t i = begin_; i < end_; ++i) mark(i) = 0;
    for (std::uint64_t key = key_;; ++found) {
      all = key == ~std::uint64_t{0};
      if (all || found == kMostDirections) break;
      first_piece[found] = key;
      const Vector3 n = direction_of(side, key);
      const float turn = side == 0 ? 1.0f : -1.0f;
      known = {
          {turn * static_cast<float>(n.x), turn * static_cast<float>(n.y), turn * static_cast<float>(n.z)}};
      key = team_.means().least_unmarked(memory_, begin_, end_, side, known);
    }
  }
  for (; !HasMeans<Team>; ++found) {
    std::uint64_t own = ~std::uint64_t{0};
    std::uint32_t holder = kNoIndex;
    for (std::uint32_t i = begin_ + team_.rank(); i < end_; i += team_.size()) {
      const std::uint32_t at = memory_.order[i];
      if (found == 0) {
        mark(i) = 0;
      } else {
        if (mark(i) != 0) continue;
        const float* n = memory_.normals + 6 * std::size_t{at} + 3 * side;
        if (same_face({{n[0], n[1], n[2]}}, known)) {
          mark(i) = 1;
          continue;
        }
      }
      const std::uint64_t key = memory_.pieces[at].key();
      if (key < own) own = key, holder = at;
    }
    const std::uint64_t key = team_.least(own);
    all = key == ~std::uint64_t{0};
    if (all || found == kMostDirections) break;
    first_piece[found] = key;
    holder = team_.least(own == key ? holder : kNoIndex);
    const float* n = memory_.normals + 6 * std::size_t{holder} + 3 * side;
    known = {{n[0], n[1], n[2]}};
  }
  if (!all && !keep_if_many) return false;
  for (int i = 0; i < found; ++i)
    direction_[directions_++] = {direction_of(side, first_piece[i]), first_piece[i]};
  return all;
}

/// Of bodies of many faces those that a patch lies on, as where prisms stand on each other: of each body the
/// face that lies most across the smooth normal, if nearly all of the curve lies in the plane of such a face.
template <typename Team>
TANDEM_HD void NormalFinder<Team>::find_bearing_faces(const Vector3& smooth, double length) {
  directions_ = 0;
  const FloatVector up = {
      {static_cast<float>(smooth.x), static_cast<float>(smooth.y), static_cast<float>(smooth.z)}};
  FaceAlong most[2] = {{0.9f, ~std::uint64_t{0}}, {0.9f, ~std::uint64_t{0}}};
  if constexpr (HasMeans<Team>) {
    for (int side = 0; side < 2; ++side)
      team_.means().find_face_along(memory_, begin_, end_, side, up, most[side]);
  } else {
    for_each_piece([&](const Piece& piece, const float* normals) {
      for (int side = 0; side < 2; ++side)
        most[side].take(dot(turned_normal(normals, side), up), piece.key());
    });
  }
  float greatest[2] = {most[0].along, most[1].along};
  team_.greatest_ones(greatest);
  std::uint64_t key[2];
  for (int side = 0; side < 2; ++side)
    key[side] = most[side].along == greatest[side] ? most[side].key : ~std::uint64_t{0};
  team_.least_ones(key);
  Vector3 n[2];
  FloatVector face[2] = {};
  bool any = false;
  for (int side = 0; side < 2; ++side) {
    if (key[side] == ~std::uint64_t{0}) continue;
    any = true;
    n[side] = direction_of(side, key[side]);
    face[side] = {
        {static_cast<float>(n[side].x), static_cast<float>(n[side].y), static_cast<float>(n[side].z)}};
  }
  if (!any) return;
  ExactSum within[2];
  if constexpr (HasMeans<Team>) {
    for (int side = 0; side < 2; ++side) {
      if (key[side] == ~std::uint64_t{0}) continue;
      team_.means().sum_length_on_face(memory_, begin_, end_, face[side], 1 / summary_.unit, within[side]);
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
  add_up(team_, {&within[0], &within[1]});
  for (int side = 0; side < 2; ++side) {
    if (key[side] != ~std::uint64_t{0} && within[side].value(summary_.unit) >= kBearing * length)
      direction_[directions_++] = {n[side], key[side]};
  }
}

/// The heights of the patch's triangles along directions, from the patch's origin on: a's highest corner and
/// b's lowest.
template <typename Team>
TANDEM_HD void NormalFinder<Team>::spread_along(const Vector3* directions, int count, Spread* spread) const {
  if constexpr (HasMeans<Team>) {
    return team_.means().spread_along(bodies_, memory_, begin_, end_, summary_.origin, directions, count,
                                      spread);
  }
  for (int i = 0; i < count; ++i) spread[i] = {-INFINITY, INFINITY};
  std::uint32_t seen_a = kNoIndex, seen_b = kNoIndex;
  for_each_piece([&](const Piece& piece, const float*) {
    for (int k = 0; k < 3 && piece.triangle[0] != seen_a; ++k) {
      const Vector3 p = bodies_.a.corner(piece.triangle[0], k) - summary_.origin;
      for (int i = 0; i < count; ++i)
        spread[i].highest_a = greater(spread[i].highest_a, dot(directions[i], p));
    }
    for (int k = 0; k < 3 && piece.triangle[1] != seen_b; ++k) {
      const Vector3 q = bodies_.b.corner(piece.triangle[1], k) - summary_.origin;
      for (int i = 0; i < count; ++i) spread[i].lowest_b = lesser(spread[i].lowest_b, dot(directions[i], q));
    }
    seen_a = piece.triangle[0], seen_b = piece.triangle[1];
  });
  double furthest[2 * kMost];
  for (int i = 0; i < count; ++i)
    furthest[2 * i] = spread[i].highest_a, furthest[2 * i + 1] = -spread[i].lowest_b;
  team_.greatest_ones(furthest, 2 * count);
  for (int i = 0; i < count; ++i) spread[i] = {furthest[2 * i], -furthest[2 * i + 1]};
}

/// Where few flat faces meet, as boxes do, the curve's own normal leans a little, by depth over length: along
/// the face normal that separates the patch's triangles soonest they stay upright. How far b must move until
/// a plane lies between all of the triangles counts, not how deep the overlap is: the tip of a pyramid in the
/// ground is narrower than it is deep, yet the ground goes on. A body whose triangles in the patch all face
/// one way is such a ground, and nothing else is to be compared.
template <typename Team>
TANDEM_HD Vector3 NormalFinder<Team>::face_nearest(const Vector3& smooth, double length) {
  directions_ = 0;
  const int of_a = gather_directions(0, false) ? directions_ : kMost, first_of_b = directions_;
  const int of_b = gather_directions(1, false) ? directions_ - first_of_b : kMost;
  if ((of_a == 1) != (of_b == 1)) {
    const Vector3& n = direction_[of_a == 1 ? 0 : first_of_b].n;
    return dot(n, smooth) > 0 ? n : smooth;
  }
  if (of_a == kMost || of_b == kMost) find_bearing_faces(smooth, length);
  const Vector3 apart = bodies_.apart();
  Vector3 tried[kMost] = {smooth};
  int count = 1;
  for (int i = 0; i < directions_; ++i) {
    const Vector3& n = direction_[i].n;
    const double cosine = dot(n, smooth);
    if (cosine < 0.1 && (cosine < -0.1 || !(dot(n, apart) > 0))) continue;
    tried[count++] = n;
  }
  if (count == 1) return smooth;
  Spread spread[kMost];
  spread_along(tried, count, spread);
  Vector3 best = smooth;
  double least = (spread[0].highest_a - spread[0].lowest_b) * (1 + 1e-9);
  for (int i = 1; i < count; ++i) {
    const double separation = spread[i].highest_a - spread[i].lowest_b;
    if (separation < least) best = tried[i], least = separation * (1 - 1e-9);
  }
  return best;
}

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

/// The one direction across an edge of each body that separates all triangles of the patch.
template <typename Team>
TANDEM_HD bool NormalFinder<Team>::find_crossing_edges(Vector3& n) const {
  constexpr std::uint32_t kMostPieces = 16, kDirections = 18;  // each of 3 x 3 edges, both ways
  if (end_ - begin_ > kMostPieces) return false;
  const double tolerance = kNoArea * bodies_.reach();
  const auto separates = [&](const Vector3& direction, const Vector3& x) {
    for (std::uint32_t i = begin_; i < end_; ++i) {
      const Piece& piece = memory_.pieces[memory_.order[i]];
      for (int k = 0; k < 3; ++k) {
        if (!(dot(direction, bodies_.a.corner(piece.triangle[0], k) - x) <= tolerance)) return false;
        if (!(dot(direction, bodies_.b.corner(piece.triangle[1], k) - x) >= -tolerance)) return false;
      }
    }
    return true;
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
  if (!team_.any(found)) return false;
  // Of the least piece the first direction counts, if no other piece has another one.
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
  return !team_.any(other);
}

/// The one direction, of faces there and else of crossings of edges, that has all of a's triangles there on
/// one side and b's on the other. Where several do, corners or edges lie on each other: nothing to lean on.
template <typename Team>
TANDEM_HD bool NormalFinder<Team>::find_for_touch(Vector3& n) {
  directions_ = 0;
  gather_directions(0, true);
  gather_directions(1, true);
  Vector3 tried[kMost], at[kMost];
  for (int i = 0; i < directions_; ++i) tried[i] = direction_[i].n, at[i] = {};
  // Each direction's plane goes through the piece that has it.
  for (int i = 0; i < directions_; ++i) {
    Vector3 x = {-INFINITY, -INFINITY, -INFINITY};
    for_each_piece([&](const Piece& piece, const float*) {
      if (piece.key() == direction_[i].piece) x = piece.end[0];
    });
    at[i] = {team_.greatest(x.x), team_.greatest(x.y), team_.greatest(x.z)};
  }
  Spread spread[kMost];
  spread_along(tried, directions_, spread);
  const double tolerance = kNoArea * bodies_.reach();
  int found = 0;
  for (int i = 0; i < directions_; ++i) {
    const double height = dot(tried[i], at[i] - summary_.origin);
    if (!(spread[i].highest_a - height <= tolerance && spread[i].lowest_b - height >= -tolerance)) continue;
    if (found > 0 && same_direction(n, tried[i])) continue;
    if (found == 0) n = tried[i];
    ++found;
  }
  return found == 0 ? find_crossing_edges(n) : found == 1;
}

template <typename Team>
TANDEM_HD PatchNormal NormalFinder<Team>::find(const CurveMeasure& curve) {
  PatchNormal out;
  out.touch = !(curve.closed ? norm(curve.area) > kNoArea * bodies_.reach() * curve.length
                             : norm(curve.sheet_normal) > kNoArea * curve.length);
  if (out.touch) {
    out.known = find_for_touch(out.n);
  } else {
    out.n = face_nearest(normalized(curve.closed ? curve.area : curve.sheet_normal), curve.length);
    out.known = true;
  }
  return out;
}

}  // namespace tandem::manifold
