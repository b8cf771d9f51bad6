#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bounds.h"
#include "tandem/formats/block.h"
#include "tree.h"

namespace tandem::build {

/// The children of a block, before boxes and places in memory are known.
struct TopologyBlock {
  std::array<std::uint32_t, kNodesPerBlock> child{};  ///< triangles of the input, or blocks; `count` of them
  std::uint8_t count = 0;
  bool is_leaf_block = false;
};

/// A tree under construction. Block 0 is the root; children may come before or after their parents.
using Topology = std::vector<TopologyBlock>;

/// The tree with the fewest imaginary nodes, by greedy surface-area splits among the legal ones, blocks in
/// depth-first order. `bounds`: of each triangle, normalized_bounds(). Source: surface-area heuristic by full
/// sweeps (Wald 2007); legal splits as in the project's design.
template <typename Bounds>
Topology build_minimal_tree(const std::vector<Bounds>& bounds);

/// The cheapest collapse of a free binary tree, with imaginary nodes wherever they fall, blocks in
/// depth-first order. `bounds`: of each triangle, normalized_bounds(). Source: surface-area heuristic (Wald
/// 2007), collapse by dynamic programming after Wald, Benthin and Boulos 2008.
template <typename Bounds>
Topology build_free_tree(const std::vector<Bounds>& bounds);

/// A tree between the minimal and the free one: the free one, in which small subtrees are minimal, as many as
/// it takes for at most `share` of all nodes to be imaginary, or the minimal one, in which some subtrees are
/// free. Which ones: those where it saves most for an imaginary node. `bounds`: of each triangle,
/// normalized_bounds().
template <typename Bounds>
Topology build_mixed_tree(const std::vector<Bounds>& bounds, double share);

/// Exchanges children of blocks so that tandem queries visit fewer of them. The number of imaginary nodes
/// stays as it is; the sum of visit_cost() never grows. The result does not depend on the number of threads.
/// `bounds`: of each triangle, normalized_bounds(). Effort::fast changes nothing.
template <typename Bounds>
void optimise(Topology& topology, const std::vector<Bounds>& bounds, Effort effort, OptimisationWatch& watch);

/// Gives a tree boxes and an order in memory: blocks depth-first, triangles as its leaves come.
Tree emit(const Geometry& geometry, const Topology& topology);

}  // namespace tandem::build
