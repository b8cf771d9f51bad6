#include "dynamics/continuous_motion.h"

#include <algorithm>
#include <cmath>

#include "kernels/common/union_find.h"

namespace tandem::dynamics {
namespace {

// A pair goes on beyond its impact, or deeper than it is, by at most this part of the thinner body's inner
// radius.
constexpr double kBeyond = 0.25;

// The depth of a pair that touches is measured at most this often on its way: each time that its points may
// have moved by kBeyond inner radii. It goes no farther.
constexpr double kMostSamples = 256;

// Each round stops bodies earlier, until none that has stopped is in another one's way.
constexpr int kMostRounds = 8;

Quaternion turned(const Quaternion& orientation, const Vector3& turn) {
  return normalized(rotation_by(turn) * orientation);
}

}  // namespace

ContinuousMotion::ContinuousMotion(std::span<const AssetView> shapes, const Threads& threads,
                                   const PairFilter* filter)
    : filter_(filter), threads_(threads), inner_radius_(inner_radii(shapes)) {
  threads_.work_for(moving_);
  require(moving_.set_assets(shapes), moving_);
  require(two_.set_assets(shapes), two_);
}

bool ContinuousMotion::find_fast(std::span<const BodyProperties> bodies, std::span<const BodyState> before,
                                 std::span<const BodyState> after) {
  const double thinnest = thinnest_of(bodies, inner_radius_);
  fast_.assign(bodies.size(), Motion::fixed);
  turn_.resize(bodies.size());
  way_.resize(bodies.size());
  bool any = false;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    way_[i] = after[i].position - before[i].position;
    turn_[i] = turn_between(before[i].orientation, after[i].orientation);
    if (!dynamics::is_fast(bodies[i], before[i], after[i], thinnest)) continue;
    fast_[i] = Motion::moving;
    any = true;
  }
  part_.assign(bodies.size(), 1);
  held_.assign(bodies.size(), 1);
  return any;
}

// Returns how deep two bodies are in each other when they have gone this part of their ways; infinite where
// one goes through the other.
double ContinuousMotion::depth_at(std::span<const BodyProperties> bodies, std::span<const BodyState> before,
                                  const ObjectPair& pair, double part) {
  const ObjectPair pairs[] = {{0, 1}};
  Instance instances[2];
  for (int i = 0; i < 2; ++i) {
    const std::uint32_t body = i == 0 ? pair.a : pair.b;
    BodyState state = before[body];
    state.position += part * part_[body] * way_[body];
    state.orientation = turned(state.orientation, part * part_[body] * turn_[body]);
    instances[i] = pose_of(bodies[body], state);
  }
  require(two_.place(instances), two_);
  require(contacts_.find(two_, pairs, {}), two_);
  require(manifolds_.find(two_, contacts_, kManifoldsOfStep), two_);
  double depth = 0;
  for (const Manifold& manifold : manifolds_.rows())
    depth = std::max(depth, (manifold.flags & kGoesThrough) != 0 ? INFINITY : manifold.depth);
  return depth;
}

// Returns which part of their ways two bodies go until they are a slop deep in each other. What hardly closes
// slides on, as what touches already. reach: how much farther they may go unseen, a length.
double ContinuousMotion::stop_after(const Impact& impact, std::span<const BodyProperties> bodies,
                                    std::span<const BodyState> before, const ObjectPair& pair, double reach,
                                    double slop) {
  const Vector3 at_a = vector_of(impact.point_a), at_b = vector_of(impact.point_b);
  const auto velocity = [&](std::uint32_t body, const Vector3& at) {
    const RigidMotion& motion = motion_[body];
    const Vector3 v = vector_of(motion.velocity), w = vector_of(motion.angular_velocity),
                  c = vector_of(motion.centre);
    return v + cross(w, at - (c + impact.t_safe * v));
  };
  const Vector3 approach = velocity(pair.a, at_a) - velocity(pair.b, at_b), apart = at_b - at_a;
  const double closing = norm(apart) > 0 ? dot(approach, normalized(apart)) : norm(approach);
  const double unseen = impact.t_safe + reach / norm(approach);
  const double deep = closing > 0 ? impact.t_safe + (impact.gap + slop) / closing : INFINITY;
  if (deep <= unseen || unseen >= 1) return std::min({1.0, deep, unseen});
  return stop_of_touching(bodies, before, pair, unseen, reach, slop);
}

