#include "kernels/refit/refit_plan.h"

#include <algorithm>

namespace tandem::gpu {
namespace {

/// A block of the tree in the making of a plan. Blocks are numbered depth first.
struct PlanNode {
  std::uint32_t below[kNodesPerBlock];  ///< triangles or blocks
  int count;                            ///< of real nodes
  bool is_leaf_block;
  bool done;             ///< a round has it
  std::uint32_t size;    ///< blocks of the subtree
  std::uint32_t left;    ///< of them, those that are not done
  std::uint32_t height;  ///< above what its cluster begins with
  std::uint32_t slot;    ///< in its cluster
  std::uint32_t root = kNoIndex;
  std::uint32_t oriented = kNoIndex, first_below = 0;
};

/// An oriented block that waits to be numbered, and where its number goes.
struct Waiting {
  std::uint32_t oriented, parent;
  int node;
};

int real_nodes(const OrientedBlock& block) {
  int count = 0;
  while (count < kNodesPerBlock && block.half_extent[0][count] >= 0) ++count;
  return count;
}

class PlanMaker {
 public:
  PlanMaker(const LevelView& level, RefitPlans& plans, RefitPlan& plan)
      : level_(level), plans_(plans), plan_(plan) {}

  Status make() {
    if (plans_.blocks.size() + level_.block_count >= kNoIndex) return Status::kOutOfRange;
    plan_ = {};
    plan_.first_corner = plans_.corners.size();
    if (!add_corners() || !(level_.oriented_blocks != nullptr ? take_oriented_blocks() : take_blocks()))
      return Status::kOutOfMemory;
    for (std::uint32_t b = level_.block_count; b-- > 0;) {
      PlanNode& node = nodes_[b];
      node.size = 1;
      for (int i = 0; i < node.count && !node.is_leaf_block; ++i) node.size += nodes_[node.below[i]].size;
    }
    while (!nodes_[0].done) {
      plan_.first_cluster[plan_.rounds] = static_cast<std::uint32_t>(plans_.clusters.size());
      if (!add_round()) return Status::kOutOfMemory;
      ++plan_.rounds;
    }
    plan_.first_cluster[plan_.rounds] = static_cast<std::uint32_t>(plans_.clusters.size());
    return Status::kOk;
  }

 private:
  bool add_corners() {
    for (std::uint32_t t = 0; t < level_.triangle_count; ++t) {
      for (int c = 0; c < 3; ++c) {
        const std::uint32_t source = level_.source_vertices[level_.topology[t].vertex[c]];
        if (!plans_.corners.push({source, level_.triangles[t].corner[c].w})) return false;
      }
    }
    return true;
  }

  bool take_blocks() {
    if (!nodes_.resize(level_.block_count)) return false;
    for (std::uint32_t b = 0; b < level_.block_count; ++b) {
      const Block& block = level_.blocks[b];
      PlanNode node = {};
      node.is_leaf_block = block.is_leaf_block();
      for (; node.count < kNodesPerBlock && block.kind[node.count] != NodeKind::imaginary; ++node.count)
        node.below[node.count] = block.index[node.count];
      nodes_[b] = node;
    }
    return true;
  }

  // The first child is the next that is numbered, so that numbers are those of blocks.
  bool take_oriented_blocks() {
    Buffer<Waiting> waiting;
    nodes_.clear();
    if (!waiting.push({0, kNoIndex, 0})) return false;
    while (waiting.size() > 0) {
      const Waiting next = waiting[waiting.size() - 1];
      (void)waiting.resize(waiting.size() - 1);
      const auto number = static_cast<std::uint32_t>(nodes_.size());
      if (next.parent != kNoIndex) nodes_[next.parent].below[next.node] = number;
      const OrientedBlock& block = level_.oriented_blocks[next.oriented];
      PlanNode node = {};
      node.is_leaf_block = block.is_leaf_block();
      node.count = real_nodes(block);
      node.oriented = next.oriented;
      node.first_below = block.first_below;
      for (int i = node.count; i-- > 0;) {
        const auto step = static_cast<std::uint32_t>(i);
        if (node.is_leaf_block) node.below[i] = (block.first_below & ~OrientedBlock::kIsLeafBlock) + step;
        if (!node.is_leaf_block && !waiting.push({block.first_below + step, number, i})) return false;
      }
      if (!nodes_.push(node)) return false;
    }
    return true;
  }

