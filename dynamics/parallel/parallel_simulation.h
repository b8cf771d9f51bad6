#pragma once
#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <utility>
#include <vector>

#include "dynamics/parallel/pair_step.h"
#include "dynamics/parallel/parallel_arrays.h"
#include "dynamics/parallel/parallel_joints.h"
#include "dynamics/parallel/parallel_newton_step.h"
#include "dynamics/parallel/parallel_soft_step.h"
#include "dynamics/parallel/simulation_rows.h"
#include "dynamics/parallel/sleep_step.h"
#include "dynamics/parallel/touch_lists.h"
#include "dynamics/parallel/wake_step.h"

namespace tandem::dynamics {

namespace parallel_simulation_detail {

// States stay where they are, since others look at them.
struct StatesGoOn {
  BodyState *before, *start;
  const BodyState* end;
  TANDEM_HD void operator()(std::uint32_t i) const { before[i] = start[i], start[i] = end[i]; }
};

struct JointsGoOn {
  JointArrays joints;
  TANDEM_HD void operator()(std::uint32_t i) const { go_on(joints, i); }
};

struct CountsGoOn {
  StepCounts* counts;
  TANDEM_HD void operator()() const { counts->records_before = counts->pairs; }
};

}  // namespace parallel_simulation_detail

struct ParallelOptions {
  Vector3 gravity = {0, 0, -9.81};
  SolverOptions solver;
  SleepOptions sleep;
  ContinuousMotion* continuous = nullptr;  ///< limits fast bodies, on the CPU; null: nobody does
};

/// All that the next steps of a parallel simulation depend on, beside what bodies are and options; its bytes
/// lie in the executor's memory, but for those of joints.
template <typename Executor>
struct ParallelState {
  typename Executor::template Array<char> bytes;
  std::uint32_t records = 0, remembered = 0;  ///< rows
  double within = 0;
  bool has_forces = false;
  ParallelJointState joints;
};

/// Moves rigid bodies as Simulation does, by the same rules, all bodies and pairs side by side. All that a
/// step needs lies in the executor's memory; the CPU looks at a few counts once a step. A step for which
/// there is too little room is made again with more, and nothing is lost.
///
/// Executor: HostExecutor or CudaExecutor. Questions: see PairStep; it has
///   void forget_needs();           before the questions of a step
///   void read_needs();             after them, before the CPU waits
///   Status make_room(bool& grew);  then: says what was wrong with them, or makes room where some had
///                                  too little
///   Status reserve(std::uint32_t bodies, std::uint32_t pairs);
template <typename Executor, typename Questions>
class ParallelSimulation {
 public:
  /// What the arguments refer to must outlive this.
  ParallelSimulation(Executor& executor, Questions& questions) : to_(executor), ask_(questions) {}

  /// Places all bodies anew. There are no contacts then.
  Status set_bodies(const ParallelBodies& bodies, const ParallelOptions& options) {
    options_ = options;
    thinnest_ = options.continuous != nullptr ? thinnest_of(bodies.properties, bodies.inner_radii) : INFINITY;
    within_ = 0, arrays_.has_forces = false, ++generation_;
    arrays_.most_pairs = arrays_.most_moved = arrays_.most_found = arrays_.most_remembered = 0;
    const Status reserved = arrays_.reserve_bodies(to_, bodies);
    if (reserved != Status::kOk) return reserved;
    records_count_ = remembered_count_ = 0;
    for (Status status :
         {joints_.set(to_, bodies.joints, bodies.properties, bodies.states),
          reserve_pairs(std::max(1024u, 8 * arrays_.bodies)),
          arrays_.reserve_moved(to_, std::max(256u, arrays_.bodies / 2)),
          reserve_contacts(std::max(4096u, 32 * arrays_.bodies), std::max(4096u, 32 * arrays_.bodies))}) {
      if (status != Status::kOk) return status;
    }
    return arrays_.put(to_, arrays_.counts, StepCounts{});
  }

