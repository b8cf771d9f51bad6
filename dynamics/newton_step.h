#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "dynamics/convex_contacts.h"

namespace tandem::dynamics {

/// What NewtonStep works with.
struct NewtonScratch {
  ConvexScratch convex;
  ConvexGoal goal;
  IslandImpulses impulse, way_impulse;
  std::span<double> target;      // of velocities along normals
  std::span<Vector6> end, mean;  // velocities at the end; those of the displacement

  TANDEM_HD void carve(Carver& carver, const ContactIsland& island, std::size_t block_count) {
    convex.carve(carver, island, block_count), goal.carve(carver, island);
    impulse.carve(carver, island), way_impulse.carve(carver, island);
    carver.take(island.contacts.size(), target);
    carver.take(island.bodies.size(), end), carver.take(island.bodies.size(), mean);
  }
};

/// Solves the contacts of a whole island to convergence, in passes. Each finds the velocities that make the
/// function of ConvexContacts least, with the impulses and the bounds of friction that the pass before ended
/// with; the first starts from those of the step before. At the least, a contact misses its law by R times
/// the change of its impulse, so passes end in Coulomb's law without any softness (the method of multipliers;
/// Tresca's iteration for friction). They end when another would change no velocity of a contact by more than
/// 10^-4 of what gravity gives in a step, and 10^-6 of the fastest approach.
///
/// The displacement is that of the velocities nearest, in the metric of mass, to the mean of those at the
/// start and at the end, that bring no contact deeper than the slop and take away the part `correction` of
/// what is deeper. The mean makes sliding and stopping right to second order.
///
/// Joints: NoJoints or ConvexJoints. All threads of a team have a NewtonStep of the same arguments.
template <typename Team, typename Joints>
class NewtonStep {
 public:
  /// Condition: see ConvexContacts.
  TANDEM_HD NewtonStep(const Team& team, const ContactIsland& island, const NewtonScratch& scratch,
                       const StepBodies& step, double correction, Joints& joints)
      : team_(team),
        island_(island),
        with_(scratch),
        step_(step),
        correction_(correction),
        joints_(joints),
        contacts_(team, island, scratch.convex, joints) {
    team.each(island.contact_count(),
              [&](std::uint32_t i) { scratch.impulse.contact[i] = island.impulse[i]; });
    team.each(island.pair_count(),
              [&](std::uint32_t i) { scratch.impulse.turning[i] = island.pairs[i].impulse; });
    team.each(island.body_count(), [&](std::uint32_t j) { scratch.end[j] = island.velocity[j]; });
    team.barrier();
  }

  /// Solves the step of an island without joints, and gives it the results. False: it has not converged, and
  /// the island is as before.
  TANDEM_HD bool solve() {
    if (!solve_velocities()) return false;
    take_mean();
    if (!solve_displacement()) return false;
    write();
    return true;
  }

  /// Finds the velocities at the end. Result: whether it converged.
  TANDEM_HD bool solve_velocities() {
    constexpr double kSoftness = 1e-5;
    constexpr int kMostPasses = 30;
    constexpr double kOfJoints = 1e-3;  // times what velocities of contacts may still change, those of joints
    constexpr double kHelps = 0.5, kStuck = 30;
    constexpr double kNearer = 0.9;
    constexpr int kNoHelp = 10;  // passes, none of which came nearer
    contacts_.set_softness(kSoftness);
    set_goal_of_velocities();
    const double solved = least_change();
    double joints_before = INFINITY, contacts_before = INFINITY, least = INFINITY;
    int least_pass = 0;
    for (int pass = 0; pass < kMostPasses; ++pass) {
      if (!contacts_.minimise(with_.goal, with_.end, with_.impulse, left_)) return false;
      const double contacts = next_change();
      bool holds = true, is_stuck = false;
      if constexpr (Joints::kAny) {
        // Joints that hold the same twice may ask for what cannot be, and so may contacts of bodies that they
        // join: another pass would not help.
        const double joints = joints_.next_change();
        holds = joints <= kOfJoints * solved || joints > kHelps * joints_before;
        is_stuck = contacts > kHelps * contacts_before;
        joints_before = joints;
      }
      if (contacts <= (is_stuck ? kStuck : 1) * solved && holds) {
        balance();
        return true;
      }
      if (contacts < kNearer * least)
        least = contacts, least_pass = pass;
      else if (pass - least_pass >= kNoHelp && contacts > kStuck * solved)
        return false;
      take_impulses();
      contacts_before = contacts;
    }
    return false;
  }

