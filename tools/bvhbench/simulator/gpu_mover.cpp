#include "body_mover.h"
#include "bvhbench/engines/gpu_engine.h"
#include "dynamics/cuda/gpu_simulation.h"

namespace tandem::simulation {
namespace {

struct CallOnGpu {
  template <typename Call>
  static auto of(const Call& call) {
    try {
      return call();
    } catch (const GpuFailed& failed) {
      throw gpu_error("--backend cuda", failed.status, failed.error, "bodies that move");
    }
  }
};

}  // namespace

std::unique_ptr<BodyMover> make_gpu_mover(std::span<const AssetView> shapes,
                                          std::span<const BodyProperties> bodies,
                                          std::span<const BodyState> states, const PairFilter& filter,
                                          const SimulatorOptions& options, bool continuous) {
  return std::make_unique<MovesBy<GpuSimulation, CallOnGpu>>(shapes, bodies, states, filter,
                                                             options_of(options), continuous);
}

}  // namespace tandem::simulation
