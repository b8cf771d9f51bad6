#include "kernels/configuration/configuration_worlds.h"

#include <algorithm>
#include <atomic>

namespace tandem {
namespace {

// Bodies that move in one question: 100 MB of poses.
constexpr std::size_t kBodiesInQuestion = std::size_t{1} << 20;

// A version that the bodies of no scene have, since these count from 0.
std::uint64_t next_version() {
  static std::atomic<std::uint64_t> last = std::uint64_t{1} << 63;
  return ++last;
}

}  // namespace

// The bodies of each configuration follow those of the one before; then come those that stand. False: out of
// memory.
bool ConfigurationWorlds::place(const SceneState& scene, const ConfigurationOptions& options,
                                const Slice& slice) {
  const std::size_t n = options.bodies.size(), moving = slice.count * n, all = moving + standing_.size();
  Buffer<Motion>& motion = worlds_.columns.motion;
  Buffer<std::uint32_t>& world = worlds_.columns.world;
  fixed_kept_ = fixed_kept_ && worlds_.instances.size() == all;
  if (!worlds_.instances.resize(all) || !worlds_.bodies.resize(all) || !motion.resize(all) ||
      !world.resize(all))
    return false;
  for (std::size_t i = 0; i < moving; ++i) {
    worlds_.instances[i] = {scene.instances[options.bodies[i % n]].asset, options.poses[slice.first * n + i]};
    motion[i] = Motion::moving;
    world[i] = static_cast<std::uint32_t>(i / n);
  }
  for (std::size_t i = 0; i < standing_.size(); ++i) {
    worlds_.instances[moving + i] = scene.instances[standing_[i]];
    motion[moving + i] = Motion::fixed;
    world[moving + i] = kEveryWorld;
  }
  worlds_.version = next_version();
  return true;
}

ConfigurationPair ConfigurationWorlds::row_of(const ConfigurationOptions& options, const Slice& slice,
                                              const ObjectPair& pair) const {
  const std::size_t n = options.bodies.size();
  const auto body = [&](std::size_t i) {
    return i < slice.count * n ? options.bodies[i % n] : standing_[i - slice.count * n];
  };
  // One of the two bodies moves, and it comes first.
  const std::uint32_t a = body(pair.a), b = body(pair.b);
  return {slice.first + pair.a / n, std::min(a, b), std::max(a, b), 0, options.within};
}

// Drops the pairs at which the filter of the scene does not look.
void ConfigurationWorlds::keep_asked(const SceneState& scene, const ConfigurationOptions& options,
                                     const Slice& slice) {
  const PairFilter filter = scene.filter();
  const auto is_asked = [&](const ObjectPair& pair) {
    const ConfigurationPair row = row_of(options, slice, pair);
    return filter.looks_at(row.a, row.b);
  };
  ObjectPair* const begin = pairs_.data();
  ObjectPair* const end =
      std::remove_if(begin, begin + pairs_.size(), [&](const ObjectPair& pair) { return !is_asked(pair); });
  (void)pairs_.resize(static_cast<std::size_t>(end - begin));
}

Status ConfigurationWorlds::decide(SceneState& scene, const ConfigurationOptions& options, const Slice& slice,
                                   Buffer<ConfigurationPair>& rows, ConfigurationCounters& counters) {
  const ContactOptions asked = {.first_contact_only = true, .within = options.within};
  const Status status =
      scene.device->find(worlds_, asked, {pairs_, contacts_, contact_counters_, contact_memory_});
  if (status != Status::kOk) return scene.fail(status, worlds_.where);
  const std::size_t begin = rows.size();
  for (const Contact& contact : contacts_.view()) {
    if (!rows.push(row_of(options, slice, pairs_[contact.pair]))) return scene.fail(Status::kOutOfMemory, 0);
  }
  std::sort(rows.data() + begin, rows.data() + rows.size());
  std::size_t kept = begin;
  for (std::size_t i = begin; i < rows.size(); ++i) {
    const bool is_first = i == begin || rows[i].configuration != rows[i - 1].configuration;
    counters.touching += is_first;
    if (is_first || options.find == ConfigurationPairs::all) rows[kept++] = rows[i];
  }
  (void)rows.resize(kept);
  return Status::kOk;
}

Status ConfigurationWorlds::measure(SceneState& scene, const ConfigurationOptions& options,
                                    const Slice& slice, Buffer<ConfigurationPair>& rows,
                                    ConfigurationCounters& counters) {
  const DistanceOptions asked = {.tolerance = options.tolerance, .reach = options.within};
  const Status status =
      scene.device->find(worlds_, asked, {pairs_, distances_, distance_counters_, distance_memory_});
  if (status != Status::kOk) return scene.fail(status, worlds_.where);
  // Pairs are sorted, so those of a configuration follow each other.
  ConfigurationPair nearest = {};
  double lower = INFINITY;
  const auto end_configuration = [&] {
    if (!(nearest.upper < INFINITY)) return true;
    counters.touching += nearest.upper == 0;
    nearest.lower = std::min(lower, nearest.upper);
    return rows.push(nearest);
  };
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    ConfigurationPair row = row_of(options, slice, pairs_[i]);
    row.upper = distances_[i].upper;
    const bool is_next = i == 0 || row.configuration != nearest.configuration;
    if (is_next && i > 0 && !end_configuration()) return scene.fail(Status::kOutOfMemory, 0);
    if (is_next || row.upper < nearest.upper) nearest = row;
    lower = is_next ? distances_[i].lower : std::min(lower, distances_[i].lower);
  }
  return pairs_.size() == 0 || end_configuration() ? Status::kOk : scene.fail(Status::kOutOfMemory, 0);
}

Status ConfigurationWorlds::find(SceneState& scene, const ConfigurationOptions& options,
                                 std::span<const std::uint8_t> moves, Buffer<ConfigurationPair>& rows,
                                 ConfigurationCounters& counters) {
  standing_.clear();
  for (std::uint32_t body = 0; body < moves.size(); ++body) {
    if (moves[body] == 0 && scene.is_body(body) && !standing_.push(body))
      return scene.fail(Status::kOutOfMemory, 0);
  }
  const std::size_t n = options.bodies.size(), count = n == 0 ? 0 : options.poses.size() / n;
  const std::size_t at_once = std::max<std::size_t>(1, kBodiesInQuestion / std::max<std::size_t>(1, n));
  scene.device->allocator = current_allocator();
  fixed_kept_ = false;
  scene.forget_fixed_on_device();
  for (std::size_t first = 0; first < count; first += at_once) {
    const Slice slice = {first, std::min(at_once, count - first)};
    if (!place(scene, options, slice)) return scene.fail(Status::kOutOfMemory, 0);
    const bool nearest = options.find == ConfigurationPairs::nearest;
    Status status = scene.device->find_pairs(worlds_, options.within, fixed_kept_, pairs_);
    if (status != Status::kOk) return scene.fail(status, worlds_.where);
    keep_asked(scene, options, slice);
    counters.object_pairs += pairs_.size();
    status = nearest ? measure(scene, options, slice, rows, counters)
                     : decide(scene, options, slice, rows, counters);
    if (status != Status::kOk) return status;
  }
  return Status::kOk;
}

}  // namespace tandem
