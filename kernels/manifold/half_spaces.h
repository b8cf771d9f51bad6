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

  /// One of the team begins. middle, along, half: the square's middle, the direction of two sides, half their
  /// length; far: heights are between -far and far.
  TANDEM_HD void begin(const Vector2& middle, const Vector2& along, double half, double far) {
    const double size = norm(along);
    along_ = size > 0 ? (1 / size) * along : Vector2{1, 0};
    for (int i = 0; i < 4; ++i) wall_[i] = dot(wall(i), middle) + half;
    wall_[4] = wall_[5] = far;
  }

  template <typename Team>
  TANDEM_HD bool knows(const Team& team, const HalfSpace& wanted) const {
    bool does = false;
    for (int i = first_of(team); i < kMost; i += step_of(team))
      does = does || (space[i].triangle == wanted.triangle && space[i].side == wanted.side);
    return team.any(does);
  }
  /// From now on, those count that have a point of both bodies behind them.
  template <typename Team>
  TANDEM_HD void look_from(const Team& team, const Vector2& at, double height) {
    for (int i = first_of(team); i < kMost; i += step_of(team))
      space[i].counts = space[i].triangle != kNoIndex && space[i].beyond(at, height) < 0;
  }
  /// Forgets those beyond which the body goes on.
  template <typename Team>
  TANDEM_HD void drop_before(const Team& team, int side, const Vector2& at, double height, double tolerance) {
    for (int i = first_of(team); i < kMost; i += step_of(team)) {
      if (space[i].triangle == kNoIndex || space[i].side != side) continue;
      if (space[i].beyond(at, height) > tolerance) space[i].triangle = kNoIndex, space[i].counts = false;
    }
  }
  /// Returns whether a point is in the plane of one of the first ones.
  TANDEM_HD bool in_plane(const Vector2& at, double height, double tolerance) const {
    bool is = false;
    for (int i = 0; i < kFirst; ++i)
      is = is || (space[i].triangle != kNoIndex && std::fabs(space[i].beyond(at, height)) <= tolerance);
    return is;
  }
  /// Returns the triangle of the half-space that ends nearest to a point of one body's, or kNoIndex if none
  /// ends within a distance.
  TANDEM_HD std::uint32_t nearest_triangle(int side, const Vector2& at, double height, double within) const {
    std::uint32_t triangle = kNoIndex;
    double nearest = within;
    for (int i = 0; i < kMost; ++i) {
      if (!space[i].counts || space[i].side != side) continue;
      const double apart = std::fabs(space[i].beyond(at, height));
      if (apart < nearest) nearest = apart, triangle = space[i].triangle;
    }
    return triangle;
  }
  /// Returns whether a line is on the square's border.
  TANDEM_HD bool on_wall(const Vector2& at, double within) const {
    bool is = false;
    for (int i = 0; i < 4; ++i) is = is || dot(wall(i), at) > wall_[i] - within;
    return is;
  }

  /// Finds the line on which the half-spaces leave a the most above b: a linear program in x, y and the two
  /// heights, by the dual simplex method. Result: none if rounding keeps it from an end.
  template <typename Team>
  TANDEM_HD LineOfTwo deepest(const Team& team, double tolerance) const;

 private:
  static constexpr int kWalls = 6, kMostPivots = 64;
  static constexpr double kLeastShare = 1e-9;
  static constexpr double kTilt = 1e-10;  ///< what places count, so that no price is 0 and no basis comes again

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
  template <typename Team>
  TANDEM_HD int most_violated(const Team& team, const double (&x)[4], double tolerance) const;

  Vector2 along_;
  double wall_[kWalls];
};

/// The constraint beyond which a point lies most: a wall, or kWalls + i the half-space i; -1 if there is none.
template <typename Team>
TANDEM_HD int HalfSpaces::most_violated(const Team& team, const double (&x)[4], double tolerance) const {
  int worst = -1;
  double most = tolerance;
  for (int i = 0; i < kWalls; ++i) {
    const double at = i < 4 ? dot(wall(i), {x[0], x[1]}) : i == 4 ? x[2] : -x[3];
    if (at - wall_[i] > most) most = at - wall_[i], worst = i;
  }
  int own = kMost;
  double own_most = most;
  for (int i = first_of(team); i < kMost; i += step_of(team)) {
    if (!space[i].counts) continue;
    const double beyond = space[i].beyond({x[0], x[1]}, space[i].side == 0 ? x[2] : x[3]);
    if (beyond > own_most) own_most = beyond, own = i;
  }
  const double greatest = team.greatest(own_most);
  if (!(greatest > most)) return worst;
  return kWalls + team.least(own_most == greatest ? own : kMost);
}

template <typename Team>
TANDEM_HD LineOfTwo HalfSpaces::deepest(const Team& team, double tolerance) const {
  // The rows of the basis are constraints: at first two sides of the square, and how high a may be and how
  // low b.
  const double c = along_.x, s = along_.y;
  double inverse[4][4] = {{c, -s, 0, 0}, {s, c, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, -1}};
  double offset[4] = {wall_[0], wall_[1], wall_[4], wall_[5]}, price[4] = {kTilt, 0.75 * kTilt, 1, 1};
  LineOfTwo out;
  for (int pivot = 0; pivot < kMostPivots; ++pivot) {
    double x[4];
    for (int r = 0; r < 4; ++r) {
      x[r] = 0;
      for (int k = 0; k < 4; ++k) x[r] += inverse[r][k] * offset[k];
    }
    const int worst = most_violated(team, x, tolerance);
    if (worst < 0) {
      out.at = {x[0], x[1]}, out.height[0] = x[2], out.height[1] = x[3];
      out.found = true;
      return out;
    }
    double row[4] = {}, row_offset;
    if (worst < kWalls) {
      const Vector2 n = worst < 4 ? wall(worst) : Vector2{};
      row[0] = n.x, row[1] = n.y, row[2] = worst == 4 ? 1 : 0, row[3] = worst == 5 ? -1 : 0;
      row_offset = wall_[worst];
    } else {
      const HalfSpace& of = space[worst - kWalls];
      row[0] = of.normal.x, row[1] = of.normal.y;
      row[2] = of.side == 0 ? of.normal.z : 0, row[3] = of.side == 0 ? 0 : of.normal.z;
      row_offset = of.offset;
    }
    double share[4], least = INFINITY, share_of_leaving = 1;
    int leaves = -1;
    for (int k = 0; k < 4; ++k) {
      share[k] = 0;
      for (int r = 0; r < 4; ++r) share[k] += row[r] * inverse[r][k];
      if (share[k] > kLeastShare && price[k] < least * share[k])
        least = price[k] / share[k], leaves = k, share_of_leaving = share[k];
    }
    if (leaves < 0) return out;
    for (int k = 0; k < 4; ++k) {
      price[k] = k == leaves ? least : greater(price[k] - least * share[k], 0.0);
      if (k == leaves) offset[k] = row_offset;
    }
    for (int r = 0; r < 4; ++r) {
      double own = 0;
      for (int k = 0; k < 4; ++k) own = k == leaves ? inverse[r][k] / share_of_leaving : own;
      for (int k = 0; k < 4; ++k) inverse[r][k] = k == leaves ? own : inverse[r][k] - own * share[k];
    }
  }
  return out;
}

}  // namespace tandem::manifold
