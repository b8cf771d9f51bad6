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

// Bits that look like chance, of a pair of bodies.
std::uint32_t shuffled(std::uint32_t a, std::uint32_t b) {
  std::uint64_t x = (std::uint64_t{a} << 32 | b) + 0x9E3779B97F4A7C15u;
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
  x = (x ^ x >> 27) * 0x94D049BB133111EBu;
  return static_cast<std::uint32_t>(x >> 32);
}

void put(double x, SoftNumber& to, int lane) {
  to.of[lane] = static_cast<float>(x);
}
void put(const Vector3& x, SoftNumber (&to)[3], int lane) {
  put(x.x, to[0], lane), put(x.y, to[1], lane), put(x.z, to[2], lane);
}
void put(const MassScale& scale, SoftNumber (&to)[9], int lane) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) put(at(scale.spread.row[i], j), to[3 * i + j], lane);
  }
}
double inverse_mass(const SteppedBody& body) {
  return body.moves ? 1 / (body.scale.root_mass * body.scale.root_mass) : 0;
}

// Masses become so many times less as the square of `root`, a power of two.
void measure_in(double root, SteppedBody& body) {
  MassScale& scale = body.scale;
  scale = {scale.root_mass / root, root * scale.inverse_root_mass, root * scale.spread};
  body.velocity = 1 / root * body.velocity;
  body.gravity = 1 / root * body.gravity;
}

Softness softness(double frequency, double damping_ratio, double h) {
  const double omega = 2 * kPi * frequency;
  const double a1 = 2 * damping_ratio + h * omega, a2 = h * omega * a1;
  return {omega / a1, a2 / (1 + a2), 1 / (1 + a2)};
}

// Bodies that impact has driven into each other may be held from both sides: what pushes one way makes the
// other deeper, the pushes are hundreds of times their weight, and whichever point is found next throws
// them about. So a deep contact pushes for what it is deeper than the same pair's contacts that push
// against it. Result: by how much.
double opposed(std::span<const ContactPoint> all, std::span<const std::uint32_t> of_pair,
               const Vector3& normal, double separation, double slop) {
  constexpr double kDeep = 4;  // slops
  const double deep = kDeep * slop;
  if (separation > -deep) return 0;
  double opposed = 0;
  for (const std::uint32_t other : of_pair)
    opposed = std::max(
        opposed, -std::min(dot(normal, all[other].normal), 0.0) * std::max(all[other].depth - slop, 0.0));
  return std::min(opposed, -deep - separation);
}

}  // namespace

struct SoftSolver::Step {
  const StepInput& input;
  const SolverOptions& options;
  RowMaker rows;
  std::span<const BodyState> states;
  std::span<const ContactImpulse> impulses;
  double h = input.dt / options.substeps;
  Softness between_movers = softness(1 / (8 * h), 10, h), against_unmoved = softness(2 / (8 * h), 5, h),
           joints = against_unmoved;
};

Residual SoftSolver::solve(const StepInput& input, std::span<const std::uint32_t> islands,
                           const SolverOptions& options, std::span<BodyState> states,
                           std::span<ContactImpulse> impulses) {
  if (islands.empty()) return {};
  const Step step = {input, options, RowMaker({input, states, options}), states, impulses};
  gather(step, islands);
  find_unit(step);
  make_groups(step);
  fill(step);
  joints_.start(input, islands, states, place_, bodies_, options.substeps, unit_root_ * unit_root_);
  run(step);
  write(step, states, impulses);
  joints_.sum_up();
  joints_.write(input.joint_memory);
  return residual();
}

