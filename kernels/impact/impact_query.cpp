#include "tandem/kernels/impact_query.h"

#include <algorithm>
#include <cmath>
#include <new>

#include "kernels/common/instance_check.h"
#include "kernels/common/worker_threads.h"
#include "kernels/impact/impact_walk.h"
#include "kernels/impact/triangle_impact.h"
#include "tandem/kernels/detail/buffer.h"

namespace tandem {
namespace {

using impact::MovingBody;
using impact::PairMotion;
using impact::PairStop;
using manifold::Vector3;

// Instances that are posed, and pairs that are walked, at a time.
constexpr std::size_t kInstancesAtOnce = 64, kPairsAtOnce = 4;

struct Asset {
  LevelView tree;
  TreeExtent extent;
  double origin[3];
  float lower[3], upper[3];
  double diagonal;
};

Asset asset_of(const AssetView& view) {
  Asset asset;
  asset.tree = view.level();
  asset.extent = extent_of(asset.tree.blocks[0]);
  const FileHeader& header = *view.header;
  double squared = 0;
  for (int k = 0; k < 3; ++k) {
    asset.origin[k] = header.origin[k];
    asset.lower[k] = header.lower[k];
    asset.upper[k] = header.upper[k];
    const double side = static_cast<double>(header.upper[k]) - static_cast<double>(header.lower[k]);
    squared += side * side;
  }
  asset.diagonal = std::sqrt(squared);
  return asset;
}

// What a worker did; each pair's impact has its own place.
struct alignas(64) Worker : Allocated {
  ImpactCounters counters;
  impact::ImpactWalk walk;
};

void add_to(ImpactCounters& sum, const ImpactCounters& part) {
  sum.at_start += part.at_start;
  sum.found += part.found;
  sum.walks += part.walks;
  sum.block_pairs += part.block_pairs;
  sum.triangle_pairs += part.triangle_pairs;
  sum.advanced += part.advanced;
  sum.steps += part.steps;
  sum.most_steps = std::max(sum.most_steps, part.most_steps);
  sum.unconverged += part.unconverged;
}

void write(const Vector3& x, double (&out)[3]) {
  out[0] = x.x;
  out[1] = x.y;
  out[2] = x.z;
}

// What two triangles of a pair tell at a time, a part of the step.
void tell(const PairMotion& pair, const LevelView& a, const LevelView& b, double time, Impact& out) {
  const Triangle &of_a = a.triangles[out.triangle_a], &of_b = b.triangles[out.triangle_b];
  const impact::TrianglesAt triangles =
      triangles_at(pair, impact::moving_triangles(pair, of_a, of_b), impact::place_at(pair, time));
  const TriangleDistance distance = triangle_distance(impact::triangle_pair(triangles));
  const Vector3 center = pair.a->center + time * pair.a->displacement;
  out.gap = distance.interval.upper;
  write(center + impact::vector_of(distance.point_a), out.point_a);
  write(center + impact::vector_of(distance.point_b), out.point_b);
  out.face_a = of_a.source_face();
  out.face_b = of_b.source_face();
}

constexpr Impact none_in(double duration) {
  return {duration, INFINITY, {0, 0, 0}, {0, 0, 0},         kNoIndex,
          kNoIndex, kNoIndex, kNoIndex,  ImpactStatus::none};
}

}  // namespace

struct ImpactQuery::State : Allocated {
  Buffer<Asset> assets;
  Buffer<MovingBody> bodies;
  Buffer<WorldBox> boxes;  // swept
  BroadPhase broad_phase;
  ContactQuery contacts;  // at the start
  Buffer<ObjectPair> given_pairs;
  std::span<const ObjectPair> pairs;  // found or given
  Buffer<std::uint32_t> contact_of;   // each pair's row of the contacts, or kNoIndex
  Buffer<Impact> impacts;
  ImpactCounters counters;
  std::uint64_t where = 0;

  std::span<const Instance> instances;
  double duration = 0;
  ImpactOptions options;
  WorkerThreads threads;
  std::unique_ptr<Worker[]> workers;
  std::uint32_t worker_count = 0;

