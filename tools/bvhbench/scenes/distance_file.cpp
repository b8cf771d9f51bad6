#include "distance_file.h"

#include <vector>

#include "common/number_words.h"
#include "hdf5_file.h"
#include "tandem/formats/hash.h"

namespace tandem::bench {
namespace {

std::vector<std::uint32_t> flat(std::span<const ObjectPair> pairs) {
  std::vector<std::uint32_t> out;
  for (const ObjectPair& pair : pairs) out.insert(out.end(), {pair.a, pair.b});
  return out;
}

template <typename Value, typename Member>
std::vector<Value> column(std::span<const ObjectDistance> distances, Member ObjectDistance::*member) {
  std::vector<Value> out;
  for (const ObjectDistance& distance : distances) out.push_back(distance.*member);
  return out;
}

std::vector<double> points(std::span<const ObjectDistance> distances, double (ObjectDistance::*member)[3]) {
  std::vector<double> out;
  for (const ObjectDistance& distance : distances)
    out.insert(out.end(), std::begin(distance.*member), std::end(distance.*member));
  return out;
}

}  // namespace

std::uint64_t hash_of(std::span<const ObjectPair> pairs, std::span<const ObjectDistance> distances) {
  std::vector<std::uint8_t> all;
  const auto add = [&](const auto& values) {
    const auto* const bytes = reinterpret_cast<const std::uint8_t*>(values.data());
    all.insert(all.end(), bytes, bytes + values.size() * sizeof values[0]);
  };
  add(flat(pairs));
  add(column<double>(distances, &ObjectDistance::lower));
  add(column<double>(distances, &ObjectDistance::upper));
  return xxh64(all.data(), all.size());
}

void write_distances(const std::string& path, std::span<const ObjectPair> pairs,
                     std::span<const ObjectDistance> distances, const DistanceRecord& record) {
  const std::uint64_t m = pairs.size();
  Hdf5Output file(path);
  file.add("/pairs", {m, 2}, flat(pairs));
  file.add("/distance/lower", {m}, column<double>(distances, &ObjectDistance::lower));
  file.add("/distance/upper", {m}, column<double>(distances, &ObjectDistance::upper));
  file.add("/distance/point_a", {m, 3}, points(distances, &ObjectDistance::point_a));
  file.add("/distance/point_b", {m, 3}, points(distances, &ObjectDistance::point_b));
  file.add("/distance/face_a", {m}, column<std::uint32_t>(distances, &ObjectDistance::face_a));
  file.add("/distance/face_b", {m}, column<std::uint32_t>(distances, &ObjectDistance::face_b));
  file.attribute("tandem_version", std::string(TANDEM_VERSION));
  file.attribute("backend", record.backend);
  file.attribute("absolute_tolerance", record.tolerance.absolute);
  file.attribute("relative_tolerance", record.tolerance.relative);
  file.attribute("reach", record.reach);
  file.attribute("given_pairs", std::uint64_t{record.given_pairs});
  file.attribute("threads", record.threads);
  file.attribute("repeats", std::uint64_t{record.seconds.size()});
  file.attribute("best_seconds", best_of(record.seconds));
  file.attribute("median_seconds", median_of(record.seconds));
  file.attribute("object_pairs", record.counters.object_pairs);
  file.attribute("block_pairs", record.counters.block_pairs);
  file.attribute("by_float32", record.counters.by_float32);
  file.attribute("by_float64", record.counters.by_float64);
  file.attribute("touching", record.counters.touching);
  file.attribute("hash", hexadecimal(hash_of(pairs, distances)));
  file.write();
}

}  // namespace tandem::bench
