#include "dynamics/islands.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "kernels/common/union_find.h"

namespace tandem::dynamics {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

bool moves(const BodyProperties& body) {
  return body.motion == Motion::moving;
}

// Sorts things with an island each by island, keeping their order.
void group(const std::vector<std::uint32_t>& island_of, std::size_t islands,
           std::vector<std::uint32_t>& members, std::vector<std::uint32_t>& begin) {
  begin.assign(islands + 1, 0);
  for (const std::uint32_t island : island_of) {
    if (island != kNone) ++begin[island + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  members.resize(begin.back());
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (std::uint32_t i = 0; i < island_of.size(); ++i) {
    if (island_of[i] != kNone) members[next[island_of[i]]++] = i;
  }
}

// Calls take(a, b) for the bodies of each contact and joint.
template <typename Take>
void for_each_link(std::span<const ContactPoint> contacts, std::span<const ObjectPair> joined,
                   const Take& take) {
  for (const ContactPoint& contact : contacts) take(contact.body_a, contact.body_b);
  for (const ObjectPair& pair : joined) take(pair.a, pair.b);
}

}  // namespace

Islands find_islands(std::span<const BodyProperties> bodies, std::span<const ContactPoint> contacts,
                     std::span<const ObjectPair> joined) {
  UnionFind sets(bodies.size());
  for_each_link(contacts, joined, [&](std::uint32_t a, std::uint32_t b) {
    if (a != kNone && b != kNone && moves(bodies[a]) && moves(bodies[b])) sets.join(a, b);
  });
  std::uint32_t count = 0;
  std::vector<std::uint32_t> island_of_body(bodies.size(), kNone), island_of_contact(contacts.size(), kNone);
  std::vector<std::uint32_t> island_of_joint(joined.size(), kNone);
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    if (!moves(bodies[i])) continue;
    const std::uint32_t first = sets.find(i);  // never after i
    island_of_body[i] = first == i ? count++ : island_of_body[first];
  }
  const auto island_of = [&](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t first = a != kNone ? island_of_body[a] : kNone;
    return first != kNone || b == kNone ? first : island_of_body[b];
  };
  for (std::size_t i = 0; i < contacts.size(); ++i)
    island_of_contact[i] = island_of(contacts[i].body_a, contacts[i].body_b);
  for (std::size_t i = 0; i < joined.size(); ++i) island_of_joint[i] = island_of(joined[i].a, joined[i].b);
  Islands islands;
  group(island_of_body, count, islands.bodies, islands.body_begin);
  group(island_of_contact, count, islands.contacts, islands.contact_begin);
  group(island_of_joint, count, islands.joints, islands.joint_begin);
  return islands;
}

std::vector<std::uint32_t> find_layers(std::span<const BodyProperties> bodies,
                                       std::span<const ContactPoint> contacts,
                                       std::span<const ObjectPair> joined) {
  // The world follows the bodies.
  const auto world = static_cast<std::uint32_t>(bodies.size());
  std::vector<std::uint32_t> layer(bodies.size() + 1, kNone), front, next;
  for (std::uint32_t i = 0; i <= world; ++i) {
    if (i == world || !moves(bodies[i])) layer[i] = 0, front.push_back(i);
  }
  std::vector<std::uint32_t> degree(bodies.size() + 2, 0), neighbours(2 * (contacts.size() + joined.size()));
  for_each_link(contacts, joined, [&](std::uint32_t a, std::uint32_t b) {
    ++degree[std::min(a, world) + 1], ++degree[std::min(b, world) + 1];
  });
  std::partial_sum(degree.begin(), degree.end(), degree.begin());
  std::vector<std::uint32_t> place(degree.begin(), degree.end() - 1);
  for_each_link(contacts, joined, [&](std::uint32_t a, std::uint32_t b) {
    neighbours[place[std::min(a, world)]++] = std::min(b, world);
    neighbours[place[std::min(b, world)]++] = std::min(a, world);
  });
  for (; !front.empty(); front.swap(next), next.clear()) {
    for (const std::uint32_t i : front) {
      for (std::uint32_t at = degree[i]; at < degree[i + 1]; ++at) {
        std::uint32_t& reached = layer[neighbours[at]];
        if (reached != kNone) continue;
        reached = layer[i] + 1;
        next.push_back(neighbours[at]);
      }
    }
  }
  layer.pop_back();
  return layer;
}

void Sleep::start(std::size_t bodies) {
  quiet_.assign(bodies, 0);
  group_.assign(bodies, kAwake);
}

void Sleep::wake_touched(std::span<const BodyProperties> bodies, std::span<const ContactPoint> contacts,
                         std::span<const ObjectPair> joined) {
  std::vector<std::uint32_t> touched;
  for_each_link(contacts, joined, [&](std::uint32_t a, std::uint32_t b) {
    if (a == kNone || b == kNone || sleeps(a) == sleeps(b)) return;
    // A fixed body wakes nobody.
    if (bodies[sleeps(a) ? b : a].motion != Motion::fixed) touched.push_back(sleeps(a) ? a : b);
  });
  for (const std::uint32_t body : touched) wake(body);
}

void Sleep::wake(std::uint32_t body) {
  quiet_[body] = 0;
  const std::uint32_t group = group_[body];
  if (group == kAwake) return;
  for (std::size_t i = 0; i < group_.size(); ++i) {
    if (group_[i] == group) group_[i] = kAwake, quiet_[i] = 0;
  }
}

void Sleep::fall_asleep(std::span<const BodyProperties> bodies, std::span<BodyState> states,
                        const Islands& islands, const SleepOptions& options, double dt,
                        std::span<const std::uint8_t> driven) {
  for (std::size_t island = 0; island < islands.size(); ++island) {
    const auto members = islands.bodies_of(island);
    bool all = !islands.flies(island);
    for (const std::uint32_t joint : islands.joints_of(island)) all = all && driven[joint] == 0;
    for (const std::uint32_t i : members) {
      const double speed = norm(states[i].velocity) + bodies[i].radius * norm(states[i].angular_velocity);
      quiet_[i] = speed <= options.speed ? quiet_[i] + dt : 0;
      all = all && quiet_[i] >= options.delay;
    }
    if (!all) continue;
    for (const std::uint32_t i : members) {
      group_[i] = members.front();
      states[i].velocity = {};
      states[i].angular_velocity = {};
    }
  }
}

std::size_t Sleep::count() const {
  return group_.size() - static_cast<std::size_t>(std::count(group_.begin(), group_.end(), kAwake));
}

void Sleep::restore(std::vector<double> quiet, std::vector<std::uint32_t> groups) {
  quiet_ = std::move(quiet);
  group_ = std::move(groups);
}

}  // namespace tandem::dynamics
