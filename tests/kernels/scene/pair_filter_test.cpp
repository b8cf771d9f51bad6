#include "tandem/kernels/pair_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <tuple>

#include "filter_oracle.h"
#include "kernels/common/worker_threads.h"
#include "kernels/contact/contact_query_fixture.h"
#include "tandem/kernels/broad_phase.h"

namespace tandem {
namespace {

using test::FilterArrays;
using test::FilterOracle;
using test::random_filter;

using Boxes = std::vector<WorldBox>;
using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

constexpr unsigned kAllParts = 31, kMotionPart = 1;

Pairs brute_force(const Boxes& boxes, const FilterArrays& filter, bool self_pairs = false) {
  const FilterOracle oracle(filter);
  Pairs pairs;
  for (std::uint32_t a = 0; a < boxes.size(); ++a) {
    for (std::uint32_t b = self_pairs ? a : a + 1; b < boxes.size(); ++b) {
      if (overlap(boxes[a], boxes[b]) && oracle.looks_at(a, b)) pairs.emplace_back(a, b);
    }
  }
  return pairs;
}

Pairs pairs_of(const BroadPhase& broad_phase) {
  Pairs pairs;
  for (const ObjectPair& pair : broad_phase.pairs()) pairs.emplace_back(pair.a, pair.b);
  return pairs;
}

// Boxes on a grid of quarters, so that many touch exactly; a huge one among them.
Boxes scattered(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const double side = std::cbrt(static_cast<double>(count) + 1) / 1.5;
  Boxes boxes(count);
  for (WorldBox& box : boxes) {
    for (int k = 0; k < 3; ++k) {
      box.lo[k] = std::round(4 * side * uniform(random)) / 4;
      box.hi[k] = box.lo[k] + std::round(4 * uniform(random)) / 4;
    }
  }
  if (count > 100) boxes[count / 3] = {{-1e6, -1e6, -1e6}, {1e6, 1e6, 1e6}};
  return boxes;
}

TEST(PairFilter, LooksAtPairsInWhichOneMovesAndAtKinematicOnesThatMeetSleepingOnes) {
  constexpr Motion m = Motion::moving, f = Motion::fixed, k = Motion::kinematic, s = Motion::sleeping;
  for (const auto& [a, b, meet] : {std::tuple{m, m, true},
                                   {m, f, true},
                                   {m, k, true},
                                   {m, s, true},
                                   {f, m, true},
                                   {f, f, false},
                                   {f, k, false},
                                   {f, s, false},
                                   {k, m, true},
                                   {k, f, false},
                                   {k, k, false},
                                   {k, s, true},
                                   {s, m, true},
                                   {s, f, false},
                                   {s, k, true},
                                   {s, s, false}}) {
    EXPECT_EQ(motions_meet(a, b), meet) << static_cast<int>(a) << " " << static_cast<int>(b);
  }
}

TEST(PairFilter, EachMaskMustNameAGroupOfTheOther) {
  EXPECT_TRUE(groups_meet(1, 2, 2, 1));
  EXPECT_FALSE(groups_meet(1, 2, 2, 2));
  EXPECT_FALSE(groups_meet(1, 1, 2, 1));
  EXPECT_TRUE(groups_meet(0x80000000u, 0x80000000u, 0x80000000u, 0x80000000u));
  EXPECT_FALSE(groups_meet(~0u, ~0u, 0, ~0u));
  EXPECT_FALSE(groups_meet(~0u, 0, ~0u, ~0u));
  const PairFilter none;
  EXPECT_TRUE(none.looks_at(0, 1));
  const std::uint32_t group[] = {0, 1};
  PairFilter groups;
  groups.group = group;
  EXPECT_FALSE(groups.looks_at(0, 1));
  EXPECT_TRUE(groups.looks_at(1, 1));
}

TEST(ExcludedPairTable, HoldsExactlyItsPairsInBothOrders) {
  ExcludedPairTable table;
  std::mt19937_64 random(5);
  for (const std::size_t count : {0, 1, 2, 3, 4, 5, 1000, 100000}) {
    // Few numbers, so that pairs come again; and the largest there are.
    std::vector<ObjectPair> pairs;
    std::set<std::pair<std::uint32_t, std::uint32_t>> expected;
    const std::uint64_t numbers = 1 + static_cast<std::uint64_t>(std::sqrt(static_cast<double>(count)));
    const auto any = [&] {
      const auto i = static_cast<std::uint32_t>(random() % numbers);
      return random() % 2 == 0 ? i : kNoIndex - 1 - i;
    };
    std::uint32_t last = 0;
    for (std::size_t i = 0; i < count; ++i) {
      pairs.push_back({any(), any()});
      expected.insert(std::minmax(pairs[i].a, pairs[i].b));
      last = std::max({last, pairs[i].a, pairs[i].b});
    }
    ASSERT_EQ(table.set(pairs), Status::kOk);
    for (const auto& [a, b] : pairs) {
      EXPECT_TRUE(table.view().contains(a, b));
      EXPECT_TRUE(table.view().contains(b, a));
    }
    for (int i = 0; i < 1000; ++i) {
      const std::uint32_t a = any(), b = any();
      EXPECT_EQ(table.view().contains(a, b), expected.count(std::minmax(a, b)) == 1) << a << " " << b;
    }
    EXPECT_EQ(table.view().instances, count == 0 ? 0 : last + 1);
    if (count == 0) continue;
    const ObjectPair& blamed = pairs[table.view().row];
    EXPECT_EQ(std::max(blamed.a, blamed.b), last);
  }
  const ObjectPair impossible[] = {{1, 2}, {3, kNoIndex}};
  EXPECT_EQ(table.set(impossible), Status::kUnknownInstance);
  EXPECT_FALSE(table.view().contains(1, 2));
}

TEST(BroadPhaseFilter, FindsThePairsOfBruteForceWhateverTheFilterTheWorkersAndWhatIsKept) {
  BroadPhase broad_phase;
  WorkerThreads threads;
  ASSERT_TRUE(threads.provide(16));
  std::size_t found = 0, left_out = 0;
  for (const std::uint32_t count : {0u, 1u, 2u, 5u, 17u, 300u, 2500u}) {
    const Boxes boxes = scattered(count, count);
    for (unsigned parts = 0; parts <= kAllParts; ++parts) {
      const FilterArrays filter = random_filter(count, parts, 100 * count + parts);
      ExcludedPairTable table;
      const PairFilter view = filter.view(table);
      for (const bool self_pairs : {false, true}) {
        const Pairs expected = brute_force(boxes, filter, self_pairs);
        found += expected.size();
        left_out += brute_force(boxes, {}, self_pairs).size() - expected.size();
        for (const bool keep : {false, true}) {
          broad_phase.forget_fixed();
          std::uint64_t work = 0;
          for (const std::uint32_t workers : {1u, 2u, 3u, 7u, 16u}) {
            if (keep && !filter.motion.empty()) {
              ASSERT_EQ(broad_phase.keep_fixed(boxes, filter.motion, view.world, threads, workers),
                        Status::kOk);
            }
            ASSERT_EQ(broad_phase.find_pairs(boxes, view, self_pairs, threads, workers), Status::kOk);
            EXPECT_EQ(pairs_of(broad_phase), expected)
                << count << " boxes, filter " << parts << ", keep " << keep << ", " << workers << " workers";
            EXPECT_TRUE(workers == 1 || broad_phase.group_pairs() == work);
            work = broad_phase.group_pairs();
          }
        }
      }
    }
  }
  EXPECT_GT(found, 10000u);
  EXPECT_GT(left_out, 10000u);
}

// Few free boxes beside many kept ones and the other way round: trees of all heights meet.
TEST(BroadPhaseFilter, KeptTreesMayBeHigherOrLowerThanTheOthers) {
  BroadPhase broad_phase;
  for (const std::uint32_t count : {2u, 6u, 40u, 400u, 3000u}) {
    const Boxes boxes = scattered(count, 7);
    for (const std::uint32_t rare : {1u, 2u, 5u, 30u, 200u}) {
      if (2 * rare > count) continue;
      for (const bool few_fixed : {false, true}) {
        FilterArrays filter;
        for (std::uint32_t i = 0; i < count; ++i)
          filter.motion.push_back((i % (count / rare) == 0) == few_fixed ? Motion::fixed : Motion::moving);
        ExcludedPairTable table;
        ASSERT_EQ(broad_phase.keep_fixed(boxes, filter.motion), Status::kOk);
        ASSERT_EQ(broad_phase.find_pairs(boxes, filter.view(table)), Status::kOk);
        EXPECT_EQ(pairs_of(broad_phase), brute_force(boxes, filter)) << count << " " << rare << few_fixed;
        // Without a filter too, no pair of two that are kept is found.
        ASSERT_EQ(broad_phase.find_pairs(boxes), Status::kOk);
        EXPECT_EQ(pairs_of(broad_phase), brute_force(boxes, filter));
      }
    }
  }
}

// Bodies in one place: each filter admits no pair, and the walk ends where the groups below tell that.
TEST(BroadPhaseFilter, EndsTheWalkAboveBoxesOfWhichItAdmitsNoPair) {
  BroadPhase broad_phase;
  constexpr std::uint32_t kCount = 4096;
  const Boxes boxes(kCount, {{0, 0, 0}, {1, 1, 1}});
  FilterArrays no_group, other_group, one_way, at_rest;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    no_group.mask.push_back(0);
    other_group.group.push_back(1u << i % 16);
    other_group.mask.push_back(0x10000u << i % 16);
    one_way.group.push_back(1 + i % 2);
    one_way.mask.push_back(2 + 2 * (i % 2));
    at_rest.motion.push_back(i % 3 == 0 ? Motion::kinematic : Motion::fixed);
  }
  ExcludedPairTable table;
  for (const FilterArrays* filter : {&no_group, &other_group, &one_way, &at_rest}) {
    ASSERT_EQ(broad_phase.find_pairs(boxes, filter->view(table)), Status::kOk);
    EXPECT_TRUE(broad_phase.pairs().empty());
    EXPECT_LT(broad_phase.group_pairs(), 100u);  // all: 524,800 and those above
  }
  at_rest.motion[1000] = Motion::moving;
  ASSERT_EQ(broad_phase.find_pairs(boxes, at_rest.view(table)), Status::kOk);
  EXPECT_EQ(broad_phase.pairs().size(), kCount - 1);
  EXPECT_LT(broad_phase.group_pairs(), kCount);
}

// 200 worlds of 20 bodies, of which a quarter is fixed: in one place, and far apart.
TEST(BroadPhaseFilter, WorldsInOnePlaceCostWhatWorldsFarApartDo) {
  const Boxes place = scattered(20, 3);
  Boxes together, apart;
  FilterArrays filter;
  for (std::uint32_t i = 0; i < 4000; ++i) {
    const std::uint32_t world = i * 7 % 4000 / 20;
    WorldBox box = place[i * 7 % 20];
    together.push_back(box);
    const double shift[3] = {3e7 * (world % 6), 3e7 * (world / 6 % 6), 3e7 * (world / 36)};
    for (int k = 0; k < 3; ++k) box.lo[k] += shift[k], box.hi[k] += shift[k];
    apart.push_back(box);
    filter.motion.push_back(i % 4 == 0 ? Motion::fixed : Motion::moving);
    filter.world.push_back(world);
  }
  ExcludedPairTable table;
  PairFilter far = filter.view(table);
  far.world = nullptr;
  for (const bool keep : {false, true}) {
    BroadPhase in_worlds, in_one;
    if (keep) {
      ASSERT_EQ(in_worlds.keep_fixed(together, filter.motion, filter.world.data()), Status::kOk);
      ASSERT_EQ(in_one.keep_fixed(apart, filter.motion), Status::kOk);
    }
    ASSERT_EQ(in_worlds.find_pairs(together, filter.view(table)), Status::kOk);
    ASSERT_EQ(in_one.find_pairs(apart, far), Status::kOk);
    EXPECT_EQ(pairs_of(in_worlds), pairs_of(in_one)) << keep;
    EXPECT_EQ(pairs_of(in_worlds), brute_force(together, filter)) << keep;
    EXPECT_LT(in_worlds.group_pairs(), in_one.group_pairs() + in_one.group_pairs() / 5) << keep;
  }
}

TEST(BroadPhaseFilter, LooksAtNoKeptBoxAgain) {
  BroadPhase broad_phase;
  const std::uint32_t count = 1000;
  Boxes boxes = scattered(count, 3);
  const FilterArrays filter = random_filter(count, kMotionPart, 3);
  ExcludedPairTable table;
  ASSERT_EQ(broad_phase.keep_fixed(boxes, filter.motion), Status::kOk);
  const Pairs expected = brute_force(boxes, filter);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (filter.motion[i] == Motion::fixed) boxes[i].lo[0] = std::nan("");
  }
  ASSERT_EQ(broad_phase.find_pairs(boxes, filter.view(table)), Status::kOk);
  EXPECT_EQ(pairs_of(broad_phase), expected);
  broad_phase.forget_fixed();
  EXPECT_EQ(broad_phase.find_pairs(boxes, filter.view(table)), Status::kOutOfRange);
}

