#include <algorithm>
#include <cmath>

#include "dynamics/island_problem.h"
#include "dynamics/pair_colours.h"
#include "dynamics/phases.h"
#include "dynamics/soft_rows.h"
#include "kernels/common/lane_variant.h"

namespace tandem::dynamics {
namespace {

constexpr std::size_t kGrain = 16;  // of things that a thread takes at once

// The numbers of a soft row, where bodies are too deep in each other.
struct Softness {
  double bias_rate, mass_scale, impulse_scale;
};

Softness softness(double frequency, double damping_ratio, double h) {
  const double omega = 2 * kPi * frequency;
  const double a1 = 2 * damping_ratio + h * omega, a2 = h * omega * a1;
  return {omega / a1, a2 / (1 + a2), 1 / (1 + a2)};
}

// Places in which equal numbers of the same pairs stand side by side.
struct Slot {
  std::uint32_t group;
  int lane;
};

// Bits that look like chance, of a pair of bodies.
std::uint32_t shuffled(std::uint32_t a, std::uint32_t b) {
  std::uint64_t x = (std::uint64_t{a} << 32 | b) + 0x9E3779B97F4A7C15u;
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
  x = (x ^ x >> 27) * 0x94D049BB133111EBu;
  return static_cast<std::uint32_t>(x >> 32);
}

void put(const Vector3& x, float (&to)[4]) {
  to[0] = static_cast<float>(x.x), to[1] = static_cast<float>(x.y), to[2] = static_cast<float>(x.z), to[3] = 0;
}
Vector3 first_three(const float (&from)[4]) {
  return {from[0], from[1], from[2]};
}
void put(const Vector3& x, SoftNumber (&to)[3], int lane) {
  to[0].of[lane] = static_cast<float>(x.x), to[1].of[lane] = static_cast<float>(x.y);
  to[2].of[lane] = static_cast<float>(x.z);
}
void put(double x, SoftNumber& to, int lane) {
  to.of[lane] = static_cast<float>(x);
}
Vector3 vector_at(const SoftNumber (&from)[3], int lane) {
  return {from[0].of[lane], from[1].of[lane], from[2].of[lane]};
}

class SoftStep {
 public:
  SoftStep(IslandProblem& problem, const StepInput& input, const SolverOptions& options)
      : p_(problem),
        input_(input),
        options_(options),
        h_(input.dt / options.substeps),
        between_movers_(softness(1 / (8 * h_), 10, h_)),
        against_unmoved_(softness(2 / (8 * h_), 5, h_)),
        passes_(*best_way<const SoftPasses*>(soft_passes)) {}

  void solve() {
    find_groups();
    fill();
    run();
    read();
  }

  // Condition: solve() was called.
  Residual residual() const {
    std::vector<Residual> of_pair(p_.pairs.size());
    input_.threads.for_parts(p_.pairs.size(), kGrain, [&](std::size_t pair) {
      const auto [group, lane] = slot_[pair];
      for (std::uint32_t i = p_.pairs[pair].begin; i < p_.pairs[pair].end; ++i) {
        const SoftNormal& row = normals_[groups_[group].first + i - p_.pairs[pair].begin];
        const bool bounces = p_.rebound[i] > 0 && row.strongest.of[lane] > 0;
        const double target = bounces ? p_.rebound[i] : -std::max(0.0f, row.followed.of[lane]) / h_;
        of_pair[pair].add(residual_of(p_, i, target, options_.friction, 1.0 / options_.substeps));
      }
    });
    Residual out;
    for (const Residual& residual : of_pair) out.add(residual);
    return out;
  }

