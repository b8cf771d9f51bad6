#include "dynamics/contacts_ahead.h"

#include <algorithm>
#include <cmath>

namespace tandem::dynamics {
namespace {

// Bodies are stopped before they meet if the gap is at most this part of the smaller one's radius: where two
// pass by each other, a plane between them says too much about what lies ahead.
constexpr double kFarthest = 0.25;

// Bodies may fall towards each other by so many times what gravity lets a body fall in a step.
constexpr double kFall = 2;

bool comes_before(const ContactPoint& p, const ContactPoint& q) {
  return ObjectPair{p.body_a, p.body_b} < ObjectPair{q.body_a, q.body_b};
}

}  // namespace

ContactsAhead::ContactsAhead(std::span<const AssetView> assets, std::uint32_t threads,
                             const PairFilter& filter)
    : filter_(filter) {
  for (Scene* scene : {&scene_, &moved_}) {
    require(scene->set_threads(threads), *scene);
    require(scene->set_assets(assets), *scene);
  }
}

void ContactsAhead::add_to(std::vector<ContactPoint>& found, std::span<const ObjectPair> kept,
                           std::span<const BodyProperties> bodies, std::span<const BodyState> states,
                           std::span<const std::uint8_t> idle, double dt, std::span<const Pull> pulls,
                           double overlap) {
  motion_.assign(bodies.size(), Motion::moving);
  instances_.resize(bodies.size()), turning_.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    instances_[i] = pose_of(bodies[i], states[i]);
    if (!idle.empty() && idle[i] != 0) motion_[i] = Motion::fixed;
    turning_[i] = motion_[i] == Motion::fixed ? 0 : bodies[i].radius * norm(states[i].angular_velocity);
  }
  filter_.motion = motion_.data();
  require(scene_.place(instances_, filter_), scene_);
  follow(bodies, states);
  find_pairs(found, kept, bodies, states, dt, pulls, overlap);
  find_approaches(bodies, states, dt, pulls, overlap);
  if (approaches_.empty()) return;
  find_points(bodies, states);
  const auto middle = static_cast<std::ptrdiff_t>(found.size());
  found.insert(found.end(), points_.begin(), points_.end());
  std::inplace_merge(found.begin(), found.begin() + middle, found.end(), comes_before);
}

// Finds how far bodies have moved since the last call.
void ContactsAhead::follow(std::span<const BodyProperties> bodies, std::span<const BodyState> states) {
  if (before_.size() != states.size()) apart_.clear(), before_.assign(states.begin(), states.end());
  way_.resize(states.size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double turn = norm(turn_between(before_[i].orientation, states[i].orientation));
    way_[i] = norm(states[i].position - before_[i].position) + bodies[i].radius * turn;
    before_[i] = states[i];
  }
}

// The velocity of b's centre as seen from a's.
Vector3 ContactsAhead::approach_of(const ObjectPair& pair, std::span<const BodyState> states) const {
  return (is_still(pair.b) ? Vector3{} : states[pair.b].velocity) -
         (is_still(pair.a) ? Vector3{} : states[pair.a].velocity);
}

// Finds the pairs that may come together within the step, as far as is known without looking at their
// surfaces: pairs_. now_apart_: all pairs that are near each other.
void ContactsAhead::find_pairs(std::span<const ContactPoint> found, std::span<const ObjectPair> kept,
                               std::span<const BodyProperties> bodies, std::span<const BodyState> states,
                               double dt, std::span<const Pull> pulls, double overlap) {
  const auto margin_of = [&](std::uint32_t body) { return kFall * pulls[body].most() * dt * dt + overlap; };
  farthest_ = 0;
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    if (is_still(i)) continue;
    const double way = dt * (norm(states[i].velocity) + turning_[i]) + margin_of(i);
    farthest_ = std::max(farthest_, std::min(way, kFarthest * bodies[i].radius));
  }
  farthest_ *= 2;
  require(scene_.find_pairs(farthest_), scene_);
  pairs_.clear(), now_apart_.clear();
  auto contact = found.begin();
  auto before = apart_.begin();
  for (const ObjectPair& pair : scene_.pairs()) {
    while (contact != found.end() && ObjectPair{contact->body_a, contact->body_b} < pair) ++contact;
    if (contact != found.end() && ObjectPair{contact->body_a, contact->body_b} == pair) continue;
    if (std::ranges::binary_search(kept, pair)) continue;
    while (before != apart_.end() && before->pair < pair) ++before;
    Apart& now = now_apart_.emplace_back(Apart{pair});
    if (before != apart_.end() && before->pair == pair) now = *before;
    now.distance -= (way_[pair.a] + way_[pair.b]) * (1 + 1e-9);
    const double way = dt * (norm(approach_of(pair, states)) + turning_of(pair)) +
                       std::max(margin_of(pair.a), margin_of(pair.b));
    const double most = kFarthest * std::min(bodies[pair.a].radius, bodies[pair.b].radius);
    if (now.distance > std::min(way, most)) continue;
    pairs_.push_back(pair);
  }
  apart_.swap(now_apart_);
}

void ContactsAhead::find_approaches(std::span<const BodyProperties> bodies, std::span<const BodyState> states,
                                    double dt, std::span<const Pull> pulls, double overlap) {
  constexpr double kExact = 0.1;  // of the overlap
  approaches_.clear();
  if (pairs_.empty()) return;
  // Farther than is needed now, so that most need not be asked about in the next steps.
  const DistanceOptions options = {.tolerance = {kExact * overlap, 0.05}, .reach = 2 * farthest_};
  require(distances_.find(scene_, pairs_, options), scene_);
  auto apart = apart_.begin();
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const ObjectPair& pair = pairs_[i];
    const ObjectDistance& distance = distances_.rows()[i];
    while (apart->pair < pair) ++apart;
    apart->distance = distance.lower;
    if (distance.triangle_a == kNoIndex) continue;
    const Vector3 from_b = vector_of(distance.point_a) - vector_of(distance.point_b);
    const double gap = norm(from_b);
    if (!(gap > 0)) continue;
    const double closing = dot(approach_of(pair, states), from_b) / gap + turning_of(pair);
    const Pull &on_a = pulls[pair.a], &on_b = pulls[pair.b];
    const double pulled = std::max(std::fabs(dot(on_a.linear, from_b)), std::fabs(dot(on_b.linear, from_b)));
    const double falls = (kFall * pulled / gap + kFall * (on_a.turning + on_b.turning)) * dt;
    const double most = kFarthest * std::min(bodies[pair.a].radius, bodies[pair.b].radius);
    if (gap <= std::min(most, dt * (std::max(0.0, closing) + falls) + overlap))
      approaches_.push_back({pair, ((gap + overlap) / gap) * from_b});
  }
}

void ContactsAhead::find_points(std::span<const BodyProperties> bodies, std::span<const BodyState> states) {
  constexpr double kSameWay = 0.5;  // cosine of the angle between b's way and a normal, at least
  instances_.clear(), moved_pairs_.clear();
  for (const Approach& approach : approaches_) {
    const auto first = static_cast<std::uint32_t>(instances_.size());
    moved_pairs_.push_back({first, first + 1});
    instances_.push_back(pose_of(bodies[approach.pair.a], states[approach.pair.a]));
    BodyState moved = states[approach.pair.b];
    moved.position += approach.way;
    instances_.push_back(pose_of(bodies[approach.pair.b], moved));
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
