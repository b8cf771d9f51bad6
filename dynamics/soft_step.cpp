#include "dynamics/soft_step.h"

#include <algorithm>
#include <cmath>

#include "dynamics/phases.h"
#include "kernels/common/lane_variant.h"

namespace tandem::dynamics {
namespace {

constexpr std::size_t kBodiesAtOnce = 64;  // that a thread takes
constexpr std::uint32_t kGroupsAtOnce = 4;
constexpr std::uint32_t kSharedGroups = 6;  // that are worth the time in which threads wait for each other

}  // namespace

struct SoftSolver::Step {
  const StepInput& input;
  const SolverOptions& options;
  std::span<const BodyState> states;
  SoftNumbers numbers;
};

Residual SoftSolver::solve(const StepInput& input, std::span<const std::uint32_t> islands,
                           const SolverOptions& options, std::span<BodyState> states,
                           std::span<ContactImpulse> impulses) {
  if (islands.empty()) return {};
  const Step step = {input, options, states, SoftNumbers({input, states, options}, impulses.data())};
  gather(step, islands);
  find_unit(step);
  make_groups(step);
  fill(step);
  joints_.start(input, islands, states, place_, bodies_, step.numbers, unit_root_);
  run(step);
  limit_work(step, islands);
  write(step, states, impulses);
  joints_.write(input.joint_memory);
  return residual();
}

// Finds the bodies, contacts and pairs of the islands.
void SoftSolver::gather(const Step& step, std::span<const std::uint32_t> islands) {
  const StepInput& input = step.input;
  body_.assign(1, 0), pairs_.clear();
  place_.resize(input.bodies.size());
  for (const std::uint32_t island : islands) {
    for (const std::uint32_t body : input.islands.bodies_of(island)) {
      place_[body] = static_cast<std::uint32_t>(body_.size());
      body_.push_back(body);
    }
    const auto place = [&](std::uint32_t body) {
      return step.numbers.rows.is_moved(body) ? place_[body] : 0;
    };
    ObjectPair last = {0, 0};
    for (const std::uint32_t i : input.islands.contacts_of(island)) {
      const ContactPoint& contact = input.contacts[i];
      const ObjectPair pair = {contact.body_a, contact.body_b};
      if (pair != last) {
        last = pair;
        pairs_.push_back({{i, 0}, place(pair.a), place(pair.b), 0, 0});
      }
      ++pairs_.back().contacts.count;
    }
  }
}

std::vector<std::uint32_t> SoftSolver::find_colours() {
  coloured_.clear();
  for (const Pair& pair : pairs_)
    coloured_.push_back({pair.a, pair.b, colouring_order(body_[pair.a], body_[pair.b])});
  return dynamics::find_colours(coloured_, body_.size());
}

// Bodies of a region are near each other, and a thread that visits its pairs has them at hand. Result: of
// each body.
std::vector<std::uint32_t> SoftSolver::find_regions(const Step& step, std::uint32_t regions) const {
  std::vector<std::uint32_t> out(body_.size());
  if (regions == 1) return out;
  const auto position = [&](std::uint32_t i, int axis) { return at(step.states[body_[i]].position, axis); };
  std::vector<std::uint32_t> order = all_below(body_.size());
  order.erase(order.begin());
  int longest = 0;
  double length = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [low, high] =
        std::ranges::minmax(order, {}, [&](std::uint32_t i) { return position(i, axis); });
    const double of_axis = position(high, axis) - position(low, axis);
    if (of_axis > length) length = of_axis, longest = axis;
  }
  std::ranges::sort(order, {}, [&](std::uint32_t i) { return position(i, longest); });
  for (std::uint32_t region = 0; region < regions; ++region) {
    const auto [begin, end] = part_of(order.size(), region, regions);
    for (std::size_t k = begin; k < end; ++k) out[order[k]] = region;
  }
  return out;
}

void SoftSolver::find_unit(const Step& step) {
  double most = 0;
  for (std::size_t i = 1; i < body_.size(); ++i) most = std::max(most, step.input.bodies[body_[i]].mass);
  unit_root_ = unit_root_of(most);
}

