#pragma once
#include <cstddef>
#include <cstdint>

#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/gpu_question.h"

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

  /// The most thread blocks, of 512 threads, that look for contacts at a time; 0: as many as the GPU holds.
  /// Fewer leave multiprocessors to other work, and suit tools that are slow where warps wait.
  std::uint32_t most_blocks = 0;

  /// Clearance: triangles whose distance is at most this count as contacts, as ContactOptions::within says;
  /// pairs that may have some are found by GpuBroadPhaseOptions::within. From 0 to kLargestWorldCoordinate.
  double within = 0;

  /// Levels of detail: as ContactOptions::add_error_bounds says. Object pairs are found as without.
  bool add_error_bounds = false;

  /// Rings of neighbours that are left out of pairs of an instance with itself, as
  /// ContactOptions::leave_out_rings says.
  std::uint32_t leave_out_rings = 0;

  /// Returns whether distances are asked for at all, which takes other kernels, and more memory.
  constexpr bool of_clearance() const { return within > 0 || add_error_bounds; }
};

/// The number of each that a query has room for, or needs room for.
struct GpuContactCapacity {
  std::uint32_t pairs = 0;
  std::uint64_t contacts = 0;
  std::uint64_t undecided = 0;  ///< candidates that float32 cannot decide; of clearance, not quickly
};

/// The most GPU memory that exact decisions of clearance take, in bytes.
inline constexpr std::size_t kMostWideBytes = std::size_t{2} << 20;

/// GPU memory that a query of so many assets with room for so much holds at most: the bound of
/// GpuContactQuery::bytes(), where it was never given more of them. options: those of all its calls.
/// Instances cost it nothing, nor does the size of the assets, unless neighbours are left out: then 24 bytes
/// for each asset and the lists that ContactOptions::leave_out_rings speaks of come on top.
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

/// Arrays in GPU memory that say where the contacts of each pair lie. They are valid behind the query. If not
/// all contacts had room, they are about those that are stored; after an error no pair has any.
struct GpuContactGroups {
  const Contact* contacts;
  const std::uint32_t*
      first_contact;                ///< pairs + 1: pair p has contacts first_contact[p], up to that of p + 1
  const std::uint32_t *few, *many;  ///< the pairs with 1 to kFewContacts contacts and with more, ascending
  const GpuGroupCounts* counts;     ///< one, in GPU memory
};

/// The outcome of a query.
struct GpuContactReport {
  Status status;              ///< kOk, or what a scene or ContactQuery names; then no contacts
  std::uint32_t complete;     ///< 0 where something did not fit: contacts are missing then, see `needed`
  std::uint64_t where;        ///< the instance, pair or asset that caused an error
  GpuContactCapacity needed;  ///< a lower bound; exact for what follows from things that did fit
  std::uint64_t contacts;     ///< how many are stored
  std::uint64_t world_pairs;  ///< object pairs beyond float32, which are walked by world boxes, slowly
  ContactCounters counters;
};

extern template class GpuQuestion<GpuContactCapacity, GpuContactReport, GpuContactOptions>;
extern template class GpuAssetQuestion<GpuContactCapacity, GpuContactReport, GpuContactOptions>;

/// Finds every pair of triangles that meet, of many posed instances of few assets, on the GPU: the same set
/// of contacts as ContactQuery. See GpuQuestion.
///
/// set_assets() also returns kOutOfRange for a tree of 2^29 - 1 blocks or more. reserve() makes room for
/// clearance where `within` or add_error_bounds is set, and the lists of neighbours for leave_out_rings: the
/// CPU makes them, of all assets, where the last call was for another number; it also returns kOutOfRange
/// (sorted or grouped: 2^32 - 1 contacts or more; grouped: 2^31 pairs or more). bytes() is at most
/// most_query_bytes().
class GpuContactQuery : public GpuAssetQuestion<GpuContactCapacity, GpuContactReport, GpuContactOptions> {
 public:
  /// Queues a query behind what `stream` holds. A pair of an instance with itself asks for the contacts
  /// within it. Mode exact walks oriented blocks, the others axis-aligned ones. Result: also
  /// kNoOrientedBlocks or kNoAxisAlignedBlocks (an asset lacks them), kOutOfRange (sorted, grouped, of
  /// clearance or leaving out rings, and reserved without), kBadReach (`within`), kBadOption
  /// (leave_out_rings). The report also names kNoTopology, where `where` is an asset that has none on
  /// the GPU and whose neighbours are to be left out. Condition:
  /// set_assets() and reserve().
  Status enqueue(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactOptions& options,
                 cudaStream_t stream);

  /// Finds all contacts, and waits for them: rarely more than two turns.
  Status find_contacts(const GpuInstances& instances, const GpuPairs& pairs, const GpuContactOptions& options,
                       cudaStream_t stream);

  const Contact* contacts() const;  ///< report().contacts of them. Condition: set_assets()

  /// Condition: set_assets(), and reserve() for grouped contacts.
  GpuContactGroups groups() const;

  /// Returns a number for each pair, not 0 where the pair has a contact. It is valid behind a query with
  /// first_contact_only whose report is kOk and complete. Condition: reserve().
  const std::uint32_t* met() const;

 private:
  friend void only_walk(GpuContactQuery& query, bool only);  // for measuring: kernels/contact/only_walk.h
};

}  // namespace tandem
