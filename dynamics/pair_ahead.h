#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "dynamics/bodies_ahead.h"
#include "dynamics/remembered_contacts.h"
#include "tandem/kernels/distance_query.h"

/// What is asked about a pair of bodies before a step, and what is made of the answers: rules for host and
/// device. See ContactsAhead.
namespace tandem::dynamics {

namespace pair_ahead_detail {

// Bodies are stopped before they meet if the gap is at most this part of the smaller one's radius: where two
// pass by each other, a plane between them says too much about what lies ahead.
inline constexpr double kFarthest = 0.25;

// A pair goes on touching if it does no more than this in half a step. It comes together by this part of the
// thinner one's inner radius at most, and parts by this part of the smaller one's radius: what seems to part
// faster may have passed through the other body. It touches from one side, by the cosine of the angle between
// normals: a nut on a bolt does not go on as it does, but as the bolt makes it.
inline constexpr double kClosing = 0.5, kParting = 0.01, kOneSide = 0.5;

// Two ways are about the same if the cosine of the angle between them is more than this.
inline constexpr double kSameWay = 0.5;

// More than a million steps may make of rounding errors in the distance of two bodies.
inline constexpr double kRounding = 1e-9;

TANDEM_HD inline double smaller_radius(const BodiesAhead& of, const ObjectPair& pair) {
  return std::min(of.bodies[pair.a].radius, of.bodies[pair.b].radius);
}

TANDEM_HD inline double rounding_of(const BodiesAhead& of, const ObjectPair& pair) {
  const auto size = [&](std::uint32_t body) {
    return norm(of.states[body].position) + of.bodies[body].radius;
  };
  return kRounding * (size(pair.a) + size(pair.b));
}

}  // namespace pair_ahead_detail

/// Tells how far a body has gone from one state to another.
struct BodyWay {
  Vector3 of_centre;
  double about_it;  ///< the most that a point has
};

TANDEM_HD inline BodyWay way_of(const BodyProperties& body, const BodyState& from, const BodyState& to) {
  return {to.position - from.position, body.radius * norm(turn_between(from.orientation, to.orientation))};
}

/// Returns how far points of one body have moved as seen from the other, at most.
TANDEM_HD inline double way_between(const BodyWay& a, const BodyWay& b) {
  return norm(b.of_centre - a.of_centre) + a.about_it + b.about_it;
}

/// Says how a pair may come together within a step.
struct PairReach {
  double reach;  ///< how far apart they may be and meet
  double asked;  ///< how far apart they are asked for their distance
  bool is_slow;  ///< points move against each other by no more than the slop
  bool is_near;  ///< it may meet, for all that is known
  bool is_fast;  ///< it may meet, is not slow, and is not surely apart now
};

/// Returns by how much bodies are apart at least, for all that balls around them say.
TANDEM_HD inline double least_distance(const BodiesAhead& of, const ObjectPair& pair) {
  const double centres = norm(of.states[pair.b].position - of.states[pair.a].position);
  return centres - of.bodies[pair.a].radius - of.bodies[pair.b].radius -
         pair_ahead_detail::rounding_of(of, pair);
}

/// distance: by which the bodies are apart at least. A pair is asked for its distance farther than it needs
/// now if that spares it the question in the next step, as far as its bodies go on as they do.
TANDEM_HD inline PairReach reach_of(const BodiesAhead& of, const ObjectPair& pair, double distance) {
  using namespace pair_ahead_detail;
  const double way = of.dt * (norm(of.approach(pair)) + of.turning(pair));
  const double margin = of.fall(pair) + of.overlap();
  const double rounding = rounding_of(of, pair);
  const double reach = std::max(std::min(way + margin, kFarthest * smaller_radius(of, pair)), rounding);
  const bool is_slow = way <= of.slop, is_near = !(distance > reach);
  const double farther = 1.5 * reach;
  return {reach, farther - way > reach ? farther : reach, is_slow, is_near,
          is_near && !is_slow && !(distance > rounding)};
}

/// The largest of what bounds the reach of a pair, over all bodies that are not idle.
struct LargestReach {
  double way = 0, radius = 0, fall = 0;

