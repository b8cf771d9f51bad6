// Writes small sound files for the fuzzer of the checker to start from: make_check_seeds FOLDER
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "build/sample_asset.h"

int main(int argc, char** argv) {
  using namespace tandem;
  if (argc != 2) return 1;
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  for (const std::uint32_t triangles : {1u, 4u, 5u, 16u, 27u}) {
    for (const auto imaginary : {build::Imaginary::minimal, build::Imaginary::free}) {
      const build::Image image = test::make_file(test::random_mesh(triangles, triangles), imaginary);
      const char* kind = imaginary == build::Imaginary::minimal ? "_minimal" : "_free";
      std::ofstream file(folder / (std::to_string(triangles) + kind), std::ios::binary);
      file.write(reinterpret_cast<const char*>(image.data()), static_cast<std::streamsize>(image.size()));
      if (!file.flush()) return 1;
    }
  }
  return 0;
}
