#pragma once
#include <cuda_runtime_api.h>

#include "kernels/common/component_labels.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/topology.h"
#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/gpu_arrays.h"

namespace tandem::gpu {

/// Downloads the components of an asset that has topology, and writes the labels of its triangles
/// (label_triangles()) to CPU memory. host: keeps CUDA's errors. Result: kOk, kOutOfMemory or CUDA's.
template <typename Host>
Status label_surface(const GpuAsset& asset, std::uint32_t* labels, bool& any_closed, Host& host,
                     cudaStream_t stream) {
  LevelView level = asset.tree;
  Buffer<TriangleTopology> topology;
  Buffer<SurfaceComponent> components;
  if (!topology.resize(level.triangle_count) || !components.resize(level.component_count))
    return Status::kOutOfMemory;
  Status status =
      host.keep(download<TriangleTopology>(level.topology, {topology.data(), topology.size()}, stream));
  if (status == Status::kOk)
    status = host.keep(
        download<SurfaceComponent>(level.components, {components.data(), components.size()}, stream));
  if (status != Status::kOk) return status;
  level.topology = topology.data(), level.components = components.data();
  any_closed = false;
  for (const SurfaceComponent& component : components.view()) any_closed = any_closed || is_closed(component);
  return containment::label_triangles(level, labels) ? Status::kOk : Status::kOutOfMemory;
}

}  // namespace tandem::gpu
