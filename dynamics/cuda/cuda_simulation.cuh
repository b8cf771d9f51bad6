#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "dynamics/cuda/cuda_executor.cuh"
#include "dynamics/cuda/cuda_questions.cuh"
#include "dynamics/parallel/parallel_simulation.h"
#include "tandem/kernels/excluded_pairs.h"
#include "tandem/kernels/scene.h"
#include "tandem/runtime/upload.h"

namespace tandem::dynamics {

/// Bodies as they enter a simulation on a GPU.
struct CudaBodies {
  std::span<const BodyProperties> properties;
  std::span<const BodyState> states;
  PairFilter filter;  ///< in the CPU's memory; its motions are not looked at
};

/// A parallel simulation on a GPU, and what it looks at there.
class CudaSimulation {
 public:
  CudaSimulation() = default;
  CudaSimulation(const CudaSimulation&) = delete;
  CudaSimulation& operator=(const CudaSimulation&) = delete;
  ~CudaSimulation() {
    if (own_stream_ != nullptr) static_cast<void>(cudaStreamDestroy(own_stream_));
  }

  /// Copies assets to the GPU; there are no bodies then. Result: as of GpuWorld::set_assets(), and `where` is
  /// the asset. Throws std::bad_alloc.
  Status set_assets(std::span<const AssetView> assets, cudaStream_t stream, std::uint64_t& where) {
    clear();
    inner_radii_.clear(), boxes_.clear(), where = 0;
    Scene scene;
    if (const Status status = scene.set_assets(assets); status != Status::kOk) {
      where = scene.where();
      return status;
    }
    // The default stream cannot be captured into a graph; one of its own waits for that, and it for this.
    if (stream == nullptr && own_stream_ == nullptr) {
      const Status status = status_of(cudaStreamCreate(&own_stream_));
      if (status != Status::kOk) return status;
    }
    stream = stream != nullptr ? stream : own_stream_;
    executor.set_stream(stream);
    if (const Status status = files_.upload(assets, Contents::all, stream); status != Status::kOk)
      return status;
    std::vector<GpuAsset> on_gpu;
    for (std::size_t i = 0; i < assets.size(); ++i) {
      const LevelView level = files_.level(i);
      where = i;
      if (level.oriented_blocks == nullptr) return Status::kNoOrientedBlocks;
      if (level.topology == nullptr) return Status::kNoTopology;
      on_gpu.push_back(gpu_asset(level, assets[i]));
      const FileHeader& header = *assets[i].header;
      boxes_.push_back(asset_box(header.lower, header.upper, header.origin));
    }
    where = 0;
    inner_radii_ = inner_radii(assets);
    return questions.set_assets(on_gpu);
  }

  /// Places all bodies anew. Throws std::bad_alloc.
  Status set_bodies(const CudaBodies& bodies, const ParallelOptions& options) {
    clear();
    PairFilter filter = bodies.filter;
    Status status = excluded_.upload(filter.excluded, executor.stream());
    for (const auto& [of_body, array] :
         {std::pair(&filter.group, &group_), {&filter.mask, &mask_}, {&filter.world, &world_}}) {
      if (status != Status::kOk || *of_body == nullptr) continue;
      status = status_of(array->upload({*of_body, bodies.properties.size()}, executor.stream()));
      *of_body = array->data();
    }
    if (status == Status::kOk) status = executor.wait();
    if (status != Status::kOk) return status;
    filter.motion = nullptr, filter.excluded = excluded_.view();
    questions.set_filter(filter);
    simulation.emplace(executor, questions);
    status = simulation->set_bodies({bodies.properties, bodies.states, inner_radii_, boxes_}, options);
    if (status != Status::kOk) clear();
    return status;
  }

  /// Removes all bodies.
  void clear() { simulation.reset(); }

  /// Returns the first error of a call of CUDA; cudaSuccess where none is known.
  cudaError_t error() const {
    for (const cudaError_t error :
         {files_.cuda_error(), excluded_.cuda_error(), executor.error(), questions.error()}) {
      if (error != cudaSuccess) return error;
    }
    return cudaSuccess;
  }

  CudaExecutor executor;
  CudaQuestions questions{executor};
  std::optional<ParallelSimulation<CudaExecutor, CudaQuestions>> simulation;  ///< none without bodies

 private:
  DeviceAssets files_;
  std::vector<double> inner_radii_;
  std::vector<AssetBox> boxes_;
  cudaStream_t own_stream_ = nullptr;
  GpuArray<std::uint32_t> group_, mask_, world_;
  GpuExcludedPairs excluded_;
};

}  // namespace tandem::dynamics
