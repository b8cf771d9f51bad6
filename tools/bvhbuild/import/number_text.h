#pragma once
#include <cstdint>

namespace tandem::build {

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

}  // namespace tandem::build
