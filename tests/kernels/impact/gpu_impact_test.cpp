// Times of impact on the GPU: what is promised, checked by exact contact queries, and the CPU's beside it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "gpu/gpu_scene_fixture.h"
#include "kernels/asked.h"
#include "kernels/impact/moving_scenes.h"
#include "tandem/kernels/excluded_pairs.h"
#include "tandem/kernels/gpu_excluded_pairs.h"
#include "tandem/kernels/gpu_impact_query.h"

namespace tandem {
namespace {

using test::ImpactChecker;
using test::moving;
using test::MovingScene;
using test::on_gpu;
using Impacts = std::vector<Impact>;
using Pairs = std::vector<ObjectPair>;

/// Returns the options that test::gpu_options() has, for impacts.
GpuImpactOptions gpu_options(bool sorted = false) {
  GpuImpactOptions options;
  options.sorted = sorted;
  options.most_blocks = test::gpu_options(QueryMode::exact).most_blocks;
  return options;
}

const GpuImpactOptions kSorted = gpu_options(true);

/// A scene with motions on the GPU, and a query of it.
struct Moved : test::AskedOnGpu<GpuImpactQuery> {
  explicit Moved(const MovingScene& moves, const Pairs& given = {})
      : AskedOnGpu(moves.scene, given), motion(on_gpu(moves.motion)), duration(moves.duration) {}
  Status find(const GpuImpactOptions& options = gpu_options()) {
    return query.find(scene.instances(), motion.data(), duration, options, nullptr);
  }
  Status find_given(const GpuImpactOptions& options = gpu_options()) {
    return query.find(scene.instances(), motion.data(), duration, scene.pairs(), options, nullptr);
  }
  Status enqueue(const GpuImpactOptions& options, cudaStream_t stream) {
    return query.enqueue(scene.instances(), motion.data(), duration, options, stream);
  }
  Impacts impacts() const { return test::download(query.impacts(), query.report().impacts); }
  Pairs pairs() const { return test::download(query.pairs().pairs, query.report().impacts); }

  GpuArray<RigidMotion> motion;
  double duration;
};

/// Byte by byte but for what lies behind the status.
bool same(const Impacts& x, const Impacts& y) {
  const auto equal = [](const Impact& a, const Impact& b) {
    return std::memcmp(&a, &b, offsetof(Impact, status)) == 0 && a.status == b.status;
  };
  return x.size() == y.size() && std::equal(x.begin(), x.end(), y.begin(), equal);
}

ImpactOptions step_of(const MovingScene& moves, double tolerance = 1e-6) {
  return {.motion = moves.motion, .duration = moves.duration, .tolerance = tolerance};
}

class GpuImpacts : public test::GpuTest {
 protected:
  /// Returns what the CPU finds with the same pairs.
  Impacts of_cpu(const MovingScene& moves, const Pairs& pairs, double tolerance = 1e-6) {
    EXPECT_EQ(cpu_.set_assets(moves.scene.assets.views()), Status::kOk);
    EXPECT_EQ(cpu_.find(moves.scene.instances, pairs, step_of(moves, tolerance)), Status::kOk);
    return {cpu_.rows().begin(), cpu_.rows().end()};
  }
  Pairs pairs_of_cpu(const MovingScene& moves) {
    EXPECT_EQ(cpu_.set_assets(moves.scene.assets.views()), Status::kOk);
    EXPECT_EQ(cpu_.find(moves.scene.instances, step_of(moves)), Status::kOk);
    return {cpu_.pairs().begin(), cpu_.pairs().end()};
  }

