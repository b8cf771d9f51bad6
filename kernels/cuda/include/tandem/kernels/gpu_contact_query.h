#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/gpu_scene.h"

namespace tandem {

struct GpuContactOptions {
  QueryMode mode = QueryMode::exact;
  /// The query reports one contact for each object pair that touches; which one is unspecified.
  bool first_contact_only = false;

  /// Contacts are sorted by pair, face_a, face_b, triangle_a, triangle_b: they are the same bytes on every
  /// run, in the order of a contacts file where the pairs are sorted too. In a pair of an instance with
  /// itself face_a <= face_b then. Sorting takes time for as many contacts as there is room for, not for
  /// those found. Without it their order is unspecified.
  bool sorted = false;

  /// Contacts lie grouped by pair, and groups() tells where those of each pair lie. Their order within a pair
  /// is unspecified, unless they are sorted too. Grouping takes time for the contacts and pairs that there
  /// are, not for as many as there is room for.
  bool grouped = false;

  /// In exact mode, the query only walks the trees and counts block pairs and candidates; it finds no
  /// contacts. This measures what the walk takes of a query's time. The other modes ignore it.
  bool walk_only = false;

  /// The most thread blocks, of 512 threads, that look for contacts at a time; 0: as many as the GPU holds.
  /// Fewer leave multiprocessors to other work, and suit tools that are slow where warps wait.
  std::uint32_t most_blocks = 0;

  /// Clearance: triangles whose distance is at most this count as contacts, as ContactOptions::within says;
  /// pairs that may have some are found by GpuBroadPhaseOptions::within. From 0 to kLargestWorldCoordinate.
  double within = 0;

  /// Levels of detail: as ContactOptions::add_error_bounds says. Object pairs are found as without.
  bool add_error_bounds = false;

  /// Whether distances are asked for at all, which takes other kernels, and more memory.
  constexpr bool of_clearance() const { return within > 0 || add_error_bounds; }
};

/// How many of each a query has room for, or needs room for.
struct GpuContactCapacity {
  std::uint32_t pairs = 0;
  std::uint64_t contacts = 0;
  std::uint64_t undecided = 0;  ///< candidates that float32 cannot decide; of clearance, not quickly
};

/// What exact decisions of clearance take of it at most.
inline constexpr std::size_t kMostWideBytes = std::size_t{2} << 20;

/// GPU memory that a query of so many assets with room for so much holds at most: the bound of
/// GpuContactQuery::bytes(), where it was never given more of them. options: those of all its calls.
/// Instances cost it nothing, nor does the size of the assets.
constexpr std::size_t most_query_bytes(const GpuContactCapacity& capacity, const GpuContactOptions& options,
                                       std::size_t assets) {
  constexpr std::size_t kFixed = std::size_t{9} << 20;  // work that warps give to each other, and the report
  const std::size_t per_contact = options.sorted ? 20 + 29 : options.grouped ? 20 + 20 : 20;
  const std::size_t per_pair = (options.grouped ? 168 + 17 : 168) + (options.of_clearance() ? 12 : 0);
  const std::size_t wide = options.of_clearance() ? kMostWideBytes : 0;
  return kFixed + wide + sizeof(GpuAsset) * assets + per_pair * capacity.pairs +
         per_contact * capacity.contacts + 12 * capacity.undecided;
}

/// A pair with no more contacts than these has few of them, see GpuContactGroups.
inline constexpr std::uint32_t kFewContacts = 64;

struct GpuGroupCounts {
  std::uint32_t pairs;      ///< all of the query, those without contacts too
  std::uint32_t contacts;   ///< as many as the report says are stored
  std::uint32_t few, many;  ///< pairs with few contacts, and with more
};

/// Where grouped contacts lie; arrays in GPU memory, valid behind the query. Where not all contacts had room,
/// they tell of those that are stored; after an error no pair has any.
struct GpuContactGroups {
  const Contact* contacts;
  const std::uint32_t*
      first_contact;                ///< pairs + 1: pair p has contacts first_contact[p], up to that of p + 1
  const std::uint32_t *few, *many;  ///< the pairs with 1 to kFewContacts contacts and with more, ascending
  const GpuGroupCounts* counts;     ///< one, in GPU memory
};

/// The outcome of a query. It lies in GPU memory, and in CPU memory once the stream has come to the query's
/// end.
struct GpuContactReport {
  Status status;              ///< kOk, or what find_contacts() of ContactQuery names; then no contacts
  std::uint32_t complete;     ///< 0 where something did not fit: contacts are missing then, see `needed`
  std::uint64_t where;        ///< the instance or pair that caused an error
  GpuContactCapacity needed;  ///< a lower bound; exact for what follows from things that did fit
  std::uint64_t contacts;     ///< how many are stored
  std::uint64_t world_pairs;  ///< object pairs beyond float32, which are walked by world boxes, slowly
  ContactCounters counters;
};

/// Finds every pair of triangles that meet, of many posed instances of few assets, on the GPU: the same set
/// of contacts as ContactQuery. enqueue() neither waits for the GPU nor allocates. Throws nothing. Movable,
/// not copyable. An object runs one query at a time: enqueue the next on the same stream, or when the last
/// has ended. Several objects can run side by side.
class GpuContactQuery {
 public:
  GpuContactQuery();
  GpuContactQuery(GpuContactQuery&&) noexcept;
  GpuContactQuery& operator=(GpuContactQuery&&) noexcept;
  ~GpuContactQuery();  ///< waits for the device

