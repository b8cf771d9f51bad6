#pragma once
#include <vector>

#include "patch_region.h"

namespace tandem::simulation {

/// The direction in which the bodies of a patch push each other. Keeps its memory from patch to patch.
class PatchNormal {
 public:
  /// False where no direction is better than another: corners or edges that touch each other.
  bool choose(const PatchRegion& region);

  const Eigen::Vector3d& normal() const { return normal_; }  ///< unit, from a towards b
  bool is_touch() const { return touch_; }                   ///< the surfaces meet without area
  double area() const { return area_; }                      ///< seen along the normal
  double separation() const { return separation_; }          ///< what takes the patch's triangles apart

 private:
  void gather_supports(const PatchRegion& region);
  double separation_along(const Eigen::Vector3d& n) const;
  Eigen::Vector3d face_nearest(const PatchRegion& region, const Eigen::Vector3d& smooth);
  bool add_direction(const Eigen::Vector3d& n);
  bool choose_for_touch(const PatchRegion& region);

  Eigen::Vector3d normal_ = Eigen::Vector3d::Zero();
  bool touch_ = false;
  double area_ = 0, separation_ = 0;
  std::vector<Eigen::Vector3d> directions_, supports_[2];
};

}  // namespace tandem::simulation
