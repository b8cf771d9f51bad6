#pragma once
#include "lanes.h"
#include "tandem/kernels/detail/block_pair.h"
#include "tandem/kernels/detail/manifold/contact_curves.h"
#include "tandem/kernels/detail/manifold/surface_line.h"

// What makes manifolds faster on a machine that has the instructions. All ways give the same bytes.
namespace tandem {

struct ManifoldMeans {
  static constexpr int kMostLines = 16;

  /// Words of the table that pieces are joined by, for each contact, and as many once more.
  static constexpr std::uint32_t kTableWords = 36;

  manifold::PieceBounds (*make_pieces)(const manifold::BodyPair& bodies, const manifold::PieceMemory& memory,
                                       const Contact* contacts, std::uint32_t count);

  static bool connect_by_ends(const manifold::BodyPair& bodies, const manifold::PieceMemory& memory,
                              std::uint32_t pieces);
  static void connect_by_corners(const manifold::BodyPair& bodies, const manifold::PieceMemory& memory,
                                 std::uint32_t pieces);

  /// Answers questions about one body, at most kMostLines.
  void (*answer_lines)(const manifold::Body& body, const manifold::PatchFrame& frame,
                       manifold::LineQuestion* const* lines, int count);

  /// The vertex of a body that reaches furthest in a prism: the highest of a (side 0), the lowest of b (1).
  manifold::Extreme (*find_extreme)(const manifold::Body& body, const manifold::Prism& prism, int side);
};

/// The named way, or null where this machine or this build lacks it.
const ManifoldMeans* manifold_means(BlockPairVariant variant);

/// Of the widest vectors that this machine has. Condition: TANDEM_HAVE_LANES.
const ManifoldMeans& best_manifold_means();

// Each defined in a file of its own, which is compiled for machines that have the instructions.
extern const ManifoldMeans kManifoldMeansLanes4, kManifoldMeansAvx2, kManifoldMeansAvx512;

}  // namespace tandem
