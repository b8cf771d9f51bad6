#pragma once
#include "kernels/manifold/surface_line.h"

namespace tandem::manifold {

/// What is known of one body from one of its triangles: near there it lies where dot(normal, x) <= offset, x
/// being the coordinates along the axes of the patch's frame.
struct HalfSpace {
  Vector3 normal;
  double offset;
  std::uint32_t triangle = kNoIndex;
  std::uint16_t side;
  bool counts;

  TANDEM_HD double beyond(const Vector2& at, double height) const {
    return normal.x * at.x + normal.y * at.y + normal.z * height - offset;
  }
};

/// A line along the patch's normal, a point of a on it, and one of b.
struct LineOfTwo {
  Vector2 at;
  double height[2];
  bool found = false;

  TANDEM_HD double depth() const { return height[0] - height[1]; }
};

/// The half-spaces that are known of two bodies, and the square across the normal that lines are to go
/// through. All of a team see them, and call these functions together.
class HalfSpaces {
 public:
  /// Those that a search begins with, and those that it learns.
  static constexpr int kFirst = 16, kLearnt = 24, kMost = kFirst + kLearnt;

  HalfSpace space[kMost];
  /// The place of one that is learnt; those of long before give way.
  TANDEM_HD HalfSpace& learnt(int i) { return space[kFirst + i % kLearnt]; }

  /// One of the team begins. middle, along, half: the square's middle, the direction of two sides, half their
  /// length; height, far: heights are no further than `far` from this one.
  TANDEM_HD void begin(const Vector2& middle, const Vector2& along, double half, double height, double far) {
    const double size = norm(along);
    along_ = size > 0 ? (1 / size) * along : Vector2{1, 0};
    for (int i = 0; i < 4; ++i) wall_[i] = dot(wall(i), middle) + half;
    wall_[4] = far + height, wall_[5] = far - height;
    begin_basis();
  }

  /// One of the team moves the square's middle to a line. half: half the length of its sides.
  TANDEM_HD void look_near(const Vector2& middle, double half) {
    for (int i = 0; i < 4; ++i) wall_[i] = dot(wall(i), middle) + half;
    begin_basis();
  }
  /// A unit vector along two sides of the square.
  TANDEM_HD const Vector2& along() const { return along_; }

