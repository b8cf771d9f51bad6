#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "patch_region.h"

namespace tandem::simulation {

/// A patch seen along its normal n.
struct PatchFrame {
  Eigen::Vector3d origin, u, v, n;

  PatchFrame() = default;
  PatchFrame(const Eigen::Vector3d& at, const Eigen::Vector3d& normal)
      : origin(at), u(normal.unitOrthogonal()), v(normal.cross(u)), n(normal) {}

  Eigen::Vector2d flat(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d d = x - origin;
    return {u.dot(d), v.dot(d)};
  }
  double height(const Eigen::Vector3d& x) const { return n.dot(x - origin); }
  Eigen::Vector3d at(const Eigen::Vector2d& x, double h) const {
    return origin + x.x() * u + x.y() * v + h * n;
  }
};

/// A line along the normal, and where it meets the surfaces.
struct Sounding {
  Eigen::Vector2d at;    ///< the point that is asked about
  Eigen::Vector2d line;  ///< the line beside it that stands for it
  double height;         ///< of the point
  std::uint64_t feature;
  bool inner;         ///< not of the rim
  double surface[2];  ///< a's highest, b's lowest; the point's own height where the line misses
  double beside[2];   ///< how far beside the line that is: 0 of a hit
};

/// Measures how deep the bodies of a patch overlap, along lines. Keeps its memory from patch to patch.
class PatchDepth {
 public:
  std::vector<Sounding> soundings;

  void start(const PatchFrame& frame) {
    frame_ = frame;
    soundings.clear();
  }

  /// nearest: how far beside a line a triangle may lie that stands in where the line hits none.
  void add(const Eigen::Vector2d& at, const Eigen::Vector2d& line, double height, std::uint64_t feature,
           bool inner, double nearest) {
    soundings.push_back({at, line, height, feature, inner, {height, height}, {nearest, nearest}});
  }

  /// Fills in the surfaces of all soundings.
  void sound(const PatchRegion& region);

 private:
  struct FlatVertex {
    Eigen::Vector2d x;
    double height;
  };

  void sound_cut_triangle(int side, const WorldTriangle& triangle);
  void sound_enclosed(const PatchRegion& region, int side);

  PatchFrame frame_;
  std::vector<FlatVertex> flat_;
};

}  // namespace tandem::simulation
