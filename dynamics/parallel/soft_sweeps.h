#pragma once
#include <bit>
#include <cstdint>

#include "dynamics/one_lane.h"
#include "dynamics/parallel/meeting.h"
#include "dynamics/parallel/pair_groups.h"
#include "dynamics/parallel/turns.h"
#include "dynamics/parallel/worker.h"
#include "dynamics/soft_rules.h"
#include "dynamics/soft_visit.h"

namespace tandem::dynamics {

/// A SoftMotion that pairs change by turns.
struct SharedMotion {
  TurnWord centre, spin;
};

TANDEM_HD inline SoftMotion motion_of(const SharedMotion& shared) {
  SoftMotion out = {};
  for (int k = 0; k < 3; ++k)
    out.centre[k] = std::bit_cast<float>(shared.centre.data[k]),
    out.spin[k] = std::bit_cast<float>(shared.spin.data[k]);
  return out;
}

/// When the pair of each lane has its turn at its bodies in a sweep, and which bodies these are: kNoIndex is
/// one that contacts do not move.
struct SoftTurns {
  std::uint32_t body[2][kSoftWidth];
  BodyTurn turn[2][kSoftWidth];
};

/// Stands for JointSweeps in a step without joints.
struct NoJointSweeps {
  static constexpr bool kAny = false;
};

/// A sweep over all pairs.
struct Sweep {
  enum class Kind : std::uint8_t { start, push, follow, relax, rub, rebound };
  Kind kind;
  std::uint32_t substep;
};
inline constexpr std::uint32_t kSweepsOfSubstep = 2 + kRelaxingSweeps;  // push, relax, rub

/// number: of the sweep in its step.
TANDEM_HD inline Sweep sweep_of(std::uint32_t number, std::uint32_t substeps) {
  using enum Sweep::Kind;
  if (number == 0) return {start, 0};
  const std::uint32_t substep = (number - 1) / kSweepsOfSubstep, in_it = (number - 1) % kSweepsOfSubstep;
  if (substep >= substeps) return {rebound, substeps};
  if (in_it == 0) return {push, substep};
  if (in_it == kSweepsOfSubstep - 1) return {rub, substep};
  return {in_it == 1 ? follow : relax, substep};
}

/// All that the sweeps of a step read and write.
struct SoftSweeps {
  SoftRows rows;  // without motions
  const SoftTurns* turns;
  SharedMotion *velocities, *moved;  // of each body: what the step adds; turn k of `moved` is substep k
  SoftMotion *gains, *starts;        // of each body: see work_on()
  const std::uint32_t* groups;
  const ColourPlaces* colours;  // see GroupsView
  const std::uint32_t* shared;
  std::uint32_t* arrived;  // see Meetings
  std::uint32_t* is_done;  // 1 once sweep_in_cluster() has done it all
  std::uint32_t bodies;
  const std::uint32_t* bounces;  // 1 where any pair does
  double h;
  std::uint32_t substeps;

