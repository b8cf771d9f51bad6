#include "number_words.h"

#include <cstdarg>
#include <cstdio>

namespace tandem {

std::string hexadecimal(std::uint64_t value) {
  return format("%016llx", static_cast<unsigned long long>(value));
}

std::string with_commas(std::uint64_t value) {
  std::string text = std::to_string(value);
  for (auto i = static_cast<std::ptrdiff_t>(text.size()) - 3; i > 0; i -= 3)
    text.insert(static_cast<std::size_t>(i), ",");
  return text;
}

std::string human_bytes(std::uint64_t bytes) {
  constexpr const char* kUnits[] = {"B", "KiB", "MiB", "GiB", "TiB"};
  auto value = static_cast<double>(bytes);
  int unit = 0;
  while (value >= 1024 && unit < 4) {
    value /= 1024;
    ++unit;
  }
  return format(unit > 0 && value < 100 ? "%.1f %s" : "%.0f %s", value, kUnits[unit]);
}

std::string threads_words(std::uint64_t threads) {
  return with_commas(threads) + (threads == 1 ? " thread" : " threads");
}

std::string format(const char* pattern, ...) {
  va_list values;
  va_start(values, pattern);
  va_list again;
  va_copy(again, values);
  std::string text(static_cast<std::size_t>(std::vsnprintf(nullptr, 0, pattern, values)), '\0');
  va_end(values);
  std::vsnprintf(text.data(), text.size() + 1, pattern, again);
  va_end(again);
  return text;
}

}  // namespace tandem
