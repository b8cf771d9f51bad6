#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "import.h"

namespace tandem::build {

/// Rows of an affine map in float64: x' = a[0] x + a[1] y + a[2] z + a[3].
using Affine = std::array<std::array<double, 4>, 3>;

inline constexpr Affine kIdentity{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

/// First `inner`, then `outer`. An identity stays out of the arithmetic.
inline Affine combined(const Affine& outer, const Affine& inner) {
  if (outer == kIdentity) return inner;
  if (inner == kIdentity) return outer;
  Affine result{};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) {
      double sum = column == 3 ? outer[row][3] : 0;
      for (int k = 0; k < 3; ++k) sum += outer[row][k] * inner[k][column];
      result[row][column] = sum;
    }
  return result;
}

/// An identity stays out of the arithmetic, so that a coordinate that is not finite spoils no other one.
inline Point transformed(const Affine& t, const Point& p) {
  if (t == kIdentity) return p;
  Point q;
  for (int row = 0; row < 3; ++row)
    q[row] = t[row][0] * p[0] + t[row][1] * p[1] + t[row][2] * p[2] + t[row][3];
  return q;
}

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
  /// Returns whether one more remark about a vertex index is welcome: the first few show what is wrong, a
  /// million would not.
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

/// Turns the indices of triangle strips into the triangles they stand for.
///
/// Index i of a strip makes the triangle (i-2, i-1, i); every other one, counted from the strip's start, is
/// turned over, so that all face the same way. A triangle that names a vertex twice only leads the strip
/// elsewhere: it is no face.
class TriangleStrip {
 public:
  explicit TriangleStrip(MeshAssembly& mesh) : mesh_(mesh) {}

  void restart() { length_ = 0; }

  void add(std::int64_t index) {
    if (length_ >= 2) add_triangle(index);
    before_last_ = std::exchange(last_, index);
    ++length_;
  }

 private:
  void add_triangle(std::int64_t index) {
    if (index == last_ || index == before_last_ || last_ == before_last_) return mesh_.leave_out_strip_turn();
    const bool turned = length_ % 2 == 1;
    mesh_.add_corner(turned ? last_ : before_last_);
    mesh_.add_corner(turned ? before_last_ : last_);
    mesh_.add_corner(index);
    mesh_.end_face();
  }

  MeshAssembly& mesh_;
  std::uint64_t length_ = 0;
  std::int64_t before_last_ = 0, last_ = 0;
};

}  // namespace tandem::build
