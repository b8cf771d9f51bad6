#include "backend.h"

#include "bvhbench/engines/registry.h"

namespace tandem::bench {
namespace {

CLI::Validator backend_name() {
  const auto defect = [](const std::string& word) -> std::string {
    if (word == "cpu" || (has_cuda() && word == "cuda")) return {};
    return word == "cuda" ? "this bvhbench was built without CUDA, so it has no GPU"
                          : word + " is neither cpu nor cuda";
  };
  return CLI::Validator(defect, "");
}

}  // namespace

bool has_cuda() {
  return is_built_in("tandem-cuda");
}

void add_backend(CLI::App& command, std::string& backend) {
  command.add_option("--backend", backend, "what the query runs on")
      ->check(backend_name())
      ->option_text(has_cuda() ? "cpu|cuda [cpu]" : "cpu [cpu]");
}

void refuse_gpu(const std::string& scene, const GpuError& error) {
  const std::string why = explain(error.status);
  switch (error.status) {
    case Status::kTooManyPairs:
      refuse(scene, error.status, 0);
    case Status::kOutOfGpuMemory:
      throw GpuError("--backend cuda: " + error.step + ": " + why +
                     (error.reason.empty() ? "" : ": " + error.reason));
    case Status::kNoGpu:
    case Status::kDriverTooOld:
    case Status::kGpuNotSupported:
      throw GpuError("--backend cuda: " + why + ": " + error.reason);
    default:
      throw std::runtime_error("the GPU: " + error.step + ": " + error.reason);
  }
}

}  // namespace tandem::bench
