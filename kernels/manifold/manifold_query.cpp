#include "tandem/kernels/manifold_query.h"

#include <algorithm>
#include <atomic>
#include <new>

#include "kernels/common/instance_check.h"
#include "kernels/common/worker_threads.h"
#include "kernels/manifold/finish.h"
#include "kernels/manifold/pair_patches.h"
#include "kernels/manifold/shape.h"
#include "tandem/kernels/detail/buffer.h"

namespace tandem {
namespace {

using manifold::BodyPair;
using manifold::OneThread;
using manifold::Patch;
using manifold::Shape;

// Pairs with contacts that a thread takes at a time.
constexpr std::size_t kPairsAtOnce = 16;

// A pair that has contacts: where its patches lie, and where its manifolds and points go.
struct Row {
  std::uint32_t pair;
  std::uint32_t worker;
  std::size_t first_patch;
  std::uint32_t patches, manifolds, points;
  std::uint32_t first_manifold, first_point;
};

// The points of a pair of bodies.
struct PairPoints {
  std::uint64_t bodies;
  std::uint32_t first, count;
};

struct alignas(64) Worker : Allocated {
  PairPatches made;
  bool enough_memory = true;
};

std::uint64_t bodies_of(const ObjectPair& pair) {
  return std::uint64_t{pair.a} << 32 | pair.b;
}

}  // namespace

struct ManifoldQuery::State : Allocated {
  Buffer<Shape> shapes;
  Buffer<std::uint32_t> triangle_counts;
  Buffer<std::uint32_t> begin;  // of each pair's contacts
  Buffer<Contact> grouped;
  Buffer<Row> rows;
  Buffer<Manifold> manifolds, manifolds_before;
  Buffer<ManifoldPoint> points, points_before;
  Buffer<PairPoints> pair_points_before;
  ManifoldCounters counters;
  std::uint64_t where = 0;

  WorkerThreads threads;
  std::unique_ptr<Worker[]> workers;
  std::uint32_t worker_count = 0;

  Status fail(Status status, std::uint64_t at);
  Status check(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
               std::span<const Contact> contacts);
  Status group(std::size_t pairs, std::span<const Contact>& contacts);
  Status provide_workers(std::uint32_t wanted);
  void make_patches(std::size_t from, std::size_t to, std::uint32_t worker,
                    std::span<const Instance> instances, std::span<const ObjectPair> pairs,
                    std::span<const Contact> contacts, int most_points);
  Status place_rows();
  void finish(Row& row, std::span<const Instance> instances, const ObjectPair& pair, bool match);
  Status remember_step(std::span<const ObjectPair> pairs);
};

Status ManifoldQuery::State::fail(Status status, std::uint64_t at) {
  where = at;
  manifolds.clear();
  points.clear();
  rows.clear();
  counters = {};
  return status;
}

Status ManifoldQuery::State::check(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
                                   std::span<const Contact> contacts) {
  if (instances.size() >= kNoIndex) return fail(Status::kTooManyInstances, 0);
  if (pairs.size() >= kNoIndex) return fail(Status::kTooManyPairs, 0);
  if (contacts.size() >= kNoIndex / 8) return fail(Status::kOutOfRange, contacts.size());
  for (std::size_t i = 0; i < instances.size(); ++i) {
    if (instances[i].asset >= shapes.size()) return fail(Status::kUnknownAsset, i);
    if (!is_rigid(instances[i].pose)) return fail(Status::kPoseNotRigid, i);
    const manifold::Body body(shapes[instances[i].asset], instances[i].pose);
    if (!(body.reach <= kLargestWorldCoordinate)) return fail(Status::kOutOfRange, i);
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Status status = check_pair(pairs[i], static_cast<std::uint32_t>(instances.size()));
    if (status != Status::kOk) return fail(status, i);
  }
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& contact = contacts[i];
    const bool known = contact.pair < pairs.size() &&
                       contact.triangle_a < triangle_counts[instances[pairs[contact.pair].a].asset] &&
                       contact.triangle_b < triangle_counts[instances[pairs[contact.pair].b].asset];
    if (!known) return fail(Status::kUnknownContact, i);
  }
  return Status::kOk;
}