// Finds the bodies, contacts and pairs of the islands.
void SoftSolver::gather(const Step& step, std::span<const std::uint32_t> islands) {
  const StepInput& input = step.input;
  body_.assign(1, 0), contacts_.clear(), pairs_.clear();
  place_.resize(input.bodies.size());
  for (const std::uint32_t island : islands) {
    for (const std::uint32_t body : input.islands.bodies_of(island)) {
      place_[body] = static_cast<std::uint32_t>(body_.size());
      body_.push_back(body);
    }
    const auto place = [&](std::uint32_t body) { return step.rows.is_moved(body) ? place_[body] : 0; };
    ObjectPair last = {0, 0};
    for (const std::uint32_t i : input.islands.contacts_of(island)) {
      const ContactPoint& contact = input.contacts[i];
      const ObjectPair pair = {contact.body_a, contact.body_b};
      if (pair != last) {
        last = pair;
        pairs_.push_back(
            {static_cast<std::uint32_t>(contacts_.size()), 0, place(pair.a), place(pair.b), 0, 0});
      }
      contacts_.push_back(i);
      ++pairs_.back().contacts;
    }
  }
}

std::vector<std::uint32_t> SoftSolver::find_colours() {
  coloured_.clear();
  for (const Pair& pair : pairs_)
    coloured_.push_back({pair.a, pair.b, shuffled(body_[pair.a], body_[pair.b]) % kColouredOrders});
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

// Masses are measured in a unit about as large as the heaviest, so that float32 has room for the others, and
// whose root is a power of two, so that no digit depends on it.
void SoftSolver::find_unit(const Step& step) {
  double most = 0;
  for (std::size_t i = 1; i < body_.size(); ++i) most = std::max(most, step.input.bodies[body_[i]].mass);
  unit_root_ = std::ldexp(1.0, std::ilogb(most) / 2);
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
                     [&](std::uint32_t i) { return kMany - std::min(pairs_[i].contacts, kMany); });
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
    contacts += pair.contacts > group.contacts ? pair.contacts - group.contacts : 0;
    group.contacts = std::max(group.contacts, pair.contacts);
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
    bodies_[i] = step.rows.body(body_[i]);
    measure_in(unit_root_, bodies_[i]);
    put(step.h / bodies_[i].scale.root_mass * bodies_[i].gravity.linear, gains_[i].centre);
    put(step.h * bodies_[i].gravity.angular, gains_[i].spin);
  });
  threads.for_parts(groups_.size(), kGroupsAtOnce, [&](std::size_t group) {
    const auto clear = [&](auto& rows) {
      std::fill_n(rows.begin() + groups_[group].first, groups_[group].contacts,
                  typename std::decay_t<decltype(rows)>::value_type{});
    };
    clear(normals_), clear(gaps_), clear(frictions_);
    turnings_[group] = {};
    for (std::uint32_t k = group_begin_[group]; k < group_begin_[group + 1]; ++k)
      fill_pair(step, pairs_[order_[k]]);
  });
}

