#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace tandem::build {

/// The number of type T that a file stores at `bytes`, which need not be aligned, in byte order `Order`.
template <class T, std::endian Order>
T load_number(const char* bytes) {
  std::array<char, sizeof(T)> raw;
  std::copy_n(bytes, sizeof(T), raw.begin());
  if constexpr (Order != std::endian::native) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}

/// Parses the decimal number that starts at `first`; the locale plays no part.
///
/// Effect: `value` becomes the float64 nearest to the text: infinite when it is too large, zero when it is
/// too small. "nan", "inf", "infinity", "nan(...)" and the "1.#INF", "-1.#IND00", "1.#QNAN" of old Windows
/// programs are numbers too, in upper and lower case.
/// Result: one past the number's last character, or nullptr (`value` unchanged) where no number starts.
/// The caller decides what may follow: of "0x10" this reads the 0.
const char* parse_real(const char* first, const char* last, double& value);

/// Parses the integer that starts at `first`, as parse_real does. A magnitude beyond 10^17 comes out as
/// some magnitude beyond 10^17: no file counts that far, so all of them are equally wrong.
inline const char* parse_integer(const char* first, const char* last, std::int64_t& value) {
  const char* p = first;
  const bool negative = p != last && *p == '-';
  if (p != last && (*p == '-' || *p == '+')) ++p;
  const char* const digits = p;
  constexpr std::int64_t kFarBeyondAnyCount = 100'000'000'000'000'000;
  std::int64_t magnitude = 0;
  for (; p != last && *p >= '0' && *p <= '9'; ++p) {
    magnitude = magnitude > kFarBeyondAnyCount ? magnitude : magnitude * 10 + (*p - '0');
  }
  if (p == digits) return nullptr;
  value = negative ? -magnitude : magnitude;
  return p;
}

inline bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}
inline bool is_line_end(char c) {
  return c == '\n' || c == '\r';
}

/// A cursor over text that belongs to somebody else: words, numbers and lines, with LF, CR LF or CR at their
/// ends. Line numbers are counted only when asked for, so that a well-formed file never pays for them.
class TextScanner {
 public:
  /// Starts behind a UTF-8 byte order mark, if there is one.
  explicit TextScanner(std::string_view text);

  bool at_end() const { return cursor_ == end_; }
  bool at_line_end() const { return at_end() || is_line_end(*cursor_); }
  char peek() const { return at_end() ? '\0' : *cursor_; }
  const char* cursor() const { return cursor_; }
  std::size_t bytes_left() const { return static_cast<std::size_t>(end_ - cursor_); }

  void skip_blanks() {
    while (!at_end() && is_blank(*cursor_)) ++cursor_;
  }
  /// Skips blanks and line ends.
  void skip_space() {
    while (!at_end() && (is_blank(*cursor_) || is_line_end(*cursor_))) ++cursor_;
  }
  /// Skips blanks, line ends and comments that reach from '#' to the end of their line.
  void skip_space_and_comments() {
    for (skip_space(); peek() == '#'; skip_space()) skip_to_line_end();
  }
  void skip_to_line_end() {
    while (!at_end() && !is_line_end(*cursor_)) ++cursor_;
  }
  void skip_word() {
    while (!at_end() && !is_blank(*cursor_) && !is_line_end(*cursor_)) ++cursor_;
  }
  /// Skips that many bytes of the bytes_left().
  void skip_bytes(std::size_t count) { cursor_ += count; }
  /// Skips the one line end at the cursor.
  void skip_line_end() {
    if (at_end()) return;
    if (*cursor_++ == '\r' && peek() == '\n') ++cursor_;
  }

  /// The word at the cursor: up to a blank or a line end, empty where the cursor stands on one.
  std::string_view word() const;
  /// Takes the rest of the line, without blanks around it.
  std::string_view take_line();

  /// Reads the number at the cursor; false, with the cursor unmoved, where none stands there or it has a tail
  /// ("3x").
  bool read_real(double& value) { return advance(parse_real(cursor_, end_, value)); }
  /// Reads an integer; `end_mark` may follow it directly, as '/' follows the first index of "7/8/9".
  bool read_integer(std::int64_t& value, char end_mark = '#') {
    return advance(parse_integer(cursor_, end_, value), end_mark);
  }

  /// "line 12", counted from 1; at the end of the text the line of its last word.
  std::string line() const { return line_at(cursor_); }
  std::string line_at(const char* position) const;

 private:
  bool advance(const char* number_end, char end_mark = '#') {
    if (!number_end || (number_end != end_ && !ends_number(*number_end, end_mark))) return false;
    cursor_ = number_end;
    return true;
  }
  // A comment or a continuation of the line may touch the number.
  static bool ends_number(char c, char end_mark) {
    return is_blank(c) || is_line_end(c) || c == end_mark || c == '#' || c == '\\';
  }

  const char* begin_;
  const char* cursor_;
  const char* end_;
};

/// `text` without blanks at its ends.
std::string_view trimmed(std::string_view text);

/// Returns whether `word` is `lower_case` in any mixture of upper and lower case.
bool equals_ignoring_case(std::string_view word, std::string_view lower_case);

}  // namespace tandem::build
