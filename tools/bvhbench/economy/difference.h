#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "tandem/kernels/contact_query.h"

namespace tandem::economy {

/// A contact manifold as two levels are compared by it.
struct Patch {
  ObjectPair pair;
  std::array<double, 3> normal;  ///< unit, from pair.a towards pair.b
  std::array<double, 3> centre;  ///< in the world
  double depth;
};

/// The findings of a query in a scene.
struct Findings {
  std::uint64_t object_pairs = 0, contacts = 0;
  std::vector<ObjectPair> touching;  ///< pairs with a contact; a < b, sorted, each once
  std::vector<Patch> patches;        ///< in any order
};

/// The spread of some numbers that are not negative: half of them are at most `median`, 95 of 100 at most
/// `most`.
struct Spread {
  double mean = 0, median = 0, most = 0, largest = 0;
};

/// 0 of no numbers.
Spread spread_of(std::vector<double> numbers);

/// The difference of the depth of a manifold; for one without a match, its whole depth.
struct DepthChange {
  ObjectPair pair;
  double by;
};

/// The changes that a coarser level makes.
struct Difference {
  std::uint64_t touching_pairs = 0;                 ///< at the finest
  std::uint64_t lost_pairs = 0, new_pairs = 0;      ///< touching at the finest alone; at the coarser alone
  std::uint64_t matched = 0;                        ///< manifolds with one to compare them with
  std::uint64_t lost_patches = 0, new_patches = 0;  ///< manifolds without
  Spread angle;                                     ///< between the normals of matched manifolds, in degrees
  Spread depth;                                     ///< of `depths`
  std::vector<DepthChange> depths;
};

/// Manifolds are matched within each object pair, those nearest to each other first, by their centres.
Difference difference(const Findings& finest, const Findings& coarser);

}  // namespace tandem::economy
