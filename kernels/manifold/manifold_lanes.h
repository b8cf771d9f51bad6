#pragma once
#include "kernels/common/lane_variant.h"
#include "kernels/common/lanes.h"
#include "kernels/manifold/contact_curves.h"
#include "kernels/manifold/patch.h"

// These functions make manifolds faster on a machine that has the instructions. All ways give the same bytes.
namespace tandem {

struct ManifoldLanes {
  static constexpr int kMostLines = 16;

  /// Words of the table that pieces are joined by: so many for each contact, and some more.
  static constexpr std::uint32_t kTableWords = 36, kMoreTableWords = 4;

  /// The function reads one float beyond the pieces' normals, of what comes later.
  manifold::PieceBounds (*make_pieces)(const manifold::BodyPair& bodies, const manifold::PieceMemory& memory,
                                       const Contact* contacts, std::uint32_t count);

  /// Adds what two triangles have in common, if that is something. It is not inlined, so that no inline
  /// function that is compiled for one machine is linked into code for another.
  static void add_piece(const manifold::PieceMemory& memory, const Contact& contact,
                        const manifold::WorldTriangle& a, const manifold::WorldTriangle& b, double tolerance,
                        manifold::PieceBounds& bounds);
  static bool connect_by_ends(const manifold::BodyPair& bodies, const manifold::PieceMemory& memory,
                              std::uint32_t pieces);
  static void connect_by_corners(const manifold::BodyPair& bodies, const manifold::PieceMemory& memory,
                                 std::uint32_t pieces);

  // Each does what the function of its name in the headers does, with pieces order[begin] to order[end - 1].
  void (*sum_pieces)(const manifold::PieceMemory& memory, std::uint32_t begin, std::uint32_t end,
                     const manifold::Vector3& origin, double one_by_unit, manifold::CurveSums& out);
  manifold::LeastPiece (*least_unmarked)(const manifold::PieceMemory& memory, std::uint32_t begin,
                                         std::uint32_t end, int side, const manifold::FloatVector& known);
  void (*find_face_along)(const manifold::PieceMemory& memory, std::uint32_t begin, std::uint32_t end,
                          int side, const manifold::FloatVector& up, manifold::FaceAlong& best);
  void (*sum_length_on_face)(const manifold::PieceMemory& memory, std::uint32_t begin, std::uint32_t end,
                             const manifold::FloatVector& face, double one_by_unit, manifold::ExactSum& sum);
  void (*spread_along)(const manifold::BodyPair& bodies, const manifold::PieceMemory& memory,
                       std::uint32_t begin, std::uint32_t end, const manifold::Vector3& origin,
                       const manifold::Vector3* directions, int count, manifold::Spread* spread);
  /// Gathers the rim where there are no polygons. ends: those of each piece, 1 or 2. Result: how many
  /// candidates there are.
  std::uint32_t (*gather_rim)(const manifold::PieceMemory& memory, std::uint32_t begin, std::uint32_t end,
                              const manifold::PatchFrame& frame, double one_by_unit, int ends,
                              manifold::Candidate* candidates, manifold::RimMoments& moments);
  void (*furthest)(const manifold::PieceMemory& memory, const manifold::Candidate* candidates,
                   std::uint32_t count, const manifold::RimValue* values, float unit, int wanted,
                   manifold::Furthest* best);
  /// The next candidate from `i` on whose distance's square from a point is less, or `count`.
  std::uint32_t (*next_near)(const manifold::Candidate* candidates, std::uint32_t i, std::uint32_t count,
                             const manifold::FloatPoint& at, float square);

  /// Answers questions about one body, at most kMostLines.
  void (*answer_lines)(const manifold::Body& body, const manifold::PatchFrame& frame,
                       manifold::LineQuestion* const* lines, int count);
};

/// The named way, or null where this machine or this build lacks it; there is no scalar one.
inline const ManifoldLanes* manifold_lanes(BlockPairVariant variant) {
  return way_of<const ManifoldLanes*>(variant, nullptr, &LaneVariant::manifold_lanes);
}

/// Returns the functions for the widest vectors that this machine has. Condition: TANDEM_HAVE_LANES.
inline const ManifoldLanes& best_manifold_lanes() {
  static const ManifoldLanes& best = *best_way(manifold_lanes);
  return best;
}

}  // namespace tandem
