#pragma once
#include <algorithm>
#include <cmath>

#include "dynamics/contact_point.h"
#include "tandem/dynamics/world.h"

/// How hard two bodies touch: rules for host and device. See Touches.
namespace tandem::dynamics {

/// Sums up what the contacts of one pair do together in a step.
class PairTouch {
 public:
  TANDEM_HD explicit PairTouch(const ObjectPair& pair) : touch_{pair.a, pair.b, 0, 0, {}} {}

  /// impulse: along the normal. approach: how fast the contact closes at the step's start.
  TANDEM_HD void add(const ContactPoint& contact, double impulse, double approach) {
    touches_ = touches_ || contact.depth >= 0 || impulse > 0;
    touch_.impulse += impulse;
    touch_.speed = std::max(touch_.speed, approach);
    if (impulse < most_impulse_ || (impulse == most_impulse_ && !(contact.depth > its_depth_))) return;
    most_impulse_ = impulse, its_depth_ = contact.depth;
    for (int k = 0; k < 3; ++k) touch_.position[k] = at(contact.position, k);
  }

  /// Returns whether the pair touches: a contact is no gap, or pushes.
  TANDEM_HD bool touches() const { return touches_; }
  TANDEM_HD const WorldTouch& touch() const { return touch_; }

 private:
  WorldTouch touch_;
  bool touches_ = false;
  double most_impulse_ = -INFINITY, its_depth_ = 0;  // of the hardest contact
};

/// Lets a pair that began to touch have the numbers of the step in which it pushed hardest, and the largest
/// speed. now: those of another step. Touch: has the members of WorldTouch.
template <typename Touch>
TANDEM_HD void take_hardest(Touch& touch, const Touch& now) {
  const double speed = std::max(touch.speed, now.speed);
  if (now.impulse > touch.impulse) touch = now;
  touch.speed = speed;
}

}  // namespace tandem::dynamics
