// Contact manifolds on the GPU: the bytes of the CPU.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "gpu/gpu_scene_fixture.h"
#include "kernels/asked.h"
#include "tandem/kernels/gpu_manifold_query.h"
#include "tandem/kernels/gpu_moved_query.h"
#include "tandem/kernels/gpu_scene.h"

namespace tandem {
namespace {

using test::BodyScene;
using test::download;
using test::GpuScene;

struct Result {
  std::vector<Manifold> manifolds;
  std::vector<ManifoldPoint> points;
  ManifoldCounters counters;
};

Result result_of(const GpuManifoldQuery& made) {
  return {download(made.manifolds(), made.report().manifolds), download(made.points(), made.report().points),
          made.report().counters};
}

template <typename Element>
bool same_bytes(const std::vector<Element>& x, const std::vector<Element>& y) {
  return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(Element)) == 0;
}

/// The first difference, for people.
void explain_difference(const Result& cpu, const Result& gpu) {
  for (std::size_t i = 0; i < std::min(cpu.manifolds.size(), gpu.manifolds.size()); ++i) {
    const Manifold &x = cpu.manifolds[i], &y = gpu.manifolds[i];
    if (std::memcmp(&x, &y, sizeof x) == 0) continue;
    ADD_FAILURE() << "manifold " << i << " of pair " << x.pair << " " << y.pair << ", points "
                  << x.point_count << " " << y.point_count << ", flags " << x.flags << " " << y.flags
                  << ", depth " << x.depth << " " << y.depth - x.depth << ", normal off "
                  << x.normal[0] - y.normal[0] << " " << x.normal[1] - y.normal[1] << " "
                  << x.normal[2] - y.normal[2] << ", centre off " << x.centre[0] - y.centre[0]
                  << ", area off " << x.area_vector[0] - y.area_vector[0];
    break;
  }
  for (std::size_t i = 0; i < std::min(cpu.points.size(), gpu.points.size()); ++i) {
    const ManifoldPoint &x = cpu.points[i], &y = gpu.points[i];
    if (std::memcmp(&x, &y, sizeof x) == 0) continue;
    ADD_FAILURE() << "point " << i << " of manifold " << x.manifold << " " << y.manifold << ", id " << x.id
                  << " " << y.id << ", depth " << x.depth << " " << y.depth - x.depth << ", position off "
                  << x.position[0] - y.position[0] << ", in a off " << x.in_a[0] - y.in_a[0] << ", faces "
                  << x.face_a << " " << y.face_a << " " << x.face_b << " " << y.face_b << ", previous "
                  << x.previous << " " << y.previous;
    return;
  }
}

void expect_same(const Result& cpu, const Result& gpu) {
  EXPECT_EQ(cpu.manifolds.size(), gpu.manifolds.size());
  EXPECT_EQ(cpu.points.size(), gpu.points.size());
  EXPECT_EQ(cpu.counters.segments, gpu.counters.segments);
  EXPECT_EQ(cpu.counters, gpu.counters);
  if (!same_bytes(cpu.manifolds, gpu.manifolds) || !same_bytes(cpu.points, gpu.points))
    explain_difference(cpu, gpu);
}

/// Both sides of a scene, which goes on from step to step.
class BothSides {
 public:
  explicit BothSides(const test::SampleAssets& assets, Contents contents = Contents::manifolds)
      : uploaded_(assets, {}, {}, contents) {
    const auto files = assets.views();
    EXPECT_EQ(query_.set_assets(files), Status::kOk);
    EXPECT_EQ(gpu_query_.set_assets(uploaded_.assets(), nullptr), Status::kOk);
    EXPECT_EQ(gpu_.set_assets(uploaded_.assets(), nullptr), Status::kOk);
  }

  /// Makes the manifolds of the CPU, and of the GPU as often as room was too small, and compares them.
  /// Result: how many points there are.
  std::size_t step(const std::vector<Instance>& instances, const std::vector<ObjectPair>& pairs,
                   const ManifoldOptions& options = {}) {
    const Result cpu = on_cpu(instances, pairs, options);
    const GpuScene scene(std::span<const AssetView>(), instances, pairs);
    EXPECT_EQ(gpu_query_.find_contacts(scene.instances(), scene.pairs(), test::grouped_options(), nullptr),
              Status::kOk);
    EXPECT_EQ(gpu_.make(scene.instances(), scene.pairs(), gpu_query_, options, nullptr), Status::kOk);
    EXPECT_LE(gpu_.bytes(), most_manifold_bytes(gpu_.capacity(), uploaded_.assets().size()));
    expect_same(cpu, result_of(gpu_));
    return cpu.points.size();
  }

