#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/manifold.h"

namespace tandem {

struct ManifoldOptions {
  /// Points are looked for among those of the last call: Manifold points then have `previous`, and keep the
  /// ids that they had. Without it ids are those of the features, and the last call does not matter.
  bool match_previous = true;
  std::uint32_t most_points = kMostManifoldPoints;  ///< of a manifold, from 1 to kMostManifoldPoints
  std::uint32_t threads = 1;  ///< with the caller's, kMostQueryThreads at most; results don't depend on it
};

/// Makes contact manifolds of the contacts that a query found, on the CPU. Keeps its memory from call to
/// call. Throws nothing. Movable, not copyable; one call at a time, several objects side by side.
class ManifoldQuery {
 public:
  ManifoldQuery();
  ManifoldQuery(ManifoldQuery&&) noexcept;
  ManifoldQuery& operator=(ManifoldQuery&&) noexcept;
  ~ManifoldQuery();

  /// Names the assets that instances refer to, the list given to the query. What the views point to must
  /// outlive the calls. Result: kOk; kUnknownAsset, where a view points to nothing; kNoTopology, where its
  /// file has none; where() is its place in the list; or kOutOfMemory. After an error there are no assets.
  /// Forgets the last call.
  Status set_assets(std::span<const AssetView> assets);

  /// Makes the manifolds of a query's contacts. A pair of an instance with itself has none. The result does
  /// not depend on the order of the contacts. Result: kOk; kUnknownAsset, kPoseNotRigid or kOutOfRange, where
  /// where() is the instance; kUnknownInstance, where it is the pair; kUnknownContact, where it is the
  /// contact: it names a pair or a triangle that does not exist; kTooManyInstances, kTooManyPairs,
  /// kOutOfMemory or kCannotStartThread; and kOutOfRange where there are too many contacts, 2^29 or 2^27 of a
  /// pair, or points. After an error there are no manifolds, and the next call finds none before it.
  Status make(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
              std::span<const Contact> contacts, const ManifoldOptions& options = {});

  /// The manifolds of the last call, by ascending pair and, within a pair, by their least pair of triangles;
  /// and their points, manifold by manifold. Valid until the next call.
  std::span<const Manifold> manifolds() const;
  std::span<const ManifoldPoint> points() const;

  const ManifoldCounters& counters() const;

  /// The next call finds no points before it.
  void forget_points();

  /// The asset, instance, pair or contact that is to blame for an error.
  std::uint64_t where() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem
