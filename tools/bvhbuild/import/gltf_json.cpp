#include "import/gltf_json.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "import/printable.h"

namespace tandem::build {
namespace {

/// How messages call the types that a member may have.
constexpr const char* kIndex = "an unsigned integer below 2147483648";
constexpr const char* kSize = "an unsigned integer below 2^53";
constexpr const char* kNumber = "a number";
constexpr const char* kText = "a text";
constexpr const char* kTruth = "true or false";
constexpr const char* kObject = "an object";
constexpr const char* kArray = "an array";

struct Member {
  std::string_view path;
  const char* type;
};

/// The members that say where triangles are, in ascending order of their paths.
constexpr Member kMembers[] = {
    {"accessors", kArray},
    {"accessors[]", kObject},
    {"accessors[].bufferView", kIndex},
    {"accessors[].byteOffset", kSize},
    {"accessors[].componentType", kIndex},
    {"accessors[].count", kSize},
    {"accessors[].normalized", kTruth},
    {"accessors[].sparse", kObject},
    {"accessors[].sparse.count", kIndex},
    {"accessors[].sparse.indices", kObject},
    {"accessors[].sparse.indices.bufferView", kIndex},
    {"accessors[].sparse.indices.byteOffset", kIndex},
    {"accessors[].sparse.indices.componentType", kIndex},
    {"accessors[].sparse.values", kObject},
    {"accessors[].sparse.values.bufferView", kIndex},
    {"accessors[].sparse.values.byteOffset", kIndex},
    {"accessors[].type", kText},
    {"asset", kObject},
    {"asset.version", kText},
    {"bufferViews", kArray},
    {"bufferViews[]", kObject},
    {"bufferViews[].buffer", kIndex},
    {"bufferViews[].byteLength", kSize},
    {"bufferViews[].byteOffset", kSize},
    {"bufferViews[].byteStride", kIndex},
    {"buffers", kArray},
    {"buffers[]", kObject},
    {"buffers[].byteLength", kSize},
    {"buffers[].name", kText},
    {"buffers[].uri", kText},
    {"extensionsRequired", kArray},
    {"extensionsRequired[]", kText},
    {"extensionsUsed", kArray},
    {"extensionsUsed[]", kText},
    {"meshes", kArray},
    {"meshes[]", kObject},
    {"meshes[].name", kText},
    {"meshes[].primitives", kArray},
    {"meshes[].primitives[]", kObject},
    {"meshes[].primitives[].attributes", kObject},
    {"meshes[].primitives[].attributes.POSITION", kIndex},
    {"meshes[].primitives[].indices", kIndex},
    {"meshes[].primitives[].mode", kIndex},
    {"meshes[].weights", kArray},
    {"meshes[].weights[]", kNumber},
    {"nodes", kArray},
    {"nodes[]", kObject},
    {"nodes[].children", kArray},
    {"nodes[].children[]", kIndex},
    {"nodes[].matrix", kArray},
    {"nodes[].matrix[]", kNumber},
    {"nodes[].mesh", kIndex},
    {"nodes[].name", kText},
    {"nodes[].rotation", kArray},
    {"nodes[].rotation[]", kNumber},
    {"nodes[].scale", kArray},
    {"nodes[].scale[]", kNumber},
    {"nodes[].skin", kIndex},
    {"nodes[].translation", kArray},
    {"nodes[].translation[]", kNumber},
    {"nodes[].weights", kArray},
    {"nodes[].weights[]", kNumber},
    {"scene", kIndex},
    {"scenes", kArray},
    {"scenes[]", kObject},
    {"scenes[].nodes", kArray},
    {"scenes[].nodes[]", kIndex},
};
static_assert(std::is_sorted(std::begin(kMembers), std::end(kMembers),
                             [](const Member& a, const Member& b) { return a.path < b.path; }));

/// The type that a member must have, or nullptr when nobody reads it.
const char* type_of(std::string_view path) {
  const auto* found = std::lower_bound(std::begin(kMembers), std::end(kMembers), path,
                                       [](const Member& m, std::string_view p) { return m.path < p; });
  return found != std::end(kMembers) && found->path == path ? found->type : nullptr;
}

/// "[json.exception.parse_error.101] parse error at line 1, column 5: ..." without the library's number.
std::string parse_failure(std::string_view what) {
  constexpr std::size_t kMostBytes = 300;
  if (what.starts_with('[')) what.remove_prefix(std::min(what.find(']') + 2, what.size()));
  return "its JSON cannot be read: " + printable(what, kMostBytes);
}

/// Receives the events of the parser. Each returns whether the parser shall go on.
class Scanner : public nlohmann::json_sax<nlohmann::json> {
 public:
  explicit Scanner(GltfJson& found) : found_(found) {}

