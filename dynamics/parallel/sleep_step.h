#pragma once
#include <cstdint>

#include "dynamics/islands.h"
#include "dynamics/parallel/labels.h"
#include "dynamics/parallel/step_arrays.h"

/// Islands and sleep of a parallel step: what find_islands() and Sleep do. An island is known by its first
/// body, as those that fell asleep together are.
namespace tandem::dynamics {

namespace sleep_step_detail {

enum Mark : std::uint32_t { kWoken = 1, kTouches = 2, kRestless = 4 };

// The mark of a body that sleeps stands for all that fell asleep with it; those of an island for all of it.
TANDEM_HD inline void mark(const StepArrays& a, std::uint32_t of, Mark mark) {
  atomic_or(a.marks[of], mark);
}

// What is awake and moves wakes what it touches, and so does what was placed.
TANDEM_HD inline void wake_touched(const StepArrays& a, const ObjectPair& pair) {
  const auto wakes = [&](std::uint32_t body, std::uint32_t other) {
    const bool sleeps = a.group[other] != Sleep::kAwake;
    if (sleeps && (a.acting[body].motion != Motion::fixed || a.placed[body] != 0))
      mark(a, a.group[other], kWoken);
    // A body without a group counts anew how long it is quiet.
    if (!sleeps && a.placed[body] != 0) mark(a, other, kWoken);
  };
  wakes(pair.a, pair.b), wakes(pair.b, pair.a);
}

// A joint keeps its island, and wakes the body that sleeps if the other is awake and moves; once it has
// broken it wakes both.
TANDEM_HD inline void mark_joined(const StepArrays& a, std::uint32_t i) {
  Joint joint = a.joints.joints[i];
  if (!joint.holds) return;
  const bool broke = a.joints.broke[i] != 0;
  joint.holds = !broke;
  bool is_awake = false, sleeps = false;
  for (const std::uint32_t body : {joint.a, joint.b}) {
    if (body == kNoIndex) continue;
    const bool of_body = a.group[body] != Sleep::kAwake;
    sleeps = sleeps || of_body, is_awake = is_awake || (!of_body && a.acting[body].motion != Motion::fixed);
    if (!a.is_moved(body)) continue;
    mark(a, a.label[body], kTouches);
    if (joint.is_driven()) mark(a, a.label[body], kRestless);
  }
  if (!broke && !(is_awake && sleeps)) return;
  for (const std::uint32_t body : {joint.a, joint.b}) {
    if (body == kNoIndex) continue;
    if (a.group[body] != Sleep::kAwake)
      mark(a, a.group[body], kWoken);
    else if (broke)
      mark(a, body, kWoken);
  }
}

TANDEM_HD inline void wake(const StepArrays& a, std::uint32_t i) {
  const std::uint32_t by = a.group[i] != Sleep::kAwake ? a.group[i] : i;
  if ((a.marks[by] & kWoken) != 0) a.group[i] = Sleep::kAwake, a.quiet[i] = 0;
}

TANDEM_HD inline void count_quiet(const StepArrays& a, std::uint32_t i, const SleepOptions& options) {
  if (!a.is_moved(i)) return;
  const BodyState& state = a.end[i];
  const double speed = norm(state.velocity) + a.properties[i].radius * norm(state.angular_velocity);
  a.quiet[i] = speed <= options.speed ? a.quiet[i] + a.dt : 0;
  if (!(a.quiet[i] >= options.delay)) mark(a, a.label[i], kRestless);
}

TANDEM_HD inline void fall_asleep(const StepArrays& a, std::uint32_t i) {
  if (a.is_moved(i) && (a.marks[a.label[i]] & (kTouches | kRestless)) == kTouches) {
    a.group[i] = a.label[i];
    a.end[i].velocity = {}, a.end[i].angular_velocity = {};
  }
  a.acting[i].motion = a.group[i] != Sleep::kAwake ? Motion::fixed : a.properties[i].motion;
  a.placed[i] = 0;
}

}  // namespace sleep_step_detail

/// Wakes what is touched, and lets islands fall asleep. Condition: the step is solved.
template <typename Executor>
void sleep_step(Executor& to, const StepArrays& a, const SleepOptions& options) {
  using namespace sleep_step_detail;
  const StepArrays of = a;
  const SleepOptions by = options;
  if (!by.enabled) {
    to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) { of.placed[i] = 0; });
    return;
  }
  to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) { of.label[i] = i, of.marks[i] = 0; });
  to.for_each(&of.counts->touching, a.most_pairs, [of] TANDEM_HD(std::uint32_t i) {
    const ContactPair& pair = of.touching[i];
    if (of.is_moved(pair.a) && of.is_moved(pair.b)) join(of.label, pair.a, pair.b);
  });
  to.for_each(nullptr, a.joints.count, [of] TANDEM_HD(std::uint32_t i) {
    const ObjectPair pair = of.joints.joints[i].pair();
    if (pair.a != kNoIndex && pair.b != kNoIndex && of.is_moved(pair.a) && of.is_moved(pair.b))
      join(of.label, pair.a, pair.b);
  });
  to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) { of.label[i] = first_of(of.label, i); });
  to.for_each(&of.counts->pairs, a.most_pairs, [of] TANDEM_HD(std::uint32_t i) {
    const PairRecord& record = of.records[i];
    if (record.contacts == 0) return;
    for (const std::uint32_t body : {record.pair.a, record.pair.b}) {
      if (of.is_moved(body)) mark(of, of.label[body], kTouches);
    }
    wake_touched(of, record.pair);
  });
  to.for_each(nullptr, a.joints.count, [of] TANDEM_HD(std::uint32_t i) { mark_joined(of, i); });
  to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) { wake(of, i); });
  to.for_each(nullptr, a.bodies, [of, by] TANDEM_HD(std::uint32_t i) { count_quiet(of, i, by); });
  to.for_each(nullptr, a.bodies, [of] TANDEM_HD(std::uint32_t i) { fall_asleep(of, i); });
}

}  // namespace tandem::dynamics
