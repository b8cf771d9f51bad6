#pragma once
#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

#include "gpu/gpu_scene_fixture.h"
#include "kernels/scene/broad_phase_limits.h"
#include "tandem/kernels/gpu_broad_phase.h"

/// Tests of a broad phase on a GPU share these.
namespace tandem::test {

using Boxes = std::vector<WorldBox>;
using Pairs = std::vector<ObjectPair>;

/// Numbers of boxes: some that are tested each against each, some that a tree is made of.
inline constexpr std::uint32_t kFew = 3000, kMany = 20000;
static_assert(kFewPosed < kFew && kFew <= kFewBoxes && kFewBoxes < kMany);

inline bool before(const ObjectPair& x, const ObjectPair& y) {
  return x.a != y.a ? x.a < y.a : x.b < y.b;
}

inline bool same(const Pairs& x, const Pairs& y) {
  return x.size() == y.size() && (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof x[0]) == 0);
}

inline bool same(const Boxes& x, const Boxes& y) {
  return x.size() == y.size() && (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof x[0]) == 0);
}

inline Pairs of_cpu(const Boxes& boxes, const PairFilter& filter = {}) {
  BroadPhase broad_phase;
  EXPECT_EQ(broad_phase.find_pairs(boxes, filter), Status::kOk);
  return {broad_phase.pairs().begin(), broad_phase.pairs().end()};
}

/// Returns what the last call stored.
inline Pairs stored(const GpuBroadPhase& broad_phase) {
  const GpuPairs pairs = broad_phase.pairs();
  return download(pairs.pairs, std::min(download(pairs.count, 1)[0], pairs.capacity));
}

/// All pairs that a call finds, sorted in any case.
inline Pairs of_gpu(GpuBroadPhase& broad_phase, const GpuArray<WorldBox>& boxes, std::size_t count,
                    const GpuBroadPhaseOptions& options) {
  EXPECT_EQ(broad_phase.find_pairs(boxes.data(), static_cast<std::uint32_t>(count), options, nullptr),
            Status::kOk)
      << cudaGetErrorString(broad_phase.cuda_error());
  EXPECT_EQ(broad_phase.report().complete, 1u);
  Pairs pairs = stored(broad_phase);
  EXPECT_EQ(pairs.size(), broad_phase.report().found);
  if (!options.sorted) std::sort(pairs.begin(), pairs.end(), before);
  return pairs;
}

/// Enqueues a call for so many boxes and waits for its end.
inline void run(GpuBroadPhase& broad_phase, const GpuArray<WorldBox>& boxes, std::uint32_t count,
                const GpuBroadPhaseOptions& options) {
  ASSERT_EQ(broad_phase.enqueue(boxes.data(), count, options, nullptr), Status::kOk);
  ASSERT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
}

/// Room for too few pairs: some of them are stored, none twice, and the report tells how many there are; with
/// room for these, all are found.
inline void expect_overflow_is_reported(GpuBroadPhase& broad_phase, const GpuArray<WorldBox>& boxes,
                                        std::uint32_t count, const GpuBroadPhaseOptions& options,
                                        const Pairs& expected) {
  const auto size = static_cast<std::uint32_t>(expected.size());
  ASSERT_GT(size, 3u);
  for (const std::uint32_t room : {0u, 1u, size / 2, size - 1}) {
    ASSERT_EQ(broad_phase.reserve({count, room}, options), Status::kOk);
    run(broad_phase, boxes, count, options);
    EXPECT_EQ(broad_phase.report().status, Status::kOk);
    EXPECT_EQ(broad_phase.report().complete, 0u);
    EXPECT_EQ(broad_phase.report().found, expected.size());
    Pairs some = stored(broad_phase);
    ASSERT_EQ(some.size(), room);
    std::sort(some.begin(), some.end(), before);
    EXPECT_TRUE(std::includes(expected.begin(), expected.end(), some.begin(), some.end(), before));
  }
  ASSERT_EQ(broad_phase.reserve({count, broad_phase.report().count}, options), Status::kOk);
  run(broad_phase, boxes, count, options);
  EXPECT_EQ(broad_phase.report().complete, 1u);
  EXPECT_EQ(std::memcmp(download(broad_phase.device_report(), 1).data(), &broad_phase.report(),
                        sizeof(GpuBroadPhaseReport)),
            0);
  Pairs all = stored(broad_phase);
  if (!options.sorted) std::sort(all.begin(), all.end(), before);
  EXPECT_TRUE(same(all, expected));
  EXPECT_LE(broad_phase.bytes(), most_broad_phase_bytes(broad_phase.capacity(), options.sorted));
}

/// Instances of boxes, and their copy in GPU memory.
struct Bodies {
  std::vector<std::uint32_t> asset;
  std::vector<Pose> pose;

  Boxes boxes(const std::vector<AssetBounds>& bounds) const {
    Boxes out;
    for (std::size_t i = 0; i < asset.size(); ++i) {
      const AssetBounds& of = bounds[asset[i]];
      out.push_back(world_box(for_stored_coordinates(pose[i], of.origin), of.lower, of.upper));
    }
    return out;
  }
};

class GpuBodies {
 public:
  explicit GpuBodies(const Bodies& bodies)
      : asset_(on_gpu(bodies.asset)),
        pose_(on_gpu(bodies.pose)),
        count_(static_cast<std::uint32_t>(bodies.asset.size())) {}
  GpuInstances view() const { return {asset_.data(), pose_.data(), count_}; }

 private:
  GpuArray<std::uint32_t> asset_;
  GpuArray<Pose> pose_;
  std::uint32_t count_;
};

/// A pointer to boxes that is not as aligned as they must be.
inline const WorldBox* misaligned(const GpuArray<WorldBox>& boxes) {
  return reinterpret_cast<const WorldBox*>(reinterpret_cast<const char*>(boxes.data()) + 8);
}

}  // namespace tandem::test
