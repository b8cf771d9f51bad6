#include "common/report.h"

#include <gtest/gtest.h>

#include <limits>

namespace tandem {
namespace {

struct Counted {
  std::uint64_t pairs = 0, walks = 0;
};
constexpr CounterRow<Counted> kCounted[] = {{"pairs", "  pairs", &Counted::pairs},
                                            {"walks", nullptr, &Counted::walks}};

TEST(Report, TextHasRowsInTheirOwnOrder) {
  Report report(6, 8);
  report.line("scene.h5: on cpu");
  report.add("hash", "0123");
  report.add("seconds", times({0.003, 0.001, 0.002})).row("took", Unit::milliseconds, "; alone");
  report.add(kCounted, Counted{5804, 7});
  report["hash"].row("hash", Unit::words);
  report.row("error", 1.25e-5, Unit::magnitude, " m");
  EXPECT_EQ(report.text(),
            "scene.h5: on cpu\n"
            "  took       1.000  best of 3, median 2.000; alone\n"
            "    pairs    5,804\n"
            "  hash    0123\n"
            "  error   1.25e-05 m\n");
}

TEST(Report, LongLabelsWidenTheirColumn) {
  Report report(2, 3);
  report.row("a", 1, Unit::count);
  report.row("within tolerance", 2, Unit::count);
  EXPECT_EQ(report.text(), "  a                  1\n  within tolerance   2\n");
}

TEST(Report, JsonHasEntriesInTheOrderInWhichTheyWereAdded) {
  Report report;
  report.add(kCounted, Counted{1, 2}, false);
  report.add_attribute("version", "1.0");
  report.add_json("last/contacts", 3);
  report.add("reach", std::numeric_limits<double>::infinity());
  report.add("last/speed", 0.5);
  EXPECT_EQ(report.json().dump(), R"({"pairs":1,"walks":2,"last":{"contacts":3,"speed":0.5},"reach":null})");
  EXPECT_EQ(report.text(), "");
}

TEST(Report, SecondsOfNoRepeatAreNullAndHaveNoRow) {
  Report report;
  report.add("seconds", times({})).row("took", Unit::milliseconds);
  EXPECT_EQ(report.json().dump(), R"({"seconds":null})");
  EXPECT_EQ(report.text(), "");
}

}  // namespace
}  // namespace tandem
