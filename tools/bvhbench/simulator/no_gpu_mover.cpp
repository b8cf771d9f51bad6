#include <stdexcept>

#include "body_mover.h"

namespace tandem::simulation {

// The command line has refused it.
std::unique_ptr<BodyMover> make_gpu_mover(std::span<const AssetView>, std::span<const BodyProperties>,
                                          std::span<const BodyState>, const PairFilter&,
                                          const SimulatorOptions&, bool) {
  throw std::logic_error("built without CUDA");
}

}  // namespace tandem::simulation