  Status fail(Status status, std::uint64_t at) {
    where = at;
    forget_results();
    return status;
  }
  void forget_results() {
    pairs = {};
    impacts.clear();
    counters = {};
  }
  std::uint32_t workers_for(std::size_t things, std::size_t at_once) const {
    const std::size_t parts = (things + at_once - 1) / at_once;
    return static_cast<std::uint32_t>(
        std::clamp<std::size_t>(parts, 1, std::clamp(options.threads, 1u, kMostQueryThreads)));
  }
  Status start(std::span<const Instance> posed, std::span<const RigidMotion> motion, double seconds,
               const ImpactOptions& chosen);
  Status pose(std::uint32_t instance, const RigidMotion& motion);
  Status take_pairs(std::span<const ObjectPair> given);
  Status find_pairs();
  Status find_contacts_at_start();
  Status provide_workers(std::uint32_t wanted);
  Impact impact_of(std::size_t pair, Worker& worker) const;
  Status find_impacts();
};

Status ImpactQuery::State::pose(std::uint32_t i, const RigidMotion& motion) {
  Pose stored;
  WorldBox box;
  const Status status = pose_instance(assets.data(), static_cast<std::uint32_t>(assets.size()),
                                      instances[i].asset, instances[i].pose, stored, box);
  if (status != Status::kOk) return status;
  const Asset& asset = assets[instances[i].asset];
  MovingBody& body = bodies[i];
  const Status moving = moving_body(stored, motion, duration, asset.lower, asset.upper, asset.extent, body);
  if (moving != Status::kOk) return moving;
  boxes[i] = swept_box(box, body.displacement, body.turn, body.fastest, body.error);
  return Status::kOk;
}

Status ImpactQuery::State::start(std::span<const Instance> posed, std::span<const RigidMotion> motion,
                                 double seconds, const ImpactOptions& chosen) {
  forget_results();
  instances = posed;
  duration = seconds;
  options = chosen;
  if (posed.size() >= kNoIndex) return fail(Status::kTooManyInstances, 0);
  if (motion.size() != posed.size()) return fail(Status::kMotionMismatch, 0);
  const bool fits =
      seconds >= 0 && std::isfinite(seconds) && options.tolerance >= 0 && std::isfinite(options.tolerance);
  if (!fits) return fail(Status::kOutOfRange, 0);
  if (!bodies.resize(posed.size()) || !boxes.resize(posed.size())) return fail(Status::kOutOfMemory, 0);
  for (std::uint32_t i = 0; i < posed.size(); ++i) {
    const Status status = pose(i, motion[i]);
    if (status != Status::kOk) return fail(status, i);
  }
  return Status::kOk;
}

Status ImpactQuery::State::find_pairs() {
  const PairFilter filter = options.filter != nullptr ? *options.filter : PairFilter();
  const std::uint32_t workers_wanted = workers_for(boxes.size(), kInstancesAtOnce);
  if (!threads.provide(workers_wanted)) return fail(Status::kCannotStartThread, 0);
  const Status status = broad_phase.find_pairs(boxes.view(), filter, false, threads, workers_wanted);
  if (status != Status::kOk)
    return fail(status, status == Status::kUnknownInstance ? filter.excluded.row : 0);
  pairs = broad_phase.pairs();
  return Status::kOk;
}

Status ImpactQuery::State::take_pairs(std::span<const ObjectPair> given) {
  if (!given_pairs.resize(given.size())) return fail(Status::kOutOfMemory, 0);
  for (std::size_t i = 0; i < given.size(); ++i) {
    const Status status = check_pair(given[i], static_cast<std::uint32_t>(instances.size()));
    if (status != Status::kOk) return fail(status, i);
    given_pairs[i] = given[i];
  }
  pairs = given_pairs.view();
  return Status::kOk;
}

Status ImpactQuery::State::find_contacts_at_start() {
  ContactOptions first;
  first.first_contact_only = true;
  first.threads = options.threads;
  const Status status = contacts.find_contacts(instances, pairs, first);
  if (status != Status::kOk) return fail(status, contacts.where());
  if (!contact_of.resize(pairs.size())) return fail(Status::kOutOfMemory, 0);
  std::fill_n(contact_of.data(), pairs.size(), kNoIndex);
  for (std::uint32_t i = 0; i < contacts.contacts().size(); ++i) {
    contact_of[contacts.contacts()[i].pair] = i;
  }
  return Status::kOk;
}

Status ImpactQuery::State::provide_workers(std::uint32_t wanted) {
  if (!threads.provide(wanted)) return fail(Status::kCannotStartThread, 0);
  if (wanted > worker_count) {
    workers.reset(new (std::nothrow) Worker[wanted]);
    worker_count = workers == nullptr ? 0 : wanted;
    if (workers == nullptr) return fail(Status::kOutOfMemory, 0);
  }
  for (std::uint32_t i = 0; i < wanted; ++i) workers[i].counters = {};
  return Status::kOk;
}

Impact ImpactQuery::State::impact_of(std::size_t row, Worker& worker) const {
  const ObjectPair& pair = pairs[row];
  const Asset &a = assets[instances[pair.a].asset], &b = assets[instances[pair.b].asset];
  const PairMotion motion = impact::pair_motion(bodies[pair.a], bodies[pair.b]);
  Impact impact = none_in(duration);
  if (contact_of[row] != kNoIndex) {
    const Contact& contact = contacts.contacts()[contact_of[row]];
    impact.t_safe = 0;
    impact.triangle_a = contact.triangle_a;
    impact.triangle_b = contact.triangle_b;
    impact.status = ImpactStatus::at_start;
    tell(motion, a.tree, b.tree, 0, impact);
    impact.gap = 0;
    ++worker.counters.at_start;
    return impact;
  }
  if (pair.a == pair.b) return impact;
  const double tolerance = options.tolerance * std::min(a.diagonal, b.diagonal);
  const PairStop stop = worker.walk.find_stop(motion, a.tree, b.tree, tolerance, worker.counters);
  if (stop.triangle_a == kNoIndex) return impact;
  impact.t_safe = stop.time * duration * (1 - 0x1p-51);
  impact.triangle_a = stop.triangle_a;
  impact.triangle_b = stop.triangle_b;
  impact.status = ImpactStatus::found;
  tell(motion, a.tree, b.tree, stop.time, impact);
  ++worker.counters.found;
  return impact;
}

Status ImpactQuery::State::find_impacts() {
  if (Status status = find_contacts_at_start(); status != Status::kOk) return status;
  const std::uint32_t wanted = workers_for(pairs.size(), kPairsAtOnce);
  if (Status status = provide_workers(wanted); status != Status::kOk) return status;
  if (!impacts.resize(pairs.size())) return fail(Status::kOutOfMemory, 0);
  threads.for_parts(wanted, pairs.size(), kPairsAtOnce,
                    [&](std::size_t i, std::size_t end, std::uint32_t worker) {
                      for (; i < end; ++i) impacts[i] = impact_of(i, workers[worker]);
                    });
  for (std::uint32_t i = 0; i < wanted; ++i) add_to(counters, workers[i].counters);
  counters.object_pairs = pairs.size();
  return Status::kOk;
}

ImpactQuery::ImpactQuery() : state_(new (std::nothrow) State) {}
ImpactQuery::ImpactQuery(ImpactQuery&&) noexcept = default;
ImpactQuery& ImpactQuery::operator=(ImpactQuery&&) noexcept = default;
ImpactQuery::~ImpactQuery() = default;

Status ImpactQuery::set_assets(std::span<const AssetView> assets) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  State& state = *state_;
  state.forget_results();
  state.assets.clear();
  if (const Status status = state.contacts.set_assets(assets); status != Status::kOk)
    return state.fail(status, state.contacts.where());
  if (!state.assets.resize(assets.size())) return state.fail(Status::kOutOfMemory, 0);
  for (std::size_t i = 0; i < assets.size(); ++i) state.assets[i] = asset_of(assets[i]);
  return Status::kOk;
}

