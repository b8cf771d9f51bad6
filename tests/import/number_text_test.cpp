#include "bvhbuild/import/scanner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <string_view>

namespace tandem::build {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

// The number that all of `text` is, or -77 where it is none.
double real(std::string_view text) {
  double value = -77;
  const char* const last = text.data() + text.size();
  return parse_real(text.data(), last, value) == last ? value : -77;
}

std::int64_t integer(std::string_view text) {
  std::int64_t value = -77;
  const char* const last = text.data() + text.size();
  return parse_integer(text.data(), last, value) == last ? value : -77;
}

TEST(NumberText, ReadsEveryWayToWriteADecimal) {
  EXPECT_EQ(real("0"), 0.0);
  EXPECT_EQ(real("-1.5"), -1.5);
  EXPECT_EQ(real("+1.5"), 1.5);
  EXPECT_EQ(real("1."), 1.0);
  EXPECT_EQ(real(".5"), 0.5);
  EXPECT_EQ(real("-.5e+1"), -5.0);
  EXPECT_EQ(real("25E-2"), 0.25);
  EXPECT_EQ(real("0.1"), 0.1);
  EXPECT_TRUE(std::signbit(real("-0")));
}

TEST(NumberText, KeepsAllBitsOfADouble) {
  EXPECT_EQ(real("0.1000000000000000055511151231257827"), 0.1);
  EXPECT_EQ(real("9007199254740993"), 9007199254740992.0);
  EXPECT_EQ(real("2.2250738585072011e-308"), 2.2250738585072011e-308);
  EXPECT_EQ(real("5e-324"), 5e-324);
  EXPECT_EQ(real("1e-42"), 1e-42);
}

TEST(NumberText, TooLargeIsInfiniteAndTooSmallIsZero) {
  EXPECT_EQ(real("1e400"), kInf);
  EXPECT_EQ(real("-1e400"), -kInf);
  EXPECT_EQ(real("1e-400"), 0.0);
  EXPECT_TRUE(std::signbit(real("-1e-400")));
  EXPECT_EQ(real("0.0001e400"), kInf);
  EXPECT_EQ(real("10000e-400"), 0.0);
  EXPECT_EQ(real("1e99999999999999999999999"), kInf);
  EXPECT_EQ(real("1e-99999999999999999999999"), 0.0);
  EXPECT_EQ(real("0e99999999999999999999999"), 0.0);
  EXPECT_EQ(real(std::string(400, '9')), kInf);
  EXPECT_EQ(real("0." + std::string(400, '0') + "1"), 0.0);
  EXPECT_EQ(real("0." + std::string(1000, '0') + "1e400"), 0.0);
  EXPECT_EQ(real("1" + std::string(1000, '0') + "e-400"), kInf);
}

TEST(NumberText, ReadsNonFiniteNumbersOfAnyProgram) {
  for (const char* text : {"nan", "NaN", "-nan", "NAN", "nan(ind)", "-nan(ind)", "1.#QNAN", "1.#qnan0",
                           "-1.#IND", "1.#IND00", "1.#SNAN"})
    EXPECT_TRUE(std::isnan(real(text))) << text;
  for (const char* text : {"inf", "+Inf", "INF", "infinity", "Infinity", "1.#INF", "1.#inf", "1.#INF00"})
    EXPECT_EQ(real(text), kInf) << text;
  for (const char* text : {"-inf", "-1.#INF", "-INFINITY"}) EXPECT_EQ(real(text), -kInf) << text;
}

TEST(NumberText, RefusesWhatIsNoDecimal) {
  for (const char* text :
       {"", "-", "+", ".", "e5", "+-1", "-+1", "--1", "0x10", "1e", "1,5", "one", "1.#", "1.#FOO", "2.#INF"})
    EXPECT_EQ(real(text), -77) << text;
}

TEST(NumberText, ReadsIntegersWithASign) {
  EXPECT_EQ(integer("0"), 0);
  EXPECT_EQ(integer("+12"), 12);
  EXPECT_EQ(integer("-12"), -12);
  EXPECT_EQ(integer("007"), 7);
  EXPECT_EQ(integer("4294967295"), 4294967295);
}

TEST(NumberText, IntegersPastEveryCountStayPastIt) {
  EXPECT_GT(integer("99999999999999999999999999"), std::int64_t{1} << 56);
  EXPECT_LT(integer("-99999999999999999999999999"), -(std::int64_t{1} << 56));
}

TEST(NumberText, RefusesWhatIsNoInteger) {
  for (const char* text : {"", "-", "3.0", "1e3", "0x10", "--1", "+-1", "12a"})
    EXPECT_EQ(integer(text), -77) << text;
}

}  // namespace
}  // namespace tandem::build