  test::Asked<ImpactQuery> cpu_;
};

Impact impact_of(Moved& moved, double tolerance = 1e-6) {
  GpuImpactOptions options = gpu_options();
  options.tolerance = tolerance;
  EXPECT_EQ(moved.find_given(options), Status::kOk);
  const Impacts found = moved.impacts();
  EXPECT_EQ(found.size(), 1u);
  return found.empty() ? Impact{} : found[0];
}

TEST_F(GpuImpacts, OfBodiesAtRestThereAreNone) {
  RandomPoses random(19);
  for (int i = 0; i < test::trials(40, 10); ++i) {
    const double far = i % 2 == 0 ? 0 : std::pow(10, random.uniform(0, 8));
    MovingScene moves;
    moves.scene.assets.add(test::cube(0.5f));
    for (const double z : {0.0, 1 + std::pow(10, random.uniform(-15, -3))}) {
      moves.add(0, at(far, 0, z), kAtRest);
      for (double& x : moves.motion.back().centre) x = random.symmetric(far + 10);
    }
    Moved moved(moves, {{0, 1}});
    const bool touch = ImpactChecker(moves).touch_at(0);
    EXPECT_EQ(impact_of(moved).status, touch ? ImpactStatus::at_start : ImpactStatus::none);
  }
}

class GpuImpactFamilies : public test::GpuTestOf<test::MotionFamily> {};

TEST_P(GpuImpactFamilies, NothingTouchesUntilTSafeAndThenTheGapIsWhatIsTold) {
  RandomPoses random(11);
  const int count = test::trials(200, 20);
  test::Asked<ImpactQuery> cpu;
  int found = 0, none = 0, other_status = 0, later = 0;
  for (int i = 0; i < count && !HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const MovingScene moves = GetParam().make(random);
    ImpactOptions options;
    if (i % 2 != 0) options.tolerance = 0;
    Moved moved(moves, {{0, 1}});
    const Impact impact = impact_of(moved, options.tolerance);
    ImpactChecker(moves).check(impact, random, test::trials(100, 10));
    found += impact.status == ImpactStatus::found;
    none += impact.status == ImpactStatus::none;

    const ObjectPair pair[] = {{0, 1}};
    ASSERT_EQ(cpu.set_assets(moves.scene.assets.views()), Status::kOk);
    ASSERT_EQ(cpu.find(moves.scene.instances, pair, step_of(moves, options.tolerance)), Status::kOk);
    const Impact& of_cpu = cpu.rows()[0];
    other_status += impact.status != of_cpu.status;
    later += std::fabs(impact.t_safe - of_cpu.t_safe) > 1e-4 * moves.duration;
  }
  RecordProperty("found", found);
  RecordProperty("none", none);
  RecordProperty("other_status", other_status);
  RecordProperty("other_time", later);
  EXPECT_GT(found, count / 20);
  EXPECT_GT(none, 0);
  // Bodies that come as near as the tolerance without meeting may stop or not.
  EXPECT_LE(other_status, count / 20);
  EXPECT_LE(later, count / 20);
}

INSTANTIATE_TEST_SUITE_P(All, GpuImpactFamilies, testing::ValuesIn(test::kMotionFamilies),
                         [](const auto& tested) { return test::family_name(tested); });

/// Bodies whose trees are deep enough to be posed at times of the step. Some go through others.
MovingScene shower(std::uint64_t seed, int count, std::uint32_t triangles, double speed) {
  RandomPoses random(seed);
  MovingScene moves;
  moves.scene.assets.add(test::soup(random, triangles, 0.08));
  moves.scene.assets.add(test::gear(20, 0.7, 0.8, 0.1f));
  moves.duration = 1;
  for (int i = 0; i < count; ++i) {
    const Pose pose = test::placed(random, 4);
    moves.add(static_cast<std::uint32_t>(i % 2), pose, test::random_motion(random, pose, speed, 1.5));
  }
  return moves;
}

TEST_F(GpuImpacts, OfManyBodiesAreCertifiedAndNearlyThoseOfTheCpu) {
  for (const MovingScene& moves :
       {test::moving_crowd(4, 120), shower(5, 60, 1500, 1), shower(6, 40, 1500, 12)}) {
    Moved moved(moves);
    ASSERT_EQ(moved.find(kSorted), Status::kOk);
    const Pairs pairs = moved.pairs(), expected = pairs_of_cpu(moves);
    ASSERT_EQ(pairs.size(), expected.size());
    const Impacts found = moved.impacts(), of_cpu = this->of_cpu(moves, pairs);
    RandomPoses random(9);
    std::uint32_t meet = 0, at_start = 0, other = 0;
    for (std::size_t i = 0; i < found.size() && !HasFailure(); ++i) {
      SCOPED_TRACE(i);
      EXPECT_EQ(pairs[i].a, expected[i].a);
      EXPECT_EQ(pairs[i].b, expected[i].b);
      meet += found[i].status == ImpactStatus::found;
      at_start += found[i].status == ImpactStatus::at_start;
      other += std::fabs(found[i].t_safe - of_cpu[i].t_safe) > 1e-5;
      if (found[i].status != ImpactStatus::none || i % 16 == 0)
        ImpactChecker(moves, pairs[i]).check(found[i], random, 8);
    }
    EXPECT_GT(meet, 10u);
    EXPECT_GT(at_start, 5u);
    EXPECT_LE(other, found.size() / 100);
    const ImpactCounters& counters = moved.report().counters;
    EXPECT_EQ(counters.object_pairs, pairs.size());
    EXPECT_EQ(counters.found, meet);
    EXPECT_EQ(counters.at_start, at_start);
    EXPECT_LE(moved.query.bytes(),
              most_impact_bytes(moved.query.capacity(), moves.scene.assets.size(), true));
  }
}

TEST_F(GpuImpacts, AContactAtTheStartIsTheLeastOfThePair) {
  const MovingScene moves = shower(7, 40, 800, 1);
  Moved moved(moves);
  ASSERT_EQ(moved.find(kSorted), Status::kOk);
  const Pairs pairs = moved.pairs();
  const Impacts found = moved.impacts();
  test::Asked<ContactQuery> contacts;
  ASSERT_EQ(contacts.set_assets(moves.scene.assets.views()), Status::kOk);
  ASSERT_EQ(contacts.find(moves.scene.instances, pairs, {}), Status::kOk);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> least(pairs.size(), {kNoIndex, kNoIndex});
  for (const Contact& contact : contacts.rows())
    least[contact.pair] = std::min(least[contact.pair], {contact.triangle_a, contact.triangle_b});
  std::size_t touching = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const bool touches = least[i].first != kNoIndex;
    touching += touches;
    EXPECT_EQ(found[i].status == ImpactStatus::at_start, touches);
    if (!touches) continue;
    EXPECT_EQ(std::pair(found[i].triangle_a, found[i].triangle_b), least[i]);
    EXPECT_EQ(found[i].gap, 0);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[i].point_a[k], found[i].point_b[k], 1e-12);
  }
  EXPECT_GT(touching, 5u);
}

