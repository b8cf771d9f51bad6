#pragma once
#include <cstdint>

#include "dynamics/contact_rows.h"

namespace tandem::dynamics {

/// Two bodies that touch, by place in the list of a step, and their contacts.
struct ContactPair {
  std::uint32_t a, b;
  std::uint32_t first, count;

  TANDEM_HD ContactRange contacts() const { return {first, count}; }
  TANDEM_HD std::uint32_t body(int side) const { return side == 0 ? a : b; }
};

/// The pairs of a step, in the executor's memory. Each has at least one body that moves.
struct ContactPairs {
  const ContactPair* pairs;      ///< by ascending (a, b)
  const std::uint32_t* count;    ///< how many
  std::uint32_t most;            ///< how many there is room for
  const BodyProperties* bodies;  ///< of the step

  TANDEM_HD bool is_moved(std::uint32_t body) const { return bodies[body].motion == Motion::moving; }
  TANDEM_HD std::uint32_t size() const { return *count < most ? *count : most; }
};

}  // namespace tandem::dynamics
