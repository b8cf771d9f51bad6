#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "dynamics/linear.h"
#include "tandem/formats/view.h"

namespace tandem::dynamics {

/// The mass of a body of density 1, and how it is spread, in the coordinates of the mesh file.
struct MassProperties {
  double volume;                ///< mass per density
  Vector3 centre;               ///< of mass
  Matrix3 inertia_per_density;  ///< about the centre of mass, along the file's axes
};

/// Says what the mass of a mesh is taken to be.
enum class MassModel : std::uint8_t {
  solid,  ///< what the surface encloses
  shell,  ///< the surface itself, as thick as kShellThickness: of meshes that enclose nothing
};

/// Thickness of a shell, as a part of the diagonal of the mesh's bounds.
inline constexpr double kShellThickness = 0.01;

/// Mass properties and how they came about.
struct MassReport {
  MassProperties properties;
  MassModel model;
  std::size_t components;             ///< parts that share no edge
  std::vector<std::string> findings;  ///< what is amiss and what was done about it, a sentence each
};

/// Integrates over level 0 of the asset: exact integrals of polynomials over each triangle (Mirtich 1996;
/// Eberly 2002), summed about a point of the mesh, so that meshes far from zero keep their accuracy.
///
/// A mesh that is not closed has findings, and a way on: windings that contradict each other are made to
/// agree; a component that is inside out is turned, unless it is a cavity of another; a mesh with a boundary,
/// or whose triangles cannot be wound consistently, or that encloses no volume, is taken for a shell.
/// Throws std::runtime_error where even the shell has no extent.
MassReport mass_properties(const AssetView& asset);

/// Returns the distance of the farthest vertex from a point in the file's coordinates.
double radius_about(const Vector3& centre, const AssetView& asset);

/// Returns for each shape half the least side of its bounds; of one that is not closed, which has no inside
/// to be passed through within, infinite.
std::vector<double> inner_radii(std::span<const AssetView> shapes);

}  // namespace tandem::dynamics
