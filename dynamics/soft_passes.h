#pragma once
#include <cstring>

#include "dynamics/soft_rows.h"
#include "kernels/common/lanes.h"

#ifndef TANDEM_INLINE
#define TANDEM_INLINE inline
#endif

// The passes of a soft step by L: OneLane of soft_passes.cpp, or Lanes of a kind. As lanes.h, this is
// included by files that are compiled for different machines: all of it has internal linkage.
namespace tandem::dynamics {
namespace {

constexpr float kFastestPush = 3;  // m/s

template <typename L>
TANDEM_INLINE L all_of(float x) {
  return L{} + x;
}

template <typename L>
TANDEM_INLINE L taken(const SoftNumber& from, int lane) {
  L out;
  std::memcpy(&out.v, from.of + lane, sizeof out.v);
  return out;
}

template <typename L>
TANDEM_INLINE void put(const L& x, SoftNumber& to, int lane) {
  std::memcpy(to.of + lane, &x.v, sizeof x.v);
}

template <typename L>
TANDEM_INLINE L smaller(const L& a, const L& b) {
  return select(less(b, a), b, a);
}

template <typename L>
struct Vector3Of {
  L x, y, z;

  TANDEM_INLINE friend Vector3Of operator+(const Vector3Of& p, const Vector3Of& q) {
    return {p.x + q.x, p.y + q.y, p.z + q.z};
  }
  TANDEM_INLINE friend Vector3Of operator-(const Vector3Of& p, const Vector3Of& q) {
    return {p.x - q.x, p.y - q.y, p.z - q.z};
  }
  TANDEM_INLINE friend Vector3Of operator*(const L& s, const Vector3Of& p) {
    return {s * p.x, s * p.y, s * p.z};
  }
  TANDEM_INLINE friend L dot(const Vector3Of& p, const Vector3Of& q) {
    return p.x * q.x + p.y * q.y + p.z * q.z;
  }
  TANDEM_INLINE friend Vector3Of cross(const Vector3Of& p, const Vector3Of& q) {
    return {p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
  }
};

template <typename L>
TANDEM_INLINE Vector3Of<L> taken(const SoftNumber (&from)[3], int lane) {
  return {taken<L>(from[0], lane), taken<L>(from[1], lane), taken<L>(from[2], lane)};
}

template <typename L>
TANDEM_INLINE void put(const Vector3Of<L>& p, SoftNumber (&to)[3], int lane) {
  put(p.x, to[0], lane), put(p.y, to[1], lane), put(p.z, to[2], lane);
}

/// Says how the body of each lane moves.
template <typename L>
struct MotionOf {
  Vector3Of<L> centre, spin;
};

// gather() reads the motions of bodies, and scatter() writes them back.
#ifdef TANDEM_HAVE_LANES
TANDEM_INLINE Vector3Of<Lanes4> columns(const Lanes4& a, const Lanes4& b, const Lanes4& c, const Lanes4& d) {
  Lanes4 rows[4] = {a, b, c, d};
  transpose(rows);
  return {rows[0], rows[1], rows[2]};
}

TANDEM_INLINE MotionOf<Lanes4> gather(const SoftMotion* of, const std::uint32_t* body, Lanes4) {
  const SoftMotion &a = of[body[0]], &b = of[body[1]], &c = of[body[2]], &d = of[body[3]];
  return {columns(load(a.centre), load(b.centre), load(c.centre), load(d.centre)),
          columns(load(a.spin), load(b.spin), load(c.spin), load(d.spin))};
}
TANDEM_INLINE void scatter(const MotionOf<Lanes4>& from, SoftMotion* of, const std::uint32_t* body) {
  Lanes4 centres[4] = {from.centre.x, from.centre.y, from.centre.z, Lanes4{}};
  Lanes4 spins[4] = {from.spin.x, from.spin.y, from.spin.z, Lanes4{}};
  transpose(centres), transpose(spins);
  for (int i = 0; i < 4; ++i) {
    std::memcpy(of[body[i]].centre, &centres[i].v, sizeof centres[i].v);
    std::memcpy(of[body[i]].spin, &spins[i].v, sizeof spins[i].v);
  }
}

// Turns four motions into their x, y and z: those of centres in the low half, those of spins in the high one.
TANDEM_INLINE void transpose_halves(Lanes<8> (&rows)[4]) {
  const auto low01 = __builtin_shufflevector(rows[0].v, rows[1].v, 0, 8, 1, 9, 4, 12, 5, 13);
  const auto high01 = __builtin_shufflevector(rows[0].v, rows[1].v, 2, 10, 3, 11, 6, 14, 7, 15);
  const auto low23 = __builtin_shufflevector(rows[2].v, rows[3].v, 0, 8, 1, 9, 4, 12, 5, 13);
  const auto high23 = __builtin_shufflevector(rows[2].v, rows[3].v, 2, 10, 3, 11, 6, 14, 7, 15);
  rows[0].v = __builtin_shufflevector(low01, low23, 0, 1, 8, 9, 4, 5, 12, 13);
  rows[1].v = __builtin_shufflevector(low01, low23, 2, 3, 10, 11, 6, 7, 14, 15);
  rows[2].v = __builtin_shufflevector(high01, high23, 0, 1, 8, 9, 4, 5, 12, 13);
  rows[3].v = __builtin_shufflevector(high01, high23, 2, 3, 10, 11, 6, 7, 14, 15);
}
TANDEM_INLINE Lanes<8> low_halves(const Lanes<8>& a, const Lanes<8>& b) {
  return {__builtin_shufflevector(a.v, b.v, 0, 1, 2, 3, 8, 9, 10, 11)};
}
TANDEM_INLINE Lanes<8> high_halves(const Lanes<8>& a, const Lanes<8>& b) {
  return {__builtin_shufflevector(a.v, b.v, 4, 5, 6, 7, 12, 13, 14, 15)};
}

TANDEM_INLINE MotionOf<Lanes<8>> gather(const SoftMotion* of, const std::uint32_t* body, Lanes<8>) {
  Lanes<8> rows[2][4];
  for (int i = 0; i < 8; ++i) std::memcpy(&rows[i / 4][i % 4].v, &of[body[i]], sizeof(SoftMotion));
  transpose_halves(rows[0]), transpose_halves(rows[1]);
  const auto &p = rows[0], &q = rows[1];
  return {{low_halves(p[0], q[0]), low_halves(p[1], q[1]), low_halves(p[2], q[2])},
          {high_halves(p[0], q[0]), high_halves(p[1], q[1]), high_halves(p[2], q[2])}};
}
TANDEM_INLINE void scatter(const MotionOf<Lanes<8>>& from, SoftMotion* of, const std::uint32_t* body) {
  const auto &p = from.centre, &q = from.spin;
  Lanes<8> rows[2][4] = {{low_halves(p.x, q.x), low_halves(p.y, q.y), low_halves(p.z, q.z), {}},
                         {high_halves(p.x, q.x), high_halves(p.y, q.y), high_halves(p.z, q.z), {}}};
  transpose_halves(rows[0]), transpose_halves(rows[1]);
  for (int i = 0; i < 8; ++i) std::memcpy(&of[body[i]], &rows[i / 4][i % 4].v, sizeof(SoftMotion));
}

TANDEM_INLINE Lanes<16> joined(const Lanes<8>& low, const Lanes<8>& high) {
  return {__builtin_shufflevector(low.v, high.v, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)};
}
TANDEM_INLINE Vector3Of<Lanes<16>> joined(const Vector3Of<Lanes<8>>& low, const Vector3Of<Lanes<8>>& high) {
  return {joined(low.x, high.x), joined(low.y, high.y), joined(low.z, high.z)};
}
template <int kFirst>
TANDEM_INLINE Lanes<8> half_of(const Lanes<16>& x) {
  return {__builtin_shufflevector(x.v, x.v, kFirst, kFirst + 1, kFirst + 2, kFirst + 3, kFirst + 4,
                                  kFirst + 5, kFirst + 6, kFirst + 7)};
}
template <int kFirst>
TANDEM_INLINE Vector3Of<Lanes<8>> half_of(const Vector3Of<Lanes<16>>& p) {
  return {half_of<kFirst>(p.x), half_of<kFirst>(p.y), half_of<kFirst>(p.z)};
}

TANDEM_INLINE MotionOf<Lanes<16>> gather(const SoftMotion* of, const std::uint32_t* body, Lanes<16>) {
  const auto low = gather(of, body, Lanes<8>{}), high = gather(of, body + 8, Lanes<8>{});
  return {joined(low.centre, high.centre), joined(low.spin, high.spin)};
}
TANDEM_INLINE void scatter(const MotionOf<Lanes<16>>& from, SoftMotion* of, const std::uint32_t* body) {
  scatter(MotionOf<Lanes<8>>{half_of<0>(from.centre), half_of<0>(from.spin)}, of, body);
  scatter(MotionOf<Lanes<8>>{half_of<8>(from.centre), half_of<8>(from.spin)}, of, body + 8);
}
#endif

// The bodies of as many pairs as there are lanes, from `lane` on.
template <typename L>
class PairVisit {
 public:
  TANDEM_INLINE PairVisit(const SoftRows& rows, std::uint32_t group, int lane)
      : PairVisit(rows, rows.pairs[group], rows.turnings[group], lane) {}

