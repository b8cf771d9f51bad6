#include "common/printable.h"

#include <gtest/gtest.h>

namespace tandem::build {
namespace {

using namespace std::string_view_literals;

TEST(Printable, LeavesUtf8AsItIs) {
  EXPECT_EQ(printable("K\u00fche \u725b \U0001F404", 100), "K\u00fche \u725b \U0001F404");
}

TEST(Printable, ReplacesWhatIsNoUtf8) {
  EXPECT_EQ(printable("K\xFChe", 100), "K\uFFFDhe");
  EXPECT_EQ(printable("\xC0\xAF", 100), "\uFFFD\uFFFD") << "overlong";
  EXPECT_EQ(printable("\xED\xA0\x80", 100), "\uFFFD\uFFFD\uFFFD") << "a surrogate";
  EXPECT_EQ(printable("\xF4\x90\x80\x80", 100), "\uFFFD\uFFFD\uFFFD\uFFFD") << "past U+10FFFF";
  EXPECT_EQ(printable("cut \xE7\x89", 100), "cut \uFFFD\uFFFD");
}

TEST(Printable, ReplacesControlCharacters) {
  EXPECT_EQ(printable("a\0b\x1B[31m\x7F"sv, 100), "a\uFFFDb\uFFFD[31m\uFFFD");
}

TEST(Printable, CutsLongTextBetweenCharacters) {
  EXPECT_EQ(printable("abcdef", 3), "abc...");
  EXPECT_EQ(printable("ab\u725b", 4), "ab...");
  EXPECT_EQ(printable("abc", 3), "abc");
}

}  // namespace
}  // namespace tandem::build
