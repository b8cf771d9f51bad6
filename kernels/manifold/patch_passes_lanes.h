#pragma once
#include <bit>
#include <cmath>

#include "kernels/manifold/double_lanes.h"

#ifdef TANDEM_HAVE_LANES
#include "kernels/manifold/manifold_lanes.h"

// These are the passes of patch_normal.h, patch_rim.h and manifold_maker.h over all pieces of a curve, four
// pieces at a time.
namespace tandem {
namespace {

/// ExactSum, a part of it in each lane. The bits of whole_number()'s constant are taken off in the end, as
/// often as something was added; whole numbers may go round.
struct ExactSumLanes {
  using Words [[gnu::vector_size(32)]] = std::uint64_t;
  Words upper = {}, lower = {};

  TANDEM_INLINE void add(const DoubleLanes<4>& value, double one_by_unit) {
    const DoubleLanes<4> scaled = value * one_by_unit * 0x1p30;
    const DoubleLanes<4> sum = scaled + kMagic, rest = (scaled - (sum - kMagic)) * 0x1p30 + kMagic;
    upper += reinterpret_cast<Words>(sum);
    lower += reinterpret_cast<Words>(rest);
  }
  TANDEM_INLINE void add_to(manifold::ExactSum& sum, std::uint32_t times) const {
    const std::uint64_t constants = 4 * std::uint64_t{times} * std::bit_cast<std::uint64_t>(kMagic);
    sum.upper += whole(upper, constants), sum.lower += whole(lower, constants);
  }

 private:
  static constexpr double kMagic = 0x1.8p52;

  TANDEM_INLINE static std::int64_t whole(const Words& lanes, std::uint64_t constants) {
    std::uint64_t all = 0;
    for (int i = 0; i < 4; ++i) all += lanes[i];
    return static_cast<std::int64_t>(all - constants);
  }
};

struct ExactVectorSumLanes {
  ExactSumLanes x, y, z;

  TANDEM_INLINE void add(const Vector3Lanes<4>& v, double one_by_unit) {
    x.add(v.x, one_by_unit), y.add(v.y, one_by_unit), z.add(v.z, one_by_unit);
  }
  TANDEM_INLINE void add_to(manifold::ExactVectorSum& sum, std::uint32_t times) const {
    x.add_to(sum.x, times), y.add_to(sum.y, times), z.add_to(sum.z, times);
  }
};

TANDEM_INLINE Vector3Lanes<4> scaled(const DoubleLanes<4>& s, const Vector3Lanes<4>& v) {
  return {s * v.x, s * v.y, s * v.z};
}

/// Four pieces of a curve; beyond its end the last one again.
struct FourPieces {
  std::uint32_t at[4];
  const manifold::Piece* piece[4];
  std::uint32_t lanes;