void SoftSolver::fill_pair(const Step& step, const Pair& pair) {
  SoftPairs& group = groups_[pair.group];
  const int lane = pair.lane;
  const SteppedBody &a = bodies_[pair.a], &b = bodies_[pair.b];
  const std::span<const std::uint32_t> contacts =
      std::span(contacts_).subspan(pair.first_contact, pair.contacts);
  const double substeps = step.options.substeps * unit_root_ * unit_root_;  // in these masses
  SoftTurning& turns = turnings_[pair.group];
  if (a.moves) group.body_a[lane] = pair.a, put(a.scale, turns.spread_a, lane);
  if (b.moves) group.body_b[lane] = pair.b, put(b.scale, turns.spread_b, lane);
  put(inverse_mass(a), group.inverse_mass_a, lane), put(inverse_mass(b), group.inverse_mass_b, lane);
  const Softness& soft = a.moves && b.moves ? step.between_movers : step.against_unmoved;
  put(soft.bias_rate, group.bias_rate, lane), put(soft.mass_scale, group.mass_scale, lane);
  put(soft.impulse_scale, group.impulse_scale, lane);
  const Vector3 spin = b.scale.spread * b.velocity.angular - a.scale.spread * a.velocity.angular;
  put(spin + step.rows.turning_drive(step.input.contacts[contacts[0]]), turns.drive, lane);
  put(1 / turning_mobility(a, b), turns.mass, lane);
  const Material material = step.rows.material_of(step.input.contacts[contacts[0]]);
  put(material.rolling_resistance, turns.lever, lane);
  Vector3 turning;
  for (const std::uint32_t i : contacts) turning += step.impulses[i].turning;
  put(turning / substeps, turns.impulse, lane);
  step.rows.visit_contacts(
      contacts, [&](std::size_t i, const ContactPoint& contact, const ContactPatch& patch) {
        const ContactMeeting meets = step.rows.meeting(contact, patch, material);
        const ContactImpulse& impulse = step.impulses[contacts[i]];
        const auto [first, second] = Tangents(contact.normal);
        SoftNormal& normal = normals_[group.first + i];
        put(contact.normal, normal.direction.along, lane);
        put(meets.arm_a, normal.direction.turn_a, lane), put(meets.arm_b, normal.direction.turn_b, lane);
        put(1.0, normal.mass, lane);
        put(meets.separation, normal.followed, lane);
        put(impulse.normal / substeps, normal.impulse, lane);
        SoftGap& gap = gaps_[group.first + i];
        const double less =
            opposed(step.input.contacts, contacts, contact.normal, meets.separation, step.options.slop);
        put(meets.separation, gap.separation, lane), put(meets.rebound, gap.rebound, lane);
        put(less, gap.opposed, lane);
        group.bounces = group.bounces || meets.rebound > 0;
        group.is_opposed = group.is_opposed || less > 0;
        SoftFriction& friction = frictions_[group.first + i];
        put(first, friction.first.along, lane), put(second, friction.second.along, lane);
        put(meets.velocity, friction.first.turn_a, lane);
        put(impulse.tangential / substeps, friction.second.turn_a, lane);
        put(material.friction, friction.coefficient, lane);
      });
}

void SoftSolver::run(const Step& step) {
  constexpr int kRelaxingSweeps = 2, kRestitutionSweeps = 10;
  struct Phase {
    Work work;
    SweepPart part = {};
    SoftPasses::Pass pass = nullptr;
    float time = 0;
  };
  std::vector<Phase> phases;
  const auto add_sweep = [&](SoftPasses::Pass pass, double time = 0) {
    for (const SweepPart& part : parts_) phases.push_back({Work::pass, part, pass, static_cast<float>(time)});
  };
  static const SoftPasses& passes = *best_way<const SoftPasses*>(soft_passes);
  const auto add_joints = [&](Work work, double time = 0) {
    if (!joints_.empty()) phases.push_back({work, {}, nullptr, static_cast<float>(time)});
  };
  add_sweep(passes.start);
  add_joints(Work::push_joints);
  for (std::uint32_t k = 0; k < step.options.substeps; ++k) {
    phases.push_back({k == 0 ? Work::begin : Work::accelerate});
    add_joints(Work::visit_soft_joints, k * step.h);
    add_sweep(passes.push);
    phases.push_back({Work::move});
    add_joints(Work::follow_joints, (k + 1) * step.h);
    for (int sweep = 0; sweep < kRelaxingSweeps; ++sweep) {
      add_joints(Work::visit_joints);
      add_sweep(sweep == 0 ? passes.follow : passes.relax, (k + 1) * step.h);
    }
    add_sweep(passes.rub);
  }
  if (std::ranges::any_of(groups_, &SoftPairs::bounces)) {
    for (int sweep = 0; sweep < kRestitutionSweeps; ++sweep) add_sweep(passes.rebound);
  }
  add_sweep(passes.judge);
  const SoftRows rows = {
      velocities_.data(), moved_.data(), groups_.data(),    turnings_.data(),
      normals_.data(),    gaps_.data(),  frictions_.data(), static_cast<float>(1 / step.h)};
  run_phases(step.input.threads, regions_, phases.size(),
             [&](std::size_t phase, std::uint32_t i, std::uint32_t n) {
               const auto& [work, part, pass, time] = phases[phase];
               if (work > Work::move) {
                 if (i == 0) work_on_joints(step, work, time);
               } else if (work != Work::pass) {
                 const auto [begin, end] = part_of(body_.size(), i, n);
                 for (std::size_t j = begin; j < end; ++j) visit_body(j, work, static_cast<float>(step.h));
               } else if (part.region_begin != nullptr) {
                 for (std::uint32_t region = i; region < regions_; region += n)
                   pass(rows, part.region_begin[region], part.region_begin[region + 1], time);
               } else if (i == 0) {
                 pass(rows, part.begin, part.end, time);
               }
             });
}

