#pragma once
#ifdef PROBE
#include <cstdio>
#include <cstdlib>
#endif
#include "kernels/manifold/surface_line.h"

namespace tandem::manifold {

/// What is known of one body from one of its triangles: near there it lies where dot(normal, x) <= offset, x
/// being the coordinates along the axes of the patch's frame.
struct HalfSpace {
  Vector3 normal;
  double offset;
  std::uint32_t triangle = kNoIndex;
  int side;

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

/// The half-spaces that are known of two bodies, and the square across the normal that lines are to go through.
class HalfSpaces {
 public:
  static constexpr int kMost = 32;

  /// middle, along, half: the square's middle, the direction of two sides, half their length; far: heights
  /// are between -far and far.
  TANDEM_HD void begin(const Vector2& middle, const Vector2& along, double half, double far) {
    count_ = next_ = 0;
    const double size = norm(along);
    along_ = size > 0 ? (1 / size) * along : Vector2{1, 0};
    for (int i = 0; i < 4; ++i) wall_[i] = dot(wall(i), middle) + half;
    wall_[4] = wall_[5] = far;
  }
  TANDEM_HD bool knows(int side, std::uint32_t triangle) const {
    bool does = false;
    for (int i = 0; i < count_; ++i)
      does = does || (space_[i].triangle == triangle && space_[i].side == side);
    return does;
  }
  /// The oldest gives way if there is no room.
  TANDEM_HD void add(const HalfSpace& space) {
    space_[count_ < kMost ? count_++ : next_++ % kMost] = space;
  }
  /// Forgets those beyond which the body goes on.
  TANDEM_HD void drop_before(int side, const Vector2& at, double height, double tolerance) {
    int kept = 0;
    for (int i = 0; i < count_; ++i) {
      if (space_[i].side != side || space_[i].beyond(at, height) <= tolerance) space_[kept++] = space_[i];
    }
    count_ = kept;
  }

  /// Returns the triangle of the half-space that ends nearest to a point of one body's, or kNoIndex if none
  /// ends within a distance.
  TANDEM_HD std::uint32_t nearest_triangle(int side, const Vector2& at, double height, double within) const {
    std::uint32_t triangle = kNoIndex;
    double nearest = within;
    for (int i = 0; i < count_; ++i) {
      const double apart = std::fabs(space_[i].beyond(at, height));
      if (space_[i].side == side && apart < nearest) nearest = apart, triangle = space_[i].triangle;
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
  TANDEM_HD LineOfTwo deepest(double tolerance) const {
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
      int worst = -1;
      double most = tolerance;
      for (int i = 0; i < kWalls; ++i) {
        const double at = i < 4 ? dot(wall(i), {x[0], x[1]}) : i == 4 ? x[2] : -x[3];
        if (at - wall_[i] > most) most = at - wall_[i], worst = i;
      }
      for (int i = 0; i < count_; ++i) {
        const double beyond = space_[i].beyond({x[0], x[1]}, x[2 + space_[i].side]);
        if (beyond > most) most = beyond, worst = kWalls + i;
      }
      if (worst < 0) {
        out.at = {x[0], x[1]}, out.height[0] = x[2], out.height[1] = x[3];
        out.found = true;
        return out;
      }
      double row[4] = {}, row_offset;
      if (worst < kWalls) {
        if (worst < 4)
          row[0] = wall(worst).x, row[1] = wall(worst).y;
        else
          row[worst - 2] = worst == 4 ? 1 : -1;
        row_offset = wall_[worst];
      } else {
        const HalfSpace& space = space_[worst - kWalls];
        row[0] = space.normal.x, row[1] = space.normal.y, row[2 + space.side] = space.normal.z;
        row_offset = space.offset;
      }
      double share[4];
      int leaves = -1;
      double least = INFINITY;
      for (int k = 0; k < 4; ++k) {
        share[k] = 0;
        for (int r = 0; r < 4; ++r) share[k] += row[r] * inverse[r][k];
        if (share[k] > kLeastShare && price[k] < least * share[k]) least = price[k] / share[k], leaves = k;
      }
#ifdef PROBE
      if (getenv("TRACE2")) printf("    pivot %d worst %d beyond %.3g share %.3g %.3g %.3g %.3g price %.3g %.3g %.3g %.3g leaves %d x %.6g %.6g %.6g %.6g\n", pivot, worst, most, share[0], share[1], share[2], share[3], price[0], price[1], price[2], price[3], leaves, x[0], x[1], x[2], x[3]);
#endif
      if (leaves < 0) return out;
      for (int k = 0; k < 4; ++k) price[k] = k == leaves ? least : greater(price[k] - least * share[k], 0.0);
      offset[leaves] = row_offset;
      for (int r = 0; r < 4; ++r) {
        const double own = inverse[r][leaves] / share[leaves];
        for (int k = 0; k < 4; ++k) inverse[r][k] = k == leaves ? own : inverse[r][k] - own * share[k];
      }
    }
    return out;
  }

#ifndef PROBE
 private:
#endif
  static constexpr int kWalls = 6, kMostPivots = 64;
  static constexpr double kLeastShare = 1e-9;
  static constexpr double kTilt = 1e-10;  ///< what places count, so that no price is 0 and no basis comes again

  /// The normal of a side of the square.
  TANDEM_HD Vector2 wall(int i) const {
    const Vector2 n = i % 2 == 0 ? along_ : Vector2{-along_.y, along_.x};
    return i < 2 ? n : -1.0 * n;
  }

  HalfSpace space_[kMost];
  Vector2 along_;
  double wall_[kWalls];
  int count_;
  int next_;
};

}  // namespace tandem::manifold
