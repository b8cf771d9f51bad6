#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "dynamics/contact_rows.h"
#include "dynamics/parallel/atomics.h"
#include "dynamics/soft_rows.h"
#include "dynamics/softness.h"

/// What a soft step does before and after its passes, body by body and pair by pair, for host and device.
/// SoftSolver and ParallelSoftStep share it, and so give the same bytes.
namespace tandem::dynamics {

inline constexpr int kRelaxingSweeps = 2;      ///< of each substep
inline constexpr int kRestitutionSweeps = 10;  ///< after all substeps

/// The numbers of a step that its soft rows are made of. Masses are measured in a unit about as large as the
/// heaviest, so that float32 has room for the others, and whose root is a power of two, so that no digit
/// depends on it. `unit_root` below is that root.
struct SoftNumbers {
  RowMaker rows;
  const ContactPoint* contacts;
  const ContactImpulse* impulses;  ///< to start with
  double dt, slop;
  double substeps;
  double h = dt / substeps;  ///< seconds of a substep
  Softness between_movers = softness(1 / (8 * h), 10, h), against_unmoved = softness(2 / (8 * h), 5, h);

  explicit SoftNumbers(const StepNumbers& step, const ContactImpulse* start)
      : rows(step),
        contacts(step.contacts.data()),
        impulses(start),
        dt(step.dt),
        slop(step.options.slop),
        substeps(step.options.substeps) {}
};

/// Returns the root of the unit of masses. most: the mass of the heaviest body.
TANDEM_HD inline double unit_root_of(double most) {
  return std::ldexp(1.0, std::ilogb(most) / 2);
}

TANDEM_HD inline void put(double x, SoftNumber& to, int lane) {
  to.of[lane] = static_cast<float>(x);
}
TANDEM_HD inline void put(const Vector3& x, SoftNumber (&to)[3], int lane) {
  put(x.x, to[0], lane), put(x.y, to[1], lane), put(x.z, to[2], lane);
}
TANDEM_HD inline void put(const MassScale& scale, SoftNumber (&to)[9], int lane) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) put(at(scale.spread.row[i], j), to[3 * i + j], lane);
  }
}
TANDEM_HD inline void put(const Vector3& x, float (&to)[4]) {
  to[0] = static_cast<float>(x.x), to[1] = static_cast<float>(x.y), to[2] = static_cast<float>(x.z),
  to[3] = 0;
}

/// Lanes that are left out together may leave a zero its sign; here it has none.
TANDEM_HD inline double unsigned_zero(float x) {
  return x + 0.0;
}
TANDEM_HD inline Vector3 first_three(const float (&from)[4]) {
  return {unsigned_zero(from[0]), unsigned_zero(from[1]), unsigned_zero(from[2])};
}

/// Returns the y of a motion, or of a way.
TANDEM_HD inline Vector6 added_motion(const MassScale& scale, const SoftMotion& motion) {
  return {scale.root_mass * first_three(motion.centre), first_three(motion.spin)};
}

/// Returns a body that contacts move.
TANDEM_HD inline SteppedBody soft_body(const SoftNumbers& step, double unit_root, std::uint32_t body) {
  SteppedBody out = step.rows.body(body);
  MassScale& scale = out.scale;
  // Masses become so many times less as the square of the root.
  scale = {scale.root_mass / unit_root, unit_root * scale.inverse_root_mass, unit_root * scale.spread};
  out.velocity = 1 / unit_root * out.velocity;
  out.gravity = 1 / unit_root * out.gravity;
  return out;
}

/// Returns what gravity and lasting forces add to a body's motion in a substep.
TANDEM_HD inline SoftMotion gain_of(const SteppedBody& body, double h) {
  SoftMotion out;
  put(h / body.scale.root_mass * body.gravity.linear, out.centre);
  put(h * body.gravity.angular, out.spin);
  return out;
}

