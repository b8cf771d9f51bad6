#include "levels/nearest_triangle.h"

#include "kernels/geometry/triangle_distance.h"

namespace tandem::levels {
namespace {

/// Squares of p's distances from the four boxes; infinite for imaginary nodes. What is computed of an axis is
/// off by less than 2^-51 of the largest magnitude of a coordinate.
void square_distances(const Block& block, const Point& p, double (&square)[kNodesPerBlock]) {
  for (int node = 0; node < kNodesPerBlock; ++node) square[node] = 0;
  for (int k = 0; k < 3; ++k) {
    for (int node = 0; node < kNodesPerBlock; ++node) {
      const double beyond =
          std::fabs(p.x[k] - double{block.centre[k][node]}) - double{block.half_extent[k][node]};
      const double gap = beyond > 0 ? beyond : 0;
      square[node] += gap * gap;
    }
  }
}

/// Calls visit(triangle) for the triangles of all leaves whose boxes are nearer than the root of reach(),
/// which visit may lower: near ones first. Calls enter() before it looks into a block.
template <class Visit, class Enter, class Reach>
void walk_near(const LevelView& level, const Point& p, const Visit& visit, const Enter& enter,
               const Reach& reach) {
  struct Entry {
    double square;
    std::uint32_t block;
  };
  // A block leaves at most three of its four children behind, on each of at most kMaxDepth levels.
  Entry stack[3 * kMaxDepth + 1];
  int size = 0;
  stack[size++] = {0, 0};
  while (size > 0) {
    const Entry entry = stack[--size];
    if (!(entry.square < reach())) continue;
    enter();
    const Block& block = level.blocks[entry.block];
    double square[kNodesPerBlock];
    square_distances(block, p, square);
    if (block.is_leaf_block()) {
      for (int node = 0; node < kNodesPerBlock; ++node) {
        if (square[node] < reach() && block.kind[node] == NodeKind::leaf) visit(block.index[node]);
      }
      continue;
    }
    const int begin = size;
    for (int node = 0; node < kNodesPerBlock; ++node) {
      if (!(square[node] < reach()) || block.kind[node] != NodeKind::internal) continue;
      int place = size++;
      for (; place > begin && stack[place - 1].square < square[node]; --place)
        stack[place] = stack[place - 1];
      stack[place] = {square[node], block.index[node]};
    }
  }
}

}  // namespace

NearestTriangle nearest_triangle(const LevelView& level, const Point& p, std::uint32_t hint,
                                 const NearEnough& enough) {
  NearestTriangle nearest = {square_distance(p, level.triangles[hint]), hint};
  const auto visit = [&](std::uint32_t triangle) {
    const double square = square_distance(p, level.triangles[triangle]);
    if (square < nearest.square) nearest.square = square, nearest.triangle = triangle;
  };
  const auto enter = [&] { nearest.certain = ++nearest.looks < enough.most_looks; };
  const auto reach = [&] { return nearest.certain && nearest.square > enough.square ? nearest.square : 0.0; };
  walk_near(level, p, visit, enter, reach);
  return nearest;
}

double proved_distance(const LevelView& level, const Point& p, std::uint32_t hint) {
  double largest = 0;
  for (int k = 0; k < 3; ++k) largest = std::max(largest, std::fabs(p.x[k]));
  const TreeExtent extent = extent_of(level.blocks[0]);
  for (int k = 0; k < 3; ++k) largest = std::max(largest, extent.reach[k]);
  double least = INFINITY;
  const auto visit = [&](std::uint32_t triangle) {
    TrianglePair pair;
    for (int i = 0; i < 3; ++i) {
      const Point corner = corner_of(level.triangles[triangle], i);
      for (int k = 0; k < 3; ++k) {
        pair.a[i][k] = p.x[k];
        pair.b[i][k] = corner.x[k];
      }
    }
    Point nearest;
    square_distance(p, level.triangles[triangle], nearest);
    const distance::LocalPair local = distance::local_pair(pair);
    const double bound = local.in_range() ? distance::distance_along(local, minus(p, nearest)) : 0;
    least = std::min(least, bound);
  };
  visit(hint);
  // Boxes are farther away than the root of what is computed less sqrt(3) 2^-51 of the largest coordinate.
  const auto reach = [&] {
    const double root = least + 0x1p-49 * largest;
    return root * root * (1 + 0x1p-49);
  };
  walk_near(
      level, p, visit, [] {}, reach);
  return least;
}

}  // namespace tandem::levels
