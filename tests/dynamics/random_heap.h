#pragma once
#include <algorithm>
#include <cstdint>
#include <random>
#include <set>
#include <vector>

#include "dynamics/parallel/parallel_soft_step.h"
#include "dynamics/step_solver.h"

namespace tandem::dynamics {

/// Says of what a RandomHeap is made.
struct HeapOptions {
  std::uint32_t bodies = 200, pairs = 600;
  std::uint32_t least_contacts = 1, most_contacts = 6;  ///< of a pair
  std::uint32_t hub = 0;                                ///< so many bodies touch body 0 too, which then moves
  bool is_near = false;                                 ///< bodies touch those next in the list
  unsigned seed = 1;
};

/// Bodies with random contacts: some are fixed or kinematic, some bounce, and contacts are deep, open, and of
/// one or of several directions.
struct RandomHeap {
  std::vector<BodyProperties> bodies;
  std::vector<BodyState> states;
  std::vector<Pull> pulls;
  std::vector<ContactPoint> contacts;
  std::vector<ContactImpulse> impulses;
  std::vector<ContactPair> pairs;
  SolverOptions options = {.kind = SolverKind::soft, .restitution = 0.2};
  double dt = 1.0 / 60;

  explicit RandomHeap(const HeapOptions& heap) : random_(heap.seed) {
    bodies.resize(heap.bodies), states.resize(heap.bodies), pulls.resize(heap.bodies);
    for (std::uint32_t i = 0; i < heap.bodies; ++i) make_body(i);
    if (heap.hub > 0) bodies[0].motion = Motion::moving;
    std::set<std::pair<std::uint32_t, std::uint32_t>> touching;
    for (std::uint32_t i = 1; i <= heap.hub; ++i) touching.insert({0, i});
    while (touching.size() < heap.pairs + heap.hub) {
      const std::uint32_t a = below(heap.bodies);
      const std::uint32_t b = heap.is_near ? (a + 1 + below(12)) % heap.bodies : below(heap.bodies);
      if (a != b) touching.insert({std::min(a, b), std::max(a, b)});
    }
    for (const auto& [a, b] : touching)
      touch(a, b, heap.least_contacts + below(heap.most_contacts - heap.least_contacts + 1));
  }

  /// Returns the step of these, of which `impulses` and `done` are changed.
  StepBodies step() const { return {bodies, contacts, dt, pulls}; }

