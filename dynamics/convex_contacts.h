#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "dynamics/block_matrix.h"
#include "dynamics/contact_island.h"

namespace tandem::dynamics {

using manifold::Vector2;

/// The derivative of Huber's function: what is wanted, but no longer than the bound.
template <typename Vector>
TANDEM_HD Vector shortened(const Vector& wanted, double bound) {
  const double size = norm(wanted);
  return size > bound ? (bound / size) * wanted : wanted;
}

/// The derivative of shortened() along a change of what is wanted.
template <typename Vector>
TANDEM_HD Vector shortened_change(const Vector& wanted, double bound, const Vector& change) {
  const double size = norm(wanted);
  if (size <= bound) return change;
  const Vector along = (1 / size) * wanted;
  return (bound / size) * (change - dot(along, change) * along);
}

/// The part of a contact's vector that is across the normal.
TANDEM_HD inline Vector2 across(const Vector3& of_contact) {
  return {of_contact.y, of_contact.z};
}

/// The impulses of contacts, and those that resist turning of the pairs.
struct IslandImpulses {
  std::span<Vector3> contact;  // along normal, first and second
  std::span<Vector3> turning;  // about the axes of the world

  TANDEM_HD void carve(Carver& carver, const ContactIsland& island) {
    carver.take(island.contacts.size(), contact), carver.take(island.pairs.size(), turning);
  }
};

/// The numbers that the least of the convex function depends on beside the rows.
struct ConvexGoal {
  std::span<Vector6> free;          // y*: velocities without contacts
  std::span<double> target;         // of w along the normal
  IslandImpulses impulse;           // l
  std::span<double> bound;          // of friction
  std::span<double> turning_bound;  // of what resists turning

  TANDEM_HD void carve(Carver& carver, const ContactIsland& island) {
    carver.take(island.bodies.size(), free), carver.take(island.contacts.size(), target);
    impulse.carve(carver, island);
    carver.take(island.contacts.size(), bound), carver.take(island.pairs.size(), turning_bound);
  }
};

/// How the impulses of a contact change with its velocities, less the sign.
struct ContactSlope {
  double normal, first, both, second;
};

/// What ConvexContacts works with.
struct ConvexScratch {
  BlockMatrix matrix;
  std::span<double> normal_stiffness, friction_stiffness, turning_stiffness;  // 1/R
  std::span<Vector6> gradient;
  std::span<Vector6> way;                     // of a Newton step
  std::span<Vector3> relative, relative_way;  // velocities of contacts, and how the way changes them
  std::span<Vector3> turning, turning_way;    // of pairs
  std::span<ContactSlope> slope;
  std::span<Matrix3> turning_slope;        // rows: how the impulse changes by each component of the turning
  std::span<std::uint32_t> block_of_pair;  // of those with two bodies

  TANDEM_HD void carve(Carver& carver, const ContactIsland& island, std::size_t block_count) {
    const std::size_t bodies = island.bodies.size(), contacts = island.contacts.size(),
                      pairs = island.pairs.size();
    matrix.carve(carver, bodies - 1, block_count);
    carver.take(contacts, normal_stiffness), carver.take(contacts, friction_stiffness);
    carver.take(pairs, turning_stiffness), carver.take(bodies, gradient), carver.take(bodies, way);
    carver.take(contacts, relative), carver.take(contacts, relative_way);
    carver.take(pairs, turning), carver.take(pairs, turning_way);
    carver.take(contacts, slope), carver.take(pairs, turning_slope), carver.take(pairs, block_of_pair);
  }
};

/// What joints add to the convex function: nothing, where there are none. ConvexJoints has the same
/// functions.
struct NoJoints {
  static constexpr bool kAny = false;
};

/// Velocities y of an island that make the strictly convex function
///
///     |y - y*|^2 / 2 + sum over contacts of  R_n/2 max(0, l_n + (target - w_n)/R_n)^2 + R_t H(l_t - w_t/R_t)
///                    + sum over pairs of     R_s H(l_s - w_s/R_s)
///                    + what joints add (ConvexJoints)
///
/// least. w: velocities of a contact and of a pair's turning; R: `softness` times what an impulse of 1
/// changes them by; H: half the square up to the bound, linear from there on (Huber), so that neither
/// friction nor what resists turning depends on the impulse along the normal. The impulses are the
/// derivatives. Newton's method on sparse LDL^T, with exact line search.
template <typename Team, typename Joints>
class ConvexContacts {
 public:
  /// Conditions: the matrix has its columns, and the island lists the pairs of its bodies. A team of many has
  /// no joints.
  TANDEM_HD ConvexContacts(const Team& team, const ContactIsland& island, const ConvexScratch& scratch,
                           Joints& joints)
      : team_(team), island_(island), with_(scratch), joints_(joints) {
    static_assert(!Team::kIsMany || !Joints::kAny);
    team.each(island.pair_count(), [&](std::uint32_t i) {
      const TouchingPair& pair = island.pairs[i];
      if (pair.a > 0 && pair.b > 0)
        scratch.block_of_pair[i] =
            scratch.matrix.block_of(std::min(pair.a, pair.b) - 1, std::max(pair.a, pair.b) - 1);
    });
  }

