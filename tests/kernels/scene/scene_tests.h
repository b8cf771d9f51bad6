#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <tuple>
#include <type_traits>
#include <vector>

#include "kernels/contact/contact_query_fixture.h"
#include "kernels/refit/bent_mesh.h"
#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/distance_query.h"
#include "tandem/kernels/impact_query.h"
#include "tandem/kernels/manifold_query.h"
#include "tandem/kernels/scene.h"
#include "tandem/kernels/tolerance_query.h"

/// Bodies that are placed, added, moved and removed: what a scene finds, on whatever device, is what a scene
/// on the CPU finds that is made of these bodies at once.
namespace tandem {

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

inline Pairs pairs_of(const Scene& scene) {
  Pairs out;
  for (const ObjectPair& pair : scene.pairs()) out.emplace_back(pair.a, pair.b);
  return out;
}

/// Says whether scenes of this kind can be made here.
template <typename TheScene>
bool is_usable() {
  return true;
}

/// All questions of a scene.
struct Questions {
  ContactQuery contacts;
  ManifoldQuery manifolds;
  MovedQuery moved;
  ContactQuery contacts_of_moved;
  ManifoldQuery kept;  // of pairs that stand still; so they are what others find
  ContainmentQuery contained;
  DistanceQuery distances;
  ImpactQuery impacts;
  ToleranceQuery verdicts;
  Status of_verdicts = Status::kOk;  // kDeformed: they are not offered

