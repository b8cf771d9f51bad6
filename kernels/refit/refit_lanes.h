#pragma once
#include "kernels/common/lanes.h"

#ifdef TANDEM_HAVE_LANES
#include "kernels/refit/refit_ways.h"
#include "tandem/formats/box.h"

// Refitting with a lane for each node of a block.
namespace tandem {
namespace {

TANDEM_INLINE DoubleLanes<4> doubled(const Lanes4& of) {
  return __builtin_convertvector(of.v, DoubleLanes<4>);
}

TANDEM_INLINE LaneMask<4> no_lanes() {
  return {LaneMask<4>::Bits{}};
}

/// The next float above where `up`, which is all ones in these lanes, and the next below where `down`.
TANDEM_INLINE Lanes4 stepped(const Lanes4& x, const LaneMask<4>& up, const LaneMask<4>& down) {
  return {reinterpret_cast<Lanes4::Floats>(reinterpret_cast<Lanes4::Bits>(x.v) - up.bits + down.bits)};
}

/// half_extent_around() with h = 0, where s is d, and f is 0.
TANDEM_INLINE Lanes4 half_extents_to(const Lanes4& centre, const Lanes4& c) {
  const Lanes4 x = larger(centre, c), y = lesser(centre, c);
  const Lanes4 d = x - y, y_part = x - d, e = (x - (d + y_part)) + (y_part - y);
  return stepped(d, less(Lanes4{}, e), no_lanes());
}

TANDEM_INLINE Lanes4 half_extents_around(const Lanes4& centre, const Lanes4& c, const Lanes4& h) {
  const Lanes4 x = larger(centre, c), y = lesser(centre, c);
  const Lanes4 d = x - y, y_part = x - d, e = (x - (d + y_part)) + (y_part - y);
  const Lanes4 s = d + h, h_part = s - d, f = (d - (s - h_part)) + (h - h_part), off = e + f;
  const Lanes4 below = stepped(s, no_lanes(), LaneMask<4>::all());
  const LaneMask<4> is_below = {(e.v == f.v) & (off.v == below.v - s.v)};
  return stepped(s, less(Lanes4{}, off), is_below);
}

TANDEM_INLINE void store(const Lanes4& lanes, float* four) {
  __builtin_memcpy(four, &lanes, sizeof lanes);
}

TANDEM_INLINE Lanes4 midpoints(const Lanes4& lower, const Lanes4& upper) {
  return 0.5f * lower + 0.5f * upper;
}

/// The three numbers from p, and a fourth from w.
TANDEM_INLINE Lanes4 load_three(const float* p, float w) {
  return {Lanes4::Floats{p[0], p[1], p[2], w}};
}

/// Moves the corners of the triangle, and finds its bounds in three lanes.
TANDEM_INLINE void move_corners(const CornerSources& sources, const float* positions, Triangle& triangle,
                                Lanes4& lower, Lanes4& upper) {
  Lanes4 corner[3];
  for (int c = 0; c < 3; ++c) {
    float* const to = triangle.corner[c].position;
    float w;
    __builtin_memcpy(&w, to + 3, sizeof w);
    corner[c] = load_three(positions + std::size_t{3} * sources.of[c], w);
    store(corner[c], to);
  }
  lower = lesser(lesser(corner[0], corner[1]), corner[2]);
  upper = larger(larger(corner[0], corner[1]), corner[2]);
}

TANDEM_INLINE void refit_leaves(const RefitTree& tree, Block& block, const float* positions) {
  Lanes4 lower[4] = {}, upper[4] = {};
  for (int i = 0; i < kNodesPerBlock && block.kind[i] == NodeKind::leaf; ++i)
    move_corners(tree.sources[block.index[i]], positions, tree.triangles[block.index[i]], lower[i], upper[i]);
  transpose(lower);
  transpose(upper);
  for (int k = 0; k < 3; ++k) {
    const Lanes4 centre = midpoints(lower[k], upper[k]);
    store(centre, block.centre[k]);
    store(larger(half_extents_to(centre, lower[k]), half_extents_to(centre, upper[k])), block.half_extent[k]);
  }
  for (int i = 0; i < kNodesPerBlock; ++i) {
    if (block.kind[i] == NodeKind::imaginary) set_imaginary(block, i);
  }
}

/// What three rows have along each of them, in three lanes.
template <typename Join>
TANDEM_INLINE Lanes4 joined(const Lanes4 (&of)[3], const Join& join) {
  Lanes4 rows[4] = {of[0], of[1], of[2], of[2]};
  transpose(rows);
  return join(join(rows[0], rows[1]), join(rows[2], rows[3]));
}

/// The box of a node is that of the child's nodes. An imaginary one has the interval [inf, -inf], and the
/// half-extent -infinity is less than all others, whatever is added to it; NaN in what says how a sum is
/// rounded changes nothing.
TANDEM_INLINE void refit_node(const Block& child, Block& block, int node) {
  const auto least = [](const Lanes4& a, const Lanes4& b) { return lesser(a, b); };
  const auto most = [](const Lanes4& a, const Lanes4& b) { return larger(a, b); };
  Lanes4 c[3], h[3], lower[3], upper[3];
  for (int k = 0; k < 3; ++k) {
    c[k] = load(child.centre[k]), h[k] = load(child.half_extent[k]);
    lower[k] = c[k] - h[k], upper[k] = c[k] + h[k];
  }
  const Lanes4 centre = midpoints(joined(lower, least), joined(upper, most));
  for (int k = 0; k < 3; ++k) {
    const float middle = centre.v[k];
    h[k] = half_extents_around({Lanes4::Floats{middle, middle, middle, middle}}, c[k], h[k]);
  }
  const Lanes4 half_extent = joined(h, most);
  for (int k = 0; k < 3; ++k) {
    block.centre[k][node] = centre.v[k];
    block.half_extent[k][node] = half_extent.v[k];
  }
}

TANDEM_INLINE double surface_of(const Block& block, int count) {
  const DoubleLanes<4> x = doubled(load(block.half_extent[0])), y = doubled(load(block.half_extent[1])),
                       z = doubled(load(block.half_extent[2])), four = x * y + y * z + z * x;
  double sum = 0;
  for (int i = 0; i < count; ++i) sum += four[i];
  return sum;
}

// Blocks lie depth first, so the last come first: children before their parents.
template <int kCount>
RefitSurfaces refit_of_lanes(const RefitTree& tree, const float* positions) {
  RefitSurfaces surfaces;
  for (std::uint32_t b = tree.block_count; b-- > 0;) {
    Block& block = tree.blocks[b];
    int count = 0;
    while (count < kNodesPerBlock && block.kind[count] != NodeKind::imaginary) ++count;
    if (block.is_leaf_block()) {
      if (positions != nullptr) refit_leaves(tree, block, positions);
      surfaces.of_leaves += surface_of(block, count);
    } else {
      for (int i = 0; i < count; ++i) refit_node(tree.blocks[block.index[i]], block, i);
      surfaces.of_inner += surface_of(block, count);
    }
  }
  return surfaces;
}

}  // namespace
}  // namespace tandem
#endif
