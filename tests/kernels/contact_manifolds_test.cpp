#include "manifold_scene.h"

namespace tandem::test {
namespace {
TEST(ContactManifolds, Nothing) { ContactManifolds m; EXPECT_TRUE(m.manifolds().empty()); }
}  // namespace
}  // namespace tandem::test
