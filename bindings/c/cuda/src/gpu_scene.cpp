#include "tandem/tandem_cuda.h"

// This function has a file of its own, because it needs the scenes of libtandem.so, which the Python
// extension does not link.
tandem_status tandem_gpu_scene_create(const tandem_allocator* allocator, tandem_scene** scene) {
  tandem_device* device = nullptr;
  const tandem_status status = tandem_gpu_device_create(allocator, &device);
  if (status == TANDEM_OK) return tandem_scene_create_on(device, allocator, scene);
  if (scene != nullptr) *scene = nullptr;
  return status;
}
