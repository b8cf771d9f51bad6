#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>

#include "dynamics/contact_work.h"
#include "dynamics/parallel/cluster_sweeps.h"
#include "dynamics/parallel/joint_step.h"
#include "dynamics/parallel/labels.h"
#include "dynamics/parallel/pair_groups.h"
#include "dynamics/parallel/soft_sweeps.h"

namespace tandem::dynamics {

/// The data of which ParallelSoftStep makes a step, all of them in the executor's memory. Contacts are those
/// of pairs; others keep their impulses.
struct SoftStepInput {
  const BodyProperties* bodies;  ///< with motions as they act: bodies that sleep are fixed
  const BodyState* states;       ///< at the start
  const Pull* pulls;
  std::uint32_t body_count;
  const ContactPoint* contacts;
  const ContactImpulse* start_impulses;
  const ContactPair* pairs;         ///< by ascending (a, b), each with a body that moves
  const std::uint32_t* pair_count;  ///< how many
  std::uint32_t most_pairs;         ///< how many there is room for
  double dt;
  JointArrays joints = {};
  const std::uint8_t* is_solved = nullptr;  ///< bodies that have their states at the end; null: none has
};

/// Returns the numbers that rows are made of.
inline StepNumbers step_numbers(const SoftStepInput& input, const SolverOptions& options) {
  StepNumbers step;
  step.bodies = {input.bodies, input.body_count};
  step.contacts = {input.contacts, std::size_t{1} << 32};  // more than numbers of 32 bits can name
  step.pulls = {input.pulls, input.body_count};
  step.states = {input.states, input.body_count};
  step.dt = input.dt, step.options = options;
  return step;
}

/// What a step writes. Each array may be the one of the input that it follows from.
struct SoftStepOutput {
  BodyState* states;         ///< at the end
  ContactImpulse* impulses;  ///< as a whole step would need them, to start the next one with
  ContactImpulse* done;      ///< what each contact did; see StepInput. Null: nobody asks
};

/// Says for how much ParallelSoftStep has room.
struct SoftStepRoom {
  std::uint32_t bodies, pairs, groups, rows;
};

/// Returns a room that most steps do with. contacts: of all pairs.
inline SoftStepRoom usual_room(std::uint32_t bodies, std::uint32_t pairs, std::uint32_t contacts) {
  constexpr std::uint32_t kColours = 32;
  const std::uint32_t groups = pairs / kSoftWidth + kGroupsOfTeam * kColours;
  return {bodies, pairs, groups, contacts / (kSoftWidth / 2) + 4 * groups};
}

/// Returns the room to make where a step had too little: half as much more than it needs.
template <typename Number>
Number roomy(Number needed) {
  return needed + needed / 2;
}
inline SoftStepRoom larger_room(const SoftStepRoom& room, const SoftStepNeeds& needs) {
  const auto larger = [](std::uint32_t has, std::uint32_t needed) {
    return needed > has ? roomy(needed) : has;
  };
  return {room.bodies, larger(room.pairs, needs.pairs), larger(room.groups, needs.groups),
          larger(room.rows, needs.rows)};
}

/// All that a step reads and writes, but for the input.
struct SoftStepView {
  SoftNumbers numbers;
  SoftSweeps sweeps;
  GroupsView groups;
  SoftStepInput input;
  SoftStepOutput output;
  SteppedBody* bodies;
  SoftTurns* turns;
  std::uint32_t* bounces;
  std::uint32_t* label;  ///< of each body; see labels.h
  ContactWork* work;     ///< of the island whose first body it is