 private:
  TANDEM_INLINE PairVisit(const SoftRows& rows, SoftPairs& pairs, SoftTurning& turning, int lane)
      : rows_(rows),
        pairs_(pairs),
        turning_(turning),
        lane_(lane),
        a_(gather(rows.velocities, pairs.body_a + lane, L{})),
        b_(gather(rows.velocities, pairs.body_b + lane, L{})),
        inverse_mass_a_(taken<L>(pairs.inverse_mass_a, lane)),
        inverse_mass_b_(taken<L>(pairs.inverse_mass_b, lane)) {}

 public:
  TANDEM_INLINE void write() const {
    scatter(a_, rows_.velocities, pairs_.body_a + lane_);
    scatter(b_, rows_.velocities, pairs_.body_b + lane_);
  }

  TANDEM_INLINE void start() {
    for (std::uint32_t i = 0; i < pairs_.contacts; ++i) {
      SoftFriction& row = friction(i);
      make_rows(normal(i), row);
      push(direction(normal(i).direction), take(normal(i).impulse));
      push(direction(row.first), take(row.first_impulse));
      push(direction(row.second), take(row.second_impulse));
    }
    turn(taken<L>(turning_.impulse, lane_));
  }

  TANDEM_INLINE void push_apart() {
    const L none{}, one = all_of<L>(1), inverse_h = all_of<L>(rows_.inverse_h);
    const L fastest = all_of<L>(-kFastestPush);
    const L bias_rate = take(pairs_.bias_rate), mass_scale = take(pairs_.mass_scale),
            impulse_scale = take(pairs_.impulse_scale);
    for (std::uint32_t i = 0; i < pairs_.contacts; ++i) {
      SoftNormal& row = normal(i);
      const L followed = take(row.followed);
      const L deep = smaller(none, pairs_.is_opposed ? followed + take(gap(i).opposed) : followed);
      const auto is_gap = less(none, followed);
      const L bias = select(is_gap, followed * inverse_h, larger(bias_rate * deep, fastest));
      visit(i, bias, select(is_gap, one, mass_scale), select(is_gap, none, impulse_scale));
    }
  }