  /// Returns which of some half-spaces are known, a bit for each.
  template <typename Team, int kCount>
  TANDEM_HD unsigned known(const Team& team, const HalfSpace (&wanted)[kCount]) const {
    unsigned own = 0, out = 0;
    for (int i = first_of(team); i < kMost; i += step_of(team)) {
      for (int k = 0; k < kCount; ++k)
        own |= space[i].triangle == wanted[k].triangle && space[i].side == wanted[k].side ? 1u << k : 0u;
    }
    for (int k = 0; k < kCount; ++k) out |= team.any((own >> k & 1u) != 0) ? 1u << k : 0u;
    return out;
  }
  /// From now on, those count that have a point of both bodies behind them.
  template <typename Team>
  TANDEM_HD void look_from(const Team& team, const Vector2& at, double height) {
    bool drops = false;
    for (int i = first_of(team); i < kMost; i += step_of(team)) {
      const bool counts = space[i].triangle != kNoIndex && space[i].beyond(at, height) < 0;
      drops = drops || (!counts && basis_.has(kWalls + i));
      space[i].counts = counts;
    }
    drops = team.any(drops);
    team.sync();  // all have read the basis
    if (drops && team.rank() == 0) begin_basis();
    team.sync();
  }
  /// Forgets those beyond which the body goes on. Result: whether it does so by more than `much` anywhere.
  template <typename Team>
  TANDEM_HD bool drop_before(const Team& team, const Vector2& at, const double (&height)[2], double tolerance,
                             double much) {
    bool drops = false, any = false;
    for (int i = first_of(team); i < kMost; i += step_of(team)) {
      HalfSpace& of = space[i];
      if (of.triangle == kNoIndex) continue;
      const double beyond = of.beyond(at, of.side == 0 ? height[0] : height[1]);
      if (!(beyond > tolerance)) continue;
      drops = drops || basis_.has(kWalls + i), any = any || beyond > much;
      of.triangle = kNoIndex, of.counts = false;
    }
    drops = team.any(drops);
    team.sync();  // all have read the basis
    if (drops && team.rank() == 0) begin_basis();
    team.sync();
    return team.any(any);
  }
  /// Returns whether a point is in the plane of one of the first ones.
  template <typename Team>
  TANDEM_HD bool in_plane(const Team& team, const Vector2& at, double height, double tolerance) const {
    bool is = false;
    for (int i = first_of(team); i < kFirst; i += step_of(team))
      is = is || (space[i].triangle != kNoIndex && std::fabs(space[i].beyond(at, height)) <= tolerance);
    return team.any(is);
  }
  /// Returns the triangle of the half-space that ends nearest to a point of one body's, or kNoIndex if none
  /// ends within a distance.
  template <typename Team>
  TANDEM_HD std::uint32_t nearest_triangle(const Team& team, int side, const Vector2& at, double height,
                                           double within = INFINITY) const {
    int own = kMost;
    double nearest = within;
    for (int i = first_of(team); i < kMost; i += step_of(team)) {
      if (!space[i].counts || space[i].side != side) continue;
      const double apart = std::fabs(space[i].beyond(at, height));
      if (apart < nearest) nearest = apart, own = i;
    }
    const double least = team.least(nearest);
    const int place = team.least(nearest == least ? own : kMost);
    return place < kMost ? space[place].triangle : kNoIndex;
  }
  /// Returns whether a point of a body lies beyond one of its half-spaces.
  TANDEM_HD bool any_before(int side, const Vector2& at, double height, double tolerance) const {
    bool is = false;
    TANDEM_ROLLED
    for (int i = 0; i < kMost; ++i)
      is = is || (space[i].triangle != kNoIndex && space[i].side == side &&
                  space[i].beyond(at, height) > tolerance);
    return is;
  }
  /// Returns the same of those that count.
  TANDEM_HD bool any_that_counts_before(int side, const Vector2& at, double height, double tolerance) const {
    bool is = false;
    TANDEM_ROLLED
    for (int i = 0; i < kMost; ++i)
      is = is || (space[i].counts && space[i].side == side && space[i].beyond(at, height) > tolerance);
    return is;
  }
  /// Returns whether a line is on the square's border.
  TANDEM_HD bool on_wall(const Vector2& at, double within) const {
    bool is = false;
    for (int i = 0; i < 4; ++i) is = is || dot(wall(i), at) > wall_[i] - within;
    return is;
  }

  /// Finds the line on which the half-spaces leave a the most above b: a linear program in x, y and the two
  /// heights, by the dual simplex method. Result: none if rounding keeps it from an end.
  /// The basis of the last program is where it begins, so that few steps are left.
  template <typename Team>
  TANDEM_HD LineOfTwo deepest(const Team& team, double tolerance);

 private:
  static constexpr int kWalls = 6, kMostPivots = 64;
  static constexpr double kLeastShare = 1e-9;
  static constexpr double kTilt =
      1e-10;  ///< what places count, so that no price is 0 and no basis comes again

  template <typename Team>
  TANDEM_HD static int first_of(const Team& team) {
    return static_cast<int>(team.rank());
  }
  template <typename Team>
  TANDEM_HD static int step_of(const Team& team) {
    return static_cast<int>(team.size());
  }
  /// The normal of a side of the square.
  TANDEM_HD Vector2 wall(int i) const {
    const Vector2 n = i % 2 == 0 ? along_ : Vector2{-along_.y, along_.x};
    return i < 2 ? n : -1.0 * n;
  }
  /// A constraint of the program: row[0] x + row[1] y + row[2] height of a + row[3] height of b <= offset.
  struct Constraint {
    double row[4], offset;
  };
  TANDEM_HD Constraint constraint(int i) const {
    if (i < kWalls) {
      const Vector2 n = i < 4 ? wall(i) : Vector2{};
      return {{n.x, n.y, i == 4 ? 1.0 : 0.0, i == 5 ? -1.0 : 0.0}, wall_[i]};
    }
    const HalfSpace& of = space[i - kWalls];
    return {{of.normal.x, of.normal.y, of.side == 0 ? of.normal.z : 0, of.side == 0 ? 0 : of.normal.z},
            of.offset};
  }
  /// Four constraints that hold exactly, and what each counts for the depth. Indices are known when it is
  /// compiled, so that a GPU keeps it in registers.
  struct Basis {
    double inverse[4][4], offset[4], price[4];
    int number[4];  ///< of each

