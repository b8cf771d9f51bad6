#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "dynamics/parallel/bytes_of.h"
#include "dynamics/parallel/joint_arrays.h"

namespace tandem::dynamics {

/// The joints of a state that is kept, in the CPU's memory.
struct ParallelJointState {
  std::vector<Joint> joints;
  std::vector<JointMemory> memory;
};

/// The joints of a ParallelSimulation. The CPU knows them, and their order, which it finds whenever they
/// change; where they are is known in the executor's memory alone.
template <typename Executor>
class ParallelJoints {
 public:
  /// bodies: of which these are the joints, and how they stand.
  Status set(Executor& to, std::span<const Joint> joints, std::span<const BodyProperties> bodies,
             std::span<const BodyState> states) {
    joints_.assign(joints.begin(), joints.end()), broken_.clear(), motions_.clear();
    tasks_ = colours_ = 0;
    if (joints.empty()) return Status::kOk;
    motions_ = motions_of(bodies);
    std::vector<JointMemory> memory;
    for (const Joint& joint : joints) memory.push_back(memory_of(joint, states));
    const Status status = put_joints(to, 0);
    return status == Status::kOk ? to.copy(std::span<const JointMemory>(memory), memory_[0].data()) : status;
  }

  /// See Simulation. bodies, states: as of set().
  Status add(Executor& to, const Joint& joint, std::span<const BodyProperties> bodies,
             std::span<const BodyState> states, std::uint32_t& place) {
    place = free_place(joints_);
    const std::size_t kept = joints_.size();
    if (motions_.empty()) motions_ = motions_of(bodies);
    const JointMemory memory = memory_of(joint, states);
    std::vector<Joint> before = joints_;
    joints_.resize(std::max<std::size_t>(kept, place + 1));
    joints_[place] = joint;
    Status status = put_joints(to, kept);
    if (status == Status::kOk)
      status = to.copy(std::span<const JointMemory>(&memory, 1), memory_[0].data() + place);
    if (status != Status::kOk) joints_ = std::move(before);
    return status;
  }
  Status remove(Executor& to, std::uint32_t joint) {
    joints_[joint] = gone_joint();
    const JointMemory none;
    const Status status = to.copy(std::span<const JointMemory>(&none, 1), memory_[0].data() + joint);
    return status == Status::kOk ? put_joints(to, joints_.size()) : status;
  }
  Status set_motor(Executor& to, std::uint32_t joint, double speed, double most_effort) {
    joints_[joint].speed = speed, joints_[joint].most_effort = most_effort;
    return to.copy(std::span<const Joint>(&joints_[joint], 1), of_joints_.data() + joint);
  }

  /// Takes which joints broke in the last step. any: whether some did.
  Status take_broken(Executor& to, bool any) {
    broken_.clear();
    if (!any) return Status::kOk;
    std::vector<std::uint8_t> broke(joints_.size());
    const Status status = to.copy(broke_.data(), std::span(broke));
    if (status != Status::kOk) return status;
    for (std::uint32_t i = 0; i < joints_.size(); ++i) {
      if (broke[i] == 0) continue;
      joints_[i].holds = false;
      broken_.push_back(i);
    }
    return put_joints(to, joints_.size());
  }

  Status save(Executor& to, ParallelJointState& state) const {
    state.joints = joints_;
    return read(to, state.memory);
  }
  /// Condition: there have been joints, or the state has none.
  Status restore(Executor& to, const ParallelJointState& state) {
    joints_ = state.joints, broken_.clear();
    const Status status = motions_.empty() ? Status::kOk : put_joints(to, 0);
    if (status != Status::kOk || joints_.empty()) return status;
    return to.copy(std::span<const JointMemory>(state.memory), memory_[0].data());
  }

  std::size_t bytes() const {
    return bytes_of(of_joints_, memory_[0], memory_[1], broke_, places_, colour_end_, joints_of_, soft_);
  }

  std::span<const Joint> all() const { return joints_; }
  /// Returns the bodies of each joint, see Joint::pair().
  std::vector<ObjectPair> joined() const {
    std::vector<ObjectPair> out;
    for (const Joint& joint : joints_) out.push_back(joint.pair());
    return out;
  }
  std::span<const std::uint32_t> broken() const { return broken_; }

  /// Copies what each joint keeps from the executor's memory.
  Status read(Executor& to, std::vector<JointMemory>& memory) const {
    memory.resize(joints_.size());
    return joints_.empty() ? Status::kOk : to.copy(memory_[0].data(), std::span(memory));
  }

  /// broken: in the executor's memory, how many joints break.
  JointArrays arrays(std::uint32_t* broken) const {
    JointArrays out;
    out.count = static_cast<std::uint32_t>(joints_.size());
    out.joints = of_joints_.data();
    out.memory = memory_[0].data(), out.memory_end = memory_[1].data();
    out.broke = broke_.data(), out.broken = broken;
    out.tasks = tasks_, out.colours = colours_;
    out.places = places_.data(), out.colour_end = colour_end_.data();
    out.joints_of = joints_of_.data(), out.soft = soft_.data();
    return out;
  }

 private:
  template <typename T>
  using Array = typename Executor::template Array<T>;

  template <typename T>
  static Status put(Executor& to, Array<T>& array, const std::vector<T>& values) {
    const Status status = array.reserve(std::max<std::size_t>(1, values.size()));
    return status == Status::kOk && !values.empty() ? to.copy(std::span<const T>(values), array.data())
                                                    : status;
  }

  // kept: of how many joints the executor's memory knows where they are.
  Status put_joints(Executor& to, std::uint64_t kept) {
    const JointOrder order = find_joint_order(joints_, motions_);
    tasks_ = order.tasks(), colours_ = static_cast<std::uint32_t>(order.colour_end.size());
    Status out = Status::kOk;
    for (Status status : {put(to, of_joints_, joints_), put(to, places_, order.places),
                          put(to, colour_end_, order.colour_end), put(to, joints_of_, order.joints_of),
                          memory_[0].grow(joints_.size(), kept), memory_[1].reserve(joints_.size()),
                          broke_.reserve(joints_.size()), soft_.reserve(order.places.size())}) {
      if (out == Status::kOk) out = status;
    }
    return out;
  }

  std::vector<Joint> joints_;
  std::vector<Motion> motions_;  // of bodies, once there have been joints
  std::vector<std::uint32_t> broken_;
  std::uint32_t tasks_ = 0, colours_ = 0;

  // See JointArrays.
  Array<Joint> of_joints_;
  Array<JointMemory> memory_[2];
  Array<std::uint8_t> broke_;
  Array<PlacedJoint> places_;
  Array<std::uint32_t> colour_end_, joints_of_;
  Array<SoftJoint> soft_;
};

}  // namespace tandem::dynamics
