#pragma once
#include <cstdint>

#include "dynamics/islands.h"
#include "dynamics/parallel/step_arrays.h"

/// What callers do to bodies between steps: what Simulation::place() and set_force() do.
namespace tandem::dynamics {

namespace wake_step_detail {

TANDEM_HD inline void wake(const StepArrays& a, std::uint32_t i) {
  a.group[i] = Sleep::kAwake, a.quiet[i] = 0;
  a.acting[i].motion = a.properties[i].motion;
}

// Marks a body, or what it fell asleep with.
TANDEM_HD inline std::uint32_t& mark_of(const StepArrays& a, std::uint32_t i) {
  return a.marks[a.group[i] != Sleep::kAwake ? a.group[i] : i];
}

template <typename Executor>
void clear_marks(Executor& to, const StepArrays& a) {
  const StepArrays of = a;
  to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) { of.marks[i] = 0; });
}
template <typename Executor>
void wake_marked(Executor& to, const StepArrays& a) {
  const StepArrays of = a;
  to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) {
    if (mark_of(of, i) != 0) wake(of, i);
  });
}

// Marks the other body of a pair.
TANDEM_HD inline void mark_other(const StepArrays& a, const ObjectPair& pair, std::uint32_t body) {
  const std::uint32_t other = pair.a == body ? pair.b : pair.a;
  if ((pair.a == body || pair.b == body) && other != kNoIndex) mark_of(a, other) = 1;
}

}  // namespace wake_step_detail

/// Wakes all bodies.
template <typename Executor>
void wake_all(Executor& to, const StepArrays& a) {
  using namespace wake_step_detail;
  const StepArrays of = a;
  to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) { wake(of, i); });
}

/// Wakes the bodies of a joint, and what fell asleep with them.
template <typename Executor>
void wake_joined(Executor& to, const StepArrays& a, const Joint& joint) {
  using namespace wake_step_detail;
  const StepArrays of = a;
  const ObjectPair pair = {joint.a, joint.b};
  clear_marks(to, a);
  to.once([of, pair] TANDEM_HD() {
    if (pair.a != kNoIndex) mark_of(of, pair.a) = 1;
    if (pair.b != kNoIndex) mark_of(of, pair.b) = 1;
  });
  wake_marked(to, a);
}

/// Wakes a body, and what fell asleep with it. One that contacts do not move wakes what touches it or is
/// joined to it; if it is placed anew, in the next step what it touches then.
template <typename Executor>
void wake_body(Executor& to, const StepArrays& a, std::uint32_t body, bool is_placed) {
  using namespace wake_step_detail;
  const StepArrays of = a;
  clear_marks(to, a);
  to.once([of, body, is_placed] TANDEM_HD() {
    if (is_placed && of.properties[body].motion == Motion::fixed) of.placed[body] = 1;
    mark_of(of, body) = 1;
  });
  to.for_each(&of.counts->records_before, a.most_pairs, [of, body] TANDEM_HD(std::uint32_t j) {
    const PairRecord& record = of.records_before[j];
    if (of.properties[body].motion != Motion::moving && record.touches) mark_other(of, record.pair, body);
  });
  to.for_each(nullptr, a.joints.count, [of, body] TANDEM_HD(std::uint32_t j) {
    if (of.properties[body].motion != Motion::moving) mark_other(of, of.joints.joints[j].pair(), body);
  });
  wake_marked(to, a);
}

/// Forgets the contacts of a pair, as if it had never met.
template <typename Executor>
void forget_contacts(Executor& to, const StepArrays& a, const ObjectPair& pair) {
  const StepArrays of = a;
  const ObjectPair forgotten = pair;
  to.for_each(&of.counts->records_before, a.most_pairs, [of, forgotten] TANDEM_HD(std::uint32_t j) {
    PairRecord& record = of.records_before[j];
    if (!is_same(record.pair, forgotten)) return;
    record.count = record.contacts = 0;
    record.is_posed = false;
  });
}

}  // namespace tandem::dynamics
