#pragma once
#include <cstdint>
#include <utility>

#include "mesh_assembly.h"

namespace tandem::build {

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
