#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "manifold_scene.h"

namespace tandem::test {
namespace {

/// A heap of bodies of many kinds, whose pairs are kept while they move by no more than a tolerance.
class Heap {
 public:
  explicit Heap(std::uint64_t seed, int count = 120) {
    RandomPoses random(seed);
    for (const Mesh& mesh : {cube(0.3f, 2), tetrahedron(), sphere(0.4, 2), pipe(12, 0.2, 0.4, 0.4f),
                             sheet(1, 3), project_mesh("cow_1500.obj")}) {
      assets_.add(mesh, {random.symmetric(3), 0, 0});
    }
    for (int i = 0; i < count; ++i)
      bodies.push_back({static_cast<std::uint32_t>(random.below(6)), any_motion(random, 1)});
    for (Instance& body : bodies) body.pose.translation[0] -= 3;
    EXPECT_EQ(scene.set_assets(assets_.views()), Status::kOk);
  }

  void find(double tolerance, const ManifoldOptions& options = {}) {
    ASSERT_EQ(scene.place(bodies), Status::kOk);
    ASSERT_EQ(moved.find(scene, {.tolerance = tolerance}), Status::kOk);
    ASSERT_EQ(contacts.find(scene, moved.rows(), {}), Status::kOk);
    ASSERT_EQ(made.find(scene, moved, contacts, options), Status::kOk);
  }

  void shake(RandomPoses& random, double by) {
    for (Instance& body : bodies) {
      for (double& x : body.pose.translation) x += random.symmetric(by);
    }
  }

  const Instance& body(std::uint32_t i) const { return bodies[i]; }
  ObjectPair pair_of(const Manifold& m) const { return made.pairs()[m.pair]; }

  std::vector<Instance> bodies;
  Scene scene;
  MovedQuery moved;
  ContactQuery contacts;
  ManifoldQuery made;

 private:
  SampleAssets assets_;
};

/// The rows of a call.
struct Made {
  std::vector<ObjectPair> pairs;
  std::vector<Manifold> manifolds;
  std::vector<ManifoldPoint> points;

