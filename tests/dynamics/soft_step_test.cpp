#include "dynamics/soft_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <random>
#include <set>

#include "dynamics/phases.h"
#include "dynamics/random_heap.h"

namespace tandem::dynamics {
namespace {

std::vector<ColouredPair> random_pairs(std::uint32_t bodies, std::size_t count, std::uint32_t first = 1) {
  std::mt19937 random(7);
  const auto below = [&](std::uint32_t most) { return static_cast<std::uint32_t>(random() % most); };
  std::vector<ColouredPair> pairs;
  while (pairs.size() < count) {
    const std::uint32_t a = below(bodies), b = below(bodies);
    if (a == b) continue;
    const auto place = [&](std::uint32_t body) { return body == 0 ? 0 : body - 1 + first; };
    pairs.push_back({place(a), place(b), below(kColouredOrders)});
  }
  return pairs;
}

void expect_no_body_twice(std::span<const ColouredPair> pairs, std::span<const std::uint32_t> colours) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> taken;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (const std::uint32_t body : {pairs[i].a, pairs[i].b}) {
      if (body != 0) {
        EXPECT_TRUE(taken.insert({colours[i], body}).second) << "pair " << i;
      }
    }
  }
}

TEST(PairColours, NoTwoPairsOfAColourMoveTheSameBody) {
  for (const std::size_t count : {0, 1, 100, 5000}) {
    const std::vector<ColouredPair> pairs = random_pairs(200, count);
    expect_no_body_twice(pairs, find_colours(pairs, 201));
  }
}

TEST(PairColours, ABodyMayHaveMorePairsThanThereAreSharedColours) {
  std::vector<ColouredPair> pairs;
  for (std::uint32_t i = 0; i < 3 * kSharedColours; ++i) pairs.push_back({1, i + 2, i});
  const std::vector<std::uint32_t> colours = find_colours(pairs, pairs.size() + 2);
  expect_no_body_twice(pairs, colours);
  EXPECT_EQ(*std::ranges::max_element(colours), pairs.size() - 1);
}

TEST(PairColours, ThoseOfAnIslandDoNotDependOnOthers) {
  const std::vector<ColouredPair> alone = random_pairs(50, 400);
  std::vector<ColouredPair> both = random_pairs(50, 400, 51);
  both.insert(both.begin() + 200, alone.begin(), alone.end());
  const std::vector<std::uint32_t> of_alone = find_colours(alone, 101), of_both = find_colours(both, 101);
  EXPECT_TRUE(std::equal(of_alone.begin(), of_alone.end(), of_both.begin() + 200));
}

// Groups of random rows over few bodies, each pair of a group of bodies of its own.
struct RandomRows {
  static constexpr std::uint32_t kGroups = 40, kContacts = 3, kBodies = 2 * kSoftWidth;
  std::mt19937 random{3};
  std::vector<SoftMotion> velocities, moved;
  std::vector<SoftPairs> pairs = std::vector<SoftPairs>(kGroups);
  std::vector<SoftTurning> turnings = std::vector<SoftTurning>(kGroups);
  std::vector<SoftNormal> normals = std::vector<SoftNormal>(kGroups * kContacts);
  std::vector<SoftGap> gaps = std::vector<SoftGap>(kGroups * kContacts);
  std::vector<SoftFriction> frictions = std::vector<SoftFriction>(kGroups * kContacts);

