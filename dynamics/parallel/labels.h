#pragma once
#include <cstdint>

#include "dynamics/parallel/atomics.h"

/// Islands as labels: each body has that of another one of its island with a smaller number, or its own.
namespace tandem::dynamics {

/// Returns the first body of an island.
TANDEM_HD inline std::uint32_t first_of(const std::uint32_t* label, std::uint32_t body) {
  while (label[body] != body) body = label[body];
  return body;
}

/// Joins the islands of two bodies. A label always leads to one that is less, whoever else joins islands
/// meanwhile.
TANDEM_HD inline void join(std::uint32_t* label, std::uint32_t a, std::uint32_t b) {
  a = first_of(label, a), b = first_of(label, b);
  while (a != b) {
    const std::uint32_t larger = a > b ? a : b, smaller = a > b ? b : a;
    const std::uint32_t there = atomic_exchange_if(label[larger], larger, smaller);
    if (there == larger) return;
    a = first_of(label, there), b = smaller;
  }
}

}  // namespace tandem::dynamics