  TANDEM_HD void set_softness(double softness) {
    if constexpr (Joints::kAny) joints_.set_softness();
    team_.each(island_.contact_count(), [&](std::uint32_t i) {
      with_.normal_stiffness[i] = 1 / (softness * island_.normal[i].mobility());
      with_.friction_stiffness[i] = 1 / (softness * island_.friction_mobility(i));
    });
    team_.each(island_.pair_count(), [&](std::uint32_t i) {
      with_.turning_stiffness[i] = 1 / (softness * island_.pairs[i].mobility);
    });
    team_.barrier();
  }

  // y: where to start, then the least. impulse: those there, a result. Result: false if it takes
  // more factorisations than are left in `factorisations`, which this counts down.
  TANDEM_HD bool minimise(const ConvexGoal& goal, std::span<Vector6> y, const IslandImpulses& impulse,
                          std::uint32_t& factorisations) {
    constexpr double kFlat = 3e-9;
    // Near the minimum the gradient falls by far more than a half each time, unless rounding is what is left.
    constexpr double kNearlyFlat = 1e-7, kFalls = 0.5;
    for (double before = INFINITY;;) {
      find_gradient(goal, y, impulse);
      const double slope = slope_of(goal, y, kFlat);
      if (slope <= kFlat || (slope <= kNearlyFlat && slope > kFalls * before)) return true;
      before = slope;
      if (factorisations == 0) return false;
      --factorisations;
      find_curvature(goal);
      if (!find_way()) return false;
      const double length = line_search(goal, y);
      if (!(length > 0)) return false;
      team_.each(moved_count(), [&](std::uint32_t k) { y[k + 1] += length * with_.way[k + 1]; });
      team_.barrier();
    }
  }

  // Returns what velocities miss of y* and the impulses, after minimise().
  TANDEM_HD std::span<const Vector6> gradient() const { return with_.gradient; }

  TANDEM_HD double normal_softness(std::size_t contact) const { return 1 / with_.normal_stiffness[contact]; }
  TANDEM_HD double friction_softness(std::size_t contact) const {
    return 1 / with_.friction_stiffness[contact];
  }
  TANDEM_HD double turning_softness(std::size_t pair) const { return 1 / with_.turning_stiffness[pair]; }

 private:
  static constexpr std::uint32_t kParts = kPartsOfBlock<Team>;

  TANDEM_HD std::uint32_t moved_count() const { return island_.body_count() - 1; }

  // Returns the gradient's length as a part of what velocities change by. flat: that part which counts as
  // none, for the rounding of joints.
  TANDEM_HD double slope_of(const ConvexGoal& goal, std::span<const Vector6> y, double flat) const {
    double rounded = 0;
    if constexpr (Joints::kAny) rounded = joints_.rounded(y, flat);
    const Sums<2> squares =
        team_.sum(Sums<2>{{0, rounded}}, moved_count(), [&](std::uint32_t k, Sums<2>& sums) {
          const std::uint32_t j = k + 1;
          sums.of[0] += square(with_.gradient[j]);
          sums.of[1] += square(y[j] - goal.free[j]) + 1e-6 * square(goal.free[j]);
        });
    return squares.of[0] > 0 ? std::sqrt(squares.of[0] / squares.of[1]) : 0;
  }

