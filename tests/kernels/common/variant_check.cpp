// Whether every variant of the narrow phase that this machine has gives the same contacts, in the same order,
// with the same counters, on pairs of small trees at hostile scales and poses. Prints a hash of all of it,
// which is the same on every machine. Usage: variant_check [TRIALS]   Exit code: 0, or 1 where variants
// differ.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "kernels/contact/narrow_phase.h"
#include "kernels/geometry/grid_test.h"
#include "kernels/tolerance/sure_verdicts.h"

namespace tandem {
namespace {

using test::RandomPoses;
using test::Scale;

/// Integers, where everything ties.
constexpr Scale kGrid = {4, 2, 5, 0, 0};

/// A tree of up to 16 triangles: the root, and a leaf block below each of its nodes. on_grid: all its corners
/// are integers.
class SmallTree {
 public:
  SmallTree(RandomPoses& random, const Scale& scale, bool on_grid) : on_grid_(on_grid) {
    const std::uint64_t leaf_blocks = 1 + random.below(kNodesPerBlock);
    blocks_.resize(1 + leaf_blocks);
    double middle[3];
    for (double& x : middle) x = random.symmetric(scale.centre);
    for (std::uint32_t block = 1; block <= leaf_blocks; ++block) {
      const std::uint64_t leaves = block < leaf_blocks ? kNodesPerBlock : 1 + random.below(kNodesPerBlock);
      for (int node = 0; node < kNodesPerBlock; ++node) {
        if (static_cast<std::uint64_t>(node) < leaves)
          add_leaf(random, scale.size, middle, blocks_[block], node);
        else
          set_imaginary(blocks_[block], node);
      }
    }
    for (int node = 0; node < kNodesPerBlock; ++node) {
      const auto child = static_cast<std::uint32_t>(node + 1);
      if (child <= leaf_blocks)
        set_node(blocks_[0], node, enclose(blocks_[child]), child, NodeKind::internal);
      else
        set_imaginary(blocks_[0], node);
    }
  }

  PosedTree posed(const Pose& pose) const {
    LevelView tree{};
    tree.blocks = blocks_.data();
    tree.triangles = triangles_.data();
    tree.block_count = static_cast<std::uint32_t>(blocks_.size());
    tree.leaf_block_count = tree.block_count - 1;
    tree.triangle_count = static_cast<std::uint32_t>(triangles_.size());
    tree.depth = 2;
    const TreeExtent extent = tandem::extent_of(blocks_[0]);
    return {tree, extent, grid_of(tree, extent), pose};
  }

  /// A corner, for something to meet.
  const float* corner(RandomPoses& random) const {
    return triangles_[random.below(triangles_.size())].corner[random.below(3)].position;
  }

 private:
  /// A triangle anywhere, a flat one, or one in a plane across an axis, as large as the tree or much smaller.
  void add_leaf(RandomPoses& random, double size, const double (&middle)[3], Block& block, int node) {
    Triangle triangle{};
    Position lo, hi;
    const std::uint64_t kind = random.below(6), axis = random.below(3);
    const double reach = random.below(3) == 0 ? 0.01 * size : size;
    double at[3];
    for (int k = 0; k < 3; ++k) at[k] = middle[k] + random.symmetric(size);
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < 3; ++c) {
        const bool same = (kind == 0 && c == 2) || (kind == 1 && static_cast<std::uint64_t>(k) == axis);
        float& x = triangle.corner[c].position[k];
        x = same ? triangle.corner[0].position[k] : static_cast<float>(at[k] + random.symmetric(reach));
        if (same && c == 0) x = static_cast<float>(at[k]);
        if (on_grid_) x = std::round(x);
      }
      lo[k] = hi[k] = triangle.corner[0].position[k];
      for (int c = 1; c < 3; ++c) {
        lo[k] = std::min(lo[k], triangle.corner[c].position[k]);
        hi[k] = std::max(hi[k], triangle.corner[c].position[k]);
      }
    }
    const auto index = static_cast<std::uint32_t>(triangles_.size());
    triangle.corner[0].w = index;
    triangles_.push_back(triangle);
    set_node(block, node, enclose(lo, hi), index, NodeKind::leaf);
  }

  bool on_grid_;
  std::vector<Block> blocks_;
  std::vector<Triangle> triangles_;
};

struct Answer {
  std::vector<Contact> contacts;
  ContactCounters counters;
  friend bool operator==(const Answer&, const Answer&) = default;
};

bool grow(ContactSink& sink) {
  auto& contacts = *static_cast<std::vector<Contact>*>(sink.owner);
  const auto used = sink.next - contacts.data();
  contacts.resize(2 * contacts.size() + 1);
  sink.next = contacts.data() + used;
  sink.end = contacts.data() + contacts.size();
  return true;
}