  /// Finds the displacement that is nearest to that of the velocities `goal.free`. Result: whether it
  /// converged.
  TANDEM_HD bool solve_displacement() {
    constexpr double kSoftness = 1e-2;  // what is left is corrected in the next step
    contacts_.set_softness(kSoftness);
    team_.each(island_.contact_count(), [&](std::uint32_t i) {
      const double s = island_.separation[i];
      // The way is that of the mean drive.
      with_.goal.target[i] = island_.drive_beyond_mean[i] - (s < 0 ? correction_ : 1) * s / step_.dt;
      with_.goal.impulse.contact[i] = {}, with_.goal.bound[i] = 0;
    });
    team_.each(island_.pair_count(),
               [&](std::uint32_t i) { with_.goal.impulse.turning[i] = {}, with_.goal.turning_bound[i] = 0; });
    team_.each(island_.body_count(), [&](std::uint32_t j) { with_.mean[j] = with_.goal.free[j]; });
    if constexpr (Joints::kAny) joints_.aim_at_ways(step_.dt);
    team_.barrier();
    const bool converged = contacts_.minimise(with_.goal, with_.mean, with_.way_impulse, left_);
    if constexpr (Joints::kAny) joints_.take_way_impulses();
    return converged;
  }

  /// Makes `goal.free` the mean of the velocities at the start and at the end.
  TANDEM_HD void take_mean() {
    team_.each(island_.body_count(), [&](std::uint32_t j) {
      with_.goal.free[j] = j > 0 ? 0.5 * (island_.velocity[j] + with_.end[j]) : Vector6{};
    });
    team_.barrier();
  }

  /// Gives the island its velocities, displacements and impulses. Condition: all has converged.
  TANDEM_HD void write() {
    team_.each(island_.body_count(), [&](std::uint32_t j) {
      island_.velocity[j] = with_.end[j], island_.displacement[j] = step_.dt * with_.mean[j];
    });
    team_.each(island_.contact_count(),
               [&](std::uint32_t i) { island_.impulse[i] = with_.impulse.contact[i]; });
    team_.each(island_.pair_count(),
               [&](std::uint32_t i) { island_.pairs[i].impulse = with_.impulse.turning[i]; });
    team_.barrier();
  }

  /// Returns what velocities of contacts may still change.
  TANDEM_HD double least_change() const {
    constexpr double kOfGravity = 1e-4, kOfApproach = 1e-6;
    double approach = team_.most(0, island_.contact_count(), [&](std::uint32_t i) {
      return norm(island_.relative(i, island_.velocity) + island_.drive[i]);
    });
    if constexpr (Joints::kAny) approach = std::max(approach, joints_.fastest(island_.velocity, with_.end));
    const double pull = team_.most(0, island_.body_count() - 1,
                                   [&](std::uint32_t k) { return step_.pull_of(island_.bodies[k + 1]); });
    return kOfGravity * step_.dt * pull + kOfApproach * approach;
  }

 private:
  // Makes the velocities those that the impulses give, so that momentum is kept to rounding.
  TANDEM_HD void balance() {
    if constexpr (Joints::kAny) {
      for (std::uint32_t j = 1; j < island_.body_count(); ++j) with_.end[j] -= contacts_.gradient()[j];
    }
  }

  TANDEM_HD void set_goal_of_velocities() {
    team_.each(island_.body_count(), [&](std::uint32_t j) {
      with_.goal.free[j] = island_.velocity[j];
      if (j > 0) with_.goal.free[j] += step_.dt * island_.stepped[j].gravity;
    });
    team_.each(island_.contact_count(), [&](std::uint32_t i) {
      const double gap = std::max(0.0, island_.separation[i]);
      with_.target[i] = island_.rebound[i] > 0 ? rebound_at_end(i, gap) : -gap / step_.dt;
      with_.goal.target[i] = with_.target[i];
    });
    if constexpr (Joints::kAny) joints_.aim_at_velocities(step_.dt, with_.end);
    take_impulses();
  }