  /// Asks them. match_previous: whether points are looked for among those of the call before.
  void ask(Scene& scene, double reach, bool self_pairs, bool match_previous) {
    std::vector<RigidMotion> motion(scene.instances().size());
    RandomPoses random(motion.size());
    for (std::size_t i = 0; i < motion.size(); ++i) {
      for (double& x : motion[i].velocity) x = random.symmetric(0.5);
      for (double& x : motion[i].angular_velocity) x = random.symmetric(1);
      std::copy_n(scene.instances()[i].pose.translation, 3, motion[i].centre);
    }
    ASSERT_EQ(verdicts.find(scene, {.tolerance = 0.1}), of_verdicts);
    ASSERT_EQ(impacts.find(scene, {.motion = motion, .duration = 0.2}), Status::kOk);
    ASSERT_EQ(contacts.find(scene, {.self_pairs = self_pairs}), Status::kOk);
    ASSERT_EQ(distances.find(scene, {.reach = reach}), Status::kOk);
    ASSERT_EQ(manifolds.find(scene, contacts, {.match_previous = match_previous}), Status::kOk);
    ASSERT_EQ(contained.find(scene, contacts), Status::kOk);
    ASSERT_EQ(moved.find(scene, {.tolerance = 5e-324}), Status::kOk);
    ASSERT_EQ(contacts_of_moved.find(scene, moved.rows(), {}), Status::kOk);
    ASSERT_EQ(kept.find(scene, moved, contacts_of_moved, {.match_previous = false}), Status::kOk);
  }
};

/// The contacts of a question in an order of their own. In a pair of a body with itself either triangle may
/// be a.
inline std::vector<Contact> sorted(const ContactQuery& query) {
  std::vector<Contact> out(query.rows().begin(), query.rows().end());
  for (Contact& contact : out) {
    const ObjectPair& pair = query.pairs()[contact.pair];
    if (pair.a != pair.b || contact.triangle_a <= contact.triangle_b) continue;
    std::swap(contact.triangle_a, contact.triangle_b);
    std::swap(contact.face_a, contact.face_b);
  }
  std::ranges::sort(out, {}, [](const Contact& c) {
    return std::tuple(c.pair, c.face_a, c.face_b, c.triangle_a, c.triangle_b);
  });
  return out;
}

template <typename Row>
void expect_same_bytes(std::span<const Row> here, std::span<const Row> there) {
  ASSERT_EQ(here.size(), there.size());
  EXPECT_TRUE(here.empty() || std::memcmp(here.data(), there.data(), here.size_bytes()) == 0);
}

/// Expects that intervals meet, and that the same pairs touch.
inline void expect_same_distances(const DistanceQuery& here, const DistanceQuery& there) {
  ASSERT_EQ(here.rows().size(), there.rows().size());
  for (std::size_t i = 0; i < here.rows().size(); ++i) {
    const ObjectDistance &x = here.rows()[i], &y = there.rows()[i];
    EXPECT_TRUE(x.lower <= y.upper && y.lower <= x.upper) << i;
    EXPECT_EQ(x.upper == 0, y.upper == 0) << i;
  }
}

/// Expects the same of all questions but distances and impacts, which are only as certified: their intervals
/// meet, and they tell the same pairs apart from those that touch.
inline void expect_same_answers(const Questions& here, const Questions& there) {
  EXPECT_EQ(sorted(here.contacts), sorted(there.contacts));
  expect_same_bytes(here.manifolds.rows(), there.manifolds.rows());
  expect_same_bytes(here.manifolds.points(), there.manifolds.points());
  EXPECT_EQ(here.manifolds.counters(), there.manifolds.counters());
  EXPECT_TRUE(std::ranges::equal(here.kept.pairs(), there.kept.pairs()));
  expect_same_bytes(here.kept.rows(), there.kept.rows());
  expect_same_bytes(here.kept.points(), there.kept.points());
  EXPECT_TRUE(std::ranges::equal(here.contained.rows(), there.contained.rows()));
  EXPECT_EQ(here.contained.counters(), there.contained.counters());
  EXPECT_TRUE(std::ranges::equal(here.verdicts.rows(), there.verdicts.rows()));
  expect_same_distances(here.distances, there.distances);
  ASSERT_EQ(here.impacts.rows().size(), there.impacts.rows().size());
  for (std::size_t i = 0; i < here.impacts.rows().size(); ++i) {
    const Impact &x = here.impacts.rows()[i], &y = there.impacts.rows()[i];
    EXPECT_EQ(here.impacts.pairs()[i].b, there.impacts.pairs()[i].b);
    EXPECT_EQ(x.status, y.status) << i;
    EXPECT_NEAR(x.t_safe, y.t_safe, 1e-4) << i;
  }
}

/// A scene that changes step by step, beside a list of its bodies.
template <typename TheScene>
class ChangingScene {
 public:
  /// spread: half the side of the cube in which bodies are that were added or moved.
  explicit ChangingScene(std::uint64_t seed, int bodies, double spread = 3)
      : random_(seed), spread_(spread), start_(crowd(seed, bodies)) {
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

  /// Moves all bodies to places of their own choice.
  void scatter() {
    for (Instance& body : bodies_) body.pose = any_instance().pose;
    place();
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

  /// Places the bodies with another filter of one.
  void place_with_other_filter() {
    filters_[random_.below(bodies_.size())] = any_filter();
    place();
  }

  /// Moves all bodies that are not fixed by up to so much along each axis, each always the same way.
  void drift(double most) {
    RandomPoses way(bodies_.size());
    for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
      if (bodies_[i].asset == kNoIndex || filters_[i].motion == Motion::fixed) continue;
      for (double& x : bodies_[i].pose.translation) x += way.symmetric(most);
      ASSERT_EQ(scene_.move(i, bodies_[i].pose), Status::kOk);
    }
  }

  /// Expects what a scene finds that is made anew of the bodies, whose numbers are their places among them.
  void expect_same(double reach, bool self_pairs) {
    Scene anew;
    expect_same_pairs(reach, self_pairs, anew);
    ContactQuery here, there;
    const ContactOptions options = {.self_pairs = self_pairs, .within = reach};
    ASSERT_EQ(here.find(scene_, options), Status::kOk);
    ASSERT_EQ(there.find(anew, options), Status::kOk);
    EXPECT_EQ(sorted(here), sorted(there));
    if constexpr (std::is_same_v<TheScene, Scene>) {
      EXPECT_EQ(here.counters(), there.counters());
    }
    found_ += here.rows().size();
  }
  void expect_same_pairs(double reach, bool self_pairs, Scene& anew) {
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
    ASSERT_EQ(anew.set_assets(start_.assets.views()), Status::kOk);
    ASSERT_EQ(anew.place(bodies, arrays.view()), Status::kOk);
    ASSERT_EQ(anew.find_pairs(reach, self_pairs), Status::kOk);
    Pairs expected;
    for (const auto& [a, b] : pairs_of(anew)) expected.emplace_back(number[a], number[b]);
    ASSERT_EQ(scene_.find_pairs(reach, self_pairs), Status::kOk);
    EXPECT_EQ(pairs_of(scene_), expected);
  }

  std::size_t found() const { return found_; }

 private:
  struct Arrays {
    explicit Arrays(const std::vector<BodyFilter>& filters) {
      for (const BodyFilter& filter : filters) {
        motion.push_back(filter.motion);
        group.push_back(filter.group);
        mask.push_back(filter.mask);
        world.push_back(filter.world);
      }
    }
    PairFilter view() const { return {motion.data(), group.data(), mask.data(), world.data()}; }
    std::vector<Motion> motion;
    std::vector<std::uint32_t> group, mask, world;
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
    for (double& x : pose.translation) x = random_.symmetric(spread_);
    return {static_cast<std::uint32_t>(random_.below(3)), pose};
  }
  BodyFilter any_filter() {
    BodyFilter filter;
    if (random_.below(3) == 0) filter.motion = static_cast<Motion>(random_.below(4));
    if (random_.below(4) == 0) filter.group = 1u << random_.below(3);
    if (random_.below(4) == 0) filter.mask = ~(1u << random_.below(3));
    if (random_.below(4) == 0) filter.world = static_cast<std::uint32_t>(random_.below(2));
    return filter;
  }

  RandomPoses random_;
  double spread_;
  BodyScene start_;
  TheScene scene_;
  std::vector<Instance> bodies_;
  std::vector<BodyFilter> filters_;
  std::size_t found_ = 0;
};

template <typename TheScene>
class SceneOn : public testing::Test {
 protected:
  void SetUp() override {
    if (!is_usable<TheScene>()) GTEST_SKIP() << "no GPU here";
  }
};
TYPED_TEST_SUITE_P(SceneOn);

TYPED_TEST_P(SceneOn, FindsThePairsOfItsBodiesWhateverChanged) {
  std::size_t found = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    ChangingScene<TypeParam> changing(seed, 40 + static_cast<int>(seed) * 5);
    EXPECT_EQ(changing.scene().set_threads(seed % 3 == 1 ? 3 : 1), Status::kOk);
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

/// A tree follows the few that change, until it is worn out, or many have changed.
TYPED_TEST_P(SceneOn, FindsThePairsOfTheFewThatChange) {
  std::size_t found = 0;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    ChangingScene<TypeParam> changing(400 + seed, 600, 12);
    EXPECT_EQ(changing.scene().set_threads(seed % 3 == 1 ? 3 : 1), Status::kOk);
    RandomPoses random(500 + seed);
    double reach = 0;
    bool selves = false;
    for (int step = 0; step < 150 && !testing::Test::HasFailure(); ++step) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", step " << step);
      const std::uint64_t changes = random.below(18);
      for (std::uint64_t i = 0; i < changes; ++i) changing.change();
      if (step == 0 || random.below(50) == 0) changing.scatter();
      if (random.below(40) == 0) reach = random.below(3) == 0 ? HUGE_VAL : random.uniform(0, 1);
      if (random.below(40) == 0) selves = !selves;
      Scene anew;
      changing.expect_same_pairs(reach, selves, anew);
      found += anew.pairs().size();
    }
  }
  EXPECT_GT(found, 10'000u);
}

/// Pairs that were near serve for the next searches, until a body leaves its larger box.
TYPED_TEST_P(SceneOn, FindsThePairsOfBodiesThatHardlyMove) {
  std::size_t found = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    ChangingScene<TypeParam> changing(200 + seed, 60);
    EXPECT_EQ(changing.scene().set_threads(seed % 3 == 1 ? 3 : 1), Status::kOk);
    RandomPoses random(300 + seed);
    double reach = 0;
    for (int step = 0; step < 80 && !testing::Test::HasFailure(); ++step) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", step " << step);
      changing.drift(random.below(20) == 0 ? 0.3 : random.below(2) == 0 ? 0.01 : 0.001);
      if (random.below(32) == 0) changing.change(), changing.place();
      if (random.below(32) == 0) changing.place_with_other_filter();
      if (random.below(8) == 0) reach = random.uniform(0, 0.05);
      changing.expect_same(reach, random.below(20) == 0);
    }
    found += changing.found();
  }
  EXPECT_GT(found, 10'000u);
}