  /// Makes a step. Result: kOutOfRange where a body has left the range of numbers, and bad_body() is the
  /// body; or what a question says. Throws what ContinuousMotion does. After an error bodies and contacts are
  /// as before the step.
  Status step(double dt) {
    constexpr int kMostRepeats = 12;
    if (dt != dt_) dt_ = dt, ++generation_;
    for (int repeat = 0; repeat < kMostRepeats; ++repeat) {
      bool whole = true;
      const StepArrays a = arrays(dt);
      const Status status = try_step(a, whole);
      if (status != Status::kOk) return status;
      if (!whole) continue;
      if (read_.has_fast != 0) {
        if (const Status limited = limit(a); limited != Status::kOk) return limited;
      }
      queue(kFinish, [&] {
        PairStep<Executor, Questions>{to_, ask_, a}.finish();
        sleep_step(to_, a, options_.sleep);
        to_.for_each(nullptr, arrays_.bodies,
                     parallel_simulation_detail::StatesGoOn{a.before, a.start, a.end});
        to_.for_each(nullptr, a.joints.count, parallel_simulation_detail::JointsGoOn{a.joints});
        to_.once(parallel_simulation_detail::CountsGoOn{a.counts});
      });
      return go_on();
    }
    return Status::kOutOfMemory;
  }

  // These do what Simulation's functions of these names do.
  Status place(std::uint32_t body, const BodyState& state) {
    const StepArrays a = arrays();
    const Status status = to_.copy(std::span(&state, 1), a.start + body);
    if (status == Status::kOk) wake_body(to_, a, body, true);
    return to_.wait();
  }
  Status set_force(std::uint32_t body, const BodyForce& force) {
    Status status = arrays_.has_forces ? Status::kOk : arrays_.fill(to_, arrays_.forces, BodyForce{});
    if (status != Status::kOk) return status;
    if (!arrays_.has_forces) arrays_.has_forces = true, ++generation_;
    return change_and_wake<BodyForce>(body, force, {arrays_.forces.data() + body});
  }
  Status change(std::uint32_t body, const BodySettings& settings) {
    return change_and_wake<BodySettings>(body, settings,
                                         {arrays_.properties.data() + body, arrays_.acting.data() + body});
  }

  /// Keeps the state, and goes on where save() was called. Condition of restore(): the state is of this
  /// simulation, since its bodies were set. There are no contacts then, and nothing has begun or ended.
  Status save(ParallelState<Executor>& state) {
    state.records = records_count_, state.remembered = remembered_count_;
    state.within = within_, state.has_forces = arrays_.has_forces;
    std::size_t bytes = 0;
    arrays_.visit_kept(state.records, state.remembered, state.has_forces,
                       [&](const auto&, std::size_t count) { bytes += count; });
    const Status status = state.bytes.reserve(bytes);
    if (status != Status::kOk) return status;
    std::size_t place = 0;
    arrays_.visit_kept(
        state.records, state.remembered, state.has_forces, [&](const auto& array, std::size_t count) {
          to_.copy_within(reinterpret_cast<const char*>(array.data()), count, state.bytes.data() + place);
          place += count;
        });
    return joints_.save(to_, state.joints);
  }
  Status restore(const ParallelState<Executor>& state) {
    if (arrays_.has_forces != state.has_forces || within_ != state.within) ++generation_;
    arrays_.has_forces = state.has_forces, within_ = state.within;
    records_count_ = state.records, remembered_count_ = state.remembered;
    std::size_t place = 0;
    arrays_.visit_kept(
        state.records, state.remembered, state.has_forces, [&](const auto& array, std::size_t count) {
          to_.copy_within(state.bytes.data() + place, count, reinterpret_cast<char*>(array.data()));
          place += count;
        });
    StepCounts counts = {};
    counts.records_before = records_count_;
    Status status = arrays_.put(to_, arrays_.counts, counts);
    if (!joints_.all().empty()) ++generation_;
    if (status == Status::kOk) status = joints_.restore(to_, state.joints);
    if (status != Status::kOk) return status;
    forget_call();
    return to_.wait();
  }

  /// Lets began() and ended() begin anew.
  void forget_call() {
    const StepArrays a = arrays();
    to_.for_each(&a.counts->records_before, a.most_pairs, ForgetCall{a.records_before});
  }

  /// Copy what World's functions of these names return: began and ended since forget_call().
  Status touching(std::vector<WorldTouch>& pairs) {
    return list(&PairRecord::touches, arrays_.touches[0].data(), listed_touches_, pairs);
  }
  Status began(std::vector<WorldTouch>& pairs) {
    return list(&PairRecord::began, arrays_.begun[0].data(), listed_touches_, pairs);
  }
  Status ended(std::vector<ObjectPair>& pairs) {
    return list(&PairRecord::ended, arrays_.records[0].data(), listed_pairs_, pairs);
  }

  /// Returns the bytes of the executor's memory that bodies, pairs and contacts take, but for those of
  /// questions and the executor.
  std::size_t bytes() const {
    return bytes_of(solver_, newton_, joints_, arrays_, sums_of_contacts_, listed_touches_, listed_pairs_);
  }

  /// The joints, by the place of each: what Simulation's functions of these names do. That joined bodies meet
  /// or do not is up to the questions, which call questions_change() where they do something else than
  /// before.
  std::span<const Joint> joints() const { return joints_.all(); }
  std::span<const std::uint32_t> broken() const { return joints_.broken(); }
  Status joint_memory(std::vector<JointMemory>& memory) const { return joints_.read(to_, memory); }
  Status set_motor(std::uint32_t joint, double speed, double most_effort) {
    wake_joined(to_, arrays(), joints_.all()[joint]);
    return joints_.set_motor(to_, joint, speed, most_effort);
  }
  /// bodies, states: all, as they stand.
  Status add_joint(const Joint& joint, std::span<const BodyProperties> bodies,
                   std::span<const BodyState> states, std::uint32_t& place) {
    if (!joint.may_touch)
      forget_contacts(to_, arrays(), {std::min(joint.a, joint.b), std::max(joint.a, joint.b)});
    const Status status = joints_.add(to_, joint, bodies, states, place);
    ++generation_;
    if (status == Status::kOk) wake_joined(to_, arrays(), joint);
    return status;
  }
  Status remove_joint(std::uint32_t joint) {
    wake_joined(to_, arrays(), joints_.all()[joint]);
    ++generation_;
    return joints_.remove(to_, joint);
  }
  void questions_change() { ++generation_; }

  /// Adds up the contacts of the last step.
  Status sum_contacts(ContactSums& sums) {
    sums = {};
    const Status status = arrays_.put(to_, sums_of_contacts_, sums);
    if (status != Status::kOk) return status;
    dynamics::sum_contacts(to_, arrays(), records_count_, sums_of_contacts_.data());
    return to_.copy(sums_of_contacts_.data(), std::span(&sums, 1));
  }

