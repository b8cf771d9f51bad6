#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "bvhbench/engines/engine.h"
#include "bvhbench/scenes/scene_file.h"
#include "kernels/common/stopwatch.h"
#include "tandem/kernels/containment_query.h"

namespace tandem::bench {

/// Throws std::bad_alloc or std::runtime_error where something is wrong.
void require(Status status);

/// The bodies of a scene file on the CPU, to ask questions of.
struct PlacedBodies {
  std::vector<AssetView> assets;
  Scene scene;

  explicit PlacedBodies(const LoadedScene& file);
};

/// Bodies within bodies, and what finding them took beside the query, each time.
struct TimedContainments {
  std::vector<Containment> rows;
  Seconds seconds;
};

/// Finds them on the CPU, `repeats` times. contacts: all of these pairs, in any order. Throws FileError,
/// where an asset has no topology, std::bad_alloc, or std::runtime_error, where a thread could not be
/// started.
TimedContainments find_contained(const LoadedScene& scene, std::span<const ObjectPair> pairs,
                                 std::span<const TriangleContact> contacts, std::uint32_t threads,
                                 std::uint32_t repeats);

/// Returns how many of them are inside; the others are in the box of a body that is open.
std::uint64_t count_inside(std::span<const Containment> rows);

}  // namespace tandem::bench
