#pragma once
#include "dynamics/soft_visit.h"

// The passes of a soft step by the lanes of a file that is compiled for one machine; see soft_visit.h.
namespace tandem::dynamics {
namespace {

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

template <typename L, typename Visit>
TANDEM_INLINE void visit_all(const SoftRows& rows, std::uint32_t begin, std::uint32_t end,
                             const Visit& visit) {
  for (std::uint32_t i = begin; i < end; ++i) {
    const SoftPairs& pairs = rows.pairs[i];
    for (int lane = 0; lane < static_cast<int>(pairs.pairs); lane += L::kLanes) {
      const std::uint32_t *const a = pairs.body_a + lane, *const b = pairs.body_b + lane;
      PairVisit<L> bodies(rows, i, lane);
      bodies.begin(gather(rows.velocities, a, L{}), gather(rows.velocities, b, L{}));
      visit(bodies, a, b);
      scatter(bodies.a(), rows.velocities, a);
      scatter(bodies.b(), rows.velocities, b);
    }
  }
}

template <typename L>
constexpr SoftPasses kSoftPassesOf = {
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float) {
      visit_all<L>(rows, begin, end, [](PairVisit<L>& visit, auto...) { visit.start(); });
    },
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float) {
      visit_all<L>(rows, begin, end, [](PairVisit<L>& visit, auto...) { visit.push_apart(); });
    },
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float time) {
      visit_all<L>(rows, begin, end,
                   [&](PairVisit<L>& visit, const std::uint32_t* a, const std::uint32_t* b) {
                     visit.follow(time, gather(rows.moved, a, L{}), gather(rows.moved, b, L{}));
                     visit.relax();
                   });
    },
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float) {
      visit_all<L>(rows, begin, end, [](PairVisit<L>& visit, auto...) { visit.relax(); });
    },
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float) {
      visit_all<L>(rows, begin, end, [](PairVisit<L>& visit, auto...) { visit.rub(); });
    },
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float) {
      for (std::uint32_t i = begin; i < end; ++i) {
        if (rows.pairs[i].bounces != 0)
          visit_all<L>(rows, i, i + 1, [](PairVisit<L>& visit, auto...) { visit.rebound(); });
      }
    },
    [](const SoftRows& rows, std::uint32_t begin, std::uint32_t end, float) {
      visit_all<L>(rows, begin, end, [](PairVisit<L>& visit, auto...) { visit.judge(); });
    }};

}  // namespace
}  // namespace tandem::dynamics
