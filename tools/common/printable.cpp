#include "printable.h"

#include <algorithm>
#include <cstdint>

namespace tandem {
namespace {

std::size_t sequence_length(unsigned char lead) {
  if (lead < 0x80) return 1;
  if (lead >= 0xC2 && lead <= 0xDF) return 2;
  if (lead >= 0xE0 && lead <= 0xEF) return 3;
  if (lead >= 0xF0 && lead <= 0xF4) return 4;
  return 0;
}

// Overlong forms, surrogates and what lies past U+10FFFF are no UTF-8; C0, DEL and C1 are control characters.
bool is_shown(std::uint32_t code, std::size_t length) {
  constexpr std::uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  if (code < kLeast[length] || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return false;
  return code >= 0xA0 || (code >= 0x20 && code < 0x7F);
}

// Bytes of the character that `bytes` begins with, 0 when it must not be shown.
std::size_t shown_length(std::string_view bytes) {
  const std::size_t length = sequence_length(static_cast<unsigned char>(bytes[0]));
  if (length == 0 || length > bytes.size()) return 0;
  constexpr unsigned char kLeadMask[] = {0, 0x7F, 0x1F, 0x0F, 0x07};
  std::uint32_t code = static_cast<unsigned char>(bytes[0]) & kLeadMask[length];
  for (std::size_t i = 1; i < length; ++i) {
    const auto next = static_cast<unsigned char>(bytes[i]);
    if ((next & 0xC0) != 0x80) return 0;
    code = code << 6 | (next & 0x3Fu);
  }
  return is_shown(code, length) ? length : 0;
}

}  // namespace

std::string printable(std::string_view bytes, std::size_t most_bytes) {
  std::string text;
  std::size_t used = 0;
  while (used < bytes.size()) {
    const std::size_t length = shown_length(bytes.substr(used));
    if (used + std::max<std::size_t>(length, 1) > most_bytes) return text + "...";
    if (length == 0) {
      text += "\xEF\xBF\xBD";
    } else {
      text += bytes.substr(used, length);
    }
    used += std::max<std::size_t>(length, 1);
  }
  return text;
}

std::string in_quotes(std::string_view bytes) {
  constexpr std::size_t kMostBytes = 40;
  return "'" + printable(bytes, kMostBytes) + "'";
}

}  // namespace tandem
