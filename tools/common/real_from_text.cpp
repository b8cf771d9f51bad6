#include "real_from_text.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string>

namespace tandem {
namespace {

const char* skip_digits(const char* at, const char* last) {
  while (at != last && *at >= '0' && *at <= '9') ++at;
  return at;
}

const char* skip_word(const char* at, const char* last, const char* lower_case) {
  const char* const first = at;
  for (; *lower_case != '\0'; ++at, ++lower_case)
    if (at == last || (*at | 0x20) != *lower_case) return first;
  return at;
}

// Returns the end of "(ind)", which may follow "nan"; `first` where there is none.
const char* skip_payload(const char* first, const char* last) {
  if (first == last || *first != '(') return first;
  const char* const end = std::find_if_not(first + 1, last, [](char c) {
    return (c >= '0' && c <= '9') || ((c | 0x20) >= 'a' && (c | 0x20) <= 'z') || c == '_';
  });
  return end != last && *end == ')' ? end + 1 : first;
}

// Returns the end of "12.5e-3", "inf", "infinity", "nan" or "nan(ind)", as strtod() knows them without a
// sign; `first` where there is none of these. has_value becomes true where some digit is not 0.
const char* number_end(const char* first, const char* last, bool& has_value) {
  const char* const whole = skip_digits(first, last);
  const char* end = whole;
  std::size_t digits = static_cast<std::size_t>(whole - first);
  if (end != last && *end == '.') {
    end = skip_digits(end + 1, last);
    digits += static_cast<std::size_t>(end - whole) - 1;
  }
  if (digits == 0) {
    const char* const infinite = skip_word(first, last, "inf");
    if (infinite != first) return skip_word(infinite, last, "inity");
    const char* const nan = skip_word(first, last, "nan");
    return nan != first ? skip_payload(nan, last) : first;
  }
  for (const char* at = first; at != end; ++at) has_value = has_value || (*at >= '1' && *at <= '9');
  if (end != last && (*end | 0x20) == 'e') {
    const char* const sign = end + 1;
    const char* const power = sign != last && (*sign == '+' || *sign == '-') ? sign + 1 : sign;
    const char* const power_end = skip_digits(power, last);
    if (power_end != power) end = power_end;
  }
  return end;
}

}  // namespace

std::from_chars_result real_by_strtod(const char* first, const char* last, double& value) {
  const bool negative = first != last && *first == '-';
  const char* const from = negative ? first + 1 : first;
  bool has_value = false;
  const char* const end = number_end(from, last, has_value);
  if (end == from) return {first, std::errc::invalid_argument};
  char few[64];
  const auto length = static_cast<std::size_t>(end - from);
  double read;
  if (length < sizeof few) {
    std::memcpy(few, from, length);
    few[length] = '\0';
    read = std::strtod(few, nullptr);
  } else {
    read = std::strtod(std::string(from, end).c_str(), nullptr);
  }
  const bool is_finite_word = *from == '.' || (*from >= '0' && *from <= '9');
  if (is_finite_word && (std::isinf(read) || (read == 0 && has_value)))
    return {end, std::errc::result_out_of_range};
  value = negative ? -read : read;
  return {end, std::errc()};
}

}  // namespace tandem
