#include "gpu/gpu_scene_fixture.h"
#include "kernels/configuration/configuration_tests.h"
#include "tandem/kernels/gpu_scene.h"

namespace tandem {

template <>
bool can_be_made<GpuScene>() {
  return !test::no_gpu();
}

INSTANTIATE_TYPED_TEST_SUITE_P(Gpu, ConfigurationsOn, testing::Types<GpuScene>);

}  // namespace tandem