// Gives each pair a place in a group of its colour and region, those with many contacts first, so that few
// places of a group are empty.
void SoftSolver::make_groups(const Step& step) {
  constexpr std::uint32_t kMany = 63;
  constexpr std::uint32_t kGroupsOfThread =
      4;  // of a colour: fewer are not worth that threads wait for others
  const std::vector<std::uint32_t> colours = find_colours();
  const std::uint32_t colour_count = colours.empty() ? 1 : *std::ranges::max_element(colours) + 1;
  const auto most =
      static_cast<std::uint32_t>(pairs_.size() / (std::size_t{colour_count} * kSoftWidth * kGroupsOfThread));
  const std::uint32_t regions = std::clamp(most, 1u, step.input.threads.count());
  const std::vector<std::uint32_t> region_of = find_regions(step, regions);
  const auto key = [&](std::uint32_t i) {
    return colours[i] * regions + region_of[pairs_[i].a != 0 ? pairs_[i].a : pairs_[i].b];
  };
  order_ = sorted_by(all_below(pairs_.size()), kMany + 1,
                     [&](std::uint32_t i) { return kMany - std::min(pairs_[i].contacts.count, kMany); });
  order_ = sorted_by(order_, std::size_t{colour_count} * regions, key);
  groups_.clear(), group_begin_.clear(), region_begin_.clear();
  std::uint32_t contacts = 0;
  for (std::uint32_t k = 0; k < order_.size(); ++k) {
    Pair& pair = pairs_[order_[k]];
    const bool begins = k == 0 || key(order_[k]) != key(order_[k - 1]);
    while (region_begin_.size() <= key(order_[k]))
      region_begin_.push_back(static_cast<std::uint32_t>(groups_.size()));
    if (begins || groups_.back().pairs == kSoftWidth) {
      group_begin_.push_back(k);
      groups_.emplace_back().first = contacts;
    }
    SoftPairs& group = groups_.back();
    pair.group = static_cast<std::uint32_t>(groups_.size() - 1);
    pair.lane = static_cast<int>(group.pairs++);
    const std::uint32_t count = pair.contacts.count;
    contacts += count > group.contacts ? count - group.contacts : 0;
    group.contacts = std::max(group.contacts, count);
  }
  region_begin_.resize(std::size_t{colour_count} * regions + 1, static_cast<std::uint32_t>(groups_.size()));
  group_begin_.push_back(static_cast<std::uint32_t>(order_.size()));
  turnings_.resize(groups_.size());
  normals_.resize(contacts), gaps_.resize(contacts), frictions_.resize(contacts);
  regions_ = regions;
  find_parts();
}

// A colour of many groups is a part, whose regions threads share. Others are one part, that one thread
// visits.
void SoftSolver::find_parts() {
  parts_.clear();
  for (std::size_t c = 0; c + 1 < region_begin_.size(); c += regions_) {
    const std::uint32_t begin = region_begin_[c], end = region_begin_[c + regions_];
    if (end - begin >= kSharedGroups)
      parts_.push_back({begin, end, &region_begin_[c]});
    else if (!parts_.empty() && parts_.back().region_begin == nullptr)
      parts_.back().end = end;
    else
      parts_.push_back({begin, end, nullptr});
  }
}

void SoftSolver::fill(const Step& step) {
  // Each group has a body of its own for what contacts do not move, so that no two threads write the same
  // one.
  auto places = static_cast<std::uint32_t>(body_.size());
  for (SoftPairs& group : groups_) {
    std::ranges::fill(group.body_a, places), std::ranges::fill(group.body_b, places);
    ++places;
  }
  velocities_.assign(places, SoftMotion{}), moved_.assign(places, SoftMotion{});
  bodies_.resize(body_.size()), gains_.resize(body_.size()), start_.resize(body_.size());
  bodies_[0] = {};
  Threads& threads = step.input.threads;
  threads.for_parts(body_.size() - 1, kBodiesAtOnce, [&](std::size_t before) {
    const std::size_t i = before + 1;
    bodies_[i] = soft_body(step.numbers, unit_root_, body_[i]);
    gains_[i] = gain_of(bodies_[i], step.numbers.h);
  });
  const SoftRows rows = rows_of(step);
  threads.for_parts(groups_.size(), kGroupsAtOnce, [&](std::size_t group) {
    const auto clear = [&](auto& list) {
      std::fill_n(list.begin() + groups_[group].first, groups_[group].contacts,
                  typename std::decay_t<decltype(list)>::value_type{});
    };
    clear(normals_), clear(gaps_), clear(frictions_);
    turnings_[group] = {};
    for (std::uint32_t k = group_begin_[group]; k < group_begin_[group + 1]; ++k) {
      const Pair& pair = pairs_[order_[k]];
      const SteppedBody &a = bodies_[pair.a], &b = bodies_[pair.b];
      if (a.moves) groups_[group].body_a[pair.lane] = pair.a;
      if (b.moves) groups_[group].body_b[pair.lane] = pair.b;
      fill_pair(step.numbers, unit_root_, pair.contacts, a, b, rows, pair.group, pair.lane);
    }
  });
}

SoftRows SoftSolver::rows_of(const Step& step) {
  return {velocities_.data(), moved_.data(), groups_.data(),    turnings_.data(),
          normals_.data(),    gaps_.data(),  frictions_.data(), static_cast<float>(1 / step.numbers.h)};
}

