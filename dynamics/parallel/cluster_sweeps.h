#pragma once
#include <cstdint>

#include "dynamics/parallel/soft_sweeps.h"

/// Sweeps of few pairs, whose rows and bodies all lie in the own memory of the blocks of a cluster. A pair's
/// visit waits neither for rows nor for turns: the workers meet after each colour.
namespace tandem::dynamics {

namespace cluster_sweeps_detail {

/// A body, in the memory of block `number % blocks`.
struct Body {
  SoftMotion velocity, moved, start, gain;
};

/// What a block knows of the sweeps.
struct Plan {
  static constexpr std::uint32_t kMostTasks = 64, kElsewhere = 0xFFFFFFFFu;

  std::uint32_t bytes;                                 // that all tasks of the block would take
  std::uint32_t stages, end_of_stage[kSharedColours];  // tasks with which colours end that have any
  std::uint32_t first_byte[kMostTasks];                // of each of the block's tasks, or kElsewhere
};

/// Has the places of a task's part of SoftRows and its turns in the own memory of its block.
struct TaskMemory {
  SoftPairs* pairs;
  SoftTurning* turnings;
  SoftTurns* turns;
  SoftNormal* normals;
  SoftGap* gaps;
  SoftFriction* frictions;

  TANDEM_HD TaskMemory(char* at, std::uint32_t contacts)
      : pairs(reinterpret_cast<SoftPairs*>(at)),
        turnings(reinterpret_cast<SoftTurning*>(pairs + kGroupsOfTeam)),
        turns(reinterpret_cast<SoftTurns*>(turnings + kGroupsOfTeam)),
        normals(reinterpret_cast<SoftNormal*>(turns + kGroupsOfTeam)),
        gaps(reinterpret_cast<SoftGap*>(normals + contacts)),
        frictions(reinterpret_cast<SoftFriction*>(gaps + contacts)) {}

  TANDEM_HD static std::uint32_t bytes(std::uint32_t contacts) {
    return static_cast<std::uint32_t>(
        kGroupsOfTeam * (sizeof(SoftPairs) + sizeof(SoftTurning) + sizeof(SoftTurns)) +
        contacts * (sizeof(SoftNormal) + sizeof(SoftGap) + sizeof(SoftFriction)));
  }
};

TANDEM_HD inline std::uint32_t first_contact_of(const SoftSweeps& all, std::uint32_t task) {
  return all.rows.pairs[kGroupsOfTeam * task].first;
}
TANDEM_HD inline std::uint32_t contacts_of(const SoftSweeps& all, std::uint32_t task) {
  const SoftPairs& last = all.rows.pairs[kGroupsOfTeam * task + kGroupsOfTeam - 1];
  return last.first + last.contacts - first_contact_of(all, task);
}

// PairVisit has internal linkage, and so has what is made with it.
namespace {

class Sweeper {
 public:
  TANDEM_HD Sweeper(const SoftSweeps& all, const ClusterWorker& worker)
      : all_(all),
        worker_(worker),
        plan_(reinterpret_cast<Plan*>(worker.own)),
        tasks_(*all.groups / kGroupsOfTeam),
        slots_((all.bodies + worker.blocks - 1) / worker.blocks),
        bodies_(reinterpret_cast<Body*>(worker.own + kBytesOfPlan)) {
    while (1u << shift_ < worker.blocks) ++shift_;
  }