Answer run(NarrowPhase way, const PairTask& task) {
  Answer answer;
  ContactSink sink;
  sink.owner = &answer.contacts;
  sink.grow = grow;
  static_cast<void>(way(task, sink));
  answer.contacts.resize(static_cast<std::size_t>(sink.next - answer.contacts.data()));
  answer.counters = sink.counters;
  return answer;
}

/// b stands so that a corner of it is near one of a, by the float64 numbers at hand.
Pose meeting_pose(RandomPoses& random, const Scale& scale, const Pose& a, const float* corner_a,
                  const float* corner_b) {
  Pose b = random.below(4) == 0 ? a : random.pose(scale);
  double from[3], to[3];
  apply(a, corner_a[0], corner_a[1], corner_a[2], to);
  for (double& x : b.translation) x = 0;
  apply(b, corner_b[0], corner_b[1], corner_b[2], from);
  const double beside = random.below(3) == 0 ? 0 : scale.size;
  for (int k = 0; k < 3; ++k) b.translation[k] = to[k] - from[k] + random.symmetric(beside);
  return b;
}

void round_translation(Pose& pose) {
  for (double& x : pose.translation) x = std::round(x);
}

class Check {
 public:
  void pair(RandomPoses& random) {
    const bool on_grid = random.below(4) == 0;
    const Scale scale = on_grid ? kGrid : test::any_scale(random);
    const SmallTree tree_a(random, scale, on_grid), tree_b(random, scale, on_grid);
    Pose pose_a = random.pose(scale);
    if (on_grid) round_translation(pose_a);
    const PosedTree a = tree_a.posed(pose_a);
    const bool self = random.below(8) == 0;
    const float* const corner_a = tree_a.corner(random);
    const float* const corner_b = tree_b.corner(random);
    Pose pose_b = meeting_pose(random, scale, a.pose, corner_a, corner_b);
    if (on_grid) round_translation(pose_b);
    const PosedTree b = tree_b.posed(pose_b);
    PairTask task = pair_task(a, self ? a : b);
    if (!task.in_frame) return;
    on_grid_ += task.on_grid;
    for (const QueryMode mode : {QueryMode::exact, QueryMode::fast, QueryMode::boxes}) {
      task.mode = mode;
      compare(task);
    }
  }

  bool finish() const {
    std::printf("%llu pairs, %llu contacts, hash %016llx, %llu comparisons\n",
                static_cast<unsigned long long>(pairs_), static_cast<unsigned long long>(contacts_),
                static_cast<unsigned long long>(hash_), static_cast<unsigned long long>(comparisons_));
    return differ_ == 0 && contacts_ > 0 && on_grid_ > 0;
  }

 private:
  void compare(const PairTask& task) {
    const Answer expected = run(narrow_phase(BlockPairVariant::scalar), task);
    add(expected);
    for (const BlockPairVariant variant : kBlockPairVariants) {
      const NarrowPhase way = narrow_phase(variant);
      if (way == nullptr || variant == BlockPairVariant::scalar) continue;
      ++comparisons_;
      if (run(way, task) == expected) continue;
      if (differ_++ == 0)
        std::printf("variant %d differs at pair %llu\n", static_cast<int>(variant),
                    static_cast<unsigned long long>(pairs_));
    }
  }

  void add(const Answer& answer) {
    ++pairs_;
    contacts_ += answer.contacts.size();
    for (const Contact& c : answer.contacts) {
      for (const std::uint32_t word : {c.triangle_a, c.triangle_b, c.face_a, c.face_b}) add(word);
    }
    const ContactCounters& counters = answer.counters;
    for (const std::uint64_t counted :
         {counters.block_pairs, counters.candidates, counters.decided_by_float32, counters.decided_by_float64,
          counters.decided_exactly})
      add(counted);
  }
  void add(std::uint64_t word) { hash_ = (hash_ ^ word) * 0x100000001B3u; }

  std::uint64_t pairs_ = 0, contacts_ = 0, comparisons_ = 0, differ_ = 0, on_grid_ = 0;
  std::uint64_t hash_ = 0xCBF29CE484222325u;
};

}  // namespace
}  // namespace tandem

int main(int argc, char** argv) {
  tandem::test::RandomPoses random(1);
  tandem::Check check;
  const int trials = argc > 1 ? std::atoi(argv[1]) : 4000;
  for (int i = 0; i < trials; ++i) check.pair(random);
  return check.finish() ? 0 : 1;
}