  TANDEM_INLINE FourPieces(const manifold::PieceMemory& memory, std::uint32_t i, std::uint32_t end)
      : lanes(end - i < 4 ? end - i : 4) {
    for (std::uint32_t k = 0; k < 4; ++k) {
      at[k] = memory.order[k < lanes ? i + k : end - 1];
      piece[k] = memory.pieces + at[k];
    }
  }
  TANDEM_INLINE void ends(Vector3Lanes<4>& from, Vector3Lanes<4>& to) const {
    using D = DoubleLanes<4>;
    D low[4], high[4];  // x, y, z of the first end, x of the other; z of the first, x, y, z of the other
    for (int k = 0; k < 4; ++k) {
      __builtin_memcpy(&low[k], &piece[k]->end[0].x, sizeof(D));
      __builtin_memcpy(&high[k], &piece[k]->end[0].z, sizeof(D));
    }
    transpose(low), transpose(high);
    from = {low[0], low[1], low[2]};
    to = {low[3], high[2], high[3]};
  }
  /// 0 beyond the end and for polygons.
  TANDEM_INLINE DoubleLanes<4> weights() const {
    DoubleLanes<4> out;
    for (std::uint32_t k = 0; k < 4; ++k)
      out[k] = k < lanes && piece[k]->kind() != manifold::MeetingKind::polygon ? piece[k]->weight() : 0;
    return out;
  }
  TANDEM_INLINE void triangles(int side, std::uint32_t (&index)[4]) const {
    for (int k = 0; k < 4; ++k) index[k] = piece[k]->triangle[side];
  }
};

/// CurveSums::add() of all pieces.
void sum_pieces(const manifold::PieceMemory& memory, std::uint32_t begin, std::uint32_t end,
                const manifold::Vector3& origin, double one_by_unit, manifold::CurveSums& out) {
  ExactVectorSumLanes area, gap, middle;
  ExactSumLanes length;
  std::uint32_t times = 0;
  for (std::uint32_t i = begin; i < end; i += 4, ++times) {
    const FourPieces four(memory, i, end);
    Vector3Lanes<4> first, second;
    four.ends(first, second);
    const DoubleLanes<4> weight = four.weights();
    const Vector3Lanes<4> from = first - origin, along = scaled(weight, second - first);
    const Vector3Lanes<4> across = cross(from, along);
    area.add({0.5 * across.x, 0.5 * across.y, 0.5 * across.z}, one_by_unit * one_by_unit);
    gap.add(along, one_by_unit);
    const DoubleLanes<4> size = square_root(dot(along, along));
    length.add(size, one_by_unit);
    const Vector3Lanes<4> to = second - origin;
    const Vector3Lanes<4> half_way = {0.5 * (from.x + to.x), 0.5 * (from.y + to.y), 0.5 * (from.z + to.z)};
    middle.add(scaled(size * one_by_unit, half_way), one_by_unit);
    for (int k = 0; k < 4; ++k) out.least.take(four.piece[k]->key(), four.at[k]);
    for (std::uint32_t k = 0; k < four.lanes; ++k) {
      if (four.piece[k]->kind() == manifold::MeetingKind::polygon)
        out.area.add(four.piece[k]->end[1], one_by_unit * one_by_unit);
    }
  }
  area.add_to(out.area, times), gap.add_to(out.gap, times), middle.add_to(out.middle, times);
  length.add_to(out.length, times);
}

/// The normals of four pieces, of a's triangle or b's. One float beyond them is read.
struct FourNormals {
  Lanes4 x, y, z;

