#include "dynamics/contacts_ahead.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "kernels/common/stopwatch.h"

namespace tandem::dynamics {
namespace {

// Bodies are stopped before they meet if the gap is at most this part of the smaller one's radius: where two
// pass by each other, a plane between them says too much about what lies ahead.
constexpr double kFarthest = 0.25;

// A pair goes on touching if it does no more than this in half a step. It comes together by this part of the
// thinner one's inner radius at most, and parts by this part of the smaller one's radius: what seems to part
// faster may have passed through the other body. It touches from one side, by the cosine of the angle between
// normals: a nut on a bolt does not go on as it does, but as the bolt makes it.
constexpr double kClosing = 0.5, kParting = 0.01, kOneSide = 0.5;

// Two ways are about the same if the cosine of the angle between them is more than this.
constexpr double kSameWay = 0.5;

// More than a million steps may make of rounding errors in the distance of two bodies.
double rounding_of(const BodiesAhead& of, const ObjectPair& pair) {
  constexpr double kOfSize = 1e-9;
  const auto size = [&](std::uint32_t body) {
    return norm(of.states[body].position) + of.bodies[body].radius;
  };
  return kOfSize * (size(pair.a) + size(pair.b));
}

}  // namespace

ContactsAhead::ContactsAhead(std::span<const AssetView> assets, std::uint32_t threads,
                             const PairFilter* filter)
    : filter_(filter), inner_radius_(inner_radii(assets)) {
  for (Scene* scene : {&scene_, &moved_}) {
    require(scene->set_threads(threads), *scene);
    require(scene->set_assets(assets), *scene);
  }
}

void ContactsAhead::find_near(const BodiesAhead& of) {
  place(of);
  follow(of);
  require(scene_.find_pairs(farthest(of)), scene_);
  now_apart_.clear(), slow_.clear(), fast_.clear();
  auto before = apart_.begin();
  for (const ObjectPair& pair : scene_.pairs()) {
    while (before != apart_.end() && before->pair < pair) ++before;
    Apart& now = now_apart_.emplace_back(Apart{{pair}});
    if (before != apart_.end() && before->pair == pair)
      now.distance = before->distance - ways_.between(pair) * (1 + 1e-9);
    const double way = of.dt * (norm(approach_of(pair, of.states)) + turning_of(pair));
    const double margin = of.fall(pair) + of.overlap();
    const double rounding = rounding_of(of, pair);
    const double farthest = kFarthest * std::min(of.bodies[pair.a].radius, of.bodies[pair.b].radius);
    now.reach = std::max(std::min(way + margin, farthest), rounding);
    now.slow = way <= of.slop;
    if (now.distance > now.reach) continue;
    if (now.slow)
      slow_.push_back(pair);
    else if (!(now.distance > rounding))
      fast_.push_back(pair);
  }
  apart_.swap(now_apart_);
}

std::span<const ObjectPair> ContactsAhead::find_in_middle(std::span<const ObjectPair> touched,
                                                          const BodiesAhead& of) {
  const double time = 0.5 * of.dt;
  pairs_.clear(), of_middle_.clear(), in_middle_.clear();
  report_ = {};
  std::ranges::set_intersection(touched, fast_, std::back_inserter(pairs_));
  // What goes far might be beyond the other body by then; what is slow comes to rest.
  std::erase_if(pairs_, [&](const ObjectPair& pair) {
    const double way = norm(approach_of(pair, of.states));
    const double farthest = kFarthest * std::min(of.bodies[pair.a].radius, of.bodies[pair.b].radius);
    return time * way > farthest || of.dt * (way + turning_of(pair)) <= kFastFrom * of.slop;
  });
  if (pairs_.empty()) return of_middle_;
  clear_moved();
  const auto pose_in_middle = [&](std::uint32_t body) {
    return pose_of(of.bodies[body], is_still(body) ? of.states[body] : later(of.states[body], time));
  };
  for (const ObjectPair& pair : pairs_) add_moved(pose_in_middle(pair.a), pose_in_middle(pair.b));
  report_ = find_points_of_moved();
  for (auto next = points_.begin(); next != points_.end();) {
    const std::uint32_t first = next->body_a;
    const ObjectPair& pair = pairs_[first / 2];
    const std::size_t before = in_middle_.size();
    const double radius = std::min(of.bodies[pair.a].radius, of.bodies[pair.b].radius);
    const double of_a = inner_radius_[of.bodies[pair.a].shape], of_b = inner_radius_[of.bodies[pair.b].shape];
    const double closing = kClosing * std::min(of_a, of_b);
    const double parting = std::min(closing, kParting * radius);
    bool lasts = std::isfinite(of_a) && std::isfinite(of_b);
    for (; next != points_.end() && next->body_a == first; ++next) {
      ContactPoint& point = in_middle_.emplace_back(*next);
      point.body_a = pair.a, point.body_b = pair.b;
      point.feature = 0;  // it is of the moved scene
      point.time = time;
      const double way = time * of.approach_at(point);
      lasts = lasts && way <= closing && -way <= parting &&
              dot(point.normal, in_middle_[before].normal) > kOneSide;
    }
    if (lasts)
      of_middle_.push_back(pair);
    else
      in_middle_.resize(before);
  }
  return of_middle_;
}

void ContactsAhead::add_to(std::vector<ContactPoint>& found, std::span<const ObjectPair> kept,
                           const BodiesAhead& of) {
  add_points(in_middle_, found);
  find_distances(found, kept, of.overlap());
  find_approaches(of);
  if (approaches_.empty()) return;
  find_points(of);
  add_points(points_, found);
}

AheadState ContactsAhead::save() const {
  AheadState state = {before_, {}};
  for (const Apart& apart : apart_) {
    if (apart.distance > 0) state.apart.push_back({apart.pair, apart.distance});
  }
  return state;
}

void ContactsAhead::restore(AheadState state) {
  before_ = std::move(state.before);
  apart_.clear();
  for (const PairApart& apart : state.apart) apart_.push_back({apart});
}

void ContactsAhead::place(const BodiesAhead& of) {
  const std::size_t bodies = of.bodies.size();
  motion_.assign(bodies, Motion::moving);
  instances_.resize(bodies), turning_.resize(bodies);
  for (std::size_t i = 0; i < bodies; ++i) {
    instances_[i] = pose_of(of.bodies[i], of.states[i]);
    if (of.is_idle(static_cast<std::uint32_t>(i))) motion_[i] = Motion::fixed;
    turning_[i] = motion_[i] == Motion::fixed ? 0 : of.bodies[i].radius * norm(of.states[i].angular_velocity);
  }
  require(scene_.place(instances_, with_motions(filter_, motion_)), scene_);
}

void ContactsAhead::Ways::find(std::span<const BodyProperties> bodies, std::span<const BodyState> from,
                               std::span<const BodyState> to) {
  of_centre_.resize(bodies.size()), about_it_.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    of_centre_[i] = to[i].position - from[i].position;
    about_it_[i] = bodies[i].radius * norm(turn_between(from[i].orientation, to[i].orientation));
  }
}

