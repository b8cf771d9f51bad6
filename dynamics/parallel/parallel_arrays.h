#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "dynamics/islands.h"
#include "dynamics/parallel/bytes_of.h"
#include "dynamics/parallel/step_arrays.h"

namespace tandem::dynamics {

/// What a parallel simulation is made of.
struct ParallelBodies {
  std::span<const BodyProperties> properties;
  std::span<const BodyState> states;
  std::span<const double> inner_radii;  ///< of each shape, see inner_radii()
  std::span<const AssetBox> boxes;      ///< of each shape
  std::span<const Joint> joints = {};
};

/// The arrays of a parallel simulation, in its executor's memory. Those with an element for each pair or
/// contact grow; what the next step starts from stays in them then.
template <typename Executor>
struct ParallelArrays {
  template <typename T>
  using Array = typename Executor::template Array<T>;

  std::uint32_t bodies = 0, most_pairs = 0, most_moved = 0, most_found = 0, most_remembered = 0;
  bool has_forces = false;

  // See StepArrays.
  Array<BodyProperties> properties, acting;
  Array<BodyState> states[3];
  Array<Pull> pulls;
  Array<BodyForce> forces;
  Array<std::uint8_t> placed, idle;
  Array<std::uint32_t> asset, group, label, marks, has_missed;
  Array<Pose> pose;
  Array<Motion> motion;
  Array<BodyWay> ways, ways_ahead;
  Array<double> quiet, inner_radius;
  Array<AssetBox> boxes;
  Array<PairRecord> records[2];
  Array<WorldTouch> touches[2], begun[2];
  Array<PairPlan> plans;
  Array<std::uint32_t> flags, sums, list, row_first, row_end;
  Array<ObjectPair> asked, moved_pairs;
  Array<double> reach;
  Array<std::uint32_t> moved_asset;
  Array<Pose> moved_pose;
  Array<Approach> approaches;
  Array<ContactPair> touching;
  Array<ContactPoint> found, contacts;
  Array<CachedContact> remembered[2];
  Array<std::uint32_t> place;
  Array<std::uint8_t> contact_marks;
  Array<ContactImpulse> impulses_before, impulses, done;
  Array<StepCounts> counts;

  StepArrays view() const {
    StepArrays a = {};
    a.bodies = bodies;
    a.properties = properties.data(), a.acting = acting.data();
    a.before = states[0].data(), a.start = states[1].data(), a.end = states[2].data();
    a.pulls = pulls.data(), a.forces = has_forces ? forces.data() : nullptr;
    a.placed = placed.data(), a.idle = idle.data();
    a.asset = asset.data(), a.pose = pose.data(), a.motion = motion.data();
    a.ways = ways.data(), a.ways_ahead = ways_ahead.data();
    a.quiet = quiet.data(), a.group = group.data(), a.label = label.data(), a.marks = marks.data();
    a.has_missed = has_missed.data();
    a.inner_radius = inner_radius.data(), a.boxes = boxes.data();
    a.most_pairs = most_pairs;
    a.records_before = records[0].data(), a.records = records[1].data();
    a.touches_before = touches[0].data(), a.touches = touches[1].data();
    a.begun_before = begun[0].data(), a.begun = begun[1].data();
    a.plans = plans.data(), a.flags = flags.data(), a.sums = sums.data(), a.list = list.data();
    a.asked = asked.data(), a.reach = reach.data();
    a.row_first = row_first.data(), a.row_end = row_end.data();
    a.most_moved = most_moved, a.moved_pairs = moved_pairs.data(), a.moved_asset = moved_asset.data();
    a.moved_pose = moved_pose.data();
    a.approaches = approaches.data(), a.touching = touching.data();
    a.most_found = most_found, a.most_remembered = most_remembered;
    a.found = found.data();
    a.remembered_before = remembered[0].data(), a.remembered = remembered[1].data();
    a.contacts = contacts.data(), a.place = place.data(), a.contact_marks = contact_marks.data();
    a.impulses_before = impulses_before.data(), a.impulses = impulses.data(), a.done = done.data();
    a.counts = counts.data();
    return a;
  }

  std::size_t bytes() const {
    return bytes_of(properties, acting, states[0], states[1], states[2], pulls, forces, placed, idle,
                    has_missed, asset, group, label, marks, pose, motion, ways, ways_ahead, quiet,
                    inner_radius, boxes, records[0], records[1], touches[0], touches[1], begun[0], begun[1],
                    plans, flags, sums, list, row_first, row_end, asked, moved_pairs, reach, moved_asset,
                    moved_pose, approaches, touching, found, contacts, remembered[0], remembered[1], place,
                    contact_marks, impulses_before, impulses, done, counts);
  }

  /// The results of a step become what the next one begins with.
  void go_on() {
    std::swap(records[0], records[1]), std::swap(remembered[0], remembered[1]);
    std::swap(touches[0], touches[1]), std::swap(begun[0], begun[1]);
  }

