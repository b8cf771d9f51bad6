#include "common/real_from_text.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <random>
#include <string>

namespace tandem {
namespace {

constexpr double kUntouched = 0.375;

/// This is what a reader found: the number's bits (of not-a-number alone that it is one), its end, and its
/// status.
struct Found {
  std::uint64_t bits;
  std::ptrdiff_t length;
  std::errc status;

  bool operator==(const Found&) const = default;
};

template <typename Reader>
Found read(const std::string& text, Reader reader) {
  double value = kUntouched;
  const std::from_chars_result got = reader(text.data(), text.data() + text.size(), value);
  return {value != value ? UINT64_MAX : std::bit_cast<std::uint64_t>(value), got.ptr - text.data(), got.ec};
}

// Returns whether both readers find the same.
::testing::AssertionResult agree(const std::string& text) {
  const auto of_library = [](const char* first, const char* last, double& value) {
    return std::from_chars(first, last, value);
  };
  const Found ours = read(text, real_by_strtod), expected = read(text, of_library);
  if (ours == expected) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << text << ": " << ours.length << " and " << expected.length
                                       << " characters, bits " << ours.bits << " and " << expected.bits;
}

std::string digits(std::mt19937& random, std::uint_fast32_t most) {
  std::string text;
  for (std::uint_fast32_t left = random() % (most + 1); left > 0; --left)
    text += static_cast<char>('0' + random() % 10);
  return text;
}

TEST(RealByStrtod, FindsWhatTheLibraryFindsInOddText) {
  for (const char* text : {"",
                           "-",
                           "--1",
                           "+1",
                           ".",
                           "-.",
                           ".5",
                           "5.",
                           "-0",
                           "0x10",
                           "1e",
                           "1e+",
                           "1e-",
                           "1E5",
                           "1e+5x",
                           "1.5.5",
                           "inf",
                           "-INF",
                           "infinity",
                           "infinit",
                           "in",
                           "nan",
                           "-nan",
                           "nan(ind)",
                           "nan(",
                           "nan(a b)",
                           "NaN()",
                           "1e400",
                           "-1e400",
                           "1e-400",
                           "0e400",
                           "0e-400",
                           "4.9e-324",
                           "2e-324",
                           "2.2250738585072011e-308",
                           "1.7976931348623159e308",
                           " 1",
                           "1 ",
                           "e5",
                           "9007199254740993"})
    EXPECT_TRUE(agree(text));
}

TEST(RealByStrtod, FindsWhatTheLibraryFindsInRandomNumbers) {
  std::mt19937 random(1);
  for (int i = 0; i < 100000; ++i) {
    std::string text =
        (random() % 2 ? "-" : "") + digits(random, 20) + (random() % 4 ? "." : "") + digits(random, 90);
    if (random() % 2) text += "e" + std::to_string(static_cast<int>(random() % 700) - 350);
    ASSERT_TRUE(agree(text));
  }
}

}  // namespace
}  // namespace tandem
