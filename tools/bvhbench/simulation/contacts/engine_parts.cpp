#include "engine_parts.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "tandem/formats/status.h"

namespace tandem::simulation {

void keep_active(std::span<const ObjectPair> pairs, std::span<const std::uint8_t> idle,
                 std::vector<ObjectPair>& kept) {
  kept.clear();
  for (const ObjectPair& pair : pairs) {
    if (idle.empty() || idle[pair.a] == 0 || idle[pair.b] == 0) kept.push_back(pair);
  }
}

void sort_contacts(std::size_t pairs, std::vector<TriangleContact>& contacts) {
  std::vector<std::size_t> begin(pairs + 1, 0);
  for (const TriangleContact& contact : contacts) ++begin[contact.pair + 1];
  for (std::size_t i = 0; i < pairs; ++i) begin[i + 1] += begin[i];
  const auto by_pair = [](const TriangleContact& x, const TriangleContact& y) { return x.pair < y.pair; };
  if (!std::is_sorted(contacts.begin(), contacts.end(), by_pair)) {
    std::vector<TriangleContact> placed(contacts.size());
    std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
    for (const TriangleContact& contact : contacts) placed[next[contact.pair]++] = contact;
    contacts.swap(placed);
  }
  const auto by_triangles = [](const TriangleContact& x, const TriangleContact& y) {
    const auto key = [](const TriangleContact& c) {
      return std::uint64_t{c.triangle_a} << 32 | c.triangle_b;
    };
    return key(x) < key(y);
  };
  oneapi::tbb::parallel_for(std::size_t{0}, pairs, [&](std::size_t i) {
    std::sort(contacts.begin() + static_cast<std::ptrdiff_t>(begin[i]),
              contacts.begin() + static_cast<std::ptrdiff_t>(begin[i + 1]), by_triangles);
  });
}

void require(std::string_view engine, Status status, std::uint64_t where) {
  if (status == Status::kOk) return;
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  const bool body = subject(status) != nullptr;
  throw std::runtime_error(std::string(engine) + ": " + (body ? "body " + std::to_string(where) + ": " : "") +
                           explain(status));
}

}  // namespace tandem::simulation
