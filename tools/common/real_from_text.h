#pragma once
#include <charconv>
#include <version>

namespace tandem {

/// Reads a float64 number as std::from_chars() does, by strtod(), which goes by the locale "C" as long as the
/// program calls no setlocale(). The strtod() of glibc, of macOS and of musl round correctly.
std::from_chars_result real_by_strtod(const char* first, const char* last, double& value);

/// Reads a float64 number as std::from_chars() does, which libc++ has from version 20 on.
inline std::from_chars_result real_from_text(const char* first, const char* last, double& value) {
#if defined(_LIBCPP_VERSION) && _LIBCPP_VERSION < 200000
  return real_by_strtod(first, last, value);
#else
  return std::from_chars(first, last, value);
#endif
}

}  // namespace tandem
