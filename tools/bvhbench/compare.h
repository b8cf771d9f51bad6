#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "timed_work.h"

namespace tandem::bench {

/// The results of one peer on one scene. Its update time is the best of up to three.
struct PeerResult : PeerTimes {
  std::uint64_t memory_bytes = 0;  ///< held after build and update: heap growth, and what malloc does not see
  std::uint64_t work_bytes = 0;    ///< by which the first query made it grow: queues, results
  std::optional<std::uint64_t> contacts;          ///< nothing where the library does not tell
  std::optional<std::uint64_t> missed, invented;  ///< against the reference
  std::uint64_t hash = 0;                         ///< XXH64 of the sorted contacts, 0 without them
  std::vector<Counter> counters;
};

/// The results of all peers on one scene: same object pairs, one thread, one process, side by side.
struct SceneComparison {
  std::string name;  ///< of the scene file, without folder and ending
  std::uint64_t instances = 0;
  std::uint64_t triangles = 0;  ///< of all instances together
  std::uint64_t object_pairs = 0;
  std::string reference;  ///< the peer that the others' answers are held against, or empty
  std::vector<PeerResult> peers;
};

/// Runs a scene through the peers, whose queries are repeated in turn. The reference is CGAL, or Tandem exact
/// without it. Throws FileError of a scene that cannot be compared, std::runtime_error of a peer.
SceneComparison compare(const std::string& path, Peers peers, unsigned repeats);

}  // namespace tandem::bench
