#include <cstring>

#include "kernels/manifold/manifold_lanes.h"

// One thread does this for CurveFinder with single pieces. Keys lie beside the references, so that nothing is
// computed again where two are compared.
namespace tandem {
namespace {

using manifold::Piece, manifold::PieceMemory, manifold::BodyPair;

class PieceJoiner {
 public:
  PieceJoiner(const PieceMemory& memory, std::uint32_t pieces, std::uint32_t slots)
      : curve_(memory.curve), table_(memory.table), slots_(slots) {
    for (std::uint32_t i = 0; i < pieces; ++i) curve_[i] = i;
    std::memset(table_, 0xFF, sizeof(Slot) * std::size_t{slots});
  }

  /// The piece that was there first under the same key, or `piece` itself.
  std::uint32_t insert(std::uint32_t u, std::uint32_t v, std::uint32_t w, std::uint32_t piece, bool& first) {
    std::uint32_t hash = u * 0x9E3779B1u + v * 0x85EBCA77u + w * 0xC2B2AE3Du;
    hash = (hash ^ hash >> 15) * 0x2C1B3C6Du;
    auto at = static_cast<std::uint32_t>(std::uint64_t{hash} * slots_ >> 32);
    for (;;) {
      std::uint32_t* const slot = table_ + 4 * std::size_t{at};
      if (slot[3] == kNoIndex) {
        slot[0] = u, slot[1] = v, slot[2] = w, slot[3] = piece;
        first = true;
        return piece;
      }
      if (slot[0] == u && slot[1] == v && slot[2] == w) {
        first = false;
        return slot[3];
      }
      if (++at == slots_) at = 0;
    }
  }

  /// Joins the set whose first piece is `first` with that of another piece. Result: the first of both.
  std::uint32_t join(std::uint32_t first, std::uint32_t piece) {
    const std::uint32_t other = first_of(piece);
    if (other == first) return first;
    const std::uint32_t of_both = other < first ? other : first;
    curve_[other < first ? first : other] = of_both;
    return of_both;
  }

 private:
  using Slot = std::uint32_t[4];

  std::uint32_t first_of(std::uint32_t piece) {
    while (curve_[piece] != piece) piece = curve_[piece] = curve_[curve_[piece]];
    return piece;
  }

  std::uint32_t* curve_;
  std::uint32_t* table_;
  std::uint32_t slots_;
};

/// The latest corners of b's triangles among pieces with one triangle of a. They are few, because contacts
/// are found block by block.
class LatestCorners {
 public:
  /// The piece that had this corner with the same triangle of a, or `piece`, which is noted then.
  std::uint32_t find_or_note(std::uint32_t triangle_a, std::uint32_t vertex, std::uint32_t piece) {
    if (triangle_a != triangle_a_) triangle_a_ = triangle_a, count_ = 0;
    const std::uint32_t known = count_ < kMost ? count_ : kMost;
    for (std::uint32_t i = 0; i < known; ++i) {
      if (vertex_[i] == vertex) return piece_[i];
    }
    const std::uint32_t at = count_++ % kMost;
    vertex_[at] = vertex, piece_[at] = piece;
    return piece;
  }

 private:
  static constexpr std::uint32_t kMost = 16;

  std::uint32_t vertex_[kMost], piece_[kMost], count_ = 0, triangle_a_ = kNoIndex;
};

}  // namespace

void ManifoldLanes::add_piece(const PieceMemory& memory, const Contact& contact,
                              const manifold::WorldTriangle& a, const manifold::WorldTriangle& b,
                              double tolerance, manifold::PieceBounds& bounds) {
  manifold::Meeting meeting;
  manifold::meet(a, b, tolerance, meeting);
  if (meeting.kind == manifold::MeetingKind::none) return;
  manifold::write_piece(memory, bounds.pieces++, contact, a.normal, b.normal, meeting);
  bounds.add(meeting);
}

bool ManifoldLanes::connect_by_ends(const BodyPair& bodies, const PieceMemory& memory, std::uint32_t pieces) {
  PieceJoiner joiner(memory, pieces, 3 * pieces);
  const TriangleTopology* const topology[2] = {bodies.a.shape->topology, bodies.b.shape->topology};
  std::int64_t alone = 0;
  bool many = false;
  for (std::uint32_t i = 0; i < pieces; ++i) {
    const Piece& piece = memory.pieces[i];
    std::uint32_t first_piece = i;
    for (int end = 0; end < 2; ++end) {
      const manifold::TriangleFeature f = piece.feature(end);
      const std::uint32_t side = f.of_b;
      const TriangleTopology& t = topology[side][piece.triangle[side]];
      const std::uint64_t edge = manifold::edge_key(t, f.number);
      many = many || has_many_triangles(t.flags, f.number);
      bool first;
      const std::uint32_t there =
          joiner.insert(static_cast<std::uint32_t>(edge >> 32), static_cast<std::uint32_t>(edge),
                        piece.triangle[1 - side] << 1 | side, i, first);
      if (!is_boundary(t.flags, f.number)) alone += first ? 1 : -1;
      if (!first) first_piece = joiner.join(first_piece, there);
    }
  }
  return alone == 0 && !many;
}

void ManifoldLanes::connect_by_corners(const BodyPair& bodies, const PieceMemory& memory,
                                       std::uint32_t pieces) {
  PieceJoiner joiner(memory, pieces, 9 * pieces + 1);
  LatestCorners latest;
  for (std::uint32_t i = 0; i < pieces; ++i) {
    const Piece& piece = memory.pieces[i];
    const std::uint32_t(&u)[3] = bodies.a.shape->topology[piece.triangle[0]].vertex;
    std::uint32_t first_piece = i;
    for (const std::uint32_t v : bodies.b.shape->topology[piece.triangle[1]].vertex) {
      const std::uint32_t known = latest.find_or_note(piece.triangle[0], v, i);
      if (known != i) {  // it has put all three corners of a with this one into the table
        first_piece = joiner.join(first_piece, known);
        continue;
      }
      for (const std::uint32_t corner : u) {
        bool first;
        const std::uint32_t there = joiner.insert(corner, v, 0, i, first);
        if (!first) first_piece = joiner.join(first_piece, there);
      }
    }
  }
}

}  // namespace tandem
