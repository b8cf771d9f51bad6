#include "gltf_model.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "common/path_text.h"
#include "common/printable.h"

namespace tandem::build {
namespace {

constexpr std::string_view kBase64 = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// The value of each sign, -1 of those that are no digits.
constexpr std::array<signed char, 256> base64_values() {
  std::array<signed char, 256> values{};
  values.fill(-1);
  for (std::size_t i = 0; i < kBase64.size(); ++i)
    values[static_cast<unsigned char>(kBase64[i])] = static_cast<signed char>(i);
  return values;
}

bool has_scheme(std::string_view uri) {
  const std::size_t colon = uri.find(':');
  return colon != std::string_view::npos && uri.substr(0, colon).find('/') == std::string_view::npos &&
         colon > 1;
}

/// A buffer as the JSON announces it.
struct BufferSource {
  std::string name;  ///< for messages: "buffers[0] 'wheel'"
  std::string uri;   ///< empty: the binary chunk of a GLB file
  std::uint64_t bytes = 0;
};

void check_length(const BufferSource& source, const char* holder, std::uint64_t held) {
  if (held < source.bytes)
    throw GltfError(source.name + ": " + holder + " holds " + std::to_string(held) +
                    " bytes, its byteLength says " + std::to_string(source.bytes));
}

std::vector<char> bytes_of_data_uri(const BufferSource& source) {
  const std::string_view uri = source.uri;
  const std::size_t comma = std::min(uri.find(','), uri.size());
  if (!uri.substr(0, comma).ends_with(";base64"))
    throw GltfError(source.name + ": " + in_quotes(uri) + " is not the kind of data that a buffer has");
  const std::string_view text = uri.substr(std::min(comma + 1, uri.size()));
  const bool is_escaped = text.find('%') != std::string_view::npos;
  std::vector<char> bytes = base64_decoded(is_escaped ? percent_decoded(text) : text, source.bytes);
  check_length(source, "its data URI", bytes.size());
  return bytes;
}

/// Effect: `file` becomes the file of this name, read whole. Result: empty, or why it cannot be read.
std::string read_file(const std::string& name, GltfBufferPlaces& places,
                      std::shared_ptr<const InputFile>& file) {
  const auto opened = std::make_shared<InputFile>();
  if (name.find('\0') != std::string::npos) return "no such file";
  const std::filesystem::path path = places.folder / path_of(name);
  std::string wrong = places.outside_files ? "" : why_not_beside(places.folder, path);
  if (wrong.empty()) wrong = opened->open(path);
  if (!wrong.empty()) return wrong;
  const auto known = places.files.find(opened->identity());
  if (known != places.files.end()) return file = known->second, std::string();
  if (opened->size() > places.most_bytes_in_files)
    return "its bytes take more than the memory limit (--memory-limit)";
  places.most_bytes_in_files -= opened->size();
  places.files.emplace(opened->identity(), file = opened);
  places.paths.push_back(text_of(path));
  return opened->read_all();
}

std::shared_ptr<const InputFile> file_of(const BufferSource& source, GltfBufferPlaces& places) {
  if (has_scheme(source.uri))
    throw GltfError(source.name + ": " + in_quotes(source.uri) + " is not a file beside the glTF");
  const std::string name = percent_decoded(source.uri);
  std::shared_ptr<const InputFile> file;
  std::string wrong = read_file(name, places, file);
  if (wrong.empty() && file->bytes().size() < source.bytes)
    wrong = "holds " + std::to_string(file->bytes().size()) + " bytes, " + std::to_string(source.bytes) +
            " are needed";
  if (!wrong.empty()) throw GltfError(source.name + ": " + in_quotes(name) + ": " + wrong);
  return file;
}

/// Finds the bytes of a buffer: in a data URI, a file or the chunk, which all may be longer than the buffer.
/// Result: as many bytes as the source says. Throws a GltfError: "buffers[0]: 'wheel.bin': no such file".
GltfBuffer read_buffer(const BufferSource& source, GltfBufferPlaces& places) {
  GltfBuffer buffer;
  if (source.bytes == 0) throw GltfError(source.name + " has no byteLength");
  if (source.uri.starts_with("data:")) {
    buffer.decoded = bytes_of_data_uri(source);
    buffer.bytes = {buffer.decoded.data(), buffer.decoded.size()};
  } else if (!source.uri.empty()) {
    buffer.file = file_of(source, places);
    buffer.bytes = buffer.file->bytes().substr(0, source.bytes);
  } else {
    if (!places.is_binary) throw GltfError(source.name + " has no uri, so its bytes are nowhere");
    check_length(source, "the binary chunk", places.chunk.size());
    buffer.bytes = places.chunk.substr(0, source.bytes);
  }
  return buffer;
}

constexpr const char* kDraco =
    "its meshes are compressed with KHR_draco_mesh_compression, which Tandem's glTF reader does not decode";

/// Required extensions that say nothing about where triangles are, or nothing that we do not do anyway.
bool leaves_triangles_alone(std::string_view extension) {
  for (const char* start : {"KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "KHR_lights_"})
    if (extension.starts_with(start)) return true;
  return extension == "KHR_mesh_quantization";
}

void check_required_extensions(const std::vector<std::string>& required, std::vector<std::string>& remarks) {
  constexpr std::size_t kMostRemarks = 2;
  for (const std::string& name : required) {
    if (name == "KHR_draco_mesh_compression") throw GltfError(kDraco);
    // assimp 5.2.5 passes over these two and reads whatever bytes lie in their place.
    if (name == "EXT_meshopt_compression" || name == "KHR_meshopt_compression")
      throw GltfError("its buffers are compressed with " + name + ", which Tandem does not decode");
    if (name == "EXT_mesh_gpu_instancing")
      throw GltfError("its meshes are repeated by EXT_mesh_gpu_instancing, which Tandem does not read");
    if (!leaves_triangles_alone(name) && remarks.size() < kMostRemarks)
      remarks.push_back("requires the extension " + in_quotes(name) + ", which is passed over");
  }
}

BufferSource buffer_source(const GltfObject& buffer, std::size_t index) {
  const std::string name = buffer.text("name");
  return {numbered("buffers", index) + (name.empty() ? "" : " " + in_quotes(name)), buffer.text("uri"),
          buffer.size("byteLength")};
}

GltfView view(const GltfObject& from) {
  return {from.index("buffer"), from.size("byteOffset"), from.size("byteLength"), from.size("byteStride")};
}

int components(const std::string& type) {
  for (const auto& [name, count] :
       {std::pair{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}})
    if (type == name) return count;
  return 0;  // smaller matrices included: nothing that is read is one
}

GltfAccessor accessor(const GltfObject& from) {
  GltfAccessor to{from.index("bufferView"),
                  from.size("byteOffset"),
                  from.required_size("count"),
                  from.index("componentType", 0),
                  components(from.text("type")),
                  from.truth("normalized"),
                  {}};
  from.with("sparse", [&to](const GltfObject& sparse) {
    to.sparse.emplace().count = sparse.required_size("count");
    sparse.with("indices", [&to](const GltfObject& indices) {
      to.sparse->index_view = indices.index("bufferView");
      to.sparse->index_offset = indices.size("byteOffset");
      to.sparse->index_type = indices.index("componentType", 0);
    });
    sparse.with("values", [&to](const GltfObject& values) {
      to.sparse->value_view = values.index("bufferView");
      to.sparse->value_offset = values.size("byteOffset");
    });
  });
  return to;
}

bool has_extension(const GltfObject& object, const char* name) {
  bool has = false;
  object.with("extensions", [&](const GltfObject& extensions) { has = extensions.has(name); });
  return has;
}

GltfPrimitive primitive(const GltfObject& from) {
  GltfPrimitive to{from.index("mode", 4), -1, from.index("indices"),
                   has_extension(from, "KHR_draco_mesh_compression")};
  from.with("attributes", [&to](const GltfObject& all) { to.positions = all.index("POSITION"); });
  return to;
}

bool has_weights(const GltfObject& object) {
  const std::vector<double> weights = object.list<double>("weights");
  return std::any_of(weights.begin(), weights.end(), [](double w) { return w != 0; });
}

GltfMesh mesh(const GltfObject& from) {
  GltfMesh to{from.text("name"), {}, has_weights(from)};
  from.each("primitives", [&to](const GltfObject& item) { to.primitives.push_back(primitive(item)); });
  return to;
}

/// Draco's data may be there without being required; then the plain accessors hold the triangles, or nothing.
void check_draco(const GltfModel& model) {
  for (const GltfMesh& mesh : model.meshes)
    for (const GltfPrimitive& primitive : mesh.primitives) {
      const auto index = static_cast<std::size_t>(primitive.positions);
      const bool is_known = primitive.positions >= 0 && index < model.accessors.size();
      if (primitive.has_draco && is_known && model.accessors[index].view == -1) throw GltfError(kDraco);
    }
}

/// A list of numbers that is there with the right length, or not at all.
std::vector<double> numbers(const GltfObject& node, const char* name, std::size_t wanted) {
  std::vector<double> result = node.list<double>(name);
  if (!result.empty() && result.size() != wanted)
    throw GltfError(node.path(name) + " has " + std::to_string(result.size()) + " numbers, not " +
                    std::to_string(wanted));
  return result;
}

template <std::size_t n>
std::optional<std::array<double, n>> part(const GltfObject& node, const char* name) {
  const std::vector<double> list = numbers(node, name, n);
  if (list.empty()) return std::nullopt;
  std::array<double, n> result;
  std::copy(list.begin(), list.end(), result.begin());
  return result;
}

/// The map from a node to its parent. glTF keeps matrices column by column; their fourth row has no meaning
/// but 0 0 0 1.
Affine local_transform(const GltfObject& node) {
  const Affine parts = affine_of(parts_of(node));
  const std::vector<double> m = numbers(node, "matrix", 16);
  if (m.empty()) return parts;
  if (m[3] != 0 || m[7] != 0 || m[11] != 0 || std::abs(m[15] - 1) >= 1e-6)
    throw GltfError(node.path("matrix") + " is not affine: its last row is not 0 0 0 1");
  Affine t{};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) t[row][column] = m[4 * column + row];
  return t;
}

GltfNode node(const GltfObject& from) {
  return {from.text("name"),
          from.index("mesh"),
          from.list<int>("children"),
          local_transform(from),
          from.has("skin"),
          has_weights(from),
          has_extension(from, "EXT_mesh_gpu_instancing")};
}

/// The nodes that are no other's child, in their order.
std::vector<int> all_roots(const std::vector<GltfNode>& nodes) {
  std::vector<bool> is_child(nodes.size());
  for (const GltfNode& node : nodes)
    for (const int child : node.children)
      if (static_cast<std::size_t>(child) < nodes.size()) is_child[child] = true;
  std::vector<int> roots;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (!is_child[i]) roots.push_back(static_cast<int>(i));
  if (roots.empty() && !nodes.empty()) throw GltfError("its nodes are a cycle: each is another one's child");
  return roots;
}

void choose_scene(const GltfObject& root, GltfModel& model) {
  std::vector<std::vector<int>> scenes;
  root.each("scenes", [&](const GltfObject& scene) { scenes.push_back(scene.list<int>("nodes")); });
  const int chosen = root.index("scene", 0);
  if (scenes.empty()) {
    model.roots = all_roots(model.nodes);
    return;
  }
  const std::string of_all = numbered("scenes", chosen) + " of " + std::to_string(scenes.size());
  if (static_cast<std::size_t>(chosen) >= scenes.size()) throw GltfError("its default scene is " + of_all);
  model.roots = std::move(scenes[chosen]);
  if (scenes.size() > 1) model.remarks.push_back(of_all + " is read");
}

}  // namespace

GltfParts parts_of(const GltfObject& node) {
  GltfParts parts;
  parts.translation = part<3>(node, "translation");
  parts.scale = part<3>(node, "scale");
  parts.rotation = part<4>(node, "rotation");
  if (parts.rotation == std::array<double, 4>{})
    throw GltfError(node.path("rotation") + " is zero, which is no rotation");
  return parts;
}

// A quaternion stored in decimal is never quite of length 1; dividing by its length leaves a rotation.
Affine affine_of(const GltfParts& parts) {
  Affine result = kIdentity;
  if (parts.rotation) {
    const auto [x, y, z, w] = *parts.rotation;
    const double f = 2 / (x * x + y * y + z * z + w * w);
    result = {{{1 - f * (y * y + z * z), f * (x * y - z * w), f * (x * z + y * w), 0},
               {f * (x * y + z * w), 1 - f * (x * x + z * z), f * (y * z - x * w), 0},
               {f * (x * z - y * w), f * (y * z + x * w), 1 - f * (x * x + y * y), 0}}};
  }
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3 && parts.scale; ++column)
      result[row][column] *= (*parts.scale)[column];
    if (parts.translation) result[row][3] = (*parts.translation)[row];
  }
  return result;
}