Status ImpactQuery::find(std::span<const Instance> instances, std::span<const RigidMotion> motion,
                         double duration, const ImpactOptions& options) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  Status status = state_->start(instances, motion, duration, options);
  if (status == Status::kOk) status = state_->find_pairs();
  return status == Status::kOk ? state_->find_impacts() : status;
}

Status ImpactQuery::find(std::span<const Instance> instances, std::span<const RigidMotion> motion,
                         double duration, std::span<const ObjectPair> pairs, const ImpactOptions& options) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  Status status = state_->start(instances, motion, duration, options);
  if (status == Status::kOk) status = state_->take_pairs(pairs);
  return status == Status::kOk ? state_->find_impacts() : status;
}

std::span<const ObjectPair> ImpactQuery::pairs() const {
  return state_ != nullptr ? state_->pairs : std::span<const ObjectPair>();
}

std::span<const Impact> ImpactQuery::impacts() const {
  return state_ != nullptr ? state_->impacts.view() : std::span<const Impact>();
}

const ImpactCounters& ImpactQuery::counters() const {
  static constexpr ImpactCounters kNone;
  return state_ != nullptr ? state_->counters : kNone;
}

std::uint64_t ImpactQuery::where() const {
  return state_ != nullptr ? state_->where : 0;
}

}  // namespace tandem