  /// Copies what the next step starts from to the CPU, but for forces, settings of bodies, touches and
  /// joints; and lets a simulation of the same bodies go on from there. bodies: as given to set_bodies().
  Status save(std::span<const BodyProperties> bodies, SimulationState& state) {
    const StepArrays a = arrays();
    std::vector<PairRecord> records(records_count_);
    std::vector<CachedContact> remembered(remembered_count_);
    state.states.resize(arrays_.bodies), state.ahead.before.resize(arrays_.bodies);
    state.quiet.resize(arrays_.bodies), state.groups.resize(arrays_.bodies);
    for (Status status :
         {to_.copy(a.records_before, std::span(records)),
          to_.copy(a.remembered_before, std::span(remembered)), to_.copy(a.start, std::span(state.states)),
          to_.copy(a.before, std::span(state.ahead.before)), to_.copy(a.quiet, std::span(state.quiet)),
          to_.copy(a.group, std::span(state.groups))}) {
      if (status != Status::kOk) return status;
    }
    keep_pairs(records, remembered, bodies, state);
    return Status::kOk;
  }
  Status restore(std::span<const BodyProperties> bodies, const SimulationState& state) {
    const KeptPairs kept(state);
    records_count_ = static_cast<std::uint32_t>(kept.records.size());
    remembered_count_ = static_cast<std::uint32_t>(kept.remembered.size());
    std::vector<BodyProperties> acting(bodies.begin(), bodies.end());
    for (std::uint32_t i = 0; i < arrays_.bodies; ++i) {
      if (state.groups[i] != Sleep::kAwake) acting[i].motion = Motion::fixed;
    }
    Status out = records_count_ > arrays_.most_pairs ? reserve_pairs(records_count_) : Status::kOk;
    if (out == Status::kOk && remembered_count_ > arrays_.most_remembered)
      out = reserve_contacts(arrays_.most_found, remembered_count_);
    ++generation_;
    const StepArrays a = arrays();
    const auto copy = [&]<typename T>(std::span<const T> from, T* to) {
      if (out == Status::kOk && !from.empty()) out = to_.copy(from, to);
    };
    const std::span<const BodyState> states = state.states, before = state.ahead.before;
    copy(std::span(kept.records), a.records_before);
    copy(std::span(kept.remembered), a.remembered_before);
    copy(states, a.start), copy(before.empty() ? states : before, a.before);
    copy(std::span(std::as_const(acting)), a.acting);
    copy(std::span(state.quiet), a.quiet), copy(std::span(state.groups), a.group);
    StepCounts counts = {};
    counts.records_before = records_count_;
    return out == Status::kOk ? arrays_.put(to_, arrays_.counts, counts) : out;
  }

  std::uint32_t bodies() const { return arrays_.bodies; }
  std::uint32_t bad_body() const { return std::min(read_.bad_start, read_.bad_body); }
  const StepCounts& counts() const { return read_; }  ///< of the last step
  /// Returns what Newton's method did in the last step. Condition: the solver is not SolverKind::soft.
  const NewtonNeeds& newton() const { return newton_needs_; }

  /// The arrays of the last step, whose results are those of the step before now.
  StepArrays arrays(double dt = 0) const {
    StepArrays a = arrays_.view();
    a.joints = joints_.arrays(&a.counts->broken);
    a.dt = dt, a.thinnest = thinnest_, a.gravity = options_.gravity, a.options = options_.solver;
    return a;
  }

 private:
  template <typename T>
  using Array = typename Executor::template Array<T>;

  static constexpr std::uint32_t kNewtonUnits = (4u << 20) / NewtonNeeds::kUnit;  // to begin with

  // Parts of a step that are queued together.
  enum Part { kFind, kAddMissed, kSolve, kFinish, kParts };

  template <typename Enqueue>
  void queue(Part part, const Enqueue& enqueue) {
    to_.again(sequences_[part][parity_], generation_, enqueue);
  }

  Status try_step(const StepArrays& a, bool& whole) {
    constexpr int kMostTimes = 3;  // as of Simulation
    PairStep<Executor, Questions> step{to_, ask_, a};
    queue(kFind, [&] {
      ask_.forget_needs();
      step.find_contacts(within_);
      solve(step.a);
      step.find_surprised();
      queue_reading();
    });
    for (int times = 1;; ++times) {
      const Status status = read(whole);
      if (status != Status::kOk || !whole) return status;
      if (read_.bad_body != kNoIndex) return Status::kOutOfRange;
      if (times == kMostTimes || read_.surprised == 0) return Status::kOk;
      queue(kAddMissed, [&] {
        ask_.forget_needs();
        step.add_missed();
        queue_reading();
      });
      const Status missed = read(whole);
      if (missed != Status::kOk || !whole || read_.missed == 0) return missed;
      queue(kSolve, [&] {
        solve(step.a, step.a.has_missed);
        step.find_surprised();
        queue_reading();
      });
    }
  }