  Status reserve_bodies(Executor& to, const ParallelBodies& all) {
    bodies = static_cast<std::uint32_t>(all.properties.size());
    std::vector<std::uint32_t> shapes;
    for (const BodyProperties& body : all.properties) shapes.push_back(body.shape);
    Status out = Status::kOk;
    for (Status status : {put<BodyProperties>(to, properties, all.properties),
                          put<BodyProperties>(to, acting, all.properties),
                          put<BodyState>(to, states[0], all.states),
                          put<BodyState>(to, states[1], all.states),
                          put<BodyState>(to, states[2], all.states),
                          put<std::uint32_t>(to, asset, shapes),
                          put<double>(to, inner_radius, all.inner_radii),
                          put<AssetBox>(to, boxes, all.boxes),
                          fill<std::uint8_t>(to, placed, 0),
                          fill<double>(to, quiet, 0),
                          fill<std::uint32_t>(to, group, Sleep::kAwake),
                          fill<std::uint8_t>(to, idle, 0),
                          pulls.reserve(bodies),
                          pose.reserve(bodies),
                          motion.reserve(bodies),
                          ways.reserve(bodies),
                          ways_ahead.reserve(bodies),
                          label.reserve(bodies),
                          marks.reserve(bodies),
                          has_missed.reserve(bodies)}) {
      if (out == Status::kOk) out = status;
    }
    return out;
  }

  Status reserve_pairs(std::uint32_t pairs) {
    const std::uint32_t kept = most_pairs;
    Status out = Status::kOk;
    for (Status status :
         {records[0].grow(pairs, kept), records[1].grow(pairs, kept), touches[0].grow(pairs, kept),
          touches[1].grow(pairs, kept), begun[0].grow(pairs, kept), begun[1].grow(pairs, kept),
          plans.reserve(pairs), flags.reserve(pairs + 1), sums.reserve(pairs + 1), list.reserve(pairs),
          asked.reserve(pairs), reach.reserve(pairs), row_first.reserve(pairs), row_end.reserve(pairs),
          touching.reserve(pairs)}) {
      if (out == Status::kOk) out = status;
    }
    most_pairs = out == Status::kOk ? pairs : 0;
    return out;
  }

  Status reserve_moved(Executor& to, std::uint32_t rows) {
    std::vector<ObjectPair> pairs(rows);
    for (std::uint32_t r = 0; r < rows; ++r) pairs[r] = {2 * r, 2 * r + 1};
    Status out = Status::kOk;
    // Questions look at the poses of all bodies.
    for (Status status :
         {put<ObjectPair>(to, moved_pairs, pairs),
          put<std::uint32_t>(to, moved_asset, std::vector<std::uint32_t>(2 * rows)),
          put<Pose>(to, moved_pose, std::vector<Pose>(2 * rows, kIdentityPose)), approaches.reserve(rows)}) {
      if (out == Status::kOk) out = status;
    }
    most_moved = out == Status::kOk ? rows : 0;
    return out;
  }

  Status reserve_contacts(std::uint32_t to_find, std::uint32_t to_remember) {
    to_find = std::max(to_find, most_found), to_remember = std::max(to_remember, most_remembered);
    const std::uint32_t kept = most_remembered;
    Status out = Status::kOk;
    for (Status status :
         {found.reserve(to_find), remembered[0].grow(to_remember, kept),
          remembered[1].grow(to_remember, kept), contacts.grow(to_remember, kept), place.reserve(to_remember),
          contact_marks.reserve(2 * to_remember), impulses_before.reserve(to_remember),
          impulses.reserve(to_remember), done.grow(to_remember, kept)}) {
      if (out == Status::kOk) out = status;
    }
    if (out != Status::kOk) return out;
    most_found = to_find, most_remembered = to_remember;
    return Status::kOk;
  }

  /// Calls visit(array, bytes) for each array that the next steps depend on, and what of it they look at.
  template <typename Visit>
  void visit_kept(std::uint32_t kept_records, std::uint32_t kept_contacts, bool with_forces,
                  const Visit& visit) const {
    const auto rows = [&]<typename T>(const Array<T>& array, std::size_t count) {
      visit(array, count * sizeof(T));
    };
    rows(properties, bodies), rows(acting, bodies);
    rows(states[0], bodies), rows(states[1], bodies);
    rows(placed, bodies), rows(quiet, bodies), rows(group, bodies);
    if (with_forces) rows(forces, bodies);
    rows(records[0], kept_records), rows(touches[0], kept_records);
    rows(remembered[0], kept_contacts);
  }

  template <typename T>
  static Status put(Executor& to, Array<T>& array, const T& value) {
    const Status status = array.reserve(1);
    return status == Status::kOk ? to.copy(std::span<const T>(&value, 1), array.data()) : status;
  }
  template <typename T>
  static Status put(Executor& to, Array<T>& array, std::span<const T> values) {
    const Status status = array.reserve(std::max<std::size_t>(1, values.size()));
    return status == Status::kOk && !values.empty() ? to.copy(values, array.data()) : status;
  }
  template <typename T>
  Status fill(Executor& to, Array<T>& array, const T& value) {
    return put<T>(to, array, std::vector<T>(bodies, value));
  }
};

}  // namespace tandem::dynamics