  /// Result: whether a cluster is worth it: most has room. A task that has none in its block stays where it
  /// is.
  TANDEM_HD bool make_plan() {
    const std::uint64_t tables = kBytesOfPlan + std::uint64_t{slots_} * sizeof(Body);
    const bool may_fit = tasks_ <= Plan::kMostTasks * worker_.blocks && tables < worker_.own_bytes;
    if (tasks_ == 0 || !may_fit) return false;
    // Rows of the plan are read side by side, and then added up.
    if (worker_.team == 0) {
      for (std::uint32_t colour = worker_.lane; colour < kSharedColours; colour += worker_.lanes)
        plan_->end_of_stage[colour] = soft_sweeps_detail::end_of_colour(all_, colour);
      for (std::uint32_t k = worker_.lane; k < own_tasks(); k += worker_.lanes)
        plan_->first_byte[k] = TaskMemory::bytes(contacts_of(all_, task(k)));
    }
    worker_.meet();
    if (worker_.team == 0 && worker_.lane == 0) add_up(static_cast<std::uint32_t>(tables));
    worker_.meet();
    std::uint64_t bytes = 0;
    for (std::uint32_t block = 0; block < worker_.blocks; ++block)
      bytes += worker_.at_block(block, plan_)->bytes;
    return bytes <= std::uint64_t{worker_.blocks} * (worker_.own_bytes - tables);
  }

  TANDEM_HD void take() {
    for_own_tasks([&](std::uint32_t k) {
      const std::uint32_t contacts = contacts_of(all_, task(k)), group = kGroupsOfTeam * task(k);
      const TaskMemory to = memory(k, contacts);
      copy(all_.rows.pairs + group, to.pairs, kGroupsOfTeam);
      copy(all_.turns + group, to.turns, kGroupsOfTeam);
      copy_rows(k, contacts, [&](auto* there, auto* here, std::uint32_t count) { copy(there, here, count); });
    });
    for_own_bodies([&](std::uint32_t i, Body& body) {
      body = {};
      body.gain = all_.gains[i];
    });
    worker_.meet();
    // The rows of a task are counted from its own first one.
    for_own_tasks([&](std::uint32_t k) {
      SoftPairs* const pairs = memory(k, 0).pairs;
      if (worker_.lane == 0) {
        for (std::uint32_t g = kGroupsOfTeam; g-- > 0;) pairs[g].first -= pairs[0].first;
      }
    });
    worker_.meet();
  }

  TANDEM_HD void put_back() {
    for_own_tasks([&](std::uint32_t k) {
      copy_rows(k, contacts_of(all_, task(k)),
                [&](auto* there, auto* here, std::uint32_t count) { copy(here, there, count); });
    });
    for_own_bodies([&](std::uint32_t i, Body& body) {
      all_.velocities[i] = shared_of(body.velocity), all_.moved[i] = shared_of(body.moved);
    });
    if (worker_.block == 0 && worker_.team == 0 && worker_.lane == 0) *all_.is_done = 1;
  }

  TANDEM_HD void sweep() {
    const std::uint32_t sweeps = all_.sweeps();
    for (std::uint32_t number = 0; number < sweeps; ++number) {
      const Sweep sweep = sweep_of(number, all_.substeps);
      std::uint32_t begin = 0;
      for (std::uint32_t stage = 0; begin < tasks_; ++stage) {
        // Each pair with a colour of its own is a stage.
        const std::uint32_t end = stage < plan_->stages ? plan_->end_of_stage[stage] : begin + 1;
        const std::uint32_t first = (begin + worker_.blocks - 1 - worker_.block) >> shift_;
        for (std::uint32_t k = first; task(k) < end; ++k) {
          if (k % worker_.teams == worker_.team) visit(sweep, k);
        }
        worker_.meet();
        begin = end;
      }
    }
  }

 private:
  static constexpr std::uint32_t kBytesOfPlan = (sizeof(Plan) + 63) / 64 * 64;

  struct alignas(16) Sixteen {
    std::uint32_t words[4];
  };

  TANDEM_HD std::uint32_t task(std::uint32_t k) const { return worker_.block + (k << shift_); }
  TANDEM_HD std::uint32_t own_tasks() const {
    return tasks_ > worker_.block ? ((tasks_ - worker_.block - 1) >> shift_) + 1 : 0;
  }
  TANDEM_HD TaskMemory memory(std::uint32_t k, std::uint32_t contacts) const {
#if defined(__CUDA_ARCH__)
    char* const own = static_cast<char*>(__cvta_shared_to_generic(__cvta_generic_to_shared(worker_.own)));
#else
    char* const own = worker_.own;
#endif
    return {own + plan_->first_byte[k], contacts};
  }

