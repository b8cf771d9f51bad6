#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/kernels/contact_query.h"

namespace tandem {

enum ContainmentFlags : std::uint32_t {
  /// An odd number of the outer body's closed surfaces is around the component. A surface in a cavity's place
  /// counts too: what lies in the hollow of a shell has two around it, and is not inside.
  kInside = 1,
  /// The outer body has components that are not closed; of these, there is no inside.
  kOuterOpen = 2,
};

/// A component of a body that meets nothing of another body, and lies within it.
struct Containment {
  std::uint32_t pair;       ///< row of the list of object pairs
  std::uint32_t inner;      ///< whose component it is: 0: a's, which lies in b; 1: b's, which lies in a
  std::uint32_t component;  ///< of the inner body: LevelView::components[component]
  std::uint32_t flags;      ///< ContainmentFlags, at least one

  friend bool operator==(const Containment&, const Containment&) = default;
};

/// Finds what lies within another body of an object pair without touching it, which no contact tells, on the
/// CPU. Decides exactly, on the posed vertices. Keeps its memory from call to call. Throws nothing. Movable,
/// not copyable; one call at a time, several objects side by side.
class ContainmentQuery {
 public:
  ContainmentQuery();
  ContainmentQuery(ContainmentQuery&&) noexcept;
  ContainmentQuery& operator=(ContainmentQuery&&) noexcept;
  ~ContainmentQuery();

  /// Names the assets that instances refer to, the list given to the contact query. What the views point to
  /// must outlive the calls. Result: kOk; kUnknownAsset, where a view points to nothing; kNoTopology, where
  /// its file has none; where() is its place in the list; or kOutOfMemory. After an error there are no
  /// assets.
  Status set_assets(std::span<const AssetView> assets);

  /// Finds the components of either body of each pair that have no contact with the other body, and have the
  /// flag kInside; or, where the other body has components that are not closed, lie in its world box: their
  /// first vertex does. A pair of an instance with itself has none. contacts: all of these pairs, in mode
  /// exact and by ascending pair, as ContactQuery has them; where no body has two components, the first
  /// contact of each pair will do. threads: with the caller's, kMostQueryThreads at most; results don't
  /// depend on it. Result: kOk; kUnknownAsset, kPoseNotRigid or kOutOfRange, where where() is the instance;
  /// kUnknownInstance, where it is the pair; kUnknownContact, where it is the contact: it names a pair or a
  /// triangle that does not exist, or comes behind one of a later pair; kTooManyInstances, kTooManyPairs,
  /// kOutOfMemory or kCannotStartThread. After an error nothing is contained.
  Status find(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
              std::span<const Contact> contacts, std::uint32_t threads = 1);

  /// What the last call found, by ascending pair, inner body and component. Valid until the next call.
  std::span<const Containment> contained() const;

  /// The asset, instance, pair or contact that is to blame for an error.
  std::uint64_t where() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem
