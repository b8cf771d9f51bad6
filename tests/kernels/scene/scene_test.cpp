// Bodies that are placed, added, moved and removed: what the scene finds is what a scene finds that is made
// of these bodies at once.
#include "tandem/kernels/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/contact/contact_query_fixture.h"
#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/distance_query.h"
#include "tandem/kernels/impact_query.h"
#include "tandem/kernels/manifold_query.h"
#include "tandem/kernels/tolerance_query.h"

namespace tandem {
namespace {

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

Pairs pairs_of(const Scene& scene) {
  Pairs out;
  for (const ObjectPair& pair : scene.pairs()) out.emplace_back(pair.a, pair.b);
  return out;
}

/// A scene that changes step by step, beside a list of its bodies.
class ChangingScene {
 public:
  explicit ChangingScene(std::uint64_t seed, int bodies) : random_(seed), start_(crowd(seed, bodies)) {
    EXPECT_EQ(scene_.set_assets(start_.assets.views()), Status::kOk);
    bodies_ = start_.instances;
    filters_.resize(bodies_.size());
    for (BodyFilter& filter : filters_) filter = any_filter();
    place();
  }

  Scene& scene() { return scene_; }

  void place() {
    drop_removed();
    const Arrays arrays(filters_);
    ASSERT_EQ(scene_.place(bodies_, arrays.view()), Status::kOk);
  }

  /// One of the ways to change the scene.
  void change() {
    const auto body = static_cast<std::uint32_t>(random_.below(bodies_.size()));
    const bool there = bodies_[body].asset != kNoIndex;
    switch (random_.below(6)) {
      case 0: {
        std::uint32_t number = kNoIndex;
        const Instance added = any_instance();
        const BodyFilter filter = any_filter();
        ASSERT_EQ(scene_.add(added, number, filter), Status::kOk);
        ASSERT_LE(number, bodies_.size());
        if (number == bodies_.size()) bodies_.push_back({kNoIndex, {}}), filters_.push_back({});
        ASSERT_EQ(bodies_[number].asset, kNoIndex);
        bodies_[number] = added;
        filters_[number] = filter;
        return;
      }
      case 1:
        ASSERT_EQ(scene_.remove(body), there ? Status::kOk : Status::kUnknownInstance);
        bodies_[body].asset = kNoIndex;
        return;
      case 2:
        filters_[body].motion = static_cast<Motion>(random_.below(4));
        ASSERT_EQ(scene_.set_motion(body, filters_[body].motion),
                  there ? Status::kOk : Status::kUnknownInstance);
        return;
      default:
        const Pose pose = any_instance().pose;
        ASSERT_EQ(scene_.move(body, pose), there ? Status::kOk : Status::kUnknownInstance);
        if (there) bodies_[body].pose = pose;
    }
  }

  /// Expects what a scene finds that is made anew of the bodies, whose numbers are their places among them.
  void expect_same(double reach, bool self_pairs) {
    std::vector<Instance> bodies;
    std::vector<BodyFilter> filters;
    std::vector<std::uint32_t> number;
    for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
      if (bodies_[i].asset == kNoIndex) continue;
      bodies.push_back(bodies_[i]);
      filters.push_back(filters_[i]);
      number.push_back(i);
    }
    const Arrays arrays(filters);
    Scene anew;
    ASSERT_EQ(anew.set_assets(start_.assets.views()), Status::kOk);
    ASSERT_EQ(anew.place(bodies, arrays.view()), Status::kOk);
    ASSERT_EQ(anew.find_pairs(reach, self_pairs), Status::kOk);
    Pairs expected;
    for (const auto& [a, b] : pairs_of(anew)) expected.emplace_back(number[a], number[b]);
    ASSERT_EQ(scene_.find_pairs(reach, self_pairs), Status::kOk);
    EXPECT_EQ(pairs_of(scene_), expected);
    ContactQuery here, there;
    const ContactOptions options = {.self_pairs = self_pairs, .within = reach};
    ASSERT_EQ(here.find(scene_, options), Status::kOk);
    ASSERT_EQ(there.find(anew, options), Status::kOk);
    EXPECT_TRUE(std::ranges::equal(here.rows(), there.rows()));
    EXPECT_EQ(here.counters(), there.counters());
    found_ += here.rows().size();
  }

  std::size_t found() const { return found_; }

 private:
  struct Arrays {
    explicit Arrays(const std::vector<BodyFilter>& filters) {
      for (const BodyFilter& filter : filters) {
        motion.push_back(filter.motion);
        group.push_back(filter.group);
        mask.push_back(filter.mask);
      }
    }
    PairFilter view() const { return {motion.data(), group.data(), mask.data(), {}}; }
    std::vector<Motion> motion;
    std::vector<std::uint32_t> group, mask;
  };