  // Condition: rows.moved is that of this time.
  TANDEM_INLINE void follow(float time) {
    const auto a = gather(rows_.moved, pairs_.body_a + lane_, L{}),
               b = gather(rows_.moved, pairs_.body_b + lane_, L{});
    for (std::uint32_t i = 0; i < pairs_.contacts; ++i) {
      SoftNormal& row = normal(i);
      const Direction along = direction(row.direction);
      put(take(gap(i).separation) + speed(along, a, b) + time * take(row.drive), row.followed, lane_);
    }
  }

  TANDEM_INLINE void relax() {
    const L none{}, one = all_of<L>(1), inverse_h = all_of<L>(rows_.inverse_h);
    for (std::uint32_t i = 0; i < pairs_.contacts; ++i)
      visit(i, larger(none, take(normal(i).followed) * inverse_h), one, none);
  }

  // Friction that was 0 stays 0 while nothing pushes.
  TANDEM_INLINE void rub() {
    const L none{};
    L all{};
    for (std::uint32_t i = 0; i < pairs_.contacts; ++i) {
      SoftFriction& row = friction(i);
      const L push = take(normal(i).impulse);
      all = all + push;
      const L before = larger(magnitude(take(row.first_impulse)), magnitude(take(row.second_impulse)));
      if (any(less(none, larger(push, before)))) rub(row, push);
    }
    const Vector3Of<L> turning = taken<L>(turning_.impulse, lane_);
    if (any(less(none, larger(all, dot(turning, turning))))) resist_turning(all);
  }