  RandomRows() : velocities(kBodies + kGroups), moved(kBodies + kGroups) {
    for (std::uint32_t i = 0; i < kBodies; ++i) {
      fill(&velocities[i].centre[0], 3), fill(&velocities[i].spin[0], 3);
      fill(&moved[i].centre[0], 3), fill(&moved[i].spin[0], 3);
    }
    for (std::uint32_t g = 0; g < kGroups; ++g) {
      fill_all(pairs[g].inverse_mass_a), fill_all(pairs[g].inverse_mass_b);
      fill_all(turnings[g]);
      make_pairs(pairs[g], g);
    }
    for (SoftNormal& row : normals) fill_all(row);
    for (SoftGap& row : gaps) fill_all(row);
    for (SoftFriction& row : frictions) fill_all(row);
    for (std::uint32_t g = 0; g < kGroups; ++g) {
      for (int lane = 0; lane < kSoftWidth; ++lane) hold_what_does_not_move(g, lane);
      clear_empty_lanes(turnings[g], pairs[g].pairs);
      for (std::uint32_t i = g * kContacts; i < (g + 1) * kContacts; ++i) {
        clear_empty_lanes(normals[i], pairs[g].pairs), clear_empty_lanes(gaps[i], pairs[g].pairs);
        clear_empty_lanes(frictions[i], pairs[g].pairs);
      }
    }
    // Some contacts push nothing, and some pairs have none in a row.
    for (std::size_t i = 0; i < normals.size(); i += 2)
      normals[i].impulse = {}, frictions[i].first_impulse = {};
    for (std::size_t i = 0; i < normals.size(); i += 5) normals[i] = {}, frictions[i] = {};
  }

  SoftRows rows() {
    return {velocities.data(), moved.data(), pairs.data(),     turnings.data(),
            normals.data(),    gaps.data(),  frictions.data(), 960};
  }

 private:
  void fill(float* to, std::size_t count) {
    std::uniform_real_distribution<float> number(-1, 1);
    for (std::size_t i = 0; i < count; ++i) to[i] = number(random);
  }
  template <typename Numbers>
  void fill_all(Numbers& to) {
    static_assert(sizeof to % sizeof(SoftNumber) == 0);
    std::vector<float> numbers(sizeof to / sizeof(float));
    fill(numbers.data(), numbers.size());
    std::memcpy(static_cast<void*>(&to), numbers.data(), sizeof to);
  }
  template <typename Numbers>
  void clear_empty_lanes(Numbers& of, std::uint32_t pairs_of_group) {
    SoftNumber numbers[sizeof of / sizeof(SoftNumber)];
    std::memcpy(numbers, &of, sizeof of);
    for (SoftNumber& number : numbers) std::fill(number.of + pairs_of_group, std::end(number.of), 0.0f);
    std::memcpy(static_cast<void*>(&of), numbers, sizeof of);
  }
  void hold_what_does_not_move(std::uint32_t g, int lane) {
    const auto hold = [&](SoftNumber& number) { number.of[lane] = 0; };
    const bool a = pairs[g].body_a[lane] >= kBodies, b = pairs[g].body_b[lane] >= kBodies;
    const auto hold_direction = [&](SoftDirection& direction) {
      for (int k = 0; k < 3; ++k) {
        if (a) hold(direction.turn_a[k]);
        if (b) hold(direction.turn_b[k]);
      }
    };
    for (std::uint32_t i = g * kContacts; i < (g + 1) * kContacts; ++i) {
      hold_direction(normals[i].direction);
      hold_direction(frictions[i].first), hold_direction(frictions[i].second);
    }
    for (int k = 0; k < 9; ++k) {
      if (a) hold(turnings[g].spread_a[k]);
      if (b) hold(turnings[g].spread_b[k]);
    }
    if (a) hold(pairs[g].inverse_mass_a);
    if (b) hold(pairs[g].inverse_mass_b);
  }
  void make_pairs(SoftPairs& group, std::uint32_t g) {
    group.pairs = 1 + g % kSoftWidth;
    group.first = g * kContacts, group.contacts = 1 + g % kContacts;
    group.bounces = g % 2 == 0, group.is_opposed = g % 3 == 0;
    for (std::uint32_t lane = 0; lane < kSoftWidth; ++lane) {
      group.body_a[lane] = lane < group.pairs ? 2 * lane : kBodies + g;
      group.body_b[lane] = lane < group.pairs && lane % 4 != 0 ? 2 * lane + 1 : kBodies + g;
      group.bias_rate.of[lane] = 100, group.mass_scale.of[lane] = 0.9f, group.impulse_scale.of[lane] = 0.1f;
    }
  }
};