// Finds where each pair's contacts begin, and brings them together if they are not. Lists the pairs that have
// some.
Status ManifoldQuery::State::group(std::size_t pairs, std::span<const Contact>& contacts) {
  if (!begin.resize(pairs + 1)) return fail(Status::kOutOfMemory, 0);
  std::fill(begin.data(), begin.data() + pairs + 1, 0u);
  bool ascending = true;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    ++begin[contacts[i].pair + 1];
    ascending = ascending && (i == 0 || contacts[i - 1].pair <= contacts[i].pair);
  }
  rows.clear();
  for (std::size_t i = 0; i < pairs; ++i) {
    if (begin[i + 1] > 0 && !rows.push({static_cast<std::uint32_t>(i), 0, 0, 0, 0, 0, 0, 0}))
      return fail(Status::kOutOfMemory, 0);
    if (begin[i + 1] > manifold::kMostContactsOfPair) return fail(Status::kOutOfRange, i);
    begin[i + 1] += begin[i];
  }
  if (ascending) return Status::kOk;
  if (!grouped.resize(contacts.size())) return fail(Status::kOutOfMemory, 0);
  for (const Contact& contact : contacts) grouped[begin[contact.pair]++] = contact;
  for (std::size_t i = pairs; i > 0; --i) begin[i] = begin[i - 1];
  begin[0] = 0;
  contacts = grouped.view();
  return Status::kOk;
}

Status ManifoldQuery::State::provide_workers(std::uint32_t wanted) {
  if (!threads.provide(wanted)) return fail(Status::kCannotStartThread, 0);
  if (wanted > worker_count) {
    std::unique_ptr<Worker[]> more(new (std::nothrow) Worker[wanted]);
    if (more == nullptr) return fail(Status::kOutOfMemory, 0);
    for (std::uint32_t i = 0; i < worker_count; ++i) more[i] = std::move(workers[i]);
    workers = std::move(more);
    worker_count = wanted;
  }
  for (std::uint32_t i = 0; i < worker_count; ++i) {
    workers[i].made.clear();
    workers[i].enough_memory = true;
  }
  return Status::kOk;
}

void ManifoldQuery::State::make_patches(std::size_t from, std::size_t to, std::uint32_t worker,
                                        std::span<const Instance> instances,
                                        std::span<const ObjectPair> pairs, std::span<const Contact> contacts,
                                        int most_points) {
  Worker& own = workers[worker];
  Buffer<Patch>& patches = own.made.patches;
#ifdef TANDEM_HAVE_LANES
  const MeansThread team = {{}, best_manifold_means()};
#else
  const OneThread team;
#endif
  for (std::size_t i = from; i < to && own.enough_memory; ++i) {
    Row& row = rows[i];
    const ObjectPair& pair = pairs[row.pair];
    row.worker = worker;
    row.first_patch = patches.size();
    if (pair.a == pair.b) continue;
    const Instance &a = instances[pair.a], &b = instances[pair.b];
    const BodyPair bodies = {{shapes[a.asset], a.pose}, {shapes[b.asset], b.pose}};
    const std::uint32_t first = begin[row.pair], count = begin[row.pair + 1] - first;
    own.enough_memory = own.made.add(team, bodies, contacts.data() + first, count, most_points);
    row.patches = static_cast<std::uint32_t>(patches.size() - row.first_patch);
    for (std::uint32_t k = 0; k < row.patches; ++k) {
      const Patch& patch = patches[row.first_patch + k];
      if (patch.hole != 0) continue;
      ++row.manifolds;
      row.points += patch.manifold.point_count;
    }
  }
}