TYPED_TEST_P(SceneOn, RefusesListsOfDifferentLengths) {
  const BodyScene cubes = row_of_cubes(4);
  TypeParam scene;
  ASSERT_EQ(scene.set_assets(cubes.assets.views()), Status::kOk);
  ASSERT_EQ(scene.place(cubes.instances), Status::kOk);
  const std::uint32_t numbers[] = {2, 0};
  const Pose poses[] = {at(50, 0, 0)};
  EXPECT_EQ(scene.move(numbers, poses), Status::kMotionMismatch);
  EXPECT_EQ(scene.instances()[2].pose.translation[0], cubes.instances[2].pose.translation[0]);
}

/// One scene, all questions: what each finds does not depend on which others were asked before, nor on what
/// answers.
TYPED_TEST_P(SceneOn, AnswersManyQuestionsAboutTheSameBodies) {
  for (std::uint64_t seed = 0; seed < 6 && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const BodyScene bodies = crowd(11 + seed, 60);
    TypeParam scene;
    Scene on_cpu;
    Questions here, there;
    for (Scene* of : {static_cast<Scene*>(&scene), &on_cpu}) {
      ASSERT_EQ(of->set_assets(bodies.assets.views()), Status::kOk);
      ASSERT_EQ(of->place(bodies.instances), Status::kOk);
    }
    std::size_t contacts = 0;
    for (int step = 0; step < 4; ++step) {
      SCOPED_TRACE(testing::Message() << "step " << step);
      const double x = step == 1 ? 100 : 1 + 0.01 * step;
      for (Scene* of : {static_cast<Scene*>(&scene), &on_cpu}) {
        ASSERT_EQ(of->move(3, at(x, 0, 0)), Status::kOk);
        if (step == 2) {
          ASSERT_EQ(of->remove(7), Status::kOk);
        }
        if (step == 3) {
          ASSERT_EQ(of->set_motion(5, Motion::fixed), Status::kOk);
        }
      }
      here.ask(scene, 0.5, step == 2, step != 1);
      there.ask(on_cpu, 0.5, step == 2, step != 1);
      expect_same_answers(here, there);
      EXPECT_EQ(here.verdicts.pairs().size() + (step == 2 ? 59 : 0), here.contacts.pairs().size());
      EXPECT_GT(here.distances.pairs().size(), here.verdicts.pairs().size());
      EXPECT_GT(here.impacts.rows().size(), here.verdicts.pairs().size());
      EXPECT_GT(here.manifolds.rows().size(), 10u);
      contacts += here.contacts.rows().size();
    }
    EXPECT_GT(contacts, 1000u);
    // The CPU makes the same manifolds of contacts that are given as a list.
    ManifoldQuery of_list;
    ASSERT_EQ(here.manifolds.find(scene, here.contacts, {.match_previous = false}), Status::kOk);
    ASSERT_EQ(of_list.find(scene, here.contacts.pairs(), here.contacts.rows(), {.match_previous = false}),
              Status::kOk);
    expect_same_bytes(of_list.rows(), here.manifolds.rows());
  }
}

