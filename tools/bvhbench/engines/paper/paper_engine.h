#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/kernels/gpu_contact_query.h"

namespace tandem::bench {

/// Says how the two flag arrays of a level are stored.
enum class PaperFlags : std::uint8_t {
  words,  ///< 32 bits a flag, as the paper's
  bits,   ///< 1 bit, and a prefix sum over the 32 flags of a warp rather than over single ones: the paper's
          ///< open end
};

struct PaperOptions {
  QueryMode mode = QueryMode::exact;
  PaperFlags flags = PaperFlags::words;
};

/// Counts what a query did, and says how long it took on the GPU, waits for the CPU included.
struct PaperReport {
  std::uint64_t where = 0;  ///< the instance or pair that is to blame for an error
  ContactCounters counters;
  std::uint32_t levels = 0;
  std::uint64_t largest_level = 0;  ///< block pairs
  float preparation_ms = 0;         ///< checks, relative poses, the first level
  float traversal_ms = 0;           ///< all levels
  float triangle_ms = 0;            ///< triangle tests
};

/// The scheme of Damkjaer and Erleben 2009, kept as the yardstick for GpuContactQuery: tandem traversal level
/// by level; 16 threads a block pair, which share the fetch of both blocks; a collision flag and a leaf flag
/// for each thread; prefix sums over the flags; collection of the next level's pairs and of the candidates;
/// counts read by the CPU after each level; the triangle test once, over all candidates, a thread each.
/// Exact as ContactQuery is, by the same cascade of triangle tests. Movable, not copyable; throws nothing.
class PaperEngine {
 public:
  PaperEngine();
  PaperEngine(PaperEngine&&) noexcept;
  PaperEngine& operator=(PaperEngine&&) noexcept;
  ~PaperEngine();

  /// Names the assets that instances refer to, on the current device. What the trees point to must outlive
  /// the queries. Result: kOk, kNoAxisAlignedBlocks, kOutOfMemory, or one that status_of() of gpu_status.h
  /// names.
  Status set_assets(std::span<const GpuAsset> assets, cudaStream_t stream);

  /// Waits for the stream, once for each level of the trees and twice more. Keeps its memory from call to
  /// call: in a steady state nothing is allocated. Result: kOk; what a scene or ContactQuery names;
  /// kOutOfRange of a pair out of reach of float32 too, and where pairs.capacity is too small;
  /// kOutOfGpuMemory of a level beyond 2^28 - 1 block pairs too; kCudaFailed. After an error there are no
  /// contacts. Condition: set_assets() went well.
  Status find_contacts(const GpuInstances& instances, const GpuPairs& pairs, const PaperOptions& options,
                       cudaStream_t stream);

  /// Returns report().counters.contacts contacts, in GPU memory, in no order.
  const Contact* contacts() const;
  const PaperReport& report() const;
  std::size_t bytes() const;  ///< GPU memory held, the assets' own excepted
  cudaError_t cuda_error() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem::bench
