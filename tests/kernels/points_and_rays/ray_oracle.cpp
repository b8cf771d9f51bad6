#include "kernels/points_and_rays/ray_oracle.h"

#include <CGAL/Interval_nt.h>

#include <array>
#include <utility>

#include "kernels/rational.h"

namespace tandem {
namespace {

bool is_zero(const RationalPoint& p) {
  return p[0] == 0 && p[1] == 0 && p[2] == 0;
}

bool is_on_segment(const RationalPoint& x, const RationalPoint& p, const RationalPoint& q) {
  const RationalPoint along = q - p, from = x - p;
  const Rational share = dot(from, along);
  return is_zero(cross(along, from)) && share >= 0 && share <= dot(along, along) &&
         (!is_zero(along) || is_zero(from));
}

}  // namespace

// A ray passes by where two of det(d, p_i, e_i) have opposite signs.
bool surely_passes_by(const double* origin, const double* direction, const double (*corner)[3]) {
  using Interval = CGAL::Interval_nt<false>;
  const Interval::Protector rounding;
  Interval p[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) p[i][k] = Interval(corner[i][k]) - Interval(origin[k]);
  }
  bool above = false, below = false;
  for (int i = 0; i < 3; ++i) {
    const Interval* const q = p[(i + 1) % 3];
    Interval volume = 0;
    // p x e is p x q, as e = q - p.
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      volume += Interval(direction[k]) * (p[i][l] * q[m] - p[i][m] * q[l]);
    }
    above = above || volume.inf() > 0;
    below = below || volume.sup() < 0;
  }
  return above && below;
}

struct RayOracle::Found {
  RationalPoint corner[3];
  bool meets = false, plain = true;
  Rational t;
  RationalPoint at;

  bool is_in_hull(const RationalPoint& x) const {
    const RationalPoint normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
    if (is_zero(normal)) {
      return is_on_segment(x, corner[0], corner[1]) || is_on_segment(x, corner[1], corner[2]) ||
             is_on_segment(x, corner[2], corner[0]);
    }
    bool within = dot(normal, x - corner[0]) == 0;
    for (int i = 0; i < 3 && within; ++i)
      within = dot(cross(corner[(i + 1) % 3] - corner[i], x - corner[i]), normal) >= 0;
    return within;
  }

  void offer(const RationalPoint& o, const RationalPoint& d, const Rational& t_there) {
    if (t_there < 0 || (meets && t <= t_there)) return;
    const RationalPoint x = o + t_there * d;
    if (!is_in_hull(x)) return;
    meets = true;
    t = t_there;
    at = x;
  }
};

RayOracle::RayOracle(const double* origin, const double* direction, const double (*corner)[3])
    : found_(std::make_unique<Found>()) {
  const RationalPoint o = rational(origin), d = rational(direction);
  for (int i = 0; i < 3; ++i) found_->corner[i] = rational(corner[i]);
  const auto& c = found_->corner;
  found_->offer(o, d, 0);
  const RationalPoint normal = cross(c[1] - c[0], c[2] - c[0]);
  const Rational slope = dot(d, normal);
  if (slope != 0) found_->offer(o, d, dot(c[0] - o, normal) / slope);
  found_->plain = slope != 0;
  for (int i = 0; i < 3; ++i) {
    const RationalPoint p = c[i] - o, e = c[(i + 1) % 3] - c[i], across = cross(d, e);
    found_->offer(o, d, dot(p, d) / dot(d, d));
    if (!is_zero(across)) found_->offer(o, d, dot(cross(p, e), across) / dot(across, across));
    if (dot(p, across) == 0) found_->plain = false;
  }
}
RayOracle::RayOracle(RayOracle&&) noexcept = default;
RayOracle& RayOracle::operator=(RayOracle&&) noexcept = default;
RayOracle::~RayOracle() = default;

bool RayOracle::meets() const {
  return found_->meets;
}
bool RayOracle::is_plain() const {
  return found_->plain;
}
bool RayOracle::is_near(double t, double part) const {
  const Rational off = Rational(t) - found_->t, most = found_->t * Rational(part);
  return off <= most && -off <= most;
}
bool RayOracle::is_at_most(double t) const {
  return found_->t <= Rational(t);
}
bool RayOracle::has_weights(const double* weight, double off) const {
  const auto& c = found_->corner;
  const RationalPoint normal = cross(c[1] - c[0], c[2] - c[0]);
  const Rational square = dot(normal, normal);
  const Rational b = dot(cross(found_->at - c[0], c[2] - c[0]), normal) / square;
  const Rational a = dot(cross(c[1] - c[0], found_->at - c[0]), normal) / square;
  const auto near = [&](const Rational& x, double y) {
    const Rational apart = x - Rational(y);
    return apart <= Rational(off) && -apart <= Rational(off);
  };
  return near(b, weight[0]) && near(a, weight[1]);
}
int RayOracle::compare(const RayOracle& x, const RayOracle& y) {
  return x.found_->t < y.found_->t ? -1 : x.found_->t > y.found_->t ? 1 : 0;
}

}  // namespace tandem
