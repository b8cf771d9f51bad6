#pragma once
#include <vector>

#include "contact_generation.h"
#include "convex_hull.h"
#include "patch_depth.h"
#include "patch_normal.h"

namespace tandem::simulation {

/// Makes contact points of the curves of a pair of bodies, a patch for each region that curves bound. Keeps
/// its memory from pair to pair.
class ContactPatches {
 public:
  /// Adds the points of all patches, by ascending first piece, and what became of them.
  void add(ContactCurves& curves, const BodySide& a, const BodySide& b, const ObjectPair& bodies,
           const ContactOptions& options, std::vector<ContactPoint>& points, ContactStatistics& statistics);

 private:
  struct Candidate {
    Eigen::Vector3d x;
    std::uint64_t feature;
  };
  struct Chosen {
    Eigen::Vector2d x;
    double height, depth;  // half-way between the surfaces
    std::uint64_t feature;
    bool inner;
  };

  void add_patch(const ObjectPair& bodies, const ContactOptions& options, std::vector<ContactPoint>& points,
                 ContactStatistics& statistics);
  void keep_curves(std::uint32_t group);
  void gather_candidates();
  void gather_rim(std::size_t most);
  void gather_inner();
  void choose_points(std::size_t most);
  void merge_near(double distance);
  void name_points(double distance);

  PatchRegion region_;
  PatchNormal normal_;
  PatchFrame frame_;
  PatchDepth depth_;
  double nearest_ = 0;  // how far beside a line triangles are looked at where it hits none
  std::vector<Candidate> candidates_;
  std::vector<PlanePoint> flat_, hull_;
  std::vector<Chosen> chosen_;
};

}  // namespace tandem::simulation
