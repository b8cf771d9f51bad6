#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/kernels/contact_query.h"

namespace tandem {

/// What is certain of the finest surfaces of an object pair.
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
  /// What need not be told apart from touching, in units of length. With 0 all pairs are decided. From 0 to
  /// kLargestWorldCoordinate, else kOutOfRange.
  double tolerance = 0;
  std::uint32_t threads = 1;  ///< with the caller's, kMostQueryThreads at most; results don't depend on it
  /// Where the query finds the pairs: those that it looks at; null: all. It must stay as long as the call.
  const PairFilter* filter = nullptr;
};

/// What a query did. The counters depend neither on the number of threads nor on the machine.
struct ToleranceCounters {
  std::uint64_t apart = 0, touching = 0, within_tolerance = 0;  ///< object pairs
  ContactCounters work;                                         ///< of the contact query at these levels

  friend bool operator==(const ToleranceCounters&, const ToleranceCounters&) = default;
};

/// Tells of pairs of bodies with levels of detail whether they surely do not meet, surely meet, or are within
/// a tolerance, on the CPU. Each body is looked at at the coarsest level that tells what is within the
/// tolerance; a pair whose bodies have none such but the finest is decided exactly. Keeps its memory from
/// call to call. Throws nothing. Movable, not copyable; one call at a time, several objects side by side.
class ToleranceQuery {
 public:
  ToleranceQuery();
  ToleranceQuery(ToleranceQuery&&) noexcept;
  ToleranceQuery& operator=(ToleranceQuery&&) noexcept;
  ~ToleranceQuery();

  /// Names the assets that instances refer to, with the levels that each view shows; what the views point to
  /// must outlive the queries. Result: kOk; kUnknownAsset, where a view points to nothing; kNoFinestLevel,
  /// where it does not show the file's level 0; where() is its place in the list; or kOutOfMemory. After an
  /// error there are no assets.
  Status set_assets(std::span<const AssetView> assets);

  /// Finds the object pairs whose world boxes overlap, and the verdicts on them; bodies that are not found as
  /// a pair do not meet. Result: as of find_contacts() of ContactQuery. After an error there are no pairs and
  /// no verdicts.
  Status decide(std::span<const Instance> instances, const ToleranceOptions& options = {});

  /// Finds the verdicts on the given object pairs, in either order of a and b; an instance touches itself.
  /// The filter is not asked. Result: as above, or kUnknownInstance: where() is the pair.
  Status decide(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
                const ToleranceOptions& options);

  /// The object pairs of the last call: a < b, sorted, where the query found them; as given else.
  std::span<const ObjectPair> pairs() const;

  /// One for each pair. Valid until the next call.
  std::span<const PairVerdict> verdicts() const;

  const ToleranceCounters& counters() const;

  /// The asset, instance or pair that is to blame for an error.
  std::uint64_t where() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem
