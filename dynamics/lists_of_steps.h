#pragma once
#include <algorithm>
#include <cstdint>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "dynamics/pair_touch.h"

namespace tandem::dynamics {

/// Returns what lists of pairs of bodies are sorted by. Row: has bodies a and b.
template <typename Row>
std::pair<std::uint32_t, std::uint32_t> bodies_of(const Row& row) {
  return {row.a, row.b};
}

/// Adds the pairs of a step to those of the steps before; both are ascending, and a pair that is in both
/// keeps its row.
template <typename Row>
void add_pairs(std::span<const Row> rows, std::vector<Row>& to) {
  if (rows.empty()) return;
  std::vector<Row> all;
  std::ranges::set_union(to, rows, std::back_inserter(all), {}, bodies_of<Row>, bodies_of<Row>);
  to.swap(all);
}

/// Adds those that began to touch in a step to those of the steps before, and gives all of them the row of
/// the step in which they pushed hardest, and the largest speed. touching: the pairs that touch in this step,
/// ascending.
template <typename Row>
void add_touches(std::span<const Row> began, std::span<const Row> touching, std::vector<Row>& to) {
  add_pairs(began, to);
  for (Row& row : to) {
    const auto now = std::ranges::lower_bound(touching, bodies_of(row), {}, bodies_of<Row>);
    if (now == touching.end() || bodies_of(*now) != bodies_of(row)) continue;
    take_hardest(row, *now);
  }
}

}  // namespace tandem::dynamics
