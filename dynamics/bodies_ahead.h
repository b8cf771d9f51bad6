#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "dynamics/contact_point.h"
#include "tandem/kernels/object_pair.h"

namespace tandem::dynamics {

/// Bodies before a step, and what bounds how near they come to each other in it.
struct BodiesAhead {
  std::span<const BodyProperties> bodies;
  std::span<const BodyState> states;
  std::span<const std::uint8_t> idle;  ///< empty, or one for each body
  double dt;
  std::span<const Pull> pulls;  ///< of each body
  double slop;

  TANDEM_HD bool is_idle(std::uint32_t body) const { return !idle.empty() && idle[body] != 0; }

  /// Returns how far two bodies may fall towards each other along a unit vector: as far as contacts give one
  /// of them what gravity and forces give, and as much to the other.
  TANDEM_HD double fall_along(const ObjectPair& pair, const Vector3& direction) const {
    const Pull &a = pulls[pair.a], &b = pulls[pair.b];
    const double pull = std::max(std::fabs(dot(a.linear, direction)), std::fabs(dot(b.linear, direction)));
    return kFall * (pull + a.turning + b.turning) * dt * dt;
  }
  /// Returns how b may fall as seen from a while something holds one of them: the fall that leads further
  /// along a direction.
  TANDEM_HD Vector3 fall_towards(const ObjectPair& pair, const Vector3& direction) const {
    const Vector3 of_b = pulls[pair.b].linear, of_a = -pulls[pair.a].linear;
    return (kFall * dt * dt) * (dot(of_b, direction) > dot(of_a, direction) ? of_b : of_a);
  }
  TANDEM_HD double fall(const ObjectPair& pair) const { return std::max(fall(pair.a), fall(pair.b)); }
  TANDEM_HD double fall(std::uint32_t body) const { return kFall * pulls[body].most() * dt * dt; }

  /// Returns how fast points of a body move by its spin, at most.
  TANDEM_HD double turning(std::uint32_t body) const {
    return is_idle(body) ? 0 : bodies[body].radius * norm(states[body].angular_velocity);
  }
  TANDEM_HD double turning(const ObjectPair& pair) const { return turning(pair.a) + turning(pair.b); }

  /// Returns the velocity of b's centre as seen from a's.
  TANDEM_HD Vector3 approach(const ObjectPair& pair) const {
    return (is_idle(pair.b) ? Vector3{} : states[pair.b].velocity) -
           (is_idle(pair.a) ? Vector3{} : states[pair.a].velocity);
  }

  /// A length in which contacts are told well.
  TANDEM_HD double overlap() const { return 0.5 * slop; }

  /// Returns how fast the bodies approach each other at a contact, along its normal.
  TANDEM_HD double approach_at(const ContactPoint& contact) const {
    return dot(contact.normal, velocity_at(contact.body_a, contact) - velocity_at(contact.body_b, contact));
  }

  /// Returns whether a contact is a gap that the step will not close.
  TANDEM_HD bool is_far(const ContactPoint& contact) const {
    if (contact.depth >= -overlap()) return false;
    const double approach = approach_at(contact);
    return -contact.depth > dt * (approach > 0 ? approach : 0) +
                                fall_along({contact.body_a, contact.body_b}, contact.normal) + overlap();
  }

 private:
  static constexpr double kFall = 2;

  TANDEM_HD Vector3 velocity_at(std::uint32_t body, const ContactPoint& contact) const {
    if (is_idle(body)) return {};
    const BodyState& state = states[body];
    return state.velocity + cross(state.angular_velocity, arm_of(contact, state));
  }
};

}  // namespace tandem::dynamics