  /// Names the assets that instances refer to, on the current device, after what `stream` holds: copies the
  /// list, and returns when that is done. What the trees point to must outlive the queries. Result: kOk,
  /// kOutOfRange (a tree of 2^29 - 1 blocks or more), kOutOfGpuMemory, kOutOfMemory, or another that
  /// status_of() of gpu_status.h names: kNoGpu, kDriverTooOld, kGpuNotSupported, kCudaFailed.
  Status set_assets(std::span<const GpuAsset> assets, cudaStream_t stream);

  /// Makes room for at least so much, waiting for the device where it grows. `options`: those of the calls to
  /// come; of `within` and add_error_bounds counts whether they are of clearance. Result: kOk, kOutOfRange
  /// (sorted or grouped: 2^32 - 1 contacts or more; grouped: 2^31 pairs or more), kOutOfGpuMemory,
  /// kCudaFailed; after an error there is the room that there was, or none. Condition: set_assets().
  Status reserve(const GpuContactCapacity& capacity, const GpuContactOptions& options = {});

  /// Queues a query behind what `stream` holds; it may be captured into a graph. The arrays must stay until
  /// it is done. A pair of an instance with itself asks for the contacts within it. Mode exact walks oriented
  /// blocks, the others axis-aligned ones. Result: kOk, kNoOrientedBlocks or kNoAxisAlignedBlocks (an asset
  /// lacks them), kOutOfRange (sorted, grouped or of clearance, and reserved without; a distance that is
  /// none), kCudaFailed, or, where CUDA loads a kernel at its first launch and the GPU is full,
  /// kOutOfGpuMemory; what the GPU finds wrong is in the report. Condition: set_assets() and reserve().
  Status enqueue(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactOptions& options,
                 cudaStream_t stream);

  /// Enqueues a query and waits for it; where room was too small, makes room and starts again until the query
  /// is complete: rarely more than twice, and in a steady state once. Result: that of the report, or of a
  /// call that failed; kOutOfRange where pairs.capacity itself was too small.
  Status find_contacts(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactOptions& options,
                       cudaStream_t stream);

  /// In GPU memory: report().contacts of them. Condition: set_assets().
  const Contact* contacts() const;
  const GpuContactReport* device_report() const;

  /// Condition: set_assets(), and reserve() for grouped contacts; valid until the next reserve().
  GpuContactGroups groups() const;

  /// Of each pair whether it has a contact, not 0 where it has, in GPU memory; valid behind a query with
  /// first_contact_only whose report is kOk and complete. Condition: reserve().
  const std::uint32_t* met() const;

  /// In CPU memory. Condition: the stream has come to the end of the query.
  const GpuContactReport& report() const;

  GpuContactCapacity capacity() const;
  std::size_t bytes() const;  ///< GPU memory held, at most most_query_bytes()
  cudaError_t cuda_error() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem
