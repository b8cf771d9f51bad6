#pragma once
#include <cstdint>

#include "tandem/formats/platform.h"

namespace tandem::manifold {

/// A team makes the manifolds of an object pair together: one thread of a CPU here, a warp or a thread block
/// on a GPU (kernels/manifold/manifold_team.cuh). Each takes every size()-th thing from rank() on. What they
/// find together must not depend on how many they are nor on who comes first.
struct OneThread {
  TANDEM_HD static std::uint32_t rank() { return 0; }
  TANDEM_HD static std::uint32_t size() { return 1; }

  /// Lets all see what all have written to memory.
  TANDEM_HD static void sync() {}

  template <typename T>
  TANDEM_HD static T sum(T value) {
    return value;
  }
  template <typename T>
  TANDEM_HD static T least(T value) {
    return value;
  }
  template <typename T>
  TANDEM_HD static T greatest(T value) {
    return value;
  }
  /// These functions do so for each of several values, sooner than one after the other.
  template <typename T, int kCount>
  TANDEM_HD static void sums(T (&)[kCount]) {}
  template <typename T, int kCount>
  TANDEM_HD static void least_ones(T (&)[kCount]) {}
  template <typename T, int kCount>
  TANDEM_HD static void greatest_ones(T (&)[kCount]) {}
  TANDEM_HD static bool any(bool value) { return value; }

  /// These work on memory that all see.
  TANDEM_HD static std::uint32_t load(const std::uint32_t& at) { return at; }
  TANDEM_HD static void store(std::uint32_t& at, std::uint32_t value) { at = value; }
  /// Loads a number that others may be writing.
  TANDEM_HD static std::uint32_t concurrent_load(std::uint32_t& at) { return at; }
  TANDEM_HD static void concurrent_store(std::uint32_t& at, std::uint32_t value) { at = value; }
  TANDEM_HD static void set_bits(std::uint32_t& at, std::uint32_t bits) { at |= bits; }
  TANDEM_HD static std::uint32_t add(std::uint32_t& at, std::uint32_t value) {
    const std::uint32_t before = at;
    at += value;
    return before;
  }
  TANDEM_HD static std::uint32_t compare_and_swap(std::uint32_t& at, std::uint32_t expected,
                                                  std::uint32_t value) {
    const std::uint32_t before = at;
    if (before == expected) at = value;
    return before;
  }
};

/// A thread of a CPU that has instructions for several things at a time: lanes() has other ways to the same
/// answers (kernels/manifold/manifold_lanes.h).
template <typename Team>
concept HasLanes = requires(const Team& team) {
  team.lanes();
};

/// A team of warps of a GPU. Each has the functions of the warp: lane(), ballot(), first_bit(),
/// from_lane(); and
/// walk_lines(), its own way to walk trees.
template <typename Team>
concept HasWarps = Team::kHasWarps;

}  // namespace tandem::manifold
