#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "tandem/formats/box.h"

/// Blocks in frames of their own: the boxes of a block's four nodes lie along the axes of one rotation, which
/// fits what is below the block. They are thinner than boxes along the axes of the mesh, so fewer pairs of
/// them overlap. Exact queries on a GPU walk them where they lie.
namespace tandem {

/// A rotation by its quaternion w + xi + yj + zk, which need not have length 1: whole numbers of at most
/// kLargestQuaternionPart, not all 0, each stored in 16 bits with kQuaternionOffset added, w and y in the
/// lower halves. It is the exact rotation of these numbers, so its rows and columns are exactly orthonormal.
struct BlockRotation {
  std::uint32_t wx, yz;

  friend bool operator==(const BlockRotation&, const BlockRotation&) = default;
};

inline constexpr int kLargestQuaternionPart = 2047;
inline constexpr std::uint32_t kQuaternionOffset = 2048;

/// A block's four boxes in its own frame, component by component, and what lies below them.
///
///     byte 0    16   32   48   64   80   96            100    104       112
///          | cx | cy | cz | hx | hy | hz | first_below | size | rotation |
///
/// Oriented block 0 is the root's. Those of the children of an internal block follow each other, children of
/// blocks that come earlier in the file before those of later ones. So a block has one number in its own
/// section and, as a rule, another one here. Node i is the same node in both.
///
/// 112 bytes, an odd number of float4: where the lanes of a warp read the same component of several blocks,
/// the L1 cache serves them from several banks, which it cannot where blocks are 128 bytes apart.
struct alignas(16) OrientedBlock {
  float centre[3][kNodesPerBlock];
  float half_extent[3][kNodesPerBlock];
  std::uint32_t first_below;  ///< oriented block below node 0, or kIsLeafBlock and the triangle of node 0
  float size;                 ///< oriented_size() of the boxes
  BlockRotation rotation;

  TANDEM_HD bool is_leaf_block() const { return (first_below & kIsLeafBlock) != 0; }

