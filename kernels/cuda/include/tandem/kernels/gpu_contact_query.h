#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <span>

#include "tandem/formats/view.h"
#include "tandem/kernels/broad_phase.h"
#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/pose.h"

namespace tandem {

/// An asset as a query on the GPU sees it; owns nothing.
struct GpuAsset {
  LevelView tree;  ///< pointers into GPU memory, as DeviceAsset::level() gives them
  double origin[3];
  float lower[3], upper[3];
};

/// The asset whose level `tree` lies in GPU memory and whose header lies in CPU memory.
inline GpuAsset gpu_asset(const LevelView& tree, const FileHeader& header) {
  GpuAsset asset = {tree, {}, {}, {}};
  for (int k = 0; k < 3; ++k) {
    asset.origin[k] = header.origin[k];
    asset.lower[k] = header.lower[k];
    asset.upper[k] = header.upper[k];
  }
  return asset;
}

/// Instances as arrays in GPU memory, which a simulation may write there. Poses speak of the file's
/// coordinates.
struct GpuInstances {
  const std::uint32_t* asset;  ///< by place in the list given to set_assets()
  const Pose* pose;
  std::uint32_t count;
};

/// Object pairs in GPU memory, their number too: what a broad phase on the GPU leaves there.
struct GpuPairs {
  const ObjectPair* pairs;
  const std::uint32_t* count;  ///< in GPU memory
  std::uint32_t capacity;      ///< room in `pairs`; where *count is more, the query is not complete
};

struct GpuQueryOptions {
  QueryMode mode = QueryMode::exact;
  bool first_contact_only = false;  ///< one contact for each object pair that has any; which one is open
};

/// How much a query has room for, and how much one needs.
struct GpuQueryCapacity {
  std::uint32_t pairs = 0;      ///< 168 bytes each
  std::uint64_t contacts = 0;   ///< 20 bytes each
  std::uint64_t undecided = 0;  ///< candidates that float32 cannot decide; 24 bytes each
};

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
  GpuContactQuery() = default;
  GpuContactQuery(GpuContactQuery&& other) noexcept { *this = static_cast<GpuContactQuery&&>(other); }
  GpuContactQuery& operator=(GpuContactQuery&& other) noexcept;
  ~GpuContactQuery() { free(); }

  /// Names the assets that instances refer to, on the current device, after what `stream` holds; returns when
  /// that is done. What the trees point to must outlive the queries. Result: kOk, kOutOfMemory, kOutOfRange
  /// (a tree of 2^29 blocks or more), kCudaFailed.
  Status set_assets(std::span<const GpuAsset> assets, cudaStream_t stream);

  /// Makes room for at least so much, waiting for the device where it grows. Result: kOk, kOutOfMemory,
  /// kCudaFailed; after an error there is the room that there was, or none. Condition: set_assets().
  Status reserve(const GpuQueryCapacity& capacity);

  /// Queues a query behind what `stream` holds; may be captured into a graph. The arrays must stay until it
  /// is done. A pair of an instance with itself asks for the contacts within it. Result: kOk or kCudaFailed;
  /// what the GPU finds wrong is in the report. Condition: set_assets() and reserve().
  Status enqueue(const GpuInstances& instances, const GpuPairs& pairs, const GpuQueryOptions& options,
                 cudaStream_t stream);

  /// enqueue(), waits, makes room where it was too small, and again until the query is complete: rarely more
  /// than twice, and in a steady state once. Result: that of the report or of a call that failed;
  /// kOutOfRange where pairs.capacity itself was too small.
  Status find_contacts(const GpuInstances& instances, const GpuPairs& pairs, const GpuQueryOptions& options,
                       cudaStream_t stream);

  /// In GPU memory: report().contacts of them, in no order.
  const Contact* contacts() const { return contacts_; }
  const GpuQueryReport* device_report() const;

  /// In CPU memory. Condition: the stream has come to the end of the query.
  const GpuQueryReport& report() const { return *host_report_; }

  const GpuQueryCapacity& capacity() const { return capacity_; }
  std::size_t bytes() const;  ///< GPU memory held
  cudaError_t cuda_error() const { return error_; }

 private:
  void free();
  void free_room();
  Status fail(cudaError_t error);
  template <typename Element>
  Status allocate(Element*& out, std::size_t count);
  Status provide_fixed_memory();

  void* assets_ = nullptr;
  std::uint32_t asset_count_ = 0, asset_room_ = 0, depth_ = 1;
  void* state_ = nullptr;
  void* chunks_ = nullptr;
  void* pairs_ = nullptr;
  std::uint32_t* world_pairs_ = nullptr;
  std::uint32_t* met_ = nullptr;
  Contact* contacts_ = nullptr;
  void* undecided_ = nullptr;
  GpuQueryReport* host_report_ = nullptr;
  GpuQueryCapacity capacity_;
  cudaError_t error_ = cudaSuccess;
};

}  // namespace tandem
