#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "dynamics/contact_point.h"
#include "tandem/kernels/object_pair.h"

namespace tandem::dynamics {

/// Bodies that push each other through contacts and joints, and those. Islands share no dynamic body, so they
/// can be solved side by side.
struct Islands {
  std::vector<std::uint32_t> bodies, body_begin;  ///< island i: bodies[body_begin[i]] ... [body_begin[i + 1])
  std::vector<std::uint32_t> contacts, contact_begin;  ///< the same of contacts
  std::vector<std::uint32_t> joints, joint_begin;      ///< and of joints

  std::size_t size() const { return body_begin.empty() ? 0 : body_begin.size() - 1; }
  std::span<const std::uint32_t> bodies_of(std::size_t island) const {
    return {bodies.data() + body_begin[island], body_begin[island + 1] - body_begin[island]};
  }
  std::span<const std::uint32_t> contacts_of(std::size_t island) const {
    return {contacts.data() + contact_begin[island], contact_begin[island + 1] - contact_begin[island]};
  }
  std::span<const std::uint32_t> joints_of(std::size_t island) const {
    return {joints.data() + joint_begin[island], joint_begin[island + 1] - joint_begin[island]};
  }
  bool flies(std::size_t island) const { return contacts_of(island).empty() && joints_of(island).empty(); }
};

/// Every dynamic body is in one island, those without contacts and joints alone. Bodies, contacts, joints and
/// islands (by their first body) come in ascending order. Contacts and joints between bodies that nothing can
/// move are in none. joined: the bodies of each joint; kNoIndex is the world.
Islands find_islands(std::span<const BodyProperties> bodies, std::span<const ContactPoint> contacts,
                     std::span<const ObjectPair> joined = {});

/// Returns for each body the fewest contacts and joints between it and one that nothing can move: 0 for such
/// a body, and the largest number for a body that hangs on none.
std::vector<std::uint32_t> find_layers(std::span<const BodyProperties> bodies,
                                       std::span<const ContactPoint> contacts,
                                       std::span<const ObjectPair> joined = {});

struct SleepOptions {
  bool enabled = false;
  double speed = 0.01;  ///< a body is quiet while no point of it is faster
  double delay = 0.5;   ///< seconds that all of an island must have been quiet
};

/// Decides which bodies sleep. An island falls asleep as a whole, and wakes as a whole in the step after a
/// body that is awake has touched it or been joined to it; until then it is like a fixed one.
class Sleep {
 public:
  static constexpr std::uint32_t kAwake = 0xFFFFFFFFu;

  /// Begins with all bodies awake.
  void start(std::size_t bodies);

  /// Bodies that are woken by contacts with bodies that are awake, and by joints with them: to be called with
  /// the contacts of each step, at its end. Clears the mark of sleep of their groups.
  void wake_touched(std::span<const BodyProperties> bodies, std::span<const ContactPoint> contacts,
                    std::span<const ObjectPair> joined = {});

  /// Wakes a body and its group.
  void wake(std::uint32_t body);

  /// Counts how long bodies have been quiet, and lets islands fall asleep: their velocities become 0. driven:
  /// for each joint whether a motor moves it, which keeps its island awake.
  void fall_asleep(std::span<const BodyProperties> bodies, std::span<BodyState> states,
                   const Islands& islands, const SleepOptions& options, double dt,
                   std::span<const std::uint8_t> driven = {});

  bool sleeps(std::uint32_t body) const { return group_[body] != kAwake; }
  std::size_t count() const;

  /// Returns how long each body has been quiet, to be kept and given back.
  std::span<const double> quiet() const { return quiet_; }
  std::span<const std::uint32_t> groups() const { return group_; }
  void restore(std::vector<double> quiet, std::vector<std::uint32_t> groups);

 private:
  std::vector<double> quiet_;         // seconds
  std::vector<std::uint32_t> group_;  // those that fell asleep together, by the first of them
};

}  // namespace tandem::dynamics