// Returns which part of their ways two bodies go that touch when they have gone a first part.
double ContinuousMotion::stop_of_touching(std::span<const BodyProperties> bodies,
                                          std::span<const BodyState> before, const ObjectPair& pair,
                                          double first, double reach, double slop) {
  const auto turned_by = [&](std::uint32_t body) {
    return bodies[body].motion == Motion::fixed ? 0 : part_[body] * bodies[body].radius * norm(turn_[body]);
  };
  const Vector3 way = part_[pair.a] * way_[pair.a] - part_[pair.b] * way_[pair.b];
  const double rest = (1 - first) * (norm(way) + turned_by(pair.a) + turned_by(pair.b));
  const double samples = std::max(1.0, std::ceil(rest / reach)), sample = (1 - first) / samples;
  const double most = std::max(depth_at(bodies, before, pair, 0), slop) + reach;
  for (double i = 1; i <= std::min(samples, kMostSamples); ++i) {
    if (depth_at(bodies, before, pair, first + i * sample) > most) return first + (i - 1) * sample;
  }
  return std::min(1.0, first + kMostSamples * sample);
}

void ContinuousMotion::find_groups(std::span<const BodyProperties> bodies,
                                   std::span<const ObjectPair> joined) {
  UnionFind sets(bodies.size());
  const auto moves = [&](std::uint32_t body) {
    return body != kNoIndex && bodies[body].motion == Motion::moving;
  };
  for (const ObjectPair& pair : joined) {
    if (moves(pair.a) && moves(pair.b)) sets.join(pair.a, pair.b);
  }
  group_.resize(bodies.size());
  for (std::uint32_t i = 0; i < group_.size(); ++i) group_[i] = sets.find(i);
}

// Result: whether a body stops earlier than it did.
bool ContinuousMotion::stop(std::span<const BodyProperties> bodies, std::span<const BodyState> before,
                            double slop) {
  instances_.resize(bodies.size());
  motion_.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    instances_[i] = pose_of(bodies[i], before[i]);
    const Vector3 way = part_[i] * way_[i], turn = part_[i] * turn_[i];
    for (int k = 0; k < 3; ++k) {
      motion_[i].velocity[k] = at(way, k);
      motion_[i].angular_velocity[k] = at(turn, k);
      motion_[i].centre[k] = at(before[i].position, k);
    }
  }
  require(moving_.place(instances_, with_motions(filter_, fast_)), moving_);
  require(query_.find(moving_, {.motion = motion_, .duration = 1, .tolerance = 1e-8}), moving_);
  stop_.assign(bodies.size(), 1);
  bool earlier = false;
  for (std::size_t i = 0; i < query_.pairs().size(); ++i) {
    const Impact& impact = query_.rows()[i];
    if (impact.status == ImpactStatus::none) continue;
    const ObjectPair& pair = query_.pairs()[i];
    const double thinner = std::min(inner_radius(bodies[pair.a]), inner_radius(bodies[pair.b]));
    const double reach = std::isfinite(thinner) ? kBeyond * thinner : slop;
    const double part = impact.status == ImpactStatus::found
                            ? stop_after(impact, bodies, before, pair, reach, slop)
                            : stop_of_touching(bodies, before, pair, 0, reach, slop);
    if (part > 1 - 1e-9) continue;
    for (const std::uint32_t body : {pair.a, pair.b}) {
      if (bodies[body].motion != Motion::moving) continue;
      double& stop = stop_[group_[body]];
      stop = std::min(stop, part);
      double& held = held_[group_[body]];
      if (impact.status != ImpactStatus::found) held = std::min(held, part);
    }
    earlier = true;
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) part_[i] *= stop_[group_[i]];
  return earlier;
}

void ContinuousMotion::limit(std::span<const BodyProperties> bodies, std::span<const ObjectPair> joined,
                             std::span<const BodyState> before, std::span<BodyState> after, double slop) {
  if (!find_fast(bodies, before, after)) return;
  find_groups(bodies, joined);
  for (int round = 0; round < kMostRounds && stop(bodies, before, slop); ++round) {
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (part_[i] == 1) continue;
    const Quaternion end = after[i].orientation;
    after[i].position = before[i].position + part_[i] * way_[i];
    after[i].orientation = turned(before[i].orientation, part_[i] * turn_[i]);
    const auto at_impact = [&](const Vector3& from, const Vector3& to) {
      return held_[group_[i]] * (from + part_[i] * (to - from));
    };
    // Spins are those in the body's frame, or a rod that turns about its axis would turn about another one.
    const Vector3 spin = at_impact(rotated(conjugated(before[i].orientation), before[i].angular_velocity),
                                   rotated(conjugated(end), after[i].angular_velocity));
    after[i].velocity = at_impact(before[i].velocity, after[i].velocity);
    after[i].angular_velocity = rotated(after[i].orientation, spin);
  }
}

}  // namespace tandem::dynamics