  TANDEM_HD std::uint32_t sweeps() const {
    return 1 + substeps * kSweepsOfSubstep + (*bounces != 0 ? kRestitutionSweeps : 0);
  }
};

namespace soft_sweeps_detail {

/// A body as a pair sees it in a sweep.
struct Side {
  std::uint32_t body;
  std::uint32_t turn;
  bool moves, is_last;  ///< is_last: the pair does the body's work
};

template <typename Joints>
TANDEM_HD Side side_of(const SoftSweeps& all, const Joints& joints, const SoftTurns& turns, int side,
                       int lane, std::uint32_t sweep) {
  const std::uint32_t body = turns.body[side][lane];
  const BodyTurn turn = turns.turn[side][lane];
  Side out = {body, sweep * turn.turns + turn.turn, body != kNoIndex, turn.turn + 1 == turn.turns};
  if constexpr (Joints::kAny) {
    if (!out.moves || !joints.hold(body)) return out;
    out.turn += joints.turns_before(body, sweep, all.substeps), out.is_last = false;
  }
  return out;
}

TANDEM_HD inline void give_turn(SharedMotion& to, std::uint32_t turn, const SoftMotion& motion) {
  std::uint32_t centre[3], spin[3];
  for (int k = 0; k < 3; ++k)
    centre[k] = std::bit_cast<std::uint32_t>(motion.centre[k]),
    spin[k] = std::bit_cast<std::uint32_t>(motion.spin[k]);
  dynamics::give_turn(to.centre, turn, centre);
  dynamics::give_turn(to.spin, turn, spin);
}

TANDEM_HD inline MotionOf<OneLane> lanes_of(const SharedMotion& motion) {
  const auto [c, s] = dynamics::motion_of(motion);
  return {{{c[0]}, {c[1]}, {c[2]}}, {{s[0]}, {s[1]}, {s[2]}}};
}
TANDEM_HD inline SoftMotion motion_of(const MotionOf<OneLane>& lanes) {
  const auto& [c, s] = lanes;
  return {{c.x.v, c.y.v, c.z.v, 0}, {s.x.v, s.y.v, s.z.v, 0}};
}

/// The motions of a pair's bodies, 0 for one that contacts do not move.
struct PairMotions {
  SharedMotion velocities[2] = {}, moved[2] = {};
};

TANDEM_HD inline SharedMotion look_for_turn(const SharedMotion& from, std::uint32_t turn) {
  return {dynamics::look_for_turn(from.centre, turn), dynamics::look_for_turn(from.spin, turn)};
}
TANDEM_HD inline bool is_at(const SharedMotion& seen, std::uint32_t turn) {
  return seen.centre.turn == turn && seen.spin.turn == turn;
}

/// Waits until the pair has its turn at both bodies, and, if this sweep looks at how far bodies have moved,
/// until that is known.
TANDEM_HD inline PairMotions wait_for(const SoftSweeps& all, const Sweep& sweep, const Side (&sides)[2]) {
  const bool follows = sweep.kind == Sweep::Kind::follow;
  const std::uint32_t moved = sweep.substep + 1;
  PairMotions out;
  for (;; wait_for_turn()) {
    // All words are asked for before the first is looked at.
    for (int i = 0; i < 2; ++i) {
      const Side& side = sides[i];
      if (side.moves) out.velocities[i] = look_for_turn(all.velocities[side.body], side.turn);
      if (side.moves && follows) out.moved[i] = look_for_turn(all.moved[side.body], moved);
    }
    bool has_turn = true;
    for (int i = 0; i < 2; ++i) {
      const Side& side = sides[i];
      has_turn = has_turn && (!side.moves || is_at(out.velocities[i], side.turn));
      has_turn = has_turn && (!side.moves || !follows || is_at(out.moved[i], moved));
    }
    if (has_turn) return out;
  }
}

/// Returns whether there is work at bodies after a sweep.
TANDEM_HD inline bool has_work(const Sweep& sweep, std::uint32_t substeps) {
  using enum Sweep::Kind;
  return sweep.kind == start || sweep.kind == push || (sweep.kind == rub && sweep.substep + 1 != substeps);
}

/// Condition: there is such work.
TANDEM_HD inline BodyWork work_after(const Sweep& sweep) {
  using enum Sweep::Kind;
  return sweep.kind == start ? BodyWork::begin : sweep.kind == push ? BodyWork::move : BodyWork::accelerate;
}

/// Hands on the velocity of a body. The last pair that visits a body in a sweep does the body's work too.
TANDEM_HD inline void hand_on(const SoftSweeps& all, const Sweep& sweep, const Side& side,
                              SoftMotion velocity) {
  if (side.is_last && has_work(sweep, all.substeps)) {
    // No other pair writes these. They are read together.
    const SoftMotion gain = all.gains[side.body];
    SoftMotion start_of_substep = all.starts[side.body], moved = dynamics::motion_of(all.moved[side.body]);
    const BodyWork work = work_after(sweep);
    work_on(work, static_cast<float>(all.h), gain, start_of_substep, velocity, moved);
    if (work == BodyWork::move)
      give_turn(all.moved[side.body], sweep.substep + 1, moved);
    else
      all.starts[side.body] = start_of_substep;
  }
  give_turn(all.velocities[side.body], side.turn + 1, velocity);
}

// PairVisit has internal linkage, and so has what is made with it.
namespace {

/// ready() fills the motions and begins the pair's visit.
template <bool kMany, typename Ready>
TANDEM_HD void visit(const SoftSweeps& all, const Sweep& sweep, PairVisit<OneLane, kMany>& pair,
                     const MotionOf<OneLane> (&moved)[2], const Ready& ready) {
  using enum Sweep::Kind;
  switch (sweep.kind) {
    case start:
      return pair.start(ready);
    case push:
      return pair.push_apart(ready);
    case follow:
      return pair.follow_and_relax(static_cast<float>((sweep.substep + 1) * all.h), moved[0], moved[1],
                                   ready);
    case relax:
      return pair.relax(ready);
    case rub:
      return pair.rub(ready);
    case rebound:
      return pair.rebound(ready);
  }
}

template <bool kMany, typename Joints>
TANDEM_HD void visit_lane(const SoftSweeps& all, const Joints& joints, std::uint32_t number,
                          const Sweep& sweep, const Meetings& meetings, std::uint32_t group, int lane) {
  if (static_cast<std::uint32_t>(lane) >= all.rows.pairs[group].pairs) return;
  const SoftTurns& turns = all.turns[group];
  const Side sides[2] = {side_of(all, joints, turns, 0, lane, number),
                         side_of(all, joints, turns, 1, lane, number)};
  PairVisit<OneLane, kMany> pair(all.rows, group, lane);
  MotionOf<OneLane> moved[2] = {};
  visit(all, sweep, pair, moved, [&] {
    if constexpr (kMany) meetings.wait();
    const PairMotions motions = wait_for(all, sweep, sides);
    pair.begin(lanes_of(motions.velocities[0]), lanes_of(motions.velocities[1]));
    moved[0] = lanes_of(motions.moved[0]), moved[1] = lanes_of(motions.moved[1]);
  });
  if (sides[0].moves) hand_on(all, sweep, sides[0], motion_of(pair.a()));
  if (sides[1].moves) hand_on(all, sweep, sides[1], motion_of(pair.b()));
}

}  // namespace

/// Returns the task with which the tasks of a colour end. All pairs with a colour of their own count as one
/// colour, the one after the last that pairs may share.
TANDEM_HD inline std::uint32_t end_of_colour(const SoftSweeps& all, std::uint32_t colour) {
  const std::uint32_t next = colour + 1;
  return (next < kSharedColours    ? all.colours[next].first_group
          : next == kSharedColours ? *all.shared
                                   : *all.groups) /
         kGroupsOfTeam;
}

}  // namespace soft_sweeps_detail

/// Does a worker's part of all sweeps. Workers need not wait for the end of a colour or of a sweep: a pair
/// waits for those that come before it at its bodies, which are of earlier sweeps or of colours before its
/// own. Teams take groups in the order of colours, so that there always is a pair whose turn it is.
///
/// Where there are many tasks, many pairs would look for their turns all the time and keep the memory from
/// those that have theirs. So workers meet after each colour there: then hardly a pair looks in vain, but for
/// those with a colour of their own. On its way to a meeting a worker reads rows of the next colour.
///
/// kMany: on a GPU, what is for few tasks leaves many alone, and the other way round. Workers of the CPU
/// never meet. joints: NoJointSweeps or JointSweeps.
template <bool kMany, typename Joints>
TANDEM_HD void sweep_all(const SoftSweeps& all, const Joints& joints, const Worker& worker) {
  constexpr std::uint32_t kLanes = kGroupsOfTeam * kSoftWidth, kMostTasksWithoutMeeting = 600;
  const std::uint32_t tasks = *all.groups / kGroupsOfTeam;
  std::uint32_t most = tasks;
  if constexpr (Joints::kAny) {
    if (!joints.are_solved()) return;
    most = std::max(tasks, joints.tasks());
  }
  if (kCanMeet && (most > kMostTasksWithoutMeeting) != kMany) return;
  if (worker.team >= most && !kMany) return;
  if (*all.is_done != 0) return;
  Meetings meetings(all.arrived);
  const std::uint32_t sweeps = all.sweeps();
  for (std::uint32_t number = 0; number < sweeps; ++number) {
    const Sweep sweep = sweep_of(number, all.substeps);
    if constexpr (Joints::kAny) joints.template visit_before<kMany>(all, number, sweep, meetings, worker);
    std::uint32_t begin = 0;
    for (std::uint32_t colour = 0; begin < tasks; ++colour) {
      const std::uint32_t end = kMany ? soft_sweeps_detail::end_of_colour(all, colour) : tasks;
      if (begin == end) continue;
      for (std::uint32_t task = begin + worker.team; task < end; task += worker.teams) {
        for (std::uint32_t lane = worker.lane; lane < kLanes; lane += worker.lanes)
          soft_sweeps_detail::visit_lane<kMany>(all, joints, number, sweep, meetings,
                                                kGroupsOfTeam * task + lane / kSoftWidth,
                                                static_cast<int>(lane % kSoftWidth));
      }
      if constexpr (kMany) meetings.wait(), meetings.come();
      begin = end;
    }
  }
}

}  // namespace tandem::dynamics
