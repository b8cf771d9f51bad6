#pragma once
#include <cstring>

#include "dynamics/soft_rows.h"

#ifdef __CUDACC__
#define TANDEM_INLINE TANDEM_HD inline
#define TANDEM_UNROLL _Pragma("unroll")
#else
#define TANDEM_UNROLL
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

/// Does nothing.
struct Nothing {
  TANDEM_INLINE void operator()() const {}
};

/// The bodies of as many pairs as there are lanes, from `lane` on. A visit calls ready() when it has read all
/// that it can before it knows how the bodies move; it has begun after that.
template <typename L, bool kReadsAhead = false>
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

  template <typename Ready = Nothing>
  TANDEM_INLINE void start(const Ready& ready = {}) {
    const TurningRow turning = turning_row();
    for_contacts<kFrictionsAhead>(
        [&](std::uint32_t i) { return unmade_row(i); }, ready,
        [&](std::uint32_t i, const UnmadeRow& unmade) { start(i, unmade, turning); });
    turn(turning, taken<L>(turning_.impulse, lane_));
  }

  template <typename Ready = Nothing>
  TANDEM_INLINE void push_apart(const Ready& ready = {}) {
    const L none{}, one = all_of<L>(1), inverse_h = all_of<L>(rows_.inverse_h);
    const L fastest = all_of<L>(-kFastestPush);
    const L bias_rate = take(pairs_.bias_rate), mass_scale = take(pairs_.mass_scale),
            impulse_scale = take(pairs_.impulse_scale);
    struct Row {
      NormalRow normal;
      L opposed;
    };
    for_contacts<kNormalsAhead>(
        [&](std::uint32_t i) {
          return Row{normal_row(i), is_opposed_ ? take(gap(i).opposed) : none};
        },
        ready,
        [&](std::uint32_t i, const Row& row) {
          const L followed = row.normal.followed;
          const L deep = smaller(none, is_opposed_ ? followed + row.opposed : followed);
          const auto is_gap = less(none, followed);
          const L bias = select(is_gap, followed * inverse_h, larger(bias_rate * deep, fastest));
          visit(i, row.normal, bias, select(is_gap, one, mass_scale), select(is_gap, none, impulse_scale));
        });
  }

  // a, b: how far the bodies have moved at this time.
  TANDEM_INLINE void follow(float time, const MotionOf<L>& a, const MotionOf<L>& b) {
    for (std::uint32_t i = 0; i < contacts_; ++i) {
      SoftNormal& row = normal(i);
      put(followed(take(gap(i).separation), direction(row.direction), take(row.drive), time, a, b),
          row.followed, lane_);
    }
  }

  // Does follow() and relax() at once. a, b: as in follow(), once the visit is ready.
  template <typename Ready>
  TANDEM_INLINE void follow_and_relax(float time, const MotionOf<L>& a, const MotionOf<L>& b,
                                      const Ready& ready) {
    for_contacts<kNormalsAhead>([&](std::uint32_t i) { return normal_row(i, gap(i).separation); }, ready,
                                [&](std::uint32_t i, NormalRow row) {
                                  row.followed = followed(row.followed, row.along, row.drive, time, a, b);
                                  put(row.followed, normal(i).followed, lane_);
                                  relax(i, row);
                                });
  }

  template <typename Ready = Nothing>
  TANDEM_INLINE void relax(const Ready& ready = {}) {
    for_contacts<kNormalsAhead>([&](std::uint32_t i) { return normal_row(i); }, ready,
                                [&](std::uint32_t i, const NormalRow& row) { relax(i, row); });
  }

  // Friction that was 0 stays 0 while nothing pushes.
  template <typename Ready = Nothing>
  TANDEM_INLINE void rub(const Ready& ready = {}) {
    const L none{};
    L all{};
    const auto add = [&](std::uint32_t i, const Pushed& pushed, const auto& read_row) {
      all = all + pushed.normal;
      const L before = larger(magnitude(pushed.first), magnitude(pushed.second));
      if (any(less(none, larger(pushed.normal, before)))) rub(friction(i), pushed, read_row());
    };
    const auto resist = [&](const Vector3Of<L>& impulse, const auto& read_turning) {
      if (any(less(none, larger(all, dot(impulse, impulse))))) resist_turning(all, impulse, read_turning());
    };
    if constexpr (kFrictionsAhead == 1) {
      ready();
      for (std::uint32_t i = 0; i < contacts_; ++i) add(i, pushed(i), [&] { return friction_row(i); });
      resist(taken<L>(turning_.impulse, lane_), [&] { return turning_row(); });
    } else {
      struct Row {
        Pushed pushed;
        FrictionRow friction;
      };
      const TurningRow turning = turning_row();
      const Vector3Of<L> impulse = taken<L>(turning_.impulse, lane_);
      for_contacts<kFrictionsAhead>(
          [&](std::uint32_t i) {
            return Row{pushed(i), friction_row(i)};
          },
          ready, [&](std::uint32_t i, const Row& row) { add(i, row.pushed, [&] { return row.friction; }); });
      resist(impulse, [&] { return turning; });
    }
  }

  template <typename Ready = Nothing>
  TANDEM_INLINE void rebound(const Ready& ready = {}) {
    struct Row {
      NormalRow normal;
      L wanted, sum_of_normal;
    };
    const L none{}, one = all_of<L>(1);
    for_contacts<kNormalsAhead>(
        [&](std::uint32_t i) {
          return Row{normal_row(i), take(gap(i).rebound), take(friction(i).sum_of_normal)};
        },
        ready,
        [&](std::uint32_t i, const Row& row) {
          const L next = next_impulse(row.normal, -row.wanted, one, none);
          const L change =
              select(less(none, row.wanted),
                     select(less(none, row.normal.strongest), next - row.normal.impulse, none), none);
          push(row.normal.along, change);
          put(row.normal.impulse + change, normal(i).impulse, lane_);
          put(row.sum_of_normal + change, friction(i).sum_of_normal, lane_);
        });
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
    L strongest;  // where a pair of the group bounces
  };
  struct FrictionRow {
    Direction first, second;
    L mass, coefficient, first_drive, second_drive, sum_of_normal, sum_of_first, sum_of_second;
  };
  // The impulses of a contact.
  struct Pushed {
    L normal, first, second;
  };
  struct TurningRow {
    Vector3Of<L> spread_a[3], spread_b[3], drive;
    L mass, lever;
  };
  // What make_rows() reads.
  struct UnmadeRow {
    Vector3Of<L> normal, first, second, arm_a, arm_b, velocity, impulse;
    L exists, normal_impulse;
  };

  // So many rows of contacts a visit keeps in registers. Where many pairs are visited on a GPU, it waits for
  // memory once for all of them; few pairs have their rows at hand, and the CPU reads ahead by itself.
  static constexpr std::uint32_t kNormalsAhead = kReadsAhead ? 4 : 1, kFrictionsAhead = kReadsAhead ? 2 : 1;

  TANDEM_INLINE NormalRow normal_row(std::uint32_t contact) const {
    return normal_row(contact, normal(contact).followed);
  }
  TANDEM_INLINE NormalRow normal_row(std::uint32_t contact, const SoftNumber& followed) const {
    const SoftNormal& row = normal(contact);
    return {direction(row.direction), take(row.mass),    take(row.drive),
            take(followed),           take(row.impulse), bounces_ ? take(gap(contact).strongest) : L{}};
  }
  TANDEM_INLINE FrictionRow friction_row(std::uint32_t contact) const {
    const SoftFriction& row = friction(contact);
    return {direction(row.first),    direction(row.second),  take(row.mass),
            take(row.coefficient),   take(row.first_drive),  take(row.second_drive),
            take(row.sum_of_normal), take(row.sum_of_first), take(row.sum_of_second)};
  }
  TANDEM_INLINE Pushed pushed(std::uint32_t contact) const {
    const SoftFriction& row = friction(contact);
    return {take(normal(contact).impulse), take(row.first_impulse), take(row.second_impulse)};
  }
  TANDEM_INLINE TurningRow turning_row() const {
    const auto row = [&](const SoftNumber* matrix, int i) {
      return Vector3Of<L>{take(matrix[3 * i]), take(matrix[3 * i + 1]), take(matrix[3 * i + 2])};
    };
    const SoftNumber *const a = turning_.spread_a, *const b = turning_.spread_b;
    return {{row(a, 0), row(a, 1), row(a, 2)},
            {row(b, 0), row(b, 1), row(b, 2)},
            taken<L>(turning_.drive, lane_),
            take(turning_.mass),
            take(turning_.lever)};
  }
  TANDEM_INLINE UnmadeRow unmade_row(std::uint32_t contact) const {
    const SoftNormal& normal = this->normal(contact);
    const SoftFriction& friction = this->friction(contact);
    return {taken<L>(normal.direction.along, lane_),
            taken<L>(friction.first.along, lane_),
            taken<L>(friction.second.along, lane_),
            taken<L>(normal.direction.turn_a, lane_),
            taken<L>(normal.direction.turn_b, lane_),
            taken<L>(friction.first.turn_a, lane_),
            taken<L>(friction.second.turn_a, lane_),
            take(normal.mass),
            take(normal.impulse)};
  }

  // Calls visit(i, read(i)) for each contact. The first kAhead rows are read before ready() is called, the
  // others as soon as there is room for them.
  template <std::uint32_t kAhead, typename Read, typename Ready, typename Visit>
  TANDEM_INLINE void for_contacts(const Read& read, const Ready& ready, const Visit& visit) const {
    if constexpr (kAhead == 1) {
      ready();
      for (std::uint32_t i = 0; i < contacts_; ++i) visit(i, read(i));
    } else {
      // Loops over `rows` are unrolled, so that these are registers. They begin as 0: a compiler keeps a
      // register for ever that is only set under a condition.
      decltype(read(0)) rows[kAhead] = {};
      TANDEM_UNROLL
      for (std::uint32_t k = 0; k < kAhead; ++k) {
        if (k < contacts_) rows[k] = read(k);
      }
      ready();
      for (std::uint32_t first = 0; first < contacts_; first += kAhead) {
        TANDEM_UNROLL
        for (std::uint32_t k = 0; k < kAhead; ++k) {
          const std::uint32_t i = first + k;
          if (i < contacts_) visit(i, rows[k]);
          if (i + kAhead < contacts_) rows[k] = read(i + kAhead);
        }
      }
    }
  }

  // See SoftNormal. One mass does for both directions of friction, or it would not oppose the slip.
  TANDEM_INLINE void start(std::uint32_t contact, const UnmadeRow& unmade, const TurningRow& turning) {
    SoftNormal& normal = this->normal(contact);
    SoftFriction& friction = this->friction(contact);
    const auto made = [&](const Vector3Of<L>& along) {
      return Direction{along, across(turning.spread_a, cross(along, unmade.arm_a)),
                       across(turning.spread_b, cross(unmade.arm_b, along))};
    };
    const Direction along_normal = made(unmade.normal), first = made(unmade.first),
                    second = made(unmade.second);
    put_turns(along_normal, normal.direction);
    put_turns(first, friction.first), put_turns(second, friction.second);
    const auto inverse = [&](const L& mobility) {
      return unmade.exists / select(less(L{}, mobility), mobility, all_of<L>(1));
    };
    put(inverse(mobility(along_normal)), normal.mass, lane_);
    put(inverse(larger(mobility(first), mobility(second))), friction.mass, lane_);
    put(dot(unmade.normal, unmade.velocity), normal.drive, lane_);
    put(dot(unmade.first, unmade.velocity), friction.first_drive, lane_);
    put(dot(unmade.second, unmade.velocity), friction.second_drive, lane_);
    const L first_impulse = dot(unmade.first, unmade.impulse),
            second_impulse = dot(unmade.second, unmade.impulse);
    put(first_impulse, friction.first_impulse, lane_);
    put(second_impulse, friction.second_impulse, lane_);
    push(along_normal, unmade.normal_impulse);
    push(first, first_impulse);
    push(second, second_impulse);
  }
  TANDEM_INLINE void put_turns(const Direction& from, SoftDirection& to) const {
    put(from.turn_a, to.turn_a, lane_), put(from.turn_b, to.turn_b, lane_);
  }
  // Result: by how much an impulse of 1 changes the velocity along the direction.
  TANDEM_INLINE L mobility(const Direction& d) const {
    return inverse_mass_a_ + inverse_mass_b_ + dot(d.turn_a, d.turn_a) + dot(d.turn_b, d.turn_b);
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
    if (bounces_) put(larger(row.strongest, next), gap(contact).strongest, lane_);
  }
  TANDEM_INLINE void relax(std::uint32_t contact, const NormalRow& row) {
    const L none{};
    visit(contact, row, larger(none, row.followed * all_of<L>(rows_.inverse_h)), all_of<L>(1), none);
  }
  // a, b: how far the bodies have moved.
  TANDEM_INLINE static L followed(const L& separation, const Direction& along, const L& drive, float time,
                                  const MotionOf<L>& a, const MotionOf<L>& b) {
    return separation + speed(along, a, b) + time * drive;
  }

  TANDEM_INLINE void rub(SoftFriction& to, const Pushed& old, const FrictionRow& row) {
    const L bound = row.coefficient * old.normal;
    L next1 = old.first - row.mass * (speed(row.first) + row.first_drive);
    L next2 = old.second - row.mass * (speed(row.second) + row.second_drive);
    const L size = square_root(next1 * next1 + next2 * next2);
    const L part = shortening(size, bound);
    next1 = part * next1, next2 = part * next2;
    push(row.first, next1 - old.first);
    push(row.second, next2 - old.second);
    put(next1, to.first_impulse, lane_);
    put(next2, to.second_impulse, lane_);
    put(row.sum_of_normal + old.normal, to.sum_of_normal, lane_);
    put(row.sum_of_first + next1, to.sum_of_first, lane_);
    put(row.sum_of_second + next2, to.sum_of_second, lane_);
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

  TANDEM_INLINE void turn(const TurningRow& row, const Vector3Of<L>& impulse) {
    a_.spin = a_.spin - across(row.spread_a, impulse);
    b_.spin = b_.spin + across(row.spread_b, impulse);
  }
  TANDEM_INLINE static Vector3Of<L> across(const Vector3Of<L> (&matrix)[3], const Vector3Of<L>& p) {
    return p.x * matrix[0] + p.y * matrix[1] + p.z * matrix[2];
  }
  TANDEM_INLINE static Vector3Of<L> applied(const Vector3Of<L> (&matrix)[3], const Vector3Of<L>& p) {
    return {dot(matrix[0], p), dot(matrix[1], p), dot(matrix[2], p)};
  }

  TANDEM_INLINE void resist_turning(const L& push_of_normals, const Vector3Of<L>& old,
                                    const TurningRow& row) {
    const L bound = row.lever * push_of_normals;
    const Vector3Of<L> turning = applied(row.spread_b, b_.spin) - applied(row.spread_a, a_.spin) + row.drive;
    Vector3Of<L> next = old - row.mass * turning;
    next = shortening(square_root(dot(next, next)), bound) * next;
    turn(row, next - old);
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
