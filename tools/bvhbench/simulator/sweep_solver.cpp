#include <algorithm>
#include <cmath>
#include <limits>

#include "common/random_pose.h"
#include "simulator.h"

namespace tandem::simulation {

namespace {

struct Velocities {
  Vector3 velocity = Vector3{}, spin = Vector3{};
};

// A body while contacts are solved.
struct Mover : Velocities {
  double inverse_mass;
  Matrix3 inverse_inertia;  // in the world
};

// A direction of a contact: w = direction . (v_b - v_a) + arm_b . spin_b - arm_a . spin_a.
struct Row {
  Vector3 direction, arm_a, arm_b;
  Vector3 turn_a, turn_b;         // what an impulse of 1 adds to the spins, less the sign of a
  double mobility_a, mobility_b;  // what it adds to w through either body
  double impulse;
};

struct Joint {
  std::uint32_t a, b;
  double inverse_mass_a, inverse_mass_b;
  Row tangent[2], normal;
  double friction;      // Coulomb's coefficient
  double target;        // of w along the normal
  double push;          // of the correction along the normal
  double push_impulse;  // that of the correction
};

// Says which bodies of a contact an impulse moves: shock propagation holds the lower one.
struct Held {
  double a = 1, b = 1;
};

double relative_velocity(const Row& row, const Velocities& a, const Velocities& b) {
  return dot(row.direction, b.velocity - a.velocity) + dot(row.arm_b, b.spin) - dot(row.arm_a, a.spin);
}

void push_apart(const Joint& joint, const Row& row, double impulse, Velocities& a, Velocities& b,
                const Held& held) {
  // A body that nothing moves is shared by islands, so it is not written to.
  if (joint.inverse_mass_a > 0 && held.a > 0) {
    a.velocity -= (impulse * joint.inverse_mass_a) * row.direction;
    a.spin -= impulse * row.turn_a;
  }
  if (joint.inverse_mass_b > 0 && held.b > 0) {
    b.velocity += (impulse * joint.inverse_mass_b) * row.direction;
    b.spin += impulse * row.turn_b;
  }
}

double mobility(const Row& row, const Held& held) {
  return held.a * row.mobility_a + held.b * row.mobility_b;
}

// The w that a row is to have, as far as the bounds of the impulse let it.
struct Law {
  double target, lower, upper;

