#pragma once
#include <cstdint>

#include "kernels/common/block_pair.h"

namespace tandem::dynamics {

/// Pairs of bodies that a soft step solves side by side: no two of them move the same body, so that the
/// result does not depend on how many a machine takes at once.
inline constexpr int kSoftWidth = 16;

/// A number of each pair.
struct alignas(64) SoftNumber {
  float of[kSoftWidth];
};

/// How a body moves in a soft step, or how far it has since the step began: its centre, and its spin in
/// coordinates in which its inertia is 1. The last of each four is 0.
struct alignas(32) SoftMotion {
  float centre[4], spin[4];
};

/// A direction of a contact: its velocity is along . (centre_b - centre_a) + turn_a . spin_a + turn_b .
/// spin_b.
struct SoftDirection {
  SoftNumber along[3], turn_a[3], turn_b[3];
};

/// The normals of one contact of each pair: what every sweep looks at. The first pass makes what follows from
/// other numbers; until then the normal's turn_a and turn_b are the arms, that is where the contact is from
/// the centres of mass, mass is 1 where a pair has such a contact, turn_a of the first direction of friction
/// is the velocity of b's point as seen from a's, and that of the second is the impulse across the normal.
struct SoftNormal {
  SoftDirection direction;
  SoftNumber mass;  ///< 0 where a pair has no such contact
  SoftNumber drive;
  SoftNumber followed;  ///< the separation as it changes
  SoftNumber impulse;
};

/// Has what few sweeps look at.
struct SoftGap {
  SoftNumber separation;  ///< at the start of the step
  SoftNumber opposed;     ///< by how much depth the push is less
  SoftNumber rebound;     ///< the velocity along the normal that restitution asks for, or 0
  SoftNumber strongest;   ///< the largest impulse of any visit, where a pair of the group bounces
};

/// Their friction.
struct SoftFriction {
  SoftDirection first, second;
  SoftNumber mass, coefficient;
  SoftNumber first_drive, second_drive, first_impulse, second_impulse;
  SoftNumber sum_of_normal, sum_of_first, sum_of_second;  ///< of the impulses of all substeps
};

/// Says how each pair turns, and what resists that.
struct SoftTurning {
  SoftNumber spread_a[9], spread_b[9];  ///< turn spins into those of the world, row by row
  SoftNumber drive[3], mass, lever, impulse[3];
};

/// Up to kSoftWidth pairs of one colour.
struct SoftPairs {
  std::uint32_t body_a[kSoftWidth], body_b[kSoftWidth];  ///< one of the group stands for all that contacts do
                                                         ///< not move, and has no inverse mass
  SoftNumber inverse_mass_a, inverse_mass_b;
  SoftNumber bias_rate, mass_scale, impulse_scale;  ///< of a soft row where bodies are too deep in each other
  std::uint32_t pairs = 0;                          ///< how many
  std::uint32_t first = 0;                          ///< of their rows
  std::uint32_t contacts = 0;                       ///< of the pair that has the most
  std::uint32_t bounces = 0;                        ///< 1 where a rebound is more than 0
  std::uint32_t is_opposed = 0;                     ///< 1 where an `opposed` is more than 0
  SoftNumber largest_residual, residual_squares;    ///< of the rows of each pair, a result
};

/// All that the passes of a soft step read and write.
struct SoftRows {
  SoftMotion* velocities;   ///< of each body
  const SoftMotion* moved;  ///< how far each has
  SoftPairs* pairs;
  SoftTurning* turnings;
  SoftNormal* normals;
  SoftGap* gaps;
  SoftFriction* frictions;
  float inverse_h;  ///< of the seconds of a substep
};

/// Visits of the SoftPairs from begin to end, all of one colour, `time` seconds after the step began. Every
/// variant gives the same bytes.
struct SoftPasses {
  using Pass = void (*)(const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float time);
  Pass start;    ///< makes the rows, and adds the impulses to the velocities
  Pass push;     ///< soft normals
  Pass follow;   ///< finds the separations where the bodies are now, and does what `relax` does
  Pass relax;    ///< normals without what pushes bodies apart
  Pass rub;      ///< friction, and what resists turning
  Pass rebound;  ///< normals that bounce
  Pass judge;    ///< finds what all this leaves undone
};

/// The passes by these lanes, or null where this machine or this build lacks them.
const SoftPasses* soft_passes(BlockPairVariant variant);

// Each is defined in a file of dynamics/variants/.
extern const SoftPasses kSoftLanes4, kSoftAvx2, kSoftAvx512;

}  // namespace tandem::dynamics
