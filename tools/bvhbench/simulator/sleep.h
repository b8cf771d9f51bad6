#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "contact_point.h"
#include "islands.h"
#include "rigid_body.h"

namespace tandem::simulation {

struct SleepOptions {
  bool enabled = false;
  double speed = 0.01;  ///< a body is quiet while no point of it is faster
  double delay = 0.5;   ///< seconds that all of an island must have been quiet
};

/// Which bodies sleep. An island falls asleep as a whole, and wakes as a whole in the step after a body that
/// is awake has touched it; until then it is like a fixed one.
class Sleep {
 public:
  static constexpr std::uint32_t kAwake = 0xFFFFFFFFu;

  /// All bodies are awake.
  void start(std::size_t bodies);

  /// Bodies that are woken by contacts with bodies that are awake: to be called with the contacts of each
  /// step, at its end. Clears the mark of sleep of their groups.
  void wake_touched(std::span<const BodyProperties> bodies, std::span<const ContactPoint> contacts);

  /// Wakes a body and its group.
  void wake(std::uint32_t body);

  /// Counts how long bodies have been quiet, and lets islands fall asleep: their velocities become 0.
  void fall_asleep(std::span<const BodyProperties> bodies, std::span<BodyState> states,
                   const Islands& islands, const SleepOptions& options, double dt);

  bool sleeps(std::uint32_t body) const { return group_[body] != kAwake; }
  std::size_t count() const;

  /// For each body, to be kept and given back.
  std::span<const double> quiet() const { return quiet_; }
  std::span<const std::uint32_t> groups() const { return group_; }
  void restore(std::vector<double> quiet, std::vector<std::uint32_t> groups);

 private:
  std::vector<double> quiet_;         // seconds
  std::vector<std::uint32_t> group_;  // those that fell asleep together, by the first of them
};

}  // namespace tandem::simulation