// The contacts of a substep begin with what they added to the velocities in the one before.
void SoftSolver::visit_body(std::size_t i, Work work, float h) {
  const auto visit = [&](float gain, float& start, float& velocity, float& moved) {
    if (work == Work::move) {
      moved += h * velocity;
      return;
    }
    const float pushed = work == Work::begin ? velocity : velocity - start;
    start = (work == Work::begin ? 0 : velocity) + gain;
    velocity = start + pushed;
  };
  for (int k = 0; k < 3; ++k) {
    visit(gains_[i].centre[k], start_[i].centre[k], velocities_[i].centre[k], moved_[i].centre[k]);
    visit(gains_[i].spin[k], start_[i].spin[k], velocities_[i].spin[k], moved_[i].spin[k]);
  }
}

void SoftSolver::work_on_joints(const Step& step, Work work, double time) {
  if (work == Work::push_joints) return joints_.push(velocities_);
  if (work == Work::follow_joints) return joints_.follow(moved_, time);
  if (work == Work::visit_joints) return joints_.visit(velocities_, step.h, nullptr);
  if (time > 0) joints_.sum_up();  // of the substep before
  joints_.add_due(velocities_);
  joints_.visit(velocities_, step.h, &step.joints);
}

void SoftSolver::write(const Step& step, std::span<BodyState> states,
                       std::span<ContactImpulse> impulses) const {
  step.input.threads.for_parts(body_.size() - 1, kBodiesAtOnce, [&](std::size_t before) {
    const std::size_t i = before + 1;
    const SteppedBody& body = bodies_[i];
    const auto added = [&](const SoftMotion& motion) {
      return Vector6{body.scale.root_mass * first_three(motion.centre), first_three(motion.spin)};
    };
    apply_motion(step.input.bodies[body_[i]], body.scale, body.velocity + added(velocities_[i]),
                 step.input.dt * body.velocity + added(moved_[i]), step.input.dt, states[body_[i]]);
  });
  const double substeps = step.options.substeps * unit_root_ * unit_root_;
  step.input.threads.for_parts(pairs_.size(), kBodiesAtOnce, [&](std::size_t k) {
    const Pair& pair = pairs_[k];
    const SoftNumber(&turns)[3] = turnings_[pair.group].impulse;
    const auto of = [&](const SoftNumber& number) { return unsigned_zero(number.of[pair.lane]); };
    const Vector3 turning = {of(turns[0]), of(turns[1]), of(turns[2])};
    for (std::uint32_t i = 0; i < pair.contacts; ++i) {
      const std::uint32_t contact = contacts_[pair.first_contact + i], row = groups_[pair.group].first + i;
      const Tangents across(step.input.contacts[contact].normal);
      const SoftFriction& friction = frictions_[row];
      const auto impulse = [&](double scale, double normal, double along_first, double along_second) {
        return ContactImpulse{scale * normal,
                              scale * (along_first * across.first + along_second * across.second),
                              substeps / pair.contacts * turning};
      };
      impulses[contact] = impulse(substeps, of(normals_[row].impulse), of(friction.first_impulse),
                                  of(friction.second_impulse));
      if (!step.input.done.empty())
        step.input.done[contact] = impulse(unit_root_ * unit_root_, of(friction.sum_of_normal),
                                           of(friction.sum_of_first), of(friction.sum_of_second));
    }
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
