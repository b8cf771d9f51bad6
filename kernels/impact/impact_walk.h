#pragma once
#include "kernels/impact/box_times.h"
#include "kernels/impact/step_parts.h"
#include "kernels/impact/turn_shells.h"
#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/impact_query.h"

namespace tandem::impact {

/// The triangles that stop a pair, and when.
struct PairStop {
  double time;  ///< a part of the step; 1: nothing does
  std::uint32_t triangle_a = kNoIndex, triangle_b = kNoIndex;
};

/// A depth-first walk of two trees through a piece of the step at a time, the nodes that may meet soonest
/// first. When it has taken long enough to look at a part of all triangles, it looks at all of them once, for
/// the shells that nodes turn in. It is large, so keep it from call to call.
class ImpactWalk {
 public:
  /// Finds until when two trees stay apart. tolerance: in units of length. Adds to the counters.
  PairStop find_stop(const PairMotion& pair, const LevelView& a, const LevelView& b, double tolerance,
                     ImpactCounters& counters);

 private:
  /// Each pair that is taken off puts at most 16 on, whose depths and halvings add up to 1 more at least:
  /// from 2 to 2 kMaxDepth + kHalvings.
  static constexpr std::uint32_t kStackSize = 16 * (2 * kMaxDepth + kHalvings - 2) + 1;

  /// A block pair whose nodes in the mask may meet, in a part of the piece, but not before `apart`.
  struct WaitingPair {
    std::uint32_t a, b, mask, part;
    double apart;
  };
  class SortedPairs;

  /// The places of the bodies when a part of the piece begins.
  struct Part {
    std::uint64_t piece = 0;  ///< that it is of, in the order of all
    Span time;
    PairPlace place;
    PairFrames frames;
  };

  const Part& part(std::uint32_t number);
  void walk();
  void find_shells();
  bool make_shells(const MovingBody& body, const LevelView& tree, const Vector3& centre, double from_a,
                   Buffer<Shell>& out) const;
  std::uint32_t without_apart(const WaitingPair& pair) const;
  void visit(const WaitingPair& pair);
  void descend(const WaitingPair& pair, const NodeTimes& times, double begin);
  void advance_leaves(const WaitingPair& pair, const NodeTimes& times, const Part& part);
  void advance_pair(const WaitingPair& leaf, const Part& part);
  void push(const WaitingPair& pair) { stack_[height_++] = pair; }

  const PairMotion* pair_ = nullptr;
  const LevelView *a_ = nullptr, *b_ = nullptr;
  ImpactCounters* counters_ = nullptr;
  double tolerance_ = 0, acceleration_ = 0;

  std::uint64_t shells_at_ = 0;  // so much work of all pairs
  bool has_shells_ = false;
  ShellAxes axes_;
  ShellGaps gaps_;                     // in the piece
  Buffer<Shell> shells_a_, shells_b_;  // of all nodes

  std::uint64_t piece_ = 0;
  Span span_ = {0, 0};  // of the piece
  PairStop stop_ = {1};
  bool converged_ = true;

  std::uint32_t height_ = 0;
  WaitingPair stack_[kStackSize];
  Part parts_[kPartNumbers];
};

}  // namespace tandem::impact
