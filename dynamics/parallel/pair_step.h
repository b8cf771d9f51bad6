#pragma once
#include <algorithm>
#include <cstdint>

#include "dynamics/parallel/atomics.h"
#include "dynamics/parallel/step_arrays.h"

/// What a parallel step does before and after contacts are solved: what Simulation does with ContactsAhead,
/// MovedQuery and ContactCache, pair by pair. Executor: HostExecutor or CudaExecutor. Questions: what answers
/// questions about bodies in the executor's memory; near(), manifolds() and distances() as they are called
/// below.
namespace tandem::dynamics {

/// Pairs in the executor's memory.
struct PairList {
  const ObjectPair* pairs;
  const std::uint32_t* count;
  std::uint32_t most;
};

/// Bodies in the executor's memory.
struct PosedList {
  const std::uint32_t* asset;
  const Pose* pose;
  std::uint32_t count;
};

/// Manifolds by ascending row of the list of pairs, and their points in the same order.
struct FoundManifolds {
  const Manifold* manifolds;
  const ManifoldPoint* points;
  const std::uint32_t* count;  ///< of manifolds
  const std::uint32_t* point_count;
  std::uint32_t most;  ///< manifolds
};

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

TANDEM_HD inline std::uint32_t least_of(std::uint32_t a, std::uint32_t b) {
  return a < b ? a : b;
}

TANDEM_HD inline ContactPoint point_of(const ObjectPair& pair, const ManifoldPoint& from) {
  return {pair.a, pair.b, vector_of(from.position), vector_of(from.normal), from.depth, from.id};
}

// A body as it stands when the step begins, and how far it may go.
TANDEM_HD inline void place_body(const StepArrays& a, std::uint32_t i) {
  const BodyProperties& body = a.properties[i];
  a.pulls[i] = pull_on(body, a.start[i], a.gravity, a.forces != nullptr ? a.forces[i] : BodyForce{});
  a.idle[i] = a.acting[i].motion == Motion::fixed && a.placed[i] == 0 ? 1 : 0;
  a.motion[i] = a.idle[i] != 0 ? Motion::fixed : Motion::moving;
  a.pose[i] = pose_of(body, a.start[i]).pose;
  a.ways[i] = way_of(body, a.before[i], a.start[i]);
  if (a.idle[i] != 0) return;
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
  const PairRecord* const old = before != kNoIndex ? &a.records_before[before] : nullptr;
  PairRecord& record = a.records[at];
  PairPlan& plan = a.plans[at];
  record.pair = pair, record.is_near = is_near, record.touches = false;
  record.apart = 0;
  if (is_near && old != nullptr && old->is_near)
    record.apart = old->apart - way_between(a.ways[pair.a], a.ways[pair.b]) * (1 + 1e-9);
  plan = {};
  plan.before = before;
  plan.is_idle = of.is_idle(pair.a) && of.is_idle(pair.b);
  if (!is_near) return;
  record.apart = std::max(record.apart, least_distance(of, pair));
  const PairReach reach = reach_of(of, pair, record.apart);
  plan.reach = reach.reach, plan.is_slow = reach.is_slow;
  plan.is_in_reach = reach.is_near, plan.is_fast = reach.is_fast;
}

TANDEM_HD inline bool touched(const StepArrays& a, const PairPlan& plan) {
  return plan.before != kNoIndex && a.records_before[plan.before].count > 0;
}

// Decides whether a pair keeps what is remembered of it, as MovedQuery does, and whether it is asked for
// contacts where the bodies stand.
TANDEM_HD inline void decide_pair(const StepArrays& a, std::uint32_t at) {
  PairRecord& record = a.records[at];
  PairPlan& plan = a.plans[at];
  const ObjectPair& pair = record.pair;
  const bool is_remembered = (touched(a, plan) || (plan.is_in_reach && plan.is_slow)) && !plan.is_of_middle;
  record.is_posed = is_remembered;
  if (is_remembered) {
    const PairRecord* const old = plan.before != kNoIndex ? &a.records_before[plan.before] : nullptr;
    const Pose now[2] = {a.pose[pair.a], a.pose[pair.b]};
    plan.keeps = old != nullptr && old->is_posed &&
                 is_kept(a.boxes[a.asset[pair.a]], a.boxes[a.asset[pair.b]], old->posed, now, a.options.slop);
    record.posed[0] = plan.keeps ? old->posed[0] : now[0];
    record.posed[1] = plan.keeps ? old->posed[1] : now[1];
  }
  // Nobody wants to know of a fixed body that was placed and another that does not move.
  const bool counts = !plan.is_idle && (a.properties[pair.a].motion == Motion::moving ||
                                        a.properties[pair.b].motion == Motion::moving);
  plan.is_asked = counts && !plan.keeps && (is_remembered || (plan.is_fast && !plan.is_of_middle));
}

TANDEM_HD inline bool is_asked_how_far(const StepArrays& a, std::uint32_t at) {
  const PairRecord& record = a.records[at];
  const PairPlan& plan = a.plans[at];
  return record.is_near && plan.found == 0 && !plan.keeps && !(record.apart > plan.reach);
}

// Makes the contacts of a pair, behind those of the pairs before it.
TANDEM_HD inline void remember_pair(const StepArrays& a, std::uint32_t at) {
  PairRecord& record = a.records[at];
  const PairPlan& plan = a.plans[at];
  record.first = record.first_contact = a.sums[at];
  record.count = record.contacts = 0;
  std::span<const CachedContact> old;
  if (plan.before != kNoIndex) old = a.remembered_of(a.records_before[plan.before]);
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
  if (missed == 0) return;
  atomic_add(a.counts->missed, 1);
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

// A pair touches if at the step's start it has a contact that is no gap, or if one pushes.
TANDEM_HD inline void finish_pair(const StepArrays& a, std::uint32_t at) {
  PairRecord& record = a.records[at];
  const PairPlan& plan = a.plans[at];
  if (plan.is_idle && plan.before != kNoIndex) record.touches = a.records_before[plan.before].touches;
  for (std::uint32_t i = 0; i < record.contacts; ++i) {
    const std::uint32_t k = record.first_contact + i;
    remember(a.remembered[record.first + a.place[k]], a.impulses[k]);
    record.touches = record.touches || a.contacts[k].depth >= 0 || a.done[k].normal > 0;
  }
}

}  // namespace pair_step_detail

/// The questions and the rules of a step, in their order.
template <typename Executor, typename Questions>
struct PairStep {
  Executor& to;
  Questions& ask;
  StepArrays a;

