#include "tandem/kernels/tolerance_query.h"

#include <algorithm>
#include <new>

#include "kernels/tolerance/tolerance_rule.h"
#include "tandem/kernels/detail/buffer.h"

namespace tandem {
namespace {

using levels::LevelRange;

struct AssetLevel {
  LevelView tree;
  double origin[3];
  float lower[3], upper[3];
};

}  // namespace

struct ToleranceQuery::State : Allocated {
  ContactQuery contacts;  // of which each level is an asset
  Buffer<LevelRange> ranges;
  Buffer<AssetLevel> levels;

  Buffer<std::uint32_t> level;  // of each instance
  Buffer<Instance> posed;       // at these levels
  Buffer<PairVerdict> verdicts;
  ToleranceCounters counters;
  bool decided = false;  // contacts has the pairs
  std::uint64_t where = 0;

  Status fail(Status status, std::uint64_t at) {
    where = at;
    decided = false;
    verdicts.clear();
    counters = {};
    return status;
  }

  Status set_assets(std::span<const AssetView> assets);
  bool choose_levels(std::span<const Instance> instances, double tolerance);
  bool judge();
  Status decide(std::span<const Instance> instances, const std::span<const ObjectPair>* given,
                const ToleranceOptions& options);
};

Status ToleranceQuery::State::set_assets(std::span<const AssetView> assets) {
  (void)fail(Status::kOk, 0);
  ranges.clear();
  levels.clear();
  Buffer<AssetView> views;  // of one level each
  for (std::size_t i = 0; i < assets.size(); ++i) {
    const AssetView& asset = assets[i];
    if (asset.header == nullptr || asset.levels.empty()) return fail(Status::kUnknownAsset, i);
    if (asset.first_level != 0) return fail(Status::kNoFinestLevel, i);
    const auto count = static_cast<std::uint32_t>(asset.levels.size());
    if (!ranges.push({static_cast<std::uint32_t>(levels.size()), count}))
      return fail(Status::kOutOfMemory, i);
    for (std::uint32_t of_file = 0; of_file < count; ++of_file) {
      AssetLevel row = {asset.level(of_file), {}, {}, {}};
      std::copy_n(asset.header->origin, 3, row.origin);
      std::copy_n(asset.header->lower, 3, row.lower);
      std::copy_n(asset.header->upper, 3, row.upper);
      if (!levels.push(row) || !views.push(asset.levels_from(of_file, 1)))
        return fail(Status::kOutOfMemory, i);
    }
  }
  return contacts.set_assets(views.view());
}

// The contact query finds what is wrong with instances.
bool ToleranceQuery::State::choose_levels(std::span<const Instance> instances, double tolerance) {
  if (!level.resize(instances.size()) || !posed.resize(instances.size())) return false;
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const auto& [asset, pose] = instances[i];
    level[i] = 0;
    posed[i] = {kNoIndex, pose};
    if (asset >= ranges.size()) continue;
    const AssetLevel* own = &levels[ranges[asset].first];
    level[i] =
        levels::level_within(own, ranges[asset].count, for_stored_coordinates(pose, own->origin), tolerance);
    posed[i].asset = ranges[asset].first + level[i];
  }
  return true;
}

// Contacts come by ascending pair, one of each that has any.
bool ToleranceQuery::State::judge() {
  const std::span<const ObjectPair> pairs = contacts.pairs();
  const std::span<const Contact> found = contacts.contacts();
  if (!verdicts.resize(pairs.size())) return false;
  std::uint64_t counted[3] = {};
  std::size_t next = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const bool near = next < found.size() && found[next].pair == i;
    next += near ? 1 : 0;
    verdicts[i] = levels::verdict_on(pairs[i], level[pairs[i].a], level[pairs[i].b], near);
    ++counted[static_cast<std::size_t>(verdicts[i].verdict)];
  }
  counters = {counted[0], counted[1], counted[2], contacts.counters()};
  decided = true;
  return true;
}

Status ToleranceQuery::State::decide(std::span<const Instance> instances,
                                     const std::span<const ObjectPair>* given,
                                     const ToleranceOptions& options) {
  (void)fail(Status::kOk, 0);
  if (!(options.tolerance >= 0 && options.tolerance <= kLargestWorldCoordinate))
    return fail(Status::kOutOfRange, 0);
  if (!choose_levels(instances, options.tolerance)) return fail(Status::kOutOfMemory, 0);
  const ContactOptions asked = {.first_contact_only = true,
                                .threads = options.threads,
                                .filter = options.filter,
                                .add_error_bounds = true};
  const Status status = given == nullptr ? contacts.find_contacts(posed.view(), asked)
                                         : contacts.find_contacts(posed.view(), *given, asked);
  if (status != Status::kOk) return fail(status, contacts.where());
  return judge() ? Status::kOk : fail(Status::kOutOfMemory, 0);
}

ToleranceQuery::ToleranceQuery() : state_(new (std::nothrow) State) {}
ToleranceQuery::ToleranceQuery(ToleranceQuery&&) noexcept = default;
ToleranceQuery& ToleranceQuery::operator=(ToleranceQuery&&) noexcept = default;
ToleranceQuery::~ToleranceQuery() = default;

Status ToleranceQuery::set_assets(std::span<const AssetView> assets) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  const Status status = state_->set_assets(assets);
  if (status != Status::kOk) {
    state_->ranges.clear();
    (void)state_->contacts.set_assets({});
  }
  return status;
}

Status ToleranceQuery::decide(std::span<const Instance> instances, const ToleranceOptions& options) {
  return state_ != nullptr ? state_->decide(instances, nullptr, options) : Status::kOutOfMemory;
}

Status ToleranceQuery::decide(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
                              const ToleranceOptions& options) {
  return state_ != nullptr ? state_->decide(instances, &pairs, options) : Status::kOutOfMemory;
}

std::span<const ObjectPair> ToleranceQuery::pairs() const {
  return state_ != nullptr && state_->decided ? state_->contacts.pairs() : std::span<const ObjectPair>();
}

std::span<const PairVerdict> ToleranceQuery::verdicts() const {
  return state_ != nullptr ? state_->verdicts.view() : std::span<const PairVerdict>();
}

const ToleranceCounters& ToleranceQuery::counters() const {
  static constexpr ToleranceCounters kNone;
  return state_ != nullptr ? state_->counters : kNone;
}

std::uint64_t ToleranceQuery::where() const {
  return state_ != nullptr ? state_->where : 0;
}

}  // namespace tandem