  TANDEM_HD double farthest(double overlap) const {
    return std::min(2 * way + fall + overlap, pair_ahead_detail::kFarthest * radius);
  }
};

/// Returns how far a body's points may go in a step by its velocities, at most.
TANDEM_HD inline double way_ahead(const BodiesAhead& of, std::uint32_t body) {
  return of.dt * (norm(of.states[body].velocity) + of.turning(body));
}

/// Returns whether a fast pair that has such contacts of the step before is asked about the middle of the
/// step. What goes far might be beyond the other body by then; what is slow comes to rest. What touched from
/// several sides mostly still does, and then take_middle() would not count.
TANDEM_HD inline bool has_middle(const BodiesAhead& of, std::span<const CachedContact> remembered) {
  using namespace pair_ahead_detail;
  if (remembered.empty()) return false;
  const ObjectPair& pair = remembered[0].pair;
  const double way = norm(of.approach(pair));
  if (0.5 * of.dt * way > kFarthest * smaller_radius(of, pair) ||
      of.dt * (way + of.turning(pair)) <= kFastFrom * of.slop)
    return false;
  const CachedContact* first = nullptr;
  for (const CachedContact& contact : remembered) {
    if (!was_found(contact)) continue;
    if (first == nullptr) first = &contact;
    if (!(dot(contact.normal_in_a, first->normal_in_a) > kOneSide)) return false;
  }
  return true;
}

/// Returns where a body is in the middle of the step.
TANDEM_HD inline Instance pose_in_middle(const BodiesAhead& of, std::uint32_t body) {
  return pose_of(of.bodies[body], of.is_idle(body) ? of.states[body] : later(of.states[body], 0.5 * of.dt));
}

/// Makes contacts of the step of those that a pair has in its middle. Result: whether the pair goes on
/// touching, so that they count. inner_radius: of each shape; infinite where it is not closed.
TANDEM_HD inline bool take_middle(const BodiesAhead& of, const ObjectPair& pair, const double* inner_radius,
                                  std::span<ContactPoint> points) {
  using namespace pair_ahead_detail;
  const double of_a = inner_radius[of.bodies[pair.a].shape], of_b = inner_radius[of.bodies[pair.b].shape];
  const double time = 0.5 * of.dt, closing = kClosing * std::min(of_a, of_b);
  const double parting = std::min(closing, kParting * smaller_radius(of, pair));
  bool lasts = !points.empty() && of_a <= 1.7976931348623157e308 && of_b <= 1.7976931348623157e308;
  for (ContactPoint& point : points) {
    point.body_a = pair.a, point.body_b = pair.b;
    point.feature = 0;  // it is of the moved scene
    point.time = time;
    const double way = time * of.approach_at(point);
    lasts = lasts && way <= closing && -way <= parting && dot(point.normal, points[0].normal) > kOneSide;
  }
  return lasts;
}

TANDEM_HD inline DistanceTolerance distance_tolerance(const BodiesAhead& of) {
  return {0.1 * of.overlap(), 0.1};
}

/// A way on which a pair may meet.
struct Approach {
  ObjectPair pair;
  double gap;  ///< of the nearest points
  bool is_nearest;
  Vector3 way;  ///< of b, until it overlaps a
};

/// Returns how many ways there are: 0, 1 or 2.
TANDEM_HD inline int find_approaches(const BodiesAhead& of, const ObjectPair& pair,
                                     const ObjectDistance& distance, Approach (&to)[2]) {
  using namespace pair_ahead_detail;
  if (distance.triangle_a == kNoIndex) return 0;
  const Vector3 from_b = vector_of(distance.point_a) - vector_of(distance.point_b);
  const double gap = norm(from_b);
  if (!(gap > 0)) return 0;
  const double closing = dot(of.approach(pair), from_b) / gap + of.turning(pair);
  const double most = kFarthest * smaller_radius(of, pair);
  const double overlap = of.overlap();
  if (gap > std::min(most, of.dt * std::max(0.0, closing) + of.fall_along(pair, from_b / gap) + overlap))
    return 0;
  to[0] = {pair, gap, true, ((gap + overlap) / gap) * from_b};
  // A bowl that falls into another meets it all around, and not only where it is nearest. What moves
  // across its fall is not looked for: a ball that rolls would meet the ground before it.
  const Vector3 fall = of.fall_towards(pair, from_b);
  if (!(dot(fall, from_b) > 0 && dot(fall, from_b) < kSameWay * norm(fall) * gap)) return 1;
  const double speed = dot(of.approach(pair), fall) / norm(fall);
  const double far = norm(fall) + of.dt * std::max(0.0, speed);
  const double way = (gap + overlap) * gap * norm(fall) / dot(fall, from_b);
  if (!(way <= far)) return 1;
  to[1] = {pair, gap, false, (way / norm(fall)) * fall};
  return 2;
}

/// Makes a contact of the step of one that a pair has when b has gone the way. Result: whether it counts.
TANDEM_HD inline bool take_ahead(const Approach& approach, ContactPoint& point) {
  const double along = -dot(approach.way, point.normal);
  if (!(along > (approach.is_nearest ? pair_ahead_detail::kSameWay * norm(approach.way) : 0))) return false;
  point.body_a = approach.pair.a, point.body_b = approach.pair.b;
  point.depth -= along;
  if (!approach.is_nearest) point.depth = std::min(point.depth, -approach.gap);
  point.position -= 0.5 * approach.way;
  return true;
}

/// Makes a contact of the step of one that a pair has at its end. Result: whether it counts.
TANDEM_HD inline bool take_missed(const BodiesAhead& start, std::span<const BodyState> end,
                                  const ObjectPair& pair, ContactPoint& point) {
  point.body_a = pair.a, point.body_b = pair.b;
  point.feature = 0;  // it is of the moved scene, whose bodies depend on what is known of distances
  if (point.depth <= start.slop) return false;
  carry(point, anchor_of(point, end), start.states);
  return point.depth < 0;
}

}  // namespace tandem::dynamics