  /// Finds the contacts of the step: contacts, of records. within: how far apart near pairs are, at least
  /// counts.reach.farthest(), or the step has to be made again.
  void find_contacts(double within) {
    begin();
    const PairList near = ask.near({a.asset, a.pose, a.bodies}, a.motion, within);
    a.near = near.pairs, a.near_count = near.count, a.most_near = near.most;
    join_near_and_remembered();
    ask_for_middle();
    ask_for_contacts();
    ask_for_contacts_ahead();
    remember_contacts();
    list_touching();
  }

  /// Finds what the step missed: counts.surprised pairs may have contacts of which nobody knew. Condition:
  /// the step is solved.
  void find_surprised() {
    using namespace pair_step_detail;
    const StepArrays of = a;
    to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) {
      of.ways_ahead[i] = way_of(of.acting[i], of.start[i], of.end[i]);
      if (!is_usable(of.end[i])) atomic_least(of.counts->bad_body, i);
    });
    select([of] TANDEM_HD(std::uint32_t i) { return is_surprised(of, i); }, &of.counts->surprised);
  }

  /// Adds the contacts at the end of the step to those of surprised pairs, and makes the contacts of the step
  /// again, if counts.missed pairs have any.
  void add_missed() {
    using namespace pair_step_detail;
    const StepArrays of = a;
    to.for_each(&of.counts->surprised, a.most_moved, [of] TANDEM_HD(std::uint32_t r) {
      const ObjectPair& pair = of.records[of.list[r]].pair;
      pose_moved(of, r, pair, pose_of(of.acting[pair.a], of.end[pair.a]).pose,
                 pose_of(of.acting[pair.b], of.end[pair.b]).pose);
    });
    ask_about_moved(&of.counts->surprised);
    to.once([of] TANDEM_HD() { of.counts->missed = 0; });
    to.for_each(&of.counts->surprised, a.most_moved,
                [of] TANDEM_HD(std::uint32_t r) { join_missed(of, of.list[r], found_of(of, r)); });
    remember_contacts();
    list_touching();
  }

  /// Takes what the contacts did. Condition: the step is solved.
  void finish() {
    using namespace pair_step_detail;
    const StepArrays of = a;
    to.for_each(&of.counts->pairs, a.most_pairs, [of] TANDEM_HD(std::uint32_t i) { finish_pair(of, i); });
  }

  // Lists the pairs of which a question is asked.
  template <typename IsAsked>
  void select(const IsAsked& is_asked, std::uint32_t* count) {
    to.select(is_asked, &a.counts->pairs, a.most_pairs, a.list, count);
  }

  void begin() {
    const StepArrays of = a;
    to.once([of] TANDEM_HD() {
      const std::uint32_t before = of.counts->records_before;
      *of.counts = {};
      of.counts->records_before = before, of.counts->bad_body = kNoIndex;
    });
    to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) { pair_step_detail::place_body(of, i); });
  }

  void join_near_and_remembered() {
    using namespace pair_step_detail;
    const StepArrays of = a;
    to.for_each(&of.counts->records_before, a.most_pairs, [of] TANDEM_HD(std::uint32_t j) {
      const PairRecord& old = of.records_before[j];
      of.flags[j] = old.count > 0 && !is_near(of, old.pair) ? 1 : 0;
    });
    to.sum_before(a.flags, &of.counts->records_before, a.most_pairs, a.sums);
    to.once([of] TANDEM_HD() { of.counts->pairs = near_count(of) + of.sums[of.counts->records_before]; });
    to.for_each(of.near_count, a.most_near, [of] TANDEM_HD(std::uint32_t i) {
      const ObjectPair pair = of.near[i];
      const std::uint32_t j = records_before(of, pair);
      const std::uint32_t at = i + of.sums[j];
      if (at >= of.most_pairs) return;
      const bool is_known = j < of.counts->records_before && is_same(of.records_before[j].pair, pair);
      plan_pair(of, at, pair, true, is_known ? j : kNoIndex);
    });
    to.for_each(&of.counts->records_before, a.most_pairs, [of] TANDEM_HD(std::uint32_t j) {
      if (of.flags[j] == 0) return;
      const ObjectPair pair = of.records_before[j].pair;
      const std::uint32_t at = of.sums[j] + near_before(of, pair);
      if (at < of.most_pairs) plan_pair(of, at, pair, false, j);
    });
  }

  void ask_for_middle() {
    using namespace pair_step_detail;
    const StepArrays of = a;
    select(
        [of] TANDEM_HD(std::uint32_t i) {
          const PairPlan& plan = of.plans[i];
          return plan.is_fast && touched(of, plan) && has_middle(of.ahead(), of.records[i].pair);
        },
        &of.counts->middle);
    to.for_each(&of.counts->middle, a.most_moved, [of] TANDEM_HD(std::uint32_t r) {
      const ObjectPair& pair = of.records[of.list[r]].pair;
      pose_moved(of, r, pair, pose_in_middle(of.ahead(), pair.a).pose,
                 pose_in_middle(of.ahead(), pair.b).pose);
    });
    ask_about_moved(&of.counts->middle);
    to.for_each(&of.counts->middle, a.most_moved, [of] TANDEM_HD(std::uint32_t r) {
      PairPlan& plan = of.plans[of.list[r]];
      const std::span<ContactPoint> found = found_of(of, r);
      plan.is_of_middle = take_middle(of.ahead(), of.records[of.list[r]].pair, of.inner_radius, found);
      if (plan.is_of_middle) set_found(of, plan, found);
    });
  }

  void ask_for_contacts() {
    using namespace pair_step_detail;
    const StepArrays of = a;
    to.for_each(&of.counts->pairs, a.most_pairs, [of] TANDEM_HD(std::uint32_t i) { decide_pair(of, i); });
    select([of] TANDEM_HD(std::uint32_t i) { return of.plans[i].is_asked; }, &of.counts->asked);
    list_asked(&of.counts->asked);
    take_points({a.asset, a.pose, a.bodies}, {a.asked, &of.counts->asked, a.most_pairs});
    to.for_each(&of.counts->asked, a.most_pairs,
                [of] TANDEM_HD(std::uint32_t r) { set_found(of, of.plans[of.list[r]], found_of(of, r)); });
  }

  void ask_for_contacts_ahead() {
    using namespace pair_step_detail;
    const StepArrays of = a;
    select([of] TANDEM_HD(std::uint32_t i) { return is_asked_how_far(of, i); }, &of.counts->apart);
    list_asked(&of.counts->apart);
    to.for_each(&of.counts->apart, a.most_pairs,
                [of] TANDEM_HD(std::uint32_t r) { of.reach[r] = asked_reach(of.plans[of.list[r]].reach); });
    const ObjectDistance* const distances =
        ask.distances({a.asset, a.pose, a.bodies}, {a.asked, &of.counts->apart, a.most_pairs}, a.reach,
                      distance_tolerance(a.ahead()));
    to.for_each(&of.counts->apart, a.most_pairs, [of, distances] TANDEM_HD(std::uint32_t r) {
      PairRecord& record = of.records[of.list[r]];
      record.apart = distances[r].lower;
      Approach ways[2];
      of.flags[r] = static_cast<std::uint32_t>(find_approaches(of.ahead(), record.pair, distances[r], ways));
    });
    to.sum_before(a.flags, &of.counts->apart, a.most_pairs, a.sums);
    to.for_each(&of.counts->apart, a.most_pairs, [of, distances] TANDEM_HD(std::uint32_t r) {
      const ObjectPair& pair = of.records[of.list[r]].pair;
      Approach ways[2];
      const int count = find_approaches(of.ahead(), pair, distances[r], ways);
      PairPlan& plan = of.plans[of.list[r]];
      plan.first_found = of.sums[r], plan.found = static_cast<std::uint32_t>(count);
      for (int k = 0; k < count; ++k) {
        const std::uint32_t row = of.sums[r] + static_cast<std::uint32_t>(k);
        if (row >= of.most_moved) continue;
        of.approaches[row] = ways[k];
        BodyState moved = of.start[pair.b];
        moved.position += ways[k].way;
        pose_moved(of, row, pair, of.pose[pair.a], pose_of(of.acting[pair.b], moved).pose);
      }
    });
    to.once([of] TANDEM_HD() { of.counts->approaches = of.sums[least_of(of.counts->apart, of.most_pairs)]; });
    ask_about_moved(&of.counts->approaches);
    to.for_each(&of.counts->apart, a.most_pairs, [of] TANDEM_HD(std::uint32_t r) {
      PairPlan& plan = of.plans[of.list[r]];
      const std::uint32_t ways = plan.first_found + plan.found <= of.most_moved ? plan.found : 0;
      take_ahead(of, plan.first_found, ways, plan);
    });
  }

  void remember_contacts() {
    using namespace pair_step_detail;
    const StepArrays of = a;
    to.for_each(&of.counts->pairs, a.most_pairs, [of] TANDEM_HD(std::uint32_t i) {
      const PairPlan& plan = of.plans[i];
      const std::uint32_t old = plan.before != kNoIndex ? of.records_before[plan.before].count : 0;
      of.flags[i] = old + (plan.keeps || plan.is_idle ? 0 : plan.found);
    });
    to.sum_before(a.flags, &of.counts->pairs, a.most_pairs, a.sums);
    to.once([of] TANDEM_HD() { of.counts->remembered = of.sums[least_of(of.counts->pairs, of.most_pairs)]; });
    to.for_each(&of.counts->pairs, a.most_pairs, [of] TANDEM_HD(std::uint32_t i) {
      if (of.counts->remembered <= of.most_remembered && of.counts->found <= of.most_found)
        remember_pair(of, i);
      else
        of.records[i].count = of.records[i].contacts = 0;
    });
  }

  void list_touching() {
    const StepArrays of = a;
    select(
        [of] TANDEM_HD(std::uint32_t i) {
          const PairRecord& record = of.records[i];
          return record.contacts > 0 && (of.is_moved(record.pair.a) || of.is_moved(record.pair.b));
        },
        &of.counts->touching);
    to.for_each(&of.counts->touching, a.most_pairs, [of] TANDEM_HD(std::uint32_t r) {
      const PairRecord& record = of.records[of.list[r]];
      of.touching[r] = {record.pair.a, record.pair.b, record.first_contact, record.contacts};
    });
  }

  void list_asked(const std::uint32_t* count) {
    const StepArrays of = a;
    to.for_each(count, a.most_pairs,
                [of] TANDEM_HD(std::uint32_t r) { of.asked[r] = of.records[of.list[r]].pair; });
  }

  /// Finds the contacts of the rows: row r of two moved bodies.
  void ask_about_moved(const std::uint32_t* rows) {
    take_points({a.moved_asset, a.moved_pose, 2 * a.most_moved}, {a.moved_pairs, rows, a.most_moved});
  }

  void take_points(const PosedList& bodies, const PairList& pairs) {
    using namespace pair_step_detail;
    const StepArrays of = a;
    to.for_each(pairs.count, pairs.most,
                [of] TANDEM_HD(std::uint32_t r) { of.row_first[r] = of.row_end[r] = 0; });
    const FoundManifolds found = ask.manifolds(bodies, pairs);
    to.for_each(found.count, found.most,
                [of, found, pairs] TANDEM_HD(std::uint32_t m) { take_manifold(of, found, pairs, m); });
    to.once([of, found] TANDEM_HD() { of.counts->found += *found.point_count; });
  }
};

}  // namespace tandem::dynamics
