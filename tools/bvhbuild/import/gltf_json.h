#pragma once
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::build {

/// Why a glTF file cannot be read. read_gltf() makes a ReadResult of it.
struct GltfError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Names an item of a list for messages: "accessors[3]".
std::string numbered(const char* list, std::int64_t index);

/// Returns the item that `user` names by its index; throws a GltfError where there is none.
template <typename Item>
const Item& named(const std::vector<Item>& items, const char* list, int index, const std::string& user) {
  if (index >= 0 && static_cast<std::size_t>(index) < items.size())
    return items[static_cast<std::size_t>(index)];
  throw GltfError(user + " names " + numbered(list, index) + " of " + std::to_string(items.size()));
}

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

/// A file of glTF 1 is refused with these words.
inline constexpr const char* kGltf1Error = "is glTF 1; Tandem reads glTF 2";

/// Throws a GltfError for another version than 2.
void check_gltf_version(const std::string& version);

/// Says where the parts of a glTF file lie, which is either JSON text or a binary container (GLB).
struct GltfContainer {
  bool is_binary = false;
  std::string_view json;
  std::string_view chunk;  ///< the binary one; empty when there is none
};

/// Finds the parts by what the bytes are, whatever the file's ending. Chunks of a GLB begin where the one
/// before ends, padded or not; those of other types are passed over (glTF 2.0, section 4.4).
///
/// Throws a GltfError for chunks that reach out of the file, and for another version than 2.
GltfContainer open_gltf_container(std::string_view bytes);

}  // namespace tandem::build