void SoftSolver::run(const Step& step) {
  const double h = step.numbers.h;
  struct Phase {
    Work work;
    SweepPart part = {};
    SoftPasses::Pass pass = nullptr;
    double time = 0;
  };
  std::vector<Phase> phases;
  const auto add_sweep = [&](SoftPasses::Pass pass, double time = 0) {
    for (const SweepPart& part : parts_) phases.push_back({Work::pass, part, pass, time});
  };
  static const SoftPasses& passes = *best_way<const SoftPasses*>(soft_passes);
  const auto add_joints = [&](Work work, double time = 0) {
    if (!joints_.empty()) phases.push_back({work, {}, nullptr, time});
  };
  add_sweep(passes.start);
  add_joints(Work::push_joints);
  for (std::uint32_t k = 0; k < step.options.substeps; ++k) {
    phases.push_back({k == 0 ? Work::begin : Work::accelerate});
    add_joints(Work::visit_soft_joints, k * h);
    add_sweep(passes.push);
    phases.push_back({Work::move});
    add_joints(Work::follow_joints, (k + 1) * h);
    for (int sweep = 0; sweep < kRelaxingSweeps; ++sweep) {
      add_joints(Work::visit_joints);
      add_sweep(sweep == 0 ? passes.follow : passes.relax, (k + 1) * h);
    }
    add_sweep(passes.rub);
  }
  if (std::ranges::any_of(groups_, [](const SoftPairs& group) { return group.bounces != 0; })) {
    for (int sweep = 0; sweep < kRestitutionSweeps; ++sweep) add_sweep(passes.rebound);
  }
  add_sweep(passes.judge);
  const SoftRows rows = rows_of(step);
  run_phases(
      step.input.threads, regions_, phases.size(), [&](std::size_t phase, std::uint32_t i, std::uint32_t n) {
        const auto& [work, part, pass, time] = phases[phase];
        if (work > Work::move) {
          if (i == 0) work_on_joints(work, time);
        } else if (work != Work::pass) {
          const auto [begin, end] = part_of(body_.size(), i, n);
          for (std::size_t j = begin; j < end; ++j)
            work_on(work == Work::begin        ? BodyWork::begin
                    : work == Work::accelerate ? BodyWork::accelerate
                                               : BodyWork::move,
                    static_cast<float>(h), gains_[j], start_[j], velocities_[j], moved_[j]);
        } else if (part.region_begin != nullptr) {
          for (std::uint32_t region = i; region < regions_; region += n)
            pass(rows, part.region_begin[region], part.region_begin[region + 1], static_cast<float>(time));
        } else if (i == 0) {
          pass(rows, part.begin, part.end, static_cast<float>(time));
        }
      });
}

void SoftSolver::work_on_joints(Work work, double time) {
  if (work == Work::push_joints) return joints_.push(velocities_);
  if (work == Work::follow_joints) return joints_.follow(moved_, time);
  if (work == Work::visit_joints) return joints_.visit(velocities_, false);
  if (time > 0) joints_.sum_up();  // of the substep before
  joints_.add_due(velocities_);
  joints_.visit(velocities_, true);
}

// Finds which part of their impulses bodies get, so that contacts add no energy to an island. Joints, and
// kinematic bodies that touch others, may.
void SoftSolver::limit_work(const Step& step, std::span<const std::uint32_t> islands) {
  const StepInput& input = step.input;
  part_.assign(body_.size(), 1), work_.resize(body_.size());
  input.threads.for_parts(body_.size() - 1, kBodiesAtOnce, [&](std::size_t before) {
    const std::size_t i = before + 1;
    work_[i] = work_on_body(bodies_[i], velocities_[i], input.dt);
  });
  const auto is_kinematic = [&](std::uint32_t body) {
    return input.bodies[body].motion == Motion::kinematic;
  };
  for (const std::uint32_t island : islands) {
    if (!input.islands.joints_of(island).empty()) continue;
    ContactWork work;
    for (const std::uint32_t i : input.islands.contacts_of(island)) {
      if (is_kinematic(input.contacts[i].body_a) || is_kinematic(input.contacts[i].body_b)) work.note_drive();
    }
    const auto bodies = input.islands.bodies_of(island);
    for (const std::uint32_t body : bodies) work.note(work_[place_[body]]);
    for (const std::uint32_t body : bodies) work.add(work_[place_[body]]);
    for (const std::uint32_t body : bodies) part_[place_[body]] = work.part();
  }
}

void SoftSolver::write(const Step& step, std::span<BodyState> states, std::span<ContactImpulse> impulses) {
  step.input.threads.for_parts(body_.size() - 1, kBodiesAtOnce, [&](std::size_t before) {
    const std::size_t i = before + 1;
    end_step(step.input.bodies[body_[i]], bodies_[i], velocities_[i], moved_[i], part_[i], step.input.dt,
             states[body_[i]]);
  });
  const SoftRows rows = rows_of(step);
  ContactImpulse* const done = step.input.done.empty() ? nullptr : step.input.done.data();
  step.input.threads.for_parts(pairs_.size(), kBodiesAtOnce, [&](std::size_t k) {
    const Pair& pair = pairs_[k];
    write_pair(step.numbers, unit_root_, pair.contacts, rows, pair.group, pair.lane,
               part_[pair.a != 0 ? pair.a : pair.b], impulses.data(), done);
  });
}

Residual SoftSolver::residual() const {
  Residual out;
  for (const Pair& pair : pairs_) {
    const SoftPairs& group = groups_[pair.group];
    out.add(Residual{group.largest_residual.of[pair.lane], group.residual_squares.of[pair.lane]});
  }
  return out;
}

}  // namespace tandem::dynamics
