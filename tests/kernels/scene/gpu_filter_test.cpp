#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "kernels/scene/filter_oracle.h"
#include "kernels/scene/gpu_broad_phase_fixture.h"
#include "tandem/kernels/gpu_excluded_pairs.h"

// Filters, and fixed boxes that are kept, on a GPU: the CPU is the oracle.
namespace tandem {
namespace {

using test::Bodies;
using test::Boxes;
using test::download;
using test::FilterArrays;
using test::GpuBodies;
using test::GpuBounds;
using test::kFew;
using test::kMany;
using test::on_gpu;
using test::Pairs;
using test::random_filter;
using test::same;

constexpr unsigned kAllParts = 31, kMotionPart = 1;

class GpuFilterTest : public test::GpuTest {};

Pairs stored(const GpuBroadPhase& broad_phase) {
  const Pairs all = test::stored(broad_phase);
  EXPECT_EQ(all.size(), broad_phase.report().found);
  return all;
}

/// The arrays of a filter in GPU memory.
class GpuFilter {
 public:
  explicit GpuFilter(const FilterArrays& arrays)
      : motion_(on_gpu(arrays.motion)),
        group_(on_gpu(arrays.group)),
        mask_(on_gpu(arrays.mask)),
        world_(on_gpu(arrays.world)) {
    ExcludedPairTable table;
    EXPECT_EQ(table.set(arrays.excluded), Status::kOk);
    EXPECT_EQ(excluded_.upload(table.view(), nullptr), Status::kOk);
  }
  PairFilter view() const {
    return {motion_.data(), group_.data(), mask_.data(), world_.data(), excluded_.view()};
  }
  Motion* motion() const { return motion_.data(); }

 private:
  GpuArray<Motion> motion_;
  GpuArray<std::uint32_t> group_, mask_, world_;
  GpuExcludedPairs excluded_;
};

Pairs of_cpu(const Boxes& boxes, const FilterArrays& filter) {
  ExcludedPairTable table;
  return test::of_cpu(boxes, filter.view(table));
}

// Boxes on a grid, so that many touch exactly, with about as many neighbours each whatever their number; a
// huge one among them.
Boxes scattered(std::uint32_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const double side = std::cbrt(count + 1.0) / 1.3;
  Boxes boxes(count);
  for (WorldBox& box : boxes) {
    for (int k = 0; k < 3; ++k) {
      box.lo[k] = std::round(8 * side * uniform(random)) / 8;
      box.hi[k] = box.lo[k] + std::round(8 * uniform(random)) / 8;
    }
  }
  if (count > 100) boxes[count / 3] = {{-1e6, -1e6, -1e6}, {1e6, 1e6, 1e6}};
  return boxes;
}

// Where fixed boxes are kept, the others are larger by all of the distance.
Boxes grown_for(Boxes boxes, const FilterArrays& filter, bool keep, double within) {
  for (std::size_t i = 0; i < boxes.size() && within > 0; ++i) {
    if (!keep) boxes[i] = grown(boxes[i], 0.5 * within);
    if (keep && filter.motion[i] != Motion::fixed) boxes[i] = grown(boxes[i], within);
  }
  return boxes;
}

void expect_as_cpu(GpuBroadPhase& broad_phase, const Boxes& boxes, const FilterArrays& filter, bool keep,
                   const std::string& what, double within = 0) {
  const bool kept =
      keep && std::find(filter.motion.begin(), filter.motion.end(), Motion::fixed) != filter.motion.end();
  const Pairs expected = of_cpu(grown_for(boxes, filter, kept, within), filter);
  const auto device = on_gpu(boxes);
  const GpuFilter on_device(filter);
  ASSERT_EQ(broad_phase.keep_fixed(device.data(), keep ? filter.motion : std::vector<Motion>(),
                                   on_device.view().world, nullptr),
            Status::kOk)
      << what;
  for (const bool sorted : {false, true}) {
    const Pairs pairs = test::of_gpu(broad_phase, device, boxes.size(), {sorted, on_device.view(), within});
    EXPECT_TRUE(same(pairs, expected)) << what << ", keep " << keep << ", sorted " << sorted << ": "
                                       << pairs.size() << " instead of " << expected.size();
    EXPECT_LE(broad_phase.bytes(), most_broad_phase_bytes(broad_phase.capacity(), true)) << what;
  }
}

TEST_F(GpuFilterTest, FindsThePairsOfTheCpuWhateverTheFilterAndWhatIsKept) {
  GpuBroadPhase broad_phase;
  for (const std::uint32_t count : {1u, 2u, 33u, 500u, kFew, kFewBoxes + 1, kMany}) {
    const Boxes boxes = scattered(count, count);
    for (unsigned parts = 1; parts <= kAllParts; ++parts) {
      if (count >= kFew && parts != kMotionPart && parts != 8 && parts != kAllParts) continue;
      const FilterArrays filter = random_filter(count, parts, 16 * count + parts);
      for (const bool keep : {false, true}) {
        expect_as_cpu(broad_phase, boxes, filter, keep && !filter.motion.empty(),
                      std::to_string(count) + " boxes, filter " + std::to_string(parts));
        expect_as_cpu(broad_phase, boxes, filter, keep && !filter.motion.empty(),
                      std::to_string(count) + " near boxes, filter " + std::to_string(parts), 0.125);
      }
    }
  }
}

// Worlds of a few bodies each that lie in one place, numbered by chance, beside bodies of every world.
TEST_F(GpuFilterTest, WorldsThatLieInOnePlace) {
  GpuBroadPhase broad_phase;
  for (const std::uint32_t count : {600u, kFewBoxes, 5 * kFewBoxes}) {
    const Boxes place = scattered(20, 3);
    std::mt19937 random(count);
    Boxes boxes;
    FilterArrays filter;
    for (std::uint32_t i = 0; i < count; ++i) {
      boxes.push_back(place[i % 20]);
      filter.world.push_back(i % 500 == 0 ? kEveryWorld : i / 20 * (i % 3 == 0 ? 1u : 1000u));
      filter.motion.push_back(random() % 4 == 0 ? Motion::fixed : Motion::moving);
    }
    for (const bool keep : {false, true})
      expect_as_cpu(broad_phase, boxes, filter, keep, std::to_string(count) + " bodies in worlds");
  }
}

// So that trees of every number of levels are kept, and walked for few boxes and for many.
TEST_F(GpuFilterTest, FewOrManyAreKept) {
  GpuBroadPhase broad_phase;
  for (const std::uint32_t count : {50u, 1100u, 40000u}) {
    const Boxes boxes = scattered(count, 5);
    for (const std::uint32_t rare : {1u, 2u, 33u, 1000u}) {
      if (2 * rare > count) continue;
      for (const bool few_fixed : {false, true}) {
        FilterArrays filter;
        for (std::uint32_t i = 0; i < count; ++i)
          filter.motion.push_back((i % (count / rare) == 0) == few_fixed ? Motion::fixed : Motion::moving);
        expect_as_cpu(broad_phase, boxes, filter, true,
                      std::to_string(count) + " " + std::to_string(rare) + " " + std::to_string(few_fixed));
      }
    }
    expect_as_cpu(broad_phase, boxes, {std::vector<Motion>(count, Motion::fixed), {}, {}, {}, {}}, true,
                  "all");
  }
}

// Far from the origin, over many sizes, in one place: the kept tree has a float32 frame of its own.
TEST_F(GpuFilterTest, KeptBoxesMayBeElsewhereThanTheOthers) {
  GpuBroadPhase broad_phase;
  for (const std::uint32_t count : {kFew, kMany}) {
    for (const double offset : {0.0, 1e7, 1e12}) {
      Boxes boxes = scattered(count, 9);
      const FilterArrays filter = random_filter(count, kMotionPart, 9);
      for (std::uint32_t i = 0; i < count; ++i) {
        const double moved = filter.motion[i] == Motion::fixed ? 0 : offset;
        const double scale = filter.motion[i] == Motion::fixed ? 1 : std::pow(10, i % 5);
        for (int k = 0; k < 3; ++k) {
          boxes[i].lo[k] += moved;
          boxes[i].hi[k] = boxes[i].hi[k] + moved + scale - 1;
        }
      }
      boxes[count / 2] = {{-1e200, 0, 0}, {1e200, 1, 1}};
      expect_as_cpu(broad_phase, boxes, filter, true, std::to_string(offset));
    }
    expect_as_cpu(broad_phase, Boxes(300, {{1, 2, 3}, {1, 2, 3}}), random_filter(300, kMotionPart, 1), true,
                  "one place");
  }
}

Bodies scattered_bodies(std::uint32_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  Bodies bodies;
  for (std::uint32_t i = 0; i < count; ++i) {
    const double angle = 6 * uniform(random), c = std::cos(angle), s = std::sin(angle),
                 side = 1.2 * std::cbrt(count);
    bodies.asset.push_back(i % 2);
    bodies.pose.push_back({{{c, -s, 0}, {s, c, 0}, {0, 0, 1}},
                           {side * uniform(random), side * uniform(random), side * uniform(random)}});
  }
  return bodies;
}

const std::vector<AssetBounds> kBounds = {{{0, 0, 0}, {-1, -0.5f, -0.25f}, {1, 0.5f, 0.75f}},
                                          {{1, -2, 0.5}, {-1, 0, 0}, {1, 2, 1}}};

TEST_F(GpuFilterTest, KeptInstancesAreNotLookedAtAgain) {
  const GpuBounds on_device_bounds(kBounds);
  const GpuAssetBounds bounds = on_device_bounds.view();
  GpuBroadPhase broad_phase;
  for (const std::uint32_t count : {40u, 2 * kFewPosed, 3 * kFewPosed, 2 * kFewBoxes, 5 * kFewBoxes}) {
    SCOPED_TRACE(count);
    Bodies bodies = scattered_bodies(count, count);
    const Boxes boxes = bodies.boxes(kBounds);
    const FilterArrays filter = random_filter(count, kAllParts, count);
    const GpuFilter on_device(filter);
    const Pairs expected = of_cpu(boxes, filter);
    EXPECT_TRUE(count == 40 || !expected.empty());
    ASSERT_EQ(broad_phase.keep_fixed(GpuBodies(bodies).view(), bounds, filter.motion, on_device.view().world,
                                     nullptr),
              Status::kOk);
    for (std::uint32_t i = 0; i < count; ++i) {
      if (filter.motion[i] != Motion::fixed) continue;
      bodies.asset[i] = 99;
      bodies.pose[i].translation[0] = std::nan("");
    }
    const GpuBodies later(bodies);
    ASSERT_EQ(broad_phase.find_pairs(later.view(), bounds, {true, on_device.view()}, nullptr), Status::kOk);
    EXPECT_TRUE(same(stored(broad_phase), expected));
    EXPECT_TRUE(same(download(broad_phase.boxes(), count), boxes));
    const GpuBroadPhaseOptions near = {true, on_device.view(), 0.25};
    ASSERT_EQ(broad_phase.find_pairs(later.view(), bounds, near, nullptr), Status::kOk);
    EXPECT_TRUE(same(stored(broad_phase), of_cpu(grown_for(boxes, filter, true, 0.25), filter)));
    EXPECT_EQ(broad_phase.keep_fixed(later.view(), bounds, filter.motion, on_device.view().world, nullptr),
              Status::kUnknownAsset);
    const auto first = std::find(filter.motion.begin(), filter.motion.end(), Motion::fixed);
    EXPECT_EQ(broad_phase.report().where, static_cast<std::uint32_t>(first - filter.motion.begin()));
    EXPECT_EQ(broad_phase.find_pairs(later.view(), bounds, {true, on_device.view()}, nullptr),
              Status::kUnknownAsset);
  }
}

TEST_F(GpuFilterTest, NamesWhatItCannotTake) {
  Boxes boxes = scattered(kFew, 3);
  FilterArrays filter = random_filter(kFew, kMotionPart, 3);
  filter.motion[7] = Motion::fixed;
  filter.motion[8] = Motion::moving;
  GpuBroadPhase broad_phase;
  auto device = on_gpu(boxes);
  EXPECT_EQ(broad_phase.keep_fixed(test::misaligned(device), filter.motion, nullptr, nullptr),
            Status::kMisaligned);
  ASSERT_EQ(broad_phase.keep_fixed(device.data(), filter.motion, nullptr, nullptr), Status::kOk);
  EXPECT_EQ(broad_phase.find_pairs(device.data(), kFew - 1, {}, nullptr), Status::kKeptMismatch);
  ASSERT_EQ(broad_phase.find_pairs(device.data(), kFew, {true}, nullptr), Status::kOk);
  const Pairs expected = stored(broad_phase);
  for (const ObjectPair& pair : expected)
    EXPECT_FALSE(filter.motion[pair.a] == Motion::fixed && filter.motion[pair.b] == Motion::fixed);

  boxes[8].lo[1] = std::nan("");
  const auto with_defect = on_gpu(boxes);
  EXPECT_EQ(broad_phase.find_pairs(with_defect.data(), kFew, {true}, nullptr), Status::kOutOfRange);
  EXPECT_EQ(broad_phase.report().where, 8u);
  EXPECT_EQ(broad_phase.report().found, 0u);
  ASSERT_EQ(broad_phase.find_pairs(device.data(), kFew, {true}, nullptr), Status::kOk);
  EXPECT_TRUE(same(stored(broad_phase), expected));

  GpuExcludedPairs excluded;
  ExcludedPairTable table;
  const ObjectPair unknown[] = {{1, 2}, {3, kFew}};
  ASSERT_EQ(table.set(unknown), Status::kOk);
  ASSERT_EQ(excluded.upload(table.view(), nullptr), Status::kOk);
  PairFilter pairs;
  pairs.excluded = excluded.view();
  EXPECT_EQ(broad_phase.find_pairs(device.data(), kFew, {true, pairs}, nullptr), Status::kUnknownInstance);

  // What is kept of instances is lost where room for more is made, and the caller is told.
  const Bodies bodies = scattered_bodies(kFew, 1);
  const GpuBodies on_device(bodies);
  const GpuBounds on_device_bounds(kBounds);
  const GpuAssetBounds bounds = on_device_bounds.view();
  EXPECT_EQ(
      broad_phase.keep_fixed(on_device.view(), bounds, std::span(filter.motion).first(9), nullptr, nullptr),
      Status::kKeptMismatch);
  ASSERT_EQ(broad_phase.keep_fixed(on_device.view(), bounds, filter.motion, nullptr, nullptr), Status::kOk);
  EXPECT_EQ(broad_phase.find_pairs(device.data(), kFew, {}, nullptr), Status::kKeptMismatch);
  EXPECT_EQ(broad_phase.find_pairs(on_device.view(), bounds, {}, nullptr), Status::kOk);
  ASSERT_EQ(broad_phase.reserve({.instances = 2 * kFew}), Status::kOk);
  EXPECT_EQ(broad_phase.find_pairs(on_device.view(), bounds, {}, nullptr), Status::kKeptMismatch);
  ASSERT_EQ(broad_phase.keep_fixed(on_device.view(), bounds, filter.motion, nullptr, nullptr), Status::kOk);
  EXPECT_EQ(broad_phase.find_pairs(on_device.view(), bounds, {}, nullptr), Status::kOk);
}

TEST_F(GpuFilterTest, OverflowIsReportedAndARetryLosesNothing) {
  for (const std::uint32_t count : {kFew, kMany}) {
    const Boxes boxes = scattered(count, 13);
    const FilterArrays filter = random_filter(count, kAllParts, 13);
    const Pairs expected = of_cpu(boxes, filter);
    const GpuFilter on_device(filter);
    const auto device = on_gpu(boxes);
    GpuBroadPhase broad_phase;
    ASSERT_EQ(broad_phase.keep_fixed(device.data(), filter.motion, on_device.view().world, nullptr),
              Status::kOk);
    test::expect_overflow_is_reported(broad_phase, device, count, {true, on_device.view()}, expected);
  }
}

// The caller's flags change in GPU memory, and no other: the host only launches the graph.
TEST_F(GpuFilterTest, AGraphSeesFlagsThatChange) {
  for (const std::uint32_t count : {kFew, kMany}) {
    const Boxes boxes = scattered(count, 17);
    FilterArrays filter = random_filter(count, kAllParts, 17);
    const GpuFilter on_device(filter);
    const auto device = on_gpu(boxes);
    GpuBroadPhase broad_phase;
    ASSERT_EQ(broad_phase.keep_fixed(device.data(), filter.motion, on_device.view().world, nullptr),
              Status::kOk);
    ASSERT_EQ(broad_phase.reserve({count, 20 * count}, {true}), Status::kOk);
    test::GraphStream stream;
    stream.capture([&] {
      return broad_phase.enqueue(device.data(), count, {true, on_device.view()}, stream.get());
    });
    std::size_t last = 0;
    for (int step = 0; step < 3; ++step) {
      stream.launch();
      const Pairs expected = of_cpu(boxes, filter);
      EXPECT_TRUE(same(stored(broad_phase), expected));
      EXPECT_NE(expected.size(), last);
      last = expected.size();
      for (std::uint32_t i = step; i < count; i += 3) {
        if (filter.motion[i] == Motion::moving) filter.motion[i] = Motion::sleeping;
      }
      ASSERT_EQ(cudaMemcpy(on_device.motion(), filter.motion.data(), count, cudaMemcpyHostToDevice),
                cudaSuccess);
    }
  }
}

}  // namespace
}  // namespace tandem
