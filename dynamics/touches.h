#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "dynamics/contact_point.h"
#include "tandem/dynamics/world.h"

namespace tandem::dynamics {

/// Follows which pairs of bodies touch, step by step, and how hard. A pair touches in a step if at the step's
/// start it has a contact that is no gap, or if a contact of it pushes in the step. A pair of two idle
/// bodies, whose contacts nobody looks at, goes on as it was.
class Touches {
 public:
  /// Takes what a step did. approach: how fast each contact closes at the step's start. Conditions: contacts
  /// come by ascending pair, with an impulse and an approach each; idle is empty or has an entry for each
  /// body.
  void update(std::span<const ContactPoint> contacts, std::span<const ContactImpulse> impulses,
              std::span<const double> approach, std::span<const std::uint8_t> idle);

  /// Return the pairs that touch in the last step, and of these those that did not in the step before; and
  /// those that did then and do not any more. Ascending.
  std::span<const WorldTouch> touching() const { return touching_; }
  std::span<const WorldTouch> began() const { return began_; }
  std::span<const ObjectPair> ended() const { return ended_; }

  /// Goes on from pairs that touch; none has begun or ended.
  void restore(std::vector<WorldTouch> touching);

 private:
  std::vector<WorldTouch> touching_, before_, began_;
  std::vector<ObjectPair> ended_;
};

}  // namespace tandem::dynamics
