#include "missing_library.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>

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
