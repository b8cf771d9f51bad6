#pragma once
#include <cmath>
#include <cstdint>

#include "dynamics/parallel/atomics.h"
#include "dynamics/soft_rules.h"

namespace tandem::dynamics {

/// What contacts do to the energy of a body in a soft step. Let y0 be the velocity that the body would end
/// with if nothing touched it, and d what contacts add to it, in coordinates where |y|^2 / 2 is the energy.
/// The part s of d changes the energy by s y0.d + s^2 |d|^2 / 2.
struct WorkOnBody {
  double along;   ///< y0.d
  double square;  ///< |d|^2 / 2

  /// Returns the larger of both sizes; infinity where one is no number.
  TANDEM_HD double largest() const {
    const double both = std::fabs(along) + square;
    return both < INFINITY ? std::fmax(std::fabs(along), square) : INFINITY;
  }
};

/// velocity: what the step has added. dt: of the step.
TANDEM_HD inline WorkOnBody work_on_body(const SteppedBody& body, const SoftMotion& velocity, double dt) {
  const Vector6 free = body.velocity + dt * body.gravity;
  const Vector6 by_contacts = added_motion(body.scale, velocity) - dt * body.gravity;
  return {dot(free, by_contacts), 0.5 * dot(by_contacts, by_contacts)};
}

/// The work of contacts on all bodies of an island. Exact impulses of contacts add no energy. Those that a
/// soft step ends with may, where it is far from the solution: bodies that are wedged between others got
/// speeds of 2 m/s. So bodies get only the part of them that adds none.
///
/// First note() the work on all bodies, then add() it. The bytes do not depend on the order, since the sums
/// are of whole numbers, multiples of 2^-38 of the largest term: up to 2^24 bodies fit.
struct ContactWork {
  double largest = 0;  ///< infinite: something drives the bodies, so that their energy may grow
  std::uint64_t along = 0, square = 0;

  TANDEM_HD void note(const WorkOnBody& work) { atomic_most(largest, work.largest()); }
  TANDEM_HD void note_drive() { atomic_most(largest, INFINITY); }
  TANDEM_HD void add(const WorkOnBody& work) {
    if (!(largest > 0 && largest < INFINITY)) return;
    int exponent = 0;
    std::frexp(largest, &exponent);
    const auto add_to = [&](std::uint64_t& sum, double term) {
      constexpr int kBits = 38;
      atomic_add(sum,
                 static_cast<std::uint64_t>(static_cast<std::int64_t>(std::ldexp(term, kBits - exponent))));
    };
    add_to(along, work.along), add_to(square, work.square);
  }

  /// Returns the largest part of the impulses, at most 1, that adds no energy.
  TANDEM_HD double part() const {
    const auto along_all = static_cast<double>(static_cast<std::int64_t>(along));
    const auto square_all = static_cast<double>(static_cast<std::int64_t>(square));
    if (!(along_all + square_all > 0)) return 1;
    return along_all < 0 ? -along_all / square_all : 0;
  }
};

}  // namespace tandem::dynamics
