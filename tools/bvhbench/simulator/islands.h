#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "contact_point.h"
#include "rigid_body.h"

namespace tandem::simulation {

/// Bodies that push each other through contacts, and those contacts. Islands share no dynamic body, so they
/// can be solved side by side.
struct Islands {
  std::vector<std::uint32_t> bodies, body_begin;  ///< island i: bodies[body_begin[i]] ... [body_begin[i + 1])
  std::vector<std::uint32_t> contacts, contact_begin;  ///< the same of contacts

  std::size_t size() const { return body_begin.empty() ? 0 : body_begin.size() - 1; }
  std::span<const std::uint32_t> bodies_of(std::size_t island) const {
    return {bodies.data() + body_begin[island], body_begin[island + 1] - body_begin[island]};
  }
  std::span<const std::uint32_t> contacts_of(std::size_t island) const {
    return {contacts.data() + contact_begin[island], contact_begin[island + 1] - contact_begin[island]};
  }
};

/// Every dynamic body is in one island, those without contacts alone. Bodies, contacts and islands (by their
/// first body) come in ascending order. Contacts between bodies that nothing can move are in none.
Islands find_islands(std::span<const BodyProperties> bodies, std::span<const ContactPoint> contacts);

/// For each body the fewest contacts between it and one that nothing can move: 0 for such a body, and the
/// largest number for a body that hangs on none.
std::vector<std::uint32_t> find_layers(std::span<const BodyProperties> bodies,
                                       std::span<const ContactPoint> contacts);

}  // namespace tandem::simulation