  // lambda = clamp(lambda - (w - target) / mobility)
  double impulse(const Row& row, double moves, const Velocities& a, const Velocities& b) const {
    return std::clamp(row.impulse - (relative_velocity(row, a, b) - target) / moves, lower, upper);
  }
};

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

Law law_of_normal(const Joint& joint) {
  return {joint.target, 0, kUnbounded};
}

Law law_of_friction(const Joint& joint) {
  const double bound = joint.friction * joint.normal.impulse;
  return {0, -bound, bound};
}

// Visits one row. Result: by how much w has changed.
double visit(const Joint& joint, Row& row, const Law& law, Mover& a, Mover& b, const Held& held) {
  const double moves = mobility(row, held);
  if (moves <= 0) return 0;
  const double impulse = law.impulse(row, moves, a, b);
  const double change = impulse - row.impulse;
  push_apart(joint, row, change, a, b, held);
  row.impulse = impulse;
  return std::fabs(change) * moves;
}

double visit_velocity(Joint& joint, std::vector<Mover>& movers, const Held& held) {
  Mover &a = movers[joint.a], &b = movers[joint.b];
  const Law slip = law_of_friction(joint);
  const double first = visit(joint, joint.tangent[0], slip, a, b, held);
  const double second = visit(joint, joint.tangent[1], slip, a, b, held);
  return std::max({first, second, visit(joint, joint.normal, law_of_normal(joint), a, b, held)});
}

// corrections: velocities that correct penetration and are forgotten after they have moved the bodies.
double visit_correction(Joint& joint, std::vector<Velocities>& corrections, const Held& held) {
  const double moves = mobility(joint.normal, held);
  if (moves <= 0) return 0;
  Velocities &a = corrections[joint.a], &b = corrections[joint.b];
  const double w = relative_velocity(joint.normal, a, b);
  const double impulse = std::max(0.0, joint.push_impulse - (w - joint.push) / moves);
  const double change = impulse - joint.push_impulse;
  joint.push_impulse = impulse;
  push_apart(joint, joint.normal, change, a, b, held);
  return std::fabs(change) * moves;
}

Row make_row(const Vector3& direction, const Vector3& from_a, const Vector3& from_b, const Mover& a,
             const Mover& b) {
  Row row;
  row.direction = direction;
  row.arm_a = cross(from_a, direction);
  row.arm_b = cross(from_b, direction);
  row.turn_a = a.inverse_inertia * row.arm_a;
  row.turn_b = b.inverse_inertia * row.arm_b;
  row.mobility_a = a.inverse_mass + dot(row.arm_a, row.turn_a);
  row.mobility_b = b.inverse_mass + dot(row.arm_b, row.turn_b);
  row.impulse = 0;
  return row;
}

Joint make_joint(const ContactPoint& contact, std::span<const BodyState> states,
                 const std::vector<Mover>& movers, const TestBedSolverOptions& options,
                 const StepInput& part) {
  const double gravity_speed = part.dt * part.pull_of(contact);
  constexpr double kSlips = 0.01;      // of what gravity gives in a step
  constexpr double kBouncesAbove = 2;  // times that
  const Mover &a = movers[contact.body_a], &b = movers[contact.body_b];
  const Vector3 from_a = contact.position - states[contact.body_a].position;
  const Vector3 from_b = contact.position - states[contact.body_b].position;
  const Vector3 relative = b.velocity + cross(b.spin, from_b) - a.velocity - cross(a.spin, from_a);
  const double approach = -dot(relative, contact.normal);
  const Vector3 slip = relative + approach * contact.normal;
  const double speed = norm(slip);
  const Vector3 first = speed > kSlips * gravity_speed ? slip / speed : unit_orthogonal(contact.normal);
  Joint joint;
  joint.a = contact.body_a, joint.b = contact.body_b;
  joint.inverse_mass_a = a.inverse_mass, joint.inverse_mass_b = b.inverse_mass;
  joint.tangent[0] = make_row(first, from_a, from_b, a, b);
  joint.tangent[1] = make_row(cross(contact.normal, first), from_a, from_b, a, b);
  joint.normal = make_row(contact.normal, from_a, from_b, a, b);
  const Material material = mixed_material(part.bodies[joint.a], part.bodies[joint.b], options);
  joint.friction = material.friction;
  joint.target = approach > kBouncesAbove * gravity_speed ? material.restitution * approach : 0;
  if (contact.depth < 0) joint.target = contact.depth / part.dt;
  joint.push = options.correction * std::max(0.0, contact.depth - options.slop) / part.dt;
  joint.push_impulse = 0;
  return joint;
}

// Starts a contact with an impulse of the step before.
void warm_start(Joint& joint, const ContactImpulse& impulse, std::vector<Mover>& movers) {
  Mover &a = movers[joint.a], &b = movers[joint.b];
  joint.normal.impulse = impulse.normal;
  const double bound = joint.friction * impulse.normal;
  for (Row& row : joint.tangent)
    row.impulse = std::clamp(dot(row.direction, impulse.tangential), -bound, bound);
  for (const Row* row : {&joint.tangent[0], &joint.tangent[1], &joint.normal}) {
    push_apart(joint, *row, row->impulse, a, b, {});
  }
}

// Returns what a visit would change, in metres per second.
double residual_of(const Row& row, const Law& law, const Mover& a, const Mover& b) {
  const double moves = mobility(row, {});
  return std::fabs(law.impulse(row, moves, a, b) - row.impulse) * moves;
}

void shuffle(std::vector<std::uint32_t>& order, std::uint64_t seed) {
  Random random(seed);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.next() % i]);
}

// The contacts of one island.
class IslandSweeps {
 public:
  IslandSweeps(std::span<const std::uint32_t> contacts, std::vector<Joint>& joints,
               std::vector<Mover>& movers, std::vector<Velocities>& corrections,
               const TestBedSolverOptions& options)
      : order_(contacts.begin(), contacts.end()),
        joints_(joints),
        movers_(movers),
        corrections_(corrections),
        options_(options) {}

  void shuffle_order(std::uint64_t seed) { shuffle(order_, seed); }

  // still: sweeps that change no velocity by more than this are the last.
  void solve(double still) {
    for (std::uint32_t i = 0; i < options_.iterations; ++i) {
      const auto visit = [&](Joint& joint) { return visit_velocity(joint, movers_, {}); };
      if (sweep(i % 2 == 1, visit) <= still) break;
    }
    if (!needs_correction()) return;
    for (std::uint32_t i = 0; i < options_.position_iterations; ++i) {
      const auto visit = [&](Joint& joint) { return visit_correction(joint, corrections_, {}); };
      if (sweep(i % 2 == 1, visit) <= still) break;
    }
  }

  // Layer by layer from the ground up, the lower body of each contact held (Guendelman, Bridson and Fedkiw
  // 2003; Erleben 2007).
  void propagate_shock(std::span<const std::uint32_t> layers) {
    constexpr int kSweeps = 5;
    const auto lower = [&](std::uint32_t i) { return std::min(layers[joints_[i].a], layers[joints_[i].b]); };
    std::stable_sort(order_.begin(), order_.end(), [&](auto i, auto j) { return lower(i) < lower(j); });
    for (std::size_t begin = 0, end = 0; begin < order_.size(); begin = end) {
      while (end < order_.size() && lower(order_[end]) == lower(order_[begin])) ++end;
      for (int i = 0; i < kSweeps; ++i) {
        for (std::size_t at = begin; at < end; ++at) {
          Joint& joint = joints_[order_[at]];
          const Held held = {layers[joint.a] < layers[joint.b] ? 0.0 : 1.0,
                             layers[joint.b] < layers[joint.a] ? 0.0 : 1.0};
          visit_velocity(joint, movers_, held);
          visit_correction(joint, corrections_, held);
        }
      }
    }
  }

  Residual residual() const {
    Residual all;
    for (const std::uint32_t i : order_) {
      const Joint& joint = joints_[i];
      const Mover &a = movers_[joint.a], &b = movers_[joint.b];
      const Law slip = law_of_friction(joint);
      for (const Row& row : joint.tangent) all.add(residual_of(row, slip, a, b));
      all.add(residual_of(joint.normal, law_of_normal(joint), a, b));
    }
    return all;
  }

 private:
  bool needs_correction() const {
    return std::any_of(order_.begin(), order_.end(), [&](std::uint32_t i) { return joints_[i].push > 0; });
  }

  // Result: the largest change of a velocity.
  template <typename Visit>
  double sweep(bool backwards, const Visit& visit) {
    double change = 0;
    if (backwards) {
      for (auto i = order_.rbegin(); i != order_.rend(); ++i) change = std::max(change, visit(joints_[*i]));
    } else {
      for (const std::uint32_t i : order_) change = std::max(change, visit(joints_[i]));
    }
    return change;
  }

  std::vector<std::uint32_t> order_;
  std::vector<Joint>& joints_;
  std::vector<Mover>& movers_;
  std::vector<Velocities>& corrections_;
  const TestBedSolverOptions& options_;
};

Mover make_mover(const BodyProperties& body, const BodyState& state) {
  const bool moves = body.motion == Motion::moving;
  const bool is_fixed = body.motion == Motion::fixed;
  return {{is_fixed ? Vector3{} : state.velocity, is_fixed ? Vector3{} : state.angular_velocity},
          moves ? 1 / body.mass : 0,
          world_inverse_inertia(body, state)};
}

// Moves with their bodies, between two searches for contacts, the contacts that a step was given.
class FollowedContacts {
 public:
  FollowedContacts(std::span<const ContactPoint> contacts, std::span<const BodyState> states)
      : contacts_(contacts.begin(), contacts.end()) {
    for (const ContactPoint& contact : contacts) anchors_.push_back(anchor_of(contact, states));
  }

  void follow(std::span<const BodyState> states) {
    for (std::size_t i = 0; i < contacts_.size(); ++i) carry(contacts_[i], anchors_[i], states);
  }

  const std::vector<ContactPoint>& contacts() const { return contacts_; }

 private:
  std::vector<ContactPoint> contacts_;
  std::vector<ContactAnchor> anchors_;
};

// Projected Gauss-Seidel on the velocity-level complementarity problem of contacts with a friction pyramid
// (Stewart and Trinkle 1996; Erleben 2007): for each contact, with w the relative velocity of b at the
// point,
//
//     0 <= lambda_n  complementary to  w_n - target >= 0
//     -mu lambda_n <= lambda_t <= mu lambda_n,  w_t = 0 in between, opposed to lambda_t at a bound
//
// target: restitution times the speed of approach where that is more than gravity gives in two steps, else
// 0. The first tangent is that in which the bodies slip, so that sliding friction has Coulomb's size
// whatever its direction.
//
// Penetration beyond the slop is taken away by a second set of velocities, which push along normals alone,
// move the bodies once, and never become kinetic energy (split impulses).
//
// An island is done before all sweeps are made when one changes no velocity by more than 10⁻⁹ of what gravity
// gives in a step. Islands are solved side by side; the bytes are the same for any
// number of threads.
//
// There are as many solutions as substeps. With warm start, a step that has no impulse of the step before
// makes ten times the sweeps.
class SweepSolver final : public StepSolver {
 public:
  explicit SweepSolver(const TestBedSolverOptions& options) : options_(options) {}