  // The CPU limits fast bodies, in steps that have any.
  Status limit(const StepArrays& a) {
    std::vector<BodyProperties> acting(arrays_.bodies);
    std::vector<BodyState> start(arrays_.bodies), end(arrays_.bodies);
    Status status = to_.copy(a.acting, std::span(acting));
    if (status == Status::kOk) status = to_.copy(a.start, std::span(start));
    if (status == Status::kOk) status = to_.copy(a.end, std::span(end));
    if (status != Status::kOk) return status;
    options_.continuous->limit(acting, joints_.joined(), start, end, options_.solver.slop);
    status = to_.copy(std::span<const BodyState>(end), a.end);
    if (status != Status::kOk || a.joints.count == 0) return status;
    solver_.end_joints(to_);  // of bodies as they stand now
    return to_.copy(a.counts, std::span(&read_, 1));
  }

  // has_changed: see ParallelNewtonStep.
  void solve(const StepArrays& a, const std::uint32_t* has_changed = nullptr) {
    const SoftStepOutput output = {a.end, a.impulses, a.done};
    SoftStepInput input = {a.acting,     a.start,
                           a.pulls,      a.bodies,
                           a.contacts,   a.impulses_before,
                           a.touching,   &a.counts->touching,
                           a.most_pairs, a.dt,
                           a.joints};
    if (has_newton()) input = newton_.step(to_, input, a.options, output, has_changed);
    solver_.step(to_, input, a.options, output);
  }

  bool has_newton() const { return options_.solver.kind != SolverKind::soft; }

  // Makes room for the bodies and pairs of a solver.
  Status reserve_solvers() {
    const std::uint32_t units = std::max(newton_.units(), kNewtonUnits);
    const Status status =
        has_newton() ? newton_.reserve(to_, arrays_.bodies, arrays_.most_pairs, units) : Status::kOk;
    return status == Status::kOk
               ? solver_.reserve(to_, usual_room(arrays_.bodies, arrays_.most_pairs, arrays_.most_remembered))
               : status;
  }

  void queue_reading() {
    to_.copy_later(arrays_.counts.data(), read_);
    to_.copy_later(solver_.needs(), solver_needs_);
    if (has_newton()) to_.copy_later(newton_.needs(), newton_needs_);
    ask_.read_needs();
  }

  // Reads the counts, and makes room where there is too little: then the step is not whole.
  Status read(bool& whole) {
    Status status = to_.wait();
    bool grew = false;
    if (status == Status::kOk && read_.bad_start != kNoIndex) status = Status::kOutOfRange;
    if (status == Status::kOk) status = ask_.make_room(grew);
    const double needed = read_.reach.farthest(0.5 * options_.solver.slop);
    if (needed > within_) within_ = 1.5 * needed, grew = true;
    if (status == Status::kOk && read_.pairs > arrays_.most_pairs) {
      grew = true;
      status = reserve_pairs(roomy(read_.pairs));
    }
    const std::uint32_t moved = std::max({read_.middle, read_.approaches, read_.surprised});
    if (status == Status::kOk && moved > arrays_.most_moved) {
      grew = true;
      status = arrays_.reserve_moved(to_, roomy(moved));
    }
    if (status == Status::kOk &&
        (read_.found > arrays_.most_found || read_.remembered > arrays_.most_remembered)) {
      grew = true;
      status = reserve_contacts(roomy(read_.found), roomy(read_.remembered));
    }
    if (status == Status::kOk && !grew && solver_needs_.has_room == 0) {
      grew = true;
      status = solver_.reserve(to_, larger_room(solver_.room(), solver_needs_));
    }
    if (status == Status::kOk && !grew && has_newton() && newton_needs_.has_room == 0) {
      grew = true;
      status = newton_.reserve(to_, arrays_.bodies, arrays_.most_pairs, roomy(newton_needs_.units));
    }
    whole = !grew;
    if (grew) ++generation_;
    return status;
  }

