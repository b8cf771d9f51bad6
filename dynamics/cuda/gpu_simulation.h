#pragma once
#include <cuda_runtime_api.h>

#include <cstdint>
#include <memory>
#include <span>

#include "dynamics/simulation.h"
#include "tandem/kernels/pair_filter.h"

namespace tandem::dynamics {

/// A GPU refused something. QueryFailed tells what is wrong with assets or bodies.
struct GpuFailed {
  Status status;
  cudaError_t error;  ///< cudaErrorUnknown where it is not known
};

/// Simulation on the current GPU, by the rules of GpuWorld: contacts stay there, and states
/// are copied from it once a step. Functions throw QueryFailed, GpuFailed or std::bad_alloc.
class GpuSimulation {
 public:
  /// filter: its motions are not looked at. is_continuous: fast bodies are limited, by the CPU. What the
  /// assets look at, and the filter, must outlive this.
  GpuSimulation(std::span<const AssetView> assets, std::span<const BodyProperties> bodies,
                std::span<const BodyState> states, const PairFilter& filter, const SimulationOptions& options,
                bool is_continuous);
  ~GpuSimulation();

  /// Makes a step. Of what was found the record has pairs of triangles, patches and contacts; of time that of
  /// the whole step.
  StepRecord step();

  std::span<const BodyProperties> bodies() const;
  std::span<const BodyState> states() const;

  /// See Simulation.
  void place(std::uint32_t body, const BodyState& state);
  SimulationState save();
  void restore(const SimulationState& state);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace tandem::dynamics