 private:
  std::uint32_t below(std::uint32_t most) { return static_cast<std::uint32_t>(random_() % most); }
  double number(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Vector3 any(double most) { return {number(-most, most), number(-most, most), number(-most, most)}; }

  void make_body(std::uint32_t i) {
    BodyProperties& body = bodies[i];
    const std::uint32_t kind = below(20);
    body.motion = kind == 0 ? Motion::fixed : kind == 1 ? Motion::kinematic : Motion::moving;
    body.mass = number(0.5, 20);
    body.radius = 1;
    const Vector3 moments = {body.mass * number(0.2, 0.4), body.mass * number(0.2, 0.4),
                             body.mass * number(0.2, 0.4)};
    body.inertia = {{{moments.x, 0, 0}, {0, moments.y, 0}, {0, 0, moments.z}}};
    body.inverse_inertia = inverse(body.inertia);
    if (below(4) == 0) body.material.restitution = 0.8;
    if (below(4) == 0) body.material.friction = number(0, 1);
    if (below(4) == 0) body.material.rolling_resistance = number(0, 0.1);
    states[i].position = any(5);
    states[i].orientation = rotation_by(any(2));
    states[i].velocity = any(2), states[i].angular_velocity = any(2);
    pulls[i] = {{0, 0, -9.81}, {}};
    if (below(8) == 0) pulls[i].angular = any(1), pulls[i].turning = norm(pulls[i].angular);
  }

  void touch(std::uint32_t a, std::uint32_t b, std::uint32_t count) {
    const auto first = static_cast<std::uint32_t>(contacts.size());
    Vector3 normal = normalized(any(1) + Vector3{0, 0, 1.5});
    const Vector3 middle = 0.5 * (states[a].position + states[b].position);
    for (std::uint32_t k = 0; k < count; ++k) {
      if (below(3) == 0) normal = normalized(any(1) + Vector3{0, 0, 0.1});
      contacts.push_back({a, b, middle + any(0.5), normal, number(-2e-3, 6e-3), 0});
      if (below(4) == 0) contacts.back().time = number(0, dt);
      ContactImpulse& impulse = impulses.emplace_back();
      if (below(3) == 0) continue;
      impulse.normal = number(0, 1);
      impulse.tangential = 0.3 * cross(normal, any(1));
      impulse.turning = 0.01 * any(1);
    }
    const bool moves = bodies[a].motion == Motion::moving || bodies[b].motion == Motion::moving;
    if (moves) pairs.push_back({a, b, first, count});
  }

  std::mt19937 random_;
};

/// Returns few pairs, so that there are many islands, small ones and large ones.
inline RandomHeap sparse_heap(unsigned seed, SolverKind kind) {
  RandomHeap heap({.bodies = 150, .pairs = 90 + 10 * seed, .seed = seed});
  heap.options.kind = kind;
  return heap;
}

/// Returns balls that are so deep in each other that few substeps are far from impulses that part them, in
/// islands of some bodies. what_drives: motion of the bodies that contacts do not move.
inline RandomHeap wedged_heap(unsigned seed, Motion what_drives) {
  RandomHeap heap({.bodies = 150, .pairs = 90, .seed = seed});
  heap.options.substeps = 4;
  for (BodyProperties& body : heap.bodies) {
    if (body.motion != Motion::moving) body.motion = what_drives;
    body.inertia = 0.3 * body.mass * Matrix3::identity(), body.inverse_inertia = inverse(body.inertia);
  }
  for (ContactPoint& contact : heap.contacts) contact.depth *= 50;
  for (Pull& pull : heap.pulls) pull = {{0, 0, -9.81}, {}};
  return heap;
}

/// Returns boxes on each other on a fixed one, the last of 10,000 kg and the others of 1 kg. Two that touch
/// do so by four corners.
inline RandomHeap tower(std::uint32_t boxes) {
  RandomHeap out({.bodies = boxes + 1, .pairs = 0});
  out.options = {};
  out.bodies[0].motion = Motion::fixed;
  for (std::uint32_t i = 1; i <= boxes; ++i) {
    BodyProperties& body = out.bodies[i];
    body = {}, body.mass = i == boxes ? 1e4 : 1;
    body.inertia = body.mass / 6 * Matrix3::identity(), body.inverse_inertia = inverse(body.inertia);
    out.states[i] = {{0, 0, i - 0.5}, {}, {0.01 * i, 0, 0}, {}};
    out.pairs.push_back({i - 1, i, static_cast<std::uint32_t>(out.contacts.size()), 4});
    for (int k = 0; k < 4; ++k)
      out.contacts.push_back({i - 1,
                              i,
                              {k % 2 - 0.5, k / 2 - 0.5, i - 1.0},
                              {0, 0, 1},
                              1e-4,
                              static_cast<std::uint64_t>(k + 1)});
  }
  out.states[0] = {};
  out.pulls.assign(boxes + 1, {{0, 0, -9.81}, {}});
  out.impulses.assign(out.contacts.size(), {});
  return out;
}

/// What a step of a heap gives.
struct HeapResult {
  std::vector<BodyState> states;
  std::vector<ContactImpulse> impulses, done;
};

/// Returns by how much a velocity, a spin, a place or a turn of a body differs at most; infinity where one is
/// no number.
inline double largest_difference(const HeapResult& a, const HeapResult& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.states.size(); ++i) {
    const BodyState &p = a.states[i], &q = b.states[i];
    for (const Vector3& by : {p.velocity - q.velocity, p.angular_velocity - q.angular_velocity,
                              p.position - q.position, turn_between(p.orientation, q.orientation)})
      if (!(norm(by) <= most)) most = norm(by) > most ? norm(by) : INFINITY;
  }
  return most;
}

/// Returns a step of the heap as the CPU makes it, by the solver of the heap's options.
inline HeapResult solution(const RandomHeap& heap, std::uint32_t thread_count = 1) {
  Threads threads(thread_count);
  std::vector<ContactImpulse> done = heap.impulses;
  HeapResult out = {heap.states, heap.impulses, {}};
  const Islands islands = find_islands(heap.bodies, heap.contacts);
  make_step_solver(heap.options)
      ->step({heap.step(), islands, 0, false, threads, {}, {}, done}, out.states, out.impulses);
  out.done = std::move(done);
  return out;
}

}  // namespace tandem::dynamics
