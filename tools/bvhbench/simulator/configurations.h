#pragma once
#include <cstdint>
#include <vector>

#include "rigid_body.h"
#include "tandem/formats/view.h"

/// The configurations of the paper's test-bed, as they are before the first step. The same arguments give the
/// same poses on every platform.
namespace tandem::simulation {

/// Bodies and what moves them.
struct Configuration {
  std::vector<Instance> instances;
  std::vector<Motion> motion;  ///< of each instance

  void add(const Instance& instance, Motion moved_by);
};

/// A cube of side^3 boxes, asset 0, on a floor of side^2 fixed ones, which come first. Each box is moved
/// along x and y by up to `jitter` box lengths, and stands in the one below by `sink`, a length.
Configuration structured_stack(const AssetView& box, std::uint32_t side, double jitter, double sink,
                               std::uint64_t seed);

/// `count` bodies, asset 0, at random rotations and places near those of a cubic lattice, above the fixed
/// ground, asset 1, which comes first. No two bodies touch: those that did are turned and moved anew, and
/// where that does not help the lattice is made wider. Throws std::bad_alloc.
Configuration unstructured_pile(const AssetView& body, const AssetView& ground, std::uint32_t count,
                                std::uint64_t seed);

/// make_slide(): bodies strewn on a sheet tilted about the y axis by `tilt` degrees. The fixed sheets, asset
/// 1, come first. Throws std::runtime_error where a sheet is smaller than a body.
Configuration rock_slide(const AssetView& body, const AssetView& ground, std::uint32_t count, double tilt,
                         std::uint64_t seed);

}  // namespace tandem::simulation
