// Compares all that a step finds in random scenes of given meshes, byte by byte: on the CPU by several
// numbers of threads, and on the GPU. Usage: gpu_random_scenes FIRST_SEED SCENES MESH.bvh...   Prints a row
// of CSV for each scene. Exit code: 0; 1 where something differs, or a CPU's result is unsound; 77 where
// there is no GPU and the CPU's results are the same.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <string>

#include "gpu_detection.h"
#include "tandem/runtime/map.h"

namespace tandem::test {
namespace {

constexpr std::uint32_t kThreads[] = {1, 2, 7, 16};

/// Sums over the steps of a scene.
struct Row {
  std::size_t pairs = 0, contacts = 0, manifolds = 0, points = 0, found_again = 0, contained = 0;
  std::string defect, by_threads, on_gpu;  // the first of each, and in which step

  void add(const Detected& found) {
    pairs += found.pairs.size(), contacts += found.contacts.size(), manifolds += found.manifolds.size();
    points += found.points.size(), contained += found.contained.size();
    found_again += points_found_again(found);
  }
};

void note(std::string& first, const std::string& found, std::size_t step) {
  if (first.empty() && !found.empty()) first = "step " + std::to_string(step) + ": " + found;
}

Row compare(std::span<const AssetView> meshes, const RandomScene& scene, bool has_gpu) {
  std::vector<CpuDetection> cpu;
  for (const std::uint32_t threads : kThreads) cpu.emplace_back(meshes, threads);
  const auto gpu = has_gpu ? std::make_unique<GpuDetection>(meshes) : nullptr;
  Row row;
  Detected before;
  for (std::size_t i = 0; i < scene.steps.size(); ++i) {
    const auto& instances = scene.steps[i];
    const Detected found = cpu[0].step(instances);
    note(row.defect, first_defect(instances, found, before), i);
    for (std::size_t k = 1; k < cpu.size(); ++k)
      note(row.by_threads, first_difference(found, cpu[k].step(instances)), i);
    if (gpu != nullptr) note(row.on_gpu, first_difference(found, gpu->step(instances)), i);
    row.add(found);
    before = found;
  }
  return row;
}

const char* verdict(const std::string& difference) {
  return difference.empty() ? "yes" : difference.c_str();
}

int run(std::uint64_t first_seed, std::uint64_t scenes, std::span<char*> paths) {
  std::vector<MappedAsset> files(paths.size());
  std::vector<AssetView> meshes;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    require(files[i].open(paths[i]), paths[i]);
    meshes.push_back(files[i].view());
  }
  int devices = 0;
  const bool has_gpu = cudaGetDeviceCount(&devices) == cudaSuccess && devices > 0;
  bool same = true;
  std::puts(
      "seed,kind,bodies,pairs,contacts,manifolds,points,found_again,contained,sound,same_by_threads,same_on_"
      "gpu");
  for (std::uint64_t seed = first_seed; seed < first_seed + scenes; ++seed) {
    const RandomScene scene = random_scene(meshes, seed);
    const Row row = compare(meshes, scene, has_gpu);
    same = same && row.defect.empty() && row.by_threads.empty() && row.on_gpu.empty();
    std::printf("%llu,%s,%zu,%zu,%zu,%zu,%zu,%zu,%zu,%s,%s,%s\n", static_cast<unsigned long long>(seed),
                scene.kind, scene.steps[0].size(), row.pairs, row.contacts, row.manifolds, row.points,
                row.found_again, row.contained, verdict(row.defect), verdict(row.by_threads),
                has_gpu ? verdict(row.on_gpu) : "");
    std::fflush(stdout);
  }
  if (!same) return 1;
  return has_gpu ? 0 : 77;
}

}  // namespace
}  // namespace tandem::test

int main(int argc, char** argv) {
  if (argc < 4) return std::puts("usage: gpu_random_scenes FIRST_SEED SCENES MESH.bvh..."), 1;
  try {
    return tandem::test::run(std::strtoull(argv[1], nullptr, 10), std::strtoull(argv[2], nullptr, 10),
                             {argv + 3, argv + argc});
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "gpu_random_scenes: %s\n", error.what()), 1;
  }
}