  TANDEM_HD void add_up(std::uint32_t byte) {
    plan_->bytes = 0;
    for (std::uint32_t k = 0; k < own_tasks(); ++k) {
      const std::uint32_t bytes = plan_->first_byte[k];
      plan_->bytes += bytes;
      const bool has_room = byte + bytes <= worker_.own_bytes;
      plan_->first_byte[k] = has_room ? byte : Plan::kElsewhere;
      if (has_room) byte += bytes;
    }
    std::uint32_t stages = 0, begin = 0;
    for (std::uint32_t colour = 0; colour < kSharedColours; ++colour) {
      const std::uint32_t end = plan_->end_of_stage[colour];
      if (end > begin) plan_->end_of_stage[stages++] = end;
      begin = end;
    }
    plan_->stages = stages;
  }

  // Calls visit(k) for the team's tasks that have room.
  template <typename Visit>
  TANDEM_HD void for_own_tasks(const Visit& visit) {
    for (std::uint32_t k = worker_.team; k < own_tasks(); k += worker_.teams) {
      if (plan_->first_byte[k] != Plan::kElsewhere) visit(k);
    }
  }
  template <typename Visit>
  TANDEM_HD void for_own_bodies(const Visit& visit) {
    for (std::uint32_t slot = worker_.team * worker_.lanes + worker_.lane; slot < slots_;
         slot += worker_.teams * worker_.lanes) {
      const std::uint32_t i = worker_.block + (slot << shift_);
      if (i < all_.bodies) visit(i, bodies_[slot]);
    }
  }

  template <typename T>
  TANDEM_HD void copy(const T* from, T* to, std::uint32_t count) const {
    static_assert(sizeof(T) % sizeof(Sixteen) == 0);
    const auto* const source = reinterpret_cast<const Sixteen*>(from);
    auto* const target = reinterpret_cast<Sixteen*>(to);
    for (std::uint32_t i = worker_.lane; i < count * (sizeof(T) / sizeof(Sixteen)); i += worker_.lanes)
      target[i] = source[i];
  }

  // Calls copy_one(there, here, count) for what visits of a task change.
  template <typename Copy>
  TANDEM_HD void copy_rows(std::uint32_t k, std::uint32_t contacts, const Copy& copy_one) const {
    const TaskMemory here = memory(k, contacts);
    const std::uint32_t first = first_contact_of(all_, task(k));
    copy_one(all_.rows.turnings + kGroupsOfTeam * task(k), here.turnings, kGroupsOfTeam);
    copy_one(all_.rows.normals + first, here.normals, contacts);
    copy_one(all_.rows.gaps + first, here.gaps, contacts);
    copy_one(all_.rows.frictions + first, here.frictions, contacts);
  }

  TANDEM_HD static SharedMotion shared_of(const SoftMotion& motion) {
    SharedMotion out = {};
    for (int k = 0; k < 3; ++k)
      out.centre.data[k] = std::bit_cast<std::uint32_t>(motion.centre[k]),
      out.spin.data[k] = std::bit_cast<std::uint32_t>(motion.spin[k]);
    return out;
  }
  TANDEM_HD static MotionOf<OneLane> lanes_of(const SoftMotion& motion) {
    const auto& [c, s] = motion;
    return {{{c[0]}, {c[1]}, {c[2]}}, {{s[0]}, {s[1]}, {s[2]}}};
  }