  TANDEM_INLINE FourNormals(const manifold::PieceMemory& memory, const FourPieces& four, int side) {
    Lanes4 rows[4];
    for (int k = 0; k < 4; ++k) rows[k] = load(memory.normals + 6 * std::size_t{four.at[k]} + 3 * side);
    transpose(rows);
    x = rows[0], y = rows[1], z = rows[2];
  }
  TANDEM_INLINE LaneMask<4> of_face(const manifold::FloatVector& n) const {
    const Lanes4 p = x + -n.x[0], q = y + -n.x[1], r = z + -n.x[2];
    return {(p * p + q * q + r * r).v < manifold::kSameFace};
  }
};

/// NormalFinder::least_unmarked(). A piece's mark is where its curve was.
manifold::LeastPiece least_unmarked(const manifold::PieceMemory& memory, std::uint32_t begin,
                                    std::uint32_t end, int side, const manifold::FloatVector& known) {
  using Marks = Vector<4>::Bits;
  manifold::LeastPiece least;
  for (std::uint32_t i = begin; i < end; i += 4) {
    const FourPieces four(memory, i, end);
    Marks marks = {1, 1, 1, 1};
    if (four.lanes == 4) {
      __builtin_memcpy(&marks, memory.curve + i, sizeof marks);
    } else {
      for (std::uint32_t k = 0; k < four.lanes; ++k)
        marks[k] = static_cast<std::int32_t>(memory.curve[i + k]);
    }
    if (LaneMask<4>{marks == 0}.mask() == 0) continue;
    marks |= FourNormals(memory, four, side).of_face(known).bits & 1;
    if (four.lanes == 4) {
      __builtin_memcpy(memory.curve + i, &marks, sizeof marks);
    } else {
      for (std::uint32_t k = 0; k < four.lanes; ++k)
        memory.curve[i + k] = static_cast<std::uint32_t>(marks[k]);
    }
    for (unsigned left = LaneMask<4>{marks == 0}.mask(); left != 0; left &= left - 1)
      least.take(four.piece[std::countr_zero(left)]->key(), four.at[std::countr_zero(left)]);
  }
  return least;
}

/// This is a pass of NormalFinder::find_bearing_faces().
void find_face_along(const manifold::PieceMemory& memory, std::uint32_t begin, std::uint32_t end, int side,
                     const manifold::FloatVector& up, manifold::FaceAlong& best) {
  const float sign = side == 0 ? 1 : -1;
  const float x = sign * up.x[0], y = sign * up.x[1], z = sign * up.x[2];
  for (std::uint32_t i = begin; i < end; i += 4) {
    const FourPieces four(memory, i, end);
    const FourNormals n(memory, four, side);
    const Lanes4 along = x * n.x + y * n.y + z * n.z;
    for (unsigned found = LaneMask<4>{along.v >= best.along}.mask(); found != 0; found &= found - 1) {
      const int k = std::countr_zero(found);
      best.take(along.v[k], four.piece[k]->key(), four.at[k]);
    }
  }
}

/// This is a pass of NormalFinder::find_bearing_faces().
void sum_length_on_face(const manifold::PieceMemory& memory, std::uint32_t begin, std::uint32_t end,
                        const manifold::FloatVector& face, double one_by_unit, manifold::ExactSum& sum) {
  const manifold::FloatVector turned = {{-face.x[0], -face.x[1], -face.x[2]}};
  for (std::uint32_t i = begin; i < end; i += 4) {
    const FourPieces four(memory, i, end);
    unsigned found =
        (FourNormals(memory, four, 0).of_face(face) | FourNormals(memory, four, 1).of_face(turned)).mask();
    for (found &= (1u << four.lanes) - 1; found != 0; found &= found - 1) {
      const manifold::Piece& piece = *four.piece[std::countr_zero(found)];
      if (piece.kind() == manifold::MeetingKind::polygon) continue;
      sum.add(norm(piece.weight() * (piece.end[1] - piece.end[0])), one_by_unit);
    }
  }
}

/// Triangles of one body that pieces of a curve have, most of them once.
class CurveTriangles {
 public:
  static constexpr std::uint32_t kMost = 64;

  CurveTriangles(const manifold::PieceMemory& memory, std::uint32_t begin, std::uint32_t end, int side)
      : memory_(memory), next_(begin), end_(end), side_(side) {
    for (std::uint32_t& s : seen_) s = kNoIndex;
  }

  /// Gathers up to kMost further ones, a multiple of four: the last one may be there several times. 0: no
  /// more.
  std::uint32_t gather(std::uint32_t (&index)[kMost]) {
    std::uint32_t count = 0;
    for (; next_ < end_ && count < kMost; ++next_) {
      const std::uint32_t t = memory_.pieces[memory_.order[next_]].triangle[side_];
      index[count] = t;
      count += seen_[t % kSeen] != t ? 1 : 0;
      seen_[t % kSeen] = t;
    }
    for (; count % 4 != 0; ++count) index[count] = index[count - 1];
    return count;
  }

 private:
  static constexpr std::uint32_t kSeen = 64;