namespace soft_rules_detail {

TANDEM_HD inline double inverse_mass(const SteppedBody& body) {
  return body.moves ? 1 / (body.scale.root_mass * body.scale.root_mass) : 0;
}

// Bodies that impact has driven into each other may be held from both sides: what pushes one way makes the
// other deeper, the pushes are hundreds of times their weight, and whichever point is found next throws
// them about. So a deep contact pushes for what it is deeper than the same pair's contacts that push
// against it. Result: by how much.
TANDEM_HD inline double opposed(const ContactPoint* all, const ContactRange& of_pair, const Vector3& normal,
                                double separation, double slop) {
  constexpr double kDeep = 4;  // slops
  const double deep = kDeep * slop;
  if (separation > -deep) return 0;
  double opposed = 0;
  for (std::size_t i = 0; i < of_pair.size(); ++i) {
    const ContactPoint& other = all[of_pair[i]];
    opposed =
        std::max(opposed, -std::min(dot(normal, other.normal), 0.0) * std::max(other.depth - slop, 0.0));
  }
  return std::min(opposed, -deep - separation);
}

}  // namespace soft_rules_detail

/// Fills the lane of a pair in the rows of its group, all of which are 0 there. a, b: its bodies.
TANDEM_HD inline void fill_pair(const SoftNumbers& step, double unit_root, const ContactRange& contacts,
                                const SteppedBody& a, const SteppedBody& b, const SoftRows& rows,
                                std::uint32_t group_of_pair, int lane) {
  using namespace soft_rules_detail;
  SoftPairs& group = rows.pairs[group_of_pair];
  SoftTurning& turns = rows.turnings[group_of_pair];
  const double substeps = step.substeps * unit_root * unit_root;  // in these masses
  if (a.moves) put(a.scale, turns.spread_a, lane);
  if (b.moves) put(b.scale, turns.spread_b, lane);
  put(inverse_mass(a), group.inverse_mass_a, lane), put(inverse_mass(b), group.inverse_mass_b, lane);
  const Softness& soft = a.moves && b.moves ? step.between_movers : step.against_unmoved;
  put(soft.bias_rate, group.bias_rate, lane), put(soft.mass_scale, group.mass_scale, lane);
  put(soft.impulse_scale, group.impulse_scale, lane);
  const Vector3 spin = b.scale.spread * b.velocity.angular - a.scale.spread * a.velocity.angular;
  put(spin + step.rows.turning_drive(step.contacts[contacts.first]), turns.drive, lane);
  put(1 / turning_mobility(a, b), turns.mass, lane);
  const Material material = step.rows.material_of(step.contacts[contacts.first]);
  put(material.rolling_resistance, turns.lever, lane);
  Vector3 turning;
  for (std::size_t i = 0; i < contacts.size(); ++i) turning += step.impulses[contacts[i]].turning;
  put(turning / substeps, turns.impulse, lane);
  step.rows.visit_contacts(
      contacts, [&](std::size_t i, const ContactPoint& contact, const ContactPatch& patch) {
        const ContactMeeting meets = step.rows.meeting(contact, patch, material);
        const ContactImpulse& impulse = step.impulses[contacts[i]];
        const Tangents across(contact.normal);
        SoftNormal& normal = rows.normals[group.first + i];
        put(contact.normal, normal.direction.along, lane);
        put(meets.arm_a, normal.direction.turn_a, lane), put(meets.arm_b, normal.direction.turn_b, lane);
        put(1.0, normal.mass, lane);
        put(meets.separation, normal.followed, lane);
        put(impulse.normal / substeps, normal.impulse, lane);
        SoftGap& gap = rows.gaps[group.first + i];
        const double less = opposed(step.contacts, contacts, contact.normal, meets.separation, step.slop);
        put(meets.separation, gap.separation, lane), put(meets.rebound, gap.rebound, lane);
        put(less, gap.opposed, lane);
        if (meets.rebound > 0) atomic_most(group.bounces, 1u);
        if (less > 0) atomic_most(group.is_opposed, 1u);
        SoftFriction& friction = rows.frictions[group.first + i];
        put(across.first, friction.first.along, lane), put(across.second, friction.second.along, lane);
        // All substeps have the drive of the middle of the step.
        put(meets.velocity + step.rows.drive_gain(contact, 0.5 * step.dt), friction.first.turn_a, lane);
        put(impulse.tangential / substeps, friction.second.turn_a, lane);
        put(material.friction, friction.coefficient, lane);
      });
}

