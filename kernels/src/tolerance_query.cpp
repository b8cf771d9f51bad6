#include "tandem/kernels/tolerance_query.h"

#include <algorithm>
#include <new>

#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/detail/tolerance_rule.h"

namespace tandem {
namespace {

using levels::LevelRange;

struct AssetLevel {
  LevelView tree;
  double origin[3];
  float lower[3], upper[3];
};

/// A body of a call: its levels, and the last of them that a round looks at.
struct Body {
  LevelRange range;
  std::uint32_t last;
};

void add_to(QueryCounters& sum, const QueryCounters& part) {
  sum.object_pairs += part.object_pairs;
  sum.block_pairs += part.block_pairs;
  sum.candidates += part.candidates;
  sum.decided_by_float32 += part.decided_by_float32;
  sum.decided_by_float64 += part.decided_by_float64;
  sum.decided_exactly += part.decided_exactly;
  sum.contacts += part.contacts;
}

}  // namespace

struct ToleranceQuery::State {
  ContactQuery contacts;  // of which each level is an asset
  Buffer<LevelRange> ranges;
  Buffer<AssetLevel> levels;

  Buffer<Body> bodies;
  Buffer<Instance> posed;  // at the levels of a round
  Buffer<ObjectPair> pairs, open_pairs;
  Buffer<std::uint32_t> open;  // rows of pairs
  Buffer<PairVerdict> verdicts;
  ToleranceCounters counters;
  std::uint64_t where = 0;

  Status fail(Status status, std::uint64_t at) {
    where = at;
    pairs.clear();
    verdicts.clear();
    counters = {};
    return status;
  }

  Status set_assets(std::span<const AssetView> assets);
  bool take_bodies(std::span<const Instance> instances, double tolerance);
  void pose_for(std::span<const Instance> instances, std::uint32_t round);
  bool take_pairs();
  bool is_last(std::uint32_t body, std::uint32_t round) const {
    const auto [range, last] = bodies[body];
    return levels::level_in_round(range.count, last, round) == last;
  }
  void judge_round(std::uint32_t round);
  void judge(std::uint32_t pair, std::uint32_t round, bool near);
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
    for (std::uint32_t level = 0; level < count; ++level) {
      AssetLevel row = {asset.level(level), {}, {}, {}};
      std::copy_n(asset.header->origin, 3, row.origin);
      std::copy_n(asset.header->lower, 3, row.lower);
      std::copy_n(asset.header->upper, 3, row.upper);
      if (!levels.push(row) || !views.push(asset.levels_from(level, 1))) return fail(Status::kOutOfMemory, i);
    }
  }
  return contacts.set_assets(views.view());
}

// The contact query finds what is wrong with instances, of which any level will do.
bool ToleranceQuery::State::take_bodies(std::span<const Instance> instances, double tolerance) {
  if (!bodies.resize(instances.size()) || !posed.resize(instances.size())) return false;
  for (std::size_t i = 0; i < instances.size(); ++i) {
    bodies[i] = {{kNoIndex, 1}, 0};
    if (instances[i].asset >= ranges.size()) continue;
    const LevelRange range = ranges[instances[i].asset];
    const AssetLevel* own = &levels[range.first];
    const Pose stored = for_stored_coordinates(instances[i].pose, own->origin);
    bodies[i] = {range, levels::last_level(own, range.count, stored, tolerance)};
  }
  return true;
}

void ToleranceQuery::State::pose_for(std::span<const Instance> instances, std::uint32_t round) {
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const Body& body = bodies[i];
    posed[i] = {body.range.first + levels::level_in_round(body.range.count, body.last, round),
                instances[i].pose};
  }
}

// All pairs of the first round are open.
bool ToleranceQuery::State::take_pairs() {
  const std::span<const ObjectPair> all = contacts.pairs();
  if (!pairs.resize(all.size()) || !verdicts.resize(all.size()) || !open.resize(all.size()) ||
      !open_pairs.resize(all.size()))
    return false;
  for (std::size_t i = 0; i < all.size(); ++i) {
    pairs[i] = all[i];
    open[i] = static_cast<std::uint32_t>(i);
  }
  return true;
}

void ToleranceQuery::State::judge(std::uint32_t pair, std::uint32_t round, bool near) {
  const Body &a = bodies[pairs[pair].a], &b = bodies[pairs[pair].b];
  PairVerdict& verdict = verdicts[pair];
  verdict.level_a = static_cast<std::uint8_t>(levels::level_in_round(a.range.count, a.last, round));
  verdict.level_b = static_cast<std::uint8_t>(levels::level_in_round(b.range.count, b.last, round));
  verdict.verdict =
      near ? levels::verdict_on_near(verdict.level_a, verdict.level_b) : ToleranceVerdict::apart;
}

// What the round says of the pairs that were open; the others stay open. Contacts come by ascending pair.
void ToleranceQuery::State::judge_round(std::uint32_t round) {
  const std::span<const Contact> found = contacts.contacts();
  std::size_t next = 0, left = 0;
  for (std::uint32_t i = 0; i < open.size(); ++i) {
    const std::uint32_t pair = open[i];
    const bool near = next < found.size() && found[next].pair == i;
    next += near ? 1 : 0;
    const auto [a, b] = pairs[pair];
    if (a == b) {
      verdicts[pair] = {ToleranceVerdict::touching, 0, 0};
    } else if (!near || (is_last(a, round) && is_last(b, round))) {
      judge(pair, round, near);
    } else {
      open[left] = pair;
      open_pairs[left++] = pairs[pair];
    }
  }
  (void)open.resize(left);
  (void)open_pairs.resize(left);
}

Status ToleranceQuery::State::decide(std::span<const Instance> instances,
                                     const std::span<const ObjectPair>* given,
                                     const ToleranceOptions& options) {
  (void)fail(Status::kOk, 0);
  if (!(options.tolerance >= 0 && options.tolerance <= kLargestWorldCoordinate))
    return fail(Status::kOutOfRange, 0);
  if (!take_bodies(instances, options.tolerance)) return fail(Status::kOutOfMemory, 0);
  const QueryOptions asked = {.first_contact_only = true,
                              .threads = options.threads,
                              .filter = options.filter,
                              .add_error_bounds = true};
  for (std::uint32_t round = 0; round == 0 || open.size() != 0; ++round) {
    pose_for(instances, round);
    const bool finds = round == 0 && given == nullptr;
    const Status status =
        finds ? contacts.find_contacts(posed.view(), asked)
              : contacts.find_contacts(posed.view(), round == 0 ? *given : open_pairs.view(), asked);
    if (status != Status::kOk) return fail(status, contacts.where());
    if (round == 0 && !take_pairs()) return fail(Status::kOutOfMemory, 0);
    if (open.size() != 0) counters.rounds = round + 1;
    counters.pairs_of_round[round] = open.size();
    add_to(counters.work, contacts.counters());
    judge_round(round);
  }
  for (const PairVerdict& verdict : verdicts.view()) {
    counters.apart += verdict.verdict == ToleranceVerdict::apart ? 1 : 0;
    counters.touching += verdict.verdict == ToleranceVerdict::touching ? 1 : 0;
    counters.within_tolerance += verdict.verdict == ToleranceVerdict::within_tolerance ? 1 : 0;
  }
  return Status::kOk;
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
  return state_ != nullptr ? state_->pairs.view() : std::span<const ObjectPair>();
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