  void step(const StepInput& input, std::span<BodyState> states,
            std::span<ContactImpulse> impulses) override {
    constexpr std::uint32_t kCold = 10;
    TestBedSolverOptions options = options_;
    if (options.warm_start && input.is_cold) options.iterations *= kCold;  // or stacks sink at once
    const double dt = input.dt / options.substeps;
    FollowedContacts followed(input.contacts, states);
    for (std::uint32_t i = 0; i < options.substeps; ++i) {
      if (i > 0) followed.follow(states);
      for (std::size_t body = 0; body < states.size(); ++body) {
        if (input.bodies[body].motion != Motion::moving) continue;
        states[body].velocity += dt * input.pulls[body].linear;
        states[body].angular_velocity += dt * input.pulls[body].angular;
      }
      solve({{input.bodies, followed.contacts(), dt, input.pulls},
             input.islands,
             input.number * options.substeps + i,
             input.is_cold,
             input.threads},
            options, states, impulses);
      for (std::size_t body = 0; body < states.size(); ++body) {
        advance(input.bodies[body], states[body], corrections_[body].velocity, corrections_[body].spin, dt);
      }
    }
    if (!input.done.empty()) std::ranges::copy(impulses, input.done.begin());
  }

 private:
  // Solves for the velocities at the end of a part of a step. Results: states' velocities, impulses,
  // corrections_. Condition: velocities include all that is not contacts.
  void solve(const StepInput& part, const TestBedSolverOptions& options, std::span<BodyState> states,
             std::span<ContactImpulse> impulses) {
    begin(part, options, states);
    const auto layers =
        options.shock_propagation ? find_layers(part.bodies, part.contacts) : std::vector<std::uint32_t>();
    std::vector<Residual> residuals(part.islands.size());
    // Without contacts there is nothing to do, and most islands of a slide are such.
    part.threads.for_each(part.islands.size(), [&](std::size_t i) {
      if (!part.islands.contacts_of(i).empty())
        residuals[i] = solve_island(part, part.islands.contacts_of(i), options, impulses, layers);
    });
    Residual all;
    for (const Residual& residual : residuals) all.add(residual);
    sum_up(part.islands, all);
    hand_out(part, states, impulses);
  }

  void begin(const StepInput& part, const TestBedSolverOptions& options, std::span<const BodyState> states) {
    movers_.resize(part.bodies.size());
    joints_.resize(part.contacts.size());
    corrections_.assign(part.bodies.size(), {});
    part.threads.for_each(part.bodies.size(),
                          [&](std::size_t i) { movers_[i] = make_mover(part.bodies[i], states[i]); });
    part.threads.for_each(part.contacts.size(), [&](std::size_t i) {
      joints_[i] = make_joint(part.contacts[i], states, movers_, options, part);
    });
  }

  Residual solve_island(const StepInput& part, std::span<const std::uint32_t> members,
                        const TestBedSolverOptions& options, std::span<const ContactImpulse> impulses,
                        std::span<const std::uint32_t> layers) {
    constexpr double kStill = 1e-9;  // of what gravity gives in a step
    if (options.warm_start) {
      for (const std::uint32_t j : members) warm_start(joints_[j], impulses[j], movers_);
    }
    IslandSweeps solver(members, joints_, movers_, corrections_, options);
    if (options.order == ContactOrder::shuffled)
      solver.shuffle_order(options.seed ^ (part.number * 0x9E3779B97F4A7C15u + members.front()));
    double pull = 0;
    for (const std::uint32_t j : members) pull = std::max(pull, part.pull_of(part.contacts[j]));
    solver.solve(kStill * (part.dt * pull));
    if (options.shock_propagation) solver.propagate_shock(layers);
    return solver.residual();
  }

  void hand_out(const StepInput& part, std::span<BodyState> states,
                std::span<ContactImpulse> impulses) const {
    part.threads.for_each(part.bodies.size(), [&](std::size_t i) {
      if (part.bodies[i].motion != Motion::moving) return;
      states[i].velocity = movers_[i].velocity;
      states[i].angular_velocity = movers_[i].spin;
    });
    part.threads.for_each(part.contacts.size(), [&](std::size_t i) {
      const Joint& joint = joints_[i];
      impulses[i].normal = joint.normal.impulse;
      impulses[i].tangential = joint.tangent[0].impulse * joint.tangent[0].direction +
                               joint.tangent[1].impulse * joint.tangent[1].direction;
    });
  }

  TestBedSolverOptions options_;
  std::vector<Mover> movers_;
  std::vector<Joint> joints_;
  std::vector<Velocities> corrections_;
};

}  // namespace

std::unique_ptr<StepSolver> make_sweep_solver(const TestBedSolverOptions& options) {
  return std::make_unique<SweepSolver>(options);
}

}  // namespace tandem::simulation
