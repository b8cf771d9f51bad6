#pragma once

namespace tandem {

/// How the surface of a body rubs, bounces and rolls. A number less than 0 stands for that of WorldOptions.
/// Two bodies that touch have the geometric mean of their frictions, the larger restitution, and the larger
/// rolling resistance.
struct Material {
  double friction = -1;            ///< Coulomb's coefficient
  double restitution = -1;         ///< part of the speed that an impact gives back, at most 1
  double rolling_resistance = -1;  ///< lever at which the force between two bodies resists that they turn
                                   ///< against each other

  friend bool operator==(const Material&, const Material&) = default;
};

}  // namespace tandem
