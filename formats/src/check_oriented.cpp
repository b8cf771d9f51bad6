#include <cmath>

#include "check_level.h"
#include "tandem/formats/box.h"

namespace tandem {
namespace {

bool is_legal(const BlockRotation& rotation) {
  bool all_zero = true;
  for (const std::uint32_t word : {rotation.wx, rotation.yz}) {
    for (const std::uint32_t half : {word & 0xFFFFu, word >> 16}) {
      const int part = static_cast<int>(half) - static_cast<int>(kQuaternionOffset);
      if (std::abs(part) > kLargestQuaternionPart) return false;
      all_zero = all_zero && part == 0;
    }
  }
  return !all_zero;
}

// Holds a quantity of two triangles side by side.
typedef double Two __attribute__((vector_size(16)));

// Walks the blocks as they lie, which is depth first, with the number of each one's oriented block.
class OrientedWalk {
 public:
  OrientedWalk(const LevelView& level, CheckDepth depth) : level_(level), depth_(depth) {
    double squared = 0;
    for (const double reach : extent_of(level.blocks[0]).reach) squared += reach * reach;
    farthest_ = std::sqrt(squared);
  }

  CheckResult run() {
    Status status = visit(0, 0);
    for (std::uint32_t b = 1; b < level_.block_count && status == Status::kOk; ++b) {
      const Ancestor& parent = ancestors_[ancestor_count_ - 1];
      status = visit(b, parent.first_child + static_cast<std::uint32_t>(parent.next));
    }
    return {status, where_, {}};
  }

 private:
  // An internal block above the current one. Its node `next` is the one whose subtree is being visited.
  struct Ancestor {
    std::uint32_t block, oriented, first_child;
    std::uint32_t first_triangle;  // below the node
    int next, real;
  };

  Status visit(std::uint32_t b, std::uint32_t oriented) {
    const Block& block = level_.blocks[b];
    int real = kNodesPerBlock;
    while (block.kind[real - 1] == NodeKind::imaginary) --real;
    where_ = oriented;
    if (const Status status = check_block(block, level_.oriented_blocks[oriented], real);
        status != Status::kOk)
      return status;
    if (!block.is_leaf_block()) {
      ancestors_[ancestor_count_++] = {b, oriented, next_number_, next_triangle_, 0, real};
      next_number_ += static_cast<std::uint32_t>(real);
      return Status::kOk;
    }
    for (int i = 0; i < real; ++i) {
      const std::uint32_t triangle = next_triangle_++;
      if (!holds(block, oriented, i, triangle, triangle + 1)) return Status::kTriangleOutsideOrientedBox;
    }
    return leave_nodes();
  }

  // Checks all but what the boxes hold.
  Status check_block(const Block& block, const OrientedBlock& oriented, int real) const {
    const std::uint32_t below =
        block.is_leaf_block() ? OrientedBlock::kIsLeafBlock | next_triangle_ : next_number_;
    if (oriented.first_below != below) return Status::kOrientedBlockMismatch;
    if (!is_legal(oriented.rotation)) return Status::kBadRotation;
    for (int i = 0; i < kNodesPerBlock; ++i) {
      const Box box = box_of(oriented, i);
      if (i < real ? !is_real_box(box) : !is_imaginary_box(box)) return Status::kBadOrientedBox;
    }
    return oriented.size == oriented_size(oriented) ? Status::kOk : Status::kBadOrientedBox;
  }

  // Finite, and no farther from the origin than the slack of the tests allows: docs/oriented_box_test.md.
  bool is_real_box(const Box& box) const {
    bool sound = true;
    for (int k = 0; k < 3; ++k) {
      sound = sound && box.half_extent[k] >= 0 && std::isfinite(box.half_extent[k]) &&
              std::abs(double{box.centre[k]}) + double{box.half_extent[k]} <= farthest_ * (1 + 0x1p-20);
    }
    return sound;
  }

