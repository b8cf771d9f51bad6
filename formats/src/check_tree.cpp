#include <algorithm>
#include <cmath>

#include "check_level.h"
#include "tandem/formats/box.h"

namespace tandem {
namespace {

bool is_real_box(const Box& box) {
  bool sound = true;
  for (int k = 0; k < 3; ++k) {
    sound =
        sound && std::isfinite(box.centre[k]) && std::isfinite(box.half_extent[k]) && box.half_extent[k] >= 0;
  }
  return sound;
}

// Kinds and boxes of the four nodes; sets `real` to the number of nodes that are not imaginary.
Status check_nodes(const Block& block, int& real) {
  real = 0;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    const NodeKind kind = block.kind[i];
    if (kind > NodeKind::imaginary) return Status::kBadNodeKind;
    if (kind == NodeKind::imaginary) {
      if (!is_imaginary_box(box_of(block, i)) || block.index[i] != kNoIndex) return Status::kBadImaginaryNode;
      continue;
    }
    if (real != i) return Status::kImaginaryBeforeReal;
    if (kind != block.kind[0]) return Status::kPartialLeafBlock;
    if (!is_real_box(box_of(block, i))) return Status::kBadBox;
    ++real;
  }
  return real > 0 ? Status::kOk : Status::kEmptyBlock;
}

Status check_triangle(const Triangle& triangle, const Box& leaf, std::uint64_t source_faces,
                      std::span<const Part> parts) {
  for (const Triangle::Corner& corner : triangle.corner) {
    for (const float x : corner.position) {
      if (!(std::abs(x) <= kMaxCoordinate)) return Status::kTriangleNotFinite;
    }
    if (!contains(leaf, corner.position)) return Status::kTriangleOutsideLeafBox;
  }
  if (triangle.source_face() >= source_faces || triangle.part() >= parts.size() ||
      triangle.corner[2].w != 0) {
    return Status::kBadFace;
  }
  const Part& part = parts[triangle.part()];
  const bool in_part =
      triangle.source_face() >= part.first_face && triangle.source_face() - part.first_face < part.face_count;
  return in_part ? Status::kOk : Status::kBadFace;
}

// Walks the blocks as they lie, which is depth first: at each block the nodes above it say which one it must
// be.
class TreeWalk {
 public:
  TreeWalk(const LevelView& level, std::uint64_t source_faces, std::span<const Part> parts)
      : level_(level), source_faces_(source_faces), parts_(parts) {}

  CheckResult run() {
    for (std::uint32_t b = 0; b < level_.block_count; ++b) {
      if (const Status status = visit(b); status != Status::kOk) return {status, where_, {}};
    }
    if (awaits_child()) return {name_misplaced(level_.block_count), where_, {}};
    if (next_triangle_ != level_.triangle_count || leaf_blocks_ != level_.leaf_block_count) {
      return {Status::kLeafCountMismatch, 0, {}};
    }
    if (deepest_ != level_.depth) return {Status::kDepthMismatch, 0, {}};
    return {};
  }

 private:
  // An internal block above the current one. Its node `next` is the first whose subtree was not begun yet.
  struct Ancestor {
    std::uint32_t block;
    int next, real;
  };

  Status visit(std::uint32_t b) {
    where_ = b;
    const Block& block = level_.blocks[b];
    if (b > 0 && !(awaits_child() && awaited_child() == b)) return name_misplaced(b);
    int real = 0;
    if (const Status status = check_nodes(block, real); status != Status::kOk) return status;
    if (b > 0 && !fits_in_its_node(block, real)) return Status::kChildOutsideParentBox;
    deepest_ = std::max(deepest_, ancestor_count_ + 1);
    if (block.is_leaf_block()) return visit_leaves(block, real);
    if (ancestor_count_ == kMaxDepth - 1) return Status::kTooDeep;
    ancestors_[ancestor_count_++] = {b, 0, real};
    return Status::kOk;
  }

  Status visit_leaves(const Block& block, int real) {
    ++leaf_blocks_;
    for (int i = 0; i < real; ++i) {
      if (next_triangle_ == level_.triangle_count || block.index[i] != next_triangle_)
        return Status::kTriangleOrder;
      const Triangle& triangle = level_.triangles[next_triangle_++];
      const Status status = check_triangle(triangle, box_of(block, i), source_faces_, parts_);
      if (status != Status::kOk) return status;
    }
    return Status::kOk;
  }

  // Leaves the ancestors all of whose nodes had their turn; whether a node is left.
  bool awaits_child() {
    while (ancestor_count_ > 0 && parent().next == parent().real) --ancestor_count_;
    return ancestor_count_ > 0;
  }

  Ancestor& parent() { return ancestors_[ancestor_count_ - 1]; }
  std::uint32_t awaited_child() { return level_.blocks[parent().block].index[parent().next]; }

  // Returns whether the node whose turn it is contains the nodes of its child; the next node's turn comes.
  bool fits_in_its_node(const Block& child, int real) {
    const Box box = box_of(level_.blocks[parent().block], parent().next++);
    for (int i = 0; i < real; ++i) {
      if (!contains(box, box_of(child, i))) {
        where_ = parent().block;
        return false;
      }
    }
    return true;
  }

  // Returns why block b, or the end of the blocks, is not the child that is awaited. It is called once, when
  // it is not.
  Status name_misplaced(std::uint32_t b) {
    if (ancestor_count_ == 0) return Status::kBlockUnreachable;
    const std::uint32_t child = awaited_child();
    where_ = parent().block;
    if (child >= level_.block_count) return Status::kChildOutOfRange;
    if (child <= parent().block) return Status::kChildNotAfterParent;
    where_ = child;
    if (child < b) return Status::kChildShared;  // it was the awaited child of another node already
    where_ = b;
    return is_named_above(b) ? Status::kBlockOrder : Status::kBlockUnreachable;
  }

  // Returns whether a node whose turn is yet to come names block b. No other block before b does: what the
  // nodes before these name are the blocks 1 to b - 1.
  bool is_named_above(std::uint32_t b) const {
    for (std::uint32_t a = 0; a < ancestor_count_; ++a) {
      const Ancestor& ancestor = ancestors_[a];
      const std::uint32_t* index = level_.blocks[ancestor.block].index;
      if (std::find(index + ancestor.next, index + ancestor.real, b) != index + ancestor.real) return true;
    }
    return false;
  }

  LevelView level_;
  std::uint64_t source_faces_;
  std::span<const Part> parts_;
  Ancestor ancestors_[kMaxDepth - 1];  // from the root down; a leaf block at kMaxDepth has as many
  std::uint32_t ancestor_count_ = 0;
  std::uint32_t next_triangle_ = 0;
  std::uint32_t leaf_blocks_ = 0;
  std::uint32_t deepest_ = 0;
  std::uint32_t where_ = 0;  // the block that a defect speaks of
};

}  // namespace

CheckResult check_tree(const LevelView& level, std::uint64_t source_faces, std::span<const Part> parts) {
  return TreeWalk(level, source_faces, parts).run();
}

}  // namespace tandem
