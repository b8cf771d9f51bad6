#pragma once
#include <algorithm>
#include <cstdint>
#include <span>

#include "dynamics/continuous_motion.h"
#include "dynamics/pair_touch.h"
#include "dynamics/parallel/atomics.h"
#include "dynamics/parallel/pair_lists.h"
#include "dynamics/parallel/step_arrays.h"

/// What a parallel step does with a pair of bodies, for host and device. PairStep has the order.
namespace tandem::dynamics {

namespace pair_step_detail {

// Returns how many near pairs there are; of those for which there is no room nothing is known.
TANDEM_HD inline std::uint32_t near_count(const StepArrays& a) {
  return *a.near_count < a.most_near ? *a.near_count : a.most_near;
}

// Return how many near pairs, or records of the step before, come before a pair.
TANDEM_HD inline std::uint32_t near_before(const StepArrays& a, const ObjectPair& pair) {
  return first_not_before(pair, near_count(a), [&](std::uint32_t k) { return a.near[k]; });
}
TANDEM_HD inline std::uint32_t records_before(const StepArrays& a, const ObjectPair& pair) {
  return first_not_before(pair, a.counts->records_before,
                          [&](std::uint32_t k) { return a.records_before[k].pair; });
}

TANDEM_HD inline bool is_near(const StepArrays& a, const ObjectPair& pair) {
  const std::uint32_t i = near_before(a, pair);
  return i < near_count(a) && is_same(a.near[i], pair);
}

// Returns whether a pair has to be followed though it is not near: for its contacts, or what it did in a
// call.
TANDEM_HD inline bool is_followed(const PairRecord& record) {
  return record.count > 0 || record.touches || record.began || record.ended;
}

TANDEM_HD inline std::uint32_t least_of(std::uint32_t a, std::uint32_t b) {
  return a < b ? a : b;
}

TANDEM_HD inline ContactPoint point_of(const ObjectPair& pair, const ManifoldPoint& from) {
  return {pair.a, pair.b, vector_of(from.position), vector_of(from.normal), from.depth, from.id};
}

// A body as it stands when the step begins, and how far it may go.
TANDEM_HD inline void place_body(const StepArrays& a, std::uint32_t i) {
  const BodyProperties& body = a.properties[i];
  a.pose[i] = pose_of(body, a.start[i]).pose;
  a.has_missed[i] = 0;
  if (!is_usable(a.start[i]) || !is_rigid(a.pose[i])) {
    // Such a step is not made. Questions do not see the body, nor do pairs.
    atomic_least(a.counts->bad_start, i);
    a.idle[i] = kUnusable, a.motion[i] = Motion::fixed, a.pose[i] = kIdentityPose;
    a.pulls[i] = {}, a.ways[i] = {};
    return;
  }
  a.pulls[i] = pull_on(body, a.start[i], a.gravity, a.forces != nullptr ? a.forces[i] : BodyForce{});
  a.idle[i] = a.acting[i].motion == Motion::fixed && a.placed[i] == 0 ? kIdle : kNotIdle;
  a.motion[i] = a.idle[i] != kNotIdle ? Motion::fixed : Motion::moving;
  a.ways[i] = way_of(body, a.before[i], a.start[i]);
  if (a.idle[i] != kNotIdle) return;
  const BodiesAhead of = a.ahead();
  LargestReach& reach = a.counts->reach;
  atomic_most(reach.way, way_ahead(of, i));
  atomic_most(reach.radius, body.radius);
  atomic_most(reach.fall, of.fall(i));
}

// Pairs that may meet are near ones; those that are remembered for their contacts stay, near or not.
TANDEM_HD inline void plan_pair(const StepArrays& a, std::uint32_t at, const ObjectPair& pair, bool is_near,
                                std::uint32_t before) {
  const BodiesAhead of = a.ahead();
  const bool can_begin = a.idle[pair.a] != kUnusable && a.idle[pair.b] != kUnusable;
  is_near = is_near && can_begin;
  const PairRecord* const old = before != kNoIndex ? &a.records_before[before] : nullptr;
  PairRecord& record = a.records[at];
  PairPlan& plan = a.plans[at];
  record.pair = pair, record.is_near = is_near;
  record.touches = record.began = record.ended = false;
  record.apart = 0;
  if (is_near && old != nullptr && old->is_near)
    record.apart = old->apart - way_between(a.ways[pair.a], a.ways[pair.b]) * (1 + 1e-9);
  plan = {};
  plan.before = before;
  plan.is_idle = !can_begin || (of.is_idle(pair.a) && of.is_idle(pair.b));
  if (!is_near) return;
  record.apart = std::max(record.apart, least_distance(of, pair));
  const PairReach reach = reach_of(of, pair, record.apart);
  plan.reach = reach.reach, plan.asked = reach.asked, plan.is_slow = reach.is_slow;
  plan.is_in_reach = reach.is_near, plan.is_fast = reach.is_fast;
}

// Returns the contacts that a pair had in the step before.
TANDEM_HD inline std::span<const CachedContact> remembered_before(const StepArrays& a, const PairPlan& plan) {
  if (plan.before == kNoIndex) return {};
  return a.remembered_of(a.records_before[plan.before]);
}

// Decides whether a pair keeps what is remembered of it, as MovedQuery does, and whether it is asked for
// contacts where the bodies stand.
TANDEM_HD inline void decide_pair(const StepArrays& a, std::uint32_t at) {
  PairRecord& record = a.records[at];
  PairPlan& plan = a.plans[at];
  const ObjectPair& pair = record.pair;
  const bool is_remembered =
      (!remembered_before(a, plan).empty() || (plan.is_in_reach && plan.is_slow)) && !plan.is_of_middle;
  record.is_posed = is_remembered;
  if (is_remembered) {
    const PairRecord* const old = plan.before != kNoIndex ? &a.records_before[plan.before] : nullptr;
    const Pose now[2] = {a.pose[pair.a], a.pose[pair.b]};
    plan.keeps = old != nullptr && old->is_posed &&
                 is_kept(a.boxes[a.asset[pair.a]], a.boxes[a.asset[pair.b]], old->posed, now, a.options.slop);
    record.posed[0] = plan.keeps ? old->posed[0] : now[0];
    record.posed[1] = plan.keeps ? old->posed[1] : now[1];
  }
  const bool counts = !plan.is_idle && are_told(a.properties[pair.a], a.properties[pair.b]);
  plan.is_asked = counts && !plan.keeps && (is_remembered || (plan.is_fast && !plan.is_of_middle));
}

TANDEM_HD inline bool is_asked_how_far(const StepArrays& a, std::uint32_t at) {
  const PairRecord& record = a.records[at];
  const PairPlan& plan = a.plans[at];
  return record.is_near && plan.found == 0 && !plan.keeps && !(record.apart > plan.reach);
}

// Returns whether the solver takes the contacts of a pair: those of bodies that it does not move stay as they
// were.
TANDEM_HD inline bool is_solved(const StepArrays& a, const PairRecord& record) {
  return record.contacts > 0 && (a.is_moved(record.pair.a) || a.is_moved(record.pair.b));
}

// Returns how many contacts a pair may remember.
TANDEM_HD inline std::uint32_t most_remembered_of(const StepArrays& a, std::uint32_t at) {
  const PairPlan& plan = a.plans[at];
  const std::uint32_t old = plan.before != kNoIndex ? a.records_before[plan.before].count : 0;
  return old + (plan.keeps || plan.is_idle ? 0 : plan.found);
}

// Makes the contacts of a pair, from the row `first` on.
TANDEM_HD inline void remember_pair(const StepArrays& a, std::uint32_t at, std::uint32_t first) {
  PairRecord& record = a.records[at];
  const PairPlan& plan = a.plans[at];
  record.first = record.first_contact = first;
  record.count = record.contacts = 0;
  const std::span<const CachedContact> old = remembered_before(a, plan);
  const PairContacts to = {a.remembered + record.first, a.contacts + record.first, a.place + record.first};
  if (plan.is_idle) {
    for (std::size_t i = 0; i < old.size(); ++i) to.remembered[i] = old[i];
    record.count = static_cast<std::uint32_t>(old.size());
    return;
  }
  PairContactCounts made;
  if (plan.keeps) {
    made = keep_contacts(old, a.ahead(), to);
  } else {
    std::uint8_t* const marks = a.contact_marks + 2 * record.first;
    for (std::size_t i = 0; i < 2 * old.size() + plan.found; ++i) marks[i] = 0;
    made = renew_contacts(record.pair, old, {a.found + plan.first_found, plan.found}, a.ahead(), to, marks);
  }
  record.count = made.remembered, record.contacts = made.contacts;
  for (std::uint32_t i = 0; i < made.contacts; ++i)
    a.impulses_before[record.first + i] = to.remembered[to.place[i]].impulse;
  if (is_solved(a, record)) return;
  for (std::uint32_t i = 0; i < made.contacts; ++i) {
    a.impulses[record.first + i] = a.impulses_before[record.first + i];
    a.done[record.first + i] = {};
  }
}

// Returns what was found of a row of a question; nothing where there is no room for all that was found.
TANDEM_HD inline std::span<ContactPoint> found_of(const StepArrays& a, std::uint32_t row) {
  const std::uint32_t first = a.row_first[row], end = a.row_end[row];
  if (end > a.most_found) return {};
  return {a.found + first, end - first};
}

TANDEM_HD inline void set_found(const StepArrays& a, PairPlan& plan, std::span<ContactPoint> found) {
  plan.found = static_cast<std::uint32_t>(found.size());
  plan.first_found = found.empty() ? 0 : static_cast<std::uint32_t>(found.data() - a.found);
}

// Takes the points of a manifold, which lie behind those found before. Rows of which nothing was found have
// an empty range.
TANDEM_HD inline void take_manifold(const StepArrays& a, const FoundManifolds& from, const PairList& pairs,
                                    std::uint32_t m) {
  const Manifold& manifold = from.manifolds[m];
  const std::uint32_t row = manifold.pair, first = a.counts->found + manifold.first_point;
  const std::uint32_t end = first + manifold.point_count;
  if (m == 0 || from.manifolds[m - 1].pair != row) a.row_first[row] = first;
  if (m + 1 == *from.count || from.manifolds[m + 1].pair != row) a.row_end[row] = end;
  if (end > a.most_found) return;
  for (std::uint32_t k = 0; k < manifold.point_count; ++k)
    a.found[first + k] = point_of(pairs.pairs[row], from.points[manifold.first_point + k]);
}

TANDEM_HD inline void pose_moved(const StepArrays& a, std::uint32_t row, const ObjectPair& pair,
                                 const Pose& pose_a, const Pose& pose_b) {
  a.moved_asset[2 * row] = a.asset[pair.a], a.moved_asset[2 * row + 1] = a.asset[pair.b];
  a.moved_pose[2 * row] = pose_a, a.moved_pose[2 * row + 1] = pose_b;
}

// The ways of a pair on which it may meet come one after the other, and so do its contacts on them.
TANDEM_HD inline void take_ahead(const StepArrays& a, std::uint32_t first_way, std::uint32_t ways,
                                 PairPlan& plan) {
  std::span<ContactPoint> all;
  std::size_t taken = 0;
  for (std::uint32_t w = first_way; w < first_way + ways; ++w) {
    const std::span<ContactPoint> found = found_of(a, w);
    if (taken == 0) all = found;
    for (ContactPoint point : found) {
      if (dynamics::take_ahead(a.approaches[w], point)) all.data()[taken++] = point;
    }
  }
  set_found(a, plan, {all.data(), taken});
}

// Adds the contacts at the end of the step to those that a pair has.
TANDEM_HD inline void join_missed(const StepArrays& a, std::uint32_t at, std::span<ContactPoint> at_end) {
  PairPlan& plan = a.plans[at];
  std::uint32_t missed = 0;
  for (ContactPoint point : at_end) {
    if (take_missed(a.ahead(), {a.end, a.bodies}, a.records[at].pair, point)) at_end[missed++] = point;
  }
  plan.is_missed = missed > 0;
  if (missed == 0) return;
  atomic_add(a.counts->missed, 1);
  for (const std::uint32_t body : {a.records[at].pair.a, a.records[at].pair.b})
    atomic_or(a.has_missed[body], 1);
  const std::uint32_t count = plan.keeps ? 0 : plan.found;
  plan.keeps = false;
  const std::uint32_t first = atomic_add(a.counts->found, count + missed);
  if (first + count + missed > a.most_found) return;
  for (std::uint32_t i = 0; i < count; ++i) a.found[first + i] = a.found[plan.first_found + i];
  for (std::uint32_t i = 0; i < missed; ++i) a.found[first + count + i] = at_end[i];
  plan.first_found = first, plan.found = count + missed;
}

// Whether a pair that was not expected to meet, since its bodies were slow and did not touch, may be deeper
// in each other than the slop at the end.
TANDEM_HD inline bool is_surprised(const StepArrays& a, std::uint32_t at) {
  const PairRecord& record = a.records[at];
  if (!record.is_near || !a.plans[at].is_slow) return false;
  for (std::uint32_t i = 0; i < record.contacts; ++i) {
    if (a.contacts[record.first_contact + i].depth >= 0) return false;
  }
  return way_between(a.ways_ahead[record.pair.a], a.ways_ahead[record.pair.b]) >
         std::max(0.0, record.apart) + a.options.slop;
}

// Follows whether a pair touches, as Touches does, and what it began and ended in a call. touch: of the
// contacts of the step, of which two idle bodies have none.
TANDEM_HD inline void follow_touch(const StepArrays& a, std::uint32_t at, const PairTouch& touch) {
  PairRecord& record = a.records[at];
  const PairPlan& plan = a.plans[at];
  const PairRecord* const before = plan.before != kNoIndex ? &a.records_before[plan.before] : nullptr;
  const bool touched = before != nullptr && before->touches, had_begun = before != nullptr && before->began;
  record.touches = touch.touches() || (plan.is_idle && touched);
  record.began = had_begun || (record.touches && !touched);
  record.ended = (before != nullptr && before->ended) || (touched && !record.touches);
  if (record.touches) a.touches[at] = touch.touches() ? touch.touch() : a.touches_before[plan.before];
  if (!record.began) return;
  a.begun[at] = had_begun ? a.begun_before[plan.before] : a.touches[at];
  if (record.touches) take_hardest(a.begun[at], a.touches[at]);
}

// Takes what the contacts of a pair did.
TANDEM_HD inline void finish_pair(const StepArrays& a, std::uint32_t at) {
  const PairRecord& record = a.records[at];
  PairTouch touch(record.pair);
  for (std::uint32_t i = 0; i < record.contacts; ++i) {
    const std::uint32_t k = record.first_contact + i;
    remember(a.remembered[record.first + a.place[k]], a.impulses[k]);
    touch.add(a.contacts[k], a.done[k].normal, approach_of(a.contacts[k], {a.start, a.bodies}));
  }
  follow_touch(a, at, touch);
}

}  // namespace pair_step_detail

}  // namespace tandem::dynamics