std::string percent_decoded(std::string_view text) {
  constexpr std::size_t kEscape = 3;  // "%20"
  std::string decoded;
  while (!text.empty()) {
    const std::string_view escape = text.substr(0, kEscape);
    std::uint8_t byte = 0;
    const bool is_escape =
        escape.size() == kEscape && escape[0] == '%' &&
        std::from_chars(escape.data() + 1, escape.data() + kEscape, byte, 16).ptr == escape.data() + kEscape;
    decoded += is_escape ? static_cast<char>(byte) : text[0];
    text.remove_prefix(is_escape ? kEscape : 1);
  }
  return decoded;
}

std::vector<char> base64_decoded(std::string_view text, std::uint64_t most_bytes) {
  static constexpr std::array<signed char, 256> kValues = base64_values();
  std::vector<char> bytes;
  bytes.reserve(std::min<std::uint64_t>(text.size() / 4 * 3 + 2, most_bytes));
  std::uint32_t bits = 0;  // the low `count` ones are not yet written
  int count = 0;
  for (const char sign : text) {
    const int value = kValues[static_cast<unsigned char>(sign)];
    if (value < 0 || bytes.size() == most_bytes) break;
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<char>(bits >> count & 0xFFu));
  }
  return bytes;
}

GltfModel read_gltf_model(const GltfObject& root, GltfBufferPlaces places) {
  std::string version;
  root.with("asset", [&](const GltfObject& asset) { version = asset.text("version"); });
  check_gltf_version(version);
  GltfModel model;
  check_required_extensions(root.list<std::string>("extensionsRequired"), model.remarks);
  root.each("buffers", [&](const GltfObject& item) {
    model.buffers.push_back(read_buffer(buffer_source(item, model.buffers.size()), places));
  });
  for (const auto& [identity, file] : places.files) model.bytes_held += file->size();
  model.files = std::move(places.paths);
  root.each("bufferViews", [&](const GltfObject& item) { model.views.push_back(view(item)); });
  root.each("accessors", [&](const GltfObject& item) { model.accessors.push_back(accessor(item)); });
  root.each("meshes", [&](const GltfObject& item) { model.meshes.push_back(mesh(item)); });
  check_draco(model);
  root.each("nodes", [&](const GltfObject& item) { model.nodes.push_back(node(item)); });
  choose_scene(root, model);
  return model;
}

bool is_for_another_gltf_reader(std::string_view error) {
  return error == kGltf1Error || error == kDraco;
}

}  // namespace tandem::build
