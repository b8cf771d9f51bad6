#include "cow_shape.h"

#include <algorithm>
#include <cmath>

#include "vector3.h"

namespace tandem::makeassets {
namespace {

// First-order distance, exact in sign.
double distance(const CowShape::Ellipsoid& e, const Point& p) {
  const Point q = p - e.centre;
  const Point scaled = {q[0] / e.radii[0], q[1] / e.radii[1], q[2] / e.radii[2]};
  const Point gradient = {scaled[0] / e.radii[0], scaled[1] / e.radii[1], scaled[2] / e.radii[2]};
  const double steepness = length(gradient);
  if (steepness == 0) return -std::min({e.radii[0], e.radii[1], e.radii[2]});
  return length(scaled) * (length(scaled) - 1) / steepness;
}

// The distance to a cone of spheres along an axis. A point belongs to the sphere whose centre it meets when
// it is moved to the axis along the normal of the cone, which leans by (r0 - r1) / |axis| from the
// perpendicular.
double distance(const CowShape::RoundCone& c, const Point& p) {
  const double stretch = 1 / c.squeeze - 1;
  const auto unsqueeze = [&](const Point& v) { return v + (stretch * dot(v, c.across)) * c.across; };
  const Point axis = unsqueeze(c.to - c.from);
  const Point q = unsqueeze(p - c.from);
  const double axis_length = length(axis);
  const double along = dot(q, axis) / axis_length;
  const double off = std::sqrt(std::max(0.0, dot(q, q) - along * along));
  const double lean = (c.from_radius - c.to_radius) / axis_length;
  const double foot = along - off * lean / std::sqrt(1 - lean * lean);
  const double at = std::clamp(foot / axis_length, 0.0, 1.0);
  return length(q - at * axis) - (c.from_radius + at * (c.to_radius - c.from_radius));
}

// Quadratic smooth minimum (Quilez): a fillet where the two distances differ by less than `blend`.
double smooth_min(double a, double b, double blend) {
  const double overlap = std::max(blend - std::abs(a - b), 0.0) / blend;
  return std::min(a, b) - overlap * overlap * blend / 4;
}

}  // namespace

CowShape::CowShape() {
  add_trunk();
  add_neck_and_head();
  for (const double side : {-1.0, 1.0}) add_ear_and_horn(side);
  // A slow walk: all four legs can be told apart from the side and from the front.
  add_fore_leg(1, -0.06);
  add_fore_leg(-1, 0.07);
  add_hind_leg(1, -0.08);
  add_hind_leg(-1, 0.08);
  add_udder();
  add_tail();
}

double CowShape::operator()(const Point& p) const {
  double d = 1e9;
  for (const auto& [shape, blend] : ellipsoids_) d = smooth_min(d, distance(shape, p), blend);
  for (const auto& [shape, blend] : cones_) d = smooth_min(d, distance(shape, p), blend);
  for (const RoundCone& nostril : nostrils_) d = std::max(d, -distance(nostril, p));
  return std::max(d, -p[2]);  // the hooves are cut flat by the ground
}

Bounds CowShape::bounds() const {
  return {{-0.66, -0.32, -0.02}, {0.96, 0.32, 1.06}};
}

void CowShape::add_trunk() {
  add(Ellipsoid{{-0.05, 0, 0.560}, {0.42, 0.190, 0.245}}, 0.08);            // barrel
  add(Ellipsoid{{-0.06, 0, 0.460}, {0.29, 0.180, 0.170}}, 0.08);            // belly
  add(Ellipsoid{{0.26, 0, 0.585}, {0.16, 0.155, 0.225}}, 0.08);             // shoulders
  add(Ellipsoid{{-0.34, 0, 0.630}, {0.155, 0.155, 0.165}}, 0.08);           // rump
  add(Ellipsoid{{0.36, 0, 0.450}, {0.085, 0.070, 0.105}}, 0.08);            // brisket
  add(RoundCone{{-0.42, 0, 0.755}, 0.045, {0.26, 0, 0.770}, 0.045}, 0.07);  // back
  for (const double side : {-1.0, 1.0}) {
    add(RoundCone{{-0.245, side * 0.105, 0.745}, 0.042, {-0.42, side * 0.07, 0.730}, 0.040},
        0.09);  // hip to pin bone
  }
}

void CowShape::add_neck_and_head() {
  add(RoundCone{{0.27, 0, 0.63}, 0.165, {0.56, 0, 0.765}, 0.090, {0, 1, 0}, 0.72}, 0.07);
  add(RoundCone{{0.38, 0, 0.46}, 0.030, {0.56, 0, 0.650}, 0.020}, 0.06);                      // dewlap
  add(RoundCone{{0.600, 0, 0.785}, 0.088, {0.770, 0, 0.610}, 0.060, {0, 1, 0}, 0.95}, 0.05);  // skull
  add(RoundCone{{0.600, 0, 0.720}, 0.060, {0.755, 0, 0.585}, 0.045}, 0.03);                   // jaw
  add(RoundCone{{0.795, -0.032, 0.585}, 0.056, {0.795, 0.032, 0.585}, 0.056}, 0.03);          // muzzle
  for (const double side : {-1.0, 1.0}) {
    add(RoundCone{{0.620, side * 0.040, 0.700}, 0.050, {0.700, side * 0.030, 0.635}, 0.040}, 0.04);   // cheek
    add(RoundCone{{0.625, side * 0.062, 0.825}, 0.020, {0.675, side * 0.062, 0.795}, 0.018}, 0.02);   // brow
    add(RoundCone{{0.655, side * 0.076, 0.775}, 0.019, {0.662, side * 0.076, 0.769}, 0.019}, 0.006);  // eye
    nostrils_.push_back({{0.850, side * 0.036, 0.607}, 0.018, {0.838, side * 0.050, 0.615}, 0.012});
  }
}

void CowShape::add_ear_and_horn(double side) {
  const Point leaf_normal = {0.8, 0, 0.6};
  add(RoundCone{{0.565, side * 0.075, 0.815}, 0.022, {0.550, side * 0.155, 0.800}, 0.050, leaf_normal, 0.4},
      0.015);
  add(RoundCone{{0.550, side * 0.155, 0.800}, 0.050, {0.545, side * 0.240, 0.765}, 0.012, leaf_normal, 0.4},
      0.005);
  add(RoundCone{{0.575, side * 0.040, 0.860}, 0.030, {0.580, side * 0.115, 0.885}, 0.025}, 0.015);
  add(RoundCone{{0.580, side * 0.115, 0.885}, 0.025, {0.605, side * 0.170, 0.920}, 0.018}, 0.010);
  add(RoundCone{{0.605, side * 0.170, 0.920}, 0.018, {0.635, side * 0.175, 0.980}, 0.007}, 0.005);
}

void CowShape::add_fore_leg(double side, double stride) {
  const double y = side * 0.105;
  const Point elbow = {0.255, y, 0.400}, knee = {0.265 + 0.6 * stride, y, 0.225};
  const Point fetlock = {0.255 + stride, y, 0.085}, hoof = {0.275 + stride, y, 0.015};
  add(RoundCone{{0.265, y, 0.560}, 0.095, elbow, 0.064}, 0.05);
  add(RoundCone{elbow, 0.062, knee, 0.038}, 0.03);
  add(RoundCone{knee, 0.036, fetlock, 0.027}, 0.02);
  add(RoundCone{fetlock, 0.029, hoof, 0.043}, 0.01);
}

void CowShape::add_hind_leg(double side, double stride) {
  const double y = side * 0.11;
  const Point stifle = {-0.325, y, 0.430}, hock = {-0.405 + 0.6 * stride, y, 0.270};
  const Point fetlock = {-0.375 + stride, y, 0.085}, hoof = {-0.355 + stride, y, 0.015};
  add(RoundCone{{-0.355, 0.85 * y, 0.610}, 0.125, stifle, 0.085}, 0.05);
  add(RoundCone{stifle, 0.085, hock, 0.043}, 0.03);
  add(RoundCone{hock, 0.041, fetlock, 0.027}, 0.02);
  add(RoundCone{fetlock, 0.029, hoof, 0.043}, 0.01);
}

void CowShape::add_udder() {
  add(RoundCone{{-0.255, 0, 0.35}, 0.095, {-0.185, 0, 0.34}, 0.080}, 0.03);
  for (const double x : {-0.265, -0.195})
    for (const double y : {-0.045, 0.045})
      add(RoundCone{{x, y, 0.275}, 0.022, {x, 1.1 * y, 0.220}, 0.014}, 0.01);
}

void CowShape::add_tail() {
  const Point root = {-0.475, 0, 0.765}, bend = {-0.530, 0, 0.700}, end = {-0.540, 0.01, 0.400};
  add(RoundCone{{-0.40, 0, 0.765}, 0.040, root, 0.028}, 0.03);
  add(RoundCone{root, 0.028, bend, 0.020}, 0.01);
  add(RoundCone{bend, 0.020, end, 0.014}, 0.01);
  add(RoundCone{end, 0.016, {-0.540, 0.01, 0.330}, 0.034}, 0.01);  // tuft
  add(RoundCone{{-0.540, 0.01, 0.330}, 0.034, {-0.535, 0.01, 0.250}, 0.012}, 0.01);
}

}  // namespace tandem::makeassets
