#include <tandem/tandem_cuda.h>

#include "contract/doors.h"
#include "tandem/kernels/gpu_scene.h"

namespace tandem::test {

std::vector<NamedDoor> doors() {
  return {{"gpu", "cpp", [] { return cpp_door(std::make_shared<GpuScene>()); }},
          {"c_gpu", "c", [] { return c_door(tandem_gpu_scene_create); }}};
}

bool doors_are_usable() {
  GpuScene scene;
  return scene.set_assets({}) == Status::kOk;
}

}  // namespace tandem::test