  TANDEM_HD double unit_root() const { return unit_root_of(groups.colouring.numbers->most_mass); }
  TANDEM_HD bool is_held(std::uint32_t body) const {
    return groups.colouring.pairs_of[body] > 0 ||
           (input.bodies[body].motion == Motion::moving && input.joints.hold(body));
  }
  TANDEM_HD ContactWork& work_of(std::uint32_t body) const { return work[first_of(label, body)]; }
  TANDEM_HD WorkOnBody work_on(std::uint32_t body) const {
    return work_on_body(bodies[body], motion_of(sweeps.velocities[body]), input.dt);
  }
  TANDEM_HD JointSweeps joints() const {
    return {input.joints, SoftJointNumbers(numbers), input.bodies, input.states,
            bodies,       groups.colouring.pairs_of, groups.needs};
  }
};

namespace soft_step_detail {

TANDEM_HD inline void fill_body(const SoftStepView& view, std::uint32_t i) {
  if (i == 0) *view.bounces = 0, *view.sweeps.arrived = 0, *view.sweeps.is_done = 0;
  view.sweeps.velocities[i] = {}, view.sweeps.moved[i] = {};
  view.label[i] = i, view.work[i] = {};
  if (!view.is_held(i)) return;
  view.bodies[i] = soft_body(view.numbers, view.unit_root(), i);
  view.sweeps.gains[i] = gain_of(view.bodies[i], view.numbers.h);
}

TANDEM_HD inline void begin_group(const SoftStepView& view, std::uint32_t i) {
  SoftPairs& group = view.sweeps.rows.pairs[i];
  group.pairs = view.groups.pairs_of[i], group.contacts = view.groups.contacts_of[i];
  group.first = view.groups.first_row[i];
  group.bounces = 0, group.is_opposed = 0;
}

/// Rows: a struct of SoftNumbers.
template <typename Rows>
TANDEM_HD void clear_lane(Rows& rows, std::uint32_t lane) {
  static_assert(sizeof(Rows) % sizeof(SoftNumber) == 0);
  auto* const numbers = reinterpret_cast<SoftNumber*>(&rows);
  for (std::size_t i = 0; i < sizeof(Rows) / sizeof(SoftNumber); ++i) numbers[i].of[lane] = 0;
}

TANDEM_HD inline void clear_lane(const SoftRows& rows, std::uint32_t group, std::uint32_t lane) {
  clear_lane(rows.turnings[group], lane);
  const SoftPairs& pairs = rows.pairs[group];
  for (std::uint32_t row = pairs.first; row < pairs.first + pairs.contacts; ++row)
    clear_lane(rows.normals[row], lane), clear_lane(rows.gaps[row], lane),
        clear_lane(rows.frictions[row], lane);
}

TANDEM_HD inline void fill_lane(const SoftStepView& view, std::uint32_t i) {
  const std::uint32_t group = i / kSoftWidth, lane = i % kSoftWidth;
  const SoftRows& rows = view.sweeps.rows;
  if (lane >= rows.pairs[group].pairs) return;
  clear_lane(rows, group, lane);
  const std::uint32_t of_lane = view.groups.pair_of[i];
  const ContactPair& pair = view.groups.colouring.pairs.pairs[of_lane];
  const SteppedBody unmoved = {};
  const SteppedBody* bodies[2] = {&unmoved, &unmoved};
  for (int side = 0; side < 2; ++side) {
    const std::uint32_t body = pair.body(side);
    const bool is_moved = view.groups.colouring.pairs.is_moved(body);
    if (is_moved) bodies[side] = &view.bodies[body];
    view.turns[group].body[side][lane] = is_moved ? body : kNoIndex;
    view.turns[group].turn[side][lane] =
        is_moved ? turn_in_sweep(view.groups.colouring, of_lane, side) : BodyTurn{0, 0};
  }
  fill_pair(view.numbers, view.unit_root(), pair.contacts(), *bodies[0], *bodies[1], rows, group,
            static_cast<int>(lane));
  for (std::uint32_t k = 0; k < pair.count; ++k) {
    if (rows.gaps[rows.pairs[group].first + k].rebound.of[lane] > 0) atomic_most(*view.bounces, 1u);
  }
}

TANDEM_HD inline void join_pair(const SoftStepView& view, std::uint32_t i) {
  const ContactPair& pair = view.groups.colouring.pairs.pairs[i];
  if (view.groups.colouring.pairs.is_moved(pair.a) && view.groups.colouring.pairs.is_moved(pair.b))
    join(view.label, pair.a, pair.b);
}

// Joints, and kinematic bodies that touch others, may add energy to an island.
TANDEM_HD inline void note_drive(const SoftStepView& view, std::uint32_t i) {
  const ContactPair& pair = view.groups.colouring.pairs.pairs[i];
  for (int side = 0; side < 2; ++side) {
    if (view.input.bodies[pair.body(side)].motion == Motion::kinematic)
      view.work_of(pair.body(1 - side)).note_drive();
  }
}

TANDEM_HD inline void note_work(const SoftStepView& view, std::uint32_t i) {
  if (!view.is_held(i)) return;
  view.label[i] = first_of(view.label, i);
  if (view.input.bodies[i].motion == Motion::moving && view.input.joints.hold(i))
    view.work_of(i).note_drive();
  view.work_of(i).note(view.work_on(i));
}

TANDEM_HD inline void add_work(const SoftStepView& view, std::uint32_t i) {
  if (view.is_held(i)) view.work_of(i).add(view.work_on(i));
}

TANDEM_HD inline void end_body(const SoftStepView& view, std::uint32_t i) {
  if (view.groups.needs->has_room == 0) return;
  if (view.input.is_solved != nullptr && view.input.is_solved[i] != 0) return;
  const BodyProperties& body = view.input.bodies[i];
  BodyState state = view.input.states[i];
  if (view.is_held(i))
    end_step(body, view.bodies[i], motion_of(view.sweeps.velocities[i]), motion_of(view.sweeps.moved[i]),
             view.work_of(i).part(), view.input.dt, state);
  else if (body.motion == Motion::moving)
    fly(body, view.input.pulls[i], view.input.dt, state);
  else if (body.motion == Motion::kinematic)
    advance(body, state, Vector3{}, Vector3{}, view.input.dt);
  view.output.states[i] = state;
}

TANDEM_HD inline void end_lane(const SoftStepView& view, std::uint32_t i) {
  const std::uint32_t group = i / kSoftWidth, lane = i % kSoftWidth;
  if (lane >= view.sweeps.rows.pairs[group].pairs) return;
  const ContactPair& pair = view.groups.colouring.pairs.pairs[view.groups.pair_of[i]];
  const std::uint32_t moved = view.groups.colouring.pairs.is_moved(pair.a) ? pair.a : pair.b;
  write_pair(view.numbers, view.unit_root(), pair.contacts(), view.sweeps.rows, group, static_cast<int>(lane),
             view.work_of(moved).part(), view.output.impulses, view.output.done);
}

}  // namespace soft_step_detail

/// Does what SoftSolver does, side by side; and moves the bodies that nothing holds. The
/// bytes of states and impulses are those of SoftSolver. Executor: HostExecutor or CudaExecutor; nothing
/// waits for a GPU but reserve(), so that a step can be captured in a graph.
template <typename Executor>
class ParallelSoftStep {
 public:
  /// Makes room where there is less. Arrays that grow forget; so do views of them.
  Status reserve(Executor& executor, const SoftStepRoom& room) {
    room_ = {std::max(room.bodies, room_.bodies), std::max(room.pairs, room_.pairs),
             std::max(room.groups, room_.groups), std::max(room.rows, room_.rows)};
    Status status = executor.reserve(std::max(room_.bodies, room_.groups) + 1);
    const auto take = [&](Status of) {
      if (status == Status::kOk) status = of;
    };
    take(colouring_.reserve(room_.bodies, room_.pairs));
    take(grouping_.reserve(room_.pairs, room_.groups, room_.rows));
    take(bodies_.reserve(room_.bodies)), take(gains_.reserve(room_.bodies));
    take(starts_.reserve(room_.bodies)), take(velocities_.reserve(room_.bodies));
    take(moved_.reserve(room_.bodies)), take(bounces_.reserve(1)), take(arrived_.reserve(1)),
        take(is_done_.reserve(1));
    take(groups_.reserve(room_.groups)), take(turnings_.reserve(room_.groups));
    take(labels_.reserve(room_.bodies)), take(works_.reserve(room_.bodies));
    take(turns_.reserve(room_.groups)), take(normals_.reserve(room_.rows));
    take(gaps_.reserve(room_.rows)), take(frictions_.reserve(room_.rows));
    return status;
  }
  const SoftStepRoom& room() const { return room_; }
  std::size_t bytes() const {
    return bytes_of(colouring_, grouping_, bodies_, gains_, starts_, velocities_, moved_, bounces_, arrived_,
                    is_done_, groups_, turnings_, turns_, normals_, gaps_, frictions_, labels_, works_);
  }

