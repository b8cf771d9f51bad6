#include "enclosure.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace tandem::build {
namespace {

using Vector = std::array<double, 3>;

// Of no special slope, since meshes love axes, diagonals and symmetric shapes. All parts are positive.
constexpr Vector kDirections[] = {{0.7548776662, 0.5698402910, 0.3247179572},
                                  {0.2955977425, 0.8191725134, 0.4914180613},
                                  {0.4422495703, 0.1442249570, 0.8851680193},
                                  {0.5436890127, 0.6477988713, 0.5330099681}};

// A triple product and whether its sign is that of the exact one.
struct Sign {
  double value;
  bool sure;
};

// Each product meets seven roundings at most, differences of the corners included, and the sum five more.
Sign triple_product(const Vector& a, const Vector& b, const Vector& c) {
  double value = 0, magnitude = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    value += c[k] * (a[l] * b[m] - a[m] * b[l]);
    magnitude += std::abs(c[k]) * (std::abs(a[l] * b[m]) + std::abs(a[m] * b[l]));
  }
  return {value, std::abs(value) > 16 * 0x1p-53 * magnitude};
}

// Whether a ray from the point meets a box, or might but for roundings.
bool may_meet(const Block& block, int node, const Vector& from, const Vector& direction) {
  double first = 0, last = HUGE_VAL;
  for (std::size_t k = 0; k < 3; ++k) {
    const double c = block.center[k][node], h = block.half_extent[k][node];
    const double slack = 0x1p-40 * (std::abs(c) + h + std::abs(from[k]));
    first = std::max(first, ((c - from[k]) - h - slack) / direction[k]);
    last = std::min(last, ((c - from[k]) + h + slack) / direction[k]);
  }
  return first <= last;
}

enum class Crossing : std::uint8_t { none, in, out, unsure };

// How a ray from 0 crosses a triangle.
Crossing crossing(const std::array<Vector, 3>& corner, const Vector& direction) {
  int positive = 0, negative = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Sign side = triple_product(corner[k], corner[(k + 1) % 3], direction);
    if (side.sure) ++(side.value > 0 ? positive : negative);
  }
  if (positive > 0 && negative > 0) return Crossing::none;
  const Sign plane = triple_product(corner[0], corner[1], corner[2]);
  if (positive + negative < 3 || !plane.sure) return Crossing::unsure;
  if ((plane.value > 0) != (positive > 0)) return Crossing::none;  // behind
  return positive > 0 ? Crossing::out : Crossing::in;
}

}  // namespace

std::optional<int> Enclosure::around(const std::array<float, 3>& point, std::uint32_t own) const {
  const Vector from = {point[0], point[1], point[2]};
  const auto corners_of = [&](std::uint32_t t) {
    std::array<Vector, 3> corner;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& p = geometry_.points[geometry_.triangles[tree_.order[t]][i]];
      for (std::size_t k = 0; k < 3; ++k) corner[i][k] = double{p[k]} - from[k];
    }
    return corner;
  };
  std::vector<std::uint32_t> pending;
  for (const Vector& direction : kDirections) {
    int winding = 0;
    bool sure = true;
    pending.assign(1, 0);
    while (sure && !pending.empty()) {
      const Block& block = tree_.blocks[pending.back()];
      pending.pop_back();
      for (int i = 0; i < kNodesPerBlock && sure; ++i) {
        if (block.kind[i] == NodeKind::imaginary || !may_meet(block, i, from, direction)) continue;
        const std::uint32_t below = block.index[i];
        if (block.kind[i] == NodeKind::internal) {
          pending.push_back(below);
        } else if (weight_[below] != 0 && component_[below] != own) {
          const Crossing how = crossing(corners_of(below), direction);
          sure = how != Crossing::unsure;
          winding += how == Crossing::out ? weight_[below] : how == Crossing::in ? -weight_[below] : 0;
        }
      }
    }
    if (sure) return winding;
  }
  return std::nullopt;
}

}  // namespace tandem::build
