#pragma once
#include <cstddef>
#include <string>
#include <string_view>

namespace tandem {

/// A name or a word of a file as it may be shown, stored and written as JSON: valid UTF-8 without control
/// characters.
///
/// Effect: what is no valid UTF-8 or a control character becomes U+FFFD; past `most_bytes` bytes of the input
/// the rest is left out and "..." stands for it.
std::string printable(std::string_view bytes, std::size_t most_bytes = std::string::npos);

/// Returns printable bytes in quotes, short enough for a message.
std::string in_quotes(std::string_view bytes);

}  // namespace tandem
