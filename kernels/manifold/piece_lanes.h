#pragma once
#include "kernels/manifold/double_lanes.h"

#ifdef TANDEM_HAVE_LANES
#include "kernels/manifold/manifold_lanes.h"

// The pieces of contact_curves.h, four contacts at a time.
namespace tandem {
namespace {

/// Body::triangle(), four of them.
struct WorldTriangleLanes {
  Vector3Lanes<4> corner[3], normal;

  TANDEM_INLINE WorldTriangleLanes(const manifold::Body& body, const std::uint32_t (&index)[4]) {
    for (int k = 0; k < 3; ++k) corner[k] = posed_corner(body, index, k);
    const Vector3Lanes<4> n = cross(corner[1] - corner[0], corner[2] - corner[0]);
    const DoubleLanes<4> length = square_root(dot(n, n));
    const DoubleLanes<4> turn = __builtin_convertvector(1 - 2 * turned_lanes(body, index), DoubleLanes<4>);
    const DoubleLanes<4> scale = length > 1e-290 ? turn / length : DoubleLanes<4>{};
    normal = {scale * n.x, scale * n.y, scale * n.z};
  }
  manifold::WorldTriangle lane(int i) const {
    manifold::WorldTriangle out;
    for (int k = 0; k < 3; ++k) out.corner[k] = lane_of(corner[k], i);
    out.normal = lane_of(normal, i);
    return out;
  }
  TANDEM_INLINE static manifold::Vector3 lane_of(const Vector3Lanes<4>& v, int i) {
    return {v.x[i], v.y[i], v.z[i]};
  }
};

TANDEM_INLINE DoubleLanes<4> either(const DoubleMask<4>& mask, const DoubleLanes<4>& x,
                                    const DoubleLanes<4>& y) {
  return mask ? x : y;
}
TANDEM_INLINE Vector3Lanes<4> either(const DoubleMask<4>& mask, const Vector3Lanes<4>& x,
                                     const Vector3Lanes<4>& y) {
  return {mask ? x.x : y.x, mask ? x.y : y.y, mask ? x.z : y.z};
}

/// meeting::Heights, of triangles that have no corner in the other's plane.
struct HeightsLanes {
  DoubleLanes<4> height[3];
  DoubleMask<4> in_plane, beside;
  DoubleMask<4> alone[3];  ///< the corner that has the plane between it and both others

  TANDEM_INLINE HeightsLanes(const WorldTriangleLanes& triangle, const WorldTriangleLanes& plane,
                             double tolerance) {
    DoubleMask<4> above[3];
    in_plane = DoubleMask<4>{};
    for (int k = 0; k < 3; ++k) {
      height[k] = dot(plane.normal, triangle.corner[k] - plane.corner[0]);
      above[k] = height[k] > tolerance;
      in_plane |= ~(above[k] | (height[k] < -tolerance));
    }
    beside = (above[0] == above[1]) & (above[1] == above[2]);
    for (int k = 0; k < 3; ++k)
      alone[k] = (above[k] != above[(k + 1) % 3]) & (above[k] != above[(k + 2) % 3]);
  }
};

/// meeting::Stretch of a triangle that the other's plane cuts through two edges.
struct StretchLanes {
  DoubleLanes<4> at[2];  // ascending
  Vector3Lanes<4> point[2];
  DoubleMask<4> edge[2];

  TANDEM_INLINE StretchLanes(const WorldTriangleLanes& t, const HeightsLanes& heights,
                             const Vector3Lanes<4>& line, const Vector3Lanes<4>& origin) {
    const auto& h = heights.height;
    // These are the two of edges 0, 1 and 2 that end at the lone corner.
    const DoubleMask<4> last = heights.alone[2], middle = heights.alone[1];
    const auto cut = [](const Vector3Lanes<4>& x, const Vector3Lanes<4>& y, const DoubleLanes<4>& of_x,
                        const DoubleLanes<4>& of_y) {
      const DoubleLanes<4> part = of_x / (of_x - of_y);
      const Vector3Lanes<4> d = y - x;
      return Vector3Lanes<4>{x.x + part * d.x, x.y + part * d.y, x.z + part * d.z};
    };
    const Vector3Lanes<4> first = cut(either(last, t.corner[1], t.corner[0]),
                                      either(last, t.corner[2], t.corner[1]), either(last, h[1], h[0]),
                                      either(last, h[2], h[1])),
                          second = cut(either(middle, t.corner[1], t.corner[2]),
                                       either(middle, t.corner[2], t.corner[0]), either(middle, h[1], h[2]),
                                       either(middle, h[2], h[0]));
    const DoubleLanes<4> along_first = dot(line, first - origin), along_second = dot(line, second - origin);
    const DoubleMask<4> edge_first = last & 1,
                        edge_second = middle ? DoubleMask<4>{} + 1 : DoubleMask<4>{} + 2;
    const DoubleMask<4> swapped = along_second < along_first;
    at[0] = swapped ? along_second : along_first, at[1] = swapped ? along_first : along_second;
    point[0] = either(swapped, second, first), point[1] = either(swapped, first, second);
    edge[0] = swapped ? edge_second : edge_first, edge[1] = swapped ? edge_first : edge_second;
  }
};

/// CurveFinder::make_pieces().
class PieceMaker {
 public:
  PieceMaker(const manifold::BodyPair& bodies, const manifold::PieceMemory& memory)
      : bodies_(bodies), memory_(memory), tolerance_(bodies.tolerance()) {}

