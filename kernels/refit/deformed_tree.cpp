#include "kernels/refit/deformed_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tandem/formats/box.h"

namespace tandem {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The next float32 number that is not above x, and not below it. Condition: |x| <= kMaxCoordinate.
float rounded_down(float x) {
  return x;
}
float rounded_up(float x) {
  return x;
}
float rounded_down(double x) {
  const float near = static_cast<float>(x);
  return static_cast<double>(near) > x ? std::nextafter(near, -kInfinity) : near;
}
float rounded_up(double x) {
  return -rounded_down(-x);
}

/// An eighth of the surface of a box.
double surface_of(const Box& box) {
  const double x = static_cast<double>(box.half_extent[0]), y = static_cast<double>(box.half_extent[1]),
               z = static_cast<double>(box.half_extent[2]);
  return (x * y + y * z) + z * x;
}

void add_surfaces(const Block& block, double (&of_node)[kNodesPerBlock]) {
  for (int i = 0; i < kNodesPerBlock && block.kind[i] == NodeKind::internal; ++i)
    of_node[i] += surface_of(box_of(block, i));
}

/// Hands each coordinate of a leaf's corners to store(corner, axis, coordinate). Result: the leaf's box.
template <typename Real, typename Store>
Box move_leaf(const CornerSources& sources, const Real* positions, const Store& store) {
  Position lower, upper;
  for (int k = 0; k < 3; ++k) {
    Real least = 0, most = 0;
    for (int c = 0; c < 3; ++c) {
      const Real x = positions[std::size_t{3} * sources.of[c] + static_cast<std::size_t>(k)];
      least = c == 0 || x < least ? x : least;
      most = c == 0 || x > most ? x : most;
      store(c, k, x);
    }
    lower[k] = rounded_down(least);
    upper[k] = rounded_up(most);
  }
  return enclose(lower, upper);
}

double refit_scalar(const RefitTree& tree, const float* positions) {
  double of_node[kNodesPerBlock] = {};
  for (std::uint32_t b = tree.block_count; b-- > 0;) {
    Block& block = tree.blocks[b];
    const bool leaves = block.is_leaf_block();
    for (int i = 0; i < kNodesPerBlock && block.kind[i] != NodeKind::imaginary; ++i) {
      const std::uint32_t below = block.index[i];
      if (!leaves) set_node(block, i, enclose(tree.blocks[below]), below, NodeKind::internal);
      if (!leaves || positions == nullptr) continue;
      const auto store = [&](int c, int k, float x) { tree.triangles[below].corner[c].position[k] = x; };
      set_node(block, i, move_leaf(tree.sources[below], positions, store), below, NodeKind::leaf);
    }
    add_surfaces(block, of_node);
  }
  return sum_of(of_node);
}

Refit best_refit() {
  static const Refit way = best_way(refit_way);
  return way;
}

/// The bounds of all positions, for which as many vertices are looked at at a time as fill whole vectors.
template <typename Real>
std::size_t check_all(std::span<const Real> positions, float (&lower)[3], float (&upper)[3]) {
  constexpr std::size_t kAtOnce = 12;
  constexpr Real kMost = static_cast<Real>(kMaxCoordinate);
  Real least[kAtOnce], most[kAtOnce];
  std::fill_n(least, kAtOnce, kMost);
  std::fill_n(most, kAtOnce, -kMost);
  std::size_t sound = 0, i = 0;
  const auto look_at = [&](std::size_t count) {
    for (std::size_t j = 0; j < count; ++j) {
      const Real x = positions[i + j];
      sound += std::fabs(x) <= kMost;  // false for NaN
      least[j] = x < least[j] ? x : least[j];
      most[j] = most[j] < x ? x : most[j];
    }
    i += count;
  };
  while (i + kAtOnce <= positions.size()) look_at(kAtOnce);
  look_at(positions.size() - i);
  for (std::size_t k = 0; k < 3; ++k) {
    lower[k] = rounded_down(std::min({least[k], least[k + 3], least[k + 6], least[k + 9]}));
    upper[k] = rounded_up(std::max({most[k], most[k + 3], most[k + 6], most[k + 9]}));
  }
  if (sound == positions.size()) return positions.size() / 3;
  const auto bad =
      std::find_if_not(positions.begin(), positions.end(), [](Real x) { return std::fabs(x) <= kMost; });
  return static_cast<std::size_t>(bad - positions.begin()) / 3;
}

}  // namespace

