#include "tandem/kernels/manifold_query.h"

#include <algorithm>
#include <numeric>

#include "kernels/common/check_options.h"
#include "kernels/manifold/finish.h"
#include "kernels/manifold/kept_manifold.h"
#include "kernels/manifold/pair_patches.h"
#include "kernels/manifold/shape.h"
#include "kernels/scene/scene_state.h"

namespace tandem {
namespace {

using manifold::BodyPair;
using manifold::FoundManifold;
using manifold::FoundPoint;
using manifold::OneThread;
using manifold::Patch;
using manifold::Shape;

// Pairs with contacts that a thread takes at a time, where there are enough for every thread to come back
// often.
constexpr std::size_t kMostRowsAtOnce = 16, kPartsForEach = 32;

// Pairs whose manifolds a thread keeps at a time.
constexpr std::size_t kKeptAtOnce = 256;

// A pair that has contacts, and where its patches lie.
struct Row {
  std::uint32_t asked;  // its row of the pairs whose contacts these are
  std::uint32_t pair;   // its row of all pairs
  std::uint32_t worker;
  std::size_t first_patch;
  std::uint32_t patches, points;
};

// The place of the manifolds and points of a pair.
struct PairPlace {
  std::uint32_t first_manifold, manifolds, first_point, points;
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
  struct Rows {
    Buffer<Manifold>& manifolds;
    Buffer<ManifoldPoint>& points;
  };

  // This has what was found, to be moved if it is kept; each entry is about the row of the same index.
  struct Found {
    Buffer<FoundManifold> manifolds;
    Buffer<FoundPoint> points;
  };

  std::uint64_t assets_id = 0, shapes_id = 0;  // whose shapes these are
  Buffer<Shape> shapes;
  Buffer<std::uint32_t> begin;  // of each pair's contacts
  Buffer<Contact> grouped;
  Buffer<Row> rows;
  Buffer<std::uint32_t> order;  // in which rows are made
  PerWorker<ManifoldWorker> workers;
  Buffer<Manifold> manifolds_before;
  Buffer<ManifoldPoint> points_before;
  Buffer<PairPlace> places, places_before;  // of each pair
  Buffer<PairPoints> pair_points_before;
  Found found, found_before;
  std::uint64_t moved_call = 0;  // what was found is of that call of MovedQuery, or of none