template <typename Thing>
void expect_same(const std::vector<Thing>& is, const std::vector<Thing>& wanted, const char* what) {
  EXPECT_EQ(std::memcmp(is.data(), wanted.data(), sizeof(Thing) * is.size()), 0) << what;
}

TEST(SoftPasses, EveryVariantGivesTheSameBytes) {
  const SoftPasses::Pass SoftPasses::*order[] = {&SoftPasses::start,   &SoftPasses::push, &SoftPasses::follow,
                                                 &SoftPasses::relax,   &SoftPasses::rub,  &SoftPasses::push,
                                                 &SoftPasses::rebound, &SoftPasses::judge};
  const auto after = [&](const SoftPasses& passes) {
    RandomRows rows;
    for (const auto pass : order) (passes.*pass)(rows.rows(), 0, RandomRows::kGroups, 0.01f);
    // A zero may have either sign where lanes are left out together.
    for (SoftMotion& motion : rows.velocities) {
      for (int i = 0; i < 4; ++i) motion.centre[i] += 0.0f, motion.spin[i] += 0.0f;
    }
    for (SoftFriction& row : rows.frictions) {
      for (int i = 0; i < kSoftWidth; ++i) row.first_impulse.of[i] += 0.0f, row.second_impulse.of[i] += 0.0f;
    }
    return rows;
  };
  const RandomRows scalar = after(*soft_passes(BlockPairVariant::scalar));
  int variants = 0;
  for (const BlockPairVariant variant : kBlockPairVariants) {
    const SoftPasses* const passes = soft_passes(variant);
    if (passes == nullptr) continue;
    SCOPED_TRACE(static_cast<int>(variant));
    const RandomRows rows = after(*passes);
    expect_same(rows.velocities, scalar.velocities, "velocities");
    expect_same(rows.normals, scalar.normals, "normals");
    expect_same(rows.frictions, scalar.frictions, "frictions");
    expect_same(rows.gaps, scalar.gaps, "gaps");
    expect_same(rows.turnings, scalar.turnings, "turnings");
    ++variants;
  }
  EXPECT_GE(variants, 2);
  EXPECT_NE(std::memcmp(scalar.velocities.data(), RandomRows().velocities.data(), sizeof(SoftMotion)), 0);
}

// A cube of bodies that touch those beside them, above a body that is fixed.
struct CubeStep {
  static constexpr std::uint32_t kSide = 16;
  std::vector<BodyProperties> bodies = std::vector<BodyProperties>(kSide * kSide * kSide + 1);
  std::vector<BodyState> states = std::vector<BodyState>(bodies.size());
  std::vector<Pull> pulls = std::vector<Pull>(bodies.size(), Pull{{0, 0, -9.81}, {}});
  std::vector<ContactPoint> contacts;

  CubeStep() {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> number(-1, 1);
    const auto any = [&] { return Vector3{number(random), number(random), number(random)}; };
    bodies[0].motion = Motion::fixed;
    for (std::uint32_t i = 1; i < bodies.size(); ++i) {
      const std::uint32_t k = i - 1;
      states[i].position = {k % kSide + 0.5, k / kSide % kSide + 0.5, k / (kSide * kSide) + 0.5};
      states[i].velocity = 0.1 * any(), states[i].angular_velocity = any();
      if (k < kSide * kSide) touch(0, i, {0, 0, 1});
      if (k % kSide > 0) touch(i - 1, i, {1, 0, 0});
      if (k / kSide % kSide > 0) touch(i - kSide, i, {0, 1, 0});
      if (k >= kSide * kSide) touch(i - kSide * kSide, i, {0, 0, 1});
    }
    std::ranges::sort(contacts, {}, [](const ContactPoint& c) { return std::pair(c.body_a, c.body_b); });
  }
  void touch(std::uint32_t a, std::uint32_t b, const Vector3& normal) {
    for (const double side : {-0.3, 0.3}) {
      const Vector3 across = side * unit_orthogonal(normal);
      contacts.push_back({a, b, states[b].position - 0.5 * normal + across, normal, 1e-3 * side, 0});
    }
  }
  std::vector<BodyState> solved(std::uint32_t count) const {
    Threads threads(count);
    const Islands islands = find_islands(bodies, contacts);
    std::vector<ContactImpulse> impulses(contacts.size());
    std::vector<BodyState> moved = states;
    make_step_solver({.kind = SolverKind::soft, .restitution = 0.3})
        ->step({{bodies, contacts, 1.0 / 60, pulls}, islands, 0, true, threads}, moved, impulses);
    return moved;
  }
};

