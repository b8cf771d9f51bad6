#pragma once
#include <cstdint>
#include <span>

#include "tandem/kernels/scene.h"

namespace tandem::test {

/// A question and a scene of its own, for tests that place bodies and ask at once.
template <typename Query>
struct Asked {
  Scene scene;
  Query query;
  PairFilter filter;

  Status set_assets(std::span<const AssetView> assets) {
    const Status status = scene.set_assets(assets);
    (void)query.find(scene);  // of no bodies
    return status;
  }

  /// Places the bodies, then asks. Where they cannot be placed, the question is asked of no bodies.
  Status find(std::span<const Instance> instances, const typename Query::Options& options = {}) {
    return place_and(instances, [&] { return query.find(scene, options); });
  }

  /// Asks about given pairs.
  Status find(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
              const typename Query::Options& options) {
    return place_and(instances, [&] { return query.find(scene, pairs, options); });
  }

  auto rows() const { return query.rows(); }
  auto pairs() const { return query.pairs(); }
  const auto& counters() const { return query.counters(); }
  std::uint64_t where() const { return where_; }

 private:
  template <typename Ask>
  Status place_and(std::span<const Instance> instances, const Ask& ask) {
    const Status placed = scene.place(instances, filter);
    where_ = scene.where();
    const Status found = ask();
    if (placed == Status::kOk) where_ = scene.where();
    return placed == Status::kOk ? found : placed;
  }

  std::uint64_t where_ = 0;
};

}  // namespace tandem::test
