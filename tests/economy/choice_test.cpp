#include "economy/choice.h"

#include <gtest/gtest.h>

#include <map>

namespace tandem::economy {
namespace {

// Two assets of four levels. A level's error bound is 0, 1, 4, 16; measured depths are off by a part of the
// sum of both, and the time is 8, 4, 2, 1 for each.
class MadeUp {
 public:
  explicit MadeUp(double part) : part_(part) {}

  Candidates candidates() {
    Candidates made;
    made.error_bounds = {kBounds, kBounds};
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
    measures.change.depth.median = depth;
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
  EXPECT_EQ(within_tolerance(scene.candidates(), {7, 0}), (Levels{1, 0}));  // level 2: bound 4, measured 8
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