/// What a body does between sweeps.
enum class BodyWork : std::uint8_t {
  begin,       ///< the first substep
  accelerate,  ///< the next substep, whose contacts begin with what they added to the velocities before
  move,
};

namespace soft_rules_detail {

TANDEM_HD inline void work_on(BodyWork work, float h, float gain, float& start, float& velocity,
                              float& moved) {
  if (work == BodyWork::move) {
    moved += h * velocity;
    return;
  }
  const float pushed = work == BodyWork::begin ? velocity : velocity - start;
  start = (work == BodyWork::begin ? 0 : velocity) + gain;
  velocity = start + pushed;
}

}  // namespace soft_rules_detail

/// gain: what a substep adds. start: the velocity without contacts, since the substep began. velocity, moved:
/// what the step adds to the motion of its start.
TANDEM_HD inline void work_on(BodyWork work, float h, const SoftMotion& gain, SoftMotion& start,
                              SoftMotion& velocity, SoftMotion& moved) {
  for (int k = 0; k < 3; ++k) {
    soft_rules_detail::work_on(work, h, gain.centre[k], start.centre[k], velocity.centre[k], moved.centre[k]);
    soft_rules_detail::work_on(work, h, gain.spin[k], start.spin[k], velocity.spin[k], moved.spin[k]);
  }
}

/// Gives a body the state at the end of the step. velocity, moved: what the step has added. part: of what
/// contacts added to the velocity; see ContactWork.
TANDEM_HD inline void end_step(const BodyProperties& properties, const SteppedBody& body,
                               const SoftMotion& velocity, const SoftMotion& moved, double part, double dt,
                               BodyState& state) {
  Vector6 end = body.velocity + added_motion(body.scale, velocity);
  if (part < 1) {
    const Vector6 free = body.velocity + dt * body.gravity;
    end = free + part * (end - free);
  }
  apply_motion(properties, body.scale, end, dt * body.velocity + added_motion(body.scale, moved), dt, state);
}

/// Writes the impulses of a pair's contacts. part: of them, see end_step(). impulses, done: of all contacts;
/// see StepSolver and StepInput; done: null where nobody asks.
TANDEM_HD inline void write_pair(const SoftNumbers& step, double unit_root, const ContactRange& contacts,
                                 const SoftRows& rows, std::uint32_t group, int lane, double part,
                                 ContactImpulse* impulses, ContactImpulse* done) {
  const double unit = part * (unit_root * unit_root), substeps = step.substeps * unit;
  const SoftNumber(&turns)[3] = rows.turnings[group].impulse;
  const auto of = [&](const SoftNumber& number) { return unsigned_zero(number.of[lane]); };
  const Vector3 turning = {of(turns[0]), of(turns[1]), of(turns[2])};
  for (std::uint32_t i = 0; i < contacts.count; ++i) {
    const std::uint32_t contact = contacts[i], row = rows.pairs[group].first + i;
    const Tangents across(step.contacts[contact].normal);
    const SoftFriction& friction = rows.frictions[row];
    const auto impulse = [&](double scale, double normal, double along_first, double along_second) {
      return ContactImpulse{scale * normal,
                            scale * (along_first * across.first + along_second * across.second),
                            substeps / contacts.count * turning};
    };
    impulses[contact] = impulse(substeps, of(rows.normals[row].impulse), of(friction.first_impulse),
                                of(friction.second_impulse));
    if (done != nullptr)
      done[contact] =
          impulse(unit, of(friction.sum_of_normal), of(friction.sum_of_first), of(friction.sum_of_second));
  }
}

}  // namespace tandem::dynamics
