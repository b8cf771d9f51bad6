#pragma once
#include <span>
#include <vector>

#include "contact_curves.h"
#include "convex_hull.h"
#include "simulation/contacts/contact_generation.h"

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
  // A vertex of the patch seen along the normal.
  struct FlatVertex {
    Eigen::Vector2d x;
    double height;
  };
  struct Frame {
    Eigen::Vector3d origin, u, v, n;

    Eigen::Vector2d flat(const Eigen::Vector3d& x) const {
      const Eigen::Vector3d d = x - origin;
      return {u.dot(d), v.dot(d)};
    }
    double height(const Eigen::Vector3d& x) const { return n.dot(x - origin); }
    Eigen::Vector3d at(const Eigen::Vector2d& x, double h) const {
      return origin + x.x() * u + x.y() * v + h * n;
    }
  };
  // A line along the normal, and where it meets the surfaces.
  struct Sounding {
    Eigen::Vector2d at, sounded_at;  // the point, and the line beside it that stands for it
    double height;                   // of the point, where the line misses
    std::uint64_t feature;
    bool inner;                        // not of the rim
    double top, bottom;                // of a's surface, of b's
    double beside_top, beside_bottom;  // how far beside the line that is: 0 of a hit
  };
  struct Chosen {
    Eigen::Vector2d x;
    double height, depth;  // half-way between the surfaces
    std::uint64_t feature;
    bool inner;
  };

  void keep_curves(std::uint32_t group);
  bool in_patch(std::uint32_t curve) const { return kept_[curve] != 0; }
  bool in_group(std::uint32_t curve) const { return group_[curve] == current_; }
  void gather_candidates();
  bool choose_normal();
  bool normal_of_touch();
  Eigen::Vector3d face_nearest(const Eigen::Vector3d& smooth);
  void gather_supports();
  double width(const Eigen::Vector3d& n) const;
  void make_frame(const Eigen::Vector3d& n);
  void gather_rim(std::size_t most);
  void gather_inner();
  void sound();
  void sound_cut_triangles();
  void sound_cut_triangle(const WorldTriangle& triangle, double cosine, bool of_b);
  void sound_enclosed(const BodySide& side);
  void add_sounding(const Eigen::Vector2d& at, const Eigen::Vector2d& sounded_at, double height,
                    std::uint64_t feature, bool inner);
  void choose_points();
  void merge_near(double distance);
  void name_points(double distance);

  // Of the pair.
  ContactCurves* curves_ = nullptr;
  const BodySide *a_ = nullptr, *b_ = nullptr;
  ContactOptions options_;
  std::vector<std::uint32_t> group_;
  std::vector<std::uint8_t> kept_;
  // Of the patch.
  std::uint32_t current_ = 0;
  bool touch_ = false;
  Eigen::Vector3d area_ = Eigen::Vector3d::Zero(), normal_ = Eigen::Vector3d::Zero();
  std::vector<Candidate> candidates_;
  std::vector<Eigen::Vector3d> directions_, supports_[2];
  Frame frame_;
  double width_ = 0;    // what separates the patch along its normal
  double nearest_ = 0;  // how far beside a line triangles are looked at where it hits none
  std::vector<PlanePoint> flat_, hull_;
  std::vector<FlatVertex> flat_vertices_;
  std::vector<Sounding> soundings_;
  std::vector<Chosen> chosen_;
};

}  // namespace tandem::simulation