/// Nothing to look at is no error, and what was asked before does not show.
TYPED_TEST_P(SceneOn, AnswersOfNoBodiesAreEmpty) {
  const BodyScene cubes = row_of_cubes(3);
  TypeParam scene;
  Questions questions;
  ASSERT_EQ(scene.set_assets(cubes.assets.views()), Status::kOk);
  for (const auto bodies : {cubes.instances.size(), std::size_t{0}, cubes.instances.size()}) {
    ASSERT_EQ(scene.place(std::span(cubes.instances).first(bodies)), Status::kOk);
    questions.ask(scene, 0.5, false, true);
    EXPECT_EQ(questions.contacts.rows().empty(), bodies == 0);
    EXPECT_EQ(questions.manifolds.rows().empty(), bodies == 0);
    EXPECT_EQ(questions.impacts.rows().empty(), bodies == 0);
    EXPECT_EQ(questions.verdicts.rows().size(), questions.verdicts.pairs().size());
    for (const ManifoldPoint& point : questions.manifolds.points()) EXPECT_EQ(point.previous, kNoIndex);
  }
}

/// Files of bodies that can bend, and a rigid one.
struct BendingBodies {
  std::vector<test::Mesh> meshes;
  std::vector<std::unique_ptr<test::Bytes>> files;
  std::vector<AssetView> views;
  std::vector<Instance> instances;