  // Puts all subtrees with few enough blocks left into clusters.
  bool add_round() {
    for (std::uint32_t b = level_.block_count; b-- > 0;) {
      PlanNode& node = nodes_[b];
      node.left = node.done ? 0 : 1;
      for (int i = 0; i < node.count && !node.is_leaf_block && !node.done; ++i)
        node.left += nodes_[node.below[i]].left;
    }
    for (std::uint32_t b = 0; b < level_.block_count;) {
      if (nodes_[b].left > kMostClusterBlocks) {
        ++b;
        continue;
      }
      if (!nodes_[b].done && !add_subtree(b)) return false;
      b += nodes_[b].size;
    }
    return end_cluster();
  }

  bool add_subtree(std::uint32_t root) {
    if (members_.size() + nodes_[root].left > kMostClusterBlocks && !end_cluster()) return false;
    if (root != 0) nodes_[root].root = plan_.roots++;
    for (std::uint32_t b = root; b < root + nodes_[root].size; b += nodes_[b].done ? nodes_[b].size : 1) {
      if (!nodes_[b].done && !members_.push(b)) return false;
    }
    return true;
  }

  // Sorts the blocks of the open cluster by height and adds it.
  bool end_cluster() {
    const auto count = static_cast<std::uint32_t>(members_.size());
    if (count == 0) return true;
    std::uint32_t heights = 0;
    for (std::uint32_t i = count; i-- > 0;) heights = std::max(heights, find_height(nodes_[members_[i]]) + 1);
    RefitCluster cluster = {};
    cluster.first_block = static_cast<std::uint32_t>(plans_.blocks.size());
    cluster.blocks = count;
    cluster.first_input =
        static_cast<std::uint32_t>(plan_.rounds == 0 ? first_triangle() : plans_.inputs.size());
    cluster.first_height = static_cast<std::uint32_t>(plans_.height_ends.size());
    cluster.heights = heights;
    std::uint32_t slot = 0;
    for (std::uint32_t height = 0; height < heights; ++height) {
      for (const std::uint32_t b : members_.view()) {
        if (nodes_[b].height == height) nodes_[b].slot = slot++;
      }
      if (!plans_.height_ends.push(static_cast<std::uint16_t>(slot))) return false;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      if (!plans_.blocks.push({})) return false;
    }
    if (!add_blocks(cluster)) return false;
    for (const std::uint32_t b : members_.view()) nodes_[b].done = true;
    members_.clear();
    return plans_.clusters.push(cluster);
  }

  std::uint32_t find_height(PlanNode& node) const {
    node.height = 0;
    for (int i = 0; i < node.count && !node.is_leaf_block; ++i) {
      const PlanNode& child = nodes_[node.below[i]];
      if (!child.done) node.height = std::max(node.height, child.height + 1);
    }
    return node.height;
  }

  // Those of a cluster follow each other.
  std::uint32_t first_triangle() const {
    std::uint32_t first = kNoIndex;
    for (const std::uint32_t b : members_.view()) {
      if (nodes_[b].is_leaf_block) first = std::min(first, nodes_[b].below[0]);
    }
    return first;
  }

  bool add_blocks(RefitCluster& cluster) {
    const bool from_triangles = plan_.rounds == 0;
    for (const std::uint32_t b : members_.view()) {
      const PlanNode& node = nodes_[b];
      for (int i = 0; i < node.count; ++i) {
        const bool is_input = from_triangles ? node.is_leaf_block : nodes_[node.below[i]].done;
        cluster.inputs += is_input;
        if (is_input && !from_triangles && !plans_.inputs.push(nodes_[node.below[i]].root)) return false;
      }
    }
    const std::uint32_t boxes_before = from_triangles ? 0 : cluster.inputs;
    std::uint32_t next_input = 0;
    for (const std::uint32_t b : members_.view()) {
      const PlanNode& node = nodes_[b];
      RefitBlock block = {b, node.oriented, node.first_below, node.root, {}};
      std::fill_n(block.below, kNodesPerBlock, RefitBlock::kNothing);
      for (int i = 0; i < node.count; ++i) {
        std::uint32_t below = next_input;
        if (node.is_leaf_block) {
          below = node.below[i] - cluster.first_input;
        } else if (nodes_[node.below[i]].done) {
          ++next_input;
        } else {
          below = boxes_before + nodes_[node.below[i]].slot;
        }
        block.below[i] = static_cast<std::uint16_t>(below);
      }
      plans_.blocks[cluster.first_block + node.slot] = block;
    }
    return true;
  }

  const LevelView& level_;
  RefitPlans& plans_;
  RefitPlan& plan_;
  Buffer<PlanNode> nodes_;
  Buffer<std::uint32_t> members_;  // of the open cluster, parents before children
};

}  // namespace

Status RefitPlans::add(const LevelView& level, RefitPlan& plan) {
  return PlanMaker(level, *this, plan).make();
}

}  // namespace tandem::gpu