// Finds how far bodies have moved since the last call.
void ContactsAhead::follow(const BodiesAhead& of) {
  if (before_.size() != of.states.size()) apart_.clear(), before_.assign(of.states.begin(), of.states.end());
  ways_.find(of.bodies, before_, of.states);
  std::ranges::copy(of.states, before_.begin());
}

// The velocity of b's centre as seen from a's.
Vector3 ContactsAhead::approach_of(const ObjectPair& pair, std::span<const BodyState> states) const {
  return (is_still(pair.b) ? Vector3{} : states[pair.b].velocity) -
         (is_still(pair.a) ? Vector3{} : states[pair.a].velocity);
}

// The largest reach that any pair may have.
double ContactsAhead::farthest(const BodiesAhead& of) const {
  double way = 0, radius = 0, fall = 0;
  for (std::uint32_t i = 0; i < of.bodies.size(); ++i) {
    if (is_still(i)) continue;
    way = std::max(way, of.dt * (norm(of.states[i].velocity) + turning_[i]));
    radius = std::max(radius, of.bodies[i].radius);
    fall = std::max(fall, of.fall(i));
  }
  return std::min(2 * way + fall + of.overlap(), kFarthest * radius);
}

// Finds the distances of pairs that may come together within the step: asked_. They are asked about together
// that have about the same reach, and farther than is needed now, so that most need not be asked about in the
// next steps.
void ContactsAhead::find_distances(std::span<const ContactPoint> found, std::span<const ObjectPair> kept,
                                   double overlap) {
  constexpr double kExact = 0.1;  // of the overlap
  constexpr int kClasses = 24;
  std::array<std::vector<std::uint32_t>, kClasses> of_reach;
  auto contact = found.begin();
  auto known = kept.begin();
  for (std::uint32_t i = 0; i < apart_.size(); ++i) {
    const Apart& apart = apart_[i];
    while (contact != found.end() && ObjectPair{contact->body_a, contact->body_b} < apart.pair) ++contact;
    if (contact != found.end() && ObjectPair{contact->body_a, contact->body_b} == apart.pair) continue;
    while (known != kept.end() && *known < apart.pair) ++known;
    if (apart.slow && known != kept.end() && *known == apart.pair) continue;
    if (apart.distance > apart.reach) continue;
    const int exponent = std::max(std::ilogb(apart.reach / overlap), 0);
    of_reach[static_cast<std::size_t>(std::min(exponent, kClasses - 1))].push_back(i);
  }
  asked_.clear();
  for (const std::vector<std::uint32_t>& places : of_reach) {
    if (places.empty()) continue;
    pairs_.clear();
    double reach = 0;
    for (const std::uint32_t i : places)
      pairs_.push_back(apart_[i].pair), reach = std::max(reach, apart_[i].reach);
    const DistanceOptions options = {.tolerance = {kExact * overlap, 0.1}, .reach = 1.5 * reach};
    require(distances_.find(scene_, pairs_, options), scene_);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const ObjectDistance& distance = distances_.rows()[i];
      apart_[places[i]].distance = distance.lower;
      if (distance.triangle_a != kNoIndex) asked_.push_back({places[i], distance});
    }
  }
  std::ranges::sort(asked_, {}, &Asked::place);
}

