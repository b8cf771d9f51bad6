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

}  // namespace wake_step_detail

/// Wakes all bodies.
template <typename Executor>
void wake_all(Executor& to, const StepArrays& a) {
  using namespace wake_step_detail;
  const StepArrays of = a;
  to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) { wake(of, i); });
}

/// Wakes a body, and what fell asleep with it. One that contacts do not move wakes what touches it; if it is
/// placed anew, in the next step what it touches then. Condition: marks are free.
template <typename Executor>
void wake_body(Executor& to, const StepArrays& a, std::uint32_t body, bool is_placed) {
  using namespace wake_step_detail;
  const StepArrays of = a;
  to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) { of.marks[i] = 0; });
  to.once([of, body, is_placed] TANDEM_HD() {
    if (is_placed && of.properties[body].motion == Motion::fixed) of.placed[body] = 1;
    mark_of(of, body) = 1;
  });
  to.for_each(&of.counts->records_before, a.most_pairs, [of, body] TANDEM_HD(std::uint32_t j) {
    const PairRecord& record = of.records_before[j];
    if (of.properties[body].motion == Motion::moving || !record.touches) return;
    if (record.pair.a != body && record.pair.b != body) return;
    mark_of(of, record.pair.a == body ? record.pair.b : record.pair.a) = 1;
  });
  to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) {
    if (mark_of(of, i) != 0) wake(of, i);
  });
}

}  // namespace tandem::dynamics
