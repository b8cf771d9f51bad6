#include "tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "parallel/parallel.h"
#include "tandem/formats/box.h"
#include "topology.h"

namespace tandem::build {
namespace {

constexpr std::size_t kEmittedAtOnce = 1 << 12;

// The place where a block of the topology comes to lie, and its children.
struct Place {
  std::uint32_t block;           // of the topology
  std::uint32_t first_triangle;  // of a leaf block: where its triangles start in the file
  std::uint32_t child[kNodesPerBlock];
};

// Places all blocks, each after its parent, those below a node before those below the next one.
class DepthFirst {
 public:
  explicit DepthFirst(const Topology& topology) : topology_(topology) {
    places_.reserve(topology.size());
    number(0, 1);
  }

  std::vector<Place> take() { return std::move(places_); }
  std::uint32_t depth() const { return depth_; }

 private:
  std::uint32_t number(std::uint32_t block, std::uint32_t depth) {
    const auto self = static_cast<std::uint32_t>(places_.size());
    const TopologyBlock& from = topology_[block];
    places_.push_back({block, triangles_, {}});
    depth_ = std::max(depth_, depth);
    if (from.is_leaf_block) {
      triangles_ += from.count;
    } else {
      for (int i = 0; i < from.count; ++i) {
        const std::uint32_t child = number(from.child[i], depth + 1);
        places_[self].child[i] = child;
      }
    }
    return self;
  }

