#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/formats/view.h"
#include "tandem/kernels/broad_phase.h"
#include "tandem/kernels/pose.h"

namespace tandem {

/// Where an asset stands. The asset is known by its place in the list given to set_assets(); the pose applies
/// to the file's coordinates.
struct Instance {
  std::uint32_t asset;
  Pose pose;
};

/// What a query decides on.
enum class QueryMode : std::uint8_t {
  exact,  ///< contact pairs, as exact arithmetic on the posed vertices finds them
  fast,   ///< contact pairs by float32 in the first instance's frame, which may err where rounding does
  boxes,  ///< candidates: triangles whose boxes overlap; all that touch are among them, and many that do not
};

/// Two triangles that meet: triangle_a belongs to instance pairs()[pair].a, triangle_b to pairs()[pair].b.
struct Contact {
  std::uint32_t pair;
  std::uint32_t triangle_a, triangle_b;  ///< in leaf order: LevelView::triangles[triangle_a]
  std::uint32_t face_a, face_b;          ///< the faces of the source files that they come from

  friend bool operator==(const Contact&, const Contact&) = default;
};

inline constexpr std::uint32_t kMostQueryThreads = 1024;

struct ContactOptions {
  QueryMode mode = QueryMode::exact;
  bool first_contact_only = false;  ///< the query reports one contact for each object pair that touches
  bool self_pairs = false;          ///< where the query finds the pairs: also each instance with itself
  std::uint32_t threads = 1;  ///< with the caller's, kMostQueryThreads at most; results don't depend on it
  /// Where the query finds the pairs: those that it looks at; null: all. It must stay as long as the call.
  const PairFilter* filter = nullptr;
  /// Clearance: triangles whose distance is at most this count as contacts, decided exactly, in mode fast
  /// too; candidates are triangles whose boxes are within it. 0: those that meet. From 0 to
  /// kLargestWorldCoordinate, else kOutOfRange.
  double within = 0;
  /// Levels of detail: each object pair is asked for a clearance that is larger by what its two levels may
  /// differ from the finest ones (docs/levels.md). The finest surfaces of a pair without a contact, and of
  /// two instances that are not found as a pair, are then surely farther apart than `within`, or with 0 do
  /// not meet. Mode fast decides exactly then, too. Pairs of finest levels, and pairs of an instance with
  /// itself, are decided as without.
  bool add_error_bounds = false;
};

/// What a query did. The counters depend neither on the number of threads nor on the machine.
struct ContactCounters {
  std::uint64_t object_pairs = 0;
  std::uint64_t block_pairs = 0;  ///< 16 box tests each
  std::uint64_t candidates = 0;   ///< except in boxes mode, without those that planes of leaves tell apart
  std::uint64_t decided_by_float32 = 0;  ///< candidates, by the stage of the cascade that decided
  std::uint64_t decided_by_float64 = 0;
  std::uint64_t decided_exactly = 0;
  std::uint64_t contacts = 0;

  friend bool operator==(const ContactCounters&, const ContactCounters&) = default;
};

/// Finds every pair of triangles that meet, of many posed instances of few assets, on the CPU. Keeps its
/// memory from call to call: in a steady state nothing is allocated. Throws nothing. Movable, not copyable;
/// one query at a time, several objects side by side. Takes about 100 KB of the calling thread's stack.
/// Rounds to nearest and keeps subnormals: the floating-point environment that every thread starts with.
class ContactQuery {
 public:
  ContactQuery();
  ContactQuery(ContactQuery&&) noexcept;
  ContactQuery& operator=(ContactQuery&&) noexcept;
  ~ContactQuery();

  /// Names the assets that instances refer to. Queries use level 0 of each view, which may be any of the file
  /// (AssetView::levels_from()); what the views point to must outlive the queries. Result: kOk;
  /// kUnknownAsset, where a view points to nothing and where() is its place in the list; or kOutOfMemory.
  /// After an error there are no assets.
  Status set_assets(std::span<const AssetView> assets);

  /// Keeps the instances whose motion is fixed as they stand: calls to come, which must be of as many
  /// instances, look neither at their assets nor at their poses again, find no pair of two of them, and take
  /// the time of the others. Call it again when one of them has moved or others are fixed; none are kept
  /// where none is fixed, as of two empty lists. motion: of each instance; where a filter of a call to come
  /// has motions, it says the same of what is kept. Result: as of find_pairs(); kKeptMismatch where the sizes
  /// differ. After an error, and after set_assets(), nothing is kept. Of the options: threads.
  Status keep_fixed(std::span<const Instance> instances, std::span<const Motion> motion,
                    const ContactOptions& options = {});

  /// Finds the object pairs whose world boxes overlap, without their contacts, so that the caller can leave
  /// some out. Result: kOk; kUnknownAsset, kPoseNotRigid or kOutOfRange (beyond kLargestWorldCoordinate),
  /// where where() is the instance; kUnknownInstance, where where() is the filter's excluded pair;
  /// kKeptMismatch, kTooManyInstances, kTooManyPairs, kOutOfMemory or kCannotStartThread. After an error
  /// there are no pairs and no contacts.
  Status find_pairs(std::span<const Instance> instances, const ContactOptions& options = {});

  /// Finds the object pairs whose world boxes overlap, or are within `within`, and their contacts.
  /// find_contacts(instances, {}) is this one, with default options. Result: as above; kOutOfMemory also
  /// where the machine, or the limit of the process's control group, has not enough memory available for the
  /// contacts: Linux would grant it and kill the process later. In a steady state nothing is asked.
  Status find_contacts(std::span<const Instance> instances, const ContactOptions& options = {});

  /// Finds the contacts of the given object pairs, in either order of a and b. A pair of an instance with
  /// itself asks for the contacts within it: each pair of two different triangles once, neighbours in the
  /// mesh included, which touch. `pairs` may be pairs(), or a part of them; the filter is not asked. Result:
  /// as above, or kUnknownInstance: where() is the pair.
  Status find_contacts(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
                       const ContactOptions& options);

  /// The object pairs of the last call: a < b, or a = b for self pairs, sorted, where the query found them;
  /// as given else.
  std::span<const ObjectPair> pairs() const;

  /// The contacts of the last call, by ascending pair; within a pair in an order that is the same on every
  /// run and machine. Valid until the next call.
  std::span<const Contact> contacts() const;

  const ContactCounters& counters() const;

  /// The instance or pair that is to blame for an error.
  std::uint64_t where() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem
