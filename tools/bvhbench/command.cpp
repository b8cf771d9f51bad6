#include "command.h"

#include <algorithm>
#include <cstdio>
#include <thread>

#include "bvhbench/engines/registry.h"
#include "bvhbench/scenes/hdf5_file.h"
#include "bvhbench/scenes/make_scene.h"

namespace tandem::bench {
namespace {

std::string backend_defect(const std::string& word) {
  if (word == "cpu" || (has_cuda() && word == "cuda")) return {};
  return word == "cuda" ? "this bvhbench was built without CUDA, so it has no GPU"
                        : word + " is neither cpu nor cuda";
}

// Ends the command where the GPU refused a scene or cannot be used.
[[noreturn]] void refuse_gpu(const std::string& scene, const GpuError& error) {
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

}  // namespace

bool has_cuda() {
  return is_built_in("tandem-cuda");
}

std::uint32_t CommonArguments::threads() const {
  return told_threads.value_or(std::clamp(std::thread::hardware_concurrency(), 1u, kMostSceneThreads));
}

OptionRow scene_argument(CommonArguments& arguments, const std::string& what) {
  return required({"SCENE", arguments.scene, "", what, file_name()});
}

OptionRow backend_option(CommonArguments& arguments) {
  return {"--backend", arguments.backend, has_cuda() ? "cpu|cuda [cpu]" : "cpu [cpu]", "what it runs on",
          backend_defect};
}

OptionRow threads_option(CommonArguments& arguments, const std::string& what) {
  return {"--threads", arguments.told_threads, "N [all]", "threads; " + what + " not depend on them",
          between(1, kMostSceneThreads)};
}

OptionRow repeat_option(CommonArguments& arguments, const std::string& what) {
  return {"--repeat", arguments.repeats, "N [" + std::to_string(arguments.repeats) + "]",
          "times to run " + what + ", for its timing", between(1, 1000000)};
}

OptionRow output_option(CommonArguments& arguments, const std::string& what, const char* name) {
  return {name, arguments.output, "", what, file_name()};
}

OptionRow json_option(CommonArguments& arguments, const std::string& what) {
  return {"--json", arguments.json, "print " + what + " as JSON"};
}

OptionRow mesh_option(std::string& mesh) {
  return required({"--mesh", mesh, "", ".bvh file of the bodies", file_name()});
}

OptionRow ground_option(std::string& ground, const std::string& what) {
  return required({"--ground", ground, "", ".bvh file of the " + what, file_name()});
}

OptionRow count_option(std::uint32_t& count, std::uint32_t usual) {
  count = usual;
  return {"--count", count, "N [" + std::to_string(usual) + "]", "how many", between(1, 10'000'000)};
}

OptionRow seed_option(std::uint64_t& seed, const std::string& what) {
  return {"--seed", seed, "N [1]", what, between(0, 1.8e19)};
}

void print(const CommonArguments& arguments, const Report& report) {
  std::fputs(report.words(arguments.json).c_str(), stdout);
}

void check_output(const CommonArguments& arguments, const std::vector<std::string>& inputs) {
  if (arguments.output.empty()) return;
  keep_inputs(arguments.output, inputs);
  try_output(arguments.output);
}

void refuse(const std::string& scene, Status status, std::uint64_t where) {
  const char* unit = subject(status);
  const std::string blamed = unit == nullptr ? "" : std::string(unit) + " " + std::to_string(where) + ": ";
  const std::string text = scene + ": " + blamed + explain(status);
  if (status == Status::kCannotStartThread) throw std::runtime_error(text);
  throw FileError(text);
}

void refuse_engine(const std::string& path, const LoadedScene& scene) {
  try {
    throw;
  } catch (const EngineError& error) {
    if (error.status == Status::kNoTopology)
      throw FileError(path + ": " + scene.name_of(error.where) + ": " + explain(error.status));
    refuse(path, error.status, error.where);
  } catch (const GpuError& error) {
    refuse_gpu(path, error);
  }
}

std::vector<std::string> files_of(const std::string& path, const LoadedScene& scene) {
  std::vector<std::string> files = {path};
  for (const std::string& asset : scene.description.assets) files.push_back(beside(path, asset));
  return files;
}

std::uint64_t triangles_of(const LoadedScene& scene) {
  std::uint64_t triangles = 0;
  for (const Instance& instance : scene.description.instances) {
    triangles += scene.view(instance.asset).level().triangle_count;
  }
  return triangles;
}

std::string cube_defect(const std::string& text) {
  const double count = number_in(text).value_or(0);
  if (!(count >= 1 && count <= 1e9)) return {};  // told by its type and by the option's own limits
  const std::uint32_t side = root_above(static_cast<std::uint32_t>(count), 3);
  if (side * side * side == count) return {};
  return text + " is no cube of a whole number; " + std::to_string((side - 1) * (side - 1) * (side - 1)) +
         " and " + std::to_string(side * side * side) + " are";
}

}  // namespace tandem::bench
