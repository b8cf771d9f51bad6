#include "import/read_gltf.h"

#include <algorithm>
#include <exception>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "import/gltf_buffer_file.h"
#include "import/gltf_container.h"
#include "import/gltf_json.h"
#include "import/gltf_scene.h"
#include "import/gltf_support.h"
#include "import/gltf_transform.h"
#include "import/input_file.h"
#include "import/printable.h"

// All of tinygltf is compiled here, without its image decoders: nothing opens an image.
#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>

namespace tandem::build {
namespace {

std::string numbered(const char* list, std::size_t index) {
  return std::string(list) + "[" + std::to_string(index) + "]";
}

/// What tinygltf's calls for files need. They come in the order of the buffers.
struct BufferFiles {
  std::filesystem::path folder;
  const std::vector<GltfBufferSource>* sources;
  std::size_t next = 0;  ///< buffer that the next call may be about
  std::string error;     ///< of the call that failed
};

bool is_in_a_file(const GltfBufferSource& source) {
  return !source.uri.empty() && !tinygltf::IsDataURI(source.uri);
}

std::string described(std::size_t index, const GltfBufferSource& source) {
  return numbered("buffers", index) + (source.name.empty() ? "" : " " + build::quoted(source.name));
}

bool read_next_buffer(std::vector<unsigned char>* bytes, std::string*, const std::string&, void* user) {
  auto& files = *static_cast<BufferFiles*>(user);
  const std::vector<GltfBufferSource>& sources = *files.sources;
  while (files.next < sources.size() && !is_in_a_file(sources[files.next])) ++files.next;
  if (files.next == sources.size()) return false;
  const std::size_t index = files.next++;
  const std::string wrong = read_gltf_buffer_file(files.folder, sources[index], *bytes);
  if (!wrong.empty()) files.error = described(index, sources[index]) + ": " + wrong;
  return wrong.empty();
}

bool take_any_file(const std::string&, void*) {
  return true;
}

std::string same_path(const std::string& path, void*) {
  return path;
}

/// Bytes that a base64 text stands for, up to the first sign that is none.
std::uint64_t base64_bytes(std::string_view text) {
  const auto is_digit = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '+' || c == '/';
  };
  const auto end = std::find_if_not(text.begin(), text.end(), is_digit);
  const auto digits = static_cast<std::uint64_t>(end - text.begin());
  return digits / 4 * 3 + (digits % 4 > 1 ? digits % 4 - 1 : 0);
}

/// What tinygltf would say with the whole buffer in its message.
std::string check_buffers(const GltfJson& json, bool is_binary) {
  for (std::size_t i = 0; i < json.buffers.size(); ++i) {
    const GltfBufferSource& source = json.buffers[i];
    const std::string name = described(i, source);
    if (source.bytes == 0) return name + " has no byteLength";
    if (source.uri.empty() && !is_binary) return name + " has no uri, so its bytes are nowhere";
    if (!tinygltf::IsDataURI(source.uri)) continue;
    const std::uint64_t held = base64_bytes(std::string_view(source.uri).substr(source.uri.find(',') + 1));
    if (held != source.bytes)
      return name + ": its data URI holds " + std::to_string(held) + " bytes, its byteLength says " +
             std::to_string(source.bytes);
  }
  return {};
}

bool pass_over_image(tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*,
                     int, void*) {
  return true;
}

/// tinygltf's messages, which may hold bytes of the file, on one line.
std::string said_by_tinygltf(std::string text) {
  constexpr std::size_t kMostBytes = 300;
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return "tinygltf: " + (text.empty() ? "failed without a reason" : printable(text, kMostBytes));
}

/// tinygltf goes on without a primitive whose attributes it cannot read; the faces after it would be
/// miscounted.
bool lost_a_primitive(const std::string& complaint) {
  return complaint.find("'attributes'") != std::string::npos;
}

/// Effect: fills `model`. Result: empty, or why not.
std::string load(std::string_view bytes, bool is_binary, BufferFiles& files, tinygltf::Model& model) {
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(pass_over_image, nullptr);
  loader.SetFsCallbacks({take_any_file, same_path, read_next_buffer, nullptr, &files});
  std::string complaint, warning;
  bool ok = false;
  try {
    const auto count = static_cast<unsigned>(bytes.size());
    ok = is_binary ? loader.LoadBinaryFromMemory(&model, &complaint, &warning,
                                                 reinterpret_cast<const unsigned char*>(bytes.data()), count)
                   : loader.LoadASCIIFromString(&model, &complaint, &warning, bytes.data(), count, "");
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    complaint = error.what();
  }
  if (!files.error.empty()) return files.error;
  return ok && !lost_a_primitive(complaint) ? std::string() : said_by_tinygltf(complaint);
}

GltfView converted(const tinygltf::BufferView& view) {
  return {view.buffer, view.byteOffset, view.byteLength, view.byteStride};
}

GltfAccessor converted(const tinygltf::Accessor& accessor) {
  GltfAccessor result{accessor.bufferView,
                      accessor.byteOffset,
                      accessor.count,
                      accessor.componentType,
                      tinygltf::GetNumComponentsInType(static_cast<unsigned>(accessor.type)),
                      accessor.normalized,
                      {}};
  const auto& sparse = accessor.sparse;
  if (sparse.isSparse)
    result.sparse = GltfSparse{static_cast<std::uint64_t>(sparse.count),
                               sparse.indices.bufferView,
                               static_cast<std::uint64_t>(sparse.indices.byteOffset),
                               sparse.indices.componentType,
                               sparse.values.bufferView,
                               static_cast<std::uint64_t>(sparse.values.byteOffset)};
  return result;
}

bool any_not_zero(const std::vector<double>& weights) {
  return std::any_of(weights.begin(), weights.end(), [](double w) { return w != 0; });
}

GltfPrimitive converted(const tinygltf::Primitive& primitive) {
  const auto positions = primitive.attributes.find("POSITION");
  return {primitive.mode, positions == primitive.attributes.end() ? -1 : positions->second,
          primitive.indices};
}

GltfMesh converted(const tinygltf::Mesh& mesh) {
  GltfMesh result{mesh.name, {}, any_not_zero(mesh.weights)};
  for (const tinygltf::Primitive& primitive : mesh.primitives)
    result.primitives.push_back(converted(primitive));
  return result;
}

GltfTransform transform_of(const tinygltf::Node& node) {
  return {node.matrix, node.rotation, node.scale, node.translation};
}

GltfNode converted(const tinygltf::Node& node) {
  GltfNode result{node.name, node.mesh, node.children};
  result.local = local_transform(transform_of(node));
  result.has_skin = node.skin != -1;
  result.has_morph_weights = any_not_zero(node.weights);
  result.is_instanced = node.extensions.count("EXT_mesh_gpu_instancing") != 0;
  return result;
}

/// The nodes that are no other's child, in their order.
std::vector<int> all_roots(const std::vector<tinygltf::Node>& nodes) {
  std::vector<bool> is_child(nodes.size());
  for (const tinygltf::Node& node : nodes)
    for (const int child : node.children)
      if (child >= 0 && static_cast<std::size_t>(child) < nodes.size()) is_child[child] = true;
  std::vector<int> roots;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (!is_child[i]) roots.push_back(static_cast<int>(i));
  return roots;
}

std::string choose_scene(const tinygltf::Model& from, GltfModel& to) {
  const std::size_t scenes = from.scenes.size();
  const int chosen = from.defaultScene == -1 ? 0 : from.defaultScene;
  if (scenes == 0) {
    to.roots = all_roots(from.nodes);
    return to.roots.empty() && !from.nodes.empty() ? "its nodes are a cycle: each is another one's child"
                                                   : "";
  }
  if (chosen < 0 || static_cast<std::size_t>(chosen) >= scenes)
    return "its default scene is scenes[" + std::to_string(chosen) + "] of " + std::to_string(scenes);
  to.roots = from.scenes[chosen].nodes;
  if (scenes > 1)
    to.remarks.push_back("scenes[" + std::to_string(chosen) + "] of " + std::to_string(scenes) + " is read");
  return {};
}

/// Draco's data may be there without being required; then the plain accessors hold the triangles, or nothing.
bool hides_in_draco(const tinygltf::Model& model, const tinygltf::Primitive& primitive) {
  if (primitive.extensions.count("KHR_draco_mesh_compression") == 0) return false;
  const GltfPrimitive plain = converted(primitive);
  const auto index = static_cast<std::size_t>(plain.positions);
  return plain.positions >= 0 && index < model.accessors.size() && model.accessors[index].bufferView == -1;
}

std::string convert_nodes(const tinygltf::Model& from, GltfModel& to) {
  for (std::size_t i = 0; i < from.nodes.size(); ++i) {
    const std::string wrong = check_transform(transform_of(from.nodes[i]));
    if (!wrong.empty()) return numbered("nodes", i) + "." + wrong;
    to.nodes.push_back(converted(from.nodes[i]));
  }
  return choose_scene(from, to);
}

/// Effect: fills `to`, and takes the buffers out of `from`. Result: empty, or why not.
std::string convert(tinygltf::Model& from, GltfModel& to) {
  to.reader = "tinygltf " TANDEM_TINYGLTF_VERSION;
  for (const tinygltf::Mesh& mesh : from.meshes)
    for (const tinygltf::Primitive& primitive : mesh.primitives)
      if (hides_in_draco(from, primitive)) return needs_draco();
  for (tinygltf::Buffer& buffer : from.buffers) to.buffers.push_back(std::move(buffer.data));
  for (const tinygltf::BufferView& view : from.bufferViews) to.views.push_back(converted(view));
  for (const tinygltf::Accessor& accessor : from.accessors) to.accessors.push_back(converted(accessor));
  for (const tinygltf::Mesh& mesh : from.meshes) to.meshes.push_back(converted(mesh));
  return convert_nodes(from, to);
}

/// Effect: fills `model` from a file. Result: empty, or why not.
std::string read_model(const std::filesystem::path& path, GltfModel& model) {
  InputFile file;
  std::string wrong = file.open(path);
  if (wrong.empty()) wrong = file.read_all();
  if (!wrong.empty()) return wrong;
  const GltfContainer container = open_gltf_container(file.bytes());
  if (!container.error.empty()) return container.error;
  if (container.version != 2) return check_gltf_version(std::to_string(container.version) + ".0");
  if (file.bytes().size() > UINT32_MAX) return "has more than 4 GiB of JSON and embedded buffers";
  const GltfJson json = scan_gltf_json(container.json);
  wrong = json.error;
  if (wrong.empty()) wrong = check_gltf_version(json.version);
  if (wrong.empty()) wrong = check_required_extensions(json);
  if (wrong.empty()) wrong = check_buffers(json, container.is_binary);
  if (!wrong.empty()) return wrong;
  model.remarks = remarks_on_extensions(json);
  BufferFiles files{path.parent_path(), &json.buffers, 0, {}};
  tinygltf::Model raw;
  wrong = load(file.bytes(), container.is_binary, files, raw);
  if (wrong.empty()) return convert(raw, model);
  // Without a decoder, tinygltf finds fault with the accessors of meshes that only Draco's data holds.
  return uses_draco(json) ? needs_draco() : wrong;
}

}  // namespace

ReadResult read_gltf(const std::filesystem::path& path, std::uint64_t most_bytes) {
  GltfModel model;
  std::string wrong = read_model(path, model);
  return wrong.empty() ? flatten_gltf(model, most_bytes) : read_failure(std::move(wrong));
}

}  // namespace tandem::build
