#include "dynamics/contacts_ahead.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tandem::dynamics {
namespace {

// Bodies are stopped before they meet if the gap is at most this part of the smaller one's radius: where two
// pass by each other, a plane between them says too much about what lies ahead.
constexpr double kFarthest = 0.25;

// More than a million steps may make of rounding errors in the distance of two bodies.
double rounding_of(const BodiesAhead& of, const ObjectPair& pair) {
  constexpr double kOfSize = 1e-9;
  const auto size = [&](std::uint32_t body) {
    return norm(of.states[body].position) + of.bodies[body].radius;
  };
  return kOfSize * (size(pair.a) + size(pair.b));
}

bool comes_before(const ContactPoint& p, const ContactPoint& q) {
  return ObjectPair{p.body_a, p.body_b} < ObjectPair{q.body_a, q.body_b};
}

}  // namespace

ContactsAhead::ContactsAhead(std::span<const AssetView> assets, std::uint32_t threads,
                             const PairFilter* filter)
    : filter_(filter) {
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
    Apart& now = now_apart_.emplace_back(Apart{pair});
    if (before != apart_.end() && before->pair == pair)
      now.distance = before->distance - (way_[pair.a] + way_[pair.b]) * (1 + 1e-9);
    const double way = of.dt * (norm(approach_of(pair, of.states)) + turning_of(pair));
    const double margin = of.fall(pair) + of.overlap();
    now.reach =
        std::min(way + margin, kFarthest * std::min(of.bodies[pair.a].radius, of.bodies[pair.b].radius));
    now.slow = way <= of.slop;
    if (now.slow)
      slow_.push_back(pair);
    else if (!(now.distance > rounding_of(of, pair)))
      fast_.push_back(pair);
  }
  apart_.swap(now_apart_);
}

void ContactsAhead::add_to(std::vector<ContactPoint>& found, std::span<const ObjectPair> kept,
                           const BodiesAhead& of) {
  find_distances(found, kept, of.overlap());
  find_approaches(of);
  if (approaches_.empty()) return;
  find_points(of);
  const auto middle = static_cast<std::ptrdiff_t>(found.size());
  found.insert(found.end(), points_.begin(), points_.end());
  std::inplace_merge(found.begin(), found.begin() + middle, found.end(), comes_before);
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

// Finds how far bodies have moved since the last call.
void ContactsAhead::follow(const BodiesAhead& of) {
  const std::span<const BodyState> states = of.states;
  if (before_.size() != states.size()) apart_.clear(), before_.assign(states.begin(), states.end());
  way_.resize(states.size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double turn = norm(turn_between(before_[i].orientation, states[i].orientation));
    way_[i] = norm(states[i].position - before_[i].position) + of.bodies[i].radius * turn;
    before_[i] = states[i];
  }
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
    const DistanceOptions options = {.tolerance = {kExact * overlap, 0.05}, .reach = 2 * reach};
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
    if (gap <= std::min(most, of.dt * std::max(0.0, closing) + of.fall_along(pair, from_b / gap) + overlap))
      approaches_.push_back({pair, ((gap + overlap) / gap) * from_b});
  }
}

void ContactsAhead::find_points(const BodiesAhead& of) {
  constexpr double kSameWay = 0.5;  // cosine of the angle between b's way and a normal, at least
  instances_.clear(), moved_pairs_.clear();
  for (const Approach& approach : approaches_) {
    const auto first = static_cast<std::uint32_t>(instances_.size());
    moved_pairs_.push_back({first, first + 1});
    instances_.push_back(pose_of(of.bodies[approach.pair.a], of.states[approach.pair.a]));
    BodyState moved = of.states[approach.pair.b];
    moved.position += approach.way;
    instances_.push_back(pose_of(of.bodies[approach.pair.b], moved));
  }
  require(moved_.place(instances_), moved_);
  require(contacts_.find(moved_, moved_pairs_, {}), moved_);
  require(manifolds_.find(moved_, contacts_, {.match_previous = false}), moved_);
  ContactStatistics statistics;
  take_points(manifolds_, moved_pairs_, points_, statistics);
  std::erase_if(points_, [&](ContactPoint& point) {
    const Approach& approach = approaches_[point.body_a / 2];
    const double along = -dot(approach.way, point.normal);
    if (!(along > kSameWay * norm(approach.way))) return true;
    point.body_a = approach.pair.a, point.body_b = approach.pair.b;
    point.depth -= along;
    point.position -= 0.5 * approach.way;
    return false;
  });
}

}  // namespace tandem::dynamics
