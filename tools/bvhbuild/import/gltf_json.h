#pragma once
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::build {

/// An object in the JSON of a glTF file. It knows its way there, so that errors name it.
///
/// A member that is null counts as left out. A number that is left out reads as `otherwise` or 0, a text or a
/// list as empty. Members of a wrong type throw a GltfError: "nodes[3].mesh is not an unsigned integer below
/// 2147483648".
class GltfObject {
 public:
  /// Throws a GltfError when `json` is no object.
  explicit GltfObject(const nlohmann::json& json) : GltfObject(json, nullptr, {}, -1) {}

  bool has(const char* name) const { return find(name) != nullptr; }
  int index(const char* name, int otherwise = -1) const;
  std::uint64_t size(const char* name) const;
  std::uint64_t required_size(const char* name) const;
  bool truth(const char* name) const;
  std::string text(const char* name) const;
  /// The items of an array. Item: int for indices, double or std::string.
  template <class Item>
  std::vector<Item> list(const char* name) const;

  using Use = std::function<void(const GltfObject&)>;
  /// Calls `use` with the object that a member is.
  void with(const char* name, const Use& use) const;
  /// Calls `use` with each object of the array that a member is.
  void each(const char* name, const Use& use) const;

  /// The way to a member: "accessors[2].sparse.count".
  std::string path(const char* name, std::int64_t item = -1) const;

 private:
  GltfObject(const nlohmann::json& json, const GltfObject* parent, const char* name, std::int64_t item);
  const nlohmann::json* find(const char* name) const;
  /// The array that a member is; empty where it is left out.
  const nlohmann::json& array(const char* name) const;

  const nlohmann::json& json_;
  const GltfObject* parent_;  ///< of the document: nullptr
  const char* name_;          ///< in its parent
  std::int64_t item_;         ///< in the array of that name; -1: it is no array
};

/// Throws a GltfError for text that is no JSON, nested more than 500 deep, or of so many values that they and
/// what is made of them may take more than `most_bytes` bytes.
nlohmann::json parse_gltf_json(std::string_view text, std::uint64_t most_bytes);

}  // namespace tandem::build
