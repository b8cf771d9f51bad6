#pragma once
#include <cmath>
#include <cstdint>

namespace tandem {

/// The volume that a closed surface encloses, summed triangle by triangle, to tell which side is inside.
///
/// Six times the volume is the sum over the triangles of the triple product of their corners' differences
/// from one point, whichever. Each of the six products in a triple product meets six roundings of float64,
/// and n triangles add 3 n parts, so the sum is off by at most (3 n + 6) 2^-53 (1 + 2^-20) times the sum of
/// the products' magnitudes. That sum itself is computed too small by the same factor at most, for which the
/// second half of 2^-52 makes up. Differences are below 2^129, products below 2^388: nothing overflows.
class EnclosedVolume {
 public:
  /// about: the point; best one of the surface, so that little cancels.
  explicit EnclosedVolume(const float* about) : about_{about[0], about[1], about[2]} {}

  void add(const float* a, const float* b, const float* c) {
    const float* corner[3] = {a, b, c};
    double x[3][3];
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) x[i][k] = double{corner[i][k]} - about_[k];
    }
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      sum_ += x[0][k] * (x[1][l] * x[2][m] - x[1][m] * x[2][l]);
      magnitude_ += std::fabs(x[0][k]) * (std::fabs(x[1][l] * x[2][m]) + std::fabs(x[1][m] * x[2][l]));
    }
    ++triangles_;
  }

  /// Returns whether the triangles go round clockwise as seen from outside; false where roundings would
  /// decide.
  bool is_inside_out() const { return sum_ < -(3 * triangles_ + 6) * 0x1p-52 * magnitude_; }

 private:
  double about_[3];
  double sum_ = 0, magnitude_ = 0, triangles_ = 0;
};

}  // namespace tandem
