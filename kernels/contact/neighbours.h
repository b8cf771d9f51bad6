#pragma once
#include <cstdint>

#include "kernels/common/traversal.h"
#include "tandem/formats/topology.h"

/// Which triangles of a mesh are neighbours, so that contacts of an instance with itself leave them out. Two
/// triangles are neighbours within n rings where a path of at most n - 1 edges leads from a vertex of one to
/// a vertex of the other; within one ring they share a vertex.
namespace tandem {

/// The neighbours of the triangles of one level, for one number of rings. Owns nothing; its pointers are of
/// the CPU or of the GPU.
struct Neighbourhood {
  const TriangleTopology* topology = nullptr;  ///< null: nothing is left out
  /// Of each vertex, and of the end of the last one: where its entries in `higher` begin. Null: one ring.
  const std::uint32_t* first = nullptr;
  /// The vertices with higher numbers that a path of at most n - 1 edges leads to, ascending for each vertex.
  const std::uint32_t* higher = nullptr;
};

// Internal linkage: files that are compiled for different machines include this, see lanes.h.
namespace {

TANDEM_HD inline bool share_vertex(const TriangleTopology& x, const TriangleTopology& y) {
  bool shared = false;
  for (const std::uint32_t u : x.vertex) {
    for (const std::uint32_t v : y.vertex) shared |= u == v;
  }
  return shared;
}

/// Returns whether a path of at most n - 1 edges joins two different vertices. Condition: n > 1.
TANDEM_HD inline bool are_joined(const Neighbourhood& mesh, std::uint32_t u, std::uint32_t v) {
  const std::uint32_t low = u < v ? u : v, high = u < v ? v : u, end = mesh.first[low + 1];
  std::uint32_t from = mesh.first[low], to = end;
  while (from < to) {
    const std::uint32_t middle = from + (to - from) / 2;
    if (mesh.higher[middle] < high)
      from = middle + 1;
    else
      to = middle;
  }
  return from < end && mesh.higher[from] == high;
}

TANDEM_HD inline bool are_neighbours(const Neighbourhood& mesh, const TriangleTopology& x,
                                     const TriangleTopology& y) {
  if (share_vertex(x, y)) return true;
  if (mesh.first == nullptr) return false;
  for (const std::uint32_t u : x.vertex) {
    for (const std::uint32_t v : y.vertex) {
      if (are_joined(mesh, u, v)) return true;
    }
  }
  return false;
}

/// Returns the hits of two leaf blocks of one mesh, less those of neighbours. first_a, first_b: their first
/// triangles; bit 4 i + j of `hits` stands for triangle first_a + i and triangle first_b + j.
TANDEM_HD inline std::uint32_t drop_neighbours(const Neighbourhood& mesh, std::uint32_t first_a,
                                               std::uint32_t first_b, std::uint32_t hits) {
  if (mesh.topology == nullptr) return hits;
  std::uint32_t left = hits;
#ifdef __CUDA_ARCH__
#pragma unroll 1
#endif
  for (; hits != 0; hits &= hits - 1) {
    const auto bit = static_cast<std::uint32_t>(lowest_bit(hits));
    const TriangleTopology x = mesh.topology[first_a + bit / 4], y = mesh.topology[first_b + bit % 4];
    if (are_neighbours(mesh, x, y)) left &= ~(1u << bit);
  }
  return left;
}

}  // namespace
}  // namespace tandem
