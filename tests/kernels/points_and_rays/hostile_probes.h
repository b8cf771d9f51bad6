#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "kernels/query_scenes.h"
#include "tandem/kernels/ray_query.h"

/// Points and rays that are hard to decide about.
namespace tandem::test {

using Place = std::array<double, 3>;

/// The triangles of all bodies, by body and leaf order.
inline std::vector<std::vector<PosedTriangle>> in_leaf_order(const BodyScene& scene) {
  std::vector<std::vector<PosedTriangle>> out;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    const std::vector<PosedTriangle> by_face = posed_triangles(scene, i);
    const LevelView level = scene.assets.views()[scene.instances[i].asset].level();
    out.emplace_back();
    for (std::uint32_t t = 0; t < level.triangle_count; ++t)
      out.back().push_back(by_face[level.triangles[t].source_face()]);
  }
  return out;
}

inline std::vector<PosedTriangle> all_of(const std::vector<std::vector<PosedTriangle>>& bodies) {
  std::vector<PosedTriangle> out;
  for (const auto& body : bodies) out.insert(out.end(), body.begin(), body.end());
  return out;
}

inline double size_of(const std::vector<PosedTriangle>& triangles) {
  double size = 0;
  for (const auto& t : triangles) {
    for (const auto& corner : t) {
      for (double x : corner) size = std::max(size, std::abs(x));
    }
  }
  return size;
}

inline Place random_place(RandomPoses& random, double size) {
  return {random.symmetric(size), random.symmetric(size), random.symmetric(size)};
}

/// Points anywhere, on triangles, in their planes, and at corners.
inline std::vector<Place> hostile_points(RandomPoses& random,
                                         const std::vector<std::vector<PosedTriangle>>& bodies, int count) {
  const double size = size_of(all_of(bodies));
  std::vector<Place> points;
  for (int i = 0; i < count; ++i) {
    const auto& body = bodies[random.below(bodies.size())];
    const PosedTriangle& t = body[random.below(body.size())];
    Place p;
    const double a = random.symmetric(2), b = i % 3 == 0 ? random.symmetric(2) : 0;
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = i % 5 == 0   ? random.symmetric(3 * size)
             : i % 5 == 1 ? t[0][k]
                          : t[0][k] + a * (t[1][k] - t[0][k]) + b * (t[2][k] - t[0][k]);
    }
    points.push_back(p);
  }
  return points;
}

struct Rays {
  std::vector<Place> origins, directions;

  void add(const Place& from, const Place& along) {
    origins.push_back(from);
    directions.push_back(along);
  }
  RayOptions options(RayHits hits) const {
    return {.origins = origins, .directions = directions, .hits = hits};
  }
};

/// A point of a triangle: a corner, one of an edge, or of the inside.
inline Place aimed_at(RandomPoses& random, const PosedTriangle& t) {
  double weight[3] = {random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1)};
  const auto kind = random.below(4);
  if (kind == 0) weight[1] = weight[2] = 0, weight[0] = 1;
  if (kind == 1) weight[0] = 0, weight[1] = weight[2] = 0.5;
  if (kind == 2) weight[random.below(3)] = 0;
  const double sum = weight[0] + weight[1] + weight[2];
  Place out;
  for (std::size_t k = 0; k < 3; ++k)
    out[k] = (weight[0] * t[0][k] + weight[1] * t[1][k] + weight[2] * t[2][k]) / sum;
  return out;
}

/// Rays that are aimed at triangles, begin on them, lie along their edges or in their planes, or go anywhere.
inline Rays hostile_rays(RandomPoses& random, const std::vector<PosedTriangle>& triangles, double size,
                         int count) {
  Rays rays;
  for (int i = 0; i < count; ++i) {
    const PosedTriangle& t = triangles[random.below(triangles.size())];
    const PosedTriangle& other = triangles[random.below(triangles.size())];
    const Place to = aimed_at(random, t);
    Place from = aimed_at(random, other), along;
    if (random.below(3) != 0) from = random_place(random, 3 * size);
    const double length = std::ldexp(1.0, static_cast<int>(random.below(9)) - 4);
    for (std::size_t k = 0; k < 3; ++k) along[k] = (to[k] - from[k]) * length;
    const auto kind = random.below(7);
    if (kind == 0) along = random_place(random, 1);
    if (kind == 1) along = {0, 0, 0}, along[random.below(3)] = random.below(2) != 0 ? size : -size;
    if (kind == 2) {
      from = t[random.below(3)];
      for (std::size_t k = 0; k < 3; ++k) along[k] = t[1][k] - t[0][k], from[k] -= along[k] * 2;
    }
    if (kind == 3) {
      // In the plane, to the middle of an edge; exactly so where the sums are exact, as of float32 corners.
      for (std::size_t k = 0; k < 3; ++k)
        along[k] = (t[1][k] - t[0][k]) + (t[2][k] - t[0][k]), from[k] = t[0][k] - along[k];
    }
    if (along == Place{0, 0, 0}) along[2] = 1;
    rays.add(from, along);
  }
  return rays;
}

/// Rays from inside a cube to its triangles, and to their edges and corners on purpose: each hits it.
inline Rays rays_from_inside(RandomPoses& random, const std::vector<PosedTriangle>& triangles, int count) {
  Rays rays;
  for (int i = 0; i < count; ++i) {
    const Place to = aimed_at(random, triangles[random.below(triangles.size())]),
                from = random_place(random, 0.5);
    rays.add(from, {to[0] - from[0], to[1] - from[1], to[2] - from[2]});
  }
  return rays;
}

}  // namespace tandem::test
