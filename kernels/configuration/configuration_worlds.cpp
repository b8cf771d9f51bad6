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
      !world.resize(all) || !worlds_.boxes.resize(all))
    return false;
  for (std::size_t i = 0; i < moving; ++i) {
    worlds_.instances[i] = {scene.instances[options.bodies[i % n]].asset, options.poses[slice.first * n + i]};
    PosedTree tree;
    // The poses were checked, so this is kOk.
    if (options.find == ConfigurationPairs::nearest)
      static_cast<void>(scene.posed(worlds_.instances[i], tree, worlds_.boxes[i]));
    motion[i] = Motion::moving;
    world[i] = static_cast<std::uint32_t>(i / n);
  }
  for (std::size_t i = 0; i < standing_.size(); ++i) {
    worlds_.instances[moving + i] = scene.instances[standing_[i]];
    worlds_.boxes[moving + i] = scene.boxes[standing_[i]];
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
  counters.object_pairs += pairs_.size();
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

// Bounds the distances of some pairs, and notes those that are nearer than what was nearest before.
Status ConfigurationWorlds::bound(SceneState& scene, const ConfigurationOptions& options, const Slice& slice,
                                  Buffer<ObjectPair>& pairs, ConfigurationCounters& counters) {
  const DistanceOptions asked = {.tolerance = options.tolerance, .reach = options.within};
  counters.object_pairs += pairs.size();
  const Status status =
      scene.device->find(worlds_, asked, {pairs, distances_, distance_counters_, distance_memory_});
  if (status != Status::kOk) return scene.fail(status, worlds_.where);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    ConfigurationPair row = row_of(options, slice, pairs[i]);
    ConfigurationPair& nearest = nearest_[row.configuration - slice.first];
    row.lower = std::min(nearest.lower, distances_[i].lower);
    row.upper = distances_[i].upper;
    if (row.upper < nearest.upper)
      nearest = row;
    else
      nearest.lower = row.lower;
  }
  return Status::kOk;
}

// Puts the pair of each configuration whose boxes are nearest on a list. Pairs are sorted, so those of a
// configuration follow each other. False: out of memory.
bool ConfigurationWorlds::list_nearest_boxes(std::size_t moving) {
  nearest_boxes_.clear();
  double least = INFINITY;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const double gap = gap_of(worlds_.boxes[pairs_[i].a], worlds_.boxes[pairs_[i].b]);
    if (i == 0 || pairs_[i].a / moving != pairs_[i - 1].a / moving) {
      if (!nearest_boxes_.push(pairs_[i])) return false;
    } else if (gap < least) {
      nearest_boxes_[nearest_boxes_.size() - 1] = pairs_[i];
    } else {
      continue;
    }
    least = gap;
  }
  return true;
}

// Drops the pairs whose distance is known, or whose boxes are farther apart than the bodies of a pair whose
// distance is: the distance of what is dropped is above the upper bound of that, and so above the least one.
void ConfigurationWorlds::keep_those_that_may_be_nearer(std::size_t moving) {
  std::size_t kept = 0, next = 0;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const ObjectPair pair = pairs_[i];
    if (next < nearest_boxes_.size() && nearest_boxes_[next] == pair) {
      ++next;
      continue;
    }
    const double upper = nearest_[pair.a / moving].upper;
    if (upper > 0 && distance_between(worlds_.boxes[pair.a], worlds_.boxes[pair.b]) <= upper)
      pairs_[kept++] = pair;
  }
  (void)pairs_.resize(kept);
}

Status ConfigurationWorlds::measure(SceneState& scene, const ConfigurationOptions& options,
                                    const Slice& slice, Buffer<ConfigurationPair>& rows,
                                    ConfigurationCounters& counters) {
  const std::size_t moving = options.bodies.size();
  if (!nearest_.resize(slice.count) || !list_nearest_boxes(moving))
    return scene.fail(Status::kOutOfMemory, 0);
  for (std::size_t i = 0; i < slice.count; ++i)
    nearest_[i] = {slice.first + i, kNoIndex, kNoIndex, INFINITY, INFINITY};
  Status status = bound(scene, options, slice, nearest_boxes_, counters);
  if (status != Status::kOk) return status;
  keep_those_that_may_be_nearer(moving);
  status = bound(scene, options, slice, pairs_, counters);
  if (status != Status::kOk) return status;
  for (ConfigurationPair& nearest : std::span(nearest_.data(), nearest_.size())) {
    if (!(nearest.upper < INFINITY)) continue;
    counters.touching += nearest.upper == 0;
    nearest.lower = std::min(nearest.lower, nearest.upper);
    if (!rows.push(nearest)) return scene.fail(Status::kOutOfMemory, 0);
  }
  return Status::kOk;
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
    status = nearest ? measure(scene, options, slice, rows, counters)
                     : decide(scene, options, slice, rows, counters);
    if (status != Status::kOk) return status;
  }
  return Status::kOk;
}

}  // namespace tandem
