#include "kernels/common/component_labels.h"

#include <algorithm>

#include "kernels/geometry/inside_test.h"
#include "tandem/kernels/detail/buffer.h"

namespace tandem::containment {
namespace {

// Calls use(lower vertex, upper vertex, triangle) with the sides of all edges.
template <typename Use>
void for_each_side(const LevelView& level, const Use& use) {
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    const std::uint32_t* v = level.topology[t].vertex;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t p = v[k], q = v[(k + 1) % 3];
      if (p != q) use(std::min(p, q), std::max(p, q), t);
    }
  }
}

// Triangles that belong together: each names a lower one, and the lowest itself.
std::uint32_t lowest(std::uint32_t* below, std::uint32_t t) {
  while (below[t] != t) t = below[t] = below[below[t]];
  return t;
}

void join(std::uint32_t* below, std::uint32_t s, std::uint32_t t) {
  s = lowest(below, s), t = lowest(below, t);
  below[std::max(s, t)] = std::min(s, t);
}

struct Side {
  std::uint32_t upper, triangle;
};

}  // namespace

bool label_triangles(const LevelView& level, std::uint32_t* labels) {
  const std::size_t vertices = level.vertex_count;
  Buffer<std::uint32_t> end;  // of the sides of each lower vertex
  Buffer<Side> sides;
  Buffer<Side> last;  // of each upper vertex: the lower vertex and triangle of the last side to it
  if (!end.resize(vertices + 1) || !last.resize(vertices)) return false;
  std::fill_n(end.data(), vertices + 1, 0u);
  std::fill_n(last.data(), vertices, Side{kNoIndex, 0});
  for_each_side(level, [&](std::uint32_t lower, std::uint32_t, std::uint32_t) { ++end[lower + 1]; });
  for (std::size_t v = 0; v < vertices; ++v) end[v + 1] += end[v];
  if (!sides.resize(end[vertices])) return false;
  for_each_side(level, [&](std::uint32_t lower, std::uint32_t upper, std::uint32_t t) {
    sides[end[lower]++] = {upper, t};
  });

  for (std::uint32_t t = 0; t < level.triangle_count; ++t) labels[t] = t;
  std::uint32_t at = 0;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    for (; at < end[v]; ++at) {
      Side& before = last[sides[at].upper];
      if (before.upper == v) join(labels, before.triangle, sides[at].triangle);
      before = {v, sides[at].triangle};
    }
  }

  for (std::uint32_t t = 0; t < level.triangle_count; ++t)
    labels[t] = labels[labels[t]];  // lower ones are done
  for (std::uint32_t c = 0; c < level.component_count; ++c) {
    if (!is_closed(level.components[c])) labels[level.components[c].first_triangle] |= kOfOpenComponent;
  }
  for (std::uint32_t t = 0; t < level.triangle_count; ++t)
    labels[t] |= labels[labels[t] & ~kOfOpenComponent] & kOfOpenComponent;
  return true;
}

}  // namespace tandem::containment