  const manifold::PieceMemory& memory_;
  std::uint32_t next_, end_;
  int side_;
  std::uint32_t seen_[kSeen];
};

TANDEM_INLINE DoubleLanes<4> larger(const DoubleLanes<4>& x, const DoubleLanes<4>& y) {
  return x > y ? x : y;
}
TANDEM_INLINE double largest(const DoubleLanes<4>& x) {
  return manifold::greater(manifold::greater(x[0], x[1]), manifold::greater(x[2], x[3]));
}

/// The greatest heights of a body's triangles along directions.
template <int kDirections>
void highest_along(const manifold::Body& body, CurveTriangles triangles, const manifold::Vector3& origin,
                   const manifold::Vector3* directions, double* highest) {
  DoubleLanes<4> most[kDirections];
  for (DoubleLanes<4>& m : most) m = DoubleLanes<4>{} - INFINITY;
  std::uint32_t index[CurveTriangles::kMost];
  while (const std::uint32_t count = triangles.gather(index)) {
    for (std::uint32_t i = 0; i < count; i += 4) {
      for (int k = 0; k < 3; ++k) {
        const Vector3Lanes<4> p = posed_corner(body, index + i, k) - origin;
        for (int d = 0; d < kDirections; ++d) most[d] = larger(most[d], dot(directions[d], p));
      }
    }
  }
  for (int d = 0; d < kDirections; ++d) highest[d] = largest(most[d]);
}

/// NormalFinder::spread_along(), of some of the directions. Heights against a direction are those along it,
/// negated to the last bit.
template <int kDirections>
void spread_along_some(const manifold::BodyPair& bodies, const manifold::PieceMemory& memory,
                       std::uint32_t begin, std::uint32_t end, const manifold::Vector3& origin,
                       const manifold::Vector3* directions, int count, manifold::Spread* spread) {
  for (int side = 0; side < 2; ++side) {
    manifold::Vector3 along[kDirections];
    double highest[kDirections];
    for (int d = 0; d < kDirections; ++d) {
      const manifold::Vector3& n = directions[d < count ? d : 0];
      along[d] = side == 0 ? n : -n;
    }
    highest_along<kDirections>(bodies[side], CurveTriangles(memory, begin, end, side), origin, along,
                               highest);
    for (int d = 0; d < kDirections && d < count; ++d)
      (side == 0 ? spread[d].highest_a : spread[d].lowest_b) = side == 0 ? highest[d] : -highest[d];
  }
}

void spread_along(const manifold::BodyPair& bodies, const manifold::PieceMemory& memory, std::uint32_t begin,
                  std::uint32_t end, const manifold::Vector3& origin, const manifold::Vector3* directions,
                  int count, manifold::Spread* spread) {
  for (int first = 0; first < count;) {
    const auto some = [&]<int kDirections>() {
      spread_along_some<kDirections>(bodies, memory, begin, end, origin, directions + first, count - first,
                                     spread + first);
      first += kDirections;
    };
    switch (count - first) {
      case 1:
      case 2:
        some.template operator()<2>();
        break;
      case 3:
        some.template operator()<3>();
        break;
      case 4:
        some.template operator()<4>();
        break;
      default:
        some.template operator()<6>();
    }
  }
}

/// RimFinder::gather(), where there are no polygons.
std::uint32_t gather_rim(const manifold::PieceMemory& memory, std::uint32_t begin, std::uint32_t end,
                         const manifold::PatchFrame& frame, double one_by_unit, int ends,
                         manifold::Candidate* candidates, manifold::RimMoments& moments) {
  using D = DoubleLanes<4>;
  ExactSumLanes twice_area, moment_x, moment_y;
  std::uint32_t times = 0, count = 0;
  for (std::uint32_t i = begin; i < end; i += 4, ++times) {
    const FourPieces four(memory, i, end);
    Vector3Lanes<4> first, second;
    four.ends(first, second);
    const Vector3Lanes<4> from = first - frame.origin, to = second - frame.origin;
    const D x[2] = {dot(frame.u, from), dot(frame.u, to)}, y[2] = {dot(frame.v, from), dot(frame.v, to)};
    const D twice = four.weights() * (x[0] * y[1] - y[0] * x[1]);
    twice_area.add(twice, one_by_unit * one_by_unit);
    const D area_in_units = twice * one_by_unit * one_by_unit / 3;
    moment_x.add(area_in_units * (x[0] + x[1]), one_by_unit);
    moment_y.add(area_in_units * (y[0] + y[1]), one_by_unit);
    for (int e = 0; e < ends; ++e) {
      const auto fx = __builtin_convertvector(x[e], Vector<4>::Floats),
                 fy = __builtin_convertvector(y[e], Vector<4>::Floats);
      for (std::uint32_t k = 0; k < four.lanes; ++k)
        candidates[count++] = {fx[k], fy[k], four.at[k] * 8 + static_cast<std::uint32_t>(e)};
    }
  }
  twice_area.add_to(moments.twice_area, times);
  moment_x.add_to(moments.x, times), moment_y.add_to(moments.y, times);
  return count;
}

/// Four candidates; beyond the end the last one again.
struct FourCandidates {
  Lanes4 x, y;