  explicit BendingBodies(RandomPoses& random) {
    for (const test::Mesh& mesh : {test::sheet(2, 6), test::cube(0.75f, 4), test::random_mesh(60, 7),
                                   test::sphere(0.8, 3), test::cube(0.6f, 3)}) {
      meshes.push_back(test::welded(mesh));
      files.push_back(std::make_unique<test::Bytes>(test::make_refittable_file(meshes.back())));
      views.push_back(files.back()->check().asset);
    }
    for (std::uint32_t body = 0; body < 20; ++body) {
      Pose pose = test::any_rotation(random);
      for (double& t : pose.translation) t = random.symmetric(1.5);
      instances.push_back({body % 5, pose});
    }
  }

  std::vector<float> bent(std::uint32_t asset, std::span<const test::Bend> bends, RandomPoses& random) const {
    return test::single(test::bent(bends[random.below(bends.size())], random.symmetric(2),
                                   test::positions_of(meshes[asset]), random));
  }
};

/// Bodies bend, move, and bend again, as those of a scene on the CPU.
TYPED_TEST_P(SceneOn, AnswersQuestionsAboutBodiesThatBend) {
  RandomPoses random(31);
  const BendingBodies bodies(random);
  TypeParam scene;
  Scene on_cpu;
  Questions here, there;
  const auto in_both = [&](const auto& change) {
    ASSERT_EQ(change(scene), Status::kOk);
    ASSERT_EQ(change(on_cpu), Status::kOk);
  };
  in_both([&](Scene& of) { return of.set_assets(bodies.views); });
  in_both([&](Scene& of) { return of.place(bodies.instances); });
  constexpr test::Bend kMild[] = {test::Bend::twist, test::Bend::shear, test::Bend::wave,
                                  test::Bend::inside_out};
  std::size_t contacts = 0, contained = 0;
  for (int step = 0; step < 8; ++step) {
    SCOPED_TRACE(testing::Message() << "step " << step);
    if (step > 0) {
      here.of_verdicts = there.of_verdicts = Status::kDeformed;
      for (std::uint32_t asset = 0; asset < 4; ++asset) {
        if (step > 1 && random.below(2) == 0) continue;
        const std::vector<float> now = bodies.bent(asset, kMild, random);
        in_both([&](Scene& of) { return of.deform(asset, now); });
      }
    }
    Pose pose = test::any_rotation(random);
    for (double& t : pose.translation) t = random.symmetric(1.5);
    in_both([&](Scene& of) { return of.move(static_cast<std::uint32_t>(step), pose); });
    here.ask(scene, 0.5, step % 2 != 0, step != 3);
    there.ask(on_cpu, 0.5, step % 2 != 0, step != 3);
    expect_same_answers(here, there);
    contacts += here.contacts.rows().size();
    contained += here.contained.rows().size();
  }
  EXPECT_GT(contacts, 1000u);
  EXPECT_GT(contained, 0u);
}

