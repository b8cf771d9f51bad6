#include "kernels/scene/scene_tests.h"

namespace tandem {

INSTANTIATE_TYPED_TEST_SUITE_P(Cpu, SceneOn, testing::Types<Scene>);

}  // namespace tandem
