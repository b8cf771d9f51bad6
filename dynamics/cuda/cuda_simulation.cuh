#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "dynamics/cuda/cuda_executor.cuh"
#include "dynamics/cuda/cuda_questions.cuh"
#include "dynamics/cuda/parallel_newton_step.cuh"
#include "dynamics/parallel/parallel_simulation.h"
#include "tandem/kernels/scene.h"
#include "tandem/runtime/upload.h"

namespace tandem::dynamics {

/// A filter of bodies, on the GPU.
class GpuFilter {
 public:
  /// Copies those arrays of a filter that there are, an element for each body, but neither motions nor
  /// excluded pairs. Waits for the GPU.
  Status upload(const PairFilter& filter, std::size_t bodies, CudaExecutor& executor) {
    Status status = Status::kOk;
    on_gpu_ = {nullptr, filter.group, filter.mask, filter.world, {}};
    for (const auto& [of_body, array] :
         {std::pair(&on_gpu_.group, &group_), {&on_gpu_.mask, &mask_}, {&on_gpu_.world, &world_}}) {
      if (status != Status::kOk || *of_body == nullptr) continue;
      status = status_of(array->upload({*of_body, bodies}, executor.stream()));
      *of_body = array->data();
    }
    return status == Status::kOk ? executor.wait() : status;
  }

  /// Copies the excluded pairs, and waits for the GPU.
  Status exclude(const ExcludedPairs& pairs, CudaExecutor& executor) {
    Status status = excluded_.upload(pairs, executor.stream());
    if (status == Status::kOk) status = executor.wait();
    on_gpu_.excluded = excluded_.view();
    return status;
  }

  const PairFilter& view() const { return on_gpu_; }
  std::size_t bytes() const { return group_.bytes() + mask_.bytes() + world_.bytes() + excluded_.bytes(); }
  cudaError_t error() const { return excluded_.cuda_error(); }

 private:
  GpuArray<std::uint32_t> group_, mask_, world_;
  GpuExcludedPairs excluded_;
  PairFilter on_gpu_;
};

/// A parallel simulation on a GPU, and what it looks at there.
class CudaSimulation {
 public:
  using Simulation = ParallelSimulation<CudaExecutor, CudaQuestions>;

  CudaSimulation() = default;
  CudaSimulation(const CudaSimulation&) = delete;
  CudaSimulation& operator=(const CudaSimulation&) = delete;
  ~CudaSimulation() {
    if (own_stream_ != nullptr) static_cast<void>(cudaStreamDestroy(own_stream_));
  }

  /// Copies assets to the GPU; there are no bodies then. Result: as of GpuWorld::set_assets(), and `where` is
  /// the asset. Throws std::bad_alloc.
  Status set_assets(std::span<const AssetView> assets, cudaStream_t stream, std::uint64_t& where) {
    simulation.reset();
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

  /// Places all bodies anew. Condition: questions have their filter. Throws std::bad_alloc.
  Status set_bodies(std::span<const BodyProperties> properties, std::span<const BodyState> states,
                    std::span<const Joint> joints, const ParallelOptions& options) {
    simulation.emplace(executor, questions);
    return simulation->set_bodies({properties, states, inner_radii_, boxes_, joints}, options);
  }

  /// Returns the bytes of GPU memory held, but for assets and the filter.
  std::size_t bytes() const {
    return executor.bytes() + questions.bytes() + (simulation.has_value() ? simulation->bytes() : 0);
  }

  /// Returns the first error of a call of CUDA; cudaSuccess where none is known.
  cudaError_t error() const {
    for (const cudaError_t error : {files_.cuda_error(), executor.error(), questions.error()}) {
      if (error != cudaSuccess) return error;
    }
    return cudaSuccess;
  }

  CudaExecutor executor;
  CudaQuestions questions{executor};
  std::optional<Simulation> simulation;  ///< none without bodies

 private:
  DeviceAssets files_;
  std::vector<double> inner_radii_;
  std::vector<AssetBox> boxes_;
  cudaStream_t own_stream_ = nullptr;
};

}  // namespace tandem::dynamics