/// Expects the same contacts and clearances of two scenes, asked in every way, and distances that agree.
/// Returns how many contacts there are.
inline std::size_t expect_same_meetings(Scene& scene, Scene& on_cpu, double within) {
  ContactQuery here, there;
  std::size_t contacts = 0;
  ContactOptions asked[6];
  asked[1].self_pairs = true;
  asked[2].mode = QueryMode::fast;
  asked[3].mode = QueryMode::boxes;
  asked[4].within = within;
  asked[5].self_pairs = true, asked[5].leave_out_rings = 1;
  for (const ContactOptions& options : asked) {
    EXPECT_EQ(here.find(scene, options), Status::kOk);
    EXPECT_EQ(there.find(on_cpu, options), Status::kOk);
    EXPECT_TRUE(std::ranges::equal(here.pairs(), there.pairs()));
    EXPECT_EQ(sorted(here), sorted(there));
    contacts += here.rows().size();
  }
  DistanceQuery near, far;
  EXPECT_EQ(near.find(scene, {.reach = 1}), Status::kOk);
  EXPECT_EQ(far.find(on_cpu, {.reach = 1}), Status::kOk);
  expect_same_distances(near, far);
  return contacts;
}

/// Wild shapes, among them flat ones, points, and coordinates of 1e15: contacts are asked for in every way.
TYPED_TEST_P(SceneOn, FindsContactsOfBodiesThatBendWildly) {
  RandomPoses random(32);
  const BendingBodies bodies(random);
  TypeParam scene;
  Scene on_cpu;
  ASSERT_EQ(scene.set_assets(bodies.views), Status::kOk);
  ASSERT_EQ(on_cpu.set_assets(bodies.views), Status::kOk);
  ASSERT_EQ(scene.place(bodies.instances), Status::kOk);
  ASSERT_EQ(on_cpu.place(bodies.instances), Status::kOk);
  std::size_t contacts = 0;
  for (int step = 0; step < 12; ++step) {
    SCOPED_TRACE(testing::Message() << "step " << step);
    for (std::uint32_t asset = 0; asset < 4; ++asset) {
      const std::vector<float> now = bodies.bent(asset, test::kBends, random);
      ASSERT_EQ(scene.deform(asset, now), Status::kOk);
      ASSERT_EQ(on_cpu.deform(asset, now), Status::kOk);
    }
    contacts += expect_same_meetings(scene, on_cpu, 0.25);
  }
  EXPECT_GT(contacts, 10000u);
}

/// Some bodies bend by float64 positions and some by float32, and some are rigid. Questions that are not
/// offered for float64 name an asset.
TYPED_TEST_P(SceneOn, DecidesOnPositionsInFloat64) {
  RandomPoses random(34);
  const BendingBodies bodies(random);
  TypeParam scene;
  Scene on_cpu;
  const auto in_both = [&](const auto& change) {
    ASSERT_EQ(change(scene), Status::kOk);
    ASSERT_EQ(change(on_cpu), Status::kOk);
  };
  in_both([&](Scene& of) { return of.set_assets(bodies.views); });
  in_both([&](Scene& of) { return of.place(bodies.instances); });
  std::size_t contacts = 0;
  for (int step = 0; step < 10; ++step) {
    SCOPED_TRACE(testing::Message() << "step " << step);
    for (std::uint32_t asset = 0; asset < 4; ++asset) {
      const test::Bend bend = test::kBends[random.below(std::size(test::kBends))];
      const test::Positions now =
          test::bent(bend, random.symmetric(2), test::positions_of(bodies.meshes[asset]), random);
      if ((static_cast<std::uint32_t>(step) + asset) % 4 == 0)
        in_both([&](Scene& of) { return of.deform(asset, test::single(now)); });
      else
        in_both([&](Scene& of) { return of.deform(asset, test::flat(now)); });
    }
    contacts += expect_same_meetings(scene, on_cpu, 0.25);
  }
  EXPECT_GT(contacts, 10000u);
  std::vector<double> thirds(3 * bodies.views[1].header->source_vertices, 1.0 / 3);
  in_both([&](Scene& of) { return of.deform(1, thirds); });
  for (const std::uint32_t asset : {0u, 2u, 3u})
    in_both(
        [&](Scene& of) { return of.deform(asset, test::single(test::positions_of(bodies.meshes[asset]))); });
  Questions questions;
  std::vector<RigidMotion> motion(bodies.instances.size());
  const auto expect_refused = [&](Status status) {
    EXPECT_EQ(status, Status::kNotFloat32);
    EXPECT_EQ(scene.where(), 1u);
  };
  ASSERT_EQ(questions.contacts.find(scene, {}), Status::kOk);
  expect_refused(questions.manifolds.find(scene, questions.contacts, {}));
  expect_refused(questions.contained.find(scene, questions.contacts));
  expect_refused(questions.impacts.find(scene, {.motion = motion, .duration = 0.2}));
  thirds[7] = NAN;
  EXPECT_EQ(scene.deform(1, thirds), Status::kOutOfRange);
  EXPECT_EQ(scene.where(), 2u);
  // They are offered again where all positions are float32 numbers.
  std::fill(thirds.begin(), thirds.end(), 0.25);
  in_both([&](Scene& of) { return of.deform(1, thirds); });
  questions.of_verdicts = Status::kDeformed;
  questions.ask(scene, 0.5, false, false);
}