TEST_F(GpuImpacts, EveryRunAndEveryReplayHasTheSameBytes) {
  const MovingScene moves = shower(8, 60, 1500, 8);
  Moved moved(moves);
  ASSERT_EQ(moved.find(kSorted), Status::kOk);
  const Impacts expected = moved.impacts();
  const ImpactCounters counters = moved.report().counters;
  EXPECT_GT(counters.found, 5u);
  test::GraphStream stream;
  stream.capture([&] { return moved.enqueue(kSorted, stream.get()); });
  for (int i = 0; i < 6; ++i) {
    ASSERT_EQ(cudaMemset(const_cast<Impact*>(moved.query.impacts()), 0xFF, expected.size() * sizeof(Impact)),
              cudaSuccess);
    if (i % 2 == 0) {
      stream.launch();
    } else {
      ASSERT_EQ(moved.enqueue(kSorted, stream.get()), Status::kOk);
    }
    ASSERT_EQ(cudaStreamSynchronize(stream.get()), cudaSuccess);
    EXPECT_TRUE(same(moved.impacts(), expected));
    EXPECT_EQ(moved.report().counters, counters);
  }
  Moved again(moves);
  ASSERT_EQ(again.find(kSorted), Status::kOk);
  EXPECT_TRUE(same(again.impacts(), expected));
}

TEST_F(GpuImpacts, WhatDoesNotFitIsToldAndNothingIsLostOnTheRetry) {
  const MovingScene moves = shower(8, 60, 1500, 8);
  Moved whole(moves);
  ASSERT_EQ(whole.find(kSorted), Status::kOk);
  const Impacts expected = whole.impacts();
  const GpuImpactCapacity needed = whole.report().needed;
  const auto starved = [&](auto GpuImpactCapacity::*what) {
    GpuImpactCapacity capacity = needed;
    capacity.undecided += needed.undecided / 2 + 1024;
    capacity.*what = capacity.*what - 1;
    Moved moved(moves);
    EXPECT_EQ(moved.query.reserve(capacity, kSorted), Status::kOk);
    EXPECT_EQ(moved.enqueue(kSorted, nullptr), Status::kOk);
    EXPECT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
    EXPECT_EQ(moved.report().complete, 0u);
    EXPECT_EQ(moved.report().impacts, 0u);
    EXPECT_GE(moved.report().needed.*what, needed.*what);
    EXPECT_EQ(moved.find(kSorted), Status::kOk);
    EXPECT_TRUE(same(moved.impacts(), expected));
  };
  starved(&GpuImpactCapacity::contacts);
  for (const auto member : {&GpuImpactCapacity::pairs, &GpuImpactCapacity::parts,
                            &GpuImpactCapacity::block_pairs, &GpuImpactCapacity::triangle_pairs})
    starved(member);

  Moved moved(moves);
  EXPECT_EQ(moved.query.reserve({}, kSorted), Status::kOk);
  EXPECT_EQ(moved.enqueue(kSorted, nullptr), Status::kOutOfRange);  // there is no room for the instances
  GpuImpactCapacity nearly_nothing = {.instances = needed.instances};
  EXPECT_EQ(moved.query.reserve(nearly_nothing, kSorted), Status::kOk);
  EXPECT_EQ(moved.find(kSorted), Status::kOk);
  EXPECT_TRUE(same(moved.impacts(), expected));
}

