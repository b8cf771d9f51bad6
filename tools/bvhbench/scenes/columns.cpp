#include "columns.h"

namespace tandem::bench {

std::vector<std::uint32_t> flat(std::span<const ObjectPair> pairs) {
  std::vector<std::uint32_t> numbers;
  for (const auto& [a, b] : pairs) numbers.insert(numbers.end(), {a, b});
  return numbers;
}

void add_pairs(Hdf5Output& file, const std::string& name, std::span<const ObjectPair> pairs) {
  file.add(name, {pairs.size(), 2}, flat(pairs));
}

}  // namespace tandem::bench
