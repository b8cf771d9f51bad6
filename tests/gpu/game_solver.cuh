#pragma once
#include <tandem/kernels/gpu_contact_manifolds.h>

using namespace tandem;

// A solver for cubes of side 1 and mass 1 on a floor of fixed ones, by one block.
constexpr std::uint32_t kFloor = 81, kBodies = kFloor + 36, kSweeps = 120, kThreads = 512;
constexpr double kStep = 1.0 / 60, kFriction = 0.6, kSlop = 0.002, kSlow = 0.05;

struct Vec {
  double x = 0, y = 0, z = 0;
  __device__ friend Vec operator+(Vec p, Vec q) { return {p.x + q.x, p.y + q.y, p.z + q.z}; }
  __device__ friend Vec operator-(Vec p, Vec q) { return {p.x - q.x, p.y - q.y, p.z - q.z}; }
  __device__ friend Vec operator*(double s, Vec p) { return {s * p.x, s * p.y, s * p.z}; }
  __device__ friend double dot(Vec p, Vec q) { return p.x * q.x + p.y * q.y + p.z * q.z; }
  __device__ friend Vec cross(Vec p, Vec q) {
    return {p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
  }
  __device__ friend double norm(Vec p) { return sqrt(dot(p, p)); }
  __device__ static Vec of(const double (&p)[3]) { return {p[0], p[1], p[2]}; }
};
struct Body {
  double by_mass = 0;  // 0: nothing moves it. A cube's inertia is a sixth of its mass about every axis
  Vec velocity = {}, spin = {};
  int calm_steps = 0, touches = 0;
  // All touches are solved at once, so each has a part of the body's mass for itself (mass splitting).
  __device__ double yield(Vec lever) const { return touches * by_mass * (1 + 6 * dot(lever, lever)); }
  __device__ Vec speed_at(Vec arm) const { return velocity + cross(spin, arm); }
  __device__ void push(Vec arm, Vec p) {
    velocity = velocity + by_mass * p, spin = spin + 6 * by_mass * cross(arm, p), ++touches;
  }
};
struct Touch {  // what a solver keeps of a manifold's point
  std::uint32_t a, b;
  Vec normal, arm_a, arm_b;
  double leaving, push = 0;     // along the normal: speed wanted, impulse
  Vec drag = {}, impulse = {};  // of friction; of the last sweep
};
struct Step {  // what is told of it
  std::uint32_t complete, points, asleep;
  int deepest;  // in thousandths of a millimetre
};

__device__ void move(Pose& pose, const Body& body) {
  double(&r)[3][3] = pose.rotation, (&x)[3] = pose.translation;
  Vec u = {r[0][0], r[1][0], r[2][0]}, v = {r[0][1], r[1][1], r[2][1]};
  u = u + kStep * cross(body.spin, u), u = (1 / norm(u)) * u;
  v = v + kStep * cross(body.spin, v), v = v - dot(u, v) * u, v = (1 / norm(v)) * v;
  const Vec axes[3] = {u, v, cross(u, v)}, to = Vec::of(x) + kStep * body.velocity;
  for (int k = 0; k < 3; ++k) r[0][k] = axes[k].x, r[1][k] = axes[k].y, r[2][k] = axes[k].z;
  x[0] = to.x, x[1] = to.y, x[2] = to.z;
}

template <typename Act>  // by one block, which suffices for hundreds of bodies
__device__ void each(std::uint32_t count, const Act& act) {
  for (std::uint32_t i = threadIdx.x; i < count; i += blockDim.x) act(i);
  __syncthreads();
}

__global__ void __launch_bounds__(kThreads)
    solve(Pose* poses, Motion* motion, Body* bodies, Touch* touch, const Touch* before, Step* told,
          const ObjectPair* pairs, const Manifold* manifolds, const ManifoldPoint* points,
          const GpuManifoldReport* report) {
  const std::uint32_t count = report->points;
  each(count, [&](std::uint32_t i) {
    const ManifoldPoint& p = points[i];
    const auto [a, b] = pairs[manifolds[p.manifold].pair];
    const Vec x = Vec::of(p.position), n = Vec::of(manifolds[p.manifold].normal);
    Touch t = {a, b, n, x - Vec::of(poses[a].translation), x - Vec::of(poses[b].translation)};
    t.leaving = 0.2 / kStep * fmax(0.0, p.depth - kSlop);
    if (p.previous != kNoIndex) t.push = before[p.previous].push, t.drag = before[p.previous].drag;
    t.impulse = t.push * n + t.drag;  // as in the step before
    touch[i] = t;
    if (motion[a] == Motion::sleeping && norm(bodies[b].velocity) > 4 * kSlow) motion[a] = Motion::moving;
    if (motion[b] == Motion::sleeping && norm(bodies[a].velocity) > 4 * kSlow) motion[b] = Motion::moving;
    atomicMax(&told->deepest, static_cast<int>(1e6 * p.depth));
  });
  const auto push_bodies = [&](std::uint32_t i) {  // in the order of points: the same bytes on every run
    bodies[i].by_mass = motion[i] == Motion::moving, bodies[i].touches = 0;
    for (const Touch* t = touch; t != touch + count; ++t) {
      if (t->a == i) bodies[i].push(t->arm_a, -1 * t->impulse);
      if (t->b == i) bodies[i].push(t->arm_b, t->impulse);
    }
  };
  each(kBodies, push_bodies);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    each(count, [&](std::uint32_t i) {
      Touch& t = touch[i];
      const Body &a = bodies[t.a], &b = bodies[t.b];
      const double mass = 1 / (a.yield(cross(t.arm_a, t.normal)) + b.yield(cross(t.arm_b, t.normal)));
      const double grip = 1 / (a.yield(t.arm_a) + b.yield(t.arm_b));  // the least mass of any direction
      const Vec speed = b.speed_at(t.arm_b) - a.speed_at(t.arm_a);
      const double along = dot(speed, t.normal), push = fmax(0.0, t.push + mass * (t.leaving - along));
      Vec drag = t.drag - grip * (speed - along * t.normal);
      if (norm(drag) > kFriction * push) drag = (kFriction * push / norm(drag)) * drag;
      t.impulse = (push - t.push) * t.normal + drag - t.drag, t.push = push, t.drag = drag;
    });
    each(kBodies, push_bodies);
  }
  each(kBodies, [&](std::uint32_t i) {
    Body& body = bodies[i];
    const bool calm = motion[i] == Motion::moving && norm(body.velocity) + norm(body.spin) < kSlow;
    body.calm_steps = calm ? body.calm_steps + 1 : 0;
    if (body.calm_steps == 30) motion[i] = Motion::sleeping, body = {};
    if (motion[i] == Motion::moving) move(poses[i], body), body.velocity.z -= 9.81 * kStep;
    if (motion[i] == Motion::sleeping) atomicAdd(&told->asleep, 1);
  });
  if (threadIdx.x == 0) told->complete = report->complete, told->points = count;
}