  // The velocity along a normal at the end of a step in which a gap closes and the bodies bounce. The
  // displacement is that of the mean velocity, so the gap that it leaves is as high as they have risen by
  // then, and has its part of the energy.
  TANDEM_HD double rebound_at_end(std::size_t i, double gap) const {
    const double rebound = island_.rebound[i], dt = step_.dt;
    const auto gravity = [&](std::uint32_t j) -> const Vector6& { return island_.stepped[j].gravity; };
    const ContactRow& normal = island_.normal[i];
    const double fall = -(dot(normal.a, gravity(island_.a[i])) + dot(normal.b, gravity(island_.b[i])));
    const double approach = -island_.along(normal, i, island_.velocity) - island_.drive[i].x;
    const double half = 0.5 * fall * dt;
    const double square = half * half - fall * (2 * gap - approach * dt) + rebound * rebound;
    const double velocity = std::sqrt(std::max(0.0, square)) - half;
    return gap + 0.5 * dt * (velocity - approach) > 0 ? velocity : rebound;
  }

  TANDEM_HD void take_impulses() {
    team_.each(island_.contact_count(), [&](std::uint32_t i) {
      with_.goal.impulse.contact[i] = with_.impulse.contact[i];
      with_.goal.bound[i] = friction_bound(i);
    });
    team_.each(island_.pair_count(), [&](std::uint32_t i) {
      with_.goal.impulse.turning[i] = with_.impulse.turning[i];
      with_.goal.turning_bound[i] = turning_bound(i);
    });
    if constexpr (Joints::kAny) joints_.take_impulses();
    team_.barrier();
  }

  TANDEM_HD double friction_bound(std::size_t contact) const {
    return island_.friction[contact] * with_.impulse.contact[contact].x;
  }

  TANDEM_HD double turning_bound(std::size_t pair) const {
    double push = 0;
    for (std::uint32_t i = island_.pairs[pair].begin; i < island_.pairs[pair].end; ++i)
      push += with_.impulse.contact[i].x;
    return island_.pairs[pair].rolling_resistance * push;
  }

  // Returns by how much another pass would change velocities of contacts; of pairs that turn, as velocities
  // at an arm about as long as that of a contact.
  TANDEM_HD double next_change() const {
    const std::uint32_t contacts = island_.contact_count();
    return team_.most(0, contacts + island_.pair_count(), [&](std::uint32_t i) {
      return i < contacts ? next_change_of_contact(i) : next_change_of_turning(i - contacts);
    });
  }

  TANDEM_HD double next_change_of_contact(std::uint32_t i) const {
    const Vector3 step = with_.impulse.contact[i] - with_.goal.impulse.contact[i];
    const double bound = friction_bound(i), friction = norm(across(with_.impulse.contact[i]));
    const bool slips = friction >= (1 - 1e-9) * std::min(bound, with_.goal.bound[i]);
    const double change = std::max(contacts_.normal_softness(i) * std::fabs(step.x),
                                   contacts_.friction_softness(i) * norm(across(step)));
    return std::max(change,
                    slips ? island_.friction_mobility(i) * std::fabs(bound - with_.goal.bound[i]) : 0.0);
  }

  TANDEM_HD double next_change_of_turning(std::uint32_t i) const {
    const TouchingPair& pair = island_.pairs[i];
    const double arm = std::sqrt(island_.friction_mobility(pair.begin) / pair.mobility);
    const double bound = turning_bound(i);
    const bool turns =
        norm(with_.impulse.turning[i]) >= (1 - 1e-9) * std::min(bound, with_.goal.turning_bound[i]);
    const double step = norm(with_.impulse.turning[i] - with_.goal.impulse.turning[i]);
    return std::max(arm * contacts_.turning_softness(i) * step,
                    turns ? arm * pair.mobility * std::fabs(bound - with_.goal.turning_bound[i]) : 0.0);
  }

  static constexpr std::uint32_t kMostFactorisations = 100;

  const Team& team_;
  const ContactIsland& island_;
  const NewtonScratch& with_;
  const StepBodies& step_;
  double correction_;
  Joints& joints_;
  ConvexContacts<Team, Joints> contacts_;
  std::uint32_t left_ = kMostFactorisations;
};

}  // namespace tandem::dynamics
