#pragma once
#include <algorithm>
#include <cstdint>
#include <span>

#include "dynamics/carver.h"
#include "dynamics/contact_rows.h"
#include "dynamics/parallel/atomics.h"

namespace tandem::dynamics {

/// Two bodies that touch, and how b turns against a.
struct TouchingPair {
  std::uint32_t begin, end;   ///< of their contacts
  std::uint32_t a, b;         ///< places
  ContactRow turn[3];         ///< about the axes of the world
  Vector3 drive;              ///< of turn
  double mobility;            ///< an impulse of 1 about any axis changes turn by no more
  double rolling_resistance;  ///< the lever of the force that pushes them apart
  Vector3 impulse;            ///< against turning, as a whole step would need it
};

/// The bodies and contacts of one island in arrays, for one step: inertia, arms and directions stay those of
/// its start. Bodies are known by their place here; 0 stands for all that contacts do not move, whose y is 0.
/// The memory is somebody else's.
struct ContactIsland {
  std::span<std::uint32_t> bodies;  ///< [0] is none
  std::span<SteppedBody> stepped;   ///< as they are at the start
  std::span<Vector6> velocity;      ///< y: at the start of the step, then at its end
  std::span<Vector6> displacement;  ///< the integral of y over the step, a result

  std::span<std::uint32_t> contacts, a, b;
  std::span<ContactRow> normal, first, second;  ///< the latter two across the normal
  std::span<Vector3> first_direction, second_direction;
  std::span<Vector3> drive;  ///< of normal, first, second: by bodies that move and are not moved, at the end
  std::span<double> drive_beyond_mean;  ///< of the normal
  std::span<double> separation;         ///< of a gap; else the slop less the depth, at most 0
  std::span<double> friction;           ///< Coulomb's coefficient
  std::span<double> rebound;            ///< velocity along the normal that restitution asks for, or 0
  std::span<Vector3> impulse;           ///< along normal, first, second, as a whole step would need it

  std::span<TouchingPair> pairs;                         ///< in the order of their contacts
  std::span<std::uint32_t> first_of_body, pair_of_body;  ///< pairs of each body, ascending, body by body

  /// bodies: place 0 included.
  TANDEM_HD void carve(Carver& carver, std::size_t body_count, std::size_t contact_count,
                       std::size_t pair_count) {
    carver.take(body_count, bodies), carver.take(body_count, stepped);
    carver.take(body_count, velocity), carver.take(body_count, displacement);
    carver.take(contact_count, contacts), carver.take(contact_count, a), carver.take(contact_count, b);
    carver.take(contact_count, normal), carver.take(contact_count, first);
    carver.take(contact_count, second), carver.take(contact_count, first_direction);
    carver.take(contact_count, second_direction), carver.take(contact_count, drive);
    carver.take(contact_count, drive_beyond_mean), carver.take(contact_count, separation);
    carver.take(contact_count, friction), carver.take(contact_count, rebound);
    carver.take(contact_count, impulse);
    carver.take(pair_count, pairs);
    carver.take(body_count + 1, first_of_body), carver.take(2 * pair_count, pair_of_body);
  }

