#pragma once
#include <filesystem>
#include <string>
#include <string_view>

/// Paths as text: UTF-8 on Windows, elsewhere the bytes as they are. (There, path::string() and paths made of
/// strings go by the character set of the C library.)
namespace tandem {

inline std::filesystem::path path_of(std::string_view text) {
  return std::u8string(text.begin(), text.end());
}

inline std::string text_of(const std::filesystem::path& path) {
  const std::u8string text = path.u8string();
  return {text.begin(), text.end()};
}

}  // namespace tandem
