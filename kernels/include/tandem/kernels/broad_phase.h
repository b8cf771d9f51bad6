#pragma once
#include <cstdint>
#include <span>

#include "tandem/formats/box.h"
#include "tandem/formats/status.h"
#include "tandem/kernels/buffer.h"
#include "tandem/kernels/world_box.h"

namespace tandem {

/// Two instances whose world boxes meet; a < b.
struct ObjectPair {
  std::uint32_t a, b;
};

/// Finds all pairs of world boxes that meet. Keeps its memory from call to call: in a steady state nothing is
/// allocated. Throws nothing. One thread.
///
/// Boxes are sorted along a space-filling curve and grouped by four into a blocked tree, level by level,
/// which is then traversed in tandem with itself. Nothing is assumed of sizes or distribution; O(n log n) for
/// boxes of bounded overlap.
class BroadPhase {
 public:
  /// Result: kOk; kOutOfMemory; kOutOfRange where a coordinate is NaN or beyond 1e300, or the boxes are 2^32
  /// - 1 or more. The pairs are those whose float64 boxes meet, touching included, no more and no fewer,
  /// sorted by a, then b.
  Status find_pairs(std::span<const WorldBox> boxes);

  /// Of the last call that returned kOk; valid until the next call.
  std::span<const ObjectPair> pairs() const { return pairs_.view(); }

 private:
  struct Key {
    std::uint32_t curve;  // position on the space-filling curve
    std::uint32_t box;
  };

  bool reserve(std::uint32_t boxes);
  float normalise(double x, int axis) const;
  void sort_along_curve(std::span<const WorldBox> boxes);
  Box box_of_leaf(std::uint32_t leaf) const;
  void build_level(std::uint32_t begin, std::uint32_t children, std::uint32_t first_child, NodeKind kind);
  void build_tree();
  bool collect(std::span<const WorldBox> boxes);
  bool sort_pairs(std::size_t boxes);

  double origin_[3] = {}, scale_ = 0;  // of normalise()
  Buffer<float> ends_[6];  // of each box in the order of the curve: lo x y z, hi x y z, normalised
  Buffer<Key> keys_, scratch_;
  Buffer<Block> blocks_;
  Buffer<ObjectPair> found_, pairs_;
  Buffer<std::uint32_t> first_;  // of each box, where its pairs begin
};

}  // namespace tandem
