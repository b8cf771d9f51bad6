#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "statistics.h"

namespace tandem {

/// A JSON object whose keys stay in the order in which they were written.
using Json = nlohmann::ordered_json;

/// The statistics under the stable keys of docs/json.md.
Json to_json(const TreeStatistics& statistics);

/// Text for a terminal or a pipe; bytes that are no UTF-8 become U+FFFD.
std::string pretty(const Json& json);

/// 16 hexadecimal digits.
std::string hexadecimal(std::uint64_t value);

/// "5,804".
std::string with_commas(std::uint64_t value);

/// "527 KiB", "1.2 GiB".
std::string human_bytes(std::uint64_t bytes);

}  // namespace tandem
