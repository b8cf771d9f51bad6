#pragma once
#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "tandem/kernels/contact_query.h"

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

/// Makes the table of contacts of any order. views: the shapes of the instances; contacts: rows with the
/// numbers `pair`, `triangle_a` and `triangle_b`. Condition on pairs: normalised.
template <typename Contacts>
ContactTable table_of(std::span<const AssetView> views, std::span<const Instance> instances,
                      std::span<const ObjectPair> pairs, const Contacts& contacts) {
  const auto face = [&](std::uint32_t instance, std::uint32_t triangle) {
    return views[instances[instance].asset].level().triangles[triangle].source_face();
  };
  std::vector<FaceContact> faces;
  faces.reserve(contacts.size());
  for (const auto& row : contacts)
    faces.push_back(
        {row.pair, face(pairs[row.pair].a, row.triangle_a), face(pairs[row.pair].b, row.triangle_b)});
  return make_table(pairs, std::move(faces));
}

/// XXH64 of pairs, pair, face_a and face_b, one after the other, as little-endian 32-bit numbers.
std::uint64_t hash_of(const ContactTable& table);

}  // namespace tandem::bench
