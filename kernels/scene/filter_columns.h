#pragma once
#include <algorithm>
#include <cstdint>
#include <cstring>

#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/pair_filter.h"
#include "tandem/kernels/scene.h"

namespace tandem {

/// A column of a filter has an entry for each body of a scene, or none where all have the usual one.
struct FilterColumns {
  Buffer<Motion> motion;
  Buffer<std::uint32_t> group, mask, world;

  /// The columns that an assignment changed, and whether there was memory for all.
  struct Changes {
    bool motion, group, mask, world, complete;

    bool any() const { return motion || group || mask || world; }
  };

  PairFilter filter(const ExcludedPairs& excluded) const {
    const auto data = [](const auto& column) { return column.size() != 0 ? column.data() : nullptr; };
    return {data(motion), data(group), data(mask), data(world), excluded};
  }

  /// Takes the columns of a filter of `count` bodies. Those for which there is no memory are empty.
  Changes assign(const PairFilter& filter, std::size_t count) {
    Changes changes = {false, false, false, false, true};
    const auto take = [&](const auto* from, auto& to) {
      const std::size_t size = from != nullptr ? count : 0;
      if (to.size() == size && (size == 0 || std::memcmp(to.data(), from, size * sizeof *from) == 0))
        return false;
      const bool enough_memory = to.resize(size);
      if (enough_memory) std::copy_n(from, size, to.data());
      if (!enough_memory) to.clear();
      changes.complete = changes.complete && enough_memory;
      return true;
    };
    changes.motion = take(filter.motion, motion);
    changes.group = take(filter.group, group);
    changes.mask = take(filter.mask, mask);
    changes.world = take(filter.world, world);
    return changes;
  }

  /// Sets what the filter says of one body; the columns then have `count` entries, or none. False: out of
  /// memory, and some may be longer.
  [[nodiscard]] bool set(std::uint32_t body, const BodyFilter& what, std::size_t count) {
    const BodyFilter usual;
    return set(what.motion, usual.motion, motion, body, count) &&
           set(what.group, usual.group, group, body, count) &&
           set(what.mask, usual.mask, mask, body, count) && set(what.world, usual.world, world, body, count);
  }
  [[nodiscard]] bool set_motion(std::uint32_t body, Motion what, std::size_t count) {
    return set(what, Motion::moving, motion, body, count);
  }

  /// Drops the entries from `count` on.
  void shrink(std::size_t count) {
    const auto drop = [&](auto& column) { (void)column.resize(std::min(column.size(), count)); };
    drop(motion), drop(group), drop(mask), drop(world);
  }

 private:
  template <typename Entry>
  static bool set(Entry entry, Entry usual, Buffer<Entry>& column, std::uint32_t body, std::size_t count) {
    if (column.size() == 0 && entry == usual) return true;
    while (column.size() < count) {
      if (!column.push(usual)) return false;
    }
    column[body] = entry;
    return true;
  }
};

}  // namespace tandem
