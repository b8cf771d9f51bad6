#include "dynamics/contacts_ahead.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "kernels/common/stopwatch.h"

namespace tandem::dynamics {
namespace {

constexpr std::size_t kPairsAtOnce = 256;  // that a thread takes

}  // namespace

ContactsAhead::ContactsAhead(std::span<const AssetView> assets, const Threads& threads,
                             const PairFilter* filter)
    : filter_(filter), threads_(threads), inner_radius_(inner_radii(assets)) {
  for (Scene* scene : {&scene_, &moved_}) {
    threads_.work_for(*scene);
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
    const bool is_known = before != apart_.end() && before->pair == pair;
    now_apart_.push_back({{pair, is_known ? before->distance : 0}, {}});
  }
  apart_.swap(now_apart_);
  threads_.for_parts(apart_.size(), kPairsAtOnce, [&](std::size_t i) {
    Apart& now = apart_[i];
    // A distance that is not above 0 says nothing, so it need not follow the bodies.
    if (now.distance > 0) now.distance -= between(now.pair) * (1 + 1e-9);
    now.distance = std::max(now.distance, least_distance(of, now.pair));
    now.reach = reach_of(of, now.pair, now.distance);
  });
  for (const Apart& apart : apart_) {
    if (apart.reach.is_near && apart.reach.is_slow) slow_.push_back(apart.pair);
    if (apart.reach.is_fast) fast_.push_back(apart.pair);
  }
}

std::span<const ObjectPair> ContactsAhead::find_in_middle(std::span<const CachedContact> remembered,
                                                          const BodiesAhead& of) {
  pairs_.clear(), of_middle_.clear(), in_middle_.clear();
  report_ = {};
  for (const ObjectPair& pair : fast_) {
    const auto first = std::ranges::lower_bound(remembered, pair, {}, &CachedContact::pair);
    const auto last = std::ranges::upper_bound(first, remembered.end(), pair, {}, &CachedContact::pair);
    if (has_middle(of, {first, last})) pairs_.push_back(pair);
  }
  if (pairs_.empty()) return of_middle_;
  clear_moved();
  for (const ObjectPair& pair : pairs_) add_moved(pose_in_middle(of, pair.a), pose_in_middle(of, pair.b));
  report_ = find_points_of_moved();
  for (auto begin = points_.begin(), end = begin; begin != points_.end(); begin = end) {
    while (end != points_.end() && end->body_a == begin->body_a) ++end;
    const ObjectPair& pair = pairs_[begin->body_a / 2];
    if (!take_middle(of, pair, inner_radius_.data(), std::span(begin, end))) continue;
    of_middle_.push_back(pair);
    in_middle_.insert(in_middle_.end(), begin, end);
  }
  return of_middle_;
}

void ContactsAhead::add_to(std::vector<ContactPoint>& found, std::span<const ObjectPair> kept,
                           const BodiesAhead& of) {
  add_points(in_middle_, found);
  find_approaches(found, kept, of);
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
  for (const PairApart& apart : state.apart) apart_.push_back({apart, {}});
}

void ContactsAhead::place(const BodiesAhead& of) {
  const std::size_t bodies = of.bodies.size();
  motion_.assign(bodies, Motion::moving);
  instances_.resize(bodies);
  for (std::size_t i = 0; i < bodies; ++i) {
    instances_[i] = pose_of(of.bodies[i], of.states[i]);
    if (of.is_idle(static_cast<std::uint32_t>(i))) motion_[i] = Motion::fixed;
  }
  require(scene_.place(instances_, with_motions(filter_, motion_)), scene_);
}

void ContactsAhead::find_ways(std::span<const BodyProperties> bodies, std::span<const BodyState> from,
                              std::span<const BodyState> to) {
  ways_.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) ways_[i] = way_of(bodies[i], from[i], to[i]);
}

// Finds how far bodies have moved since the last call.
void ContactsAhead::follow(const BodiesAhead& of) {
  if (before_.size() != of.states.size()) apart_.clear(), before_.assign(of.states.begin(), of.states.end());
  find_ways(of.bodies, before_, of.states);
  std::ranges::copy(of.states, before_.begin());
}

// The largest reach that any pair may have.
double ContactsAhead::farthest(const BodiesAhead& of) {
  LargestReach largest;
  for (std::uint32_t i = 0; i < of.bodies.size(); ++i) {
    if (of.is_idle(i)) continue;
    largest.way = std::max(largest.way, way_ahead(of, i));
    largest.radius = std::max(largest.radius, of.bodies[i].radius);
    largest.fall = std::max(largest.fall, of.fall(i));
  }
  return largest.farthest(of.overlap());
}

// Finds on which ways pairs may meet within the step, from their distances.
void ContactsAhead::find_approaches(std::span<const ContactPoint> found, std::span<const ObjectPair> kept,
                                    const BodiesAhead& of) {
  pairs_.clear(), places_.clear(), reaches_.clear(), approaches_.clear();
  auto contact = found.begin();
  auto known = kept.begin();
  for (std::uint32_t i = 0; i < apart_.size(); ++i) {
    const Apart& apart = apart_[i];
    while (contact != found.end() && pair_of(*contact) < apart.pair) ++contact;
    if (contact != found.end() && pair_of(*contact) == apart.pair) continue;
    while (known != kept.end() && *known < apart.pair) ++known;
    if (known != kept.end() && *known == apart.pair) continue;
    if (apart.distance > apart.reach.reach) continue;
    pairs_.push_back(apart.pair), places_.push_back(i), reaches_.push_back(apart.reach.asked);
  }
  if (pairs_.empty()) return;
  require(distances_.find(scene_, pairs_, {.tolerance = distance_tolerance(of), .reach_of_pair = reaches_}),
          scene_);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const ObjectDistance& distance = distances_.rows()[i];
    apart_[places_[i]].distance = distance.lower;
    Approach found_ways[2];
    const int count = dynamics::find_approaches(of, pairs_[i], distance, found_ways);
    approaches_.insert(approaches_.end(), found_ways, found_ways + count);
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
  std::erase_if(points_,
                [&](ContactPoint& point) { return !take_ahead(approaches_[point.body_a / 2], point); });
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
    return !take_missed(start, end, pairs_[point.body_a / 2], point);
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
  find_ways(start.bodies, start.states, end);
  for (const Apart& apart : apart_) {
    const ObjectPair& pair = apart.pair;
    if (!apart.reach.is_slow || !(between(pair) > std::max(0.0, apart.distance) + start.slop)) continue;
    bool touches = false;
    auto contact =
        std::ranges::lower_bound(known, pair, {}, [](const ContactPoint& of) { return pair_of(of); });
    for (; contact != known.end() && pair_of(*contact) == pair; ++contact)
      touches = touches || contact->depth >= 0;
    if (!touches) pairs_.push_back(pair);
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
  require(manifolds_.find(moved_, contacts_, kManifoldsOfStep), moved_);
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
