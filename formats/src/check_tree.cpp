#include "check_tree.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "tandem/formats/box.h"

namespace tandem {
namespace {

struct Free {
  void operator()(void* memory) const { std::free(memory); }
};

bool is_real_box(const Box& box) {
  bool sound = true;
  for (int k = 0; k < 3; ++k) {
    sound =
        sound && std::isfinite(box.center[k]) && std::isfinite(box.half_extent[k]) && box.half_extent[k] >= 0;
  }
  return sound;
}

bool is_imaginary_box(const Box& box) {
  bool sound = true;
  for (int k = 0; k < 3; ++k)
    sound = sound && box.center[k] == 0 && !std::signbit(box.center[k]) &&
            box.half_extent[k] == kImaginaryHalfExtent;
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

// Walks the blocks in their order, which is possible because children come after their parents.
class TreeWalk {
 public:
  TreeWalk(const LevelView& level, std::uint64_t source_faces, std::span<const Part> parts,
           std::uint8_t* depth)
      : level_(level), source_faces_(source_faces), parts_(parts), depth_(depth) {
    depth_[0] = 1;
  }

  CheckResult run() {
    for (std::uint32_t b = 0; b < level_.block_count; ++b) {
      if (depth_[b] == 0) return {Status::kBlockUnreachable, b, {}};
      if (const Status status = visit(b); status != Status::kOk) return {status, b, {}};
    }
    if (next_triangle_ != level_.triangle_count || leaf_blocks_ != level_.leaf_block_count) {
      return {Status::kLeafCountMismatch, 0, {}};
    }
    if (deepest_ != level_.depth) return {Status::kDepthMismatch, 0, {}};
    return {};
  }

 private:
  Status visit(std::uint32_t b) {
    const Block& block = level_.blocks[b];
    int real = 0;
    if (const Status status = check_nodes(block, real); status != Status::kOk) return status;
    return block.is_leaf_block() ? visit_leaves(block, real) : visit_children(b, real);
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

  Status visit_children(std::uint32_t b, int real) {
    const Block& block = level_.blocks[b];
    if (depth_[b] == kMaxDepth) return Status::kTooDeep;
    for (int i = 0; i < real; ++i) {
      const std::uint32_t child = block.index[i];
      if (child >= level_.block_count) return Status::kChildOutOfRange;
      if (child <= b) return Status::kChildNotAfterParent;
      if (depth_[child] != 0) return Status::kChildShared;
      depth_[child] = static_cast<std::uint8_t>(depth_[b] + 1);
      deepest_ = std::max<std::uint32_t>(deepest_, depth_[child]);
      if (!contains_children(box_of(block, i), level_.blocks[child])) return Status::kChildOutsideParentBox;
    }
    return Status::kOk;
  }

  // Nodes of the child that are not sound are found when the child is visited; here they only must do no
  // harm.
  static bool contains_children(const Box& box, const Block& child) {
    for (int i = 0; i < kNodesPerBlock; ++i) {
      if (child.kind[i] == NodeKind::imaginary) break;
      const Box inner = box_of(child, i);
      if (is_real_box(inner) && !contains(box, inner)) return false;
    }
    return true;
  }

  LevelView level_;
  std::uint64_t source_faces_;
  std::span<const Part> parts_;
  std::uint8_t* depth_;  // of each block, 0 while it has no parent
  std::uint32_t next_triangle_ = 0;
  std::uint32_t leaf_blocks_ = 0;
  std::uint32_t deepest_ = 1;
};

static_assert(kMaxDepth <= 255, "depths are kept in bytes");

}  // namespace

CheckResult check_tree(const LevelView& level, std::uint64_t source_faces, std::span<const Part> parts) {
  // calloc instead of a container: formats/ throws nothing.
  const std::unique_ptr<std::uint8_t, Free> depth(
      static_cast<std::uint8_t*>(std::calloc(level.block_count, 1)));
  if (depth == nullptr) return {Status::kOutOfMemory, 0, {}};
  return TreeWalk(level, source_faces, parts, depth.get()).run();
}

}  // namespace tandem