  TANDEM_INLINE FourCandidates(const manifold::Candidate* candidates, std::uint32_t i, std::uint32_t count) {
    if (count - i >= 4) {
      const float* const at = &candidates[i].x;
      const auto a = load(at).v, b = load(at + 4).v, c = load(at + 8).v;  // xy.x y.xy .xy.
      x.v = __builtin_shufflevector(__builtin_shufflevector(a, b, 0, 3, 6, 6), c, 0, 1, 2, 5);
      y.v = __builtin_shufflevector(__builtin_shufflevector(a, b, 1, 4, 7, 7), c, 0, 1, 2, 6);
      return;
    }
    for (std::uint32_t k = 0; k < 4; ++k) {
      const manifold::Candidate& c = candidates[i + k < count ? i + k : count - 1];
      x.v[k] = c.x, y.v[k] = c.y;
    }
  }
};

TANDEM_INLINE Lanes4 value_of(const manifold::RimValue& value, const FourCandidates& c) {
  const manifold::FloatPoint &p = value.p, &q = value.q;
  const Lanes4 x = c.x + -p.x, y = c.y + -p.y;
  return value.distance ? x * x + y * y : (q.y - p.y) * x - (q.x - p.x) * y;
}

/// RimFinder::furthest(). First the greatest values, then who has them.
void furthest(const manifold::PieceMemory& memory, const manifold::Candidate* candidates, std::uint32_t count,
              const manifold::RimValue* values, float unit, int wanted, manifold::Furthest* best) {
  constexpr std::uint32_t kKept = 64;  // values of so many groups need not be computed again
  Lanes4 most[2], kept[2][kKept];
  for (int w = 0; w < wanted; ++w) most[w].v = Lanes4::Floats{} + best[w].value;
  const std::uint32_t groups = (count + 3) / 4;
  for (std::uint32_t group = 0; group < groups; ++group) {
    const FourCandidates four(candidates, 4 * group, count);
    for (int w = 0; w < wanted; ++w) {
      const Lanes4 value = value_of(values[w], four);
      if (group < kKept) kept[w][group] = value;
      most[w] = larger(most[w], value);
    }
  }
  for (int w = 0; w < wanted; ++w) {
    float greatest = most[w].v[0];
    for (int k = 1; k < 4; ++k) greatest = manifold::greater(greatest, most[w].v[k]);
    if (!(greatest > best[w].value)) continue;
    best[w].value = greatest;
    const float limit = greatest - values[w].tied(greatest, unit);
    for (std::uint32_t group = 0; group < groups; ++group) {
      const Lanes4 value =
          group < kKept ? kept[w][group] : value_of(values[w], FourCandidates(candidates, 4 * group, count));
      unsigned found = LaneMask<4>{value.v >= limit}.mask();
      for (; found != 0; found &= found - 1) {
        const std::uint32_t i = 4 * group + static_cast<std::uint32_t>(std::countr_zero(found));
        if (i < count) best[w].take(memory, candidates[i].reference);
      }
    }
  }
}

/// The next candidate from `i` on that is near, or `count`.
std::uint32_t next_near(const manifold::Candidate* candidates, std::uint32_t i, std::uint32_t count,
                        const manifold::FloatPoint& at, float square) {
  for (; i < count; i += 4) {
    const FourCandidates four(candidates, i, count);
    const Lanes4 x = four.x + -at.x, y = four.y + -at.y;
    const unsigned found = LaneMask<4>{(x * x + y * y).v < square}.mask();
    if (found == 0) continue;
    const std::uint32_t next = i + static_cast<std::uint32_t>(std::countr_zero(found));
    return next < count ? next : count;
  }
  return count;
}

}  // namespace
}  // namespace tandem
#endif
