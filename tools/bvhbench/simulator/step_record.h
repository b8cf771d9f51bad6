#pragma once
#include <Eigen/Core>
#include <cstdint>

namespace tandem::simulation {

/// What a step found and did. The contacts are those of the state before the step; energies, momenta and
/// speeds are those of the state after it, over all dynamic bodies.
struct StepRecord {
  double time = 0;  ///< at the end of the step

  // Seconds that the phases took.
  double update_seconds = 0, broad_phase_seconds = 0, traversal_seconds = 0, triangle_test_seconds = 0,
         transfer_seconds = 0, contact_seconds = 0, solver_seconds = 0, step_seconds = 0;

  std::uint64_t object_pairs = 0, block_pairs = 0, candidates = 0, triangle_pairs = 0;
  std::uint64_t segments = 0, patches = 0, open_curves = 0, contacts = 0;
  std::uint64_t islands = 0, newton_islands = 0, sleeping = 0, reentered = 0;

  double contact_ratio =
      0;  ///< pairs of triangles that meet, by the triangles of dynamic bodies: the paper's Figure 6
  double contact_area = 0;
  double penetration_max = 0, penetration_mean = 0;  ///< over the contacts
  double residual_max = 0, residual_rms = 0;         ///< SolverStatistics

  double kinetic_energy = 0, potential_energy = 0;  ///< potential: 0 at the world's origin
  Eigen::Vector3d linear_momentum = Eigen::Vector3d::Zero(), angular_momentum = Eigen::Vector3d::Zero();
  double speed_max = 0, speed_mean = 0;  ///< of centres of mass
  double spin_max = 0;                   ///< of the fastest point about its body's centre
};

}  // namespace tandem::simulation