  TANDEM_HD void find_gradient(const ConvexGoal& goal, std::span<const Vector6> y,
                               const IslandImpulses& impulse) {
    team_.each(island_.contact_count(), [&](std::uint32_t i) {
      with_.relative[i] = island_.relative(i, y) + island_.drive[i];
      impulse.contact[i] = impulse_at(goal, i, with_.relative[i]);
    });
    team_.each(island_.pair_count(), [&](std::uint32_t i) {
      const TouchingPair& pair = island_.pairs[i];
      with_.turning[i] = island_.turning(pair, y) + pair.drive;
      impulse.turning[i] = turning_at(goal, i, with_.turning[i]);
    });
    team_.barrier();
    team_.each(moved_count(), [&](std::uint32_t k) {
      const std::uint32_t j = k + 1;
      Vector6 gradient = y[j] - goal.free[j];
      if constexpr (Joints::kAny) gradient = gradient + joints_.drawn(j, y[j]);
      with_.gradient[j] = less_impulses(j, gradient, impulse);
    });
    if constexpr (Joints::kAny) joints_.push(y, with_.gradient);
    team_.barrier();
  }

  // Returns the gradient of a body less what contacts and pairs push it by.
  TANDEM_HD Vector6 less_impulses(std::uint32_t j, Vector6 gradient, const IslandImpulses& impulse) const {
    island_.pairs_of(j, [&](const TouchingPair& pair, std::uint32_t) {
      for (std::uint32_t i = pair.begin; i < pair.end; ++i) {
        const Vector3& by = impulse.contact[i];
        gradient -= by.x * side_of(pair, j, island_.normal[i]);
        gradient -= by.y * side_of(pair, j, island_.first[i]);
        gradient -= by.z * side_of(pair, j, island_.second[i]);
      }
    });
    island_.pairs_of(j, [&](const TouchingPair& pair, std::uint32_t i) {
      for (int k = 0; k < 3; ++k) gradient -= at(impulse.turning[i], k) * side_of(pair, j, pair.turn[k]);
    });
    return gradient;
  }

  TANDEM_HD static const Vector6& side_of(const TouchingPair& pair, std::uint32_t j, const ContactRow& row) {
    return pair.a == j ? row.a : row.b;
  }

  TANDEM_HD void find_curvature(const ConvexGoal& goal) {
    find_slopes(goal);
    team_.barrier();
    const BlockMatrix& matrix = with_.matrix;
    team_.each(moved_count() * kParts, [&](std::uint32_t i) {
      const std::uint32_t j = i / kParts + 1;
      BlockPart<Team> sum(i % kParts);
      sum.add_identity();
      if constexpr (Joints::kAny) joints_.add_nearness(j, sum);
      island_.pairs_of(j, [&](const TouchingPair& pair, std::uint32_t) {
        add_contacts(sum, pair, pair.a == j, pair.a == j);
      });
      island_.pairs_of(j, [&](const TouchingPair& pair, std::uint32_t number) {
        add_turning(sum, pair, number, pair.a == j, pair.a == j);
      });
      sum.write(matrix.diagonal[j - 1]);
    });
    // Of a block the rows are those of the body further on.
    team_.each(island_.pair_count() * kParts, [&](std::uint32_t i) {
      const TouchingPair& pair = island_.pairs[i / kParts];
      if (pair.a == 0 || pair.b == 0) return;
      BlockPart<Team> sum(i % kParts);
      add_contacts(sum, pair, pair.a > pair.b, pair.a < pair.b);
      add_turning(sum, pair, i / kParts, pair.a > pair.b, pair.a < pair.b);
      sum.write(matrix.blocks[with_.block_of_pair[i / kParts]]);
    });
    if constexpr (Joints::kAny) joints_.add_curvature(matrix);
    team_.barrier();
  }

