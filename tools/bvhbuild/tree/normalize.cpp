#include "normalize.h"

#include <algorithm>
#include <cmath>

#include "parallel/parallel.h"

namespace tandem::build {
namespace {

constexpr std::size_t kTrianglesAtOnce = 1 << 14;

class Normalization {
 public:
  explicit Normalization(const Geometry& geometry) {
    double upper[3] = {-kInfinity, -kInfinity, -kInfinity};
    for (const auto& triangle : geometry.triangles) {
      for (const std::uint32_t vertex : triangle) {
        for (int k = 0; k < 3; ++k) {
          lower_[k] = std::min<double>(lower_[k], geometry.points[vertex][k]);
          upper[k] = std::max<double>(upper[k], geometry.points[vertex][k]);
        }
      }
    }
    const double longest = std::max({upper[0] - lower_[0], upper[1] - lower_[1], upper[2] - lower_[2]});
    if (longest > 0) scale_ = std::ldexp(1.0, -std::ilogb(longest));
  }

  Bounds bounds_of(const Geometry& geometry, std::uint32_t triangle) const {
    Bounds bounds;
    for (const std::uint32_t vertex : geometry.triangles[triangle]) {
      for (int k = 0; k < 3; ++k) {
        const auto x = static_cast<float>((geometry.points[vertex][k] - lower_[k]) * scale_);
        bounds.lo[k] = std::min(bounds.lo[k], x);
        bounds.hi[k] = std::max(bounds.hi[k], x);
      }
    }
    return bounds;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double lower_[3] = {kInfinity, kInfinity, kInfinity};
  double scale_ = 1;
};

}  // namespace

std::vector<Bounds> normalized_bounds(const Geometry& geometry) {
  std::vector<Bounds> bounds(geometry.triangles.size());
  const Normalization normalization(geometry);
  parallel::for_parts(bounds.size(), kTrianglesAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t != end; ++t)
      bounds[t] = normalization.bounds_of(geometry, static_cast<std::uint32_t>(t));
  });
  return bounds;
}

}  // namespace tandem::build