  manifold::PieceBounds make(const Contact* contacts, std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; i += 4) {
      const std::uint32_t lanes = count - i < 4 ? count - i : 4;
      for (std::uint32_t next = i + kAhead; next < i + kAhead + 4 && next < count; ++next) {
        fetch_triangle(bodies_.a, contacts[next].triangle_a);
        fetch_triangle(bodies_.b, contacts[next].triangle_b);
      }
      make_four(contacts + i, lanes);
    }
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < 4; ++i) {
        found_.lower[k] = manifold::lesser(found_.lower[k], lower_[k][i]);
        found_.upper[k] = manifold::greater(found_.upper[k], upper_[k][i]);
      }
    }
    return found_;
  }

 private:
  static constexpr std::uint32_t kAhead = 12;  // contacts whose triangles are on their way

  TANDEM_INLINE static void fetch_triangle(const manifold::Body& body, std::uint32_t triangle) {
    __builtin_prefetch(body.shape->triangles[triangle].corner);
    __builtin_prefetch(body.shape->triangles[triangle].corner + 2);
    __builtin_prefetch(body.shape->topology + triangle);
  }

  TANDEM_INLINE void make_four(const Contact* contacts, std::uint32_t lanes) {
    using D = DoubleLanes<4>;
    using Mask = DoubleMask<4>;
    std::uint32_t index_a[4], index_b[4];
    for (std::uint32_t i = 0; i < 4; ++i) {
      const Contact& contact = contacts[i < lanes ? i : 0];
      index_a[i] = contact.triangle_a, index_b[i] = contact.triangle_b;
    }
    const WorldTriangleLanes a(bodies_.a, index_a), b(bodies_.b, index_b);
    const HeightsLanes of_a(a, b, tolerance_), of_b(b, a, tolerance_);
    const unsigned all = (1u << lanes) - 1;
    // The heights of a flat triangle are all 0 as well.
    const unsigned special = bits_of_mask(of_a.in_plane | of_b.in_plane) & all;
    const Vector3Lanes<4> across = cross(a.normal, b.normal);
    const D sine = square_root(dot(across, across));
    Mask meets = ~(of_a.beside | of_b.beside) & (sine != 0);
    if ((bits_of_mask(meets) & all & ~special) != 0) {
      const D scale = 1 / sine;
      const Vector3Lanes<4> line = {scale * across.x, scale * across.y, scale * across.z};
      const StretchLanes in_a(a, of_a, line, a.corner[0]), in_b(b, of_b, line, a.corner[0]);
      const Mask begins_in_a = in_a.at[0] >= in_b.at[0], ends_in_a = in_a.at[1] <= in_b.at[1];
      const D begin = begins_in_a ? in_a.at[0] : in_b.at[0], end = ends_in_a ? in_a.at[1] : in_b.at[1];
      meets &= end >= begin - tolerance_;
      const Mask is_point = end <= begin + tolerance_;
      const Vector3Lanes<4> from = either(begins_in_a, in_a.point[0], in_b.point[0]),
                            to = either(ends_in_a, in_a.point[1], in_b.point[1]);
      // The features are as bits_of() has them: of_b, then the edge's number.
      const Mask feature_from = begins_in_a ? in_a.edge[0] << 2 : in_b.edge[0] << 2 | 1,
                 feature_to = ends_in_a ? in_a.edge[1] << 2 : in_b.edge[1] << 2 | 1;
      const Mask kind = is_point ? Mask{} + static_cast<std::int64_t>(manifold::MeetingKind::point)
                                 : Mask{} + static_cast<std::int64_t>(manifold::MeetingKind::segment);
      const Mask info = kind | feature_from << 8 | feature_to << 12;
      const unsigned whole = bits_of_mask(meets) & all & ~special;
      stretch_bounds(from, to, is_point, meets, whole, special, lanes);
      write(index_a, index_b, whole, info, from, to, a.normal, b.normal);
      found_.segments += static_cast<std::uint32_t>(std::popcount(whole & ~bits_of_mask(is_point)));
    }
    for (unsigned rest = special; rest != 0; rest &= rest - 1) {
      const int i = std::countr_zero(rest);
      ManifoldLanes::add_piece(memory_, contacts[i], a.lane(i), b.lane(i), tolerance_, found_);
    }
  }

  TANDEM_INLINE void stretch_bounds(const Vector3Lanes<4>& from, const Vector3Lanes<4>& to,
                                    const DoubleMask<4>& is_point, const DoubleMask<4>& meets, unsigned whole,
                                    unsigned special, std::uint32_t lanes) {
    DoubleMask<4> counts = meets;
    if (special != 0 || lanes < 4) {
      for (int i = 0; i < 4; ++i) counts[i] = (whole >> i & 1u) != 0 ? -1 : 0;
    }
    const DoubleMask<4> also = counts & ~is_point;
    const DoubleLanes<4> x[3] = {from.x, from.y, from.z}, y[3] = {to.x, to.y, to.z};
    for (int k = 0; k < 3; ++k) {
      lower_[k] = (counts & (x[k] < lower_[k])) ? x[k] : lower_[k];
      upper_[k] = (counts & (x[k] > upper_[k])) ? x[k] : upper_[k];
      lower_[k] = (also & (y[k] < lower_[k])) ? y[k] : lower_[k];
      upper_[k] = (also & (y[k] > upper_[k])) ? y[k] : upper_[k];
    }
  }

  TANDEM_INLINE void write(const std::uint32_t (&index_of_a)[4], const std::uint32_t (&index_of_b)[4],
                           unsigned whole, const DoubleMask<4>& info, const Vector3Lanes<4>& from,
                           const Vector3Lanes<4>& to, const Vector3Lanes<4>& normal_a,
                           const Vector3Lanes<4>& normal_b) {
    using Floats = Vector<4>::Floats;
    using Bits = Vector<4>::Bits;
    const auto floats = [](const DoubleLanes<4>& x) { return Lanes4{__builtin_convertvector(x, Floats)}; };
    const auto bits_as_floats = [](const Bits& x) { return Lanes4{reinterpret_cast<Floats>(x)}; };
    Bits index_a, index_b;
    __builtin_memcpy(&index_a, index_of_a, sizeof index_a);
    __builtin_memcpy(&index_b, index_of_b, sizeof index_b);
    Lanes4 head[4] = {bits_as_floats(index_a), bits_as_floats(index_b),
                      bits_as_floats(__builtin_convertvector(info, Bits)), Lanes4{}};
    DoubleLanes<4> ends[4] = {from.x, from.y, from.z, to.x}, rest[4] = {to.y, to.z, to.y, to.z};
    Lanes4 normals[4] = {floats(normal_a.x), floats(normal_a.y), floats(normal_a.z), floats(normal_b.x)},
           more[4] = {floats(normal_b.y), floats(normal_b.z), floats(normal_b.y), floats(normal_b.z)};
    transpose(head), transpose(ends), transpose(rest);
    transpose(normals), transpose(more);
#pragma GCC unroll 4
    for (unsigned i = 0; i < 4; ++i) {
      if ((whole >> i & 1u) == 0) continue;
      const std::uint32_t at = found_.pieces++;
      char* const piece = reinterpret_cast<char*>(memory_.pieces + at);
      __builtin_memcpy(piece, &head[i], 16);
      __builtin_memcpy(piece + 16, &ends[i], 32);
      __builtin_memcpy(piece + 48, &rest[i], 16);
      float* const normals_of_piece = memory_.normals + 6 * std::size_t{at};
      __builtin_memcpy(normals_of_piece, &normals[i], 16);
      __builtin_memcpy(normals_of_piece + 4, &more[i], 8);
    }
  }

  static_assert(offsetof(manifold::Piece, info) == 8 && offsetof(manifold::Piece, end) == 16);

  static constexpr DoubleLanes<4> kNothing = {INFINITY, INFINITY, INFINITY, INFINITY};

  const manifold::BodyPair& bodies_;
  manifold::PieceMemory memory_;
  double tolerance_;
  manifold::PieceBounds found_;
  DoubleLanes<4> lower_[3] = {kNothing, kNothing, kNothing}, upper_[3] = {-kNothing, -kNothing, -kNothing};
};

manifold::PieceBounds make_pieces(const manifold::BodyPair& bodies, const manifold::PieceMemory& memory,
                                  const Contact* contacts, std::uint32_t count) {
  return PieceMaker(bodies, memory).make(contacts, count);
}

}  // namespace
}  // namespace tandem
#endif