Status ManifoldQuery::State::place_rows() {
  std::uint64_t next_manifold = 0, next_point = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].first_manifold = static_cast<std::uint32_t>(next_manifold);
    rows[i].first_point = static_cast<std::uint32_t>(next_point);
    next_manifold += rows[i].manifolds;
    next_point += rows[i].points;
  }
  if (next_point >= kNoIndex) return fail(Status::kOutOfRange, 0);
  if (!manifolds.resize(next_manifold) || !points.resize(next_point)) return fail(Status::kOutOfMemory, 0);
  return Status::kOk;
}

void ManifoldQuery::State::finish(Row& row, std::span<const Instance> instances, const ObjectPair& pair,
                                  bool match) {
  Patch* const patches = workers[row.worker].made.patches.data() + row.first_patch;
  const auto patch = [&](std::uint32_t i) -> Patch& { return patches[i]; };
  std::sort(patches, patches + row.patches, [](const Patch& x, const Patch& y) { return x.key < y.key; });
  for (std::uint32_t i = 0; i < row.patches; ++i) {
    if (patches[i].hole != 0) manifold::take_off_hole(patches[i], row.patches, patch);
  }
  std::uint32_t next_manifold = row.first_manifold, next_point = row.first_point;
  for (std::uint32_t i = 0; i < row.patches; ++i) {
    if (patches[i].hole != 0) continue;
    Manifold& out = manifolds[next_manifold];
    out = patches[i].manifold;
    out.pair = row.pair;
    out.first_point = next_point;
    for (std::uint32_t k = 0; k < out.point_count; ++k) {
      ManifoldPoint& point = points[next_point++];
      point = patches[i].point[k];
      point.id = manifold::feature_hash(bodies_of(pair), point.id);
      point.manifold = next_manifold;
    }
    ++next_manifold;
  }
  if (!match) return;
  const PairPoints* const end = pair_points_before.data() + pair_points_before.size();
  const PairPoints* const before =
      std::lower_bound(static_cast<const PairPoints*>(pair_points_before.data()), end, bodies_of(pair),
                       [](const PairPoints& p, std::uint64_t bodies) { return p.bodies < bodies; });
  if (before == end || before->bodies != bodies_of(pair)) return;
  const Shape &a = shapes[instances[pair.a].asset], &b = shapes[instances[pair.b].asset];
  const OneThread team;
  const manifold::PointMatcher<OneThread> matcher(team, std::min(a.diagonal, b.diagonal));
  matcher.match(points.data(), manifolds.data(), row.first_point, row.points,
                {manifolds_before.data(), points_before.data(), before->first, before->count});
}

// What the next call looks for its points in.
Status ManifoldQuery::State::remember_step(std::span<const ObjectPair> pairs) {
  pair_points_before.clear();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].points == 0) continue;
    if (!pair_points_before.push({bodies_of(pairs[rows[i].pair]), rows[i].first_point, rows[i].points}))
      return fail(Status::kOutOfMemory, 0);
  }
  std::sort(pair_points_before.data(), pair_points_before.data() + pair_points_before.size(),
            [](const PairPoints& x, const PairPoints& y) {
              return x.bodies != y.bodies ? x.bodies < y.bodies : x.first < y.first;
            });
  return Status::kOk;
}

ManifoldQuery::ManifoldQuery() : state_(new (std::nothrow) State) {}
ManifoldQuery::ManifoldQuery(ManifoldQuery&&) noexcept = default;
ManifoldQuery& ManifoldQuery::operator=(ManifoldQuery&&) noexcept = default;
ManifoldQuery::~ManifoldQuery() = default;

