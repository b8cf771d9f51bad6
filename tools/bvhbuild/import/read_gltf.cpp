#include <map>
#include <memory>
#include <string_view>
#include <utility>

#include "common/printable.h"
#include "gltf_accessor.h"
#include "gltf_scene.h"
#include "mesh_assembly.h"
#include "readers.h"

namespace tandem::build {
namespace {

constexpr std::uint64_t kMostCorners = kNoVertex - 1;
constexpr int kMostRemarksOfAKind = 4;

/// The counts that a mesh adds to the result each time that a node shows it.
struct Size {
  std::uint64_t points = 0;
  std::uint64_t triangles = 0;   ///< at most
  std::uint64_t primitives = 0;  ///< which take time even where they add nothing
};

std::uint64_t triangles_of(int mode, std::uint64_t vertices) {
  if (mode == kTriangles) return vertices / 3;
  return vertices < 3 ? 0 : vertices - 2;
}

class SceneReader {
 public:
  SceneReader(const GltfModel& model, const ReadLimits& limits, bool is_posed_later)
      : model_(model),
        limits_(limits),
        out_("tandem glTF", kMostNameBytes),
        is_posed_later_(is_posed_later) {}

  /// Measures before anything is stored: a small file can show a mesh a million times.
  ReadResult read() {
    for (const std::string& remark : model_.remarks) out_.remark(remark);
    walk_scene(model_, [this](std::size_t node, const GltfPlace&) { measure_node(node); });
    out_.reserve_points(total_.points);
    out_.reserve_faces(total_.triangles, 3 * total_.triangles);
    walk_scene(model_, [this](std::size_t node, const GltfPlace& place) { add_node(node, place); });
    return out_.finish();
  }

 private:
  static constexpr std::size_t kMostNameBytes = std::size_t{64} << 20;

  void measure_node(std::size_t node_index) {
    const GltfNode& node = model_.nodes[node_index];
    if (node.mesh == -1) return;
    const auto index = static_cast<std::size_t>(node.mesh);
    if (node.mesh < 0 || index >= model_.meshes.size())
      throw GltfError(described("nodes", node_index, node.name) + " names " + numbered("meshes", index) +
                      " of " + std::to_string(model_.meshes.size()));
    const auto [known, is_new] = sizes_.try_emplace(index);
    if (is_new) measure_mesh(index, known->second);
    total_.points += known->second.points;
    total_.triangles += known->second.triangles;
    total_.primitives += known->second.primitives;
    remark_pose(node, described("nodes", node_index, node.name));
    check_total();
  }

  /// A file that repeats nothing holds a byte at least for each of these: three for a vertex, one for the
  /// index that ends a triangle, or a vertex of its own where there are no indices, and dozens for a
  /// primitive.
  void check_total() const {
    const std::uint64_t parts = total_.points + total_.triangles + total_.primitives;
    if (parts > model_.bytes_held && parts - model_.bytes_held > limits_.expansion)
      throw GltfError("instances of meshes, or counts without data, make more than " +
                      std::to_string(limits_.expansion) + " vertices and faces beyond what its " +
                      std::to_string(model_.bytes_held) + " bytes can hold (--expansion-limit)");
    if (total_.points > kMostCorners || total_.triangles > kMostCorners / 3)
      throw GltfError(
          "the scene has more than 4294967294 vertices or corners, counting each instance of a mesh");
    const std::uint64_t bytes = total_.points * sizeof(Point) + total_.triangles * 4 * sizeof(std::uint32_t);
    if (bytes > limits_.memory_bytes)
      throw GltfError("its triangles, counting each instance of a mesh, take " + std::to_string(bytes >> 20) +
                      " MiB, more than the memory limit (--memory-limit)");
  }

  void measure_mesh(std::size_t index, Size& size) {
    std::map<int, std::uint64_t> points;
    size.primitives = model_.meshes[index].primitives.size();
    each_primitive(model_.meshes[index], index, [&](const GltfPrimitive& primitive, const std::string& name) {
      measure_primitive(primitive, name, points, size);
    });
  }

  /// `points` has the accessors that earlier primitives of the mesh took their vertices from.
  void measure_primitive(const GltfPrimitive& primitive, const std::string& name,
                         std::map<int, std::uint64_t>& points, Size& size) {
    if (primitive.mode < 0 || primitive.mode > kTriangleFan)
      throw GltfError("mode " + std::to_string(primitive.mode) + " is none of glTF");
    if (primitive.mode == kPoints) out_.leave_out_points();
    if (primitive.mode > kPoints && primitive.mode < kTriangles) out_.leave_out_lines();
    if (!has_triangles(primitive)) return;
    if (primitive.positions == -1) {
      if (remarks_++ < kMostRemarksOfAKind) out_.remark(name + " has no POSITION and is passed over");
      return;
    }
    check_positions(model_, primitive.positions);
    if (primitive.indices != -1) check_indices(model_, primitive.indices);
    const std::uint64_t count = model_.accessors[primitive.positions].count;
    const std::uint64_t vertices =
        primitive.indices == -1 ? count : model_.accessors[primitive.indices].count;
    // Each count alone is bounded here, so that no sum of theirs overflows before check_total() sees it.
    if (count > kMostCorners || vertices > kMostCorners)
      throw GltfError("it has more than 4294967294 vertices");
    if (points.emplace(primitive.positions, count).second) size.points += count;
    size.triangles += triangles_of(primitive.mode, vertices);
    remark_left_over(primitive, name, vertices);
  }

