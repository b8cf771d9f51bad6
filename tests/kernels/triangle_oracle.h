#pragma once
#include <memory>

#include "kernels/geometry/triangle_test.h"

namespace tandem {

/// By what a test divides how many pairs it judges: 1, or 20 where Boost's rational numbers stand in for
/// GMP's, which are as many times as fast.
int oracle_share();

/// Returns whether the triangles meet, as CGAL finds by rational numbers: a flat triangle is dispatched as
/// the segment or point that it is.
bool oracle_contact(const TrianglePair& pair);

/// The distance of two triangles by rational numbers.
class DistanceOracle {
 public:
  explicit DistanceOracle(const TrianglePair& pair);
  ~DistanceOracle();

  bool meet() const;
  bool is_in(double lower, double upper) const;
  double rounded() const;

 private:
  struct Square;
  std::unique_ptr<Square> square_;
};

/// |computed - det(q - p, r - p, s - p)|, by rational numbers, rounded at the end.
double oracle_volume_error(const double* p, const double* q, const double* r, const double* s,
                           double computed);

/// Returns the error of a computed component k of (q - p) x (r - p).
double oracle_area_error(const double* p, const double* q, const double* r, int k, double computed);

/// The sign of det(q - p, r - p, s - p), by rational numbers.
int oracle_volume_sign(const double* p, const double* q, const double* r, const double* s);

}  // namespace tandem