  TANDEM_HD std::uint32_t body_count() const { return static_cast<std::uint32_t>(bodies.size()); }
  TANDEM_HD std::uint32_t contact_count() const { return static_cast<std::uint32_t>(contacts.size()); }
  TANDEM_HD std::uint32_t pair_count() const { return static_cast<std::uint32_t>(pairs.size()); }
  TANDEM_HD double along(const ContactRow& row, std::size_t contact, std::span<const Vector6> y) const {
    return dot(row.a, y[a[contact]]) + dot(row.b, y[b[contact]]);
  }
  /// Returns the velocities of a contact but for its drive.
  TANDEM_HD Vector3 relative(std::size_t contact, std::span<const Vector6> y) const {
    return {along(normal[contact], contact, y), along(first[contact], contact, y),
            along(second[contact], contact, y)};
  }
  /// Returns by how much b of a pair turns against a, but for what drives them.
  TANDEM_HD Vector3 turning(const TouchingPair& pair, std::span<const Vector6> y) const {
    const auto along = [&](const ContactRow& row) { return dot(row.a, y[pair.a]) + dot(row.b, y[pair.b]); };
    return {along(pair.turn[0]), along(pair.turn[1]), along(pair.turn[2])};
  }
  /// Returns one mobility for both directions, or friction would not oppose the slip.
  TANDEM_HD double friction_mobility(std::size_t contact) const {
    return std::max(first[contact].mobility(), second[contact].mobility());
  }
  /// Calls visit(pair) for each pair of a body, ascending.
  template <typename Visit>
  TANDEM_HD void pairs_of(std::uint32_t body, const Visit& visit) const {
    for (std::uint32_t k = first_of_body[body]; k < first_of_body[body + 1]; ++k)
      visit(pairs[pair_of_body[k]], pair_of_body[k]);
  }
};

/// Lists the pairs of each body. Condition: the pairs have their bodies.
template <typename Team>
TANDEM_HD void list_pairs_of_bodies(const Team& team, const ContactIsland& island) {
  const std::span<std::uint32_t> first = island.first_of_body, list = island.pair_of_body;
  team.each(island.body_count() + 1, [&](std::uint32_t j) { first[j] = 0; });
  team.barrier();
  team.each(island.pair_count(), [&](std::uint32_t i) {
    for (const std::uint32_t body : {island.pairs[i].a, island.pairs[i].b}) {
      if (body > 0) atomic_add(first[body], 1);
    }
  });
  team.barrier();
  // Each place becomes the end of the body's pairs, and goes down to their begin as they are listed.
  if (team.rank() == 0) {
    for (std::uint32_t j = 1; j <= island.body_count(); ++j) first[j] += first[j - 1];
  }
  team.barrier();
  team.each(island.pair_count(), [&](std::uint32_t k) {
    const std::uint32_t i = island.pair_count() - 1 - k;
    for (const std::uint32_t body : {island.pairs[i].a, island.pairs[i].b}) {
      if (body > 0) list[atomic_add(first[body], 0xFFFFFFFFu) - 1] = i;
    }
  });
  team.barrier();
  team.each(island.body_count(), [&](std::uint32_t j) {
    for (std::uint32_t k = first[j] + 1; k < first[j + 1]; ++k) {
      const std::uint32_t moved = list[k];
      std::uint32_t to = k;
      for (; to > first[j] && list[to - 1] > moved; --to) list[to] = list[to - 1];
      list[to] = moved;
    }
  });
  team.barrier();
}

/// Fills what the island knows of a body. Condition: `bodies` has it.
TANDEM_HD inline void fill_island_body(const RowMaker& rows, const ContactIsland& island, std::uint32_t j) {
  island.stepped[j] = j > 0 ? rows.body(island.bodies[j]) : SteppedBody{};
  island.velocity[j] = island.stepped[j].velocity;
  island.displacement[j] = {};
}

/// Fills a pair and its contacts. Conditions: `contacts` has them; the pair knows its bodies and contacts,
/// and its bodies are filled. contacts, impulses: of the step.
TANDEM_HD inline void fill_island_pair(const RowMaker& rows, const ContactPoint* contacts,
                                       const ContactImpulse* impulses, const ContactIsland& island,
                                       TouchingPair& pair) {
  const SteppedBody &body_a = island.stepped[pair.a], &body_b = island.stepped[pair.b];
  const std::span<const std::uint32_t> own = island.contacts.subspan(pair.begin, pair.end - pair.begin);
  const Material material = rows.material_of(contacts[own[0]]);
  pair.drive = rows.turning_drive(contacts[own[0]]);
  pair.rolling_resistance = material.rolling_resistance;
  pair.mobility = turning_mobility(body_a, body_b);
  pair.impulse = Vector3{};
  for (int k = 0; k < 3; ++k) {
    pair.turn[k] = {Vector6{}, Vector6{}};
    if (pair.a > 0) pair.turn[k].a.angular = -body_a.scale.spread.row[k];
    if (pair.b > 0) pair.turn[k].b.angular = body_b.scale.spread.row[k];
  }
  for (const std::uint32_t contact : own) pair.impulse += impulses[contact].turning;
  rows.visit_contacts(own, [&](std::size_t k, const ContactPoint& contact, const ContactPatch& patch) {
    const std::size_t i = pair.begin + k;
    const ContactRows made = rows.rows(contact, patch, body_a, body_b, material, impulses[own[k]]);
    island.a[i] = pair.a, island.b[i] = pair.b;
    island.normal[i] = made.normal, island.first[i] = made.first, island.second[i] = made.second;
    island.first_direction[i] = made.first_direction, island.second_direction[i] = made.second_direction;
    island.drive[i] = made.drive, island.drive_beyond_mean[i] = made.drive_beyond_mean;
    island.impulse[i] = made.impulse;
    island.separation[i] = made.separation, island.rebound[i] = made.rebound;
    island.friction[i] = made.friction;
  });
}

/// Moves a body by its displacement and gives it its velocity. state: at the start, then at the end.
TANDEM_HD inline void move_island_body(const ContactIsland& island, const StepBodies& step, std::uint32_t j,
                                       BodyState& state) {
  apply_motion(step.bodies[island.bodies[j]], island.stepped[j].scale, island.velocity[j],
               island.displacement[j], step.dt, state);
}

/// Hands out the impulses of a pair's contacts. impulses: of all contacts of the step.
TANDEM_HD inline void write_island_pair(const ContactIsland& island, const TouchingPair& pair,
                                        ContactImpulse* impulses) {
  for (std::uint32_t i = pair.begin; i < pair.end; ++i) {
    const Vector3& impulse = island.impulse[i];
    impulses[island.contacts[i]] = {
        impulse.x, impulse.y * island.first_direction[i] + impulse.z * island.second_direction[i],
        pair.impulse / (pair.end - pair.begin)};
  }
}

}  // namespace tandem::dynamics
