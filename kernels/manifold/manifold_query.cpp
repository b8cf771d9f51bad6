#include "tandem/kernels/manifold_query.h"

#include <algorithm>

#include "kernels/common/check_options.h"
#include "kernels/manifold/finish.h"
#include "kernels/manifold/pair_patches.h"
#include "kernels/manifold/shape.h"
#include "kernels/scene/scene_state.h"

namespace tandem {
namespace {

using manifold::BodyPair;
using manifold::OneThread;
using manifold::Patch;
using manifold::Shape;

// Pairs with contacts that a thread takes at a time.
constexpr std::size_t kRowsAtOnce = 16;

// A pair that has contacts: where its patches lie, and where its manifolds and points go.
struct Row {
  std::uint32_t pair;
  std::uint32_t worker;
  std::size_t first_patch;
  std::uint32_t patches, points;
  std::uint32_t first_manifold, first_point;
};

// The points of a pair of bodies.
struct PairPoints {
  std::uint64_t bodies;
  std::uint32_t first, count;
};

struct ManifoldWorker {
  PairPatches made;
  bool enough_memory = true;
};

std::uint64_t bodies_of(const ObjectPair& pair) {
  return std::uint64_t{pair.a} << 32 | pair.b;
}

}  // namespace

struct ManifoldQuery::State : Allocated {
  // The manifolds of a call and their points.
  struct Found {
    Manifold* manifolds;
    ManifoldPoint* points;
  };

  std::uint64_t assets_id = 0;  // whose shapes these are
  Buffer<Shape> shapes;
  Buffer<std::uint32_t> begin;  // of each pair's contacts
  Buffer<Contact> grouped;
  Buffer<Row> rows;
  PerWorker<ManifoldWorker> workers;
  Buffer<Manifold> manifolds_before;
  Buffer<ManifoldPoint> points_before;
  Buffer<PairPoints> pair_points_before;

  Status name_shapes(SceneState& scene);
  Status check_bodies(SceneState& scene) const;
  Status check(SceneState& scene, std::span<const ObjectPair> pairs, std::span<const Contact> contacts) const;
  Status group(SceneState& scene, std::size_t pairs, std::span<const Contact>& contacts);
  void make_patches(std::size_t from, std::size_t to, std::uint32_t worker, const SceneState& scene,
                    std::span<const ObjectPair> pairs, std::span<const Contact> contacts, int most_points);
  Status place_rows(SceneState& scene, Buffer<Manifold>& manifolds, Buffer<ManifoldPoint>& points);
  void finish(Row& row, const SceneState& scene, const ObjectPair& pair, Found found, bool match);
  bool remember_step(std::span<const ObjectPair> pairs);
};

// The points of other assets are none of these.
Status ManifoldQuery::State::name_shapes(SceneState& scene) {
  if (assets_id == scene.assets_id) return Status::kOk;
  assets_id = 0;
  pair_points_before.clear();
  shapes.clear();
  if (const Status status = scene.require_topology(); status != Status::kOk) return status;
  for (std::size_t i = 0; i < scene.assets.size(); ++i) {
    const SceneAsset& asset = scene.assets[i];
    if (!shapes.push(manifold::shape_of(*asset.view.header, asset.tree)))
      return scene.fail(Status::kOutOfMemory, i);
  }
  assets_id = scene.assets_id;
  return Status::kOk;
}

Status ManifoldQuery::State::check_bodies(SceneState& scene) const {
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    if (!scene.is_body(i)) continue;
    const manifold::Body body(shapes[scene.instances[i].asset], scene.instances[i].pose);
    if (!(body.reach <= kLargestWorldCoordinate)) return scene.fail(Status::kOutOfRange, i);
  }
  return Status::kOk;
}

Status ManifoldQuery::State::check(SceneState& scene, std::span<const ObjectPair> pairs,
                                   std::span<const Contact> contacts) const {
  if (contacts.size() >= kNoIndex / 8) return scene.fail(Status::kOutOfRange, contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& contact = contacts[i];
    const bool known = contact.pair < pairs.size() &&
                       contact.triangle_a < scene.bodies[pairs[contact.pair].a].tree.triangle_count &&
                       contact.triangle_b < scene.bodies[pairs[contact.pair].b].tree.triangle_count;
    if (!known) return scene.fail(Status::kUnknownContact, i);
  }
  return Status::kOk;
}