/// Two sheets are nearer to each other than float32 can tell.
TYPED_TEST_P(SceneOn, TellsGapsApartThatFloat32Lacks) {
  RandomPoses random(35);
  const BendingBodies bodies(random);
  const AssetView views[] = {bodies.views[0], bodies.views[0]};
  const Instance instances[] = {{0, kIdentityPose}, {1, kIdentityPose}};
  TypeParam scene;
  ASSERT_EQ(scene.set_assets(views), Status::kOk);
  ASSERT_EQ(scene.place(instances), Status::kOk);
  for (const double gap : {0.0, 0x1p-54, 1e-13, 1e-9}) {
    test::Positions sheet = test::positions_of(bodies.meshes[0]);
    for (auto& p : sheet) p = {p[0] / 3, p[1] / 3, 1.0 / 3};
    ASSERT_EQ(scene.deform(0, test::flat(sheet)), Status::kOk);
    for (auto& p : sheet) p[2] += gap;
    ASSERT_EQ(scene.deform(1, test::flat(sheet)), Status::kOk);
    ContactQuery contacts, within, beyond;
    DistanceQuery distances;
    ASSERT_EQ(contacts.find(scene, {}), Status::kOk);
    ASSERT_EQ(within.find(scene, {.within = 1.5 * gap}), Status::kOk);
    ASSERT_EQ(beyond.find(scene, {.within = 0.5 * gap}), Status::kOk);
    ASSERT_EQ(distances.find(scene, {.tolerance = {0, 1e-6}, .reach = 1}), Status::kOk);
    EXPECT_EQ(contacts.rows().empty(), gap > 0) << gap;
    EXPECT_FALSE(within.rows().empty()) << gap;
    EXPECT_EQ(beyond.rows().empty(), gap > 0) << gap;
    ASSERT_EQ(distances.rows().size(), 1u);
    EXPECT_NEAR(distances.rows()[0].upper, (1.0 / 3 + gap) - 1.0 / 3, 1e-5 * gap);
  }
}

