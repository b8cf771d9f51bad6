#pragma once
#include <nlohmann/json.hpp>
#include <string>

namespace tandem {

/// A JSON object whose keys stay in the order in which they were written.
using Json = nlohmann::ordered_json;

/// Text for a terminal or a pipe; bytes that are no UTF-8 become U+FFFD.
std::string pretty(const Json& json);

}  // namespace tandem
