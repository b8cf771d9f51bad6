#include "tandem/kernels/gpu_scene.h"

#include "gpu/gpu_scene_fixture.h"
#include "kernels/scene/scene_tests.h"

namespace tandem {

template <>
bool is_usable<GpuScene>() {
  return !test::no_gpu();
}

INSTANTIATE_TYPED_TEST_SUITE_P(Gpu, SceneOn, testing::Types<GpuScene>);

}  // namespace tandem