  TANDEM_HD void visit(const Sweep& sweep, std::uint32_t k) const {
    if (plan_->first_byte[k] == Plan::kElsewhere) {
      visit_groups(sweep, all_.rows, all_.turns, kGroupsOfTeam * task(k));
      return;
    }
    const SoftPairs* const pairs = memory(k, 0).pairs;
    const SoftPairs& last = pairs[kGroupsOfTeam - 1];
    const TaskMemory here = memory(k, last.first + last.contacts);
    const SoftRows rows = {nullptr,      nullptr,   here.pairs,     here.turnings,
                           here.normals, here.gaps, here.frictions, all_.rows.inverse_h};
    visit_groups(sweep, rows, here.turns, 0);
  }
  TANDEM_HD void visit_groups(const Sweep& sweep, const SoftRows& rows, const SoftTurns* turns,
                              std::uint32_t first) const {
    for (std::uint32_t lane = worker_.lane; lane < kGroupsOfTeam * kSoftWidth; lane += worker_.lanes)
      visit_lane(sweep, rows, turns, first + lane / kSoftWidth, static_cast<int>(lane % kSoftWidth));
  }

  TANDEM_HD void visit_lane(const Sweep& sweep, const SoftRows& rows, const SoftTurns* turns,
                            std::uint32_t group, int lane) const {
    if (static_cast<std::uint32_t>(lane) >= rows.pairs[group].pairs) return;
    Body* at[2] = {nullptr, nullptr};
    bool is_last[2];
    for (int side = 0; side < 2; ++side) {
      const std::uint32_t body = turns[group].body[side][lane];
      const BodyTurn turn = turns[group].turn[side][lane];
      is_last[side] = turn.turn + 1 == turn.turns;
      if (body != kNoIndex)
        at[side] = worker_.at_block(body & (worker_.blocks - 1), bodies_) + (body >> shift_);
    }
    const bool follows = sweep.kind == Sweep::Kind::follow;
    SoftMotion velocities[2] = {}, moved[2] = {};
    for (int side = 0; side < 2; ++side) {
      if (at[side] != nullptr) velocities[side] = at[side]->velocity;
      if (at[side] != nullptr && follows) moved[side] = at[side]->moved;
    }
    PairVisit<OneLane> pair(rows, group, lane);
    const MotionOf<OneLane> moved_lanes[2] = {lanes_of(moved[0]), lanes_of(moved[1])};
    soft_sweeps_detail::visit(all_, sweep, pair, moved_lanes,
                              [&] { pair.begin(lanes_of(velocities[0]), lanes_of(velocities[1])); });
    if (at[0] != nullptr) hand_on(sweep, is_last[0], soft_sweeps_detail::motion_of(pair.a()), *at[0]);
    if (at[1] != nullptr) hand_on(sweep, is_last[1], soft_sweeps_detail::motion_of(pair.b()), *at[1]);
  }

  TANDEM_HD void hand_on(const Sweep& sweep, bool is_last, SoftMotion velocity, Body& body) const {
    if (is_last && soft_sweeps_detail::has_work(sweep, all_.substeps)) {
      const SoftMotion gain = body.gain;
      SoftMotion start = body.start, moved = body.moved;
      const BodyWork work = soft_sweeps_detail::work_after(sweep);
      work_on(work, static_cast<float>(all_.h), gain, start, velocity, moved);
      if (work == BodyWork::move)
        body.moved = moved;
      else
        body.start = start;
    }
    body.velocity = velocity;
  }

  const SoftSweeps& all_;
  const ClusterWorker& worker_;
  Plan* plan_;
  std::uint32_t tasks_, slots_, shift_ = 0;
  Body* bodies_;
};

}  // namespace

}  // namespace cluster_sweeps_detail

/// Does all sweeps, if a cluster has room for what they visit. The results are those of sweep_all().
TANDEM_HD inline void sweep_in_cluster(const SoftSweeps& all, const ClusterWorker& worker) {
  cluster_sweeps_detail::Sweeper sweeper(all, worker);
  if (!sweeper.make_plan()) return;
  sweeper.take();
  sweeper.sweep();
  sweeper.put_back();
}

}  // namespace tandem::dynamics