  Result on_cpu(const std::vector<Instance>& instances, const std::vector<ObjectPair>& pairs,
                const ManifoldOptions& options = {}) {
    EXPECT_EQ(query_.find(instances, pairs, {}), Status::kOk);
    EXPECT_EQ(manifolds_.find(query_.scene, query_.query, options), Status::kOk);
    return {{manifolds_.rows().begin(), manifolds_.rows().end()},
            {manifolds_.points().begin(), manifolds_.points().end()},
            manifolds_.counters()};
  }

  GpuContactQuery& gpu_query() { return gpu_query_; }
  GpuManifoldQuery& gpu() { return gpu_; }

 private:
  test::Asked<ContactQuery> query_;
  ManifoldQuery manifolds_;
  GpuScene uploaded_;
  GpuContactQuery gpu_query_;
  GpuManifoldQuery gpu_;
};

/// Moves and turns a little.
void move(std::vector<Instance>& instances, test::RandomPoses& random, double by) {
  for (Instance& instance : instances) {
    for (double& x : instance.pose.translation) x += random.symmetric(by);
    const double angle = random.symmetric(by), c = std::cos(angle), s = std::sin(angle);
    auto& r = instance.pose.rotation;
    for (int k = 0; k < 3; ++k) {
      const double x = r[0][k], y = r[1][k];
      r[0][k] = c * x - s * y, r[1][k] = s * x + c * y;
    }
  }
}

/// Cubes of several meshes that overlap a little, and one far larger.
BodyScene boxes(std::uint32_t bodies, double spread, std::uint64_t seed) {
  test::RandomPoses random(seed);
  BodyScene scene;
  for (const int cells : {1, 3, 8}) scene.assets.add(test::cube(0.5f, cells));
  scene.assets.add(test::cube(2.0f, 2));
  for (std::uint32_t i = 0; i < bodies; ++i) {
    scene.instances.push_back({i % 16 == 0 ? 3u : i % 3, random.pose({1, 1, spread, 0, 4})});
  }
  return scene;
}

class GpuManifolds : public test::GpuTest {};

class GpuManifoldsOfFamily : public test::GpuTestOf<test::SceneFamily> {};

TEST_P(GpuManifoldsOfFamily, AreTheCpus) {
  test::RandomPoses random(51);
  for (int trial = 0; trial < test::trials(5, 20); ++trial) {
    BodyScene scene = GetParam().make(random);
    BothSides both(scene.assets);
    const std::vector<ObjectPair> pairs = test::all_pairs(scene.instances, true, random);
    both.step(scene.instances, pairs);
    if (HasFailure()) break;
  }
}
INSTANTIATE_TEST_SUITE_P(Scenes, GpuManifoldsOfFamily, testing::ValuesIn(test::scene_families()),
                         [](const auto& tested) { return test::family_name(tested); });

TEST_F(GpuManifolds, GoOnFromStepToStep) {
  for (const Contents contents : {Contents::manifolds, Contents::all}) {
    BodyScene scene = boxes(120, 4, 52);
    test::RandomPoses random(53);
    BothSides both(scene.assets, contents);
    std::size_t points = 0;
    for (int step = 0; step < 8; ++step) {
      points += both.step(scene.instances, test::all_pairs(scene.instances, false, random),
                          {.match_previous = step != 4});
      if (HasFailure()) return;
      move(scene.instances, random, 2e-3);
    }
    EXPECT_GT(points, 1000u);
  }
}

TEST_F(GpuManifolds, OfPairsWithManyContacts) {
  BodyScene scene = test::pile(12, 3000, 0.5, 54);
  test::RandomPoses random(55);
  BothSides both(scene.assets);
  for (int step = 0; step < 3 && !HasFailure(); ++step) {
    EXPECT_GT(both.step(scene.instances, test::all_pairs(scene.instances, true, random),
                        {.quick_depths = step == 1}),
              100u);
    move(scene.instances, random, 1e-3);
  }
}

/// There are so many pairs that warps go in step.
TEST_F(GpuManifolds, OfManyPairs) {
  constexpr std::uint32_t kBodies = 20'000;
  const BodyScene scene = boxes(kBodies, 0.3, 61);
  std::vector<ObjectPair> pairs;
  for (std::uint32_t i = 1; i < kBodies; ++i) pairs.push_back({i - 1, i});
  BothSides both(scene.assets);
  EXPECT_GT(both.step(scene.instances, pairs), 60'000u);
}

/// Boxes in a lattice, as they lie in an exact stack: ties all over.
TEST_F(GpuManifolds, OfAnExactStack) {
  BodyScene scene;
  test::RandomPoses random(56);
  scene.assets.add(test::cube(0.5f, 1));
  scene.assets.add(test::cube(0.5f, 4));
  for (std::uint32_t i = 0; i < 64; ++i) {
    Instance instance = {i % 2, kIdentityPose};
    instance.pose.translation[0] = i % 4 + 1e5, instance.pose.translation[1] = i / 4 % 4,
    instance.pose.translation[2] = i / 16;
    scene.instances.push_back(instance);
  }
  BothSides both(scene.assets);
  EXPECT_GT(both.step(scene.instances, test::all_pairs(scene.instances, false, random)), 300u);
}

/// What does not fit is told, and the retry finds the points of the step before nevertheless.
TEST_F(GpuManifolds, WithoutRoomTellWhatTheyNeed) {
  BodyScene scene = boxes(60, 3, 57);
  test::RandomPoses random(58);
  BothSides both(scene.assets);
  std::vector<ObjectPair> pairs = test::all_pairs(scene.instances, false, random);
  for (int step = 0; step < 3; ++step) {
    const Result cpu = both.on_cpu(scene.instances, pairs);
    const GpuScene on_gpu(std::span<const AssetView>(), scene.instances, pairs);
    ASSERT_EQ(
        both.gpu_query().find_contacts(on_gpu.instances(), on_gpu.pairs(), test::grouped_options(), nullptr),
        Status::kOk);
    if (step == 0) {
      ASSERT_EQ(both.gpu().reserve({.pairs = 1, .contacts = 1, .manifolds = 1, .points = 1}), Status::kOk);
      ASSERT_EQ(both.gpu().enqueue(on_gpu.instances(), on_gpu.pairs(), both.gpu_query(), {}, nullptr),
                Status::kOk);
      ASSERT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
      EXPECT_EQ(both.gpu().report().complete, 0u);
      EXPECT_EQ(both.gpu().report().needed.pairs, pairs.size());
      EXPECT_EQ(both.gpu().report().manifolds, 0u);
    }
    ASSERT_EQ(both.gpu().make(on_gpu.instances(), on_gpu.pairs(), both.gpu_query(), {}, nullptr),
              Status::kOk);
    expect_same(cpu, result_of(both.gpu()));
    move(scene.instances, random, 1e-3);
    // Twice the bodies from the second step on: more than there was room for.
    if (step == 0) {
      const std::vector<Instance> first = scene.instances;
      for (Instance instance : first) {
        instance.pose.translation[0] += 20;
        scene.instances.push_back(instance);
      }
      pairs = test::all_pairs(scene.instances, false, random);
    }
  }
}

TEST_F(GpuManifolds, OfAGraphThatIsReplayed) {
  BodyScene scene = boxes(60, 3, 59);
  test::RandomPoses random(60);
  BothSides both(scene.assets);
  const std::vector<ObjectPair> pairs = test::all_pairs(scene.instances, false, random);
  both.step(scene.instances, pairs);
  const GpuScene on_gpu(std::span<const AssetView>(), scene.instances, pairs);
  test::GraphStream stream;
  stream.capture([&] {
    EXPECT_EQ(
        both.gpu_query().enqueue(on_gpu.instances(), on_gpu.pairs(), test::grouped_options(), stream.get()),
        Status::kOk);
    return both.gpu().enqueue(on_gpu.instances(), on_gpu.pairs(), both.gpu_query(), {}, stream.get());
  });
  for (int step = 0; step < 3; ++step) {
    stream.launch();
    expect_same(both.on_cpu(scene.instances, pairs), result_of(both.gpu()));
  }
}

TEST_F(GpuManifolds, HaveFromOneToSevenPoints) {
  const BodyScene scene = boxes(2, 0.5, 3);
  BothSides both(scene.assets);
  const GpuScene on_gpu(std::span<const AssetView>(), scene.instances, {{0, 1}});
  ASSERT_EQ(
      both.gpu_query().find_contacts(on_gpu.instances(), on_gpu.pairs(), test::grouped_options(), nullptr),
      Status::kOk);
  const auto make = [&](std::uint32_t most_points) {
    const ManifoldOptions options = {.most_points = most_points};
    return both.gpu().make(on_gpu.instances(), on_gpu.pairs(), both.gpu_query(), options, nullptr);
  };
  for (const std::uint32_t bad : {0u, kMostManifoldPoints + 1, 4000000000u})
    EXPECT_EQ(make(bad), Status::kBadOption) << bad;
  for (const std::uint32_t good : {1u, kMostManifoldPoints}) EXPECT_EQ(make(good), Status::kOk) << good;
}

/// Both sides of a scene whose manifolds are kept.
class KeptOnBothSides {
 public:
  explicit KeptOnBothSides(const test::SampleAssets& assets)
      : uploaded_(assets, {}, {}, Contents::manifolds) {
    EXPECT_EQ(scene_.set_assets(assets.views()), Status::kOk);
    EXPECT_EQ(gpu_moved_.set_assets(uploaded_.assets(), nullptr), Status::kOk);
    EXPECT_EQ(gpu_query_.set_assets(uploaded_.assets(), nullptr), Status::kOk);
    EXPECT_EQ(gpu_.set_assets(uploaded_.assets(), nullptr), Status::kOk);
  }

  Result on_cpu(const std::vector<Instance>& instances, const std::vector<ObjectPair>& pairs,
                const MovedOptions& options, bool match_previous) {
    EXPECT_EQ(scene_.place(instances), Status::kOk);
    EXPECT_EQ(moved_.find(scene_, pairs, options), Status::kOk);
    EXPECT_EQ(query_.find(scene_, moved_.rows(), {}), Status::kOk);
    EXPECT_EQ(manifolds_.find(scene_, moved_, query_, {.match_previous = match_previous}), Status::kOk);
    return {{manifolds_.rows().begin(), manifolds_.rows().end()},
            {manifolds_.points().begin(), manifolds_.points().end()},
            manifolds_.counters()};
  }

  /// What moved, on both sides.
  void expect_same_moved() const {
    const GpuMoved moved = gpu_moved_.moved();
    const std::size_t pairs = moved_.pairs().size();
    EXPECT_EQ(gpu_moved_.report().counters, moved_.counters());
    EXPECT_TRUE(std::ranges::equal(download(moved.kept_rows, pairs), moved_.kept_rows()));
    EXPECT_TRUE(std::ranges::equal(download(moved.moved.pairs, moved_.rows().size()), moved_.rows()));
    EXPECT_EQ(download(moved.moved.count, 1)[0], moved_.rows().size());
    const std::vector<PosedBodies> posed = download(moved.posed, pairs);
    for (std::size_t i = 0; i < pairs; ++i) {
      const PosedBodies &x = posed[i], &y = moved_.posed()[i];
      EXPECT_EQ(x.pair, y.pair);
      EXPECT_EQ(x.a.asset, y.a.asset);
      EXPECT_EQ(std::memcmp(&x.a.pose, &y.a.pose, sizeof(Pose)), 0);
      EXPECT_EQ(std::memcmp(&x.b.pose, &y.b.pose, sizeof(Pose)), 0);
    }
  }

  /// Result: the number of pairs that are kept.
  std::uint64_t step(const std::vector<Instance>& instances, const std::vector<ObjectPair>& pairs,
                     double tolerance, bool match_previous = true, const std::vector<double>& of_pair = {}) {
    const Result cpu = on_cpu(instances, pairs, {tolerance, of_pair}, match_previous);
    const GpuScene scene(std::span<const AssetView>(), instances, pairs);
    const auto tolerances = test::on_gpu(of_pair);
    const GpuMovedOptions options = {tolerance, of_pair.empty() ? nullptr : tolerances.data()};
    EXPECT_EQ(gpu_moved_.find(scene.instances(), scene.pairs(), options, nullptr), Status::kOk);
    expect_same_moved();
    const GpuMoved moved = gpu_moved_.moved();
    EXPECT_EQ(gpu_query_.find_contacts(scene.instances(), moved.moved, test::grouped_options(), nullptr),
              Status::kOk);
    EXPECT_EQ(gpu_.make(scene.instances(), moved, gpu_query_, {.match_previous = match_previous}, nullptr),
              Status::kOk);
    EXPECT_LE(gpu_.bytes(), most_manifold_bytes(gpu_.capacity(), uploaded_.assets().size()));
    EXPECT_LE(gpu_moved_.bytes(), most_moved_bytes(gpu_moved_.capacity(), uploaded_.assets().size()));
    expect_same(cpu, result_of(gpu_));
    return moved_.counters().kept;
  }

  GpuMovedQuery& gpu_moved() { return gpu_moved_; }
  GpuContactQuery& gpu_query() { return gpu_query_; }
  GpuManifoldQuery& gpu() { return gpu_; }

 private:
  Scene scene_;
  MovedQuery moved_;
  ContactQuery query_;
  ManifoldQuery manifolds_;
  GpuScene uploaded_;
  GpuMovedQuery gpu_moved_;
  GpuContactQuery gpu_query_;
  GpuManifoldQuery gpu_;
};

/// A part of all pairs, in their order or in none.
std::vector<ObjectPair> some_pairs(const std::vector<Instance>& instances, bool in_order,
                                   test::RandomPoses& random) {
  std::vector<ObjectPair> pairs = test::all_pairs(instances, false, random);
  for (ObjectPair& pair : pairs) {
    if (pair.b < pair.a) std::swap(pair.a, pair.b);
  }
  std::erase_if(pairs, [&](const ObjectPair&) { return random.below(10) == 0; });
  if (!in_order) std::ranges::shuffle(pairs, random.engine());
  return pairs;
}

TEST_F(GpuManifolds, ThatAreKeptAreTheCpus) {
  for (const bool in_order : {true, false}) {
    BodyScene scene = boxes(120, 4, 62);
    test::RandomPoses random(63);
    KeptOnBothSides both(scene.assets);
    std::uint64_t kept = 0;
    for (int step = 0; step < 10; ++step) {
      const std::vector<ObjectPair> pairs = some_pairs(scene.instances, in_order, random);
      std::vector<double> of_pair;
      for (std::size_t i = 0; step == 6 && i < pairs.size(); ++i)
        of_pair.push_back(static_cast<double>(random.below(3)) * 2e-3);
      kept += both.step(scene.instances, pairs, step == 5 ? 0 : 3e-3, step != 4, of_pair);
      if (HasFailure()) return;
      if (step != 7) move(scene.instances, random, 5e-4);
    }
    EXPECT_GT(kept, 10'000u);
  }
}

/// What does not fit is told, and after the retry pairs are kept nevertheless.
TEST_F(GpuManifolds, ThatAreKeptStayWhenRoomGrows) {
  BodyScene scene = boxes(60, 3, 64);
  test::RandomPoses random(65);
  KeptOnBothSides both(scene.assets);
  std::vector<ObjectPair> pairs = test::all_pairs(scene.instances, false, random);
  ASSERT_EQ(both.gpu_moved().reserve({.pairs = 1}), Status::kOk);
  ASSERT_EQ(both.gpu().reserve({.pairs = 1, .contacts = 1, .manifolds = 1, .points = 1}), Status::kOk);
  both.step(scene.instances, pairs, 0.1);
  const std::vector<Instance> first = scene.instances;
  for (Instance instance : first) {
    instance.pose.translation[0] += 20;
    scene.instances.push_back(instance);
  }
  pairs = test::all_pairs(scene.instances, false, random);
  for (ObjectPair& pair : pairs) {
    if (pair.b < pair.a) std::swap(pair.a, pair.b);
  }
  both.step(scene.instances, pairs, 0.1);
  EXPECT_GT(both.step(scene.instances, pairs, 0.1), 1000u);
}

TEST_F(GpuManifolds, ThatAreKeptByAGraphThatIsReplayed) {
  BodyScene scene = boxes(60, 3, 66);
  test::RandomPoses random(67);
  KeptOnBothSides both(scene.assets);
  const std::vector<ObjectPair> pairs = test::all_pairs(scene.instances, false, random);
  both.step(scene.instances, pairs, 0);
  both.step(scene.instances, pairs, 0);
  const GpuScene on_gpu(std::span<const AssetView>(), scene.instances, pairs);
  test::GraphStream stream;
  stream.capture([&] {
    EXPECT_EQ(both.gpu_moved().enqueue(on_gpu.instances(), on_gpu.pairs(), {.tolerance = 1}, stream.get()),
              Status::kOk);
    const GpuMoved moved = both.gpu_moved().moved();
    EXPECT_EQ(
        both.gpu_query().enqueue(on_gpu.instances(), moved.moved, test::grouped_options(), stream.get()),
        Status::kOk);
    return both.gpu().enqueue(on_gpu.instances(), moved, both.gpu_query(), {}, stream.get());
  });
  for (int step = 0; step < 3; ++step) {
    stream.launch();
    const Result cpu = both.on_cpu(scene.instances, pairs, {.tolerance = 1}, true);
    both.expect_same_moved();
    EXPECT_EQ(both.gpu_moved().report().counters.kept, pairs.size());
    expect_same(cpu, result_of(both.gpu()));
  }
}

TEST_F(GpuManifolds, ThatTheCallBeforeDidNotReturnAreRefused) {
  BodyScene scene = boxes(60, 3, 68);
  test::RandomPoses random(69);
  KeptOnBothSides both(scene.assets);
  const std::vector<ObjectPair> pairs = test::all_pairs(scene.instances, false, random);
  both.step(scene.instances, pairs, 1);
  const GpuScene on_gpu(std::span<const AssetView>(), scene.instances, pairs);
  const auto status = [&] {
    const GpuMoved moved = both.gpu_moved().moved();
    EXPECT_EQ(
        both.gpu_query().find_contacts(on_gpu.instances(), moved.moved, test::grouped_options(), nullptr),
        Status::kOk);
    return both.gpu().make(on_gpu.instances(), moved, both.gpu_query(), {}, nullptr);
  };
  for (int call = 0; call < 2; ++call) {  // of one of them there are no manifolds
    EXPECT_EQ(both.gpu_moved().find(on_gpu.instances(), on_gpu.pairs(), {.tolerance = 1}, nullptr),
              Status::kOk);
  }
  EXPECT_EQ(status(), Status::kKeptMismatch);
  EXPECT_EQ(both.gpu_moved().forget_poses(nullptr), Status::kOk);
  EXPECT_EQ(both.gpu_moved().find(on_gpu.instances(), on_gpu.pairs(), {.tolerance = 1}, nullptr),
            Status::kOk);
  EXPECT_EQ(both.gpu_moved().report().counters.kept, 0u);
  EXPECT_EQ(status(), Status::kOk);
  EXPECT_EQ(both.gpu_moved().find(on_gpu.instances(), on_gpu.pairs(), {.tolerance = -1}, nullptr),
            Status::kBadTolerance);
}

/// A scene that a GPU answers keeps what one on the CPU keeps.
TEST_F(GpuManifolds, OfAGpuSceneAreKept) {
  BodyScene bodies = boxes(80, 3, 70);
  test::RandomPoses random(71);
  tandem::GpuScene on_gpu;
  Scene on_cpu;
  struct Side {
    Scene& scene;
    MovedQuery moved;
    ContactQuery query;
    ManifoldQuery manifolds;

    void step(const std::vector<Instance>& instances, double tolerance) {
      ASSERT_EQ(scene.place(instances), Status::kOk);
      ASSERT_EQ(moved.find(scene, {.tolerance = tolerance}), Status::kOk);
      ASSERT_EQ(query.find(scene, moved.rows(), {}), Status::kOk);
      ASSERT_EQ(manifolds.find(scene, moved, query), Status::kOk);
    }
    Result result() const {
      return {{manifolds.rows().begin(), manifolds.rows().end()},
              {manifolds.points().begin(), manifolds.points().end()},
              manifolds.counters()};
    }
  };
  Side cpu = {on_cpu, {}, {}, {}}, gpu = {on_gpu, {}, {}, {}};
  ASSERT_EQ(on_cpu.set_assets(bodies.assets.views()), Status::kOk);
  ASSERT_EQ(on_gpu.set_assets(bodies.assets.views()), Status::kOk);
  for (int step = 0; step < 6 && !HasFailure(); ++step) {
    const double tolerance = step == 4 ? INFINITY : 3e-3;
    cpu.step(bodies.instances, tolerance);
    gpu.step(bodies.instances, tolerance);
    expect_same(cpu.result(), gpu.result());
    EXPECT_EQ(cpu.moved.counters(), gpu.moved.counters());
    EXPECT_EQ(step > 0, cpu.moved.counters().kept > 0);
    move(bodies.instances, random, 5e-4);
  }
}

TEST_F(GpuManifolds, NeedTopology) {
  test::expect_needed<GpuManifoldQuery>(boxes(2, 1, 61), Contents::exact_queries, Status::kNoTopology);
}

}  // namespace
}  // namespace tandem