  /// What the last step needed room for, in the executor's memory. Where it had too little it has written
  /// neither states nor impulses.
  const SoftStepNeeds* needs() const { return grouping_.needs(); }

  /// Condition: there is room for all bodies and for input.most_pairs pairs.
  void step(Executor& executor, const SoftStepInput& input, const SolverOptions& options,
            const SoftStepOutput& output) {
    find_colours(executor, input);
    make_groups(executor);
    fill(executor, input, options, output);
    sweep(executor);
    write(executor);
  }

  // The parts of a step, in their order.
  void find_colours(Executor& executor, const SoftStepInput& input) {
    colouring_.find(executor, {input.pairs, input.pair_count, input.most_pairs, input.bodies},
                    input.body_count);
  }
  void make_groups(Executor& executor) { grouping_.make(executor, colouring_.view()); }
  void fill(Executor& executor, const SoftStepInput& input, const SolverOptions& options,
            const SoftStepOutput& output) {
    using namespace soft_step_detail;
    const SoftStepView view = view_of(input, options, output);
    if (input.joints.tasks > 0) {
      executor.for_each(nullptr, input.body_count, [=] TANDEM_HD(std::uint32_t i) {
        weigh_joined(view.input.joints, view.input.bodies, i, view.groups.colouring.numbers->most_mass);
      });
    }
    executor.for_each(nullptr, input.body_count, [=] TANDEM_HD(std::uint32_t i) { fill_body(view, i); });
    executor.for_each(nullptr, input.joints.place_count(),
                      [=] TANDEM_HD(std::uint32_t i) { begin_placed(view.joints(), view.unit_root(), i); });
    executor.for_each(view.sweeps.groups, room_.groups,
                      [=] TANDEM_HD(std::uint32_t i) { begin_group(view, i); });
    executor.for_each(view.groups.lanes, kSoftWidth * room_.groups,
                      [=] TANDEM_HD(std::uint32_t i) { fill_lane(view, i); });
    view_.emplace(view);
  }
  void sweep(Executor& executor) {
    if (view_->input.joints.tasks > 0)
      sweep(executor, view_->joints(), std::max(view_->input.joints.tasks, room_.groups / kGroupsOfTeam));
    else
      sweep(executor, NoJointSweeps{}, room_.groups / kGroupsOfTeam);
  }
  void write(Executor& executor) {
    using namespace soft_step_detail;
    const SoftStepView view = *view_;
    const ContactPairs& pairs = view.groups.colouring.pairs;
    executor.for_each(pairs.count, pairs.most, [=] TANDEM_HD(std::uint32_t i) { join_pair(view, i); });
    executor.for_each(pairs.count, pairs.most, [=] TANDEM_HD(std::uint32_t i) { note_drive(view, i); });
    executor.for_each(nullptr, view.input.body_count, [=] TANDEM_HD(std::uint32_t i) { note_work(view, i); });
    executor.for_each(nullptr, view.input.body_count, [=] TANDEM_HD(std::uint32_t i) { add_work(view, i); });
    executor.for_each(nullptr, view.input.body_count, [=] TANDEM_HD(std::uint32_t i) { end_body(view, i); });
    executor.for_each(view.groups.lanes, kSoftWidth * room_.groups,
                      [=] TANDEM_HD(std::uint32_t i) { end_lane(view, i); });
    end_joints(executor);
  }

