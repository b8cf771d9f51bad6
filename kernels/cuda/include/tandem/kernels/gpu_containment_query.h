#pragma once
#include <cstddef>
#include <cstdint>

#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/gpu_contact_query.h"

namespace tandem {

/// The number of each that there is room for, or that needs room.
struct GpuContainmentCapacity {
  std::uint32_t pairs = 0;      ///< object pairs of the query
  std::uint32_t contained = 0;  ///< components that lie within the other body
};

/// GPU memory that an object with room for so much holds at most. triangles: of all assets that have more
/// than one component, together.
constexpr std::size_t most_containment_bytes(const GpuContainmentCapacity& capacity, std::size_t assets,
                                             std::size_t triangles) {
  constexpr std::size_t kFixed = 4096;
  return kFixed + 128 * assets + 4 * triangles + 5 * std::size_t{capacity.pairs} +
         36 * std::size_t{capacity.contained};
}

/// The outcome of a call.
struct GpuContainmentReport {
  Status status;           ///< that of the contact query
  std::uint32_t complete;  ///< 0 where something did not fit, or the contact query was not complete; then
                           ///< nothing is contained
  GpuContainmentCapacity needed;  ///< `contained` is exact where there was room for all pairs
  std::uint32_t contained;
};

extern template class GpuQuestion<GpuContainmentCapacity, GpuContainmentReport>;
extern template class GpuAssetQuestion<GpuContainmentCapacity, GpuContainmentReport>;

/// Finds what lies within another body of an object pair without touching it, on the GPU: what
/// ContainmentQuery finds, in its order. See GpuQuestion; instances and pairs are those of a contact query in
/// mode exact.
///
/// Assets, the list given to the contact query, need topology, which set_assets() takes back to the CPU once
/// for those with more than one component. bytes() is at most most_containment_bytes().
class GpuContainmentQuery : public GpuAssetQuestion<GpuContainmentCapacity, GpuContainmentReport> {
 public:
  /// Queues the search behind what `stream` holds, the contact query among it. That groups its contacts;
  /// where no body has two components, the first contact of each pair will do. Condition: set_assets() and
  /// reserve().
  Status enqueue(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactQuery& query,
                 cudaStream_t stream);

  /// Searches behind a contact query that has ended, and waits for it. Result: also kOutOfRange where that
  /// query is not complete.
  Status find(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactQuery& query,
              cudaStream_t stream);

  const Containment* contained() const;  ///< report().contained of them
};

}  // namespace tandem
