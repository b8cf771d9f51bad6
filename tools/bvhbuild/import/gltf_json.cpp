#include "gltf_json.h"

#include <algorithm>
#include <bit>
#include <cstdint>

#include "common/printable.h"
#include "scanner.h"

namespace tandem::build {
namespace {

using Json = nlohmann::json;

/// A member, or an item of one; its path is only put together for errors.
struct Spot {
  const GltfObject& object;
  const char* name;
  std::int64_t item = -1;
};

[[noreturn]] void refuse(const Spot& spot, const char* wanted) {
  throw GltfError(spot.object.path(spot.name, spot.item) + " is not " + wanted);
}

template <class Item>
Item converted(const Json& value, const Spot& spot);

template <>
int converted(const Json& value, const Spot& spot) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > INT32_MAX)
    refuse(spot, "an unsigned integer below 2147483648");
  return value.get<int>();
}

template <>
double converted(const Json& value, const Spot& spot) {
  if (!value.is_number()) refuse(spot, "a number");
  return value.get<double>();
}

template <>
std::string converted(const Json& value, const Spot& spot) {
  if (!value.is_string()) refuse(spot, "a text");
  return value.get<std::string>();
}

/// "[json.exception.parse_error.101] parse error at line 1, column 5: ..." without the library's number.
std::string parse_failure(std::string_view what) {
  constexpr std::size_t kMostBytes = 300;
  if (what.starts_with('[')) what.remove_prefix(std::min(what.find(']') + 2, what.size()));
  return "its JSON cannot be read: " + printable(what, kMostBytes);
}

/// Counts brackets and commas outside of strings, before anything is built of them. (The parser's own
/// callback would look at all items of an array once more after each.)
void check_size(std::string_view text, std::uint64_t most_bytes) {
  constexpr int kDeepest = 500;
  // An empty object, the shortest that a node can be, takes 80 bytes here and 176 as a GltfNode.
  constexpr std::uint64_t kBytesOfAValue = 256;
  std::uint64_t values = 0;
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string && c == '\\') ++i;
    if (c == '"') in_string = !in_string;
    if (in_string) continue;
    depth += (c == '[' || c == '{') - (c == ']' || c == '}');
    values += c == '[' || c == '{' || c == ',';
    if (depth > kDeepest) throw GltfError("its JSON is nested more than 500 deep");
  }
  if (values > most_bytes / kBytesOfAValue)
    throw GltfError("its JSON takes more than the memory limit (--memory-limit)");
}

constexpr std::uint64_t kHeaderBytes = 12;  // magic, version, length of the file
constexpr std::uint32_t kJson = 0x4E4F534A, kBinary = 0x004E4942;

std::uint32_t word(std::string_view bytes, std::uint64_t offset) {
  return load_number<std::uint32_t, std::endian::little>(bytes.data() + offset);
}

struct Chunk {
  std::uint32_t type;
  std::string_view bytes;
};

/// Takes a chunk off the front of what is left of a file.
Chunk take_chunk(std::string_view& left, const char* name) {
  constexpr std::uint64_t kHead = 8;  // length of the chunk, type
  if (left.size() < kHead || word(left, 0) > left.size() - kHead)
    throw GltfError("its " + std::string(name) + " chunk is cut short");
  const Chunk chunk{word(left, 4), left.substr(kHead, word(left, 0))};
  left.remove_prefix(kHead + chunk.bytes.size());
  return chunk;
}

}  // namespace

std::string numbered(const char* list, std::int64_t index) {
  return std::string(list) + "[" + std::to_string(index) + "]";
}

GltfObject::GltfObject(const Json& json, const GltfObject* parent, const char* name, std::int64_t item)
    : json_(json), parent_(parent), name_(name), item_(item) {
  if (json.is_object()) return;
  if (parent == nullptr) throw GltfError("its JSON is not an object");
  refuse({*parent, name, item}, "an object");
}

const Json* GltfObject::find(const char* name) const {
  const auto found = json_.find(name);
  return found == json_.end() || found->is_null() ? nullptr : &*found;
}