std::size_t check_positions(std::span<const float> positions, float (&lower)[3], float (&upper)[3]) {
  return check_all(positions, lower, upper);
}

std::size_t check_positions(std::span<const double> positions, float (&lower)[3], float (&upper)[3]) {
  return check_all(positions, lower, upper);
}

Status DeformedTree::begin(const LevelView& rest) {
  if (!blocks_.resize(rest.block_count) || !triangles_.resize(rest.triangle_count) ||
      !sources_.resize(rest.triangle_count))
    return Status::kOutOfMemory;
  std::copy_n(rest.blocks, rest.block_count, blocks_.data());
  std::copy_n(rest.triangles, rest.triangle_count, triangles_.data());
  for (std::uint32_t t = 0; t < rest.triangle_count; ++t) {
    for (int c = 0; c < 3; ++c) sources_[t].of[c] = rest.source_vertices[rest.topology[t].vertex[c]];
  }
  level_ = rest;
  level_.blocks = blocks_.data();
  level_.triangles = triangles_.data();
  level_.precise = nullptr;
  level_.oriented_blocks = nullptr;
  level_.error_bound = 0;
  level_.number = 0;
  double of_node[kNodesPerBlock] = {};
  for (std::size_t b = blocks_.size(); b-- > 0;)
    add_surfaces(blocks_[b], of_node);  // in the order of refit()
  surface_at_rest_ = by_root(sum_of(of_node));
  return Status::kOk;
}

double DeformedTree::by_root(double surfaces) const {
  const double of_root = surface_of(enclose(blocks_[0]));
  return of_root > 0 ? surfaces / of_root : 0;
}

double DeformedTree::refit_by(Refit way, const float* positions) {
  const double surfaces =
      way({blocks_.data(), triangles_.data(), sources_.data(), level_.block_count}, positions);
  surface_ = by_root(surfaces);
  return surfaces;
}

double DeformedTree::looseness() const {
  return surface_ > 0 && surface_at_rest_ > 0 ? surface_ / surface_at_rest_ : 1;
}

Status DeformedTree::refit(std::span<const float> positions) {
  for (double& off : rounding_) off = 0;
  level_.precise = nullptr;
  refit_by(best_refit(), positions.data());
  return Status::kOk;
}

void DeformedTree::refit_leaf(Block& block, int node, const double* positions) {
  const std::uint32_t t = block.index[node];
  const auto store = [&](int c, int k, double x) {
    triangles_[t].corner[c].position[k] = static_cast<float>(x);
    precise_[t].position[c][k] = x;
  };
  set_node(block, node, move_leaf(sources_[t], positions, store), t, NodeKind::leaf);
}

Status DeformedTree::provide_float64(std::size_t numbers) {
  return single_.resize(numbers) && precise_.resize(triangles_.size()) ? Status::kOk : Status::kOutOfMemory;
}

// A coordinate that underflows is rounded by at most half of the smallest float32 number, as any. The
// difference of a number and its rounding is exact.
Status DeformedTree::refit(std::span<const double> positions) {
  if (!single_.resize(positions.size())) return Status::kOutOfMemory;
  double off[3] = {};
  for (std::size_t i = 0; i < positions.size(); ++i) {
    single_[i] = static_cast<float>(positions[i]);
    off[i % 3] = std::max(off[i % 3], std::fabs(positions[i] - static_cast<double>(single_[i])));
  }
  if (off[0] == 0 && off[1] == 0 && off[2] == 0) return refit(single_.view());
  if (!precise_.resize(triangles_.size())) return Status::kOutOfMemory;
  std::copy_n(off, 3, rounding_);
  level_.precise = precise_.data();
  for (Block& block : std::span(blocks_.data(), blocks_.size())) {
    for (int i = 0; i < kNodesPerBlock && block.kind[i] == NodeKind::leaf; ++i)
      refit_leaf(block, i, positions.data());
  }
  refit_by(best_refit(), nullptr);
  return Status::kOk;
}

Refit refit_way(BlockPairVariant variant) {
  return way_of(variant, refit_scalar, &LaneVariant::refit);
}

}  // namespace tandem
