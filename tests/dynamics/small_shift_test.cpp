#include <gtest/gtest.h>

#include "dynamics/falling_bodies.h"
#include "tandem/dynamics/world.h"

/// What a shift of all bodies that is too small to matter does to their motion.
namespace tandem::test {
namespace {

// Each island is solved by Newton's method or by the soft step. If rounding decided which, two worlds would
// part at once: by up to 1.6 m/s and rad/s within these steps.
TEST(World, AShiftTooSmallToMatterDoesNotMatter) {
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    FallingBodies bodies(24, seed);
    World worlds[2];
    for (World& world : worlds) {
      ASSERT_EQ(world.set_assets(bodies.assets.views()), Status::kOk);
      ASSERT_EQ(world.set_bodies(bodies.descriptions), Status::kOk);
      for (std::size_t i = 1; i < bodies.descriptions.size(); ++i) {
        for (double& x : bodies.descriptions[i].pose.translation) x += 1e-10 * static_cast<double>(i % 5);
      }
      ASSERT_EQ(world.step(1.0 / 60, 20), Status::kOk);
    }
    for (std::size_t i = 0; i < bodies.descriptions.size(); ++i) {
      const BodyMotion &p = worlds[0].bodies()[i], &q = worlds[1].bodies()[i];
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(p.velocity[k], q.velocity[k], 1e-4) << i;
        EXPECT_NEAR(p.angular_velocity[k], q.angular_velocity[k], 1e-4) << i;
      }
    }
  }
}

}  // namespace
}  // namespace tandem::test