  void remark_left_over(const GltfPrimitive& primitive, const std::string& name, std::uint64_t vertices) {
    const std::uint64_t rest = primitive.mode == kTriangles ? vertices % 3 : (vertices < 3 ? vertices : 0);
    if (rest == 0 || remarks_++ >= kMostRemarksOfAKind) return;
    out_.remark(name + ": the last " + std::to_string(rest) + " of " + std::to_string(vertices) +
                (primitive.indices == -1 ? " vertices" : " indices") + " make no triangle");
  }

  void remark_pose(const GltfNode& node, const std::string& name) {
    const bool is_morphed = node.has_morph_weights || model_.meshes[node.mesh].has_morph_weights;
    const bool stays_unposed = !is_posed_later_ && (node.has_skin || is_morphed);
    if (pose_remarked_ || !(stays_unposed || node.is_instanced)) return;
    pose_remarked_ = true;
    if (node.is_instanced)
      out_.remark(name + " repeats its mesh by EXT_mesh_gpu_instancing; it is read once");
    else
      out_.remark(name + " has a " + (node.has_skin ? "skin" : "morphed mesh") + "; its mesh is read " +
                  (node.has_skin ? "unposed" : "unmorphed"));
  }

  void add_node(std::size_t node_index, const GltfPlace& place) {
    if (model_.nodes[node_index].mesh == -1) return;
    const auto index = static_cast<std::size_t>(model_.nodes[node_index].mesh);
    const GltfMesh& mesh = model_.meshes[index];
    out_.begin_part(name_or_number(mesh.name, "meshes", index), *place.path);
    std::map<int, std::uint64_t> first_points;
    each_primitive(mesh, index, [&](const GltfPrimitive& primitive, const std::string& name) {
      if (has_triangles(primitive) && primitive.positions != -1)
        add_primitive(primitive, name, place.world, first_points);
    });
  }

  /// Primitives of a mesh often share their vertices, and these are stored once.
  void add_primitive(const GltfPrimitive& primitive, const std::string& name, const Affine& world,
                     std::map<int, std::uint64_t>& first_points) {
    const auto [shared, is_new] = first_points.try_emplace(primitive.positions, out_.point_count());
    if (is_new) {
      read_positions(model_, primitive.positions, points_);
      for (const Point& point : points_) out_.add_point(transformed(world, point));
    }
    if (primitive.indices != -1) read_indices(model_, primitive.indices, indices_);
    add_faces(primitive, name, shared->second);
  }

  /// An index that names no vertex becomes a negative number of its own, so that strips tell two of them
  /// apart.
  std::int64_t corner(std::uint32_t index, const std::string& name, std::uint64_t first,
                      std::uint64_t vertices) {
    if (index < vertices && index != kNoVertex) return static_cast<std::int64_t>(first + index);
    if (out_.wants_index_remark()) {
      if (index == kNoVertex)
        out_.remark_index(name + ": an index is the largest of its type, which names no vertex");
      else
        out_.remark_index(name + ": index", index, vertices);
    }
    return -1 - std::int64_t{index};
  }

  void add_faces(const GltfPrimitive& primitive, const std::string& name, std::uint64_t first) {
    const std::uint64_t vertices = model_.accessors[primitive.positions].count;
    const bool indexed = primitive.indices != -1;
    const std::uint64_t count = indexed ? indices_.size() : vertices;
    const auto at = [&](std::uint64_t i) {
      return indexed ? corner(indices_[i], name, first, vertices) : static_cast<std::int64_t>(first + i);
    };
    if (primitive.mode == kTriangleStrip) {
      TriangleStrip strip(out_);
      if (count >= 3)
        for (std::uint64_t i = 0; i < count; ++i) strip.add(at(i));
      return;
    }
    for (std::uint64_t t = 0; t < triangles_of(primitive.mode, count); ++t) {
      const bool is_fan = primitive.mode == kTriangleFan;
      for (std::uint64_t k = 0; k < 3; ++k)
        out_.add_corner(at(is_fan ? (k == 2 ? 0 : t + k + 1) : 3 * t + k));
      out_.end_face();
    }
  }

  const GltfModel& model_;
  const ReadLimits& limits_;
  MeshAssembly out_;
  std::map<std::size_t, Size> sizes_;  ///< of the meshes that nodes show
  Size total_;
  int remarks_ = 0;
  bool is_posed_later_;
  bool pose_remarked_ = false;
  std::vector<Point> points_;           ///< of the primitive at hand
  std::vector<std::uint32_t> indices_;  ///< of the primitive at hand
};

}  // namespace

ReadResult read_gltf(std::string_view bytes, const std::filesystem::path& folder, const ReadLimits& limits,
                     bool is_posed_later) {
  try {
    const GltfModel model = parse_gltf(bytes, folder, limits).model;
    ReadResult result = SceneReader(model, limits, is_posed_later).read();
    result.files = model.files;
    return result;
  } catch (const GltfError& error) {
    return read_failure(error.what());
  }
}

}  // namespace tandem::build
