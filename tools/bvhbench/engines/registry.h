#pragma once
#include <memory>
#include <string_view>
#include <vector>

#include "engine.h"
#include "gpu_distances.h"
#include "gpu_impacts.h"
#include "gpu_tolerance.h"

namespace tandem {

/// The engines that a simulator can use, built in or not: tandem, tandem-cuda, paper, paper-bits, fcl,
/// embree, embree-refit.
std::vector<std::string_view> engine_names();

/// Whether this program has the engine.
bool is_built_in(std::string_view name);

/// `options`: the mode; and, for Tandem, the rest. Throws std::runtime_error: no engine of this name, one
/// that is not built in, without a usable GPU, or one that has no such mode.
std::unique_ptr<Engine> make_engine(std::string_view name, const ContactOptions& options = {});

/// What finds distances on the GPU, see gpu_distances.h; null where this program was built without CUDA.
DistancesOnGpu* distances_on_gpu();
/// What finds impacts on the GPU, see gpu_impacts.h; null where this program was built without CUDA.
ImpactsOnGpu* impacts_on_gpu();
/// What comes to verdicts on the GPU, see gpu_tolerance.h; null where this program was built without CUDA.
VerdictsOnGpu* verdicts_on_gpu();

/// The libraries that `bvhbench compare` runs, of those built in, in the order of the charts.
std::vector<std::string_view> peer_names();

/// The engines of a library, one for each mode worth comparing. Condition: `peer` is one of peer_names().
std::vector<std::unique_ptr<Engine>> make_peers(std::string_view peer);

}  // namespace tandem
