#include "laid_level.h"

#include <algorithm>

namespace tandem::build {

LaidLevel::LaidLevel(const Geometry& geometry, const Tree& tree) : tree_(tree) {
  std::vector<std::uint32_t> number(geometry.points.size(), kNoIndex);
  triangles_.reserve(tree.order.size());
  topology_.reserve(tree.order.size());
  for (const std::uint32_t source : tree.order) {
    Triangle& triangle = triangles_.emplace_back(Triangle{});
    TriangleTopology& topology = topology_.emplace_back(TriangleTopology{});
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t point = geometry.triangles[source][k];
      std::copy_n(geometry.points[point].data(), 3, triangle.corner[k].position);
      if (number[point] == kNoIndex) number[point] = vertex_count_++;
      topology.vertex[k] = number[point];
    }
  }
}

LevelView LaidLevel::view() const {
  LevelView view;
  view.blocks = tree_.blocks.data();
  view.triangles = triangles_.data();
  view.topology = topology_.data();
  view.block_count = static_cast<std::uint32_t>(tree_.blocks.size());
  view.triangle_count = static_cast<std::uint32_t>(triangles_.size());
  view.leaf_block_count = tree_.leaf_block_count;
  view.depth = tree_.depth;
  view.vertex_count = vertex_count_;
  return view;
}

}  // namespace tandem::build
