#pragma once
#include <cstdint>

#include "tandem/formats/platform.h"

namespace tandem::manifold {

/// Those who make the manifolds of an object pair together: one thread of a CPU here, a warp or a thread
/// block on a GPU (kernels/cuda/src/manifold_team.cuh). Each takes every size()-th thing from rank() on. What
/// they find together must not depend on how many they are nor on who comes first.
struct OneThread {
  TANDEM_HD static std::uint32_t rank() { return 0; }
  TANDEM_HD static std::uint32_t size() { return 1; }

  /// What all have written to memory is seen by all.
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
  TANDEM_HD static bool any(bool value) { return value; }

  /// Those of the team who walk trees together: the first of it.
  TANDEM_HD static bool in_crew() { return true; }
  TANDEM_HD static std::uint32_t crew_size() { return 1; }
  TANDEM_HD static void crew_sync() {}
  /// Calls of() for each of the crew that has found something, one after the other. All of the crew come
  /// here.
  template <typename Found, typename Of>
  TANDEM_HD static void one_by_one(const Found& found, const Of& of) {
    if (found) of();
  }

  /// On memory that all see.
  TANDEM_HD static std::uint32_t load(const std::uint32_t& at) { return at; }
  TANDEM_HD static void store(std::uint32_t& at, std::uint32_t value) { at = value; }
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

/// A thread of a CPU that has instructions for several things at a time: means() has other ways to the same
/// answers (kernels/src/manifold_means.h).
template <typename Team>
concept HasMeans = requires(const Team& team) {
  team.means();
};

}  // namespace tandem::manifold
