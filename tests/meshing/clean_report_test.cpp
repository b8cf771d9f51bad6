#include "tandem/build/clean_report.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace tandem::build {
namespace {

TEST(Findings, ListEveryCountUnderItsOwnKey) {
  CleanReport report;
  report.faces_index_out_of_range = 1;
  report.faces_not_finite = 2;
  report.faces_too_large = 3;
  report.faces_not_simple = 4;
  report.vertices_unreferenced = 5;
  report.vertices_welded = 6;
  report.triangles_degenerate = 7;
  report.triangles_duplicate = 8;
  report.triangles_duplicate_reversed = 9;
  report.triangles_flattened = 10;
  report.faces_too_few_corners = 11;
  report.faces_repeated_corner = 12;
  std::set<std::string> keys;
  std::set<std::uint64_t> counts;
  for (const Finding& finding : findings(report)) {
    keys.insert(finding.key);
    counts.insert(finding.count);
    EXPECT_EQ(finding.sentence().find(std::to_string(finding.count) + " "), 0u);
  }
  EXPECT_EQ(keys.size(), 12u);
  EXPECT_EQ(counts.size(), 12u);
}

TEST(Findings, SpeakOfOneAndOfMany) {
  CleanReport report;
  report.faces_not_finite = 1;
  report.triangles_degenerate = 2;
  std::set<std::string> sentences;
  for (const Finding& finding : findings(report)) sentences.insert(finding.sentence());
  EXPECT_TRUE(sentences.contains("1 face has a coordinate that is NaN or infinite; dropped"));
  EXPECT_TRUE(sentences.contains("2 triangles have all corners on one line; dropped"));
}

TEST(Findings, CallWeldingNoDefect) {
  for (const Finding& finding : findings({}))
    EXPECT_EQ(finding.defect, std::string(finding.key) != "vertices_welded") << finding.key;
}

}  // namespace
}  // namespace tandem::build
