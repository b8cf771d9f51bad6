#pragma once
#include <cstdint>
#include <vector>

#include "common/random_pose.h"

/// Generators of posed snapshots. The same arguments give the same poses on every platform: random numbers
/// are SplitMix64's, and arithmetic is float64 with +, -, *, / and square roots alone. docs/scene_kinds.md
/// describes the scenes.
namespace tandem::bench {

/// The arguments of every scene. The mesh is asset 0.
struct SceneSeed {
  std::uint64_t seed = 1;
  Vector offset = {};  ///< added to every translation
};

/// A cube of cubes, side^3 boxes, identity rotations. jitter: how far a box is moved along each axis at most,
/// in box lengths, uniformly; 0: faces coincide exactly as posed float64 points.
/// Throws std::runtime_error where float64 has no such positions.
std::vector<Instance> make_stack(const AssetView& box, std::uint32_t side, double jitter, const SceneSeed&);

/// `count` bodies at random rotations on a jittered cubic lattice. Its spacing is such that a body's world
/// box meets those of `neighbours` others on average, to 1 % where `count` allows it.
std::vector<Instance> make_pile(const AssetView& body, std::uint32_t count, double neighbours,
                                const SceneSeed&);

/// `count` bodies at random rotations on a cubic lattice, each moved along each axis by up to a quarter of
/// the spacing, which is in lengths of the body's longest side.
std::vector<Instance> make_lattice(const AssetView& body, std::uint32_t count, double spacing,
                                   const SceneSeed&);

/// Bodies strewn on a sheet of ground whose heights are its z, the whole tilted about the y axis by `tilt`
/// degrees. Instances of asset 1, the sheet, come first: one, or a square of them where the bodies need it.
/// Throws std::runtime_error where a sheet is smaller than a body.
std::vector<Instance> make_slide(const AssetView& body, const AssetView& ground, std::uint32_t count,
                                 double tilt, const SceneSeed&);

/// `count` pairs of instances, 2 i and 2 i + 1, each in one random pose exactly; pairs do not touch.
std::vector<Instance> make_coincident(const AssetView& body, std::uint32_t count, const SceneSeed&);

/// A heap of `count` moving bodies on a layer of `fixed` fixed ones, which come first: as make_lattice(),
/// with the layer square, the heap a cube over the layer's middle, a spacing higher.
std::vector<Instance> make_field(const AssetView& body, std::uint32_t fixed, std::uint32_t count,
                                 double spacing, const SceneSeed&);

/// Adds the offset to every translation.
void move(std::vector<Instance>& instances, const Vector& offset);

/// The least n with n^power >= count. Condition: power is 2 or 3.
std::uint32_t root_above(std::uint32_t count, int power);

/// Finds the instances whose world boxes meet, and that the filter looks at: the object pairs that a query
/// finds, a < b, sorted. Throws std::bad_alloc, std::runtime_error (coordinates beyond what a query takes).
std::vector<ObjectPair> find_box_pairs(const std::vector<AssetView>& assets,
                                       const std::vector<Instance>& instances, const PairFilter& filter = {});

}  // namespace tandem::bench