  const Topology& topology_;
  std::vector<Place> places_;
  std::uint32_t triangles_ = 0, depth_ = 0;
};

Box box_of_triangle(const Geometry& geometry, std::uint32_t triangle) {
  const auto& corners = geometry.triangles[triangle];
  Position lo, hi;
  for (int k = 0; k < 3; ++k) {
    const float a = geometry.points[corners[0]][k], b = geometry.points[corners[1]][k],
                c = geometry.points[corners[2]][k];
    lo[k] = std::min({a, b, c});
    hi[k] = std::max({a, b, c});
  }
  return enclose(lo, hi);
}

void emit_leaf_block(const Geometry& geometry, const TopologyBlock& from, const Place& place, Tree& tree,
                     Block& block) {
  for (std::uint32_t i = 0; i < from.count; ++i) {
    const std::uint32_t number = place.first_triangle + i;
    tree.order[number] = from.child[i];
    set_node(block, static_cast<int>(i), box_of_triangle(geometry, from.child[i]), number, NodeKind::leaf);
  }
}

void emit_internal_block(const TopologyBlock& from, const Place& place, const Tree& tree, Block& block) {
  for (int i = 0; i < from.count; ++i) {
    const std::uint32_t child = place.child[i];
    set_node(block, i, enclose(tree.blocks[child]), child, NodeKind::internal);
  }
}

template <typename Bounds>
Topology build_topology(const std::vector<Bounds>& bounds, Imaginary imaginary) {
  if (imaginary == Imaginary::minimal) return build_minimal_tree(bounds);
  if (imaginary == Imaginary::free) return build_free_tree(bounds);
  return build_mixed_tree(bounds, imaginary.share);
}

template <typename Bounds>
Topology optimised_topology(const std::vector<Bounds>& bounds, Imaginary imaginary, Effort effort,
                            OptimisationWatch& watch) {
  const BuildShares shares = build_shares(effort);
  watch.reach(0.1 * shares.split);
  Topology topology = build_topology(bounds, imaginary);
  watch.reach(shares.split);
  watch.optimise_between(shares.split, shares.optimised);
  optimise(topology, bounds, effort, watch);
  watch.reach(shares.optimised);
  return topology;
}

// Samples come in few numbers, each of which is compiled for itself.
Topology topology_over_samples(const Geometry& geometry, Imaginary imaginary, Effort effort,
                               OptimisationWatch& watch) {
  const std::size_t samples = 1 + geometry.poses.size();
  if (samples == 1) return optimised_topology(normalized_bounds(geometry), imaginary, effort, watch);
  if (samples <= 4) return optimised_topology(normalized_samples<4>(geometry), imaginary, effort, watch);
  if (samples <= 8) return optimised_topology(normalized_samples<8>(geometry), imaginary, effort, watch);
  if (samples <= 16) return optimised_topology(normalized_samples<16>(geometry), imaginary, effort, watch);
  return optimised_topology(normalized_samples<kMostTreeSamples>(geometry), imaginary, effort, watch);
}

}  // namespace

double CornerBounds::diagonal() const {
  return std::hypot(double{upper[0]} - lower[0], double{upper[1]} - lower[1], double{upper[2]} - lower[2]);
}

CornerBounds corner_bounds(const Geometry& geometry) {
  CornerBounds bounds;
  bounds.lower.fill(std::numeric_limits<float>::infinity());
  bounds.upper.fill(-std::numeric_limits<float>::infinity());
  for (const auto& corners : geometry.triangles) {
    for (const std::uint32_t vertex : corners) {
      for (std::size_t k = 0; k < 3; ++k) {
        bounds.lower[k] = std::min(bounds.lower[k], geometry.points[vertex][k]);
        bounds.upper[k] = std::max(bounds.upper[k], geometry.points[vertex][k]);
      }
    }
  }
  return bounds;
}

Tree emit(const Geometry& geometry, const Topology& topology) {
  DepthFirst numbering(topology);
  const std::vector<Place> places = numbering.take();
  Tree tree;
  tree.depth = numbering.depth();
  tree.blocks.resize(places.size());
  tree.order.resize(geometry.triangles.size());
  // Children come before parents, whose boxes enclose them. A block with a child in another part waits.
  std::vector<std::uint8_t> waits(places.size(), 0);
  parallel::for_parts(places.size(), kEmittedAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = end; b-- > begin;) {
      const TopologyBlock& from = topology[places[b].block];
      for (int i = from.count; i < kNodesPerBlock; ++i) set_imaginary(tree.blocks[b], i);
      if (from.is_leaf_block) {
        emit_leaf_block(geometry, from, places[b], tree, tree.blocks[b]);
        continue;
      }
      for (int i = 0; i < from.count; ++i)
        waits[b] |= static_cast<std::uint8_t>(places[b].child[i] >= end || waits[places[b].child[i]] != 0);
      if (waits[b] == 0) emit_internal_block(from, places[b], tree, tree.blocks[b]);
    }
  });
  for (std::size_t b = places.size(); b-- > 0;) {
    const TopologyBlock& from = topology[places[b].block];
    tree.leaf_block_count += from.is_leaf_block;
    if (waits[b] != 0) emit_internal_block(from, places[b], tree, tree.blocks[b]);
  }
  return tree;
}

Tree refitted(const Geometry& geometry, const Tree& tree) {
  Tree out = tree;
  for (std::size_t b = out.blocks.size(); b-- > 0;) {  // children come after their parents
    Block& block = out.blocks[b];
    for (int i = 0; i < kNodesPerBlock && block.kind[i] != NodeKind::imaginary; ++i) {
      const std::uint32_t below = block.index[i];
      const Box box = block.kind[i] == NodeKind::leaf ? box_of_triangle(geometry, out.order[below])
                                                      : enclose(out.blocks[below]);
      set_node(block, i, box, below, block.kind[i]);
    }
  }
  return out;
}

Tree build_tree(const Geometry& geometry, Imaginary imaginary, Effort effort) {
  OptimisationWatch watch;
  return build_tree(geometry, imaginary, effort, watch);
}

Tree build_tree(const Geometry& geometry, Imaginary imaginary, Effort effort, OptimisationWatch& watch) {
  return emit(geometry, topology_over_samples(geometry, imaginary, effort, watch));
}

}  // namespace tandem::build
