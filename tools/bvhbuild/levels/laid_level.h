#pragma once
#include <span>
#include <vector>

#include "bvhbuild/tree/tree.h"
#include "tandem/formats/view.h"

namespace tandem::build {

/// A level as it lies in a file, as far as distances from it need it: blocks, corners and the numbers of
/// vertices. The tree must outlive it.
class LaidLevel {
 public:
  LaidLevel(const Geometry& geometry, const Tree& tree);
  LevelView view() const;

 private:
  const Tree& tree_;
  std::vector<Triangle> triangles_;
  std::vector<TriangleTopology> topology_;
  std::uint32_t vertex_count_ = 0;
};

}  // namespace tandem::build
