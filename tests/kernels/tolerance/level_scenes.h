#pragma once
#include <cmath>
#include <vector>

#include "gpu/made_files.h"
#include "kernels/query_scenes.h"

/// Assets with levels of detail whose errors are known by how they are made, and scenes of them.
namespace tandem::test {

/// Meshes from the finest on, and their errors.
struct LevelMeshes {
  std::vector<Mesh> mesh;
  std::vector<double> error;
};

/// Levels whose coarsest is `coarsest`. Each finer one splits every triangle into four, and moves the new
/// corners by up to `amount` along each axis. Corners stay, so that all levels lie within the bounds of the
/// finest. A point of a small triangle is as far from the same point of the large one, by weights, as its
/// corners at most; so the largest step of a corner bounds the distance of two levels both ways.
inline LevelMeshes split_levels(const Mesh& coarsest, int levels, double amount, RandomPoses& random) {
  LevelMeshes out;
  out.mesh = {coarsest};
  std::vector<double> step;  // from each level to the next coarser one
  for (int i = 1; i < levels; ++i) {
    const Mesh& coarse = out.mesh.front();
    Mesh fine;
    double largest = 0;
    for (const auto& triangle : coarse.triangles) {
      std::array<float, 3> corner[3], middle[3];
      for (int k = 0; k < 3; ++k) corner[k] = coarse.points[triangle[k]];
      for (int k = 0; k < 3; ++k) {
        double square = 0;
        for (int x = 0; x < 3; ++x) {
          const double exact =
              0.5 * (static_cast<double>(corner[k][x]) + static_cast<double>(corner[(k + 1) % 3][x]));
          middle[k][x] = static_cast<float>(exact + random.symmetric(amount));
          square += std::pow(static_cast<double>(middle[k][x]) - exact, 2);
        }
        largest = std::max(largest, std::sqrt(square) * (1 + 1e-14));
      }
      for (int k = 0; k < 3; ++k) fine.add(corner[k], middle[k], middle[(k + 2) % 3]);
      fine.add(middle[0], middle[1], middle[2]);
    }
    out.mesh.insert(out.mesh.begin(), fine);
    step.insert(step.begin(), largest);
  }
  out.error = {0};
  for (const double d : step) out.error.push_back((out.error.back() + d) * (1 + 1e-14));
  return out;
}

inline void add_levels(SampleAssets& assets, const LevelMeshes& levels,
                       const std::array<double, 3>& origin = {}) {
  std::vector<MadeLevel> made;
  for (std::size_t i = 0; i < levels.mesh.size(); ++i) {
    const Mesh& mesh = levels.mesh[i];
    made.push_back({mesh, build::build_tree(mesh.geometry(), build::Imaginary::minimal, build::Effort::fast),
                    levels.error[i]});
  }
  assets.add(levels.mesh[0], made_image(made), origin);
}

/// All levels of assets as assets of their own, and where those of each begin.
struct LevelViews {
  std::vector<AssetView> views;
  std::vector<std::uint32_t> first;

  explicit LevelViews(std::span<const AssetView> assets) {
    for (const AssetView& asset : assets) {
      first.push_back(static_cast<std::uint32_t>(views.size()));
      for (std::uint32_t i = 0; i < asset.levels.size(); ++i) views.push_back(asset.levels_from(i, 1));
    }
  }
};

/// Two to five bodies of soups, grids and solids with levels, near each other, here or far away.
inline BodyScene any_level_scene(RandomPoses& random) {
  BodyScene scene;
  const double sizes[] = {1, 1, 1, 1e-3, 1e4}, away[] = {0, 0, 1, 1e3, 1e7};
  const double size = sizes[random.below(5)], far = away[random.below(5)] * size;
  for (int i = 0; i < 2; ++i) {
    Mesh mesh = random.below(3) == 0   ? cube(0.5f, 1)
                : random.below(2) == 0 ? grid_soup(random, 6, 2)
                                       : soup(random, 6, 0.7);
    scale(mesh, size);
    const double amount = size * std::pow(10, -random.uniform(0.5, 9));
    const bool displaced = random.below(2) == 0;
    add_levels(
        scene.assets,
        split_levels(mesh, static_cast<int>(2 + random.below(3)), random.below(5) == 0 ? 0 : amount, random),
        {displaced ? far : 0, displaced ? size : 0, 0});
  }
  const std::uint64_t count = 2 + random.below(4);
  const double place[3] = {random.symmetric(far), random.symmetric(far), random.symmetric(far)};
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto asset = static_cast<std::uint32_t>(random.below(2));
    Pose pose = any_rotation(random);
    double centre[3];
    for (int k = 0; k < 3; ++k) centre[k] = place[k] + random.symmetric(1.4 * size);
    scene.instances.push_back({asset, centred_at(scene.assets.views()[asset], pose, centre)});
  }
  return scene;
}

}  // namespace tandem::test
