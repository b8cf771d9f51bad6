#include "sleep.h"

#include <algorithm>

namespace tandem::simulation {

void Sleep::start(std::size_t bodies) {
  quiet_.assign(bodies, 0);
  group_.assign(bodies, kAwake);
}

void Sleep::wake_touched(std::span<const BodyProperties> bodies, std::span<const ContactPoint> contacts) {
  std::vector<std::uint32_t> touched;
  for (const ContactPoint& contact : contacts) {
    const bool a = sleeps(contact.body_a), b = sleeps(contact.body_b);
    if (a == b) continue;
    // What is fixed wakes nobody.
    const std::uint32_t other = a ? contact.body_b : contact.body_a;
    if (bodies[other].motion != Motion::fixed) touched.push_back(a ? contact.body_a : contact.body_b);
  }
  for (const std::uint32_t body : touched) wake(body);
}

void Sleep::wake(std::uint32_t body) {
  quiet_[body] = 0;
  const std::uint32_t group = group_[body];
  if (group == kAwake) return;
  for (std::size_t i = 0; i < group_.size(); ++i) {
    if (group_[i] == group) group_[i] = kAwake, quiet_[i] = 0;
  }
}

void Sleep::fall_asleep(std::span<const BodyProperties> bodies, std::span<BodyState> states,
                        const Islands& islands, const SleepOptions& options, double dt) {
  for (std::size_t island = 0; island < islands.size(); ++island) {
    const auto members = islands.bodies_of(island);
    bool all = !islands.contacts_of(island).empty();  // what flies does not sleep
    for (const std::uint32_t i : members) {
      const double speed = states[i].velocity.norm() + bodies[i].radius * states[i].angular_velocity.norm();
      quiet_[i] = speed <= options.speed ? quiet_[i] + dt : 0;
      all = all && quiet_[i] >= options.delay;
    }
    if (!all) continue;
    for (const std::uint32_t i : members) {
      group_[i] = members.front();
      states[i].velocity.setZero();
      states[i].angular_velocity.setZero();
    }
  }
}

std::size_t Sleep::count() const {
  return group_.size() - static_cast<std::size_t>(std::count(group_.begin(), group_.end(), kAwake));
}

void Sleep::restore(std::vector<double> quiet, std::vector<std::uint32_t> groups) {
  quiet_ = std::move(quiet);
  group_ = std::move(groups);
}

}  // namespace tandem::simulation
