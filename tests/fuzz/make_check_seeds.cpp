// Writes small sound files for the fuzzer of the checker to start from: make_check_seeds FOLDER
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "build/sample_asset.h"

namespace {

using namespace tandem;

bool write(const std::filesystem::path& path, const build::Image& image) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(image.data()), static_cast<std::streamsize>(image.size()));
  return static_cast<bool>(file.flush());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 1;
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  for (const std::uint32_t triangles : {1u, 4u, 5u, 16u, 27u}) {
    for (const auto imaginary : {build::Imaginary::minimal, build::Imaginary::free}) {
      const build::Image image = test::make_file(test::random_mesh(triangles, triangles), imaginary);
      const char* kind = imaginary == build::Imaginary::minimal ? "_minimal" : "_free";
      if (!write(folder / (std::to_string(triangles) + kind), image)) return 1;
    }
  }
  for (const std::uint32_t levels : {2u, 3u}) {
    const build::Image image = test::make_file_of_levels(test::random_levels(5, levels, levels));
    if (!write(folder / (std::to_string(levels) + "_levels"), image)) return 1;
  }
  return 0;
}
