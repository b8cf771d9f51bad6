#pragma once
#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "hdf5_file.h"
#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/manifold.h"

namespace tandem::bench {

/// The answer of a query in the order of a contacts file, by source faces, so that the answers of different
/// programs can be compared.
struct ContactTable {
  std::vector<ObjectPair> pairs;      ///< sorted; a < b, or a = b for an instance with itself
  std::vector<std::uint32_t> pair;    ///< a row of pairs for each contact; contacts are sorted by pair,
  std::vector<std::uint32_t> face_a;  ///< then face_a, source face of pairs[pair].a,
  std::vector<std::uint32_t> face_b;  ///< then face_b; of an instance with itself face_a <= face_b
};

/// Returns each pair once, a <= b, sorted.
std::vector<ObjectPair> normalised(std::span<const ObjectPair> pairs);

/// Source faces that meet, of the instances in row `pair` of the object pairs.
struct FaceContact {
  std::uint32_t pair, face_a, face_b;

  friend auto operator<=>(const FaceContact&, const FaceContact&) = default;
};

/// Condition on pairs: normalised.
ContactTable make_table(std::span<const ObjectPair> pairs, std::vector<FaceContact> contacts);

/// XXH64 of pairs, pair, face_a and face_b, one after the other, as little-endian 32-bit numbers.
std::uint64_t hash_of(const ContactTable& table);

/// Adds the datasets of a contacts file (docs/scenes.md). Throws OutputError.
void add_contacts(Hdf5Output& file, const ContactTable& table);

/// Adds those of contact manifolds. Manifold::pair is a row of the table's pairs.
void add_manifolds(Hdf5Output& file, std::span<const Manifold> manifolds,
                   std::span<const ManifoldPoint> points);

/// Adds those of bodies within bodies. Containment::pair is a row of the table's pairs.
void add_contained(Hdf5Output& file, std::span<const Containment> rows);

}  // namespace tandem::bench