std::string GltfObject::path(const char* name, std::int64_t item) const {
  std::string way = parent_ == nullptr ? std::string() : parent_->path(name_, item_) + ".";
  way += name;
  return item < 0 ? way : way + "[" + std::to_string(item) + "]";
}

int GltfObject::index(const char* name, int otherwise) const {
  const Json* value = find(name);
  return value == nullptr ? otherwise : converted<int>(*value, {*this, name});
}

std::uint64_t GltfObject::size(const char* name) const {
  const Json* value = find(name);
  if (value == nullptr) return 0;
  constexpr std::uint64_t kLeastInexact = std::uint64_t{1} << 53;
  if (!value->is_number_unsigned() || value->get<std::uint64_t>() >= kLeastInexact)
    refuse({*this, name}, "an unsigned integer below 2^53");
  return value->get<std::uint64_t>();
}

std::uint64_t GltfObject::required_size(const char* name) const {
  if (!has(name)) throw GltfError(path(name) + " is missing");
  return size(name);
}

bool GltfObject::truth(const char* name) const {
  const Json* value = find(name);
  if (value != nullptr && !value->is_boolean()) refuse({*this, name}, "true or false");
  return value != nullptr && value->get<bool>();
}

std::string GltfObject::text(const char* name) const {
  const Json* value = find(name);
  return value == nullptr ? std::string() : converted<std::string>(*value, {*this, name});
}

const Json& GltfObject::array(const char* name) const {
  static const Json kNone = Json::array();
  const Json* value = find(name);
  if (value == nullptr) return kNone;
  if (!value->is_array()) refuse({*this, name}, "an array");
  return *value;
}

template <class Item>
std::vector<Item> GltfObject::list(const char* name) const {
  const Json& values = array(name);
  std::vector<Item> items;
  items.reserve(values.size());
  for (const Json& value : values)
    items.push_back(converted<Item>(value, {*this, name, static_cast<std::int64_t>(items.size())}));
  return items;
}

template std::vector<int> GltfObject::list(const char*) const;
template std::vector<double> GltfObject::list(const char*) const;
template std::vector<std::string> GltfObject::list(const char*) const;

void GltfObject::with(const char* name, const Use& use) const {
  if (const Json* value = find(name)) use(GltfObject(*value, this, name, -1));
}

void GltfObject::each(const char* name, const Use& use) const {
  std::int64_t item = 0;
  for (const Json& value : array(name)) use(GltfObject(value, this, name, item++));
}

Json parse_gltf_json(std::string_view text, std::uint64_t most_bytes) {
  check_size(text, most_bytes);
  try {
    return Json::parse(text.begin(), text.end());
  } catch (const Json::exception& error) {
    throw GltfError(parse_failure(error.what()));
  }
}

void check_gltf_version(const std::string& version) {
  if (version.empty()) throw GltfError("is no glTF: its JSON names no asset.version");
  if (version.starts_with("1.") || version == "1") throw GltfError(kGltf1Error);
  if (version.starts_with("2.") || version == "2") return;
  throw GltfError("is glTF " + in_quotes(version) + "; Tandem reads glTF 2");
}

GltfContainer open_gltf_container(std::string_view bytes) {
  if (!bytes.starts_with("glTF")) return {false, bytes, {}};
  if (bytes.size() < kHeaderBytes) throw GltfError("its GLB header is cut short");
  check_gltf_version(std::to_string(word(bytes, 4)) + ".0");
  const std::uint64_t promised = word(bytes, 8);
  if (promised > bytes.size())
    throw GltfError("its GLB header promises " + std::to_string(promised) + " bytes, the file holds " +
                    std::to_string(bytes.size()));
  std::string_view left = bytes.substr(0, promised);
  left.remove_prefix(std::min<std::uint64_t>(kHeaderBytes, promised));
  const Chunk json = take_chunk(left, "JSON");
  if (json.type != kJson) throw GltfError("its first chunk is not JSON");
  GltfContainer container{true, json.bytes, {}};
  while (!left.empty() && container.chunk.empty()) {
    const Chunk chunk = take_chunk(left, "binary");
    if (chunk.type == kBinary) container.chunk = chunk.bytes;
  }
  return container;
}

}  // namespace tandem::build
