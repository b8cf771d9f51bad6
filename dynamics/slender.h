#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "dynamics/contact_point.h"

/// Which islands without joints are solved by Newton's method, and in how many parts.
namespace tandem::dynamics {

/// Returns how many multiplications it takes to eliminate so many bodies that hang together with as many of
/// the next layer.
TANDEM_HD inline double elimination_work(std::uint32_t bodies) {
  const double size = 6 * static_cast<double>(bodies);
  return size * size * size;
}

/// An island is slender if factorising its matrix costs no more than what Newton's method has to do for each
/// contact. With bodies by layer the matrix is a band, and the work is the sum over layers of
/// elimination_work().
inline constexpr double kForAContact = 3000;
TANDEM_HD inline bool is_slender(double work, std::size_t contacts) {
  return work <= kForAContact * static_cast<double>(contacts);
}

/// Returns by how much the bodies of a contact turn against each other about its normal in a step, in
/// radians.
TANDEM_HD inline double turn_about(const ContactPoint& contact, std::span<const BodyState> states,
                                   double dt) {
  const Vector3 spin = states[contact.body_b].angular_velocity - states[contact.body_a].angular_velocity;
  return dt * std::fabs(dot(contact.normal, spin));
}

/// Returns into how many parts a step of Newton's method is divided. Bodies that spin fast about the normal
/// of a contact, as tops do, have several, in which their contacts turn with them. turn: see turn_about(),
/// the largest of all contacts.
TANDEM_HD inline std::uint32_t parts_for(double turn) {
  constexpr double kTurn = 0.1, kMostParts = 16;  // radians in a part
  return static_cast<std::uint32_t>(std::min(std::floor(turn / kTurn) + 1, kMostParts));
}

}  // namespace tandem::dynamics
