#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "bvhbuild/meshing/polygon_mesh.h"
#include "read_result.h"

namespace tandem::build {

/// A polygon mesh that a reader puts together in the file's order.
class MeshAssembly {
 public:
  /// `reader` signs the mesh. `file_bytes` bounds what the names of parts may take: a file can pair one long
  /// object name with a hundred thousand groups, and memory must stay a small multiple of the file.
  MeshAssembly(std::string reader, std::size_t file_bytes);

  std::size_t point_count() const { return mesh_.points.size(); }
  std::size_t face_count() const { return mesh_.face_count(); }
  void reserve_points(std::size_t count) { mesh_.points.reserve(count); }
  void reserve_faces(std::size_t faces, std::size_t corners);

  void add_point(const Point& point) { mesh_.points.push_back(point); }
  /// Adds a corner to the face at hand. An index that no file can mean becomes kNoVertex.
  void add_corner(std::int64_t index) {
    const bool is_representable = static_cast<std::uint64_t>(index) < kNoVertex;
    mesh_.corners.push_back(is_representable ? static_cast<std::uint32_t>(index) : kNoVertex);
  }
  /// Ends the face at hand, however many corners it has.
  void end_face() { mesh_.face_begin.push_back(static_cast<std::uint32_t>(mesh_.corners.size())); }

  /// The faces that follow belong to a part of this name and path; the last part goes on where it has the
  /// same name and path.
  void begin_part(std::string_view name, std::string_view node_path);

  /// Notes what the file holds beside faces, for when it has no face at all.
  void leave_out_points() { mesh_.left_out.points = true; }
  void leave_out_lines() { mesh_.left_out.lines = true; }
  void leave_out_strip_turn() { mesh_.left_out.strip_turns = true; }

  void remark(std::string text) { mesh_.remarks.push_back(std::move(text)); }
  /// Whether one more remark about a vertex index is welcome: the first few show what is wrong, a million
  /// would not.
  bool wants_index_remark() const { return index_remarks_ < kMostIndexRemarks; }
  void remark_index(std::string_view place, std::int64_t index, std::size_t vertices);
  void remark_index(std::string text);

  /// Hands over the mesh; fails when it has more vertices or corners than its 32-bit indices can name.
  ReadResult finish();

 private:
  static constexpr int kMostIndexRemarks = 4;

  void close_part();

  PolygonMesh mesh_;
  std::size_t name_bytes_left_;
  bool names_left_out_ = false;
  int index_remarks_ = 0;
};

}  // namespace tandem::build
