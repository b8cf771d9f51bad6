// What stands between tinygltf and the polygons: the container, the scan of the JSON, and the scene with its
// accessors, made of the fuzzer's bytes without tinygltf.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "import/gltf_accessor.h"
#include "import/gltf_container.h"
#include "import/gltf_json.h"
#include "import/gltf_scene.h"
#include "mesh_invariants.h"

namespace tandem::build {
namespace {

class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

  template <class T>
  T take() {
    T value{};
    const std::size_t count = std::min(sizeof(T), left_);
    std::memcpy(&value, data_, count);
    data_ += count;
    left_ -= count;
    return value;
  }
  /// From -1 up, mostly in range of a short list, sometimes anything.
  int index() {
    const auto value = take<std::uint8_t>();
    return value == 255 ? take<int>() : value % 6 - 1;
  }
  /// Mostly small, sometimes anything.
  std::uint64_t number() {
    const auto value = take<std::uint8_t>();
    return value == 255 ? take<std::uint64_t>() : value;
  }
  std::size_t few() { return take<std::uint8_t>() % 5; }
  std::vector<unsigned char> rest() const { return {data_, data_ + left_}; }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

int component_type(Bytes& bytes) {
  constexpr int kTypes[] = {kInt8, kUint8, kInt16, kUint16, kUint32, kFloat32, kFloat64, 5124, 0};
  return kTypes[bytes.take<std::uint8_t>() % std::size(kTypes)];
}

GltfAccessor accessor(Bytes& bytes) {
  GltfAccessor result{bytes.index(),
                      bytes.number(),
                      bytes.number(),
                      component_type(bytes),
                      3,
                      (bytes.take<std::uint8_t>() & 1) != 0,
                      {}};
  const auto shape = bytes.take<std::uint8_t>();
  result.components = shape % 4 == 0 ? 1 : shape % 4 == 1 ? bytes.index() : 3;
  if (shape >= 128)
    result.sparse = GltfSparse{bytes.number(),        bytes.index(), bytes.number(),
                               component_type(bytes), bytes.index(), bytes.number()};
  return result;
}

GltfNode node(Bytes& bytes) {
  GltfNode result;
  result.mesh = bytes.index();
  for (std::size_t i = bytes.few(); i > 0; --i) result.children.push_back(bytes.index());
  for (auto& row : result.local) row[3] = bytes.take<std::int8_t>();
  return result;
}

GltfMesh mesh(Bytes& bytes) {
  GltfMesh result;
  for (std::size_t i = bytes.few(); i > 0; --i)
    result.primitives.push_back({bytes.take<std::int8_t>() % 9, bytes.index(), bytes.index()});
  return result;
}

GltfModel model(Bytes bytes) {
  GltfModel result;
  for (std::size_t i = bytes.few(); i > 0; --i) result.nodes.push_back(node(bytes));
  for (std::size_t i = bytes.few(); i > 0; --i) result.meshes.push_back(mesh(bytes));
  for (std::size_t i = bytes.few(); i > 0; --i) result.accessors.push_back(accessor(bytes));
  for (std::size_t i = bytes.few(); i > 0; --i)
    result.views.push_back({bytes.index(), bytes.number(), bytes.number(), bytes.number()});
  for (std::size_t i = bytes.few(); i > 0; --i) result.roots.push_back(bytes.index());
  result.buffers = {bytes.rest(), {1, 2, 3, 4}};
  return result;
}

void stop_at(const std::string& broken) {
  if (broken.empty()) return;
  std::fprintf(stderr, "%s\n", broken.c_str());
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::uint64_t kMostBytes = 1 << 20;
  stop_at(broken_invariant(flatten_gltf(model({data, size}), kMostBytes), kMostBytes));
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const GltfContainer container = open_gltf_container(bytes);
  ReadResult scanned = read_failure(scan_gltf_json(container.json).error);
  if (scanned.error.empty()) scanned.ok = true;
  stop_at(broken_invariant(scanned, size));
  return 0;
}

}  // namespace tandem::build