    TANDEM_HD bool has(int i) const {
      return number[0] == i || number[1] == i || number[2] == i || number[3] == i;
    }
    /// Takes a constraint for the one that has to leave; false if none can.
    TANDEM_HD bool take(const Constraint& entering, int number_of_entering) {
      double share[4], price_of_leaving = 0, share_of_leaving = 0;
      int leaves = -1;
      for (int k = 0; k < 4; ++k) {
        share[k] = 0;
        for (int r = 0; r < 4; ++r) share[k] += entering.row[r] * inverse[r][k];
        // The one whose price counts least for its share.
        if (share[k] > kLeastShare &&
            (leaves < 0 || price[k] * share_of_leaving < price_of_leaving * share[k]))
          leaves = k, price_of_leaving = price[k], share_of_leaving = share[k];
      }
      if (leaves < 0) return false;
      const double by_share = 1 / share_of_leaving, least = price_of_leaving * by_share;
      for (int k = 0; k < 4; ++k) {
        price[k] = k == leaves ? least : greater(price[k] - least * share[k], 0.0);
        offset[k] = k == leaves ? entering.offset : offset[k];
        number[k] = k == leaves ? number_of_entering : number[k];
      }
      for (int r = 0; r < 4; ++r) {
        double own = 0;
        for (int k = 0; k < 4; ++k) own = k == leaves ? inverse[r][k] : own;
        own *= by_share;
        for (int k = 0; k < 4; ++k) inverse[r][k] = k == leaves ? own : inverse[r][k] - own * share[k];
      }
      return true;
    }
  };
  /// Two sides of the square, and how high a may be and how low b.
  TANDEM_HD void begin_basis() {
    const double c = along_.x, s = along_.y;
    basis_ = {{{c, -s, 0, 0}, {s, c, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, -1}},
              {wall_[0], wall_[1], wall_[4], wall_[5]},
              {kTilt, 0.75 * kTilt, 1, 1},
              {0, 1, 4, 5}};
  }
  template <typename Team>
  TANDEM_HD int most_violated(const Team& team, const double (&x)[4], double tolerance) const;

  Vector2 along_;
  double wall_[kWalls];
  Basis basis_;
};

/// The constraint beyond which a point lies most: a wall, or kWalls + i the half-space i; -1 if there is
/// none.
template <typename Team>
TANDEM_HD int HalfSpaces::most_violated(const Team& team, const double (&x)[4], double tolerance) const {
  const Vector2 at = {x[0], x[1]};
  int own = kWalls + kMost;
  double most = tolerance;
  for (int i = first_of(team); i < kWalls + kMost; i += step_of(team)) {
    double beyond = 0;
    if (i < kWalls) {
      beyond = (i < 4 ? dot(wall(i), at) : i == 4 ? x[2] : -x[3]) - wall_[i];
    } else {
      const HalfSpace& of = space[i - kWalls];
      beyond = of.counts ? of.beyond(at, of.side == 0 ? x[2] : x[3]) : 0;
    }
    if (beyond > most) most = beyond, own = i;
  }
  const double greatest = team.greatest(most);
  return greatest > tolerance ? team.least(most == greatest ? own : kWalls + kMost) : -1;
}

template <typename Team>
TANDEM_HD LineOfTwo HalfSpaces::deepest(const Team& team, double tolerance) {
  Basis basis = basis_;  // of each of the team its own
  LineOfTwo out;
  for (int pivot = 0; pivot < kMostPivots && !out.found; ++pivot) {
    double x[4];
    for (int r = 0; r < 4; ++r) {
      x[r] = 0;
      for (int k = 0; k < 4; ++k) x[r] += basis.inverse[r][k] * basis.offset[k];
    }
    const int worst = most_violated(team, x, tolerance);
    if (worst < 0) {
      out.at = {x[0], x[1]}, out.height[0] = x[2], out.height[1] = x[3];
      out.found = true;
    } else if (!basis.take(constraint(worst), worst)) {
      break;
    }
  }
  team.sync();  // all have read the basis
  if (team.rank() == 0) basis_ = basis;
  return out;
}

}  // namespace tandem::manifold