  TANDEM_INLINE void rebound() {
    const L none{}, one = all_of<L>(1);
    for (std::uint32_t i = 0; i < pairs_.contacts; ++i) {
      SoftNormal& row = normal(i);
      const L wanted = take(gap(i).rebound);
      const L old = take(row.impulse);
      const Direction along = direction(row.direction);
      const L next = next_impulse(row, along, old, -wanted, one, none);
      const L change =
          select(less(none, wanted), select(less(none, take(gap(i).strongest)), next - old, none), none);
      push(along, change);
      put(old + change, row.impulse, lane_);
      put(take(friction(i).sum_of_normal) + change, friction(i).sum_of_normal, lane_);
    }
  }

  // Finds what another visit of the rows would change.
  TANDEM_INLINE void judge() {
    const L none{}, inverse_h = all_of<L>(rows_.inverse_h);
    L largest{}, squares{};
    const auto add = [&](const L& change, const L& mass) {
      const L size =
          select(less(none, mass), magnitude(change) / select(less(none, mass), mass, all_of<L>(1)), none);
      largest = larger(largest, size);
      squares = squares + size * size;
    };
    for (std::uint32_t i = 0; i < pairs_.contacts; ++i) {
      const SoftNormal& row = normal(i);
      const L old = take(row.impulse), rebound = take(gap(i).rebound);
      const auto bounces = less(none, smaller(rebound, take(gap(i).strongest)));
      const L bias = select(bounces, -rebound, larger(none, take(row.followed) * inverse_h));
      add(next_impulse(row, direction(row.direction), old, bias, all_of<L>(1), none) - old, take(row.mass));
      const SoftFriction& rubs = friction(i);
      const L bound = take(rubs.coefficient) * old, mass = take(rubs.mass);
      const L old1 = take(rubs.first_impulse), old2 = take(rubs.second_impulse);
      const L wanted1 = old1 - mass * (speed(direction(rubs.first)) + take(rubs.first_drive));
      const L wanted2 = old2 - mass * (speed(direction(rubs.second)) + take(rubs.second_drive));
      add(within(wanted1, rest_of(bound, old2)) - old1, mass);
      add(within(wanted2, rest_of(bound, old1)) - old2, mass);
    }
    put(largest, pairs_.largest_residual, lane_);
    put(squares, pairs_.residual_squares, lane_);
  }

 private:
  struct Direction {
    Vector3Of<L> along, turn_a, turn_b;
  };

  // See SoftNormal. One mass does for both directions of friction, or it would not oppose the slip.
  TANDEM_INLINE void make_rows(SoftNormal& normal, SoftFriction& friction) const {
    const Vector3Of<L> arm_a = taken<L>(normal.direction.turn_a, lane_),
                       arm_b = taken<L>(normal.direction.turn_b, lane_);
    const Vector3Of<L> velocity = taken<L>(friction.first.turn_a, lane_),
                       impulse = taken<L>(friction.second.turn_a, lane_);
    const L exists = take(normal.mass);
    const L along_normal = make_turns(normal.direction, arm_a, arm_b);
    const L along_first = make_turns(friction.first, arm_a, arm_b),
            along_second = make_turns(friction.second, arm_a, arm_b);
    const auto inverse = [&](const L& mobility) {
      return exists / select(less(L{}, mobility), mobility, all_of<L>(1));
    };
    put(inverse(along_normal), normal.mass, lane_);
    put(inverse(larger(along_first, along_second)), friction.mass, lane_);
    const auto along = [&](const SoftDirection& direction, const Vector3Of<L>& p) {
      return dot(taken<L>(direction.along, lane_), p);
    };
    put(along(normal.direction, velocity), normal.drive, lane_);
    put(along(friction.first, velocity), friction.first_drive, lane_);
    put(along(friction.second, velocity), friction.second_drive, lane_);
    put(along(friction.first, impulse), friction.first_impulse, lane_);
    put(along(friction.second, impulse), friction.second_impulse, lane_);
  }

