#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/gpu_scene.h"

namespace tandem {

struct GpuQueryOptions {
  QueryMode mode = QueryMode::exact;
  bool first_contact_only = false;  ///< one contact for each object pair that has any; which one is open

  /// Contacts come sorted by pair, face_a, face_b, triangle_a, triangle_b: the same bytes on every run, and
  /// the order of a contacts file where the pairs are sorted too. Within an instance itself face_a <= face_b
  /// then. Takes time for as many contacts as there is room for, not for those found. Else they come in no
  /// order.
  bool sorted = false;

  /// Walks the trees as mode exact does, counts block pairs and candidates, and decides none: no contacts.
  /// Tells what the walk takes of a query's time. The other modes do not know it.
  bool walk_only = false;

  /// Thread blocks, of 512 threads, that may look for contacts at a time; 0: as many as the GPU holds. Fewer
  /// leave multiprocessors to what runs beside the query, and let tools run that are slow where warps wait.
  std::uint32_t most_blocks = 0;
};

/// How much a query has room for, and how much one needs.
struct GpuQueryCapacity {
  std::uint32_t pairs = 0;
  std::uint64_t contacts = 0;
  std::uint64_t undecided = 0;  ///< candidates that float32 cannot decide
};

/// GPU memory that a query of these assets with room for so much holds at most: the bound of
/// GpuContactQuery::bytes(), where it was never given more blocks of trees. Instances cost it nothing.
inline std::size_t most_query_bytes(const GpuQueryCapacity& capacity, bool sorted,
                                    std::span<const GpuAsset> assets) {
  constexpr std::size_t kFixed = std::size_t{5} << 20;  // work that warps give to each other, and the report
  std::size_t blocks = assets.size();
  for (const GpuAsset& asset : assets)
    blocks += std::size_t{kNodesPerBlock} * (asset.tree.block_count - asset.tree.leaf_block_count);
  const std::size_t per_contact = sorted ? 20 + 29 : 20;
  return kFixed + 256 * assets.size() + 116 * blocks + 200 * std::size_t{capacity.pairs} +
         per_contact * capacity.contacts + 24 * capacity.undecided;
}

/// What became of a query. Lies in GPU memory, and in CPU memory once the stream has come so far.
struct GpuQueryReport {
  Status status;              ///< kOk, or what find_contacts() of ContactQuery names; then no contacts
  std::uint32_t complete;     ///< 0: something did not fit; contacts are missing, and `needed` says more
  std::uint64_t where;        ///< the instance or pair that is to blame for an error
  GpuQueryCapacity needed;    ///< at least; exactly, for what follows from things that did fit
  std::uint64_t contacts;     ///< stored
  std::uint64_t world_pairs;  ///< object pairs out of reach of float32, which take the slow way
  QueryCounters counters;
};

/// Finds every pair of triangles that meet, of many posed instances of few assets, on the GPU: the same set
/// of contacts as ContactQuery. Nothing of enqueue() waits for the GPU, allocates, or asks the CPU. Throws
/// nothing. Movable, not copyable. One query at a time: enqueue the next on the same stream, or after it;
/// several objects side by side.
class GpuContactQuery {
 public:
  GpuContactQuery();
  GpuContactQuery(GpuContactQuery&&) noexcept;
  GpuContactQuery& operator=(GpuContactQuery&&) noexcept;
  ~GpuContactQuery();  ///< waits for the device

  /// Names the assets that instances refer to, on the current device, after what `stream` holds; returns when
  /// that is done. What the trees point to must outlive the queries. Result: kOk, kOutOfRange (a tree of 2^29
  /// blocks or more), kOutOfGpuMemory, kOutOfMemory, or another that status_of() of gpu_status.h names:
  /// kNoGpu, kDriverTooOld, kGpuNotSupported, kCudaFailed.
  Status set_assets(std::span<const GpuAsset> assets, cudaStream_t stream);

  /// Makes room for at least so much, waiting for the device where it grows. `options`: those of the calls to
  /// come. Result: kOk, kOutOfRange (sorted contacts: 2^32 - 1 or more), kOutOfGpuMemory, kCudaFailed; after
  /// an error there is the room that there was, or none. Condition: set_assets().
  Status reserve(const GpuQueryCapacity& capacity, const GpuQueryOptions& options = {});

  /// Queues a query behind what `stream` holds; may be captured into a graph. The arrays must stay until it
  /// is done. A pair of an instance with itself asks for the contacts within it. Result: kOk, kOutOfRange
  /// (sorted, and reserved without), kCudaFailed, or, where CUDA loads a kernel at its first launch and the
  /// GPU is full, kOutOfGpuMemory; what the GPU finds wrong is in the report. Condition: set_assets() and
  /// reserve().
  Status enqueue(const GpuInstances& instances, const GpuPairs& pairs, const GpuQueryOptions& options,
                 cudaStream_t stream);

  /// enqueue(), waits, makes room where it was too small, and again until the query is complete: rarely more
  /// than twice, and in a steady state once. Result: that of the report or of a call that failed;
  /// kOutOfRange where pairs.capacity itself was too small.
  Status find_contacts(const GpuInstances& instances, const GpuPairs& pairs, const GpuQueryOptions& options,
                       cudaStream_t stream);

  /// In GPU memory: report().contacts of them. Condition: set_assets().
  const Contact* contacts() const;
  const GpuQueryReport* device_report() const;

  /// In CPU memory. Condition: the stream has come to the end of the query.
  const GpuQueryReport& report() const;

  GpuQueryCapacity capacity() const;
  std::size_t bytes() const;  ///< GPU memory held, at most most_query_bytes()
  cudaError_t cuda_error() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem
