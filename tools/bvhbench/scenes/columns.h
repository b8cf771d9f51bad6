#pragma once
#include <functional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "hdf5_file.h"
#include "tandem/formats/hash.h"

/// Rows of structs as HDF5 files have them: a dataset for each member.
namespace tandem::bench {

/// What a member, or a function, says of each row: numbers; those of arrays one after the other; enumerations
/// as the numbers that stand for them.
template <typename Row, typename Member>
auto column(std::span<const Row> rows, const Member& member) {
  using Value = std::remove_cvref_t<std::invoke_result_t<Member, const Row&>>;
  if constexpr (std::is_array_v<Value>) {
    std::vector<std::remove_extent_t<Value>> all;
    for (const Row& row : rows)
      all.insert(all.end(), std::begin(std::invoke(member, row)), std::end(std::invoke(member, row)));
    return all;
  } else if constexpr (std::is_enum_v<Value>) {
    std::vector<std::underlying_type_t<Value>> all;
    for (const Row& row : rows)
      all.push_back(static_cast<std::underlying_type_t<Value>>(std::invoke(member, row)));
    return all;
  } else {
    std::vector<Value> all;
    for (const Row& row : rows) all.push_back(std::invoke(member, row));
    return all;
  }
}

/// Adds what a member, or a function, says of each row: a dataset of as many rows. Throws OutputError.
template <typename Row, typename Member>
void add_column(Hdf5Output& file, const std::string& name, std::span<const Row> rows, const Member& member) {
  using Value = std::remove_cvref_t<std::invoke_result_t<Member, const Row&>>;
  Shape shape = {rows.size()};
  if constexpr (std::is_array_v<Value>) shape.push_back(std::extent_v<Value>);
  file.add(name, shape, column(rows, member));
}

/// Two numbers for each pair.
std::vector<std::uint32_t> flat(std::span<const ObjectPair> pairs);

/// Adds them, two to a row. Throws OutputError.
void add_pairs(Hdf5Output& file, const std::string& name, std::span<const ObjectPair> pairs);

/// XXH64 of the columns' values, one column after the other.
template <typename... Value>
std::uint64_t hash_of_columns(const std::vector<Value>&... columns) {
  std::vector<std::byte> all;
  const auto add = [&](std::span<const std::byte> bytes) {
    all.insert(all.end(), bytes.begin(), bytes.end());
  };
  (add(std::as_bytes(std::span(columns))), ...);
  return xxh64(all.data(), all.size());
}

}  // namespace tandem::bench