  /// Takes what the joints of the last step did, and where they are. Condition: the bodies stand as at its
  /// end.
  void end_joints(Executor& executor) {
    const SoftStepView view = *view_;
    if (view.input.joints.count == 0) return;
    executor.once([=] TANDEM_HD() { *view.input.joints.broken = 0; });
    executor.for_each(nullptr, view.input.joints.count, [=] TANDEM_HD(std::uint32_t i) {
      if (view.groups.needs->has_room != 0)
        end_joint(view.input.joints, view.output.states, view.input.dt, i);
    });
    executor.for_each(nullptr, view.input.joints.place_count(), [=] TANDEM_HD(std::uint32_t i) {
      if (view.groups.needs->has_room != 0)
        end_placed(view.joints(), view.unit_root(), view.output.states, i);
    });
  }

  // Joints: NoJointSweeps or JointSweeps.
  template <typename Joints>
  void sweep(Executor& executor, const Joints& joints, std::uint32_t most_teams) {
    const SoftSweeps sweeps = view_->sweeps;
    if constexpr (!Joints::kAny)
      executor.in_cluster([=] TANDEM_HD(const ClusterWorker& worker) { sweep_in_cluster(sweeps, worker); });
    executor.together(most_teams,
                      [=] TANDEM_HD(const Worker& worker) { sweep_all<false>(sweeps, joints, worker); });
    if constexpr (Executor::kHasManyWorkers)
      executor.together(most_teams,
                        [=] TANDEM_HD(const Worker& worker) { sweep_all<true>(sweeps, joints, worker); });
  }

 private:
  SoftStepView view_of(const SoftStepInput& input, const SolverOptions& options,
                       const SoftStepOutput& output) const {
    const SoftNumbers numbers(step_numbers(input, options), input.start_impulses);
    const SoftRows rows = {
        nullptr,         nullptr,      groups_.data(),    turnings_.data(),
        normals_.data(), gaps_.data(), frictions_.data(), static_cast<float>(1 / numbers.h)};
    const GroupsView& groups = grouping_.view();
    return {numbers,
            {rows, turns_.data(), velocities_.data(), moved_.data(), gains_.data(), starts_.data(),
             groups.groups, groups.colours, groups.shared, arrived_.data(), is_done_.data(), input.body_count,
             bounces_.data(), numbers.h, options.substeps},
            groups,
            input,
            output,
            bodies_.data(),
            turns_.data(),
            bounces_.data(),
            labels_.data(),
            works_.data()};
  }

  template <typename T>
  using Array = typename Executor::template Array<T>;

  SoftStepRoom room_ = {};
  std::optional<SoftStepView> view_;  // of the last step
  PairColouring<Executor> colouring_;
  PairGroups<Executor> grouping_;
  Array<SteppedBody> bodies_;
  Array<SoftMotion> gains_, starts_;
  Array<SharedMotion> velocities_, moved_;
  Array<std::uint32_t> bounces_, arrived_, is_done_, labels_;
  Array<ContactWork> works_;
  Array<SoftPairs> groups_;
  Array<SoftTurning> turnings_;
  Array<SoftTurns> turns_;
  Array<SoftNormal> normals_;
  Array<SoftGap> gaps_;
  Array<SoftFriction> frictions_;
};

}  // namespace tandem::dynamics
