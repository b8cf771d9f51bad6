#include "missing_library.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#ifdef TANDEM_READS_REALS

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

// Returns the end of "12.5e-3", "inf", "infinity" or "nan", as strtod() knows them without a sign; `first`
// where there is none of these. has_value becomes true where some digit is not 0.
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
    return skip_word(first, last, "nan");
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

// musl's strtod() rounds correctly, and the program never leaves the locale "C". The scanner, which alone
// calls this, takes signs itself.
std::from_chars_result std::from_chars(const char* first, const char* last, double& value) {
  bool has_value = false;
  const char* const end = number_end(first, last, has_value);
  if (end == first) return {first, errc::invalid_argument};
  char few[64];
  const auto length = static_cast<size_t>(end - first);
  double read;
  if (length < sizeof few) {
    memcpy(few, first, length);
    few[length] = '\0';
    read = strtod(few, nullptr);
  } else {
    read = strtod(string(first, end).c_str(), nullptr);
  }
  const bool is_finite_word = *first == '.' || (*first >= '0' && *first <= '9');
  if (is_finite_word && (std::isinf(read) || (read == 0 && has_value)))
    return {end, errc::result_out_of_range};
  value = read;
  return {end, errc{}};
}
#endif

#ifdef TANDEM_WRITES_REALS
// The shortest digits that give the value back, as "0.5" or "5e-05", whichever is shorter.
std::to_chars_result std::to_chars(char* first, char* last, double value) {
  char scientific[40], fixed[400];
  int digits = 1;
  do {
    snprintf(scientific, sizeof scientific, "%.*e", digits - 1, value);
  } while (strtod(scientific, nullptr) != value && ++digits <= 17);
  const char* const exponent = strchr(scientific, 'e');
  const int places = exponent != nullptr ? digits - 1 - atoi(exponent + 1) : 0;
  snprintf(fixed, sizeof fixed, "%.*f", places > 0 ? places : 0, value);
  const char* const text = strlen(fixed) <= strlen(scientific) ? fixed : scientific;
  const size_t length = strlen(text);
  if (length > static_cast<size_t>(last - first)) return {last, errc::value_too_large};
  memcpy(first, text, length);
  return {first + length, errc{}};
}
#endif
