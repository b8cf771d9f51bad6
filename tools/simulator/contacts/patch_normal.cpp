#include "patch_normal.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace tandem::simulation {
namespace {

using Eigen::Vector3d;

// An area vector below this part of length times largest coordinate is rounding: the surfaces only touch.
constexpr double kNoArea = 0x1p-40;

// Faces in so few directions on either side make a patch one of flat faces; otherwise it is a smooth one.
constexpr std::size_t kMostDirections = 5;

// The cosine of half a milliradian: directions closer than that are the same.
constexpr double kSameDirection = 1 - 1e-7;

// All corners of triangles of a lie behind the plane through x across n, all of b's before it.
bool separates(const PatchRegion& region, const Vector3d& n, const Vector3d& x) {
  const double tolerance = kNoArea * region.reach();
  bool apart = true;
  const auto accept = [&](std::uint32_t curve) { return apart && region.in_patch(curve); };
  region.for_each_cut_triangle(accept, [&](int side, const WorldTriangle& t) {
    for (const Vector3d& corner : t.corner) {
      const double height = n.dot(corner - x);
      apart = apart && (side == 0 ? height <= tolerance : height >= -tolerance);
    }
  });
  return apart;
}

}  // namespace

// The corners of a's triangles in the patch, and of b's, with all that is enclosed.
void PatchNormal::gather_supports(const PatchRegion& region) {
  for (int side = 0; side < 2; ++side) {
    supports_[side].clear();
    for (const BodySide::Enclosed& v : region.side[side]->enclosed()) {
      if (region.in_group(v.curve)) supports_[side].push_back(v.position);
    }
  }
  const auto accept = [&](std::uint32_t curve) { return region.in_patch(curve); };
  region.for_each_cut_triangle(accept, [&](int side, const WorldTriangle& t) {
    supports_[side].insert(supports_[side].end(), t.corner, t.corner + 3);
  });
}

// How far b must move along n until a plane across n lies between all of the triangles there. The overlap
// alone would not do: the tip of a pyramid in the ground is narrower than it is deep, yet the ground goes on.
double PatchNormal::separation_along(const Vector3d& n) const {
  const Vector3d& origin = supports_[0][0];
  double highest_a = -INFINITY, lowest_b = INFINITY;
  for (const Vector3d& x : supports_[0]) highest_a = std::max(highest_a, n.dot(x - origin));
  for (const Vector3d& x : supports_[1]) lowest_b = std::min(lowest_b, n.dot(x - origin));
  return highest_a - lowest_b;
}

// False where it is known.
bool PatchNormal::add_direction(const Vector3d& n) {
  const auto same = [&](const Vector3d& d) { return d.dot(n) > kSameDirection; };
  if (std::any_of(directions_.begin(), directions_.end(), same)) return false;
  directions_.push_back(n);
  return true;
}

// Where few flat faces meet, as boxes do, the curve's own normal leans a little, by depth over length: along
// the face normal that separates the bodies soonest they stay upright.
Vector3d PatchNormal::face_nearest(const PatchRegion& region, const Vector3d& smooth) {
  directions_.clear();
  std::size_t own[2] = {0, 0};
  const auto flat = [&] { return std::max(own[0], own[1]) <= kMostDirections; };
  const auto accept = [&](std::uint32_t curve) { return flat() && region.in_patch(curve); };
  region.for_each_cut_triangle(accept, [&](int side, const WorldTriangle& t) {
    if (flat()) own[side] += add_direction(side == 0 ? t.normal : Vector3d(-t.normal));
  });
  if (!flat()) return smooth;
  Vector3d best = smooth;
  double least = separation_along(smooth) * (1 + 1e-9);
  for (const Vector3d& n : directions_) {
    const double cosine = n.dot(smooth);
    if (cosine < 0.1 && (cosine < -0.1 || n.dot(region.apart()) <= 0)) continue;
    const double of_n = separation_along(n);
    if (of_n < least) best = n, least = of_n * (1 - 1e-9);
  }
  return best;
}

// The one direction, of faces there and else of crossings of edges, that has all of a's triangles there on
// one side and b's on the other. Where several do, corners or edges lie on each other: nothing to lean on.
bool PatchNormal::choose_for_touch(const PatchRegion& region) {
  directions_.clear();
  const auto consider = [&](const Vector3d& n, const Vector3d& x) {
    if (separates(region, n, x)) add_direction(n);
  };
  const auto pieces = region.curves->pieces();
  for (const CurvePiece& piece : pieces) {
    if (!region.in_patch(piece.curve) || directions_.size() > 1) continue;
    consider(region.side[0]->at(piece.slot[0]).normal, piece.end[0]);
    consider(-region.side[1]->at(piece.slot[1]).normal, piece.end[0]);
  }
  for (const CurvePiece& piece : pieces) {
    if (!region.in_patch(piece.curve) || !directions_.empty()) continue;
    const Vector3d *a = region.side[0]->at(piece.slot[0]).corner,
                   *b = region.side[1]->at(piece.slot[1]).corner;
    for (int i = 0; i < 9; ++i) {
      const Vector3d e = a[(i / 3 + 1) % 3] - a[i / 3], f = b[(i % 3 + 1) % 3] - b[i % 3], n = e.cross(f);
      if (n.norm() <= 1e-6 * e.norm() * f.norm()) continue;
      consider(n.normalized(), piece.end[0]);
      consider(-n.normalized(), piece.end[0]);
    }
  }
  if (directions_.size() != 1) return false;
  normal_ = directions_[0];
  return true;
}

bool PatchNormal::choose(const PatchRegion& region) {
  const auto curves = region.curves->curves();
  Vector3d area = Vector3d::Zero(), sheet = Vector3d::Zero();
  double length = 0;
  bool closes = true;
  for (std::uint32_t i = 0; i < curves.size(); ++i) {
    if (!region.in_patch(i)) continue;
    area += curves[i].area;
    sheet += curves[i].sheet_normal;
    length += curves[i].length;
    closes = closes && curves[i].closed;
  }
  touch_ = !(closes ? area.norm() > kNoArea * region.reach() * length : sheet.norm() > kNoArea * length);
  area_ = separation_ = 0;
  if (touch_) return choose_for_touch(region);
  gather_supports(region);
  normal_ = face_nearest(region, (closes ? area : sheet).normalized());
  area_ = std::fabs(area.dot(normal_));
  separation_ = separation_along(normal_);
  return true;
}

}  // namespace tandem::simulation
