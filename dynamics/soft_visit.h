#pragma once
#include <cstring>

#include "dynamics/soft_rows.h"

#ifdef __CUDACC__
#define TANDEM_INLINE TANDEM_HD inline
#else
#include "kernels/common/lanes.h"
#ifndef TANDEM_INLINE
#define TANDEM_INLINE inline
#endif
#endif

// What a soft step does with a pair of bodies, by L: OneLane, for host and device, or Lanes of a kind. As
// lanes.h, this is included by files that are compiled for different machines: all of it has internal
// linkage.
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
  // One number is no copy of bytes, which a GPU would make byte by byte.
  if constexpr (L::kLanes == 1)
    out.v = from.of[lane];
  else
    std::memcpy(&out.v, from.of + lane, sizeof out.v);
  return out;
}

template <typename L>
TANDEM_INLINE void put(const L& x, SoftNumber& to, int lane) {
  if constexpr (L::kLanes == 1)
    to.of[lane] = x.v;
  else
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
// The bodies of as many pairs as there are lanes, from `lane` on.
template <typename L>
class PairVisit {
 public:
  TANDEM_INLINE PairVisit(const SoftRows& rows, std::uint32_t group, int lane)
      : rows_(rows),
        pairs_(rows.pairs[group]),
        turning_(rows.turnings[group]),
        lane_(lane),
        first_(pairs_.first),
        contacts_(pairs_.contacts),
        bounces_(pairs_.bounces != 0),
        is_opposed_(pairs_.is_opposed != 0),
        inverse_mass_a_(taken<L>(pairs_.inverse_mass_a, lane)),
        inverse_mass_b_(taken<L>(pairs_.inverse_mass_b, lane)) {}

  /// Begins the visit with how the bodies move.
  TANDEM_INLINE void begin(const MotionOf<L>& a, const MotionOf<L>& b) { a_ = a, b_ = b; }
  TANDEM_INLINE const MotionOf<L>& a() const { return a_; }
  TANDEM_INLINE const MotionOf<L>& b() const { return b_; }

  TANDEM_INLINE void start() {
    for (std::uint32_t i = 0; i < contacts_; ++i) {
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
    for_normals([&](std::uint32_t i, const NormalRow& row) {
      const L deep = smaller(none, is_opposed_ ? row.followed + take(gap(i).opposed) : row.followed);
      const auto is_gap = less(none, row.followed);
      const L bias = select(is_gap, row.followed * inverse_h, larger(bias_rate * deep, fastest));
      visit(i, row, bias, select(is_gap, one, mass_scale), select(is_gap, none, impulse_scale));
    });
  }

  // a, b: how far the bodies have moved at this time.
  TANDEM_INLINE void follow(float time, const MotionOf<L>& a, const MotionOf<L>& b) {
    for (std::uint32_t i = 0; i < contacts_; ++i) {
      SoftNormal& row = normal(i);
      const Direction along = direction(row.direction);
      put(take(gap(i).separation) + speed(along, a, b) + time * take(row.drive), row.followed, lane_);
    }
  }

  TANDEM_INLINE void relax() {
    const L none{}, one = all_of<L>(1), inverse_h = all_of<L>(rows_.inverse_h);
    for_normals([&](std::uint32_t i, const NormalRow& row) {
      visit(i, row, larger(none, row.followed * inverse_h), one, none);
    });
  }

  // Friction that was 0 stays 0 while nothing pushes.
  TANDEM_INLINE void rub() {
    const L none{};
    L all{};
    for (std::uint32_t i = 0; i < contacts_; ++i) {
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
    for (std::uint32_t i = 0; i < contacts_; ++i) {
      const NormalRow row = normal_row(i);
      const L wanted = take(gap(i).rebound);
      const L next = next_impulse(row, -wanted, one, none);
      const L change = select(less(none, wanted),
                              select(less(none, take(gap(i).strongest)), next - row.impulse, none), none);
      push(row.along, change);
      put(row.impulse + change, normal(i).impulse, lane_);
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
    for (std::uint32_t i = 0; i < contacts_; ++i) {
      const NormalRow row = normal_row(i);
      const L old = row.impulse, rebound = take(gap(i).rebound);
      const auto bounces = less(none, smaller(rebound, take(gap(i).strongest)));
      const L bias = select(bounces, -rebound, larger(none, row.followed * inverse_h));
      add(next_impulse(row, bias, all_of<L>(1), none) - old, row.mass);
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
  struct NormalRow {
    Direction along;
    L mass, drive, followed, impulse;
  };

  TANDEM_INLINE NormalRow normal_row(std::uint32_t contact) const {
    const SoftNormal& row = normal(contact);
    return {direction(row.direction), take(row.mass), take(row.drive), take(row.followed), take(row.impulse)};
  }

  // Calls visit(i, row) for each contact. One lane reads the next row before it visits one: a GPU solves
  // while it waits for memory.
  template <typename Visit>
  TANDEM_INLINE void for_normals(const Visit& visit) const {
    if constexpr (L::kLanes > 1) {
      for (std::uint32_t i = 0; i < contacts_; ++i) visit(i, normal_row(i));
    } else {
      NormalRow next = normal_row(0);
      for (std::uint32_t i = 0; i < contacts_; ++i) {
        const NormalRow row = next;
        if (i + 1 < contacts_) next = normal_row(i + 1);
        visit(i, row);
      }
    }
  }

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
  TANDEM_INLINE SoftNormal& normal(std::uint32_t contact) const { return rows_.normals[first_ + contact]; }
  TANDEM_INLINE SoftGap& gap(std::uint32_t contact) const { return rows_.gaps[first_ + contact]; }
  TANDEM_INLINE SoftFriction& friction(std::uint32_t contact) const {
    return rows_.frictions[first_ + contact];
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

  TANDEM_INLINE L next_impulse(const NormalRow& row, const L& bias, const L& mass_scale,
                               const L& impulse_scale) const {
    const L w = speed(row.along) + row.drive;
    const L wanted = row.impulse - row.mass * mass_scale * (w + bias) - impulse_scale * row.impulse;
    return larger(L{}, wanted);
  }
  TANDEM_INLINE void visit(std::uint32_t contact, const NormalRow& row, const L& bias, const L& mass_scale,
                           const L& impulse_scale) {
    const L next = next_impulse(row, bias, mass_scale, impulse_scale);
    push(row.along, next - row.impulse);
    put(next, normal(contact).impulse, lane_);
    if (bounces_) put(larger(take(gap(contact).strongest), next), gap(contact).strongest, lane_);
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
  std::uint32_t first_, contacts_;
  bool bounces_, is_opposed_;
  L inverse_mass_a_, inverse_mass_b_;
  MotionOf<L> a_, b_;
};

}  // namespace
}  // namespace tandem::dynamics
