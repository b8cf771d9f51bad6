#pragma once
#include <algorithm>
#include <cstdint>

#include "tandem/formats/platform.h"

namespace tandem::dynamics {

/// Numbers that are summed up side by side.
template <int kCount>
struct Sums {
  double of[kCount];
};

/// A team is the threads that work on one thing together, all of which call the same functions in the same
/// order:
///
///     rank(), size()           which thread this is, of how many
///     barrier()                all come here, and see what the others wrote before
///     each(count, visit)       calls visit(i) for each i below count, side by side
///     sum(start, count, add)   add(i, sums) adds something of each i; every thread gets the same sums
///     most(start, count, of)   the largest of start and of(i) of each i; every thread gets it
///
/// Neither each() nor sum() nor most() waits for what others write before it. The order in which a team sums
/// up depends on its kind alone. kIsMany: there are many threads, among which small work is spread too.
///
/// SerialTeam is one thread, which sums up from the first to the last.
struct SerialTeam {
  static constexpr bool kIsMany = false;

  TANDEM_HD std::uint32_t rank() const { return 0; }
  TANDEM_HD std::uint32_t size() const { return 1; }
  TANDEM_HD void barrier() const {}
  template <typename Visit>
  TANDEM_HD void each(std::uint32_t count, const Visit& visit) const {
    for (std::uint32_t i = 0; i < count; ++i) visit(i);
  }
  template <int kCount, typename Add>
  TANDEM_HD Sums<kCount> sum(Sums<kCount> start, std::uint32_t count, const Add& add) const {
    for (std::uint32_t i = 0; i < count; ++i) add(i, start);
    return start;
  }
  template <typename Of>
  TANDEM_HD double most(double start, std::uint32_t count, const Of& of) const {
    for (std::uint32_t i = 0; i < count; ++i) start = std::max(start, of(i));
    return start;
  }
};

/// Calls visit(p, q, part) for each q <= p < count and each part below `parts`, side by side.
template <typename Team, typename Visit>
TANDEM_HD void each_of_triangle(const Team& team, std::uint32_t count, std::uint32_t parts,
                                const Visit& visit) {
  if constexpr (Team::kIsMany) {
    team.each(count * count * parts, [&](std::uint32_t i) {
      const std::uint32_t p = i / parts / count, q = i / parts % count;
      if (q <= p) visit(p, q, i % parts);
    });
  } else {
    for (std::uint32_t q = 0; q < count; ++q) {
      for (std::uint32_t p = q; p < count; ++p) {
        for (std::uint32_t part = 0; part < parts; ++part) visit(p, q, part);
      }
    }
  }
}

}  // namespace tandem::dynamics
