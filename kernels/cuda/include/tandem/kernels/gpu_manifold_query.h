#pragma once
#include <cstddef>
#include <cstdint>

#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/kernels/gpu_moved_query.h"
#include "tandem/kernels/manifold_query.h"

namespace tandem {

/// The number of each that there is room for, or that needs room.
struct GpuManifoldCapacity {
  std::uint32_t pairs = 0;      ///< object pairs of the query
  std::uint64_t contacts = 0;   ///< of the query
  std::uint32_t manifolds = 0;  ///< and holes in them
  std::uint32_t points = 0;
};

/// Returns the bytes of GPU memory that an object with room for so much, of so many assets, holds at most.
std::size_t most_manifold_bytes(const GpuManifoldCapacity& capacity, std::size_t assets);

/// The outcome of a call.
struct GpuManifoldReport {
  Status status;           ///< that of the query, kOk or an error; kOutOfRange: a pair of 2^27 contacts; or
                           ///< kKeptMismatch: see ManifoldQuery
  std::uint32_t complete;  ///< 0 where something did not fit, or the query was not complete: then there are
                           ///< no manifolds
  GpuManifoldCapacity
      needed;  ///< where the query is complete; more points than needed, if manifolds did not fit
  std::uint32_t manifolds, points;
  ManifoldCounters counters;
};

extern template class GpuQuestion<GpuManifoldCapacity, GpuManifoldReport>;
extern template class GpuAssetQuestion<GpuManifoldCapacity, GpuManifoldReport>;

/// Makes contact manifolds of the contacts that a GpuContactQuery found, on the GPU: the same bytes as
/// ManifoldQuery makes of them. See GpuQuestion; instances and pairs are those of the contact query.
///
/// Assets, the list given to the contact query, need topology; set_assets() forgets the last call. reserve()
/// keeps what the last call found for the next one to match; it also returns kOutOfRange (contacts or points:
/// 2^31 or more). bytes() is at most most_manifold_bytes().
class GpuManifoldQuery : public GpuAssetQuestion<GpuManifoldCapacity, GpuManifoldReport> {
 public:
  /// Queues the making of manifolds behind what `stream` holds, the contact query among it, whose contacts
  /// are grouped. Result: also kBadOption (most_points). Condition: set_assets() and reserve().
  Status enqueue(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactQuery& query,
                 const ManifoldOptions& options, cudaStream_t stream);

  /// Makes manifolds of a contact query that has ended, and waits for them. Result: also kOutOfRange where
  /// that query is not complete.
  Status make(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactQuery& query,
              const ManifoldOptions& options, cudaStream_t stream);

  /// Do the same where pairs are kept: `query` is about moved.moved, and rows are about moved.pairs, as those
  /// of ManifoldQuery. The last call is remembered whatever the options say.
  Status enqueue(const GpuInstances& instances, const GpuMoved& moved, const GpuContactQuery& query,
                 const ManifoldOptions& options, cudaStream_t stream);
  Status make(const GpuInstances& instances, const GpuMoved& moved, const GpuContactQuery& query,
              const ManifoldOptions& options, cudaStream_t stream);

  /// Return report().manifolds manifolds and report().points points. They are in the order of ManifoldQuery
  /// if the pairs are in its order.
  const Manifold* manifolds() const;
  const ManifoldPoint* points() const;

  /// Queues that the next call finds no points before it.
  Status forget_points(cudaStream_t stream);
};

}  // namespace tandem
