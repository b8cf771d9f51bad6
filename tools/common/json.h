#pragma once
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace tandem {

/// A JSON object whose keys stay in the order in which they were written.
using Json = nlohmann::ordered_json;

/// Text for a terminal or a pipe; bytes that are no UTF-8 become U+FFFD.
inline std::string pretty(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

template <typename Value>
Json or_null(const std::optional<Value>& value) {
  return value ? Json(*value) : Json();
}

/// Returns the text, or null where it is empty.
inline Json or_null(const std::string& text) {
  return text.empty() ? Json() : Json(text);
}

}  // namespace tandem
