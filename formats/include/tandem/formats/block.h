#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>

#include "tandem/formats/platform.h"

namespace tandem {

/// The kind of a node. A block holds leaves and imaginary nodes only (leaf block), or internal and imaginary
/// nodes only (internal block); a mix is called a partial leaf block and does not exist.
enum class NodeKind : std::uint32_t {
  internal = 0,   ///< index is the child block
  leaf = 1,       ///< index is the one triangle
  imaginary = 2,  ///< padding: index is kNoIndex, the box is empty
};

inline constexpr int kNodesPerBlock = 4;
inline constexpr std::uint32_t kNoIndex = 0xFFFFFFFFu;

/// The deepest tree that a file may hold, in blocks from the root block (depth 1) to a leaf block.
/// Traversals size their stacks by it. The builder's trees have depths of 6 to 30.
inline constexpr std::uint32_t kMaxDepth = 64;

/// Four nodes, one cache line, component by component: SIMD loads four lanes as they are, and a GPU thread
/// loads eight float4.
///
///     byte 0    16   32   48   64   80   96   112   128
///          | cx | cy | cz | hx | hy | hz | index | kind |     each four lanes: node 0, 1, 2, 3
///
/// Node i has the box [centre - half_extent, centre + half_extent], in real arithmetic, relative to the
/// asset's origin. Imaginary nodes come last.
///
/// The blocks of a tree lie depth first: the first child of block b is block b + 1, each further child begins
/// where the subtree of the one before it ends. So the blocks of a subtree are consecutive, and so are the
/// triangles below a block or a node.
struct alignas(128) Block {
  float centre[3][kNodesPerBlock];
  float half_extent[3][kNodesPerBlock];
  std::uint32_t index[kNodesPerBlock];
  NodeKind kind[kNodesPerBlock];

  TANDEM_HD bool is_leaf_block() const { return kind[0] == NodeKind::leaf; }
};
static_assert(sizeof(Block) == 128 && alignof(Block) == 128);
static_assert(offsetof(Block, half_extent) == 48 && offsetof(Block, index) == 96 &&
              offsetof(Block, kind) == 112);

/// The box of an imaginary node: centre 0, half-extent -infinity, that is the empty interval [+inf, -inf] on
/// every axis.
///
/// Why every box test rejects it. A box test of Tandem reports an overlap only if an ordered comparison
///     |d| <= r,   r = sum of |coefficient| * half_extent over both boxes (+ rounding slack)
/// holds on every axis that it looks at, and each axis it looks at takes in at least one half-extent of each
/// box. Let one box be imaginary. Its products are |coefficient| * -inf: -inf where the coefficient is not 0,
/// and NaN where it is 0 or NaN; never +inf, never finite. Adding anything to -inf gives -inf, or NaN when
/// that is +inf or NaN; adding anything to NaN gives NaN. So r is -inf or NaN, whatever the other box, the
/// rotation and the translation are, and whatever the order of summation, fused or not. |d| is at least 0 or
/// NaN, and no ordered comparison of such a |d| with -inf or with NaN is true: rejected, on the first axis.
/// Slack derived from the half-extents (|h| times an epsilon) is +inf or NaN: r is NaN, rejected too.
/// Interval tests (lo_a <= hi_b && lo_b <= hi_a) meet lo = +inf and hi = -inf: both hold on an axis only if
/// the other interval is [-inf, +inf], and c - h and c + h cannot both overflow for finite c and h. A test
/// must therefore never be written as "separated if |d| > r, else overlapping": NaN would pass it. The same
/// values make an imaginary box the neutral element of the union of boxes by min and max.
inline constexpr float kImaginaryCentre = 0.0f;
inline constexpr float kImaginaryHalfExtent = -std::numeric_limits<float>::infinity();

/// The fewest imaginary nodes that a tree of `triangles` leaves can have without partial leaf blocks. With L
/// = ceil(N / 4) leaf blocks and I = ceil((L - 1) / 3) internal ones, every block but the root being the
/// child of exactly one node, 4 (L + I) = N + (L + I - 1) + imaginary. Exact for every N >= 1.
constexpr std::uint32_t minimal_imaginary_nodes(std::uint64_t triangles) {
  const std::uint64_t leaf_blocks = (triangles + 3) / 4;
  return static_cast<std::uint32_t>((4 - triangles % 4) % 4 + (3 - (leaf_blocks + 2) % 3) % 3);
}
static_assert(minimal_imaginary_nodes(16) == 0 && minimal_imaginary_nodes(1) == 3 &&
              minimal_imaginary_nodes(5) == 5 && minimal_imaginary_nodes(4) == 0);

}  // namespace tandem