Status ManifoldQuery::set_assets(std::span<const AssetView> assets) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  State& state = *state_;
  state.shapes.clear();
  state.triangle_counts.clear();
  forget_points();
  if (assets.size() >= kNoIndex) return state.fail(Status::kOutOfRange, 0);
  for (std::size_t i = 0; i < assets.size(); ++i) {
    Status status = Status::kOk;
    if (assets[i].header == nullptr || assets[i].levels.empty()) {
      status = Status::kUnknownAsset;
    } else if (assets[i].level().topology == nullptr) {
      status = Status::kNoTopology;
    } else if (!state.shapes.push(manifold::shape_of(*assets[i].header, assets[i].level())) ||
               !state.triangle_counts.push(assets[i].level().triangle_count)) {
      status = Status::kOutOfMemory;
    }
    if (status != Status::kOk) {
      state.shapes.clear();
      return state.fail(status, i);
    }
  }
  return Status::kOk;
}

Status ManifoldQuery::make(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
                           std::span<const Contact> contacts, const ManifoldOptions& options) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  State& state = *state_;
  if (!options.match_previous) forget_points();
  std::swap(state.manifolds, state.manifolds_before);
  std::swap(state.points, state.points_before);
  const auto failed = [&](Status status) {
    forget_points();
    return status;
  };
  Status status = state.check(instances, pairs, contacts);
  if (status == Status::kOk) status = state.group(pairs.size(), contacts);
  if (status != Status::kOk) return failed(status);
  const auto most_points = static_cast<int>(std::clamp(options.most_points, 1u, kMostManifoldPoints));
  const std::size_t chunks = (state.rows.size() + kPairsAtOnce - 1) / kPairsAtOnce;
  const auto workers = static_cast<std::uint32_t>(
      std::clamp<std::size_t>(chunks, 1, std::clamp(options.threads, 1u, kMostQueryThreads)));
  if ((status = state.provide_workers(workers)) != Status::kOk) return failed(status);
  state.threads.for_parts(workers, state.rows.size(), kPairsAtOnce,
                          [&](std::size_t from, std::size_t to, std::uint32_t worker) {
                            state.make_patches(from, to, worker, instances, pairs, contacts, most_points);
                          });
  state.counters = {};
  for (std::uint32_t i = 0; i < workers; ++i) {
    if (!state.workers[i].enough_memory) return failed(state.fail(Status::kOutOfMemory, 0));
    state.counters.segments += state.workers[i].made.segments;
    state.counters.ambiguous_touches += state.workers[i].made.ambiguous_touches;
  }
  if ((status = state.place_rows()) != Status::kOk) return failed(status);
  state.threads.for_parts(
      workers, state.rows.size(), kPairsAtOnce, [&](std::size_t from, std::size_t to, std::uint32_t) {
        for (std::size_t i = from; i < to; ++i) {
          state.finish(state.rows[i], instances, pairs[state.rows[i].pair], options.match_previous);
        }
      });
  state.counters.contacts = contacts.size();
  state.counters.manifolds = state.manifolds.size();
  state.counters.points = state.points.size();
  for (std::size_t i = 0; i < state.manifolds.size(); ++i) {
    state.counters.open_curves += (state.manifolds[i].flags & kOpenCurve) != 0;
  }
  if (options.match_previous && (status = state.remember_step(pairs)) != Status::kOk) return failed(status);
  return Status::kOk;
}

std::span<const Manifold> ManifoldQuery::manifolds() const {
  return state_ != nullptr ? state_->manifolds.view() : std::span<const Manifold>();
}

std::span<const ManifoldPoint> ManifoldQuery::points() const {
  return state_ != nullptr ? state_->points.view() : std::span<const ManifoldPoint>();
}

const ManifoldCounters& ManifoldQuery::counters() const {
  static constexpr ManifoldCounters kNone;
  return state_ != nullptr ? state_->counters : kNone;
}

void ManifoldQuery::forget_points() {
  if (state_ != nullptr) state_->pair_points_before.clear();
}

std::uint64_t ManifoldQuery::where() const {
  return state_ != nullptr ? state_->where : 0;
}

}  // namespace tandem
