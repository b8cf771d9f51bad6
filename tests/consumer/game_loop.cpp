#include <tandem/kernels/contact_query.h>
#include <tandem/kernels/manifold_query.h>
#include <tandem/runtime/map.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

// Cubes of side 1 and mass 1 fall on a floor of fixed ones, tumble and come to rest.
constexpr int kFloor = 81, kBodies = kFloor + 36;
constexpr double kStep = 1.0 / 60, kFriction = 0.6, kSlop = 0.002, kSlow = 0.05;

struct Vec {
  double x = 0, y = 0, z = 0;
  friend Vec operator+(Vec p, Vec q) { return {p.x + q.x, p.y + q.y, p.z + q.z}; }
  friend Vec operator-(Vec p, Vec q) { return {p.x - q.x, p.y - q.y, p.z - q.z}; }
  friend Vec operator*(double s, Vec p) { return {s * p.x, s * p.y, s * p.z}; }
  friend double dot(Vec p, Vec q) { return p.x * q.x + p.y * q.y + p.z * q.z; }
  friend Vec cross(Vec p, Vec q) {
    return {p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
  }
  friend double norm(Vec p) { return std::sqrt(dot(p, p)); }
  friend Vec unit(Vec p) { return (1 / norm(p)) * p; }
  static Vec of(const double (&p)[3]) { return {p[0], p[1], p[2]}; }
};

struct Body {
  double by_mass = 0;  // 0: nothing moves it. A cube's inertia is a sixth of its mass about every axis
  Vec velocity = {}, spin = {};
  int calm_steps = 0;
  double yield(Vec arm, Vec n) const { return by_mass * (1 + 6 * dot(cross(arm, n), cross(arm, n))); }
  Vec speed_at(Vec arm) const { return velocity + cross(spin, arm); }
  void push(Vec arm, Vec p) { velocity = velocity + by_mass * p, spin = spin + 6 * by_mass * cross(arm, p); }
};

struct Touch {  // what a solver keeps of a manifold's point
  Body *a, *b;
  Vec normal, arm_a, arm_b;
  double mass = 0, leaving = 0, push = 0;  // along the normal: resistance, speed wanted, impulse
  Vec drag = {};                           // the impulse of friction
  void apply(Vec impulse) const { a->push(arm_a, -1 * impulse), b->push(arm_b, impulse); }
};

void solve(std::vector<Touch>& touches) {  // a sweep of sequential impulses
  for (Touch& t : touches) {
    const Vec speed = t.b->speed_at(t.arm_b) - t.a->speed_at(t.arm_a);
    const double along = dot(speed, t.normal), push = std::max(0.0, t.push + t.mass * (t.leaving - along));
    Vec drag = t.drag - t.mass * (speed - along * t.normal);
    if (norm(drag) > kFriction * push) drag = (kFriction * push / norm(drag)) * drag;
    t.apply((push - t.push) * t.normal + drag - t.drag);
    t.push = push, t.drag = drag;
  }
}

void move(tandem::Pose& pose, const Body& body) {
  double(&r)[3][3] = pose.rotation, (&x)[3] = pose.translation;
  Vec u = {r[0][0], r[1][0], r[2][0]}, v = {r[0][1], r[1][1], r[2][1]};
  u = unit(u + kStep * cross(body.spin, u)), v = v + kStep * cross(body.spin, v), v = unit(v - dot(u, v) * u);
  const Vec axes[3] = {u, v, cross(u, v)}, to = Vec::of(x) + kStep * body.velocity;
  for (int k = 0; k < 3; ++k) r[0][k] = axes[k].x, r[1][k] = axes[k].y, r[2][k] = axes[k].z;
  x[0] = to.x, x[1] = to.y, x[2] = to.z;
}

int main(int, char** argv) {
  using tandem::Motion, tandem::Status;
  tandem::MappedAsset cube;
  tandem::Scene scene;
  tandem::ContactQuery query;
  tandem::ManifoldQuery manifolds;
  if (cube.open(argv[1]) != Status::kOk) return std::printf("%s cannot be read\n", argv[1]), 1;
  const tandem::AssetView assets[] = {cube.view()};
  if (scene.set_assets(assets) != Status::kOk) return 1;
  std::vector<tandem::Instance> poses(kBodies, {0, tandem::kIdentityPose});
  std::vector<Body> bodies(kBodies);
  std::vector<Motion> motion(kBodies, Motion::fixed);
  for (int i = 0; i < kBodies; ++i) {
    const int k = i - kFloor;
    double(&x)[3] = poses[i].pose.translation;
    x[0] = k < 0 ? i % 9 - 4 : 1.1 * (k % 3) - 1.1 + 0.02 * (k % 7);
    x[1] = k < 0 ? i / 9 - 4 : 1.1 * (k / 3 % 3) - 1.1 + 0.03 * (k % 5);
    x[2] = k < 0 ? -0.5 : 0.6 + 1.2 * (k / 9);
    if (k >= 0) motion[i] = Motion::moving, bodies[i] = {1, {}, {k % 5 - 2.0, k % 3 - 1.0, 0}};
  }
  const tandem::PairFilter filter = {.motion = motion.data()};
  std::vector<Touch> touches, before;
  for (int step = 1; step <= 1200; ++step) {
    for (Body& body : bodies) body.velocity.z -= 9.81 * kStep * body.by_mass;  // of mass 1, or none
    if (scene.place(poses, filter) != Status::kOk || query.find(scene) != Status::kOk) return 1;
    if (manifolds.find(scene, query) != Status::kOk) return 1;
    std::swap(touches, before), touches.clear();
    double deepest = 0;
    for (const tandem::ManifoldPoint& p : manifolds.points()) {
      const auto [i, j] = query.pairs()[manifolds.rows()[p.manifold].pair];
      Body &a = bodies[i], &b = bodies[j];
      for (const std::uint32_t k : {i, j})  // who is hit wakes
        if (motion[k] == Motion::sleeping && norm(bodies[i + j - k].velocity) > 4 * kSlow)
          motion[k] = Motion::moving, bodies[k].by_mass = 1;
      const Vec n = Vec::of(p.normal), x = Vec::of(p.position);
      Touch t = {&a, &b, n, x - Vec::of(poses[i].pose.translation), x - Vec::of(poses[j].pose.translation)};
      t.mass = 1 / (a.yield(t.arm_a, n) + b.yield(t.arm_b, n));
      t.leaving = 0.2 / kStep * std::max(0.0, p.depth - kSlop);
      deepest = std::max(deepest, p.depth);
      if (p.previous != tandem::kNoIndex) t.push = before[p.previous].push, t.drag = before[p.previous].drag;
      touches.emplace_back(t).apply(t.push * n + t.drag);  // as in the step before
    }
    for (int sweep = 0; sweep < 20; ++sweep) solve(touches);
    for (int i = kFloor; i < kBodies; ++i) {
      const double speed = norm(bodies[i].velocity) + norm(bodies[i].spin);
      bodies[i].calm_steps = speed < kSlow ? bodies[i].calm_steps + 1 : 0;
      if (bodies[i].calm_steps == 30) motion[i] = Motion::sleeping, bodies[i] = {};
      if (motion[i] == Motion::moving) move(poses[i].pose, bodies[i]);
    }
    if (step % 60 == 0)
      std::printf("%d s: %zu points, %.1f mm deep\n", step / 60, touches.size(), 1e3 * deepest);
    const auto asleep = std::count(motion.begin(), motion.end(), Motion::sleeping);
    if (asleep == kBodies - kFloor) return std::printf("all are asleep after %d steps\n", step), 0;
  }
  return std::puts("the cubes do not come to rest"), 1;
}
