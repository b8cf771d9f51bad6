#pragma once
#include <string>

#include "bvhbench/engines/engine.h"
#include "command.h"

namespace tandem::bench {

/// Whether this program was built with CUDA.
bool has_cuda();

/// The option --backend: "cpu", or "cuda" where has_cuda().
void add_backend(CLI::App& command, std::string& backend);

/// Ends the command where the GPU refused a scene or cannot be used.
[[noreturn]] void refuse_gpu(const std::string& scene, const GpuError& error);

}  // namespace tandem::bench
