#pragma once
#include <cstdint>

#include "tandem/formats/platform.h"

/// The filter says which pairs of instances a broad phase looks at, by one rule for CPU and GPU.
namespace tandem {

/// Says what moves an instance. The numbers are those of /simulation/motion in a scene file.
enum class Motion : std::uint8_t {
  moving,     ///< forces and contacts
  fixed,      ///< nothing
  kinematic,  ///< the caller, whatever it meets
  sleeping,   ///< nothing until the caller wakes it: the caller's flag
};

/// Returns whether a pair is looked at: where one of them moves, or a kinematic one meets a sleeping one,
/// which its caller may want to wake. Nothing comes of the others: none of the two gives way.
TANDEM_HD inline bool motions_meet(Motion a, Motion b) {
  // Bit b of row a, in four bits each: sleeping, kinematic, fixed, moving.
  constexpr std::uint32_t kRows = 0b0101'1001'0001'1111;
  return (kRows >> (4 * (static_cast<std::uint32_t>(a) & 3) + (static_cast<std::uint32_t>(b) & 3)) & 1) != 0;
}

/// Returns whether each of the two is in a group that the other's mask names.
TANDEM_HD inline bool groups_meet(std::uint32_t group_a, std::uint32_t mask_a, std::uint32_t group_b,
                                  std::uint32_t mask_b) {
  return (group_a & mask_b) != 0 && (group_b & mask_a) != 0;
}

/// The world of an instance that is in all worlds.
inline constexpr std::uint32_t kEveryWorld = ~std::uint32_t{0};

/// Returns whether two instances are in one world.
TANDEM_HD inline bool worlds_meet(std::uint32_t a, std::uint32_t b) {
  return a == b || a == kEveryWorld || b == kEveryWorld;
}

/// The lowest and the highest world of some instances.
struct WorldRange {
  std::uint32_t first = kEveryWorld, last = 0;  ///< of none: first > last

  TANDEM_HD static WorldRange of(std::uint32_t world) {
    return world == kEveryWorld ? WorldRange{0, kEveryWorld} : WorldRange{world, world};
  }
  TANDEM_HD void add(const WorldRange& more) {
    first = more.first < first ? more.first : first;
    last = more.last > last ? more.last : last;
  }
  TANDEM_HD bool meets(const WorldRange& other) const { return first <= other.last && other.first <= last; }
};

/// A set of pairs of instances: a table that ExcludedPairTable or GpuExcludedPairs owns. Owns nothing.
struct ExcludedPairs {
  static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};

  const std::uint64_t* slots = nullptr;  ///< keys and kEmpty; a key lies at its home or after it, with no
                                         ///< kEmpty between; null where no pair is excluded
  std::uint64_t last_slot = 0;           ///< their number less one: a power of two less one
  std::uint32_t instances = 0;           ///< every pair names instances below this number
  std::uint64_t row = 0;                 ///< of the pair that names the last of them

  /// Returns the key of a pair, the same for both orders of a and b. No pair of instances has the key kEmpty,
  /// as kNoIndex is none.
  TANDEM_HD static std::uint64_t key(std::uint32_t a, std::uint32_t b) {
    return a < b ? std::uint64_t{a} << 32 | b : std::uint64_t{b} << 32 | a;
  }

  /// Returns where a key's slots begin. Source: Stafford's variant 13 of the finalizer of MurmurHash3.
  TANDEM_HD std::uint64_t home(std::uint64_t key) const {
    key = (key ^ key >> 30) * 0xBF58476D1CE4E5B9u;
    key = (key ^ key >> 27) * 0x94D049BB133111EBu;
    return (key ^ key >> 31) & last_slot;
  }

  /// Ends, because at least one slot is kEmpty.
  TANDEM_HD bool contains(std::uint32_t a, std::uint32_t b) const {
    if (slots == nullptr) return false;
    const std::uint64_t wanted = key(a, b);
    for (std::uint64_t slot = home(wanted);; slot = (slot + 1) & last_slot) {
      if (slots[slot] == wanted) return true;
      if (slots[slot] == kEmpty) return false;
    }
  }
};

/// Says which pairs a broad phase looks at, of all whose world boxes meet. Each array has an entry for each
/// instance, or is null; without any, all pairs are. Owns nothing; for a broad phase on a GPU all lies in GPU
/// memory.
struct PairFilter {
  const Motion* motion = nullptr;        ///< null: all move
  const std::uint32_t* group = nullptr;  ///< the groups that an instance is in, a bit each; null: all
  const std::uint32_t* mask = nullptr;   ///< the groups that it meets; null: all
  const std::uint32_t* world = nullptr;  ///< only those of one world meet, and those of kEveryWorld all;
                                         ///< null: there is one world. Broad phases sort by it, so that
                                         ///< worlds that lie in one place cost what worlds far apart do
  ExcludedPairs excluded = {};           ///< such as bodies that a joint connects

  /// The rule; a == b: an instance with itself.
  TANDEM_HD bool looks_at(std::uint32_t a, std::uint32_t b) const {
    if (world != nullptr && !worlds_meet(world[a], world[b])) return false;
    if (motion != nullptr && !motions_meet(motion[a], motion[b])) return false;
    const auto bits = [](const std::uint32_t* of, std::uint32_t i) { return of != nullptr ? of[i] : ~0u; };
    return groups_meet(bits(group, a), bits(mask, a), bits(group, b), bits(mask, b)) &&
           !excluded.contains(a, b);
  }
};

}  // namespace tandem