 private:
  // Gives each pair a place in a group of its colour, those with many contacts first, so that few places of a
  // group are empty.
  void find_groups() {
    std::vector<ColouredPair> coloured;
    coloured.reserve(p_.pairs.size());
    for (const TouchingPair& pair : p_.pairs) {
      const std::uint32_t a = p_.a[pair.begin], b = p_.b[pair.begin];
      coloured.push_back({a, b, shuffled(p_.bodies[a], p_.bodies[b])});
    }
    const std::vector<std::uint32_t> colours = find_colours(coloured, p_.bodies.size());
    std::vector<std::uint32_t> order(p_.pairs.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    const auto contacts_of = [&](std::uint32_t pair) { return p_.pairs[pair].end - p_.pairs[pair].begin; };
    std::ranges::stable_sort(order, [&](std::uint32_t i, std::uint32_t j) {
      return colours[i] != colours[j] ? colours[i] < colours[j] : contacts_of(i) > contacts_of(j);
    });
    slot_.resize(order.size());
    colour_begin_.clear();
    std::uint32_t contacts = 0, colour = 0;
    for (std::size_t k = 0; k < order.size(); ++k) {
      const std::uint32_t pair = order[k];
      const bool begins = k == 0 || colours[pair] != colour;
      if (begins) colour_begin_.push_back(static_cast<std::uint32_t>(groups_.size()));
      if (begins || groups_.back().pairs == kSoftWidth) {
        SoftPairs& group = groups_.emplace_back();
        group.first = contacts;
        group.contacts = contacts_of(pair);
        contacts += group.contacts;
      }
      colour = colours[pair];
      slot_[pair] = {static_cast<std::uint32_t>(groups_.size() - 1), static_cast<int>(groups_.back().pairs++)};
    }
    colour_begin_.push_back(static_cast<std::uint32_t>(groups_.size()));
    normals_.resize(contacts), frictions_.resize(contacts);
  }

  void fill() {
    // What contacts do not move has a body for each pair, so that no two write the same one.
    auto bodies = static_cast<std::uint32_t>(p_.bodies.size());
    for (SoftPairs& group : groups_) {
      for (int lane = 0; lane < kSoftWidth; ++lane)
        group.body_a[lane] = bodies++, group.body_b[lane] = bodies++;
    }
    bodies_.resize(bodies), start_.resize(p_.bodies.size());
    gains_.resize(p_.bodies.size());
    input_.threads.for_parts(p_.bodies.size(), kGrain, [&](std::size_t i) {
      put(h_ / p_.scale[i].root_mass * p_.gravity[i].linear, gains_[i].velocity);
      put(h_ * p_.gravity[i].angular, gains_[i].spin);
    });
    input_.threads.for_parts(p_.pairs.size(), kGrain, [&](std::size_t i) { fill_pair(p_.pairs[i], slot_[i]); });
  }

  double inverse_mass(std::uint32_t body) const {
    return body == 0 ? 0 : 1 / (p_.scale[body].root_mass * p_.scale[body].root_mass);
  }

  void fill_pair(const TouchingPair& pair, const Slot& slot) {
    SoftPairs& group = groups_[slot.group];
    const int lane = slot.lane;
    const std::uint32_t a = p_.a[pair.begin], b = p_.b[pair.begin];
    if (a != 0) group.body_a[lane] = a;
    if (b != 0) group.body_b[lane] = b;
    put(inverse_mass(a), group.inverse_mass_a, lane), put(inverse_mass(b), group.inverse_mass_b, lane);
    const Softness& soft = a == 0 || b == 0 ? against_unmoved_ : between_movers_;
    put(soft.bias_rate, group.bias_rate, lane), put(soft.mass_scale, group.mass_scale, lane);
    put(soft.impulse_scale, group.impulse_scale, lane);
    for (int k = 0; k < 3; ++k) {
      const Vector3 row_a = -pair.turn[k].a.angular, row_b = pair.turn[k].b.angular;
      for (int j = 0; j < 3; ++j) {
        put(at(row_a, j), group.spread_a[3 * k + j], lane);
        put(at(row_b, j), group.spread_b[3 * k + j], lane);
      }
    }
    put(pair.drive + p_.turning(pair, p_.velocity), group.turn_drive, lane);
    put(1 / pair.mobility, group.turn_mass, lane);
    put(pair.impulse / options_.substeps, group.turn_impulse, lane);
    put(options_.rolling_resistance, group.lever, lane);
    for (std::uint32_t i = pair.begin; i < pair.end; ++i) {
      fill_normal(normals_[group.first + i - pair.begin], i, lane);
      fill_friction(frictions_[group.first + i - pair.begin], i, lane);
      put(opposed(pair, i), normals_[group.first + i - pair.begin].opposed, lane);
      if (p_.rebound[i] > 0) group.bounces = true;
    }
  }

  void fill_direction(SoftDirection& to, const ContactRow& row, const Vector3& along, int lane) const {
    put(along, to.along, lane), put(row.a.angular, to.turn_a, lane), put(row.b.angular, to.turn_b, lane);
  }

  void fill_normal(SoftNormal& to, std::uint32_t i, int lane) const {
    const ContactRow& row = p_.normal[i];
    fill_direction(to.direction, row, input_.contacts[p_.contacts[i]].normal, lane);
    put(1 / row.mobility(), to.mass, lane);
    put(p_.drive[i].x + p_.along(row, i, p_.velocity), to.drive, lane);
    put(p_.separation[i], to.separation, lane), put(p_.separation[i], to.followed, lane);
    put(p_.rebound[i], to.rebound, lane);
    put(p_.impulse[i].x / options_.substeps, to.impulse, lane);
  }

  void fill_friction(SoftFriction& to, std::uint32_t i, int lane) const {
    fill_direction(to.first, p_.first[i], p_.first_direction[i], lane);
    fill_direction(to.second, p_.second[i], p_.second_direction[i], lane);
    put(1 / p_.friction_mobility(i), to.mass, lane);
    put(options_.friction, to.coefficient, lane);
    put(p_.drive[i].y + p_.along(p_.first[i], i, p_.velocity), to.first_drive, lane);
    put(p_.drive[i].z + p_.along(p_.second[i], i, p_.velocity), to.second_drive, lane);
    put(p_.impulse[i].y / options_.substeps, to.first_impulse, lane);
    put(p_.impulse[i].z / options_.substeps, to.second_impulse, lane);
  }

  // Bodies that impact has driven into each other may be held from both sides: what pushes one way makes the
  // other deeper, the pushes are hundreds of times their weight, and whichever point is found next throws
  // them about. So a deep contact pushes for what it is deeper than the same pair's contacts that push
  // against it.
  double opposed(const TouchingPair& pair, std::uint32_t i) const {
    constexpr double kDeep = 4;  // slops
    const double deep = kDeep * options_.slop;
    if (p_.separation[i] > -deep) return 0;
    const Vector3& normal = input_.contacts[p_.contacts[i]].normal;
    double opposed = 0;
    for (std::uint32_t j = pair.begin; j < pair.end; ++j) {
      const double along = dot(normal, input_.contacts[p_.contacts[j]].normal);
      opposed = std::max(opposed, std::min(along, 0.0) * std::min(p_.separation[j], 0.0));
    }
    return std::min(opposed, -deep - p_.separation[i]);
  }

  // What a phase does.
  enum class Work : std::uint8_t { pass, begin, accelerate, move };
  struct Phase {
    Work work;
    std::uint32_t colour = 0;
    SoftPasses::Pass pass = nullptr;
    float time = 0;
  };

  void run() {
    constexpr int kRelaxingSweeps = 2, kRestitutionSweeps = 10;
    constexpr std::uint32_t kBodiesAtOnce = 256;
    const auto body_parts = static_cast<std::uint32_t>((p_.bodies.size() + kBodiesAtOnce - 1) / kBodiesAtOnce);
    std::vector<Phase> phases;
    std::vector<std::uint32_t> parts;
    const auto add_bodies = [&](Work work) { phases.push_back({work}), parts.push_back(body_parts); };
    const auto add_sweep = [&](SoftPasses::Pass pass, double time = 0) {
      for (std::uint32_t c = 0; c + 1 < colour_begin_.size(); ++c) {
        phases.push_back({Work::pass, c, pass, static_cast<float>(time)});
        parts.push_back((colour_begin_[c + 1] - colour_begin_[c] + kGroupsAtOnce - 1) / kGroupsAtOnce);
      }
    };
    add_sweep(passes_.start);
    for (std::uint32_t k = 0; k < options_.substeps; ++k) {
      add_bodies(k == 0 ? Work::begin : Work::accelerate);
      add_sweep(passes_.push);
      add_bodies(Work::move);
      add_sweep(passes_.follow, (k + 1) * h_);
      for (int sweep = 1; sweep < kRelaxingSweeps; ++sweep) add_sweep(passes_.relax);
      add_sweep(passes_.rub);
    }
    if (std::ranges::any_of(groups_, &SoftPairs::bounces)) {
      for (int sweep = 0; sweep < kRestitutionSweeps; ++sweep) add_sweep(passes_.rebound);
    }
    const SoftRows rows = {bodies_.data(), groups_.data(), normals_.data(), frictions_.data(),
                           static_cast<float>(1 / h_)};
    run_phases(input_.threads, parts, [&](std::size_t i, std::uint32_t part) {
      const Phase& phase = phases[i];
      if (phase.work == Work::pass) {
        const std::uint32_t begin = colour_begin_[phase.colour] + part * kGroupsAtOnce;
        phase.pass(rows, begin, std::min(begin + kGroupsAtOnce, colour_begin_[phase.colour + 1]), phase.time);
        return;
      }
      const std::size_t begin = std::size_t{part} * kBodiesAtOnce;
      for (std::size_t j = begin; j < std::min(begin + kBodiesAtOnce, p_.bodies.size()); ++j)
        visit_body(j, phase.work);
    });
  }

  // Velocities of a body, as SoftBody has them.
  struct Velocities {
    float velocity[4], spin[4];
  };

  // The contacts of a substep begin with what they added to the velocities in the one before.
  void visit_body(std::size_t j, Work work) {
    SoftBody& body = bodies_[j];
    const auto h = static_cast<float>(h_);
    for (int i = 0; i < 3; ++i) {
      visit_coordinate(work, h, gains_[j].velocity[i], start_[j].velocity[i], body.velocity[i], body.moved[i]);
      visit_coordinate(work, h, gains_[j].spin[i], start_[j].spin[i], body.spin[i], body.turned[i]);
    }
  }

  static void visit_coordinate(Work work, float h, float gain, float& start, float& velocity, float& moved) {
    if (work == Work::move) {
      moved += h * velocity;
      return;
    }
    const float pushed = work == Work::begin ? velocity : velocity - start;
    start = (work == Work::begin ? 0 : velocity) + gain;
    velocity = start + pushed;
  }

  void read() {
    input_.threads.for_parts(p_.bodies.size() - 1, kGrain, [&](std::size_t before) {
      const std::size_t j = before + 1;
      const SoftBody& body = bodies_[j];
      const double root_mass = p_.scale[j].root_mass;
      p_.displacement[j] = input_.dt * p_.velocity[j];
      p_.displacement[j] += {root_mass * first_three(body.moved), first_three(body.turned)};
      p_.velocity[j] += {root_mass * first_three(body.velocity), first_three(body.spin)};
    });
    const double substeps = options_.substeps;
    input_.threads.for_parts(p_.pairs.size(), kGrain, [&](std::size_t k) {
      TouchingPair& pair = p_.pairs[k];
      const auto [group, lane] = slot_[k];
      pair.impulse = substeps * vector_at(groups_[group].turn_impulse, lane);
      for (std::uint32_t i = pair.begin; i < pair.end; ++i) {
        const std::uint32_t contact = groups_[group].first + i - pair.begin;
        p_.impulse[i] = {substeps * normals_[contact].impulse.of[lane],
                         substeps * frictions_[contact].first_impulse.of[lane],
                         substeps * frictions_[contact].second_impulse.of[lane]};
      }
    });
  }

  static constexpr std::uint32_t kGroupsAtOnce = 4;

  IslandProblem& p_;
  const StepInput& input_;
  const SolverOptions& options_;
  double h_;
  Softness between_movers_, against_unmoved_;
  const SoftPasses& passes_;
  std::vector<Slot> slot_;                   // of each pair
  std::vector<std::uint32_t> colour_begin_;  // of its groups
  std::vector<SoftPairs> groups_;
  std::vector<SoftNormal> normals_;
  std::vector<SoftFriction> frictions_;
  std::vector<SoftBody> bodies_;             // what the step adds to the motion of its start
  std::vector<Velocities> gains_, start_;    // what a substep adds to each; the velocities without its contacts
};

}  // namespace

Residual solve_soft_step(IslandProblem& problem, const StepInput& input, const SolverOptions& options) {
  SoftStep step(problem, input, options);
  step.solve();
  return step.residual();
}

}  // namespace tandem::dynamics
