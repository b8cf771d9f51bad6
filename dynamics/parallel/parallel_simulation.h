#pragma once
#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <utility>
#include <vector>

#include "dynamics/parallel/newton_step.h"
#include "dynamics/parallel/pair_step.h"
#include "dynamics/parallel/parallel_joints.h"
#include "dynamics/parallel/simulation_rows.h"
#include "dynamics/parallel/sleep_step.h"
#include "dynamics/parallel/soft_step.h"
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

/// What a parallel simulation is made of.
struct ParallelBodies {
  std::span<const BodyProperties> properties;
  std::span<const BodyState> states;
  std::span<const double> inner_radii;  ///< of each shape, see inner_radii()
  std::span<const AssetBox> boxes;      ///< of each shape
  std::span<const Joint> joints = {};
};

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
    bodies_ = static_cast<std::uint32_t>(bodies.properties.size());
    options_ = options;
    thinnest_ = options.continuous != nullptr ? thinnest_of(bodies.properties, bodies.inner_radii) : INFINITY;
    within_ = 0, has_forces_ = false, ++generation_;
    most_pairs_ = most_moved_ = most_found_ = most_remembered_ = 0;
    records_count_ = remembered_count_ = 0;
    for (Status status :
         {joints_.set(to_, bodies.joints, bodies.properties, bodies.states), reserve_bodies(bodies),
          reserve_pairs(std::max(1024u, 8 * bodies_)), reserve_moved(std::max(256u, bodies_ / 2)),
          reserve_contacts(std::max(4096u, 32 * bodies_), std::max(4096u, 32 * bodies_))}) {
      if (status != Status::kOk) return status;
    }
    return put(counts_, StepCounts{});
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
        to_.for_each(nullptr, bodies_, parallel_simulation_detail::StatesGoOn{a.before, a.start, a.end});
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
    Status status = has_forces_ ? Status::kOk : fill<BodyForce>(forces_, {});
    if (status != Status::kOk) return status;
    if (!has_forces_) has_forces_ = true, ++generation_;
    return change_and_wake<BodyForce>(body, force, {forces_.data() + body});
  }
  Status change(std::uint32_t body, const BodySettings& settings) {
    return change_and_wake<BodySettings>(body, settings, {properties_.data() + body, acting_.data() + body});
  }

  /// Keeps the state, and goes on where save() was called. Condition of restore(): the state is of this
  /// simulation, since its bodies were set. There are no contacts then, and nothing has begun or ended.
  Status save(ParallelState<Executor>& state) {
    state.records = records_count_, state.remembered = remembered_count_;
    state.within = within_, state.has_forces = has_forces_;
    std::size_t bytes = 0;
    visit_kept(state, [&](const auto&, std::size_t count) { bytes += count; });
    const Status status = state.bytes.reserve(bytes);
    if (status != Status::kOk) return status;
    std::size_t place = 0;
    visit_kept(state, [&](const auto& array, std::size_t count) {
      to_.copy_within(reinterpret_cast<const char*>(array.data()), count, state.bytes.data() + place);
      place += count;
    });
    return joints_.save(to_, state.joints);
  }
  Status restore(const ParallelState<Executor>& state) {
    if (has_forces_ != state.has_forces || within_ != state.within) ++generation_;
    has_forces_ = state.has_forces, within_ = state.within;
    records_count_ = state.records, remembered_count_ = state.remembered;
    std::size_t place = 0;
    visit_kept(state, [&](const auto& array, std::size_t count) {
      to_.copy_within(state.bytes.data() + place, count, reinterpret_cast<char*>(array.data()));
      place += count;
    });
    StepCounts counts = {};
    counts.records_before = records_count_;
    Status status = put(counts_, counts);
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
    return list(&PairRecord::touches, touches_[0].data(), listed_touches_, pairs);
  }
  Status began(std::vector<WorldTouch>& pairs) {
    return list(&PairRecord::began, begun_[0].data(), listed_touches_, pairs);
  }
  Status ended(std::vector<ObjectPair>& pairs) {
    return list(&PairRecord::ended, records_[0].data(), listed_pairs_, pairs);
  }

  /// Returns the bytes of the executor's memory that bodies, pairs and contacts take, but for those of
  /// questions and the executor.
  std::size_t bytes() const {
    return bytes_of(solver_, newton_, joints_, properties_, acting_, states_[0], states_[1], states_[2], pulls_,
                    forces_, placed_, idle_, asset_, group_, label_, marks_, pose_, motion_, ways_,
                    ways_ahead_, quiet_, inner_radius_, boxes_, records_[0], records_[1], touches_[0],
                    touches_[1], begun_[0], begun_[1], plans_, flags_, sums_, list_, row_first_, row_end_,
                    asked_, moved_pairs_, reach_, moved_asset_, moved_pose_, approaches_, touching_, found_,
                    contacts_, remembered_[0], remembered_[1], place_, contact_marks_, impulses_before_,
                    impulses_, done_, counts_, sums_of_contacts_, listed_touches_, listed_pairs_);
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
    const Status status = put(sums_of_contacts_, sums);
    if (status != Status::kOk) return status;
    dynamics::sum_contacts(to_, arrays(), records_count_, sums_of_contacts_.data());
    return to_.copy(sums_of_contacts_.data(), std::span(&sums, 1));
  }

  /// Copies what the next step starts from to the CPU, but for forces, settings of bodies, touches and joints;
  /// and lets a simulation of the same bodies go on from there. bodies: as given to set_bodies().
  Status save(std::span<const BodyProperties> bodies, SimulationState& state) {
    const StepArrays a = arrays();
    std::vector<PairRecord> records(records_count_);
    std::vector<CachedContact> remembered(remembered_count_);
    state.states.resize(bodies_), state.ahead.before.resize(bodies_);
    state.quiet.resize(bodies_), state.groups.resize(bodies_);
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
    for (std::uint32_t i = 0; i < bodies_; ++i) {
      if (state.groups[i] != Sleep::kAwake) acting[i].motion = Motion::fixed;
    }
    Status out = records_count_ > most_pairs_ ? reserve_pairs(records_count_) : Status::kOk;
    if (out == Status::kOk && remembered_count_ > most_remembered_)
      out = reserve_contacts(most_found_, remembered_count_);
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
    return out == Status::kOk ? put(counts_, counts) : out;
  }

  std::uint32_t bodies() const { return bodies_; }
  std::uint32_t bad_body() const { return std::min(read_.bad_start, read_.bad_body); }
  const StepCounts& counts() const { return read_; }  ///< of the last step
  /// Returns what Newton's method did in the last step. Condition: the solver is not SolverKind::soft.
  const NewtonNeeds& newton() const { return newton_needs_; }

  /// The arrays of the last step, whose results are those of the step before now.
  StepArrays arrays(double dt = 0) const {
    StepArrays a = {};
    a.bodies = bodies_;
    a.properties = properties_.data(), a.acting = acting_.data();
    a.before = states_[0].data(), a.start = states_[1].data(), a.end = states_[2].data();
    a.pulls = pulls_.data(), a.forces = has_forces_ ? forces_.data() : nullptr;
    a.placed = placed_.data(), a.idle = idle_.data();
    a.asset = asset_.data(), a.pose = pose_.data(), a.motion = motion_.data();
    a.ways = ways_.data(), a.ways_ahead = ways_ahead_.data();
    a.quiet = quiet_.data(), a.group = group_.data(), a.label = label_.data(), a.marks = marks_.data();
    a.inner_radius = inner_radius_.data(), a.boxes = boxes_.data();
    a.most_pairs = most_pairs_;
    a.records_before = records_[0].data(), a.records = records_[1].data();
    a.touches_before = touches_[0].data(), a.touches = touches_[1].data();
    a.begun_before = begun_[0].data(), a.begun = begun_[1].data();
    a.plans = plans_.data(), a.flags = flags_.data(), a.sums = sums_.data(), a.list = list_.data();
    a.asked = asked_.data(), a.reach = reach_.data();
    a.row_first = row_first_.data(), a.row_end = row_end_.data();
    a.most_moved = most_moved_, a.moved_pairs = moved_pairs_.data(), a.moved_asset = moved_asset_.data();
    a.moved_pose = moved_pose_.data();
    a.approaches = approaches_.data(), a.touching = touching_.data();
    a.most_found = most_found_, a.most_remembered = most_remembered_;
    a.found = found_.data();
    a.remembered_before = remembered_[0].data(), a.remembered = remembered_[1].data();
    a.contacts = contacts_.data(), a.place = place_.data(), a.contact_marks = contact_marks_.data();
    a.impulses_before = impulses_before_.data(), a.impulses = impulses_.data(), a.done = done_.data();
    a.counts = counts_.data();
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
        solve(step.a);
        step.find_surprised();
        queue_reading();
      });
    }
  }

  // The CPU limits fast bodies, in steps that have any.
  Status limit(const StepArrays& a) {
    std::vector<BodyProperties> acting(bodies_);
    std::vector<BodyState> start(bodies_), end(bodies_);
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

  void solve(const StepArrays& a) {
    const SoftStepOutput output = {a.end, a.impulses, a.done};
    SoftStepInput input = {a.acting,     a.start,
                           a.pulls,      a.bodies,
                           a.contacts,   a.impulses_before,
                           a.touching,   &a.counts->touching,
                           a.most_pairs, a.dt,
                            a.joints};
    if (has_newton()) input = newton_.step(to_, input, a.options, output);
    solver_.step(to_, input, a.options, output);
  }

  bool has_newton() const { return options_.solver.kind != SolverKind::soft; }

  // Makes room for the bodies and pairs of a solver.
  Status reserve_solvers() {
    const std::uint32_t units = std::max(newton_.units(), kNewtonUnits);
    const Status status = has_newton() ? newton_.reserve(to_, bodies_, most_pairs_, units) : Status::kOk;
    return status == Status::kOk ? solver_.reserve(to_, usual_room(bodies_, most_pairs_, most_remembered_))
                                 : status;
  }

  void queue_reading() {
    to_.copy_later(counts_.data(), read_);
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
    if (status == Status::kOk && read_.pairs > most_pairs_) {
      grew = true;
      status = reserve_pairs(read_.pairs + read_.pairs / 4);
    }
    const std::uint32_t moved = std::max({read_.middle, read_.approaches, read_.surprised});
    if (status == Status::kOk && moved > most_moved_) {
      grew = true;
      status = reserve_moved(moved + moved / 2);
    }
    if (status == Status::kOk && (read_.found > most_found_ || read_.remembered > most_remembered_)) {
      grew = true;
      status = reserve_contacts(read_.found + read_.found / 4, read_.remembered + read_.remembered / 4);
    }
    if (status == Status::kOk && !grew && solver_needs_.has_room == 0) {
      grew = true;
      status = solver_.reserve(to_, larger_room(solver_.room(), solver_needs_));
    }
    if (status == Status::kOk && !grew && has_newton() && newton_needs_.has_room == 0) {
      grew = true;
      const std::uint32_t units = newton_needs_.units + newton_needs_.units / 4;
      status = newton_.reserve(to_, bodies_, most_pairs_, units);
    }
    whole = !grew;
    if (grew) ++generation_;
    return status;
  }

  // The results of a step become what the next one begins with.
  Status go_on() {
    constexpr double kWide = 3;
    records_count_ = read_.pairs, remembered_count_ = read_.remembered;
    std::swap(records_[0], records_[1]), std::swap(remembered_[0], remembered_[1]);
    std::swap(touches_[0], touches_[1]), std::swap(begun_[0], begun_[1]);
    parity_ = 1 - parity_;
    if (read_.broken > 0) ++generation_;
    const Status joints = joints_.take_broken(to_, read_.broken > 0);
    const double needed = read_.reach.farthest(0.5 * options_.solver.slop);
    if (kWide * needed < within_) within_ = 1.5 * needed, ++generation_;
    return joints == Status::kOk ? to_.status() : joints;
  }

  // Calls visit(array, bytes) for each array of the state, and what of it is kept. Arrays grow, but do not
  // shrink, and all that grew kept these.
  template <typename Visit>
  void visit_kept(const ParallelState<Executor>& state, const Visit& visit) const {
    const auto rows = [&]<typename T>(const Array<T>& array, std::size_t count) {
      visit(array, count * sizeof(T));
    };
    rows(properties_, bodies_), rows(acting_, bodies_);
    rows(states_[0], bodies_), rows(states_[1], bodies_);
    rows(placed_, bodies_), rows(quiet_, bodies_), rows(group_, bodies_);
    if (state.has_forces) rows(forces_, bodies_);
    rows(records_[0], state.records), rows(touches_[0], state.records);
    rows(remembered_[0], state.remembered);
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

  template <typename T>
  Status put(Array<T>& array, const T& value) {
    const Status status = array.reserve(1);
    return status == Status::kOk ? to_.copy(std::span<const T>(&value, 1), array.data()) : status;
  }
  template <typename T>
  Status put(Array<T>& array, std::span<const T> values) {
    const Status status = array.reserve(std::max<std::size_t>(1, values.size()));
    return status == Status::kOk && !values.empty() ? to_.copy(values, array.data()) : status;
  }
  template <typename T>
  Status fill(Array<T>& array, const T& value) {
    return put<T>(array, std::vector<T>(bodies_, value));
  }

  Status reserve_bodies(const ParallelBodies& bodies) {
    std::vector<std::uint32_t> asset;
    for (const BodyProperties& body : bodies.properties) asset.push_back(body.shape);
    Status out = Status::kOk;
    for (Status status :
         {put<BodyProperties>(properties_, bodies.properties),
          put<BodyProperties>(acting_, bodies.properties), put<BodyState>(states_[0], bodies.states),
          put<BodyState>(states_[1], bodies.states), put<BodyState>(states_[2], bodies.states),
          put<std::uint32_t>(asset_, asset), put<double>(inner_radius_, bodies.inner_radii),
          put<AssetBox>(boxes_, bodies.boxes), fill<std::uint8_t>(placed_, 0), fill<double>(quiet_, 0),
          fill<std::uint32_t>(group_, Sleep::kAwake), fill<std::uint8_t>(idle_, 0), pulls_.reserve(bodies_),
          pose_.reserve(bodies_), motion_.reserve(bodies_), ways_.reserve(bodies_),
          ways_ahead_.reserve(bodies_), label_.reserve(bodies_), marks_.reserve(bodies_)}) {
      if (out == Status::kOk) out = status;
    }
    return out;
  }

  Status reserve_pairs(std::uint32_t pairs) {
    const std::uint32_t kept = most_pairs_;
    Status out = Status::kOk;
    for (Status status :
         {records_[0].grow(pairs, kept), records_[1].grow(pairs, kept), touches_[0].grow(pairs, kept),
          touches_[1].grow(pairs, kept), begun_[0].grow(pairs, kept), begun_[1].grow(pairs, kept),
          plans_.reserve(pairs), flags_.reserve(pairs + 1), sums_.reserve(pairs + 1), list_.reserve(pairs),
          asked_.reserve(pairs), reach_.reserve(pairs), row_first_.reserve(pairs), row_end_.reserve(pairs),
          touching_.reserve(pairs), to_.reserve(pairs + 1), ask_.reserve(bodies_, pairs)}) {
      if (out == Status::kOk) out = status;
    }
    most_pairs_ = out == Status::kOk ? pairs : 0;
    return out == Status::kOk ? reserve_solvers() : out;
  }

  Status reserve_moved(std::uint32_t rows) {
    std::vector<ObjectPair> pairs(rows);
    for (std::uint32_t r = 0; r < rows; ++r) pairs[r] = {2 * r, 2 * r + 1};
    Status out = Status::kOk;
    // Questions look at the poses of all bodies.
    for (Status status :
         {put<ObjectPair>(moved_pairs_, pairs),
          put<std::uint32_t>(moved_asset_, std::vector<std::uint32_t>(2 * rows)),
          put<Pose>(moved_pose_, std::vector<Pose>(2 * rows, kIdentityPose)), approaches_.reserve(rows)}) {
      if (out == Status::kOk) out = status;
    }
    most_moved_ = out == Status::kOk ? rows : 0;
    return out;
  }

  Status reserve_contacts(std::uint32_t found, std::uint32_t remembered) {
    found = std::max(found, most_found_), remembered = std::max(remembered, most_remembered_);
    const std::uint32_t kept = most_remembered_;
    Status out = Status::kOk;
    for (Status status :
         {found_.reserve(found), remembered_[0].grow(remembered, kept), remembered_[1].grow(remembered, kept),
          contacts_.grow(remembered, kept), place_.reserve(remembered),
          contact_marks_.reserve(2 * remembered), impulses_before_.reserve(remembered),
          impulses_.reserve(remembered), done_.grow(remembered, kept)}) {
      if (out == Status::kOk) out = status;
    }
    if (out != Status::kOk) return out;
    most_found_ = found, most_remembered_ = remembered;
    return reserve_solvers();
  }

  Executor& to_;
  Questions& ask_;
  ParallelSoftStep<Executor> solver_;
  ParallelJoints<Executor> joints_;
  ParallelNewtonStep<Executor> newton_;
  ParallelOptions options_;
  std::uint32_t bodies_ = 0, most_pairs_ = 0, most_moved_ = 0, most_found_ = 0, most_remembered_ = 0;
  std::uint32_t records_count_ = 0, remembered_count_ = 0;  // of the last step that was whole
  double within_ = 0;                                       // how far apart near pairs are
  double thinnest_ = INFINITY;
  bool has_forces_ = false;
  StepCounts read_ = {};
  SoftStepNeeds solver_needs_ = {};
  NewtonNeeds newton_needs_ = {};
  double dt_ = 0;
  std::uint64_t generation_ = 0;  // of all that is queued, memory included
  int parity_ = 0;                // of the step: records change places
  typename Executor::Sequence sequences_[kParts][2];

  // See StepArrays.
  Array<BodyProperties> properties_, acting_;
  Array<BodyState> states_[3];
  Array<Pull> pulls_;
  Array<BodyForce> forces_;
  Array<std::uint8_t> placed_, idle_;
  Array<std::uint32_t> asset_, group_, label_, marks_;
  Array<Pose> pose_;
  Array<Motion> motion_;
  Array<BodyWay> ways_, ways_ahead_;
  Array<double> quiet_, inner_radius_;
  Array<AssetBox> boxes_;
  Array<PairRecord> records_[2];
  Array<WorldTouch> touches_[2], begun_[2];
  Array<PairPlan> plans_;
  Array<std::uint32_t> flags_, sums_, list_, row_first_, row_end_;
  Array<ObjectPair> asked_, moved_pairs_;
  Array<double> reach_;
  Array<std::uint32_t> moved_asset_;
  Array<Pose> moved_pose_;
  Array<Approach> approaches_;
  Array<ContactPair> touching_;
  Array<ContactPoint> found_, contacts_;
  Array<CachedContact> remembered_[2];
  Array<std::uint32_t> place_;
  Array<std::uint8_t> contact_marks_;
  Array<ContactImpulse> impulses_before_, impulses_, done_;
  Array<StepCounts> counts_;

  Array<WorldTouch> listed_touches_;
  Array<ObjectPair> listed_pairs_;
  Array<ContactSums> sums_of_contacts_;
};

}  // namespace tandem::dynamics