  // place() takes bodies that are there.
  void drop_removed() {
    for (std::size_t i = bodies_.size(); i-- > 0;) {
      if (bodies_[i].asset != kNoIndex) continue;
      bodies_.erase(bodies_.begin() + static_cast<std::ptrdiff_t>(i));
      filters_.erase(filters_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }

  Instance any_instance() {
    Pose pose = any_rotation(random_);
    for (double& x : pose.translation) x = random_.symmetric(3);
    return {static_cast<std::uint32_t>(random_.below(3)), pose};
  }
  BodyFilter any_filter() {
    BodyFilter filter;
    if (random_.below(3) == 0) filter.motion = static_cast<Motion>(random_.below(4));
    if (random_.below(4) == 0) filter.group = 1u << random_.below(3);
    if (random_.below(4) == 0) filter.mask = ~(1u << random_.below(3));
    return filter;
  }

  RandomPoses random_;
  BodyScene start_;
  Scene scene_;
  std::vector<Instance> bodies_;
  std::vector<BodyFilter> filters_;
  std::size_t found_ = 0;
};

TEST(Scene, FindsThePairsOfItsBodiesWhateverChanged) {
  std::size_t found = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    ChangingScene changing(seed, 40 + static_cast<int>(seed) * 5);
    if (seed % 3 == 1) changing.scene().set_threads(3);
    RandomPoses random(100 + seed);
    double reach = 0;
    bool selves = false;
    for (int step = 0; step < 30 && !testing::Test::HasFailure(); ++step) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", step " << step);
      const std::uint64_t changes = random.below(3) == 0 ? random.below(40) : random.below(4);
      for (std::uint64_t i = 0; i < changes; ++i) changing.change();
      if (random.below(6) == 0) changing.place();
      if (random.below(4) == 0) reach = random.below(2) == 0 ? 0 : random.uniform(0, 1);
      if (random.below(5) == 0) selves = !selves;
      changing.expect_same(reach, selves);
    }
    found += changing.found();
  }
  EXPECT_GT(found, 10'000u);
}

TEST(Scene, RefusesListsOfDifferentLengths) {
  const BodyScene cubes = row_of_cubes(4);
  Scene scene;
  ASSERT_EQ(scene.set_assets(cubes.assets.views()), Status::kOk);
  ASSERT_EQ(scene.place(cubes.instances), Status::kOk);
  const std::uint32_t numbers[] = {2, 0};
  const Pose poses[] = {at(50, 0, 0)};
  EXPECT_EQ(scene.move(numbers, poses), Status::kMotionMismatch);
  EXPECT_EQ(scene.instances()[2].pose.translation[0], cubes.instances[2].pose.translation[0]);
}

/// One scene, all questions: what each finds does not depend on which others were asked before.
TEST(Scene, AnswersManyQuestionsAboutTheSameBodies) {
  const BodyScene bodies = crowd(11, 60);
  const std::vector<RigidMotion> motion(bodies.instances.size(),
                                        RigidMotion{{1, 0, 0}, {0, 0, 1}, {0, 0, 0}});
  Scene scene;
  ASSERT_EQ(scene.set_assets(bodies.assets.views()), Status::kOk);
  ASSERT_EQ(scene.place(bodies.instances), Status::kOk);
  ContactQuery contacts;
  ManifoldQuery manifolds;
  ContainmentQuery contained;
  DistanceQuery distances;
  ImpactQuery impacts;
  ToleranceQuery verdicts;
  const ImpactOptions step = {.motion = motion, .duration = 0.1};
  const auto ask_all = [&] {
    ASSERT_EQ(verdicts.find(scene), Status::kOk);
    ASSERT_EQ(distances.find(scene, {.reach = 0.5}), Status::kOk);
    ASSERT_EQ(contacts.find(scene), Status::kOk);
    ASSERT_EQ(impacts.find(scene, step), Status::kOk);
    ASSERT_EQ(manifolds.find(scene, contacts, {.match_previous = false}), Status::kOk);
    ASSERT_EQ(contained.find(scene, contacts), Status::kOk);
  };
  ask_all();
  EXPECT_EQ(verdicts.pairs().size(), contacts.pairs().size());
  EXPECT_GT(distances.pairs().size(), contacts.pairs().size());
  EXPECT_GT(impacts.rows().size(), contacts.pairs().size());
  EXPECT_GT(manifolds.rows().size(), 10u);
  const std::vector<Contact> before = contacts_of(contacts);
  const std::vector<ObjectDistance> distances_before(distances.rows().begin(), distances.rows().end());
  const std::size_t impacts_before = impacts.rows().size(), manifolds_before = manifolds.rows().size();
  ASSERT_EQ(scene.move(3, at(100, 0, 0)), Status::kOk);
  ask_all();
  EXPECT_LT(contacts.rows().size(), before.size());
  ASSERT_EQ(scene.move(3, bodies.instances[3].pose), Status::kOk);
  ask_all();
  EXPECT_EQ(contacts_of(contacts), before);
  EXPECT_TRUE(std::ranges::equal(distances.rows(), distances_before));
  EXPECT_EQ(impacts.rows().size(), impacts_before);
  EXPECT_EQ(manifolds.rows().size(), manifolds_before);
}

}  // namespace
}  // namespace tandem
