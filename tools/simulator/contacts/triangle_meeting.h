#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace tandem::simulation {

/// A posed triangle.
struct WorldTriangle {
  Eigen::Vector3d corner[3];
  Eigen::Vector3d normal;  ///< unit, outward; 0 of a flat triangle
};

/// What part of a triangle a point lies on: edge k joins corners k and k + 1.
struct TriangleFeature {
  bool of_b;            ///< of triangle b, in the inside of a; else the other way round
  bool is_corner;       ///< corner k, else edge k
  std::uint8_t number;  ///< k
};

/// An edge that goes through the other triangle from one side to the other.
struct Piercing {
  bool of_b;
  std::uint8_t edge;
  double at;          ///< between the edge's first corner, 0, and its second, 1
  bool first_inside;  ///< the first corner lies behind the other triangle, else the second does
};

/// What two triangles have in common.
struct Meeting {
  enum class Kind : std::uint8_t { none, point, segment, polygon };

  Kind kind = Kind::none;
  bool degenerate = false;  ///< a corner lies in the other's plane
  Eigen::Vector3d end[2];   ///< of a segment, run along as normal_a x normal_b points; of a point, twice
  TriangleFeature feature[2] = {};

  /// Half where the segment is an edge of a, half again where one of b: then neighbours that share the edge,
  /// or a body that only touches there, have the rest.
  double weight = 1;

  std::uint8_t piercings = 0;
  Piercing piercing[4] = {};

  // Of a polygon: triangles in one plane.
  std::uint8_t corners = 0;
  std::array<Eigen::Vector3d, 6> corner;
  double area = 0;
  bool facing = false;  ///< normals are opposed: the surfaces touch. Else one lies on the other
};

/// Fills `meeting`. tolerance: lengths by which points may lie beside a plane and count as in it.
void meet(const WorldTriangle& a, const WorldTriangle& b, double tolerance, Meeting& meeting);

}  // namespace tandem::simulation