void ContactsAhead::find_approaches(const BodiesAhead& of) {
  approaches_.clear();
  for (const auto& [place, distance] : asked_) {
    const ObjectPair& pair = apart_[place].pair;
    const Vector3 from_b = vector_of(distance.point_a) - vector_of(distance.point_b);
    const double gap = norm(from_b);
    if (!(gap > 0)) continue;
    const double closing = dot(approach_of(pair, of.states), from_b) / gap + turning_of(pair);
    const double most = kFarthest * std::min(of.bodies[pair.a].radius, of.bodies[pair.b].radius);
    const double overlap = of.overlap();
    if (gap > std::min(most, of.dt * std::max(0.0, closing) + of.fall_along(pair, from_b / gap) + overlap))
      continue;
    approaches_.push_back({pair, gap, true, ((gap + overlap) / gap) * from_b});
    // A bowl that falls into another meets it all around, and not only where it is nearest. What moves
    // across its fall is not looked for: a ball that rolls would meet the ground before it.
    const Vector3 fall = of.fall_towards(pair, from_b);
    if (!(dot(fall, from_b) > 0 && dot(fall, from_b) < kSameWay * norm(fall) * gap)) continue;
    const double speed = dot(approach_of(pair, of.states), fall) / norm(fall);
    const double far = norm(fall) + of.dt * std::max(0.0, speed);
    const double way = (gap + overlap) * gap * norm(fall) / dot(fall, from_b);
    if (way <= far) approaches_.push_back({pair, gap, false, (way / norm(fall)) * fall});
  }
}

