#pragma once
#include <algorithm>
#include <cstdint>

#include "dynamics/parallel/joint_arrays.h"
#include "dynamics/parallel/pair_groups.h"
#include "dynamics/parallel/soft_sweeps.h"

namespace tandem::dynamics {

/// What the joints of a step do before a sweep over its pairs: one visit of each.
enum class JointWork : std::uint8_t {
  push,          ///< adds the impulses that it starts with
  add_due,       ///< begins a substep
  visit_softly,  ///< so that what is out of place comes back
  follow,        ///< makes the rows anew, and changes no velocity
  visit,
};

/// The joints in the sweeps of a step. Bodies are handed on from joints to pairs and back as from pair to
/// pair: joints come before a sweep, in phases, and at each body they have their turns by ascending colour.
/// The first joint of a body does the body's work in place of the last pair.
struct JointSweeps {
  static constexpr bool kAny = true;

  JointArrays joints;
  SoftJointNumbers numbers;
  const BodyProperties* bodies;  ///< of the step
  const BodyState* states;       ///< at its start
  const SteppedBody* stepped;
  const std::uint32_t* pairs_of;  ///< how many pairs move each body
  const SoftStepNeeds* needs;

  TANDEM_HD bool are_solved() const { return needs->has_room != 0; }
  TANDEM_HD std::uint32_t tasks() const { return joints.tasks; }
  TANDEM_HD bool hold(std::uint32_t body) const { return joints.joints_of[body] > 0; }

  /// Returns how many turns joints have had at a body that moves before a sweep.
  TANDEM_HD std::uint32_t turns_before(std::uint32_t body, std::uint32_t sweep,
                                       std::uint32_t substeps) const {
    return phases_before(sweep, substeps) * joints.joints_of[body];
  }

  /// Does a worker's part of what joints do before a sweep.
  template <bool kMany>
  TANDEM_HD void visit_before(const SoftSweeps& all, std::uint32_t number, const Sweep& sweep,
                              Meetings& meetings, const Worker& worker) const {
    using enum Sweep::Kind;
    const auto do_work = [&](JointWork work, std::uint32_t phases_after) {
      const std::uint32_t phase = phases_before(number, all.substeps) - phases_after;
      visit_all<kMany>(all, {work, number, sweep.substep, phase}, meetings, worker);
    };
    if (sweep.kind == push) {
      if (sweep.substep == 0) do_work(JointWork::push, 3);
      do_work(JointWork::add_due, 2);
      do_work(JointWork::visit_softly, 1);
    }
    if (sweep.kind == follow) do_work(JointWork::follow, 1);
    if (sweep.kind == follow || sweep.kind == relax) do_work(JointWork::visit, 1);
  }

  /// Returns a body of a joint.
  TANDEM_HD SoftJointBody body(std::uint32_t body) const {
    const bool moves = body != kNoIndex && bodies[body].motion == Motion::moving;
    return {body, bodies, states, moves ? &stepped[body] : nullptr};
  }

 private:
  using Side = soft_sweeps_detail::Side;

  struct Phase {
    JointWork work;
    std::uint32_t sweep, substep;
    std::uint32_t number;  // of phases in which velocities change
  };

  // Phases in which velocities change: one before the first substep; in each, two before the sweep that
  // pushes and one before each that relaxes.
  TANDEM_HD static std::uint32_t phases_before(std::uint32_t sweep, std::uint32_t substeps) {
    constexpr std::uint32_t kPhases = 2 + kRelaxingSweeps;
    if (sweep == 0) return 0;
    const std::uint32_t substep = (sweep - 1) / kSweepsOfSubstep, in_it = (sweep - 1) % kSweepsOfSubstep;
    if (substep >= substeps) return 1 + substeps * kPhases;
    return 1 + substep * kPhases + std::min(2 + in_it, kPhases);
  }

  template <bool kMany>
  TANDEM_HD void visit_all(const SoftSweeps& all, const Phase& phase, Meetings& meetings,
                           const Worker& worker) const {
    std::uint32_t begin = 0;
    for (std::uint32_t colour = 0; colour < joints.colours; ++colour) {
      const std::uint32_t end = joints.colour_end[colour];
      if constexpr (kMany) meetings.wait();
      for (std::uint32_t task = begin + worker.team; task < end; task += worker.teams) {
        for (std::uint32_t lane = worker.lane; lane < kJointsOfTeam; lane += worker.lanes)
          visit(all, phase, kJointsOfTeam * task + lane);
      }
      if constexpr (kMany) meetings.come();
      begin = end;
    }
  }

