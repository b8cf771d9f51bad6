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

/// Says how a value stands in a dataset: the type of its numbers, and how many they are. A number is itself.
template <typename Value>
struct Stored {
  using Number = Value;
  static constexpr std::size_t kWidth = 1;
  static void append(std::vector<Number>& numbers, const Value& value) { numbers.push_back(value); }
  static Value at(const std::vector<Number>& numbers, std::size_t i) { return numbers[i]; }
};

/// An enumeration is the number that stands for it.
template <typename Value>
requires std::is_enum_v<Value>
struct Stored<Value> {
  using Number = std::underlying_type_t<Value>;
  static constexpr std::size_t kWidth = 1;
  static void append(std::vector<Number>& numbers, Value value) {
    numbers.push_back(static_cast<Number>(value));
  }
};

template <typename Value, std::size_t kCount>
struct Stored<Value[kCount]> {
  using Number = Value;
  static constexpr std::size_t kWidth = kCount;
  static void append(std::vector<Number>& numbers, const Value (&values)[kCount]) {
    numbers.insert(numbers.end(), values, values + kCount);
  }
};

template <>
struct Stored<ObjectPair> {
  using Number = std::uint32_t;
  static constexpr std::size_t kWidth = 2;
  static void append(std::vector<Number>& numbers, const ObjectPair& pair) {
    numbers.insert(numbers.end(), {pair.a, pair.b});
  }
  static ObjectPair at(const std::vector<Number>& numbers, std::size_t i) {
    return {numbers[2 * i], numbers[2 * i + 1]};
  }
};

/// Says how a member, or a function, of a row stands in a dataset.
template <typename Row, typename Member>
using StoredMember = Stored<std::remove_cvref_t<std::invoke_result_t<Member, const Row&>>>;

/// The shape of a row of a dataset of such values.
template <typename Of>
Shape row_shape() {
  return Of::kWidth == 1 ? Shape() : Shape{Of::kWidth};
}

/// Returns what a member, or a function, says of each row: numbers, those of one row after the other.
template <typename Row, typename Member>
auto column(std::span<const Row> rows, const Member& member) {
  using Of = StoredMember<Row, Member>;
  std::vector<typename Of::Number> numbers;
  for (const Row& row : rows) Of::append(numbers, std::invoke(member, row));
  return numbers;
}

/// Adds what a member, or a function, says of each row: a dataset of as many rows. Throws OutputError.
template <typename Row, typename Member>
void add_column(Hdf5Output& file, const std::string& name, std::span<const Row> rows, const Member& member) {
  Shape shape = row_shape<StoredMember<Row, Member>>();
  shape.insert(shape.begin(), rows.size());
  file.add(name, shape, column(rows, member));
}

/// Two numbers for each pair.
inline std::vector<std::uint32_t> flat(std::span<const ObjectPair> pairs) {
  return column(pairs, std::identity());
}

/// Adds them, two to a row. Throws OutputError.
inline void add_pairs(Hdf5Output& file, const std::string& name, std::span<const ObjectPair> pairs) {
  add_column(file, name, pairs, std::identity());
}

/// The values of a dataset, one of each row. Throws FileError.
template <typename Value>
std::vector<Value> read_values(const Hdf5Input& file, const std::string& name) {
  using Of = Stored<Value>;
  const auto numbers = [&] {
    if constexpr (std::is_same_v<typename Of::Number, double>) return file.read_f64(name, row_shape<Of>());
    if constexpr (std::is_same_v<typename Of::Number, std::uint32_t>)
      return file.read_u32(name, row_shape<Of>());
    if constexpr (std::is_same_v<typename Of::Number, std::uint64_t>)
      return file.read_u64(name, row_shape<Of>());
  }();
  std::vector<Value> values;
  values.reserve(numbers.size() / Of::kWidth);
  for (std::size_t i = 0; i < numbers.size() / Of::kWidth; ++i) values.push_back(Of::at(numbers, i));
  return values;
}

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