  // Result: by how much an impulse of 1 changes the velocity along the direction.
  TANDEM_INLINE L make_turns(SoftDirection& direction, const Vector3Of<L>& arm_a,
                             const Vector3Of<L>& arm_b) const {
    const Vector3Of<L> along = taken<L>(direction.along, lane_);
    const Vector3Of<L> turn_a = across(turning_.spread_a, cross(along, arm_a)),
                       turn_b = across(turning_.spread_b, cross(arm_b, along));
    put(turn_a, direction.turn_a, lane_), put(turn_b, direction.turn_b, lane_);
    return inverse_mass_a_ + inverse_mass_b_ + dot(turn_a, turn_a) + dot(turn_b, turn_b);
  }

  TANDEM_INLINE L take(const SoftNumber& from) const { return taken<L>(from, lane_); }
  TANDEM_INLINE Direction direction(const SoftDirection& from) const {
    return {taken<L>(from.along, lane_), taken<L>(from.turn_a, lane_), taken<L>(from.turn_b, lane_)};
  }
  TANDEM_INLINE SoftNormal& normal(std::uint32_t contact) const {
    return rows_.normals[pairs_.first + contact];
  }
  TANDEM_INLINE SoftGap& gap(std::uint32_t contact) const { return rows_.gaps[pairs_.first + contact]; }
  TANDEM_INLINE SoftFriction& friction(std::uint32_t contact) const {
    return rows_.frictions[pairs_.first + contact];
  }

  TANDEM_INLINE static L speed(const Direction& d, const MotionOf<L>& a, const MotionOf<L>& b) {
    return dot(d.along, b.centre - a.centre) + dot(d.turn_a, a.spin) + dot(d.turn_b, b.spin);
  }
  TANDEM_INLINE L speed(const Direction& d) const { return speed(d, a_, b_); }
  TANDEM_INLINE void push(const Direction& d, const L& impulse) {
    a_.centre = a_.centre - (impulse * inverse_mass_a_) * d.along;
    b_.centre = b_.centre + (impulse * inverse_mass_b_) * d.along;
    a_.spin = a_.spin + impulse * d.turn_a;
    b_.spin = b_.spin + impulse * d.turn_b;
  }

  TANDEM_INLINE L next_impulse(const SoftNormal& row, const Direction& along, const L& impulse, const L& bias,
                               const L& mass_scale, const L& impulse_scale) const {
    const L w = speed(along) + take(row.drive);
    const L wanted = impulse - take(row.mass) * mass_scale * (w + bias) - impulse_scale * impulse;
    return larger(L{}, wanted);
  }
  TANDEM_INLINE void visit(std::uint32_t contact, const L& bias, const L& mass_scale,
                           const L& impulse_scale) {
    SoftNormal& row = normal(contact);
    const L impulse = take(row.impulse);
    const Direction along = direction(row.direction);
    const L next = next_impulse(row, along, impulse, bias, mass_scale, impulse_scale);
    push(along, next - impulse);
    put(next, row.impulse, lane_);
    if (pairs_.bounces) put(larger(take(gap(contact).strongest), next), gap(contact).strongest, lane_);
  }

  TANDEM_INLINE void rub(SoftFriction& row, const L& push_of_normal) {
    const L bound = take(row.coefficient) * push_of_normal, mass = take(row.mass);
    const Direction first = direction(row.first), second = direction(row.second);
    const L old1 = take(row.first_impulse), old2 = take(row.second_impulse);
    L next1 = old1 - mass * (speed(first) + take(row.first_drive));
    L next2 = old2 - mass * (speed(second) + take(row.second_drive));
    const L size = square_root(next1 * next1 + next2 * next2);
    const L part = shortening(size, bound);
    next1 = part * next1, next2 = part * next2;
    push(first, next1 - old1);
    push(second, next2 - old2);
    put(next1, row.first_impulse, lane_);
    put(next2, row.second_impulse, lane_);
    put(take(row.sum_of_normal) + push_of_normal, row.sum_of_normal, lane_);
    put(take(row.sum_of_first) + next1, row.sum_of_first, lane_);
    put(take(row.sum_of_second) + next2, row.sum_of_second, lane_);
  }

