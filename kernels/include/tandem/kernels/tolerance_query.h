#pragma once
#include <cstdint>
#include <span>

#include "tandem/kernels/contact_query.h"

namespace tandem {

/// Says what is certain about the finest surfaces of an object pair.
enum class ToleranceVerdict : std::uint8_t {
  apart,             ///< they do not meet
  touching,          ///< they meet
  within_tolerance,  ///< they are at most the tolerance apart; whether they meet was not asked
};

/// The verdict on an object pair, and the levels of its bodies that it was asked of.
struct PairVerdict {
  ToleranceVerdict verdict;
  std::uint8_t level_a, level_b;

  friend bool operator==(const PairVerdict&, const PairVerdict&) = default;
};

struct ToleranceOptions {
  /// The distance that need not be told apart from touching, in units of length. With 0 all pairs are
  /// decided. From 0 to kLargestWorldCoordinate, else kBadTolerance.
  double tolerance = 0;
};

/// Counts what a query did. The counters depend neither on the number of threads nor on the machine.
struct ToleranceCounters {
  std::uint64_t apart = 0, touching = 0, within_tolerance = 0;  ///< object pairs
  ContactCounters work;                                         ///< of the contact query at these levels

  friend bool operator==(const ToleranceCounters&, const ToleranceCounters&) = default;
};

/// Tells of pairs of bodies with levels of detail whether they surely do not meet, surely meet, or are within
/// a tolerance. The query looks at each body at the coarsest level that tells what is within the tolerance; a
/// pair whose bodies have none such but the finest is decided exactly. There is one row for each pair; bodies
/// that the scene does not find as a pair do not meet, and an instance touches itself. Result of find(): as
/// of ContactQuery; kNoFinestLevel, where where() of the scene is the asset, where a view does not show the
/// file's level 0.
class ToleranceQuery : public PairQuestion<ToleranceQuery, PairVerdict, ToleranceCounters, ToleranceOptions> {
 private:
  friend PairQuestion;
  struct State;
  Status answer(SceneState& scene, const std::span<const ObjectPair>* given, const ToleranceOptions& options);

  Kept<State> state_;
};

}  // namespace tandem
