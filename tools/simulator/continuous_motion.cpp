#include "continuous_motion.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "followed_contacts.h"

namespace tandem::simulation {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// A pair goes on beyond its impact by at most this part of the thinner body's inner radius.
constexpr double kBeyond = 0.25;

// Each round stops bodies earlier, until none that has stopped is in another one's way.
constexpr int kMostRounds = 8;

// Half the least side of the bounds; of a shape that is not closed, which has no inside to be passed through
// within, infinite.
double inner_radius_of(const AssetView& shape) {
  if (!shape.level().closed) return INFINITY;
  double least = INFINITY;
  for (int k = 0; k < 3; ++k) {
    const double side =
        static_cast<double>(shape.header->upper[k]) - static_cast<double>(shape.header->lower[k]);
    least = std::min(least, 0.5 * side);
  }
  return least;
}

// The shortest rotation from one orientation to another, as an axis times an angle.
Vector3d turn_between(const Quaterniond& from, const Quaterniond& to) {
  const AngleAxisd turn(to * from.conjugate());
  return turn.angle() * turn.axis();
}

Quaterniond turned(const Quaterniond& orientation, const Vector3d& turn) {
  const double angle = turn.norm();
  if (angle == 0) return orientation;
  return (Quaterniond(AngleAxisd(angle, turn / angle)) * orientation).normalized();
}

}  // namespace

ContinuousMotion::ContinuousMotion(std::span<const AssetView> shapes, std::uint32_t threads)
    : threads_(threads) {
  const Status status = query_.set_assets(shapes);
  if (status != Status::kOk) throw std::runtime_error(explain(status));
  for (const AssetView& shape : shapes) inner_radius_.push_back(inner_radius_of(shape));
}

bool ContinuousMotion::find_fast(std::span<const BodyProperties> bodies, std::span<const BodyState> before,
                                 std::span<const BodyState> after) {
  constexpr double kFast = 0.5;
  double thinnest = INFINITY;
  for (const BodyProperties& body : bodies) thinnest = std::min(thinnest, inner_radius(body));
  fast_.assign(bodies.size(), Motion::fixed);
  turn_.resize(bodies.size());
  way_.resize(bodies.size());
  bool any = false;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    way_[i] = after[i].position - before[i].position;
    turn_[i] = turn_between(before[i].orientation, after[i].orientation);
    if (bodies[i].motion == Motion::fixed) continue;
    if (way_[i].norm() + bodies[i].radius * turn_[i].norm() <= kFast * thinnest) continue;
    fast_[i] = Motion::moving;
    any = true;
  }
  part_.assign(bodies.size(), 1);
  return any;
}

// What touched already is no impact. A fast body goes on until a contact is deeper by a part of the thinner
// body's inner radius.
void ContinuousMotion::stop_in_contacts(std::span<const BodyProperties> bodies,
                                        std::span<const ContactPoint> contacts,
                                        std::span<const BodyState> before, std::span<const BodyState> after,
                                        double slop) {
  FollowedContacts followed(contacts, before);
  followed.follow(after);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const std::uint32_t a = contacts[i].body_a, b = contacts[i].body_b;
    const double thinner = std::min(inner_radius(bodies[a]), inner_radius(bodies[b]));
    const double start = contacts[i].depth, end = followed.contacts()[i].depth;
    const double most = std::max(start, slop) + kBeyond * thinner;
    if (end <= most) continue;
    const double part = (most - start) / (end - start);
    for (const std::uint32_t body : {a, b}) {
      if (fast_[body] == Motion::moving && bodies[body].motion == Motion::moving)
        part_[body] = std::min(part_[body], part);
    }
  }
}

// Which part of their ways two bodies go until they are a slop deep in each other, or a little beyond where
// they barely touch. reach: how much farther they may go, a length.
double ContinuousMotion::stop_of(const Impact& impact, std::uint32_t a, std::uint32_t b, double reach,
                                 double slop) const {
  const Vector3d at_a(impact.point_a), at_b(impact.point_b);
  const auto velocity = [&](std::uint32_t body, const Vector3d& at) {
    const RigidMotion& motion = motion_[body];
    const Vector3d v(motion.velocity), w(motion.angular_velocity), c(motion.center);
    return Vector3d(v + w.cross(at - (c + impact.t_safe * v)));
  };
  const Vector3d approach = velocity(a, at_a) - velocity(b, at_b), apart = at_b - at_a;
  const double closing = apart.norm() > 0 ? approach.dot(apart.normalized()) : approach.norm();
  double beyond = reach / approach.norm();
  if (closing > 0) beyond = std::min(beyond, (impact.gap + slop) / closing);
  return std::min(1.0, impact.t_safe + beyond);
}

// Result: whether a body stops earlier than it did.
bool ContinuousMotion::stop_at_impacts(std::span<const BodyProperties> bodies,
                                       std::span<const BodyState> before, double slop) {
  instances_.resize(bodies.size());
  motion_.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    instances_[i] = pose_of(bodies[i], before[i]);
    const Vector3d way = part_[i] * way_[i], turn = part_[i] * turn_[i];
    for (int k = 0; k < 3; ++k) {
      motion_[i].velocity[k] = way[k];
      motion_[i].angular_velocity[k] = turn[k];
      motion_[i].center[k] = before[i].position[k];
    }
  }
  const PairFilter filter = {.motion = fast_.data()};
  const Status status =
      query_.find(instances_, motion_, 1, {.tolerance = 1e-8, .threads = threads_, .filter = &filter});
  if (status != Status::kOk) throw std::runtime_error(std::string("times of impact: ") + explain(status));
  stop_.assign(bodies.size(), 1);
  bool earlier = false;
  for (std::size_t i = 0; i < query_.pairs().size(); ++i) {
    const Impact& impact = query_.impacts()[i];
    if (impact.status != ImpactStatus::found) continue;
    const auto [a, b] = query_.pairs()[i];
    const double thinner = std::min(inner_radius(bodies[a]), inner_radius(bodies[b]));
    const double reach = std::isfinite(thinner) ? kBeyond * thinner : slop;
    const double part = stop_of(impact, a, b, reach, slop);
    if (part > 1 - 1e-9) continue;
    for (const std::uint32_t body : {a, b}) {
      if (bodies[body].motion == Motion::moving) stop_[body] = std::min(stop_[body], part);
    }
    earlier = true;
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) part_[i] *= stop_[i];
  return earlier;
}

void ContinuousMotion::limit(std::span<const BodyProperties> bodies, std::span<const ContactPoint> contacts,
                             std::span<const BodyState> before, std::span<BodyState> after,
                             double slop) {
  if (!find_fast(bodies, before, after)) return;
  stop_in_contacts(bodies, contacts, before, after, slop);
  for (int round = 0; round < kMostRounds && stop_at_impacts(bodies, before, slop); ++round) {
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (part_[i] == 1) continue;
    after[i].position = before[i].position + part_[i] * way_[i];
    after[i].orientation = turned(before[i].orientation, part_[i] * turn_[i]);
  }
}

}  // namespace tandem::simulation
