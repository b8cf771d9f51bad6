#include "bounds.h"

#include "bvhbuild/meshing/meshing.h"
#include "parallel/parallel.h"

namespace tandem::build {

std::vector<std::size_t> spread_first(std::size_t count, std::size_t first) {
  const std::size_t spread = std::min(count, first);
  std::vector<bool> is_taken(count);
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < spread; ++i) {
    numbers.push_back(i * count / spread);
    is_taken[numbers.back()] = true;
  }
  for (std::size_t number = 0; number < count; ++number) {
    if (!is_taken[number]) numbers.push_back(number);
  }
  return numbers;
}

std::vector<Bounds> normalized_bounds(const Geometry& geometry) {
  const CornerBounds all = corner_bounds(geometry);
  double longest = 0;
  for (std::size_t k = 0; k < 3; ++k) longest = std::max(longest, double{all.upper[k]} - all.lower[k]);
  const double scale = longest > 0 ? std::ldexp(1.0, -std::ilogb(longest)) : 1;
  std::vector<Bounds> bounds(geometry.triangles.size());
  parallel::for_parts(bounds.size(), kTrianglesAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t != end; ++t) {
      for (const std::uint32_t vertex : geometry.triangles[t]) {
        for (std::size_t k = 0; k < 3; ++k) {
          const auto x = static_cast<float>((geometry.points[vertex][k] - double{all.lower[k]}) * scale);
          bounds[t].lo[k] = std::min(bounds[t].lo[k], x);
          bounds[t].hi[k] = std::max(bounds[t].hi[k], x);
        }
      }
    }
  });
  return bounds;
}

}  // namespace tandem::build
