#pragma once
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "kernels/geometry/triangle_test.h"

/// Seeded families of triangle pairs, from harmless to hostile.
namespace tandem {

using Random = std::mt19937_64;

struct TriangleFamily {
  const char* name;
  TrianglePair (*make)(Random&);

  /// The name with _ for blanks.
  std::string identifier() const;
};

inline std::ostream& operator<<(std::ostream& out, const TriangleFamily& family) {
  return out << family.name;
}

/// All coordinates of a pair, as C++ reads them.
std::string text(const TrianglePair& pair);

/// The pair with a for b.
TrianglePair swapped(const TrianglePair& pair);

/// Every family. Each pair is finite.
const std::vector<TriangleFamily>& triangle_families();

/// Triangles of one size at random places near each other: what a query meets mostly.
TrianglePair generic_pair(Random& random);

/// Corners on the integer points of [0, 4]^3.
TrianglePair grid_pair(Random& random);

/// Coordinates of every magnitude that a float64 has, mixed.
TrianglePair any_exponent_pair(Random& random);

int uniform(Random& random, int lowest, int highest);
double uniform(Random& random, double lowest, double highest);

}  // namespace tandem