TEST(SoftSolver, GivesTheSameBytesByAnyNumberOfThreads) {
  const CubeStep cube;
  const std::vector<BodyState> alone = cube.solved(1);
  for (const std::uint32_t threads : {2u, 3u, 8u}) expect_same(cube.solved(threads), alone, "states");
  EXPECT_TRUE(std::ranges::all_of(alone, is_usable));
  EXPECT_NE(norm(alone[1].velocity - cube.states[1].velocity), 0);
}

// Returns the energy of an island of balls after a step, over that after a step without contacts.
double energy_by_contacts(const RandomHeap& heap, const HeapResult& result,
                          std::span<const std::uint32_t> bodies) {
  double with = 0, without = 0;
  for (const std::uint32_t i : bodies) {
    BodyState free = heap.states[i];
    free.velocity += heap.dt * heap.pulls[i].linear;
    with += kinetic_energy(heap.bodies[i], result.states[i]);
    without += kinetic_energy(heap.bodies[i], free);
  }
  return with / without;
}

TEST(SoftSolver, ContactsAddEnergyOnlyWhereSomethingDrivesBodies) {
  constexpr double kRounding = 1e-9;
  for (const Motion what_drives : {Motion::fixed, Motion::kinematic}) {
    int limited = 0, more = 0;
    for (unsigned seed = 1; seed <= 20; ++seed) {
      const RandomHeap heap = wedged_heap(seed, what_drives);
      const HeapResult result = solution(heap);
      const Islands islands = find_islands(heap.bodies, heap.contacts);
      for (std::size_t island = 0; island < islands.size(); ++island) {
        if (islands.flies(island)) continue;
        const double energy = energy_by_contacts(heap, result, islands.bodies_of(island));
        more += energy > 1 + kRounding ? 1 : 0;
        limited += std::fabs(energy - 1) <= kRounding ? 1 : 0;
      }
    }
    EXPECT_GT(limited, 20);
    if (what_drives == Motion::fixed)
      EXPECT_EQ(more, 0);
    else
      EXPECT_GT(more, 20);
  }
}

TEST(Phases, EachBeginsWhenTheOneBeforeIsDone) {
  constexpr std::size_t kPhases = 2000;
  for (const std::uint32_t workers : {1u, 2u, 5u}) {
    Threads threads(workers);
    std::vector<std::atomic<std::uint32_t>> done(kPhases + 1);
    std::atomic<int> early = 0;
    std::atomic<std::uint32_t> came = 0;
    run_phases(threads, workers, kPhases, [&](std::size_t phase, std::uint32_t i, std::uint32_t n) {
      if (phase > 0 && done[phase - 1] != n) ++early;
      if (i >= n) ++early;
      came = n;
      ++done[phase];
    });
    EXPECT_EQ(early, 0);
    for (std::size_t phase = 0; phase < kPhases; ++phase) ASSERT_EQ(done[phase], came) << phase;
    EXPECT_LE(came, workers);
  }
}

}  // namespace
}  // namespace tandem::dynamics
