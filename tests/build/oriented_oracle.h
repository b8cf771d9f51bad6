#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "tandem/formats/view.h"

/// What the checker promises of oriented blocks, found out in another way: by rotations from quaternions as
/// textbooks write them, numbers of blocks by a queue, and boxes in long double.
namespace tandem::test {

namespace oriented_oracle_detail {

using Real = long double;

struct Rotation {
  std::int64_t matrix[3][3];  ///< times length
  std::int64_t length;        ///< of the quaternion, squared
  bool legal;
};

inline Rotation rotation_of(const OrientedBlock& block) {
  const std::uint32_t half[4] = {block.rotation.wx & 0xFFFFu, block.rotation.wx >> 16,
                                 block.rotation.yz & 0xFFFFu, block.rotation.yz >> 16};
  Rotation out = {{}, 0, true};
  std::int64_t q[4];
  for (int i = 0; i < 4; ++i) {
    q[i] = std::int64_t{half[i]} - 2048;
    out.legal = out.legal && half[i] > 0 && half[i] < 4096;
    out.length += q[i] * q[i];
  }
  out.legal = out.legal && out.length > 0;
  // w^2 - |u|^2, 2 u u^T and 2 w times the matrix of u x.
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      const std::int64_t cross = i == k ? 0 : (i + 1) % 3 == k ? -q[4 - i - k] : q[4 - i - k];
      out.matrix[i][k] =
          (i == k ? 2 * q[0] * q[0] - out.length : 0) + 2 * q[i + 1] * q[k + 1] + 2 * q[0] * cross;
    }
  }
  return out;
}

/// Whether node `node` holds the triangles from `first` to `end`. The terms are exact; two sums of three
/// numbers lose 2^-62 of the largest at most, a thousandth of what the checker keeps as its margin, and
/// nothing where the frame is the mesh's.
inline bool holds(const LevelView& level, const OrientedBlock& block, int node, std::uint32_t first,
                  std::uint32_t end) {
  const Rotation rotation = rotation_of(block);
  for (std::uint32_t t = first; t < end; ++t) {
    for (const Triangle::Corner& corner : level.triangles[t].corner) {
      for (int k = 0; k < 3; ++k) {
        Real at = 0;
        for (int i = 0; i < 3; ++i)
          at += static_cast<Real>(rotation.matrix[i][k]) * static_cast<Real>(corner.position[i]);
        const Real n = static_cast<Real>(rotation.length), c = n * static_cast<Real>(block.center[k][node]),
                   h = n * static_cast<Real>(block.half_extent[k][node]);
        if (!(at >= c - h && at <= c + h)) return false;
      }
    }
  }
  return true;
}

inline bool is_finite_box(const OrientedBlock& block, int node) {
  bool finite = true;
  for (int k = 0; k < 3; ++k) {
    finite = finite && std::isfinite(block.center[k][node]) && std::isfinite(block.half_extent[k][node]) &&
             block.half_extent[k][node] >= 0;
  }
  return finite;
}

inline bool is_empty_box(const OrientedBlock& block, int node) {
  bool empty = true;
  for (int k = 0; k < 3; ++k) {
    empty = empty && block.center[k][node] == 0 && !std::signbit(block.center[k][node]) &&
            block.half_extent[k][node] == kImaginaryHalfExtent;
  }
  return empty;
}

/// The edge of the cube with the surface of the largest box.
inline bool has_right_size(const OrientedBlock& block) {
  Real largest = 0;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    if (!is_finite_box(block, i)) continue;
    const Real x = block.half_extent[0][i], y = block.half_extent[1][i], z = block.half_extent[2][i];
    largest = std::fmax(largest, x * y + y * z + z * x);
  }
  const Real size = std::sqrt(largest / 3);
  return std::fabs(size - static_cast<Real>(block.size)) <= 0x1p-23L * size + 0x1p-149L;
}

}  // namespace oriented_oracle_detail

/// What is wrong with the oriented blocks of a level whose blocks are sound, or null.
inline const char* defect_of_oriented_blocks(const LevelView& level) {
  using namespace oriented_oracle_detail;
  // Triangles below each block. Children come after their parents.
  std::vector<std::uint32_t> first(level.block_count), end(level.block_count);
  for (std::uint32_t b = level.block_count; b-- > 0;) {
    const Block& block = level.blocks[b];
    first[b] = block.is_leaf_block() ? block.index[0] : first[block.index[0]];
    for (int i = 0; i < kNodesPerBlock; ++i) {
      if (block.kind[i] == NodeKind::leaf) end[b] = block.index[i] + 1;
      if (block.kind[i] == NodeKind::internal) end[b] = end[block.index[i]];
    }
  }
  std::vector<std::uint32_t> number(level.block_count);
  std::uint32_t next = 1;
  for (std::uint32_t b = 0; b < level.block_count; ++b) {
    const Block& block = level.blocks[b];
    const OrientedBlock& oriented = level.oriented_blocks[number[b]];
    if (oriented.is_leaf_block() != block.is_leaf_block()) return "leaf blocks are leaf blocks";
    if ((oriented.first_below & ~OrientedBlock::kIsLeafBlock) != (block.is_leaf_block() ? first[b] : next))
      return "what is below is named in the order of the blocks";
    if (!rotation_of(oriented).legal) return "rotations are quaternions of small whole numbers";
    if (!has_right_size(oriented)) return "the size is that of the largest box";
    for (int i = 0; i < kNodesPerBlock; ++i) {
      if (block.kind[i] == NodeKind::imaginary) {
        if (!is_empty_box(oriented, i)) return "oriented boxes of imaginary nodes are empty";
        continue;
      }
      const std::uint32_t below = block.index[i];
      const bool leaf = block.kind[i] == NodeKind::leaf;
      if (!leaf) number[below] = next++;
      if (!is_finite_box(oriented, i)) return "oriented boxes are finite";
      if (!holds(level, oriented, i, leaf ? below : first[below], leaf ? below + 1 : end[below]))
        return "oriented boxes hold the triangles below them";
    }
  }
  return next == level.block_count ? nullptr : "there are as many oriented blocks as blocks";
}

}  // namespace tandem::test