  // Finds the slopes of all impulses, and clears the blocks.
  TANDEM_HD void find_slopes(const ConvexGoal& goal) {
    const auto blocks = static_cast<std::uint32_t>(with_.matrix.blocks.size());
    team_.each(blocks * 6, [&](std::uint32_t i) {
      for (double& number : with_.matrix.blocks[i / 6].at[i % 6]) number = 0;
    });
    team_.each(island_.contact_count(), [&](std::uint32_t i) {
      const Vector3& w = with_.relative[i];
      const double normal = impulse_slope(goal, i, w, {1, 0, 0}).x;
      with_.slope[i] = {normal, 0, 0, 0};
      if (goal.bound[i] <= 0) return;
      const Vector3 first = impulse_slope(goal, i, w, {0, 1, 0}),
                    second = impulse_slope(goal, i, w, {0, 0, 1});
      with_.slope[i] = {normal, first.y, first.z, second.z};
    });
    team_.each(island_.pair_count(), [&](std::uint32_t i) {
      const bool acts = goal.turning_bound[i] > 0;
      for (int k = 0; k < 3; ++k)
        with_.turning_slope[i].row[k] =
            acts ? turning_slope(goal, i, with_.turning[i], Matrix3::identity().row[k]) : Vector3{};
    });
  }

  // Adds what the contacts of a pair do to a block with rows of a or of b, and columns of a or of b.
  TANDEM_HD void add_contacts(BlockPart<Team>& sum, const TouchingPair& pair, bool rows_of_a,
                              bool columns_of_a) const {
    const auto left = [&](const ContactRow& row) -> const Vector6& { return rows_of_a ? row.a : row.b; };
    const auto right = [&](const ContactRow& row) -> const Vector6& { return columns_of_a ? row.a : row.b; };
    for (std::uint32_t i = pair.begin; i < pair.end; ++i) {
      const ContactRow &n = island_.normal[i], &f = island_.first[i], &s = island_.second[i];
      const ContactSlope& slope = with_.slope[i];
      if (slope.normal > 0) sum.add(slope.normal, left(n), right(n));
      if (slope.first != 0) sum.add(slope.first, left(f), right(f));
      if (slope.second != 0) sum.add(slope.second, left(s), right(s));
      if (slope.both == 0) continue;
      sum.add(slope.both, left(f), right(s));
      sum.add(slope.both, left(s), right(f));
    }
  }

