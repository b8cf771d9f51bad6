#include "engine.h"

#include <algorithm>
#include <bit>
#include <new>

#include "tandem/formats/status.h"

namespace tandem {
namespace {

// Sorts by digits of the three numbers, packed as tightly as they allow: with 1,000 cows in half the time, or
// less, that sorting each body pair's by comparison takes.
void sort_contacts(std::vector<TriangleContact>& contacts) {
  TriangleContact largest = {0, 0, 0};
  for (const TriangleContact& c : contacts) {
    largest = {largest.pair | c.pair, largest.triangle_a | c.triangle_a, largest.triangle_b | c.triangle_b};
  }
  const int bits_b = std::bit_width(largest.triangle_b), bits_a = std::bit_width(largest.triangle_a);
  const int bits = bits_b + bits_a + std::bit_width(largest.pair);
  if (bits > 64) return std::sort(contacts.begin(), contacts.end());
  std::vector<std::uint64_t> keys(contacts.size()), sorted(contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const TriangleContact& c = contacts[i];
    keys[i] = (std::uint64_t{c.pair} << bits_a | c.triangle_a) << bits_b | c.triangle_b;
  }
  constexpr int kDigit = 11;
  for (int shift = 0; shift < bits; shift += kDigit) {
    const auto digit = [&](std::uint64_t key) { return key >> shift & ((1u << kDigit) - 1); };
    std::size_t next[1 << kDigit] = {};
    for (const std::uint64_t key : keys) ++next[digit(key)];
    std::size_t begin = 0;
    for (std::size_t& place : next) place = std::exchange(begin, begin + place);
    for (const std::uint64_t key : keys) sorted[next[digit(key)]++] = key;
    keys.swap(sorted);
  }
  const auto low = [](std::uint64_t key, int count) {
    return static_cast<std::uint32_t>(key & ((std::uint64_t{1} << count) - 1));
  };
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const std::uint64_t key = keys[i];
    contacts[i] = {static_cast<std::uint32_t>(key >> bits_b >> bits_a), low(key >> bits_b, bits_a),
                   low(key, bits_b)};
  }
}

}  // namespace

void check_kept(std::span<const Manifold> manifolds, std::span<const ManifoldPoint> points,
                const TimedManifolds& found) {
  const auto same = [](const auto& kept, const auto& rows) {
    return std::ranges::equal(std::as_bytes(std::span(kept)), std::as_bytes(std::span(rows)));
  };
  if (!same(manifolds, found.manifolds) || !same(points, found.points))
    throw std::runtime_error("manifolds that were kept are not those that were found");
}

void Engine::cannot(const char* what) const {
  throw std::logic_error("the engine " + std::string(name_) + " was not made to " + what);
}
TimedAnswer Engine::time_query(const TimedQuery& asked) {
  TimedAnswer answer;
  std::span<const ObjectPair> pairs;
  if (asked.given == nullptr) keep_fixed();
  for (std::uint32_t i = 0; i < asked.repeats; ++i) {
    Stopwatch watch;
    if (asked.given == nullptr) {
      pairs = find_pairs_and_query();
    } else {
      pairs = *asked.given;
      query(pairs);
    }
    answer.whole.push_back(watch.lap());
    if (asked.manifolds) make_manifolds(pairs, answer.manifolds);
  }
  answer.pairs.assign(pairs.begin(), pairs.end());
  contacts(answer.contacts);
  return answer;
}

void Engine::find(std::span<const BodyPose> bodies, std::span<const std::uint8_t> idle, ContactList& found,
                  const PairChoice& choose) {
  times_ = {};
  counters_ = {};
  Stopwatch watch;
  update(bodies);
  idle_motion_.clear();
  for (const std::uint8_t rests : idle) idle_motion_.push_back(rests != 0 ? Motion::fixed : Motion::moving);
  filter_.motion = idle.empty() ? nullptr : idle_motion_.data();
  set_filter(filter_);
  times_.update = watch.lap();
  std::span<const ObjectPair> pairs = find_pairs();
  if (choose) pairs = choose(pairs);
  found.pairs.assign(pairs.begin(), pairs.end());
  times_.broad_phase = watch.lap();
  query(found.pairs);
  times_.traversal = watch.lap() - times_.triangle_tests;
  if (!contacts(found.triangles)) throw std::logic_error("an engine that does not tell triangles");
  sort_contacts(found.triangles);
  times_.transfer = watch.lap();
  counters_.object_pairs = found.pairs.size();
  counters_.contacts = found.triangles.size();
}

std::span<const ObjectPair> Engine::find_pairs_and_query() {
  const std::span<const ObjectPair> pairs = find_pairs();
  query(pairs);
  return pairs;
}

std::optional<double> Engine::deform(std::span<const BentShape> bent) {
  std::optional<double> loosest;
  for (const auto& [shape, positions] : bent) loosest = std::max(loosest, deform_one(shape, positions));
  return loosest;
}

void Engine::require_bent(std::uint32_t shape, Status status, std::uint64_t where) const {
  try {
    require(status, where);
  } catch (EngineError& error) {
    error.shape = shape;
    throw;
  }
}

void Engine::require(Status status, std::uint64_t where) const {
  if (status == Status::kOk) return;
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  const std::string blamed = subject(status) != nullptr ? "body " + std::to_string(where) + ": " : "";
  throw EngineError(std::string(name_) + ": " + blamed + explain(status), status, where);
}

}  // namespace tandem
