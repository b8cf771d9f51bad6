#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "dynamics/falling_bodies.h"

namespace tandem::test {

/// A floor, and boxes of 40 x 30 x 20 cm, some of them joined.
struct JoinedBoxes : FallingBodies {
  JoinedBoxes() : FallingBodies(1) {}

  std::uint32_t add(double x, double y, double z) {
    BodyDescription& body = descriptions.emplace_back();
    body.asset = 3, body.pose = shift(x, y, z);
    return static_cast<std::uint32_t>(descriptions.size() - 1);
  }
  JointDescription& join(JointKind kind, std::uint32_t a, std::uint32_t b, const double (&anchor)[3]) {
    JointDescription& joint = joints.emplace_back();
    joint.kind = kind, joint.a = a, joint.b = b;
    std::ranges::copy(anchor, joint.anchor), std::ranges::copy(anchor, joint.anchor_b);
    return joint;
  }

  std::vector<JointDescription> joints;
};

/// Pairs of boxes that fall in a heap, of any kind of joint, some with limits and motors, or that break.
inline JoinedBoxes heap_of_pairs() {
  JoinedBoxes heap;
  for (int i = 0; i < 15; ++i) {
    const double x = 0.5 * (i % 3), z = 0.4 + 0.5 * (i / 3), at[3] = {x, 0.17, z};
    const std::uint32_t a = heap.add(x, 0, z), b = heap.add(x, 0.34, z);
    JointDescription& joint = heap.join(static_cast<JointKind>(i % 5), a, b, at);
    if (joint.kind == JointKind::distance) joint.anchor[1] = 0, joint.anchor_b[1] = 0.34, joint.most = 0.4;
    if (i % 2 == 0 && (joint.kind == JointKind::hinge || joint.kind == JointKind::slider))
      joint.least = -0.05, joint.most = 0.1;
    if (i % 3 == 0 && (joint.kind == JointKind::hinge || joint.kind == JointKind::slider))
      joint.speed = 2, joint.most_effort = 20;
    if (i % 4 == 0) joint.breaking_force = 2000;
    joint.may_touch = i % 2 == 1;
  }
  return heap;
}

}  // namespace tandem::test
