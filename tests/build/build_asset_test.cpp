#include "tandem/build/build_asset.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

namespace tandem::build {
namespace {

// A bumpy sheet of 2 n^2 triangles with some soup over it: large enough that threads share every step.
struct Sheet {
  std::vector<Point> points;
  std::vector<TriangleIndices> triangles;

  explicit Sheet(std::uint32_t n) {
    std::mt19937 random(7);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    for (std::uint32_t i = 0; i <= n; ++i) {
      for (std::uint32_t j = 0; j <= n; ++j)
        points.push_back({i / double{1024}, j / double{1024}, 0.01 * uniform()});
    }
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = 0; j < n; ++j) {
        const std::uint32_t a = i * (n + 1) + j, b = a + n + 1;
        triangles.push_back({a, b, a + 1});
        triangles.push_back({a + 1, b, b + 1});
      }
    }
    for (std::uint32_t k = 0; k < n; ++k) {
      const auto first = static_cast<std::uint32_t>(points.size());
      for (int corner = 0; corner < 3; ++corner) points.push_back({uniform(), uniform(), uniform()});
      triangles.push_back({first, first + 1, first + 2});
    }
  }

  std::vector<std::byte> built(BuildOptions options, unsigned threads) const {
    options.threads = threads;
    OptimisationWatch watch;
    const BuiltAsset asset = build_asset({points, triangles, {}, 0, {}}, options, {}, watch);
    EXPECT_TRUE(asset.file);
    const Image& image = asset.file->image;
    return {image.data(), image.data() + image.size()};
  }
};

TEST(BuildAsset, GivesTheSameBytesWhateverTheNumberOfThreads) {
  const Sheet sheet(170);  // 57,970 triangles: beyond what is binned, and several regions of the optimiser
  for (const Imaginary imaginary : {Imaginary::minimal, Imaginary::free, Imaginary{0.1}}) {
    const BuildOptions options = {.imaginary = imaginary};
    const std::vector<std::byte> one = sheet.built(options, 1);
    for (const unsigned threads : {2u, 3u, 16u})
      EXPECT_TRUE(sheet.built(options, threads) == one) << imaginary.share << ", " << threads << " threads";
  }
}

}  // namespace
}  // namespace tandem::build
