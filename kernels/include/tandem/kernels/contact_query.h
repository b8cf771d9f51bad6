#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/formats/view.h"
#include "tandem/kernels/broad_phase.h"
#include "tandem/kernels/pose.h"

namespace tandem {

/// An asset, by its place in the list given to set_assets(), and where it stands. The pose speaks of the
/// file's coordinates.
struct Instance {
  std::uint32_t asset;
  Pose pose;
};

/// How much a query decides.
enum class QueryMode : std::uint8_t {
  exact,  ///< contact pairs, as exact arithmetic on the posed vertices finds them
  fast,   ///< contact pairs by float32 in the first instance's frame: may err where rounding does
  boxes,  ///< candidates: triangles whose boxes overlap; none that touch are missing, many do not touch
};

/// Two triangles that meet: one of pairs()[pair].a, one of pairs()[pair].b.
struct Contact {
  std::uint32_t pair;
  std::uint32_t triangle_a, triangle_b;  ///< in leaf order: LevelView::triangles[triangle_a]
  std::uint32_t face_a, face_b;          ///< faces of the source files

  friend bool operator==(const Contact&, const Contact&) = default;
};

inline constexpr std::uint32_t kMostQueryThreads = 1024;

struct QueryOptions {
  QueryMode mode = QueryMode::exact;
  bool first_contact_only = false;  ///< at most one contact for each object pair: do they touch?
  bool self_pairs = false;          ///< also each instance with itself, where the query finds the pairs
  std::uint32_t threads = 1;  ///< the caller's included, kMostQueryThreads at most; results are the same
};

/// What a query did. Independent of threads, and of the machine.
struct QueryCounters {
  std::uint64_t object_pairs = 0;
  std::uint64_t block_pairs = 0;  ///< 16 box tests each
  std::uint64_t candidates = 0;   ///< in boxes mode; otherwise less those that planes of leaves tell apart
  std::uint64_t decided_by_float32 = 0;  ///< candidates, by the stage of the cascade that decided
  std::uint64_t decided_by_float64 = 0;
  std::uint64_t decided_exactly = 0;
  std::uint64_t contacts = 0;

  friend bool operator==(const QueryCounters&, const QueryCounters&) = default;
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

  /// Names the assets that instances refer to; level 0 of each is looked at. What the views look at must
  /// outlive the queries. Result: kOk, kUnknownAsset (a view of nothing: where() is its place in the list),
  /// or kOutOfMemory; then there are no assets.
  Status set_assets(std::span<const AssetView> assets);

  /// Finds the object pairs whose world boxes overlap, and not their contacts: for those who want to leave
  /// some out. Result: kOk, or kUnknownAsset, kPoseNotRigid, kOutOfRange (beyond kLargestWorldCoordinate):
  /// where() is the instance; kTooManyInstances, kTooManyPairs, kOutOfMemory. After an error there are no
  /// pairs and no contacts.
  Status find_pairs(std::span<const Instance> instances, const QueryOptions& options = {});

  /// Finds the object pairs whose world boxes overlap, and their contacts. find_contacts(instances, {}) is
  /// this one, with default options. Result: as above, or kCannotStartThread. kOutOfMemory also where the
  /// machine, or the limit of the process's control group, has not enough memory available for the contacts:
  /// Linux would grant it and kill the process later. In a steady state nothing is asked.
  Status find_contacts(std::span<const Instance> instances, const QueryOptions& options = {});

  /// Finds the contacts of the given object pairs, in either order of a and b. A pair of an instance with
  /// itself asks for the contacts within it: each pair of two different triangles once, neighbours in the
  /// mesh included, which touch. `pairs` may be pairs(), or a part of them. Result: as above, or
  /// kUnknownInstance: where() is the pair.
  Status find_contacts(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
                       const QueryOptions& options);

  /// The object pairs of the last call: a < b, or a = b for self pairs, sorted, where the query found them;
  /// as given else.
  std::span<const ObjectPair> pairs() const;

  /// The contacts of the last call, by ascending pair; within a pair in an order that is the same on every
  /// run and machine. Valid until the next call.
  std::span<const Contact> contacts() const;

  const QueryCounters& counters() const;

  /// The instance or pair that is to blame for an error.
  std::uint64_t where() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem
