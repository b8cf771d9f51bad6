#pragma once
#include <cstdint>
#include <limits>
#include <optional>

#include "tandem/formats/box.h"
#include "tandem/formats/view.h"
#include "tandem/kernels/pose.h"

/// The walk of oriented blocks, on a CPU and counted only: what exact queries on a GPU do.
namespace tandem {

/// Counts the work of a walk of two trees.
struct WalkWork {
  std::uint64_t block_pairs = 0;  ///< units of 4 x 4 box tests
  std::uint64_t candidates = 0;   ///< leaf pairs whose boxes overlap
};

/// Two bodies, the first of which stands at the identity.
class OrientedWork {
 public:
  static constexpr std::uint64_t kAny = std::numeric_limits<std::uint64_t>::max();

  /// Condition: checked assets, which outlive this.
  OrientedWork(const AssetView& a, const AssetView& b);

  /// Counts what a GPU walks with b in this pose, by the same functions and rules, though it fuses
  /// operations, so that a box pair which touches by a rounding may count here and not there. Result: nothing
  /// where a body has no oriented blocks, where the pose is beyond the range of float32 box tests, or where
  /// there are more than `most_block_pairs`.
  std::optional<WalkWork> count(const Pose& b, std::uint64_t most_block_pairs = kAny) const;

 private:
  LevelView tree_a_, tree_b_;
  TreeExtent extent_a_, extent_b_;
  const double* origin_b_;
  Pose a_;
};

}  // namespace tandem