// Finds where each pair's contacts begin, and brings them together if they are not. Lists the pairs that have
// some.
Status ManifoldQuery::State::group(SceneState& scene, std::size_t pairs, std::span<const Contact>& contacts) {
  if (!begin.resize(pairs + 1)) return scene.fail(Status::kOutOfMemory, 0);
  std::fill(begin.data(), begin.data() + pairs + 1, 0u);
  bool ascending = true;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    ++begin[contacts[i].pair + 1];
    ascending = ascending && (i == 0 || contacts[i - 1].pair <= contacts[i].pair);
  }
  rows.clear();
  for (std::size_t i = 0; i < pairs; ++i) {
    if (begin[i + 1] > 0 && !rows.push({static_cast<std::uint32_t>(i), 0, 0, 0, 0, 0, 0}))
      return scene.fail(Status::kOutOfMemory, 0);
    if (begin[i + 1] > manifold::kMostContactsOfPair) return scene.fail(Status::kOutOfRange, i);
    begin[i + 1] += begin[i];
  }
  if (ascending) return Status::kOk;
  if (!grouped.resize(contacts.size())) return scene.fail(Status::kOutOfMemory, 0);
  for (const Contact& contact : contacts) grouped[begin[contact.pair]++] = contact;
  for (std::size_t i = pairs; i > 0; --i) begin[i] = begin[i - 1];
  begin[0] = 0;
  contacts = grouped.view();
  return Status::kOk;
}

void ManifoldQuery::State::make_patches(std::size_t from, std::size_t to, std::uint32_t worker,
                                        const SceneState& scene, std::span<const ObjectPair> pairs,
                                        std::span<const Contact> contacts, int most_points) {
  ManifoldWorker& own = workers[worker];
  Buffer<Patch>& patches = own.made.patches;
#ifdef TANDEM_HAVE_LANES
  const MeansThread team = {{}, best_manifold_lanes()};
#else
  const OneThread team;
#endif
  for (std::size_t i = from; i < to && own.enough_memory; ++i) {
    Row& row = rows[i];
    const ObjectPair& pair = pairs[row.pair];
    row.worker = worker;
    row.first_patch = patches.size();
    if (pair.a == pair.b) continue;
    const Instance &a = scene.instances[pair.a], &b = scene.instances[pair.b];
    const BodyPair bodies = {{shapes[a.asset], a.pose}, {shapes[b.asset], b.pose}};
    const std::uint32_t first = begin[row.pair], count = begin[row.pair + 1] - first;
    own.enough_memory = own.made.add(team, bodies, contacts.data() + first, count, most_points);
    row.patches = static_cast<std::uint32_t>(patches.size() - row.first_patch);
    for (std::uint32_t k = 0; k < row.patches; ++k) {
      row.points += patches[row.first_patch + k].manifold.point_count;
    }
  }
}

Status ManifoldQuery::State::place_rows(SceneState& scene, Buffer<Manifold>& manifolds,
                                        Buffer<ManifoldPoint>& points) {
  std::uint64_t next_manifold = 0, next_point = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].first_manifold = static_cast<std::uint32_t>(next_manifold);
    rows[i].first_point = static_cast<std::uint32_t>(next_point);
    next_manifold += rows[i].patches;
    next_point += rows[i].points;
  }
  if (next_point >= kNoIndex) return scene.fail(Status::kOutOfRange, 0);
  if (!manifolds.resize(next_manifold) || !points.resize(next_point))
    return scene.fail(Status::kOutOfMemory, 0);
  return Status::kOk;
}

void ManifoldQuery::State::finish(Row& row, const SceneState& scene, const ObjectPair& pair, Found found,
                                  bool match) {
  Patch* const patches = workers[row.worker].made.patches.data() + row.first_patch;
  std::sort(patches, patches + row.patches, [](const Patch& x, const Patch& y) { return x.key < y.key; });
  std::uint32_t next_manifold = row.first_manifold, next_point = row.first_point;
  for (std::uint32_t i = 0; i < row.patches; ++i) {
    Manifold& out = found.manifolds[next_manifold];
    out = patches[i].manifold;
    out.pair = row.pair;
    out.first_point = next_point;
    for (std::uint32_t k = 0; k < out.point_count; ++k) {
      ManifoldPoint& point = found.points[next_point++];
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
  const Shape &a = shapes[scene.instances[pair.a].asset], &b = shapes[scene.instances[pair.b].asset];
  const OneThread team;
  const manifold::PointMatcher<OneThread> matcher(team, std::min(a.diagonal, b.diagonal));
  matcher.match(found.points, found.manifolds, row.first_point, row.points,
                {manifolds_before.data(), points_before.data(), before->first, before->count});
}

// Keeps the manifolds and points in which the next call looks for its points.
bool ManifoldQuery::State::remember_step(std::span<const ObjectPair> pairs) {
  pair_points_before.clear();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].points == 0) continue;
    if (!pair_points_before.push({bodies_of(pairs[rows[i].pair]), rows[i].first_point, rows[i].points}))
      return false;
  }
  std::sort(pair_points_before.data(), pair_points_before.data() + pair_points_before.size(),
            [](const PairPoints& x, const PairPoints& y) {
              return x.bodies != y.bodies ? x.bodies < y.bodies : x.first < y.first;
            });
  return true;
}