// Work counted, not timed.
TEST(BroadPhaseFilter, KeptBoxesThatNothingMeetsCostNextToNothing) {
  BroadPhase broad_phase;
  Boxes boxes = scattered(1000, 11);
  ASSERT_EQ(broad_phase.find_pairs(boxes), Status::kOk);
  const std::uint64_t alone = broad_phase.group_pairs();
  std::vector<Motion> motion(boxes.size(), Motion::moving);
  for (int i = 0; i < 100'000; ++i) {
    const double x = 1.5e6 + i % 317, y = 1.5e6 + i / 317;
    boxes.push_back({{x, y, -1}, {x + 1, y + 1, 0}});
    motion.push_back(Motion::fixed);
  }
  PairFilter filter;
  filter.motion = motion.data();
  ASSERT_EQ(broad_phase.find_pairs(boxes), Status::kOk);
  EXPECT_GT(broad_phase.group_pairs(), 20 * alone);
  ASSERT_EQ(broad_phase.find_pairs(boxes, filter), Status::kOk);
  const Pairs expected = pairs_of(broad_phase);
  ASSERT_EQ(broad_phase.keep_fixed(boxes, motion), Status::kOk);
  ASSERT_EQ(broad_phase.find_pairs(boxes, filter), Status::kOk);
  EXPECT_EQ(pairs_of(broad_phase), expected);
  EXPECT_LT(broad_phase.group_pairs(), alone + alone / 4);
}

