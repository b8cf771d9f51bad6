#pragma once
#include <memory>

namespace tandem {

/// Returns whether CGAL's intervals prove that a ray's line passes a triangle by.
bool surely_passes_by(const double* origin, const double* direction, const double (*corner)[3]);

/// Where a ray first meets a triangle, by rational numbers: the least of all parameters at which the ray may
/// enter the hull of the corners and is in it.
class RayOracle {
 public:
  RayOracle(const double* origin, const double* direction, const double (*corner)[3]);
  RayOracle(RayOracle&&) noexcept;
  RayOracle& operator=(RayOracle&&) noexcept;
  ~RayOracle();

  bool meets() const;
  /// Whether the ray goes through the inside of the triangle, or does not come near it: not through an edge.
  bool is_plain() const;
  /// Whether the parameter is that of `t` up to a part of it.
  bool is_near(double t, double part) const;
  bool is_at_most(double t) const;
  /// Whether weights of corners 1 and 2 are those of the meeting up to `off`. Condition: is_plain().
  bool has_weights(const double* weight, double off) const;
  /// The sign of the difference of the parameters of two that meet.
  static int compare(const RayOracle& x, const RayOracle& y);

 private:
  struct Found;
  std::unique_ptr<Found> found_;
};

}  // namespace tandem
