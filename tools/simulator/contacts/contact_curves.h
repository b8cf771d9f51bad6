#pragma once
#include <span>
#include <vector>

#include "body_side.h"
#include "engines/engine.h"
#include "key_table.h"

namespace tandem::simulation {

/// What one pair of triangles has in common.
struct CurvePiece {
  std::uint32_t triangle[2];  ///< of a, of b
  std::uint32_t slot[2];      ///< of their posed triangles
  std::uint32_t curve;
  std::uint32_t polygon, corners;  ///< of coplanar triangles: where their corners lie in corners()
  Meeting::Kind kind;
  bool facing;
  double weight;
  Eigen::Vector3d end[2];
  TriangleFeature feature[2];
  Eigen::Vector3d area;  ///< of a polygon: along a's normal, half of it; the segments around it have the rest
};

/// Pieces that hang together: where both surfaces cross, or lie on each other.
struct Curve {
  Eigen::Vector3d area;          ///< area vector: half the sum of r x dr, and polygons; from a towards b
  Eigen::Vector3d residual;      ///< the sum of dr: 0 where the curve closes
  Eigen::Vector3d sheet_normal;  ///< of the pieces' triangles, from a towards b, times lengths; of open
                                 ///< surfaces where there are any
  double length;
  bool closed;
  bool degenerate;  ///< corners of one body lie in triangles of the other
};

/// The intersection of two bodies' surfaces. Keeps its memory from pair to pair.
class ContactCurves {
 public:
  /// Leaves posed triangles in the sides, and the vertices of each that lie inside the other. Curves that
  /// bound one and the same enclosed part of a body are joined: see group_of().
  void find(std::span<const TriangleContact> contacts, BodySide& a, BodySide& b);

  std::span<const CurvePiece> pieces() const { return pieces_; }
  std::span<const Curve> curves() const { return curves_; }
  std::span<const Eigen::Vector3d> corners(const CurvePiece& piece) const {
    return std::span(corners_).subspan(piece.polygon, piece.corners);
  }
  /// The curve that stands for all that bound the same region.
  std::uint32_t group_of(std::uint32_t curve) { return groups_.find(curve); }
  std::uint64_t segments() const { return segments_; }

 private:
  struct PiecePiercing {
    std::uint32_t piece, edge;
    bool of_b, lower_inside;
    double at;
  };

  void add(const TriangleContact& contact, double tolerance, BodySide& a, BodySide& b);
  bool connect_by_ends(const BodySide& a, const BodySide& b);
  void connect_by_corners(const BodySide& a, const BodySide& b);
  void number_curves();
  void measure(const BodySide& a, const BodySide& b);
  void find_enclosed(BodySide& a, BodySide& b);

  std::vector<CurvePiece> pieces_;
  std::vector<PiecePiercing> piercings_;
  std::vector<Eigen::Vector3d> corners_;
  std::vector<Curve> curves_;
  std::vector<std::uint32_t> loose_;  // pieces with an end that no other piece has
  std::vector<std::uint32_t> first_;  // of each curve, its first piece
  KeyTable table_;
  DisjointSets sets_, groups_;
  Meeting meeting_;
  std::uint64_t segments_ = 0;
  bool degenerate_ = false;
};

}  // namespace tandem::simulation