  TANDEM_HD void visit(const SoftSweeps& all, const Phase& phase, std::uint32_t place) const {
    const PlacedJoint placed = joints.places[place];
    SoftJoint& soft = joints.soft[place];
    if (placed.joint == kNoIndex || soft.count == 0) return;
    const Joint& joint = joints.joints[placed.joint];
    const SoftJointBodies of = {body(joint.a), body(joint.b)};
    const Side sides[2] = {side_of(phase, joint.a, of.a.moves, placed.turn_a),
                           side_of(phase, joint.b, of.b.moves, placed.turn_b)};
    const bool is_first[2] = {of.a.moves && placed.turn_a == 0, of.b.moves && placed.turn_b == 0};
    if (phase.work == JointWork::follow) return follow(all, phase, joint, of, sides, is_first, soft);
    const soft_sweeps_detail::PairMotions shared =
        soft_sweeps_detail::wait_for(all, {Sweep::Kind::push, phase.substep}, sides);
    SoftMotion velocities[2];
    for (int i = 0; i < 2; ++i) {
      velocities[i] = motion_of(shared.velocities[i]);
      if (phase.work == JointWork::add_due && is_first[i])
        begin_substep(all, phase, sides[i].body, velocities[i]);
    }
    JointMotion y = {of.a.y_of(velocities[0]), of.b.y_of(velocities[1])};
    change(phase, soft, y);
    if (of.a.moves) hand_on(all, sides[0], of.a.added_of(y.a));
    if (of.b.moves) hand_on(all, sides[1], of.b.added_of(y.b));
  }

  TANDEM_HD Side side_of(const Phase& phase, std::uint32_t body, bool moves, std::uint32_t turn) const {
    if (!moves) return {kNoIndex, 0, false, false};
    const std::uint32_t before = phase.sweep * pairs_of[body] + phase.number * joints.joints_of[body];
    return {body, before + turn, true, false};
  }

  // Changes the velocities of a joint's bodies.
  TANDEM_HD void change(const Phase& phase, SoftJoint& soft, JointMotion& y) const {
    switch (phase.work) {
      case JointWork::push:
        return push_joint(soft, y);
      case JointWork::add_due:
        if (phase.substep > 0) sum_up(soft);  // of the substep before
        return dynamics::add_due(soft, y);
      case JointWork::visit_softly:
        return visit_joint(soft, y, numbers.h, &numbers.softness);
      default:
        return visit_joint(soft, y, numbers.h, nullptr);
    }
  }

  // Accelerates a body. No other joint writes its start.
  TANDEM_HD void begin_substep(const SoftSweeps& all, const Phase& phase, std::uint32_t body,
                               SoftMotion& velocity) const {
    SoftMotion none = {};
    work_on(phase.substep == 0 ? BodyWork::begin : BodyWork::accelerate, static_cast<float>(all.h),
            all.gains[body], all.starts[body], velocity, none);
  }

  // The first joint of a body moves it, the others wait for that.
  TANDEM_HD void follow(const SoftSweeps& all, const Phase& phase, const Joint& joint,
                        const SoftJointBodies& of, const Side (&sides)[2], const bool (&is_first)[2],
                        SoftJoint& soft) const {
    SoftMotion moved[2] = {};
    for (int i = 0; i < 2; ++i) {
      if (!is_first[i]) continue;
      const std::uint32_t body = sides[i].body;
      SoftMotion velocity = wait_for(all.velocities[body], sides[i].turn), none = {};
      moved[i] = motion_of(all.moved[body]);
      work_on(BodyWork::move, static_cast<float>(all.h), none, none, velocity, moved[i]);
      soft_sweeps_detail::give_turn(all.moved[body], phase.substep + 1, moved[i]);
    }
    for (int i = 0; i < 2; ++i) {
      if (sides[i].moves && !is_first[i]) moved[i] = wait_for(all.moved[sides[i].body], phase.substep + 1);
    }
    const double time = (phase.substep + 1) * all.h;
    follow_joint(joint, joints.memory[soft.joint].position, of, time,
                 {of.a.way_of(time, moved[0]), of.b.way_of(time, moved[1])}, soft);
  }

  TANDEM_HD static SoftMotion wait_for(const SharedMotion& of, std::uint32_t turn) {
    for (;; wait_for_turn()) {
      const SharedMotion seen = soft_sweeps_detail::look_for_turn(of, turn);
      if (soft_sweeps_detail::is_at(seen, turn)) return motion_of(seen);
    }
  }
  TANDEM_HD static void hand_on(const SoftSweeps& all, const Side& side, const SoftMotion& velocity) {
    soft_sweeps_detail::give_turn(all.velocities[side.body], side.turn + 1, velocity);
  }
};

}  // namespace tandem::dynamics