TYPED_TEST_P(SceneOn, TakesAReachForEachPair) {
  BodyScene cubes = row_of_cubes(3);
  for (int i = 0; i < 3; ++i) cubes.instances[i].pose.translation[0] = 1.25 * i;
  TypeParam scene;
  ASSERT_EQ(scene.set_assets(cubes.assets.views()), Status::kOk);
  ASSERT_EQ(scene.place(cubes.instances), Status::kOk);
  DistanceQuery query;
  std::vector<double> reaches = {0.3, 1, 0.2};
  ASSERT_EQ(query.find(scene, {.reach_of_pair = reaches}), Status::kOk);
  ASSERT_EQ(query.rows().size(), 3u);  // of the distances 0.25, 1.5, 0.25
  EXPECT_NEAR(query.rows()[0].upper, 0.25, 1e-6);
  for (const std::size_t i : {1, 2}) {
    EXPECT_EQ(query.rows()[i].triangle_a, kNoIndex);
    EXPECT_EQ(query.rows()[i].upper, INFINITY);
    EXPECT_GE(query.rows()[i].lower, reaches[i]);
  }
  // The scene finds pairs by the reach of all, which pairs with a reach of their own do not have.
  const std::vector<double> far = {9, 9};
  ASSERT_EQ(query.find(scene, {.reach = 1, .reach_of_pair = far}), Status::kOk);
  EXPECT_EQ(query.rows().size(), 2u);
  EXPECT_EQ(query.find(scene, {.reach_of_pair = far}), Status::kBadOption);
  EXPECT_TRUE(query.rows().empty());
  for (const double bad : {-1.0, static_cast<double>(NAN)}) {
    reaches[2] = bad;
    EXPECT_EQ(query.find(scene, {.reach_of_pair = reaches}), Status::kBadReach);
    EXPECT_EQ(scene.where(), 2u);
  }
  EXPECT_EQ(query.find(scene, std::span<const ObjectPair>(), {.reach_of_pair = reaches}), Status::kBadOption);
  EXPECT_EQ(query.find(scene, std::span<const ObjectPair>(), {.reach_of_pair = {}}), Status::kOk);
}

TYPED_TEST_P(SceneOn, RefusesPositionsAndStaysAsItIs) {
  RandomPoses random(33);
  const BendingBodies bodies(random);
  TypeParam scene;
  Scene on_cpu;
  Questions here, there;
  ASSERT_EQ(scene.set_assets(bodies.views), Status::kOk);
  ASSERT_EQ(on_cpu.set_assets(bodies.views), Status::kOk);
  ASSERT_EQ(scene.place(bodies.instances), Status::kOk);
  ASSERT_EQ(on_cpu.place(bodies.instances), Status::kOk);
  constexpr test::Bend kTwist[] = {test::Bend::twist};
  const std::vector<float> single = bodies.bent(1, kTwist, random);
  std::vector<double> positions(single.begin(), single.end());
  ASSERT_EQ(scene.deform(1, positions), Status::kOk);
  ASSERT_EQ(on_cpu.deform(1, single), Status::kOk);
  positions[10] = NAN;
  EXPECT_EQ(scene.deform(1, positions), Status::kOutOfRange);
  EXPECT_EQ(scene.where(), 3u);
  EXPECT_EQ(scene.deform(7, single), Status::kUnknownAsset);
  EXPECT_EQ(scene.deform(2, single), Status::kVertexCountMismatch);
  here.of_verdicts = there.of_verdicts = Status::kDeformed;
  here.ask(scene, 0.5, false, true);
  there.ask(on_cpu, 0.5, false, true);
  expect_same_answers(here, there);
  // The files' shapes are there again.
  ASSERT_EQ(scene.set_assets(bodies.views), Status::kOk);
  ASSERT_EQ(on_cpu.set_assets(bodies.views), Status::kOk);
  ASSERT_EQ(scene.place(bodies.instances), Status::kOk);
  ASSERT_EQ(on_cpu.place(bodies.instances), Status::kOk);
  here.of_verdicts = there.of_verdicts = Status::kOk;
  here.ask(scene, 0.5, false, true);
  there.ask(on_cpu, 0.5, false, true);
  expect_same_answers(here, there);
}

REGISTER_TYPED_TEST_SUITE_P(SceneOn, FindsThePairsOfItsBodiesWhateverChanged, FindsThePairsOfTheFewThatChange,
                            FindsThePairsOfBodiesThatHardlyMove, RefusesListsOfDifferentLengths,
                            AnswersManyQuestionsAboutTheSameBodies, AnswersOfNoBodiesAreEmpty,
                            AnswersQuestionsAboutBodiesThatBend, FindsContactsOfBodiesThatBendWildly,
                            DecidesOnPositionsInFloat64, TellsGapsApartThatFloat32Lacks,
                            TakesAReachForEachPair, RefusesPositionsAndStaysAsItIs);

}  // namespace tandem
