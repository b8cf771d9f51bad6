#pragma once
#include <array>
#include <cstdint>

#include "tandem/formats/view.h"
#include "tandem/kernels/contact_query.h"

/// Random numbers and rotations that are the same on every platform, and bodies placed by them: float64 with
/// +, -, *, / and square roots alone.
namespace tandem {

using Vector = std::array<double, 3>;
using Rotation = std::array<Vector, 3>;

/// SplitMix64 (Steele, Lea and Flood 2014).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  /// Goes on as if `draws` numbers had been drawn. They are all different, up to 2^64 of them.
  void skip(std::uint64_t draws);

  std::uint64_t next();
  double uniform();                            ///< in [0, 1), a multiple of 2^-53
  double between(double lower, double upper);  ///< uniform

 private:
  std::uint64_t state_;
};

/// Returns the rotation of a unit quaternion, uniformly distributed: a point of the unit ball of four
/// dimensions, found by rejection.
Rotation random_rotation(Random& random);

/// A unit vector, uniformly distributed, found likewise.
Vector random_direction(Random& random);

/// Returns the rotation of the quaternion (w, x, y, z) of any length but 0.
Rotation rotation_of(double w, double x, double y, double z);

Rotation multiply(const Rotation& a, const Rotation& b);
Vector multiply(const Rotation& a, const Vector& x);

/// A body's bounds in the file's coordinates.
struct Bounds {
  Vector lower, upper;

  Vector centre() const;
  double diagonal() const;
};

Bounds bounds_of(const AssetView& asset);

/// An instance turned by `rotation` whose point `centre`, of the file's coordinates, lies at `position`.
Instance place(std::uint32_t asset, const Rotation& rotation, const Vector& centre, const Vector& position);

}  // namespace tandem