TEST(BroadPhaseFilter, NamesWhatItCannotTakeAndKeepsNothingThen) {
  BroadPhase broad_phase;
  Boxes boxes = scattered(50, 1);
  std::vector<Motion> motion(50, Motion::fixed);
  EXPECT_EQ(broad_phase.keep_fixed(boxes, std::span(motion).first(49)), Status::kKeptMismatch);
  ASSERT_EQ(broad_phase.keep_fixed(boxes, motion), Status::kOk);
  EXPECT_EQ(broad_phase.kept_of(), 50u);
  EXPECT_EQ(broad_phase.find_pairs(boxes), Status::kOk);
  EXPECT_EQ(broad_phase.pairs().size(), 0u);
  EXPECT_EQ(broad_phase.find_pairs(std::span(boxes).first(49)), Status::kKeptMismatch);
  boxes[20].hi[1] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(broad_phase.find_pairs(boxes), Status::kOk);
  EXPECT_EQ(broad_phase.keep_fixed(boxes, motion), Status::kOutOfRange);
  EXPECT_EQ(broad_phase.kept_of(), 0u);
  boxes[20].hi[1] = 1;
  ExcludedPairTable table;
  const ObjectPair excluded[] = {{1, 2}, {50, 3}};
  ASSERT_EQ(table.set(excluded), Status::kOk);
  PairFilter filter;
  filter.excluded = table.view();
  EXPECT_EQ(broad_phase.find_pairs(boxes, filter), Status::kUnknownInstance);
  ASSERT_EQ(broad_phase.keep_fixed({}, {}), Status::kOk);
  EXPECT_EQ(broad_phase.find_pairs({}), Status::kOk);
}