  // The results of a step become what the next one begins with.
  Status go_on() {
    constexpr double kWide = 3;
    records_count_ = read_.pairs, remembered_count_ = read_.remembered;
    arrays_.go_on();
    parity_ = 1 - parity_;
    if (read_.broken > 0) ++generation_;
    const Status joints = joints_.take_broken(to_, read_.broken > 0);
    const double needed = read_.reach.farthest(0.5 * options_.solver.slop);
    if (kWide * needed < within_) within_ = 1.5 * needed, ++generation_;
    return joints == Status::kOk ? to_.status() : joints;
  }

  // Writes what is not what it was, and wakes the body then.
  template <typename T>
  Status change_and_wake(std::uint32_t body, const T& value, std::initializer_list<T*> places) {
    T before;
    Status status = to_.copy(*places.begin(), std::span(&before, 1));
    if (status != Status::kOk || before == value) return status;
    for (T* const place : places) {
      if (status == Status::kOk) status = to_.copy(std::span(&value, 1), place);
    }
    if (status == Status::kOk) wake_body(to_, arrays(), body, false);
    return to_.wait();
  }

  // Copies the rows of the records that have a flag. There are none before a step, whose counts are 0.
  template <typename From, typename Row>
  Status list(bool PairRecord::*flag, const From* from, Array<Row>& listed, std::vector<Row>& out) {
    const StepArrays a = arrays();
    std::uint32_t* const count = &a.counts->listed;
    std::uint32_t found = 0;
    to_.select(RecordIsListed{a.records_before, flag}, &a.counts->records_before, a.most_pairs, a.list,
               count);
    Status status = to_.copy(count, std::span(&found, 1));
    out.clear();
    if (status != Status::kOk || found == 0) return status;
    status = listed.reserve(found);
    if (status != Status::kOk) return status;
    to_.for_each(count, found, CopyListed<From, Row>{from, a.list, listed.data()});
    out.resize(found);
    return to_.copy(listed.data(), std::span(out));
  }

  Status reserve_pairs(std::uint32_t pairs) {
    Status status = arrays_.reserve_pairs(pairs);
    if (status == Status::kOk) status = to_.reserve(pairs + 1);
    if (status == Status::kOk) status = ask_.reserve(arrays_.bodies, pairs);
    return status == Status::kOk ? reserve_solvers() : status;
  }
  Status reserve_contacts(std::uint32_t found, std::uint32_t remembered) {
    const Status status = arrays_.reserve_contacts(found, remembered);
    return status == Status::kOk ? reserve_solvers() : status;
  }

  Executor& to_;
  Questions& ask_;
  ParallelArrays<Executor> arrays_;
  ParallelSoftStep<Executor> solver_;
  ParallelJoints<Executor> joints_;
  ParallelNewtonStep<Executor> newton_;
  ParallelOptions options_;
  std::uint32_t records_count_ = 0, remembered_count_ = 0;  // of the last step that was whole
  double within_ = 0;                                       // how far apart near pairs are
  double thinnest_ = INFINITY;
  StepCounts read_ = {};
  SoftStepNeeds solver_needs_ = {};
  NewtonNeeds newton_needs_ = {};
  double dt_ = 0;
  std::uint64_t generation_ = 0;  // of all that is queued, memory included
  int parity_ = 0;                // of the step: records change places
  typename Executor::Sequence sequences_[kParts][2];

  Array<WorldTouch> listed_touches_;
  Array<ObjectPair> listed_pairs_;
  Array<ContactSums> sums_of_contacts_;
};

}  // namespace tandem::dynamics
