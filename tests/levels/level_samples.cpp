// level_samples SAMPLES FILE.bvh...: attacks the error bounds of levels by samples. Of each level as many
// points as said, spread evenly over its area, and as many of level 0, each as far from the other surface as
// the nearest triangle that a search finds: none may be farther than the error bound. Exit code 1: one is.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "levels/nearest_triangle.h"
#include "parallel/parallel.h"
#include "tandem/runtime/map.h"

namespace {

using namespace tandem;
using levels::Point;

constexpr std::size_t kSamplesAtOnce = 16384;

struct Farthest {
  double by_area = 0;  ///< the greatest distance of a sample
  double corner = 0;   ///< of a corner
  std::uint64_t violations = 0;

  void add(const Farthest& other) {
    by_area = std::max(by_area, other.by_area);
    corner = std::max(corner, other.corner);
    violations += other.violations;
  }
};

/// Returns for each triangle the sum of the areas up to it, by which samples are shared out.
std::vector<double> cumulative_areas(const LevelView& level) {
  std::vector<double> areas;
  double sum = 0;
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    const Point a = levels::corner_of(level.triangles[t], 0);
    const Point normal = levels::cross(levels::minus(levels::corner_of(level.triangles[t], 1), a),
                                       levels::minus(levels::corner_of(level.triangles[t], 2), a));
    areas.push_back(sum += std::sqrt(levels::dot(normal, normal)));
  }
  return areas;
}

Farthest attack(const LevelView& from, const LevelView& to, std::uint64_t samples, double error_bound) {
  const std::vector<double> areas = cumulative_areas(from);
  Farthest all;
  const auto look = [&](const Point& p, std::uint32_t& hint, Farthest& farthest, bool is_corner) {
    const levels::NearestTriangle nearest = levels::nearest_triangle(to, p, hint);
    hint = nearest.triangle;
    const double distance = std::sqrt(nearest.square);
    double& most = is_corner ? farthest.corner : farthest.by_area;
    most = std::max(most, distance);
    farthest.violations += distance > error_bound;
  };
  const auto sample = [&](Farthest& farthest, std::uint64_t begin, std::uint64_t end) {
    std::mt19937_64 random(begin);
    const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    std::uint32_t hint = 0;
    for (std::uint64_t i = begin; i < end; ++i) {
      const double place = (static_cast<double>(i) + uniform()) / static_cast<double>(samples) * areas.back();
      const auto found = std::lower_bound(areas.begin(), areas.end() - 1, place);
      const Triangle& triangle = from.triangles[found - areas.begin()];
      double x = uniform(), y = uniform();
      if (x + y > 1) {
        x = 1 - x;
        y = 1 - y;
      }
      const Point a = levels::corner_of(triangle, 0), u = levels::minus(levels::corner_of(triangle, 1), a),
                  v = levels::minus(levels::corner_of(triangle, 2), a);
      look(levels::plus(a, levels::plus(levels::scaled(x, u), levels::scaled(y, v))), hint, farthest, false);
    }
  };
  parallel::for_parts(
      samples, kSamplesAtOnce, [] { return Farthest(); }, sample,
      [&](const Farthest& farthest) { all.add(farthest); });
  std::uint32_t hint = 0;
  for (std::uint32_t t = 0; t < from.triangle_count; ++t)
    for (int k = 0; k < 3; ++k) look(levels::corner_of(from.triangles[t], k), hint, all, true);
  return all;
}

bool attack_file(const char* path, std::uint64_t samples) {
  MappedAsset asset;
  if (const Status status = asset.open(path); status != Status::kOk) {
    std::fprintf(stderr, "%s: %s\n", path, explain(status));
    return false;
  }
  const AssetView& view = asset.view();
  bool holds = true;
  for (std::uint32_t i = 1; i < view.levels.size(); ++i) {
    const LevelView finest = view.level(0), level = view.level(i);
    Farthest farthest = attack(finest, level, samples, level.error_bound);
    farthest.add(attack(level, finest, samples, level.error_bound));
    std::printf(
        "%s level %u triangles %u bound %.9g sampled %.9g ratio %.5f with_corners %.5f violations %llu\n",
        path, i, level.triangle_count, level.error_bound, farthest.by_area,
        level.error_bound / farthest.by_area, level.error_bound / std::max(farthest.by_area, farthest.corner),
        static_cast<unsigned long long>(farthest.violations));
    std::fflush(stdout);
    holds = holds && farthest.violations == 0;
  }
  return holds;
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 3) {
    std::fprintf(stderr, "usage: level_samples SAMPLES FILE.bvh...\n");
    return 2;
  }
  bool holds = true;
  for (int i = 2; i < count; ++i)
    holds = attack_file(arguments[i], std::strtoull(arguments[1], nullptr, 10)) && holds;
  return holds ? 0 : 1;
}