  static constexpr std::uint32_t kIsLeafBlock = 1u << 31;
};
static_assert(sizeof(OrientedBlock) == 112 && offsetof(OrientedBlock, half_extent) == 48 &&
              offsetof(OrientedBlock, first_below) == 96 && offsetof(OrientedBlock, rotation) == 104);

TANDEM_HD inline Box box_of(const OrientedBlock& block, int node) {
  return {{block.centre[0][node], block.centre[1][node], block.centre[2][node]},
          {block.half_extent[0][node], block.half_extent[1][node], block.half_extent[2][node]}};
}

/// A level with as many triangles has no oriented blocks: they could not name them all.
inline constexpr std::uint32_t kMostOrientedTriangles = OrientedBlock::kIsLeafBlock;

/// A rotation in whole numbers, exactly: x_mesh = scaled * x_block / squared_length.
struct ScaledRotation {
  float scaled[3][3];    ///< at most 2^24; rows and columns are squared_length long
  float squared_length;  ///< of the quaternion; below 2^24
};

/// Returns part 0 to 3 of a quaternion: w, x, y, z.
TANDEM_HD inline float quaternion_part(const BlockRotation& rotation, int part) {
  const std::uint32_t word = part < 2 ? rotation.wx : rotation.yz;
#ifdef __CUDA_ARCH__
  // 2^23 + n has n in its last bits.
  return __uint_as_float(__byte_perm(word, 0x4B000000u, part % 2 != 0 ? 0x7632 : 0x7610)) -
         static_cast<float>(0x1p23 + kQuaternionOffset);
#else
  const std::uint32_t half = part % 2 != 0 ? word >> 16 : word & 0xFFFFu;
  return static_cast<float>(static_cast<int>(half) - static_cast<int>(kQuaternionOffset));
#endif
}

TANDEM_HD inline ScaledRotation scaled_rotation(const BlockRotation& rotation) {
  const float w = quaternion_part(rotation, 0), x = quaternion_part(rotation, 1),
              y = quaternion_part(rotation, 2), z = quaternion_part(rotation, 3);
  const float with_x = w * w + x * x, without_x = y * y + z * z, wx_less = w * w - x * x,
              yz_less = y * y - z * z;
  const float xy = x * y, xz = x * z, yz = y * z, wx = w * x, wy = w * y, wz = w * z;
  return {{{with_x - without_x, 2 * (xy - wz), 2 * (xz + wy)},
           {2 * (xy + wz), wx_less + yz_less, 2 * (yz - wx)},
           {2 * (xz - wy), 2 * (yz + wx), wx_less - yz_less}},
          with_x + without_x};
}

/// The quaternion nearest to w + xi + yj + zk. Condition: finite, not all 0.
inline BlockRotation rotation_near(float w, float x, float y, float z) {
  const float part[4] = {w, x, y, z};
  float largest = 0;
  for (const float p : part) largest = std::fabs(p) > largest ? std::fabs(p) : largest;
  constexpr float kToWhole = 0x1.8p23f;  // a sum with it is rounded to a whole number, to an even one of two
  std::uint32_t word[4];
  for (int i = 0; i < 4; ++i) {
    const float n = (part[i] / largest * static_cast<float>(kLargestQuaternionPart) + kToWhole) - kToWhole;
    word[i] = static_cast<std::uint32_t>(static_cast<int>(n) + static_cast<int>(kQuaternionOffset));
  }
  return {word[0] | word[1] << 16, word[2] | word[3] << 16};
}

/// The mesh's own axes.
inline constexpr BlockRotation kNoRotation = {
    kQuaternionOffset << 16 | (kQuaternionOffset + kLargestQuaternionPart),
    kQuaternionOffset << 16 | kQuaternionOffset};

/// The coordinate of a vertex along axis k of a block's frame, times rotation.squared_length.
inline double scaled_along_axis(const ScaledRotation& rotation, int k, const float (&vertex)[3]) {
  const auto at = [&](int i) { return double{rotation.scaled[i][k]} * double{vertex[i]}; };  // exact
  return (at(0) + at(1)) + at(2);
}

/// The coordinate itself, off by at most 2^-51 of the vertex's distance from the origin.
inline double along_axis(const ScaledRotation& rotation, int k, const float (&vertex)[3]) {
  return scaled_along_axis(rotation, k, vertex) / double{rotation.squared_length};
}

/// Centre and half-extent along an axis of a box that holds, in real arithmetic, what lies from `lowest` to
/// `highest`, both of along_axis(), `farthest` being at least the distance of each vertex from the origin.
/// The margin is what the checker asks for and more (formats/src/check_oriented.cpp).
inline void box_along(double lowest, double highest, double farthest, float& centre, float& half_extent) {
  centre = static_cast<float>(0.5 * (lowest + highest));
  const double above = highest - double{centre}, below = double{centre} - lowest;
  const double half = (std::fmax(above, below) + 0x1p-48 * farthest) * (1 + 0x1p-22);
  half_extent = static_cast<float>(half);
  if (double{half_extent} < half)
    half_extent = std::nextafter(half_extent, std::numeric_limits<float>::infinity());
}

/// Returns the size of a block: the edge of the cube with the surface of its largest box. Walks compare it to
/// decide which of two blocks goes on to its children. It is the same on every machine: float64 squares of
/// float32 numbers are exact, and the rest is rounded as IEEE 754 says, fused or not.
inline float oriented_size(const OrientedBlock& block) {
  double largest = 0;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    const double x = block.half_extent[0][i], y = block.half_extent[1][i], z = block.half_extent[2][i];
    if (!(x >= 0)) continue;  // imaginary
    const double surface = (x * y + y * z) + z * x;
    if (surface > largest) largest = surface;
  }
  return static_cast<float>(std::sqrt(largest / 3));
}

}  // namespace tandem