TEST_F(GpuImpacts, OfBodiesThatStandStillOrTurnManyTimes) {
  MovingScene moves;
  moves.scene.assets.add(test::box(2, 0.1f, 0.1f));
  moves.scene.assets.add(test::cube(0.5f, 12));
  moves.add(0, kIdentityPose, {{0, 0, 0}, {0, 0, 1000}, {0, 0, 0}});
  moves.add(1, at(4, 0, 0), moving(-3, 0, 0));
  Moved turning(moves, {{0, 1}});
  const Impact found = impact_of(turning);
  EXPECT_EQ(found.status, ImpactStatus::found);
  RandomPoses random(2);
  ImpactChecker(moves).check(found, random, 100);
  EXPECT_NEAR(found.t_safe, of_cpu(moves, {{0, 1}})[0].t_safe, 1e-4);

  moves.duration = 0;
  Moved still(moves, {{0, 1}});
  const Impact none = impact_of(still);
  EXPECT_EQ(none.status, ImpactStatus::none);
  EXPECT_EQ(none.t_safe, 0);
  moves.scene.instances[1].pose.translation[0] = 1.2;
  Moved touching(moves, {{0, 1}, {0, 0}, {1, 0}});
  ASSERT_EQ(touching.find_given(), Status::kOk);
  const Impacts all = touching.impacts();
  EXPECT_EQ(all[0].status, ImpactStatus::at_start);
  EXPECT_EQ(all[1].status, ImpactStatus::at_start);  // neighbours in a mesh touch
  EXPECT_EQ(all[2].status, ImpactStatus::at_start);
}

TEST_F(GpuImpacts, FiltersLeavePairsOut) {
  const MovingScene moves = test::moving_crowd(3, 2);
  const ObjectPair joint[] = {{1, 0}};
  ExcludedPairTable table;
  ASSERT_EQ(table.set(joint), Status::kOk);
  GpuExcludedPairs excluded;
  ASSERT_EQ(excluded.upload(table.view(), nullptr), Status::kOk);
  GpuImpactOptions options = gpu_options();
  Moved moved(moves);
  ASSERT_EQ(moved.find(options), Status::kOk);
  EXPECT_EQ(moved.report().impacts, pairs_of_cpu(moves).size());
  EXPECT_EQ(moved.report().impacts, 1u);
  options.filter.excluded = excluded.view();
  ASSERT_EQ(moved.find(options), Status::kOk);
  EXPECT_EQ(moved.report().impacts, 0u);
}

TEST_F(GpuImpacts, ErrorsAreNamedAndLeaveNothing) {
  MovingScene moves;
  moves.scene.assets.add(test::cube(0.5f));
  moves.add(0, kIdentityPose, moving(1, 0, 0));
  moves.add(0, at(3, 0, 0), kAtRest);
  const auto ask = [&](std::uint64_t where = 1, const Pairs& pairs = {{0, 1}}) {
    Moved moved(moves, pairs);
    const Status status = moved.find_given();
    if (status != Status::kOk) {
      EXPECT_EQ(moved.report().where, where);
      EXPECT_EQ(moved.report().impacts, 0u);
      EXPECT_EQ(moved.find(), moved.report().status);
    }
    return status;
  };
  EXPECT_EQ(ask(), Status::kOk);
  const std::vector<RigidMotion> good = moves.motion;
  const auto refused = [&](double& number, double value) {
    number = value;
    EXPECT_EQ(ask(), Status::kOutOfRange) << value;
    moves.motion = good;
  };
  refused(moves.motion[1].velocity[0], NAN);
  refused(moves.motion[1].velocity[1], 1e101);
  refused(moves.motion[1].centre[2], INFINITY);
  refused(moves.motion[1].angular_velocity[0], 1.001 * kLargestTurn);
  moves.scene.instances[1].pose.rotation[0][0] = 2;
  EXPECT_EQ(ask(), Status::kPoseNotRigid);
  moves.scene.instances[1] = {1, kIdentityPose};
  EXPECT_EQ(ask(), Status::kUnknownAsset);
  moves.scene.instances[1] = {0, at(3, 0, 0)};
  Moved unknown(moves, {{0, 1}, {0, 2}});
  EXPECT_EQ(unknown.find_given(), Status::kUnknownInstance);
  EXPECT_EQ(unknown.report().where, 1u);
  Moved moved(moves, {{0, 1}});
  for (const double duration : {-1.0, static_cast<double>(INFINITY), static_cast<double>(NAN)}) {
    moved.duration = duration;
    EXPECT_EQ(moved.find_given(), Status::kBadDuration);
  }
  moved.duration = 1;
  GpuImpactOptions options = gpu_options();
  options.tolerance = NAN;
  EXPECT_EQ(moved.find_given(options), Status::kBadTolerance);
}

TEST_F(GpuImpacts, NeedBothKindsOfBlocks) {
  test::expect_needed<GpuImpactQuery>(test::moving_crowd(3, 2).scene, Contents::exact_queries,
                                      Status::kNoAxisAlignedBlocks);
}

}  // namespace
}  // namespace tandem