Status ManifoldQuery::answer(SceneState& scene, State& state, std::span<const Contact> contacts,
                             const ManifoldOptions& options) {
  const std::span<const ObjectPair> pairs = pairs_.view();
  Status status = state.check(scene, pairs, contacts);
  if (status == Status::kOk) status = state.group(scene, pairs.size(), contacts);
  if (status != Status::kOk) return status;
  const auto most_points = static_cast<int>(options.most_points);
  const std::uint32_t workers = scene.workers_for(state.rows.size(), kRowsAtOnce);
  if (!scene.threads.provide(workers)) return scene.fail(Status::kCannotStartThread, 0);
  if (!state.workers.provide(workers)) return scene.fail(Status::kOutOfMemory, 0);
  for (std::uint32_t i = 0; i < workers; ++i) {
    state.workers[i].made.clear();
    state.workers[i].enough_memory = true;
  }
  scene.threads.for_parts(workers, state.rows.size(), kRowsAtOnce,
                          [&](std::size_t from, std::size_t to, std::uint32_t worker) {
                            state.make_patches(from, to, worker, scene, pairs, contacts, most_points);
                          });
  counters_ = {};
  for (std::uint32_t i = 0; i < workers; ++i) {
    if (!state.workers[i].enough_memory) return scene.fail(Status::kOutOfMemory, 0);
    counters_.segments += state.workers[i].made.segments;
    counters_.ambiguous_touches += state.workers[i].made.ambiguous_touches;
  }
  if ((status = state.place_rows(scene, rows_, points_)) != Status::kOk) return status;
  scene.threads.for_parts(workers, state.rows.size(), kRowsAtOnce,
                          [&](std::size_t from, std::size_t to, std::uint32_t) {
                            for (std::size_t i = from; i < to; ++i) {
                              state.finish(state.rows[i], scene, pairs[state.rows[i].pair],
                                           {rows_.data(), points_.data()}, options.match_previous);
                            }
                          });
  counters_.contacts = contacts.size();
  counters_.manifolds = rows_.size();
  counters_.points = points_.size();
  for (const Manifold& made : rows_.view()) counters_.open_curves += (made.flags & kOpenCurve) != 0;
  return !options.match_previous || state.remember_step(pairs) ? Status::kOk
                                                               : scene.fail(Status::kOutOfMemory, 0);
}

// query: that has found the contacts, or null.
Status ManifoldQuery::ask(Scene& in, std::span<const ObjectPair> pairs, std::span<const Contact> contacts,
                          const ContactQuery* query, const ManifoldOptions& options) {
  SceneState* const scene = in.state();
  State* const state = state_.provide();
  Status status = Status::kOutOfMemory;
  if (scene != nullptr && state != nullptr) {
    const DeviceMemory* const on_device = query != nullptr ? query->on_device_of(*scene) : nullptr;
    if (!options.match_previous || on_device != nullptr) state->pair_points_before.clear();
    std::swap(rows_, state->manifolds_before);
    std::swap(points_, state->points_before);
    status = check_most_points(options.most_points);
    status = status == Status::kOk ? state->name_shapes(*scene) : scene->fail(status, 0);
    if (status == Status::kOk) status = scene->take_pairs(pairs, pairs_);
    if (status == Status::kOk) status = state->check_bodies(*scene);
    if (status == Status::kOk) {
      status = on_device != nullptr ? scene->ask_device(options, *on_device, points_, found())
                                    : answer(*scene, *state, contacts, options);
    }
  }
  if (status == Status::kOk) return status;
  forget_points();
  points_.clear();
  return forget(status);
}

Status ManifoldQuery::find(Scene& scene, std::span<const ObjectPair> pairs, std::span<const Contact> contacts,
                           const ManifoldOptions& options) {
  return ask(scene, pairs, contacts, nullptr, options);
}

Status ManifoldQuery::find(Scene& scene, const ContactQuery& contacts, const ManifoldOptions& options) {
  return ask(scene, contacts.pairs(), contacts.rows(), &contacts, options);
}

void ManifoldQuery::forget_points() {
  if (State* const state = state_.get()) state->pair_points_before.clear();
  memory_on_device_.reset();
}

}  // namespace tandem