  explicit Made(const ManifoldQuery& query)
      : pairs(query.pairs().begin(), query.pairs().end()),
        manifolds(query.rows().begin(), query.rows().end()),
        points(query.points().begin(), query.points().end()) {}
};

// Indices are those of the rows, and ascend.
void expect_order(const Heap& heap) {
  std::uint32_t next = 0, pair = 0, index = 0;
  for (const Manifold& m : heap.made.rows()) {
    EXPECT_GE(m.pair, pair);
    EXPECT_EQ(m.first_point, next);
    for (std::uint32_t k = 0; k < m.point_count; ++k) EXPECT_EQ(heap.made.points()[next + k].manifold, index);
    next += m.point_count, pair = m.pair, ++index;
  }
  EXPECT_EQ(next, heap.made.points().size());
  EXPECT_TRUE(std::ranges::equal(heap.made.pairs(), heap.moved.pairs()));
}

TEST(KeptManifolds, OfBodiesThatStandStillKeepTheirBytes) {
  Heap heap(1);
  const ManifoldOptions of_features = {.match_previous = false};
  heap.find(0.01, of_features);
  const Made found(heap.made);
  const ManifoldCounters counters = heap.made.counters();
  EXPECT_GT(found.manifolds.size(), 100u);
  for (int step = 0; step < 3; ++step) {
    heap.find(0.01, of_features);
    EXPECT_TRUE(heap.contacts.pairs().empty());
    EXPECT_TRUE(same_bytes<Manifold>(found.manifolds, heap.made.rows()));
    EXPECT_TRUE(same_bytes<ManifoldPoint>(found.points, heap.made.points()));
    EXPECT_EQ(heap.made.counters().manifolds, counters.manifolds);
    EXPECT_EQ(heap.made.counters().open_curves, counters.open_curves);
    EXPECT_EQ(heap.made.counters().ambiguous_touches, counters.ambiguous_touches);
    expect_order(heap);
  }
  // Moved and put back, they are the same again.
  const std::vector<Instance> before = heap.bodies;
  RandomPoses random(2);
  heap.shake(random, 0.001);
  heap.find(0.01, of_features);
  EXPECT_FALSE(same_bytes<Manifold>(found.manifolds, heap.made.rows()));
  EXPECT_GT(heap.moved.counters().kept, 100u);
  heap.bodies = before;
  heap.find(0.01, of_features);
  for (const Manifold& m : heap.made.rows()) {
    const auto same = [&](const Manifold& other) {
      return found.pairs[other.pair] == heap.pair_of(m) &&
             std::memcmp(other.normal, m.normal, sizeof m.normal) == 0 && other.depth == m.depth &&
             std::memcmp(other.centre, m.centre, sizeof m.centre) == 0;
    };
    EXPECT_TRUE(std::ranges::any_of(found.manifolds, same));
  }
}

// Their points are as deep but for rounding, so the first is not always the deepest.
TEST(KeptManifolds, OfAStackThatStandsStillKeepTheirBytes) {
  Heap heap(3, 64);
  RandomPoses random(4);
  const Pose common = any_motion(random, 1);
  for (std::uint32_t i = 0; i < 64; ++i) {
    Instance& body = heap.bodies[i] = {0, common};
    const double spacing = 0.6 - 1e-3;
    apply(common, spacing * (i % 4), spacing * (i / 4 % 4), spacing * (i / 16), body.pose.translation);
  }
  const ManifoldOptions of_features = {.match_previous = false};
  heap.find(0.01, of_features);
  const Made found(heap.made);
  EXPECT_GT(found.manifolds.size(), 100u);
  heap.find(0.01, of_features);
  EXPECT_TRUE(heap.contacts.pairs().empty());
  EXPECT_TRUE(same_bytes<Manifold>(found.manifolds, heap.made.rows()));
}

double distance(const Vector3& x, const Vector3& y) {
  return norm(x - y);
}

TEST(KeptManifolds, OfBodiesThatMoveTogetherMoveWithThem) {
  Heap heap(3);
  heap.find(1e-9);
  const Made found(heap.made);
  RandomPoses random(4);
  for (int step = 0; step < 3; ++step) {
    const Pose by = any_motion(random, 2);
    const std::vector<Instance> before = heap.bodies;
    for (Instance& body : heap.bodies) body.pose = after(by, body.pose);
    heap.find(1e-9);
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> first;
    for (std::uint32_t i = 0; i < found.manifolds.size(); ++i) {
      const ObjectPair pair = found.pairs[found.manifolds[i].pair];
      first.try_emplace({pair.a, pair.b}, i);
    }
    std::size_t kept = 0;
    for (std::uint32_t i = 0; i < heap.made.rows().size(); ++i) {
      const Manifold& m = heap.made.rows()[i];
      if (heap.moved.kept_rows()[m.pair] == kNoIndex) continue;
      const ObjectPair pair = heap.pair_of(m);
      const Manifold& of = found.manifolds[first.at({pair.a, pair.b})++];
      ++kept;
      EXPECT_LT(distance(vector_of(m.normal), rotate(by, vector_of(of.normal))), 1e-13);
      EXPECT_LT(distance(vector_of(m.area_vector), rotate(by, vector_of(of.area_vector))), 1e-13);
      EXPECT_LT(distance(vector_of(m.centre), apply(by, vector_of(of.centre))), 1e-13);
      EXPECT_NEAR(m.depth, of.depth, 1e-13);
      ASSERT_EQ(m.point_count, of.point_count);
      EXPECT_EQ(m.flags, of.flags);
      for (std::uint32_t k = 0; k < m.point_count; ++k) {
        const ManifoldPoint &p = heap.made.points()[m.first_point + k], &q = found.points[of.first_point + k];
        EXPECT_EQ(p.id, q.id);
        EXPECT_LT(distance(vector_of(p.position), apply(by, vector_of(q.position))), 1e-13);
        EXPECT_NEAR(p.depth, q.depth, 1e-13);
        EXPECT_EQ(std::memcmp(p.in_a, q.in_a, sizeof p.in_a), 0);
        EXPECT_EQ(std::memcmp(p.in_b, q.in_b, sizeof p.in_b), 0);
      }
    }
    EXPECT_EQ(kept, found.manifolds.size());
    heap.bodies = before;
  }
}

// A heap that moves a little: what a kept manifold is, by its own points.
TEST(KeptManifolds, ArePlacedByTheirPointsOnBothBodies) {
  Heap heap(5);
  RandomPoses random(6);
  std::size_t kept = 0, apart = 0;
  heap.find(0.004);
  for (int step = 0; step < 6; ++step) {
    for (Instance& body : heap.bodies) {
      body.pose = after(body.pose, turn(static_cast<int>(random.below(3)), random.symmetric(1e-4)));
    }
    heap.shake(random, 4e-4);
    const Made before(heap.made);
    heap.find(0.004);
    expect_order(heap);
    for (const Manifold& m : heap.made.rows()) {
      if ((m.flags & kAmbiguous) != 0) continue;
      EXPECT_NEAR(norm(vector_of(m.normal)), 1, 1e-14);
      if (heap.moved.kept_rows()[m.pair] == kNoIndex) continue;
      const ObjectPair pair = heap.pair_of(m);
      const Pose &a = heap.body(pair.a).pose, &b = heap.body(pair.b).pose;
      double deepest = -INFINITY;
      for (const ManifoldPoint& p : heap.made.points().subspan(m.first_point, m.point_count)) {
        const Vector3 on_a = apply(a, vector_of(p.in_a)), on_b = apply(b, vector_of(p.in_b));
        EXPECT_LT(distance(vector_of(p.position), 0.5 * (on_a + on_b)), 1e-14);
        EXPECT_NEAR(p.depth, dot(vector_of(p.normal), on_a - on_b), 1e-14);
        deepest = std::max(deepest, p.depth);
        ASSERT_NE(p.previous, kNoIndex);
        const ManifoldPoint& q = before.points[p.previous];
        EXPECT_EQ(p.id, q.id);
        EXPECT_EQ(std::memcmp(p.in_a, q.in_a, sizeof p.in_a), 0);
        EXPECT_TRUE(before.pairs[before.manifolds[q.manifold].pair] == pair);
        apart += p.depth < 0;
      }
      EXPECT_EQ(m.depth, deepest);
      ++kept;
    }
  }
  EXPECT_GT(kept, 300u);
  EXPECT_GT(apart, 0u);
}

// The normal is that of the larger body, so a small one that rocks on a plate does not turn it.
TEST(KeptManifolds, NormalsTurnWithTheLargerBody) {
  for (const bool exchanged : {false, true}) {
    SampleAssets assets;
    assets.add(box(4, 4, 1));
    assets.add(cube(0.5f));
    Scene scene;
    MovedQuery moved;
    ContactQuery contacts;
    ManifoldQuery made;
    ASSERT_EQ(scene.set_assets(assets.views()), Status::kOk);
    const auto normal_with = [&](const Pose& plate, const Pose& on_it) {
      std::vector<Instance> bodies = {{0, plate}, {1, on_it}};
      if (exchanged) std::swap(bodies[0], bodies[1]);
      EXPECT_EQ(scene.place(bodies), Status::kOk);
      EXPECT_EQ(moved.find(scene, {.tolerance = 0.01}), Status::kOk);
      EXPECT_EQ(contacts.find(scene, moved.rows(), {}), Status::kOk);
      EXPECT_EQ(made.find(scene, moved, contacts), Status::kOk);
      EXPECT_EQ(made.rows().size(), 1u);
      return (exchanged ? -1.0 : 1.0) * vector_of(made.rows()[0].normal);
    };
    const Pose rests = shift(0, 0, 0.999);
    const Vector3 up = {0, 0, 1};
    EXPECT_LT(distance(normal_with(kIdentityPose, rests), up), 1e-15);
    EXPECT_LT(distance(normal_with(kIdentityPose, after(rests, turn(0, 0.005))), up), 1e-15);
    EXPECT_TRUE(moved.rows().empty());
    const Pose tilt = turn(1, 0.004);
    EXPECT_LT(distance(normal_with(tilt, rests), rotate(tilt, up)), 1e-15);
    EXPECT_TRUE(moved.rows().empty());
  }
}

// Of pairs that have moved there are the rows that a question about these alone finds.
TEST(KeptManifolds, OthersAreFoundAsEver) {
  Heap heap(7);
  RandomPoses random(8);
  heap.find(1e-6);
  for (int step = 0; step < 4; ++step) {
    for (int i = 0; i < 20; ++i) {
      for (double& x : heap.bodies[random.below(heap.bodies.size())].pose.translation)
        x += random.symmetric(1e-3);
    }
    heap.find(1e-6);
    expect_order(heap);
    EXPECT_GT(heap.moved.counters().kept, 0u);
    EXPECT_GT(heap.moved.rows().size(), 0u);
    ManifoldQuery alone;
    ASSERT_EQ(alone.find(heap.scene, heap.contacts, {.match_previous = false}), Status::kOk);
    std::size_t next = 0;
    for (const Manifold& m : heap.made.rows()) {
      if (heap.moved.kept_rows()[m.pair] != kNoIndex) continue;
      ASSERT_LT(next, alone.rows().size());
      const Manifold& of = alone.rows()[next++];
      EXPECT_TRUE(heap.pair_of(m) == alone.pairs()[of.pair]);
      EXPECT_EQ(std::memcmp(&m, &of, offsetof(Manifold, pair)), 0);
      ASSERT_EQ(m.point_count, of.point_count);
      for (std::uint32_t k = 0; k < m.point_count; ++k) {
        EXPECT_EQ(std::memcmp(&heap.made.points()[m.first_point + k], &alone.points()[of.first_point + k],
                              offsetof(ManifoldPoint, id)),
                  0);
      }
    }
    EXPECT_EQ(next, alone.rows().size());
    EXPECT_EQ(heap.made.counters().manifolds, heap.made.rows().size());
    EXPECT_EQ(heap.made.counters().contacts, heap.contacts.rows().size());
  }
}

// A pair that moves finds its points among those that it kept.
TEST(KeptManifolds, IdsLastFromKeptOnesToFoundOnes) {
  Heap heap(9);
  RandomPoses random(10);
  std::size_t matched = 0, all = 0;
  heap.find(1e-4);
  for (int step = 0; step < 8; ++step) {
    heap.shake(random, 3e-5);
    const Made before(heap.made);
    heap.find(1e-4);
    for (const ManifoldPoint& p : heap.made.points()) {
      const bool kept = heap.moved.kept_rows()[heap.made.rows()[p.manifold].pair] != kNoIndex;
      EXPECT_TRUE(!kept || p.previous != kNoIndex);
      EXPECT_TRUE(p.previous == kNoIndex || p.id == before.points[p.previous].id);
      matched += !kept && p.previous != kNoIndex;
      all += !kept;
    }
  }
  EXPECT_GT(all, 300u);
  EXPECT_GT(static_cast<double>(matched), 0.9 * static_cast<double>(all));
}

TEST(KeptManifolds, ThreadsAndTheOrderOfContactsDoNotChangeAByte) {
  Heap one(11), many(11);
  RandomPoses random(12);
  for (std::uint32_t threads = 1; threads <= 8; ++threads) {
    one.shake(random, 1e-3);
    many.bodies = one.bodies;
    ASSERT_EQ(many.scene.set_threads(threads), Status::kOk);
    one.find(0.003);
    ASSERT_EQ(many.scene.place(many.bodies), Status::kOk);
    ASSERT_EQ(many.moved.find(many.scene, {.tolerance = 0.003}), Status::kOk);
    ASSERT_EQ(many.contacts.find(many.scene, many.moved.rows(), {}), Status::kOk);
    std::vector<Contact> contacts(many.contacts.rows().begin(), many.contacts.rows().end());
    std::ranges::shuffle(contacts, random.engine());
    ASSERT_EQ(many.made.find(many.scene, many.moved, contacts), Status::kOk);
    EXPECT_TRUE(same_bytes(one.made.rows(), many.made.rows())) << threads;
    EXPECT_TRUE(same_bytes(one.made.points(), many.made.points())) << threads;
    EXPECT_EQ(one.made.counters(), many.made.counters());
  }
  EXPECT_GT(one.moved.counters().kept, 0u);
}

TEST(KeptManifolds, PairsWithoutManifoldsAreNotAskedAgain) {
  Heap heap(13);
  heap.find(0.01);
  std::vector<char> has(heap.made.pairs().size(), 0);
  for (const Manifold& m : heap.made.rows()) has[m.pair] = 1;
  EXPECT_GT(std::ranges::count(has, 0), 50);
  RandomPoses random(14);
  heap.shake(random, 1e-4);
  heap.find(0.01);
  EXPECT_LT(heap.contacts.pairs().size(), 20u);  // those whose boxes have come to meet
}

TEST(KeptManifolds, ThatTheCallBeforeDidNotReturnAreRefused) {
  Heap heap(15, 20);
  heap.find(0.01);
  const auto refused = [&](ManifoldQuery& query) {
    const Status status = query.find(heap.scene, heap.moved, heap.contacts);
    EXPECT_TRUE(status == Status::kOk || (query.rows().empty() && query.points().empty()));
    return status == Status::kKeptMismatch;
  };
  heap.find(0.01);
  ASSERT_GT(heap.moved.counters().kept, 0u);
  EXPECT_TRUE(refused(heap.made));  // twice of one call
  ManifoldQuery other;
  EXPECT_TRUE(refused(other));
  heap.moved.forget_poses();
  EXPECT_TRUE(refused(heap.made));
  EXPECT_EQ(other.find(heap.scene, MovedQuery(), heap.contacts), Status::kKeptMismatch);
  heap.find(0.01);
  heap.find(0.01);
  ASSERT_EQ(heap.moved.find(heap.scene, {.tolerance = 0.01}), Status::kOk);  // a call is left out
  ASSERT_EQ(heap.moved.find(heap.scene, {.tolerance = 0.01}), Status::kOk);
  EXPECT_TRUE(refused(heap.made));
  heap.moved.forget_poses();
  heap.find(0.01);
  // The bodies have moved, or the contacts are of other pairs.
  heap.bodies[0].pose.translation[0] += 0.5;
  ASSERT_EQ(heap.scene.place(heap.bodies), Status::kOk);
  EXPECT_TRUE(refused(heap.made));
  ASSERT_EQ(heap.moved.find(heap.scene, {}), Status::kOk);
  ASSERT_GT(heap.moved.rows().size(), 1u);
  ASSERT_EQ(heap.contacts.find(heap.scene, heap.moved.rows().subspan(1), {}), Status::kOk);
  EXPECT_TRUE(refused(heap.made));
  ASSERT_EQ(heap.contacts.find(heap.scene, heap.moved.rows(), {}), Status::kOk);
  EXPECT_FALSE(refused(heap.made));
}

}  // namespace
}  // namespace tandem::test