class FilteredQuery : public Query {};

// The contacts of the pairs that the oracle leaves, of all that a query without a filter finds.
std::vector<Contact> left_by(const FilterArrays& filter, const test::Asked<ContactQuery>& all) {
  const FilterOracle oracle(filter);
  std::vector<std::uint32_t> row;
  std::uint32_t rows = 0;
  for (const ObjectPair& pair : all.pairs())
    row.push_back(oracle.looks_at(pair.a, pair.b) ? rows++ : kNoIndex);
  std::vector<Contact> left;
  for (Contact contact : all.rows()) {
    contact.pair = row[contact.pair];
    if (contact.pair != kNoIndex) left.push_back(contact);
  }
  return left;
}

TEST_F(FilteredQuery, FindsTheContactsOfThePairsThatTheFilterLooksAt) {
  const BodyScene scene = crowd(21, 150);
  const auto count = static_cast<std::uint32_t>(scene.instances.size());
  test::Asked<ContactQuery> all, some;
  for (auto* query : {&all, &some}) ASSERT_EQ(query->set_assets(scene.assets.views()), Status::kOk);
  for (const unsigned parts : {1u, 6u, 8u, kAllParts}) {
    const FilterArrays filter = random_filter(count, parts, parts);
    ExcludedPairTable table;
    const PairFilter view = filter.view(table);
    for (std::uint32_t threads = 1; threads <= 16; threads += 5) {
      EXPECT_EQ(all.scene.set_threads(threads), Status::kOk);
      EXPECT_EQ(some.scene.set_threads(threads), Status::kOk);
      const ContactOptions options = {.self_pairs = parts == kAllParts};
      ASSERT_EQ(all.find(scene.instances, options), Status::kOk);
      const std::vector<Contact> expected = left_by(filter, all);
      EXPECT_FALSE(expected.empty());
      EXPECT_LT(expected.size(), all.rows().size());
      some.filter = view;
      for (int step = 0; step < 2; ++step) {  // the second keeps what the first found
        ASSERT_EQ(some.find(scene.instances, options), Status::kOk);
        EXPECT_EQ(contacts_of(some), expected);
      }
    }
  }
}

// The lines are those of docs/queries.md.
TEST_F(FilteredQuery, IsAskedAsTheDocumentationShows) {
  const BodyScene cubes = row_of_cubes(3);
  const std::vector<Instance>& bodies = cubes.instances;
  Scene scene;
  ContactQuery query;
  ASSERT_EQ(scene.set_assets(cubes.assets.views()), Status::kOk);
  const Motion motion[] = {Motion::fixed, Motion::moving, Motion::moving};  // of each instance
  const ObjectPair joints[] = {{1, 2}};
  ExcludedPairTable excluded;
  Status status = excluded.set(joints);
  const PairFilter filter = {.motion = motion, .excluded = excluded.view()};
  if (status == Status::kOk) status = scene.place(bodies, filter);
  if (status == Status::kOk) status = query.find(scene);
  EXPECT_EQ(status, Status::kOk);
  ASSERT_EQ(query.pairs().size(), 1u);
  EXPECT_EQ(query.pairs()[0].b, 1u);
}

}  // namespace
}  // namespace tandem