  // Makes what is longer than the bound as long as it.
  TANDEM_INLINE static L shortening(const L& size, const L& bound) {
    const L one = all_of<L>(1);
    return select(less(bound, size), bound / select(less(bound, size), size, one), one);
  }

  // A row of friction has what the other leaves of the cone.
  TANDEM_INLINE static L rest_of(const L& bound, const L& other) {
    return square_root(larger(L{}, bound * bound - other * other));
  }
  TANDEM_INLINE static L within(const L& x, const L& bound) { return larger(-bound, smaller(x, bound)); }

  TANDEM_INLINE void turn(const Vector3Of<L>& impulse) {
    a_.spin = a_.spin - across(turning_.spread_a, impulse);
    b_.spin = b_.spin + across(turning_.spread_b, impulse);
  }
  TANDEM_INLINE Vector3Of<L> row(const SoftNumber* matrix, int i) const {
    return {take(matrix[3 * i]), take(matrix[3 * i + 1]), take(matrix[3 * i + 2])};
  }
  TANDEM_INLINE Vector3Of<L> across(const SoftNumber* matrix, const Vector3Of<L>& p) const {
    return p.x * row(matrix, 0) + p.y * row(matrix, 1) + p.z * row(matrix, 2);
  }
  TANDEM_INLINE Vector3Of<L> applied(const SoftNumber* matrix, const Vector3Of<L>& p) const {
    return {dot(row(matrix, 0), p), dot(row(matrix, 1), p), dot(row(matrix, 2), p)};
  }

  TANDEM_INLINE void resist_turning(const L& push_of_normals) {
    const L bound = take(turning_.lever) * push_of_normals, mass = take(turning_.mass);
    const Vector3Of<L> turning = applied(turning_.spread_b, b_.spin) - applied(turning_.spread_a, a_.spin) +
                                 taken<L>(turning_.drive, lane_);
    const Vector3Of<L> old = taken<L>(turning_.impulse, lane_);
    Vector3Of<L> next = old - mass * turning;
    next = shortening(square_root(dot(next, next)), bound) * next;
    turn(next - old);
    put(next.x, turning_.impulse[0], lane_);
    put(next.y, turning_.impulse[1], lane_);
    put(next.z, turning_.impulse[2], lane_);
  }

  const SoftRows& rows_;
  SoftPairs& pairs_;
  SoftTurning& turning_;
  int lane_;
  MotionOf<L> a_, b_;
  L inverse_mass_a_, inverse_mass_b_;
};

template <typename L, typename Visit>
TANDEM_INLINE void visit_all(const SoftRows& rows, std::uint32_t begin, std::uint32_t end,
                             const Visit& visit) {
  for (std::uint32_t i = begin; i < end; ++i) {
    for (int lane = 0; lane < static_cast<int>(rows.pairs[i].pairs); lane += L::kLanes) {
      PairVisit<L> bodies(rows, i, lane);
      visit(bodies);
      bodies.write();
    }
  }
}

template <typename L>
constexpr SoftPasses kSoftPassesOf = {
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float) {
      visit_all<L>(rows, begin, end, [](PairVisit<L>& visit) { visit.start(); });
    },
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float) {
      visit_all<L>(rows, begin, end, [](PairVisit<L>& visit) { visit.push_apart(); });
    },
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float time) {
      visit_all<L>(rows, begin, end, [&](PairVisit<L>& visit) { visit.follow(time), visit.relax(); });
    },
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float) {
      visit_all<L>(rows, begin, end, [](PairVisit<L>& visit) { visit.relax(); });
    },
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float) {
      visit_all<L>(rows, begin, end, [](PairVisit<L>& visit) { visit.rub(); });
    },
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float) {
      for (std::uint32_t i = begin; i < end; ++i) {
        if (rows.pairs[i].bounces) visit_all<L>(rows, i, i + 1, [](PairVisit<L>& visit) { visit.rebound(); });
      }
    },
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float) {
      visit_all<L>(rows, begin, end, [](PairVisit<L>& visit) { visit.judge(); });
    }};

}  // namespace
}  // namespace tandem::dynamics
