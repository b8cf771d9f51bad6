#pragma once
#include <cstdint>
#include <vector>

#include "kernels/query_scenes.h"

/// Sheets and other surfaces that meet themselves, and which contacts are left when neighbours are left out.
namespace tandem::test {

/// A mesh that is asked about contacts with itself.
struct Surface {
  const char* name;
  Mesh mesh;
};

inline std::ostream& operator<<(std::ostream& out, const Surface& surface) {
  return out << surface.name;
}

/// Open sheets, flat and in folds, closed meshes, components that touch, non-manifold edges, flat triangles,
/// fans about one vertex, and soups.
std::vector<Surface> surfaces_that_meet_themselves();

/// A sheet of columns x rows squares, of two triangles each, that lies in so many folds; gap: between the
/// layers, in sides of a square.
Mesh folded_sheet(std::uint32_t columns, std::uint32_t rows, std::uint32_t folds, float gap);

/// Says which triangles of a mesh are neighbours, by a search from each vertex over the edges. Vertices are
/// the different positions of corners.
class NeighbourReference {
 public:
  explicit NeighbourReference(const Mesh& mesh);

  /// The least n so that the triangles are neighbours within n rings; a large number where no path joins
  /// them.
  std::uint32_t rings_between(std::uint32_t x, std::uint32_t y) const;

 private:
  std::vector<std::array<std::uint32_t, 3>> vertices_;  // of each triangle
  std::vector<std::vector<std::uint32_t>> edges_;       // the least number of them between two vertices
};

/// Returns the contacts of a scene of one asset, less those of an instance with itself that are neighbours.
FaceContacts without_neighbours(const FaceContacts& contacts, const NeighbourReference& reference,
                                std::uint32_t rings);

}  // namespace tandem::test