  Status name_shapes(SceneState& scene);
  Status check_bodies(SceneState& scene) const;
  Status check(SceneState& scene, std::span<const ObjectPair> pairs, std::span<const Contact> contacts) const;
  Status check_kept(SceneState& scene, const Asked& asked, bool on_device) const;
  Status group(SceneState& scene, std::size_t pairs, std::span<const Contact>& contacts);
  bool put_in_order(bool for_threads);
  void name_pairs(const MovedQuery* moved);
  void make_patches(std::size_t from, std::size_t to, std::uint32_t worker, const SceneState& scene,
                    std::span<const ObjectPair> pairs, std::span<const Contact> contacts,
                    const manifold::PatchOptions& options);
  Status place_pairs(SceneState& scene, std::size_t pairs, const MovedQuery* moved, Rows out);
  void finish(const Row& row, const SceneState& scene, const ObjectPair& pair, bool remember, Rows out,
              bool match);
  void keep(std::uint32_t pair, const SceneState& scene, const MovedQuery& moved, Rows out, bool match);
  bool remember_step(std::span<const ObjectPair> pairs);
};

// The points of other assets are none of these.
Status ManifoldQuery::State::name_shapes(SceneState& scene) {
  if (assets_id == scene.assets_id && shapes_id == scene.shapes_id) return Status::kOk;
  if (assets_id != scene.assets_id) {
    pair_points_before.clear();
    moved_call = 0;
  }
  assets_id = 0;
  shapes.clear();
  Status status = scene.require_topology();
  if (status == Status::kOk) status = scene.require_float32_corners();
  if (status != Status::kOk) return status;
  for (std::size_t i = 0; i < scene.assets.size(); ++i) {
    const SceneAsset& asset = scene.assets[i];
    if (!shapes.push(manifold::shape_of(asset.tree, asset.lower, asset.upper, asset.origin)))
      return scene.fail(Status::kOutOfMemory, i);
  }
  assets_id = scene.assets_id;
  shapes_id = scene.shapes_id;
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
    if (begin[i + 1] > 0 &&
        !rows.push({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i), 0, 0, 0, 0}))
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

// Threads begin with the pairs of most contacts, so that none of these is left when all others are done.
bool ManifoldQuery::State::put_in_order(bool for_threads) {
  if (!order.resize(rows.size())) return false;
  std::iota(order.data(), order.data() + order.size(), 0u);
  if (!for_threads) return true;
  const auto contacts = [&](std::uint32_t row) {
    return begin[rows[row].asked + 1] - begin[rows[row].asked];
  };
  std::sort(order.data(), order.data() + order.size(),
            [&](std::uint32_t x, std::uint32_t y) { return contacts(x) > contacts(y); });
  return true;
}

// Says which of all pairs those are that have contacts.
void ManifoldQuery::State::name_pairs(const MovedQuery* moved) {
  if (moved == nullptr) return;
  std::size_t row = 0;
  std::uint32_t asked = 0;
  for (std::uint32_t pair = 0; row < rows.size(); ++pair) {
    if (moved->kept_rows()[pair] != kNoIndex) continue;
    if (rows[row].asked == asked++) rows[row++].pair = pair;
  }
}

void ManifoldQuery::State::make_patches(std::size_t from, std::size_t to, std::uint32_t worker,
                                        const SceneState& scene, std::span<const ObjectPair> pairs,
                                        std::span<const Contact> contacts,
                                        const manifold::PatchOptions& options) {
  ManifoldWorker& own = workers[worker];
  Buffer<Patch>& patches = own.made.patches;
#ifdef TANDEM_HAVE_LANES
  const MeansThread team = {{}, best_manifold_lanes()};
#else
  const OneThread team;
#endif
  for (std::size_t i = from; i < to && own.enough_memory; ++i) {
    Row& row = rows[order[i]];
    const ObjectPair& pair = pairs[row.pair];
    row.worker = worker;
    row.first_patch = patches.size();
    if (pair.a == pair.b) continue;
    const Instance &a = scene.instances[pair.a], &b = scene.instances[pair.b];
    const BodyPair bodies = {{shapes[a.asset], a.pose}, {shapes[b.asset], b.pose}};
    const std::uint32_t first = begin[row.asked], count = begin[row.asked + 1] - first;
    own.enough_memory = own.made.add(team, bodies, contacts.data() + first, count, options);
    row.patches = static_cast<std::uint32_t>(patches.size() - row.first_patch);
    for (std::uint32_t k = 0; k < row.patches; ++k) {
      row.points += patches[row.first_patch + k].manifold.point_count;
    }
  }
}

Status ManifoldQuery::State::place_pairs(SceneState& scene, std::size_t pairs, const MovedQuery* moved,
                                         Rows out) {
  if (!places.resize(pairs)) return scene.fail(Status::kOutOfMemory, 0);
  std::fill_n(places.data(), pairs, PairPlace{});
  for (const Row& row : rows.view()) {
    places[row.pair].manifolds = row.patches;
    places[row.pair].points = row.points;
  }
  std::uint64_t next_manifold = 0, next_point = 0;
  for (std::size_t i = 0; i < pairs; ++i) {
    if (moved != nullptr && moved->kept_rows()[i] != kNoIndex)
      places[i] = places_before[moved->kept_rows()[i]];
    places[i].first_manifold = static_cast<std::uint32_t>(next_manifold);
    places[i].first_point = static_cast<std::uint32_t>(next_point);
    next_manifold += places[i].manifolds;
    next_point += places[i].points;
  }
  if (next_point >= kNoIndex || next_manifold >= kNoIndex) return scene.fail(Status::kOutOfRange, 0);
  const bool has_memory =
      out.manifolds.resize(next_manifold) && out.points.resize(next_point) &&
      (moved == nullptr || (found.manifolds.resize(next_manifold) && found.points.resize(next_point)));
  return has_memory ? Status::kOk : scene.fail(Status::kOutOfMemory, 0);
}

void ManifoldQuery::State::finish(const Row& row, const SceneState& scene, const ObjectPair& pair,
                                  bool remember, Rows out, bool match) {
  Patch* const patches = workers[row.worker].made.patches.data() + row.first_patch;
  std::sort(patches, patches + row.patches, [](const Patch& x, const Patch& y) { return x.key < y.key; });
  const PairPlace& place = places[row.pair];
  std::uint32_t next_manifold = place.first_manifold, next_point = place.first_point;
  for (std::uint32_t i = 0; i < row.patches; ++i) {
    Manifold& made = out.manifolds[next_manifold];
    made = patches[i].manifold;
    made.pair = row.pair;
    made.first_point = next_point;
    for (std::uint32_t k = 0; k < made.point_count; ++k) {
      ManifoldPoint& point = out.points[next_point++];
      point = patches[i].point[k];
      point.id = manifold::feature_hash(bodies_of(pair), point.id);
      point.manifold = next_manifold;
      if (remember) found.points[next_point - 1] = manifold::found(point);
    }
    if (remember) found.manifolds[next_manifold] = manifold::found(made);
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
  matcher.match(out.points.data(), place.first_point, place.points,
                {points_before.data(), before->first, before->count});
}

// Moves the manifolds of a pair that is kept.
void ManifoldQuery::State::keep(std::uint32_t pair, const SceneState& scene, const MovedQuery& moved,
                                Rows out, bool match) {
  const PairPlace &place = places[pair], &before = places_before[moved.kept_rows()[pair]];
  if (place.manifolds == 0) return;
  const PosedBodies& then = moved.posed()[pair];
  const Instance &a = scene.instances[then.pair.a], &b = scene.instances[then.pair.b];
  const manifold::KeptMotion motion({then.a.pose, then.b.pose}, {a.pose, b.pose},
                                    moved.second_is_larger(a.asset, b.asset));
  for (std::uint32_t i = 0; i < place.manifolds; ++i) {
    const std::uint32_t to = place.first_manifold + i, from = before.first_manifold + i;
    const FoundManifold& of_then = found.manifolds[to] = found_before.manifolds[from];
    Manifold& kept = out.manifolds[to] = manifolds_before[from];
    motion.move(of_then, kept);
    kept.pair = pair;
    kept.first_point = place.first_point + (kept.first_point - before.first_point);
    for (std::uint32_t k = 0; k < kept.point_count; ++k) {
      const std::uint32_t point_to = kept.first_point + k,
                          point_from = before.first_point + (point_to - place.first_point);
      found.points[point_to] = found_before.points[point_from];
      ManifoldPoint& point = out.points[point_to] = points_before[point_from];
      motion.move(found.points[point_to], point);
      point.previous = match ? point_from : kNoIndex;
      point.manifold = to;
      kept.depth = k == 0 ? point.depth : std::max(kept.depth, point.depth);
    }
  }
}

// Keeps the manifolds and points in which the next call looks for its points.
bool ManifoldQuery::State::remember_step(std::span<const ObjectPair> pairs) {
  pair_points_before.clear();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (places[i].points == 0) continue;
    if (!pair_points_before.push({bodies_of(pairs[i]), places[i].first_point, places[i].points}))
      return false;
  }
  std::sort(pair_points_before.data(), pair_points_before.data() + pair_points_before.size(),
            [](const PairPoints& x, const PairPoints& y) {
              return x.bodies != y.bodies ? x.bodies < y.bodies : x.first < y.first;
            });
  return true;
}

// Checks that the call before found what is to be kept. The device knows by itself what it found.
Status ManifoldQuery::State::check_kept(SceneState& scene, const Asked& asked, bool on_device) const {
  if (asked.moved == nullptr) return Status::kOk;
  const MovedQuery& moved = *asked.moved;
  const bool stands = moved.call() != 0 && moved.is_of(scene);
  const bool is_known =
      on_device || moved.counters().kept == 0 || (moved_call != 0 && moved_call == moved.call_before());
  const bool fits = stands && is_known && std::ranges::equal(asked.pairs, moved.rows());
  return fits ? Status::kOk : scene.fail(Status::kKeptMismatch, 0);
}

Status ManifoldQuery::answer(SceneState& scene, State& state, const Asked& asked,
                             const ManifoldOptions& options) {
  const std::span<const ObjectPair> pairs = pairs_.view();
  const MovedQuery* const moved = asked.moved;
  std::span<const Contact> contacts = asked.contacts;
  Status status = state.check(scene, asked.pairs, contacts);
  if (status == Status::kOk) status = state.group(scene, asked.pairs.size(), contacts);
  if (status != Status::kOk) return status;
  state.name_pairs(moved);
  const manifold::PatchOptions of_patches = {static_cast<int>(options.most_points), options.quick_depths};
  const std::size_t at_once =
      std::clamp(state.rows.size() / (kPartsForEach * scene.most_workers), std::size_t{1}, kMostRowsAtOnce);
  const std::uint32_t workers = scene.workers_for(state.rows.size(), at_once);
  if (!scene.threads->provide(workers)) return scene.fail(Status::kCannotStartThread, 0);
  if (!state.workers.provide(workers) || !state.put_in_order(workers > 1))
    return scene.fail(Status::kOutOfMemory, 0);
  for (std::uint32_t i = 0; i < workers; ++i) {
    state.workers[i].made.clear();
    state.workers[i].enough_memory = true;
  }
  scene.threads->for_parts(workers, state.rows.size(), at_once,
                           [&](std::size_t from, std::size_t to, std::uint32_t worker) {
                             state.make_patches(from, to, worker, scene, pairs, contacts, of_patches);
                           });
  counters_ = {};
  for (std::uint32_t i = 0; i < workers; ++i) {
    if (!state.workers[i].enough_memory) return scene.fail(Status::kOutOfMemory, 0);
    counters_.segments += state.workers[i].made.segments;
  }
  const State::Rows out = {rows_, points_};
  if ((status = state.place_pairs(scene, pairs.size(), moved, out)) != Status::kOk) return status;
  scene.threads->for_parts(
      workers, state.rows.size(), kMostRowsAtOnce, [&](std::size_t from, std::size_t to, std::uint32_t) {
        for (std::size_t i = from; i < to; ++i) {
          const Row& row = state.rows[i];
          state.finish(row, scene, pairs[row.pair], moved != nullptr, out, options.match_previous);
        }
      });
  if (moved != nullptr) {
    const std::uint32_t of_pairs = scene.workers_for(pairs.size(), kKeptAtOnce);
    if (!scene.threads->provide(of_pairs)) return scene.fail(Status::kCannotStartThread, 0);
    scene.threads->for_parts(
        of_pairs, pairs.size(), kKeptAtOnce, [&](std::size_t from, std::size_t to, std::uint32_t) {
          for (std::size_t i = from; i < to; ++i) {
            if (moved->kept_rows()[i] != kNoIndex)
              state.keep(static_cast<std::uint32_t>(i), scene, *moved, out, options.match_previous);
          }
        });
  }
  counters_.contacts = contacts.size();
  counters_.manifolds = rows_.size();
  counters_.points = points_.size();
  for (const Manifold& made : rows_.view()) {
    counters_.open_curves += (made.flags & kOpenCurve) != 0;
    counters_.ambiguous_touches += (made.flags & kAmbiguous) != 0;
  }
  state.moved_call = moved != nullptr ? moved->call() : 0;
  return !options.match_previous || state.remember_step(pairs) ? Status::kOk
                                                               : scene.fail(Status::kOutOfMemory, 0);
}

Status ManifoldQuery::ask(Scene& in, const Asked& asked, const ManifoldOptions& options) {
  SceneState* const scene = in.state();
  State* const state = state_.provide();
  Status status = Status::kOutOfMemory;
  if (scene != nullptr && state != nullptr) {
    const DeviceMemory* const on_device =
        asked.query != nullptr ? asked.query->on_device_of(*scene) : nullptr;
    if (!options.match_previous || on_device != nullptr) state->pair_points_before.clear();
    std::swap(rows_, state->manifolds_before);
    std::swap(points_, state->points_before);
    std::swap(state->places, state->places_before);
    std::swap(state->found, state->found_before);
    status = check_most_points(options.most_points);
    status = status == Status::kOk ? state->name_shapes(*scene) : scene->fail(status, 0);
    if (status == Status::kOk) status = state->check_kept(*scene, asked, on_device != nullptr);
    if (status == Status::kOk)
      status = scene->take_pairs(asked.moved != nullptr ? asked.moved->pairs() : asked.pairs, pairs_);
    if (status == Status::kOk) status = state->check_bodies(*scene);
    if (status == Status::kOk) {
      if (on_device != nullptr) state->moved_call = 0;
      status = on_device != nullptr ? scene->ask_device(options, asked.moved, *on_device, points_, found())
                                    : answer(*scene, *state, asked, options);
    }
  }
  if (status == Status::kOk) return status;
  forget_points();
  points_.clear();
  return forget(status);
}

Status ManifoldQuery::find(Scene& scene, std::span<const ObjectPair> pairs, std::span<const Contact> contacts,
                           const ManifoldOptions& options) {
  return ask(scene, {pairs, contacts, nullptr, nullptr}, options);
}

Status ManifoldQuery::find(Scene& scene, const ContactQuery& contacts, const ManifoldOptions& options) {
  return ask(scene, {contacts.pairs(), contacts.rows(), &contacts, nullptr}, options);
}

Status ManifoldQuery::find(Scene& scene, const MovedQuery& moved, std::span<const Contact> contacts,
                           const ManifoldOptions& options) {
  return ask(scene, {moved.rows(), contacts, nullptr, &moved}, options);
}

Status ManifoldQuery::find(Scene& scene, const MovedQuery& moved, const ContactQuery& contacts,
                           const ManifoldOptions& options) {
  return ask(scene, {contacts.pairs(), contacts.rows(), &contacts, &moved}, options);
}

void ManifoldQuery::forget_points() {
  if (State* const state = state_.get()) {
    state->pair_points_before.clear();
    state->moved_call = 0;
  }
  memory_on_device_.reset();
}

}  // namespace tandem
