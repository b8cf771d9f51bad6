#include "verdicts_file.h"

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

template <typename Member>
std::vector<std::uint8_t> column(std::span<const PairVerdict> verdicts, Member PairVerdict::*member) {
  std::vector<std::uint8_t> out;
  for (const PairVerdict& verdict : verdicts) out.push_back(static_cast<std::uint8_t>(verdict.*member));
  return out;
}

}  // namespace

std::uint64_t hash_of(std::span<const ObjectPair> pairs, std::span<const PairVerdict> verdicts) {
  const std::vector<std::uint32_t> numbers = flat(pairs);
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(numbers.data());
  std::vector<std::uint8_t> all(bytes, bytes + numbers.size() * sizeof numbers[0]);
  const std::vector<std::uint8_t> verdict = column(verdicts, &PairVerdict::verdict);
  all.insert(all.end(), verdict.begin(), verdict.end());
  return xxh64(all.data(), all.size());
}

void write_verdicts(const std::string& path, std::span<const ObjectPair> pairs,
                    std::span<const PairVerdict> verdicts, const VerdictRecord& record) {
  const std::uint64_t m = pairs.size();
  const ToleranceCounters& counters = record.counters;
  Hdf5Output file(path);
  file.add("/pairs", {m, 2}, flat(pairs));
  file.add("/verdict/verdict", {m}, column(verdicts, &PairVerdict::verdict));
  file.add("/verdict/level_a", {m}, column(verdicts, &PairVerdict::level_a));
  file.add("/verdict/level_b", {m}, column(verdicts, &PairVerdict::level_b));
  file.attribute("tandem_version", std::string(TANDEM_VERSION));
  file.attribute("backend", record.backend);
  file.attribute("tolerance", record.tolerance);
  file.attribute("given_pairs", std::uint64_t{record.given_pairs});
  file.attribute("threads", record.threads);
  file.attribute("repeats", std::uint64_t{record.seconds.size()});
  file.attribute("best_seconds", best_of(record.seconds));
  file.attribute("median_seconds", median_of(record.seconds));
  file.attribute("object_pairs", m);
  file.attribute("apart", counters.apart);
  file.attribute("touching", counters.touching);
  file.attribute("within_tolerance", counters.within_tolerance);
  file.attribute("block_pairs", counters.work.block_pairs);
  file.attribute("candidates", counters.work.candidates);
  file.attribute("hash", hexadecimal(hash_of(pairs, verdicts)));
  file.write();
}

}  // namespace tandem::bench
