#include <bit>
#include <cmath>

#include "kernels/common/block_pair.h"
#include "kernels/common/traversal.h"
#include "kernels/contact/candidate.h"
#include "near_contact.h"
#include "oriented_work.h"
#include "statistics.h"

namespace tandem {
namespace {

// A sample may cost this many block pairs, half a second or so: a mesh whose triangles all lie in one place
// would take their number squared. A triangle test takes as long as a few block pairs.
constexpr std::uint64_t kMostWork = 20'000'000, kWorkOfTriangleTest = 8;
// Pairs of oriented blocks are tested without SIMD, one box after the other.
constexpr std::uint64_t kMostOrientedPairs = kMostWork / 8;

// A tree at the identity against itself, posed, as queries walk it, one candidate at a time.
class BudgetedQuery {
 public:
  explicit BudgetedQuery(const AssetView& asset)
      : tree_(asset.level()),
        extent_(extent_of(tree_.blocks[0])),
        origin_(asset.header->origin),
        a_(for_stored_coordinates(kIdentityPose, origin_)) {}

  /// Once it is spent, or poses were out of the range of box tests, the answers are worth nothing.
  bool spent() const { return budget_ == 0; }

  bool touching(const Pose& pose) {
    const Pose b = for_stored_coordinates(pose, origin_);
    bool found = false;
    walk(b, [&](const Block& block_a, const Block& block_b, std::uint32_t mask) {
      for (; mask != 0 && !found && take(kWorkOfTriangleTest); mask &= mask - 1) {
        const int bit = lowest_bit(mask);
        found = meet(block_a.index[bit / 4], b, block_b.index[bit % 4]);
      }
      return !found;
    });
    return found;
  }

  WalkWork work(const Pose& pose) {
    WalkWork work;
    work.block_pairs =
        walk(for_stored_coordinates(pose, origin_), [&](const Block&, const Block&, std::uint32_t mask) {
          work.candidates += static_cast<std::uint64_t>(std::popcount(mask));
          return true;
        });
    return work;
  }

 private:
  bool take(std::uint64_t work) {
    budget_ = budget_ > work ? budget_ - work : 0;
    return budget_ > 0;
  }

  template <typename OnLeaves>
  std::uint64_t walk(const Pose& b, const OnLeaves& on_leaves) {
    RelativePose b_in_a;
    if (relative_pose(a_, extent_, b, extent_, b_in_a) != RelativePoseStatus::kOk) {
      budget_ = 0;
      return 0;
    }
    const auto test = [&](const Block& block_a, const Block& block_b) -> std::uint32_t {
      return take(1) ? of_blocks_(block_a, block_b, b_in_a) : 0;
    };
    return traverse(tree_.blocks, tree_.blocks, test, on_leaves);
  }

  bool meet(std::uint32_t triangle_a, const Pose& b, std::uint32_t triangle_b) const {
    const TrianglePair pair = posed_pair(a_, tree_.triangles[triangle_a], b, tree_.triangles[triangle_b]);
    return decide(pair).verdict == Verdict::contact;
  }

  const LevelView tree_;
  const TreeExtent extent_;
  const double* origin_;
  const Pose a_;
  const BlockPairTest of_blocks_ = block_pair_test();
  std::uint64_t budget_ = kMostWork;
};

// The sample of the oriented blocks.
class OrientedSample {
 public:
  OrientedSample(const AssetView& asset, std::uint32_t poses) : walk_(asset, asset), poses_(poses) {}

  void add(const Pose& pose) {
    if (!sum_) return;
    const std::optional<WalkWork> work = walk_.count(pose, left_);
    if (!work) return sum_.reset();
    left_ -= work->block_pairs;
    sum_->block_pairs += static_cast<double>(work->block_pairs) / poses_;
    sum_->candidates += static_cast<double>(work->candidates) / poses_;
  }

  std::optional<ExpectedWork::Oriented> sum() const { return sum_; }

 private:
  const OrientedWork walk_;
  const std::uint32_t poses_;
  std::uint64_t left_ = kMostOrientedPairs;
  std::optional<ExpectedWork::Oriented> sum_ = ExpectedWork::Oriented{};
};

}  // namespace

ExpectedWork sample_expected_work(const AssetView& asset, std::uint32_t poses) {
  const Bounds bounds = bounds_of(asset);
  const NearContactPoses near_contact(bounds, bounds, 1, PoseSet::validation);
  BudgetedQuery query(asset);
  OrientedSample oriented(asset, poses);
  ExpectedWork sum;
  sum.poses = poses;
  for (std::uint32_t i = 0; i < poses; ++i) {
    const auto pose = near_contact.find(i, [&](const Pose& b) { return query.touching(b) || query.spent(); });
    if (!pose) return {};
    const WalkWork work = query.work(pose->b);
    if (query.spent()) return {};
    oriented.add(pose->b);
    sum.block_pairs += static_cast<double>(work.block_pairs) / poses;
    sum.candidates += static_cast<double>(work.candidates) / poses;
  }
  sum.oriented = oriented.sum();
  return sum;
}

std::optional<double> mean_block_pairs(const AssetView& asset, std::span<const Pose> poses) {
  BudgetedQuery query(asset);
  double sum = 0;
  for (const Pose& pose : poses) {
    sum += static_cast<double>(query.work(pose).block_pairs);
    if (query.spent()) return std::nullopt;
  }
  return sum / static_cast<double>(poses.size());
}

}  // namespace tandem
