#include "bvhbench/economy/choice.h"

#include <gtest/gtest.h>

#include <map>

namespace tandem::economy {
namespace {

// Two assets of four levels, an instance each. A level's error bound is 0, 1, 4, 16; the depth between both
// is off by a part of their sum, and the time is 8, 4, 2, 1 for each.
class MadeUp {
 public:
  explicit MadeUp(double part) : part_(part) {}

  Candidates candidates() {
    Candidates made;
    made.error_bounds = {kBounds, kBounds};
    made.asset_of = {0, 1};
    made.measure = [this](const Levels& levels) -> const Measures& { return measure(levels); };
    return made;
  }

 private:
  const Measures& measure(const Levels& levels) {
    Measures& measures = known_[levels];
    measures.levels = levels;
    measures.query_seconds = 0;
    double depth = 0;
    for (const std::uint32_t level : levels) {
      measures.query_seconds += 8 >> level;
      depth += part_ * kBounds[level];
    }
    measures.change.depths = {{{0, 1}, depth}};
    return measures;
  }

  const std::vector<double> kBounds = {0, 1, 4, 16};
  double part_;
  std::map<Levels, Measures> known_;
};

double time_of(const Measures& measures) {
  return measures.query_seconds;
}

TEST(WithinTolerance, TakesTheCoarsestLevelOfEachAsset) {
  MadeUp scene(0.1);
  EXPECT_EQ(within_tolerance(scene.candidates(), {4, 20}), (Levels{2, 3}));
  EXPECT_EQ(within_tolerance(scene.candidates(), {3.9, 0.5}), (Levels{1, 0}));
}

TEST(WithinTolerance, OfNothingTakesLevelsWithoutError) {
  Candidates flat;
  flat.error_bounds = {{0, 0, 0, 1}};
  const Measures none;
  flat.measure = [&](const Levels&) -> const Measures& { return none; };
  EXPECT_EQ(within_tolerance(flat, {0}), (Levels{2}));
}

TEST(WithinTolerance, LooksAtWhatALevelChangesInTheScene) {
  MadeUp scene(2);
  EXPECT_EQ(within_tolerance(scene.candidates(), {7, 7}), (Levels{1, 1}));  // level 2: bound 4, measured 8
}

TEST(WithinTolerance, TakesTheSmallerToleranceOfAPair) {
  MadeUp scene(0.1);
  EXPECT_EQ(within_tolerance(scene.candidates(), {20, 0.5}), (Levels{2, 0}));  // level 3: measured 1.6
}

// Depths of pairs of instances 0 to 4, of assets 0, 1, 1, 2, 2, each of two levels: what the pair's assets
// add to it at level 1.
Candidates of_pairs(std::vector<DepthChange> at_level_1, std::map<Levels, Measures>& known) {
  Candidates made;
  made.error_bounds = {{0, 1}, {0, 1}, {0, 1}};
  made.asset_of = {0, 1, 1, 2, 2};
  made.measure = [=, &known](const Levels& levels) -> const Measures& {
    Measures& measures = known[levels];
    measures.change.depths.clear();
    for (const auto& [pair, by] : at_level_1) {
      const std::uint32_t a = made.asset_of[pair.a], b = made.asset_of[pair.b];
      measures.change.depths.push_back({pair, by * (levels[a] + levels[b])});
    }
    return measures;
  };
  return made;
}

TEST(WithinTolerance, JudgesAnAssetByThePairsThatItIsIn) {
  std::map<Levels, Measures> known;
  const Candidates made = of_pairs({{{0, 1}, 5}, {{1, 2}, 0}, {{3, 4}, 0}}, known);
  EXPECT_EQ(within_tolerance(made, {2, 2, 2}), (Levels{0, 1, 1}));  // asset 1: half of its depths
}

TEST(WithinTolerance, RefinesOnlyWhatCanBeToBlame) {
  std::map<Levels, Measures> known;
  const Candidates made = of_pairs({{{0, 1}, 1.5}, {{3, 4}, 0}}, known);
  EXPECT_EQ(within_tolerance(made, {2, 2, 1}), (Levels{0, 1, 1}));
}

TEST(Tolerances, AreAtMostThatOfTheSmallestThatMoves) {
  EXPECT_EQ(tolerances_of(0.5, {100, 4, 2, 1}, {false, true, true, false}),
            (std::vector<double>{1, 1, 1, 0.5}));
  EXPECT_EQ(tolerances_of(0.5, {100, 4}, {false, false}), (std::vector<double>{50, 2}));
}

TEST(WithinTolerance, RefinesWhereAllTogetherChangeTooMuch) {
  MadeUp scene(0.8);  // each at level 2 changes 3.2, both together 6.4, one of them at level 1 4
  const Levels chosen = within_tolerance(scene.candidates(), {4, 4});
  EXPECT_EQ(chosen, (Levels{1, 2}));
}

TEST(WithinBudget, StaysAtTheFinestWhereThatIsCheapEnough) {
  MadeUp scene(1);
  EXPECT_EQ(within_budget(scene.candidates(), 16, time_of), (Levels{0, 0}));
}

TEST(WithinBudget, CoarsensWhatAddsLeastErrorForWhatItSaves) {
  MadeUp scene(1);
  EXPECT_EQ(within_budget(scene.candidates(), 12, time_of), (Levels{1, 0}));
  EXPECT_EQ(within_budget(scene.candidates(), 8, time_of), (Levels{1, 1}));
  EXPECT_EQ(within_budget(scene.candidates(), 4, time_of), (Levels{2, 2}));
}

TEST(WithinBudget, TakesTheCheapestWhereNothingIsCheapEnough) {
  MadeUp scene(1);
  EXPECT_EQ(within_budget(scene.candidates(), 1, time_of), (Levels{3, 3}));
}

TEST(WithinBudget, MeasuresAllAtTheirCoarsestBeforeItGivesUp) {
  Candidates made;  // only both together save anything
  made.error_bounds = {{0, 1}, {0, 1}};
  std::map<Levels, Measures> known;
  for (const Levels& levels : {Levels{0, 0}, Levels{1, 0}, Levels{0, 1}}) known[levels].query_seconds = 10;
  known[{1, 1}].query_seconds = 5;
  made.measure = [&](const Levels& levels) -> const Measures& { return known.at(levels); };
  EXPECT_EQ(within_budget(made, 6, time_of), (Levels{1, 1}));
}

TEST(WithinBudget, LeavesLevelsOutThatSaveNothing) {
  Candidates made;
  made.error_bounds = {{0, 1, 2}};
  std::map<Levels, Measures> known;
  for (std::uint32_t level = 0; level < 3; ++level)
    known[{level}].query_seconds = level == 1 ? 12 : 10 - level;
  made.measure = [&](const Levels& levels) -> const Measures& { return known.at(levels); };
  EXPECT_EQ(within_budget(made, 9, time_of), (Levels{2}));
  EXPECT_EQ(within_budget(made, 1, time_of), (Levels{2}));
}

}  // namespace
}  // namespace tandem::economy
