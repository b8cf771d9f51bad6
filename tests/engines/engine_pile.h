#pragma once
#include <algorithm>

#include "bvhbench/engines/registry.h"
#include "simulator/contact_scene.h"

namespace tandem::test {

/// Dumb-bells in a heap over a sheet, in successive steps.
struct Pile {
  SampleAssets assets;
  std::vector<Instance> bodies;
  RandomPoses random{11};

  explicit Pile(int count = 60) {
    assets.add(sheet(8, 20));
    assets.add(joined(sphere(0.4, 3), moved(sphere(0.3, 3), 0.6f, 0, 0)));
    bodies.push_back({0, kIdentityPose});
    for (int i = 0; i < count; ++i) {
      bodies.push_back({1, to_pose(at(random.symmetric(2), random.symmetric(2), random.uniform(-0.3, 1.5)) *
                                   random_motion(random, 0))});
    }
  }
  void step() {
    for (std::size_t i = 1; i < bodies.size(); ++i) {
      for (double& x : bodies[i].pose.translation) x += random.symmetric(0.05);
    }
  }
  /// Two of three bodies do not move.
  std::vector<std::uint8_t> idle() const {
    std::vector<std::uint8_t> idle(bodies.size());
    for (std::size_t i = 0; i < idle.size(); ++i) idle[i] = i % 3 != 1;
    return idle;
  }
};

inline ContactList found_by(Engine& engine, const Pile& pile, std::span<const std::uint8_t> idle = {}) {
  ContactList list;
  engine.find(pile.bodies, idle, list);
  return list;
}

inline bool same(const ContactList& x, const ContactList& y) {
  return x.triangles == y.triangles &&
         std::equal(x.pairs.begin(), x.pairs.end(), y.pairs.begin(), y.pairs.end(),
                    [](const ObjectPair& p, const ObjectPair& q) { return p.a == q.a && p.b == q.b; });
}

}  // namespace tandem::test
