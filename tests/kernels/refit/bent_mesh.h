#pragma once
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "kernels/query_scenes.h"
#include "kernels/solid_meshes.h"

namespace tandem::test {

using Positions = std::vector<std::array<double, 3>>;

inline Positions positions_of(const Mesh& mesh) {
  Positions out;
  for (const auto& p : mesh.points)
    out.push_back({static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
  return out;
}

inline std::vector<float> single(const Positions& positions) {
  std::vector<float> out;
  for (const auto& p : positions) {
    for (const double x : p) out.push_back(static_cast<float>(x));
  }
  return out;
}

inline std::vector<double> flat(const Positions& positions) {
  std::vector<double> out;
  for (const auto& p : positions) out.insert(out.end(), p.begin(), p.end());
  return out;
}

/// The mesh with one point for each place, so that what hangs together at rest does so when its points move.
inline Mesh welded(const Mesh& mesh) {
  Mesh out;
  std::map<std::array<float, 3>, std::uint32_t> place;
  for (const auto& triangle : mesh.triangles) {
    std::array<std::uint32_t, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [at, fresh] =
          place.try_emplace(mesh.points[triangle[k]], static_cast<std::uint32_t>(out.points.size()));
      if (fresh) out.points.push_back(at->first);
      corners[k] = at->second;
    }
    out.triangles.push_back(corners);
  }
  return out;
}

/// The number of the block that each oriented block belongs to, by the invariant *Numbers* of FORMAT.md.
inline std::vector<std::uint32_t> blocks_of_oriented(const LevelView& level) {
  std::vector<std::uint32_t> of = {0};
  for (std::uint32_t b = 0; b < level.block_count; ++b) {
    const Block& block = level.blocks[b];
    for (int i = 0; i < kNodesPerBlock && block.kind[i] == NodeKind::internal; ++i)
      of.push_back(block.index[i]);
  }
  return of;
}

/// Ways to bend, of which some are wild.
enum class Bend { twist, fold, shear, wave, flatten, collapse, inside_out, noise, huge, tiny };
inline constexpr Bend kBends[] = {Bend::twist,    Bend::fold,       Bend::shear, Bend::wave, Bend::flatten,
                                  Bend::collapse, Bend::inside_out, Bend::noise, Bend::huge, Bend::tiny};

inline std::array<double, 3> bent(Bend bend, double amount, const std::array<double, 3>& p,
                                  RandomPoses& random) {
  const auto [x, y, z] = p;
  const double c = std::cos(amount * z + x), s = std::sin(amount * z + x);
  switch (bend) {
    case Bend::twist:
      return {c * x - s * y, s * x + c * y, z};
    case Bend::fold:
      return {std::fabs(x), y, z + amount * 1e-3 * x};
    case Bend::shear:
      return {x + amount * y, y, z};
    case Bend::wave:
      return {x, y, z + 0.3 * std::sin(amount * 5 * x) * std::cos(3 * y)};
    case Bend::flatten:
      return {x, y, 0};
    case Bend::collapse:
      return {0.25, 0.25, 0.25};
    case Bend::inside_out:
      return {-x, -y, -z};
    case Bend::noise:
      return {x + random.symmetric(amount), y + random.symmetric(amount), z + random.symmetric(amount)};
    case Bend::huge:
      return {1e15 * x, 1e15 * y, 1e15 * z};
    case Bend::tiny:
      return {1e-42 * x, 1e-42 * y, 1e-42 * z};
  }
  return p;
}

inline Positions bent(Bend bend, double amount, Positions positions, RandomPoses& random) {
  for (auto& p : positions) p = bent(bend, amount, p, random);
  return positions;
}

}  // namespace tandem::test