  bool null() override {
    begin_value();
    end_value();
    return true;
  }
  bool boolean(bool) override { return scalar(kTruth); }
  bool number_integer(number_integer_t) override { return scalar(kNumber); }
  bool number_unsigned(number_unsigned_t value) override;
  bool number_float(number_float_t, const string_t&) override { return scalar(kNumber); }
  bool string(string_t& value) override;
  bool binary(binary_t&) override { return false; }  // JSON has none
  bool start_object(std::size_t) override { return open(kObject); }
  bool start_array(std::size_t) override { return open(kArray); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override;
  bool parse_error(std::size_t, const std::string&, const nlohmann::json::exception& error) override;

 private:
  /// An object or array that is open.
  struct Level {
    std::size_t path_bytes;  ///< of its own path
    std::size_t items = 0;   ///< of an array, so far
    bool is_array = false;
  };

  void begin_value();
  void end_value();
  bool expect(const char* type);
  bool scalar(const char* type);
  bool open(const char* type);
  bool close();
  std::string place() const;

  GltfJson& found_;
  std::string path_;  ///< of the value at hand: "nodes[].children"
  std::vector<Level> levels_;
};

void Scanner::begin_value() {
  if (levels_.empty() || !levels_.back().is_array) return;
  path_ += "[]";
  ++levels_.back().items;
}

void Scanner::end_value() {
  if (!levels_.empty()) path_.resize(levels_.back().path_bytes);
}

bool Scanner::expect(const char* type) {
  const char* wanted = type_of(path_);
  const bool fits = wanted == nullptr || wanted == type ||
                    (wanted == kNumber && (type == kIndex || type == kSize)) ||
                    (wanted == kSize && type == kIndex);
  if (!fits) found_.error = place() + " is not " + wanted;
  return fits;
}

/// The path of the value at hand with the numbers of the items it lies in.
std::string Scanner::place() const {
  std::string text;
  auto level = levels_.begin();
  for (std::size_t i = 0; i < path_.size(); ++i) {
    text += path_[i];
    if (path_[i] != '[') continue;
    while (level != levels_.end() && !level->is_array) ++level;
    if (level != levels_.end()) text += std::to_string((level++)->items - 1);
  }
  return text;
}

bool Scanner::scalar(const char* type) {
  begin_value();
  const bool fits = expect(type);
  end_value();
  return fits;
}

bool Scanner::number_unsigned(number_unsigned_t value) {
  const bool is_buffer_size = path_ == "buffers[].byteLength" && !found_.buffers.empty();
  if (is_buffer_size) found_.buffers.back().bytes = value;
  if (value <= INT32_MAX) return scalar(kIndex);
  return scalar(value < (std::uint64_t{1} << 53) ? kSize : kNumber);
}

bool Scanner::string(string_t& value) {
  begin_value();
  const bool fits = expect(kText);
  if (path_ == "asset.version")
    found_.version = std::move(value);
  else if (path_ == "extensionsUsed[]")
    found_.extensions_used.push_back(std::move(value));
  else if (path_ == "extensionsRequired[]")
    found_.extensions_required.push_back(std::move(value));
  else if (path_ == "buffers[].uri")
    found_.buffers.back().uri = std::move(value);
  else if (path_ == "buffers[].name")
    found_.buffers.back().name = std::move(value);
  end_value();
  return fits;
}

bool Scanner::open(const char* type) {
  constexpr std::size_t kDeepest = 500;
  begin_value();
  if (!expect(type)) return false;
  if (levels_.size() == kDeepest) {
    found_.error = "its JSON is nested more than 500 deep";
    return false;
  }
  if (levels_.empty() && type != kObject) {
    found_.error = "its JSON is not an object";
    return false;
  }
  if (path_ == "buffers") found_.buffers.clear();  // named twice, the last one counts
  if (path_ == "buffers[]") found_.buffers.emplace_back();
  levels_.push_back({path_.size(), 0, type == kArray});
  return true;
}

bool Scanner::close() {
  levels_.pop_back();
  end_value();
  return true;
}

bool Scanner::key(string_t& name) {
  // Of members that nobody reads, what lies inside is not read either, so their names need not be kept. A
  // name with the signs of a path in it must not pass for one.
  const bool is_plain = name.find_first_of(".[]") == std::string::npos && name.size() < 32;
  path_.resize(levels_.back().path_bytes);
  if (!path_.empty()) path_ += '.';
  path_ += is_plain ? name : std::string("?");
  return true;
}

bool Scanner::parse_error(std::size_t, const std::string&, const nlohmann::json::exception& error) {
  found_.error = parse_failure(error.what());
  return false;
}

}  // namespace

GltfJson scan_gltf_json(std::string_view text) {
  GltfJson found;
  Scanner scanner(found);
  nlohmann::json::sax_parse(text.begin(), text.end(), &scanner);
  return found;
}

}  // namespace tandem::build