void ContactsAhead::find_points(const BodiesAhead& of) {
  clear_moved();
  for (const Approach& approach : approaches_) {
    BodyState moved = of.states[approach.pair.b];
    moved.position += approach.way;
    add_moved(pose_of(of.bodies[approach.pair.a], of.states[approach.pair.a]),
              pose_of(of.bodies[approach.pair.b], moved));
  }
  find_points_of_moved();
  std::erase_if(points_, [&](ContactPoint& point) {
    const Approach& approach = approaches_[point.body_a / 2];
    const double along = -dot(approach.way, point.normal);
    if (!(along > (approach.is_nearest ? kSameWay * norm(approach.way) : 0))) return true;
    point.body_a = approach.pair.a, point.body_b = approach.pair.b;
    point.depth -= along;
    if (!approach.is_nearest) point.depth = std::min(point.depth, -approach.gap);
    point.position -= 0.5 * approach.way;
    return false;
  });
}

std::span<const ObjectPair> ContactsAhead::add_missed(std::vector<ContactPoint>& found,
                                                      std::span<const ContactPoint> known,
                                                      const BodiesAhead& start,
                                                      std::span<const BodyState> end) {
  missed_.clear();
  find_surprised(known, start, end);
  if (pairs_.empty()) return missed_;
  clear_moved();
  for (const ObjectPair& pair : pairs_)
    add_moved(pose_of(start.bodies[pair.a], end[pair.a]), pose_of(start.bodies[pair.b], end[pair.b]));
  find_points_of_moved();
  std::erase_if(points_, [&](ContactPoint& point) {
    const ObjectPair& pair = pairs_[point.body_a / 2];
    point.body_a = pair.a, point.body_b = pair.b;
    point.feature = 0;  // it is of the moved scene, whose bodies depend on what is known of distances
    if (point.depth <= start.slop) return true;
    carry(point, anchor_of(point, end), start.states);
    return point.depth >= 0;
  });
  for (const ContactPoint& point : points_) {
    const ObjectPair pair = pair_of(point);
    if (missed_.empty() || missed_.back() != pair) missed_.push_back(pair);
  }
  add_points(points_, found);
  return missed_;
}

// Finds the pairs that were not expected to meet, since their bodies were slow and did not touch, and may be
// deeper in each other than the slop at the end.
void ContactsAhead::find_surprised(std::span<const ContactPoint> known, const BodiesAhead& start,
                                   std::span<const BodyState> end) {
  pairs_.clear();
  ways_.find(start.bodies, start.states, end);
  for (const Apart& apart : apart_) {
    const ObjectPair& pair = apart.pair;
    bool touches = false;
    for (; !known.empty() && pair_of(known.front()) <= pair; known = known.subspan(1))
      touches = touches || (pair_of(known.front()) == pair && known.front().depth >= 0);
    if (touches || !apart.slow) continue;
    if (ways_.between(pair) > std::max(0.0, apart.distance) + start.slop) pairs_.push_back(pair);
  }
}

void ContactsAhead::clear_moved() {
  instances_.clear(), moved_pairs_.clear();
}

void ContactsAhead::add_moved(const Instance& a, const Instance& b) {
  const auto first = static_cast<std::uint32_t>(instances_.size());
  moved_pairs_.push_back({first, first + 1});
  instances_.push_back(a), instances_.push_back(b);
}

// Finds the contacts of moved_pairs_: points_, of which pair i has bodies 2 i and 2 i + 1.
FinderReport ContactsAhead::find_points_of_moved() {
  FinderReport report;
  Stopwatch stopwatch;
  require(moved_.place(instances_), moved_);
  report.times.update = stopwatch.lap();
  require(contacts_.find(moved_, moved_pairs_, {}), moved_);
  report.times.traversal = stopwatch.lap();
  require(manifolds_.find(moved_, contacts_, {.match_previous = false}), moved_);
  take_points(manifolds_, moved_pairs_, points_, report.contacts);
  report.times.generation = stopwatch.lap();
  report.counters = contacts_.counters();
  return report;
}

// Adds points to those found, which come by ascending pair and go on doing so.
void ContactsAhead::add_points(const std::vector<ContactPoint>& points, std::vector<ContactPoint>& found) {
  const auto middle = static_cast<std::ptrdiff_t>(found.size());
  found.insert(found.end(), points.begin(), points.end());
  std::ranges::inplace_merge(found, found.begin() + middle, {},
                             [](const ContactPoint& contact) { return pair_of(contact); });
}

}  // namespace tandem::dynamics