  // Ends the nodes whose subtrees are complete now.
  Status leave_nodes() {
    while (ancestor_count_ > 0) {
      Ancestor& parent = ancestors_[ancestor_count_ - 1];
      if (!holds(level_.blocks[parent.block], parent.oriented, parent.next, parent.first_triangle,
                 next_triangle_)) {
        where_ = parent.oriented;
        return Status::kTriangleOutsideOrientedBox;
      }
      parent.first_triangle = next_triangle_;
      if (++parent.next < parent.real) break;
      --ancestor_count_;
    }
    return Status::kOk;
  }

  // Returns whether the box of a node holds the triangles from `first` to `end`, in real arithmetic.
  //
  // Proof. Let S be the scaled rotation, n the squared length of its quaternion, v a vertex and c, h of the
  // box. v lies in the box along axis k if |p - n c| <= n h with p = sum over i of S_ik v_i. Products of two
  // float32 numbers are exact in float64, so p as computed is off by two roundings, at most 2^-52 (1 + 2^-50)
  // n |v|, since a column of S is n long; and |v| <= farthest_. n c and n h are exact, and |c| + h <=
  // farthest_ (1 + 2^-20), so n c - n h and n c + n h are off by 2^-53 (1 + 2^-19) n farthest_. Adding the
  // margin takes one more rounding of that kind. All these are less than the margin together, 2^-50 n
  // farthest_. Nothing overflows or is subnormal in float64.
  bool holds(const Block& block, std::uint32_t number, int node, std::uint32_t first,
             std::uint32_t end) const {
    if (depth_ == CheckDepth::quick) return true;
    const OrientedBlock& oriented = level_.oriented_blocks[number];
    // In the mesh's own axes it suffices that boxes lie within boxes, as check_tree() showed.
    if (oriented.rotation == kNoRotation && contains(box_of(oriented, node), box_of(block, node)))
      return true;
    const ScaledRotation rotation = scaled_rotation(oriented.rotation);
    Two s[3][3], lowest[3], highest[3];
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < 3; ++i) s[i][k] = Two{} + double{rotation.scaled[i][k]};
      lowest[k] = Two{} + HUGE_VAL;
      highest[k] = Two{} - HUGE_VAL;
    }
    for (std::uint32_t t = first; t < end; t += 2) {
      const Triangle &one = level_.triangles[t], &other = level_.triangles[t + 1 < end ? t + 1 : t];
      for (int corner = 0; corner < 3; ++corner) {
        const float *v = one.corner[corner].position, *w = other.corner[corner].position;
        const Two x = {v[0], w[0]}, y = {v[1], w[1]}, z = {v[2], w[2]};
        for (int k = 0; k < 3; ++k) {
          const Two p = (s[0][k] * x + s[1][k] * y) + s[2][k] * z;
          lowest[k] = p < lowest[k] ? p : lowest[k];
          highest[k] = p > highest[k] ? p : highest[k];
        }
      }
    }
    const double n = rotation.squared_length, margin = 0x1p-50 * n * farthest_;
    bool inside = true;
    for (int k = 0; k < 3; ++k) {
      const double c = n * double{oriented.centre[k][node]}, h = n * double{oriented.half_extent[k][node]};
      for (int i = 0; i < 2; ++i)
        inside = inside && lowest[k][i] - margin >= c - h && highest[k][i] + margin <= c + h;
    }
    return inside;
  }

  LevelView level_;
  CheckDepth depth_;
  double farthest_;  // at least the distance of each vertex from the origin, but for roundings of float64
  Ancestor ancestors_[kMaxDepth - 1];
  std::uint32_t ancestor_count_ = 0;
  std::uint32_t next_number_ = 1;  // of an oriented block
  std::uint32_t next_triangle_ = 0;
  std::uint32_t where_ = 0;  // the oriented block that a defect speaks of
};

}  // namespace

CheckResult check_oriented_blocks(const LevelView& level, CheckDepth depth) {
  return OrientedWalk(level, depth).run();
}

}  // namespace tandem
