#pragma once
#include "kernels/common/lanes.h"

#ifdef TANDEM_HAVE_LANES
#include "kernels/refit/refit_ways.h"
#include "tandem/formats/box.h"

// Refits trees with a lane for each node of a block, or for each node and axis.
namespace tandem {
namespace {

TANDEM_INLINE DoubleLanes<4> doubled(const Lanes4& of) {
  return __builtin_convertvector(of.v, DoubleLanes<4>);
}

/// All ones in the lanes of the mask.
template <int kCount>
TANDEM_INLINE typename Lanes<kCount>::Bits ones_in(const LaneMask<kCount>& mask) {
#if defined(__AVX512F__)
  if constexpr (kCount == 16)
    return reinterpret_cast<typename Lanes<kCount>::Bits>(_mm512_maskz_set1_epi32(mask.bits, -1));
  else
#endif
    return mask.bits;
}

/// The next float above where `up`, and the next below where `down`.
template <int kCount>
TANDEM_INLINE Lanes<kCount> stepped(const Lanes<kCount>& x, const LaneMask<kCount>& up,
                                    const LaneMask<kCount>& down) {
  using Bits = typename Lanes<kCount>::Bits;
  return {reinterpret_cast<typename Lanes<kCount>::Floats>(reinterpret_cast<Bits>(x.v) - ones_in(up) +
                                                           ones_in(down))};
}

/// Holds the distance d of two numbers, rounded, and e, so that d + e is the distance itself.
template <int kCount>
struct LaneDistance {
  Lanes<kCount> d, e;
  TANDEM_INLINE LaneDistance(const Lanes<kCount>& p, const Lanes<kCount>& q) {
    const Lanes<kCount> x = larger(p, q), y = lesser(p, q);
    d = x - y;
    const Lanes<kCount> y_part = x - d;
    e = (x - (d + y_part)) + (y_part - y);
  }
};

/// half_extent_around() with h = 0, where s is d, and f is 0.
template <int kCount>
TANDEM_INLINE Lanes<kCount> half_extents_to(const Lanes<kCount>& centre, const Lanes<kCount>& c) {
  const LaneDistance<kCount> of(centre, c);
  return stepped(of.d, less(Lanes<kCount>{}, of.e), !LaneMask<kCount>::all());
}

/// half_extent_around() in lanes.
template <int kCount>
TANDEM_INLINE Lanes<kCount> half_extents_around(const Lanes<kCount>& centre, const Lanes<kCount>& c,
                                                const Lanes<kCount>& h) {
  const LaneMask<kCount> all = LaneMask<kCount>::all(), none = !all;
  const auto [d, e] = LaneDistance<kCount>(centre, c);
  const Lanes<kCount> s = d + h, h_part = s - d, f = (d - (s - h_part)) + (h - h_part), off = e + f;
  const Lanes<kCount> gap = stepped(s, none, all) - s;
  LaneMask<kCount> is_below = all;
  is_below.require(e, f), is_below.require(f, e), is_below.require(off, gap), is_below.require(gap, off);
  return stepped(s, less(Lanes<kCount>{}, off), is_below);
}

template <int kCount>
TANDEM_INLINE Lanes<kCount> midpoints(const Lanes<kCount>& lower, const Lanes<kCount>& upper) {
  return 0.5f * lower + 0.5f * upper;
}

// Vectors of 4 lanes hold nodes 0 to 3 along axis k. Vectors of 16 lanes hold them along all three axes, and
// their last four lanes are nobody's. The functions that tell both apart are these.

/// Loads the row of axis k, or all rows.
TANDEM_INLINE void load_rows(const float (&of)[3][kNodesPerBlock], int k, Lanes4& rows) {
  rows = load(of[k]);
}

TANDEM_INLINE void store_rows(const Lanes4& rows, int k, float (&to)[3][kNodesPerBlock]) {
  __builtin_memcpy(to[k], &rows, sizeof rows);
}

#if defined(__AVX512F__)
constexpr int kRefitLanes = 16;

TANDEM_INLINE void load_rows(const float (&of)[3][kNodesPerBlock], int, Lanes<16>& rows) {
  rows.v = reinterpret_cast<Lanes<16>::Floats>(_mm512_maskz_loadu_ps(0x0FFF, &of[0][0]));
}

TANDEM_INLINE void store_rows(const Lanes<16>& rows, int, float (&to)[3][kNodesPerBlock]) {
  const auto two_rows = __builtin_shufflevector(rows.v, rows.v, 0, 1, 2, 3, 4, 5, 6, 7);
  const auto last_row = __builtin_shufflevector(rows.v, rows.v, 8, 9, 10, 11);
  __builtin_memcpy(to[0], &two_rows, sizeof two_rows);
  __builtin_memcpy(to[2], &last_row, sizeof last_row);
}

/// Turns rows into columns within each four lanes. A masked form of an intrinsic whose mask is full spares
/// GCC a warning about what the plain form leaves undefined.
TANDEM_INLINE void transpose(Lanes<16> (&rows)[4]) {
  const auto row = [&](int i) { return reinterpret_cast<__m512>(rows[i].v); };
  const auto pairs = [](const __m512& p) { return _mm512_castps_pd(p); };
  const __m512d low01 = pairs(_mm512_maskz_unpacklo_ps(0xFFFF, row(0), row(1))),
                high01 = pairs(_mm512_maskz_unpackhi_ps(0xFFFF, row(0), row(1))),
                low23 = pairs(_mm512_maskz_unpacklo_ps(0xFFFF, row(2), row(3))),
                high23 = pairs(_mm512_maskz_unpackhi_ps(0xFFFF, row(2), row(3)));
  const auto set = [&](int i, const __m512d& column) {
    rows[i].v = reinterpret_cast<Lanes<16>::Floats>(_mm512_castpd_ps(column));
  };
  set(0, _mm512_maskz_unpacklo_pd(0xFF, low01, low23));
  set(1, _mm512_maskz_unpackhi_pd(0xFF, low01, low23));
  set(2, _mm512_maskz_unpacklo_pd(0xFF, high01, high23));
  set(3, _mm512_maskz_unpackhi_pd(0xFF, high01, high23));
}
#else
constexpr int kRefitLanes = 4;
#endif

constexpr int kRefitAxes = kRefitLanes == 4 ? 1 : 3;  // in a vector
using RefitRows = Lanes<kRefitLanes>;

/// Loads a position, and keeps the last lane of the corner as it was.
TANDEM_INLINE Lanes4 load_corner(const float* position, const Lanes4& old) {
#if defined(__AVX512VL__)
  return {
      reinterpret_cast<Lanes4::Floats>(_mm_mask_loadu_ps(reinterpret_cast<__m128>(old.v), 0x7, position))};
#else
  return {Lanes4::Floats{position[0], position[1], position[2], old.v[3]}};
#endif
}

/// Moves the corners of the triangle, and finds its bounds in three lanes.
TANDEM_INLINE void move_corners(const CornerSources& sources, const float* positions, Triangle& triangle,
                                Lanes4& lower, Lanes4& upper) {
  Lanes4 corner[3];
  for (int c = 0; c < 3; ++c) {
    float* const to = triangle.corner[c].position;
    corner[c] = load_corner(positions + std::size_t{3} * sources.of[c], load(to));
    __builtin_memcpy(to, &corner[c], sizeof corner[c]);
  }
  lower = lesser(lesser(corner[0], corner[1]), corner[2]);
  upper = larger(larger(corner[0], corner[1]), corner[2]);
}

TANDEM_INLINE void empty_nodes_from(int count, Block& block) {
  for (; count < kNodesPerBlock; ++count) set_imaginary(block, count);
}

TANDEM_INLINE void refit_leaves(const RefitTree& tree, Block& block, int count, const float* positions) {
  Lanes4 lower[4], upper[4];
#pragma GCC unroll 4
  for (int i = 0; i < kNodesPerBlock; ++i) {
    const std::size_t t = std::size_t{block.index[0]} + static_cast<std::size_t>(i < count ? i : 0);
    move_corners(tree.sources[t], positions, tree.triangles[t], lower[i], upper[i]);
  }
  transpose(lower);
  transpose(upper);
  for (int k = 0; k < 3; ++k) {
    const Lanes4 centre = midpoints(lower[k], upper[k]);
    store_rows(centre, k, block.centre);
    store_rows(larger(half_extents_to(centre, lower[k]), half_extents_to(centre, upper[k])), k,
               block.half_extent);
  }
  empty_nodes_from(count, block);
}

/// The box of a node is that of the child's nodes. An imaginary one has the interval [inf, -inf], and the
/// half-extent -infinity is less than all others, whatever is added to it; NaN in what says how a sum is
/// rounded changes nothing. Where a block has fewer than four children, the first one stands in for the
/// others, and their nodes are emptied at the end.
TANDEM_INLINE void refit_nodes(const Block* blocks, Block& block, int count) {
  const auto join = [](const auto& of, const auto& join_two) {
    return join_two(join_two(of[0], of[1]), join_two(of[2], of[3]));
  };
  const auto least = [](const RefitRows& a, const RefitRows& b) { return lesser(a, b); };
  const auto most = [](const RefitRows& a, const RefitRows& b) { return larger(a, b); };
  const Block* child[kNodesPerBlock];
  for (int j = 0; j < kNodesPerBlock; ++j) child[j] = blocks + block.index[j < count ? j : 0];
  for (int k = 0; k < 3; k += kRefitAxes) {
    RefitRows c[4], h[4], lower[4], upper[4];
    for (int j = 0; j < kNodesPerBlock; ++j) {
      load_rows(child[j]->centre, k, c[j]);
      load_rows(child[j]->half_extent, k, h[j]);
    }
    transpose(c);  // c[i] has node i of each child
    transpose(h);
    for (int i = 0; i < kNodesPerBlock; ++i) lower[i] = c[i] - h[i], upper[i] = c[i] + h[i];
    const RefitRows centre = midpoints(join(lower, least), join(upper, most));
    for (int i = 0; i < kNodesPerBlock; ++i) h[i] = half_extents_around(centre, c[i], h[i]);
    store_rows(centre, k, block.centre);
    store_rows(join(h, most), k, block.half_extent);
  }
  empty_nodes_from(count, block);
}

/// Adds an eighth of the surface of each real node to the sum of its lane.
TANDEM_INLINE void add_surfaces(const Block& block, int count, DoubleLanes<4>& sums) {
  const DoubleLanes<4> x = doubled(load(block.half_extent[0])), y = doubled(load(block.half_extent[1])),
                       z = doubled(load(block.half_extent[2])), four = (x * y + y * z) + z * x;
  if (count == kNodesPerBlock) {
    sums += four;
    return;
  }
  for (int i = 0; i < count; ++i) sums[i] += four[i];
}

// Blocks lie depth first, so the last come first: children before their parents.
template <int kCount>
double refit_of_lanes(const RefitTree& tree, const float* positions) {
  DoubleLanes<4> surfaces = {};
  for (std::uint32_t b = tree.block_count; b-- > 0;) {
    Block& block = tree.blocks[b];
    int count = 0;
    while (count < kNodesPerBlock && block.kind[count] != NodeKind::imaginary) ++count;
    if (block.is_leaf_block()) {
      if (positions != nullptr) refit_leaves(tree, block, count, positions);
    } else {
      refit_nodes(tree.blocks, block, count);
      add_surfaces(block, count, surfaces);
    }
  }
  return sum_of(surfaces);
}

}  // namespace
}  // namespace tandem
#endif
