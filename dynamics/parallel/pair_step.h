#pragma once
#include <cstdint>

#include "dynamics/parallel/pair_rules.h"

/// What a parallel step does before and after contacts are solved: what Simulation does with ContactsAhead,
/// MovedQuery and ContactCache, pair by pair. Executor: HostExecutor or CudaExecutor. Questions: what answers
/// questions about bodies in the executor's memory; near(), manifolds() and distances() as they are called
/// below.
namespace tandem::dynamics {

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
      if (of.thinnest < INFINITY && is_fast(of.acting[i], of.start[i], of.end[i], of.thinnest))
        atomic_or(of.counts->has_fast, 1);
    });
    select([of] TANDEM_HD(std::uint32_t i) { return is_surprised(of, i); }, &of.counts->surprised);
  }

  /// Adds the contacts at the end of the step to those of surprised pairs, if counts.missed pairs have any.
  /// The contacts of other pairs stay where they are.
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
    remember_missed();
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
      of.counts->records_before = before;
      of.counts->bad_start = of.counts->bad_body = kNoIndex;
    });
    to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) { pair_step_detail::place_body(of, i); });
  }

  void join_near_and_remembered() {
    using namespace pair_step_detail;
    const StepArrays of = a;
    to.for_each(&of.counts->records_before, a.most_pairs, [of] TANDEM_HD(std::uint32_t j) {
      const PairRecord& old = of.records_before[j];
      of.flags[j] = is_followed(old) && !is_near(of, old.pair) ? 1 : 0;
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
          return plan.is_fast && has_middle(of.ahead(), remembered_before(of, plan));
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
                [of] TANDEM_HD(std::uint32_t r) { of.reach[r] = of.plans[of.list[r]].asked; });
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
    to.for_each(&of.counts->pairs, a.most_pairs,
                [of] TANDEM_HD(std::uint32_t i) { of.flags[i] = most_remembered_of(of, i); });
    to.sum_before(a.flags, &of.counts->pairs, a.most_pairs, a.sums);
    to.once([of] TANDEM_HD() { of.counts->remembered = of.sums[least_of(of.counts->pairs, of.most_pairs)]; });
    to.for_each(&of.counts->pairs, a.most_pairs, [of] TANDEM_HD(std::uint32_t i) {
      if (of.counts->remembered <= of.most_remembered && of.counts->found <= of.most_found)
        remember_pair(of, i, of.sums[i]);
      else
        of.records[i].count = of.records[i].contacts = 0;
    });
  }

  // Contacts of pairs that missed some come behind all others. Without room nothing is written: the step is
  // made again.
  void remember_missed() {
    using namespace pair_step_detail;
    const StepArrays of = a;
    to.for_each(&of.counts->surprised, a.most_moved, [of] TANDEM_HD(std::uint32_t r) {
      of.flags[r] = of.plans[of.list[r]].is_missed ? most_remembered_of(of, of.list[r]) : 0;
    });
    to.sum_before(a.flags, &of.counts->surprised, a.most_moved, a.sums);
    to.for_each(&of.counts->surprised, a.most_moved, [of] TANDEM_HD(std::uint32_t r) {
      const std::uint32_t first = of.counts->remembered + of.sums[r], end = first + of.flags[r];
      if (of.plans[of.list[r]].is_missed && end <= of.most_remembered && of.counts->found <= of.most_found)
        remember_pair(of, of.list[r], first);
    });
    to.once([of] TANDEM_HD() {
      of.counts->remembered += of.sums[least_of(of.counts->surprised, of.most_moved)];
    });
  }

  void list_touching() {
    using namespace pair_step_detail;
    const StepArrays of = a;
    select([of] TANDEM_HD(std::uint32_t i) { return is_solved(of, of.records[i]); }, &of.counts->touching);
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
