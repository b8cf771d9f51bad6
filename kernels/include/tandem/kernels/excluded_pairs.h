#pragma once
#include <span>

#include "tandem/formats/block.h"
#include "tandem/formats/status.h"
#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/object_pair.h"
#include "tandem/kernels/pair_filter.h"

namespace tandem {

/// Owns a table of pairs of instances that a broad phase is not to look at, such as those that a joint
/// connects. Throws nothing.
class ExcludedPairTable {
 public:
  /// Takes these pairs instead of those before: in any order of each and of all, each as often as wanted, an
  /// instance with itself too. Result: kOk; kOutOfMemory; kUnknownInstance where a pair names instance
  /// 2^32 - 1, which there cannot be. After an error no pair is excluded. A query asks whether there are the
  /// instances.
  Status set(std::span<const ObjectPair> pairs);

  /// Valid until the next set().
  const ExcludedPairs& view() const { return view_; }

  /// The table: what view().slots points to.
  std::span<const std::uint64_t> slots() const { return slots_.view(); }

 private:
  Buffer<std::uint64_t> slots_;
  ExcludedPairs view_;
};

}  // namespace tandem
