#pragma once
#include <cstdint>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "tandem/kernels/excluded_pairs.h"
#include "tandem/kernels/pair_filter.h"

/// Random filters, and what they say, told another way.
namespace tandem::test {

/// Arrays of a filter, in CPU memory.
struct FilterArrays {
  std::vector<Motion> motion;
  std::vector<std::uint32_t> group, mask, world;
  std::vector<ObjectPair> excluded;

  /// table: owns the excluded pairs.
  PairFilter view(ExcludedPairTable& table) const {
    static_cast<void>(table.set(excluded));
    return {motion.empty() ? nullptr : motion.data(), group.empty() ? nullptr : group.data(),
            mask.empty() ? nullptr : mask.data(), world.empty() ? nullptr : world.data(), table.view()};
  }
};

/// parts: which arrays there are, a bit each. Excluded pairs name neighbours by number.
inline FilterArrays random_filter(std::uint32_t count, unsigned parts, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  FilterArrays filter;
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  // Half are fixed, because that is what filters are for.
  constexpr Motion kMotions[] = {Motion::moving, Motion::fixed,     Motion::fixed,
                                 Motion::fixed,  Motion::kinematic, Motion::sleeping};
  for (std::uint32_t i = 0; i < count; ++i) {
    if (parts & 1) filter.motion.push_back(kMotions[below(6)]);
    if (parts & 2) filter.group.push_back(i % 10 == 3 ? 0x80000000u : 1u << below(3));
    if (parts & 4) filter.mask.push_back(static_cast<std::uint32_t>(random()) | below(8));
    if (parts & 16) filter.world.push_back(below(16) == 0 ? kEveryWorld : below(5) * 0x1000'0001u);
    if ((parts & 8) && i > 0) {
      const std::uint32_t other = i - 1 - below(i < 20 ? i : 20);
      filter.excluded.push_back(below(2) == 0 ? ObjectPair{i, other} : ObjectPair{other, i});
      if (below(4) == 0) filter.excluded.push_back({other, i});
      if (below(16) == 0) filter.excluded.push_back({i, i});
    }
  }
  return filter;
}

/// The rule in words.
class FilterOracle {
 public:
  explicit FilterOracle(const FilterArrays& filter) : filter_(filter) {
    for (const ObjectPair& pair : filter.excluded) {
      excluded_.emplace(pair.a, pair.b);
      excluded_.emplace(pair.b, pair.a);
    }
  }

  bool looks_at(std::uint32_t a, std::uint32_t b) const {
    return share_a_world(a, b) && move(a, b) && names(a, b) && names(b, a) && excluded_.count({a, b}) == 0;
  }

 private:
  Motion motion(std::uint32_t i) const { return filter_.motion.empty() ? Motion::moving : filter_.motion[i]; }

  bool move(std::uint32_t a, std::uint32_t b) const {
    if (motion(a) == Motion::moving || motion(b) == Motion::moving) return true;
    return std::set{motion(a), motion(b)} == std::set{Motion::kinematic, Motion::sleeping};
  }

  bool share_a_world(std::uint32_t a, std::uint32_t b) const {
    if (filter_.world.empty()) return true;
    const std::set<std::uint32_t> worlds = {filter_.world[a], filter_.world[b]};
    return worlds.size() == 1 || worlds.count(kEveryWorld) != 0;
  }

  // Whether a's mask names a group of b's.
  bool names(std::uint32_t a, std::uint32_t b) const {
    for (int bit = 0; bit < 32; ++bit) {
      const bool wanted = filter_.mask.empty() || (filter_.mask[a] >> bit & 1) != 0;
      const bool member = filter_.group.empty() || (filter_.group[b] >> bit & 1) != 0;
      if (wanted && member) return true;
    }
    return false;
  }

  const FilterArrays& filter_;
  std::set<std::pair<std::uint32_t, std::uint32_t>> excluded_;
};

}  // namespace tandem::test