  TANDEM_HD void add_turning(BlockPart<Team>& sum, const TouchingPair& pair, std::uint32_t number,
                             bool rows_of_a, bool columns_of_a) const {
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 3; ++j) {
        const double slope = at(with_.turning_slope[number].row[k], j);
        if (slope == 0) continue;
        sum.add(slope, rows_of_a ? pair.turn[j].a : pair.turn[j].b,
                columns_of_a ? pair.turn[k].a : pair.turn[k].b);
      }
    }
  }

  TANDEM_HD bool find_way() {
    const std::span<Vector6> way = with_.way;
    team_.each(island_.body_count(),
               [&](std::uint32_t j) { way[j] = j > 0 ? -with_.gradient[j] : Vector6{}; });
    team_.barrier();
    if (!with_.matrix.solve(team_, way.subspan(1))) return false;
    team_.each(island_.contact_count(),
               [&](std::uint32_t i) { with_.relative_way[i] = island_.relative(i, way); });
    team_.each(island_.pair_count(),
               [&](std::uint32_t i) { with_.turning_way[i] = island_.turning(island_.pairs[i], way); });
    if constexpr (Joints::kAny) joints_.take_way(way);
    team_.barrier();
    return true;
  }

  // The root of the derivative along the way, by Newton's method within a bracket.
  TANDEM_HD double line_search(const ConvexGoal& goal, std::span<const Vector6> y) const {
    constexpr int kMost = 40;
    constexpr double kEnough = 1e-3;
    const Sums<3> sums = team_.sum(Sums<3>{}, moved_count(), [&](std::uint32_t k, Sums<3>& to) {
      const std::uint32_t j = k + 1;
      const Vector6& way = with_.way[j];
      Vector6 gone = y[j] - goal.free[j];
      if constexpr (Joints::kAny) gone = gone + joints_.drawn(j, y[j]);
      to.of[0] += dot(gone, way);
      to.of[1] += square(way);
      if constexpr (Joints::kAny) to.of[1] += joints_.curvature_of_nearness(j, way);
      to.of[2] -= dot(with_.gradient[j], way);
    });
    const double linear = sums.of[0], quadratic = sums.of[1], fall = sums.of[2];
    const std::uint32_t contacts = island_.contact_count();
    double low = 0, high = 0, length = 1;
    for (int k = 0; k < kMost; ++k) {
      const Sums<2> start = {{linear + length * quadratic, quadratic}};
      const Sums<2> all =
          team_.sum(start, contacts + island_.pair_count(), [&](std::uint32_t i, Sums<2>& to) {
            if (i < contacts) {
              const Vector3& way = with_.relative_way[i];
              const Vector3 w = with_.relative[i] + length * way;
              to.of[0] -= dot(impulse_at(goal, i, w), way);
              to.of[1] += dot(impulse_slope(goal, i, w, way), way);
            } else {
              const std::uint32_t pair = i - contacts;
              const Vector3& way = with_.turning_way[pair];
              const Vector3 w = with_.turning[pair] + length * way;
              to.of[0] -= dot(turning_at(goal, pair, w), way);
              to.of[1] += dot(turning_slope(goal, pair, w, way), way);
            }
          });
      double slope = all.of[0], curvature = all.of[1];
      if constexpr (Joints::kAny) joints_.add_slopes(length, slope, curvature);
      if (std::fabs(slope) <= kEnough * fall) return length;
      (slope > 0 ? high : low) = length;
      const double next = length - slope / curvature;
      const bool is_inside = next > low && (high == 0 || next < high);
      length = is_inside ? next : high > 0 ? 0.5 * (low + high) : 2 * length;
    }
    return low > 0 ? low : length;
  }

  TANDEM_HD Vector2 wanted_friction(const ConvexGoal& goal, std::size_t i, const Vector3& w) const {
    return across(goal.impulse.contact[i]) - with_.friction_stiffness[i] * across(w);
  }

  TANDEM_HD Vector3 wanted_turning(const ConvexGoal& goal, std::size_t i, const Vector3& w) const {
    return goal.impulse.turning[i] - with_.turning_stiffness[i] * w;
  }

  TANDEM_HD Vector3 turning_at(const ConvexGoal& goal, std::size_t i, const Vector3& w) const {
    return shortened(wanted_turning(goal, i, w), goal.turning_bound[i]);
  }

  // Returns the slope of a turning impulse, as impulse_slope() does of an impulse.
  TANDEM_HD Vector3 turning_slope(const ConvexGoal& goal, std::size_t i, const Vector3& w,
                                  const Vector3& change) const {
    return shortened_change<Vector3>(wanted_turning(goal, i, w), goal.turning_bound[i],
                                     with_.turning_stiffness[i] * change);
  }

  TANDEM_HD Vector3 impulse_at(const ConvexGoal& goal, std::size_t i, const Vector3& w) const {
    const double normal =
        std::max(0.0, goal.impulse.contact[i].x + with_.normal_stiffness[i] * (goal.target[i] - w.x));
    const Vector2 friction = shortened(wanted_friction(goal, i, w), goal.bound[i]);
    return {normal, friction.x, friction.y};
  }

  // The derivative of the impulse along a change of w, less its sign.
  TANDEM_HD Vector3 impulse_slope(const ConvexGoal& goal, std::size_t i, const Vector3& w,
                                  const Vector3& change) const {
    const bool pushes = goal.impulse.contact[i].x + with_.normal_stiffness[i] * (goal.target[i] - w.x) > 0;
    const Vector2 slope = shortened_change<Vector2>(wanted_friction(goal, i, w), goal.bound[i],
                                                    with_.friction_stiffness[i] * across(change));
    return {pushes ? with_.normal_stiffness[i] * change.x : 0, slope.x, slope.y};
  }

  const Team& team_;
  const ContactIsland& island_;
  const ConvexScratch& with_;
  Joints& joints_;
};

}  // namespace tandem::dynamics
