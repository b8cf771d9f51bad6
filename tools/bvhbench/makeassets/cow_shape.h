#pragma once

#include <vector>

#include "polygonise.h"

namespace tandem::makeassets {

// A solid cow as a smooth union of simple parts, given by a function that is negative inside. The body is
// about 1 m long, faces +x and stands on the plane z = 0. Only + - * / and sqrt are used: no result depends
// on a maths library.
class CowShape {
 public:
  CowShape();

  [[nodiscard]] double operator()(const Point& p) const;
  [[nodiscard]] Bounds bounds() const;

  // The hull of two spheres; `squeeze` < 1 flattens it along the unit vector `across`.
  struct RoundCone {
    Point from;
    double from_radius;
    Point to;
    double to_radius;
    Point across{0, 1, 0};
    double squeeze = 1;
  };
  struct Ellipsoid {
    Point centre, radii;
  };

 private:
  // `blend` is the width, in metres, of the fillet between a part and all the parts before it.
  struct BlendedCone {
    RoundCone shape;
    double blend;
  };
  struct BlendedEllipsoid {
    Ellipsoid shape;
    double blend;
  };

  void add_trunk();
  void add_neck_and_head();
  void add_ear_and_horn(double side);
  void add_fore_leg(double side, double stride);
  void add_hind_leg(double side, double stride);
  void add_udder();
  void add_tail();

  void add(const Ellipsoid& shape, double blend) { ellipsoids_.push_back({shape, blend}); }
  void add(const RoundCone& shape, double blend) { cones_.push_back({shape, blend}); }

  std::vector<BlendedEllipsoid> ellipsoids_;
  std::vector<BlendedCone> cones_;
  std::vector<RoundCone> nostrils_;  // taken out of the union
};

}  // namespace tandem::makeassets
