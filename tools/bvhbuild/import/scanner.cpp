#include "scanner.h"

#include <algorithm>
#include <limits>
#include <string_view>
#include <system_error>

#include "common/real_from_text.h"

namespace tandem::build {
namespace {

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

bool starts_with_ignoring_case(const char* first, const char* last, std::string_view lower_case) {
  if (static_cast<std::size_t>(last - first) < lower_case.size()) return false;
  return std::equal(lower_case.begin(), lower_case.end(), first,
                    [](char a, char b) { return a == lower(b); });
}

// Reads what the C library of Visual C++ before 2015 printed: "1.#INF", "1.#IND", "1.#QNAN", "1.#SNAN",
// padded with digits to the asked precision ("1.#IND00").
const char* parse_windows_special(const char* first, const char* last, double& value) {
  if (!starts_with_ignoring_case(first, last, "1.#")) return nullptr;
  first += 3;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  constexpr struct {
    std::string_view word;
    double value;
  } kWords[] = {{"inf", kInf}, {"ind", kNan}, {"qnan", kNan}, {"snan", kNan}};
  for (const auto& special : kWords) {
    if (!starts_with_ignoring_case(first, last, special.word)) continue;
    value = special.value;
    return std::find_if_not(first + special.word.size(), last, is_digit);
  }
  return nullptr;
}

// The power of ten of the first significant digit, for a number that real_from_text() found too large or too
// small: only its sign counts, so that an exponent that fits in no integer may saturate.
bool is_beyond_one(const char* first, const char* last) {
  std::int64_t power = 0;
  bool significant = false;
  const char* p = first;
  for (; p != last && is_digit(*p); ++p) {
    significant = significant || *p != '0';
    power += significant ? 1 : 0;
  }
  if (p != last && *p == '.') {
    for (++p; p != last && is_digit(*p); ++p) {
      significant = significant || *p != '0';
      power -= significant ? 0 : 1;
    }
  }
  std::int64_t exponent = 0;
  if (p != last && lower(*p) == 'e') parse_integer(p + 1, last, exponent);
  return power + exponent > 0;
}

}  // namespace

const char* parse_real(const char* first, const char* last, double& value) {
  const bool negative = first != last && *first == '-';
  if (first != last && (*first == '-' || *first == '+')) ++first;
  if (first == last || *first == '-') return nullptr;

  double magnitude = 0;
  auto [end, status] = real_from_text(first, last, magnitude);
  if (status == std::errc::invalid_argument) return nullptr;
  if (status == std::errc::result_out_of_range)
    magnitude = is_beyond_one(first, end) ? std::numeric_limits<double>::infinity() : 0.0;
  if (end != last && *end == '#') {
    const char* const special_end = parse_windows_special(first, last, magnitude);
    if (special_end) end = special_end;
  }
  value = negative ? -magnitude : magnitude;
  return end;
}

TextScanner::TextScanner(std::string_view text)
    : begin_(text.data()), cursor_(text.data()), end_(text.data() + text.size()) {
  if (text.starts_with("\xEF\xBB\xBF")) cursor_ += 3;
}

std::string_view TextScanner::word() const {
  const char* const last = std::find_if(cursor_, end_, [](char c) { return is_blank(c) || is_line_end(c); });
  return {cursor_, static_cast<std::size_t>(last - cursor_)};
}

std::string_view TextScanner::take_line() {
  const char* const first = cursor_;
  skip_to_line_end();
  return trimmed({first, static_cast<std::size_t>(cursor_ - first)});
}

std::string TextScanner::line_at(const char* position) const {
  const auto is_space = [](char c) { return is_blank(c) || is_line_end(c); };
  if (position == end_)
    while (position != begin_ && is_space(position[-1])) --position;
  std::size_t line = 1;
  for (const char* p = begin_; p != position; ++p) {
    const bool ends_in_line_feed = *p == '\r' && p + 1 != end_ && p[1] == '\n';
    if (is_line_end(*p) && !ends_in_line_feed) ++line;
  }
  return "line " + std::to_string(line);
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

bool equals_ignoring_case(std::string_view word, std::string_view lower_case) {
  const auto same = [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b; };
  return std::equal(word.begin(), word.end(), lower_case.begin(), lower_case.end(), same);
}

}  // namespace tandem::build
