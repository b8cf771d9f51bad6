#include "tandem/kernels/impact_query.h"

#include <algorithm>
#include <cmath>

#include "kernels/common/check_options.h"
#include "kernels/contact/contact_finder.h"
#include "kernels/impact/impact_walk.h"
#include "kernels/impact/triangle_impact.h"
#include "kernels/scene/scene_state.h"

namespace tandem {
namespace {

using impact::MovingBody;
using impact::PairMotion;
using impact::PairStop;
using manifold::Vector3;

// Boxes that a worker looks at, and pairs that it walks, at a time.
constexpr std::size_t kSweptBoxesAtOnce = 64, kMovesAtOnce = 4;

// Counts what a worker did; each pair's impact has its own place.
struct ImpactWorker {
  ImpactCounters counters;
  impact::ImpactWalk walk;
};

void add_to(ImpactCounters& sum, const ImpactCounters& part) {
  using C = ImpactCounters;
  tandem::add_to(sum, part,
                 {&C::at_start, &C::found, &C::walks, &C::block_pairs, &C::triangle_pairs, &C::advanced,
                  &C::steps, &C::unconverged});
  sum.most_steps = std::max(sum.most_steps, part.most_steps);
}

Status check(SceneState& scene, const ImpactOptions& options) {
  if (options.motion.size() != scene.bodies.size()) return scene.fail(Status::kMotionMismatch, 0);
  const Status status = check_impact_options(options.duration, options.tolerance);
  return status == Status::kOk ? status : scene.fail(status, 0);
}

void write(const Vector3& x, double (&out)[3]) {
  out[0] = x.x;
  out[1] = x.y;
  out[2] = x.z;
}

// Writes what two triangles of a pair tell at a time, a part of the step.
void tell(const PairMotion& pair, const LevelView& a, const LevelView& b, double time, Impact& out) {
  const Triangle &of_a = a.triangles[out.triangle_a], &of_b = b.triangles[out.triangle_b];
  const impact::TrianglesAt triangles =
      triangles_at(pair, impact::moving_triangles(pair, of_a, of_b), impact::place_at(pair, time));
  const TriangleDistance distance = triangle_distance(impact::triangle_pair(triangles));
  const Vector3 centre = pair.a->centre + time * pair.a->displacement;
  out.gap = distance.interval.upper;
  write(centre + impact::vector_of(distance.point_a), out.point_a);
  write(centre + impact::vector_of(distance.point_b), out.point_b);
  out.face_a = of_a.source_face();
  out.face_b = of_b.source_face();
}

constexpr Impact none_in(double duration) {
  return {duration, INFINITY, {0, 0, 0}, {0, 0, 0},         kNoIndex,
          kNoIndex, kNoIndex, kNoIndex,  ImpactStatus::none};
}

}  // namespace

struct ImpactQuery::State : Allocated {
  Buffer<MovingBody> bodies;
  Buffer<WorldBox> boxes;  // swept
  BroadPhase broad_phase;
  ContactFinder finder;
  Buffer<Contact> contacts;          // at the start, one of each pair that has any
  Buffer<std::uint32_t> contact_of;  // each pair's row of the contacts, or kNoIndex
  PerWorker<ImpactWorker> workers;

  Status move(SceneState& scene, const ImpactOptions& options);
  Status find_pairs(SceneState& scene, Buffer<ObjectPair>& pairs);
  Status find_contacts_at_start(SceneState& scene, std::span<const ObjectPair> pairs);
  Impact impact_of(std::size_t row, const ObjectPair& pair, const SceneState& scene,
                   const ImpactOptions& options, ImpactWorker& worker) const;
};

// Removed bodies stay where they are, nowhere.
Status ImpactQuery::State::move(SceneState& scene, const ImpactOptions& options) {
  const std::size_t count = scene.bodies.size();
  if (!bodies.resize(count) || !boxes.resize(count)) return scene.fail(Status::kOutOfMemory, 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    boxes[i] = scene.boxes[i];
    if (!scene.is_body(i)) continue;
    const SceneAsset& asset = scene.asset_of(i);
    const Status status = moving_body(scene.bodies[i].pose, options.motion[i], options.duration, asset.lower,
                                      asset.upper, asset.extent, bodies[i]);
    if (status != Status::kOk) return scene.fail(status, i);
    boxes[i] =
        swept_box(scene.boxes[i], bodies[i].displacement, bodies[i].turn, bodies[i].fastest, bodies[i].error);
  }
  return Status::kOk;
}

Status ImpactQuery::State::find_pairs(SceneState& scene, Buffer<ObjectPair>& pairs) {
  const std::uint32_t wanted = scene.workers_for(boxes.size(), kSweptBoxesAtOnce);
  if (!scene.threads->provide(wanted)) return scene.fail(Status::kCannotStartThread, 0);
  const Status status = broad_phase.find_pairs(boxes.view(), scene.filter(), false, *scene.threads, wanted);
  if (status != Status::kOk) return scene.fail(status, 0);
  return scene.take_pairs(broad_phase.pairs(), pairs);
}

Status ImpactQuery::State::find_contacts_at_start(SceneState& scene, std::span<const ObjectPair> pairs) {
  ContactCounters counters;
  const Status status =
      finder.find(scene, scene.bodies.view(), pairs, {.first_contact_only = true}, contacts, counters);
  if (status != Status::kOk) return status;
  if (!contact_of.resize(pairs.size())) return scene.fail(Status::kOutOfMemory, 0);
  std::fill_n(contact_of.data(), pairs.size(), kNoIndex);
  for (std::uint32_t i = 0; i < contacts.size(); ++i) contact_of[contacts[i].pair] = i;
  return Status::kOk;
}

Impact ImpactQuery::State::impact_of(std::size_t row, const ObjectPair& pair, const SceneState& scene,
                                     const ImpactOptions& options, ImpactWorker& worker) const {
  const SceneAsset &a = scene.asset_of(pair.a), &b = scene.asset_of(pair.b);
  const PairMotion motion = impact::pair_motion(bodies[pair.a], bodies[pair.b]);
  Impact impact = none_in(options.duration);
  if (contact_of[row] != kNoIndex) {
    const Contact& contact = contacts[contact_of[row]];
    impact.t_safe = 0;
    impact.triangle_a = contact.triangle_a;
    impact.triangle_b = contact.triangle_b;
    impact.status = ImpactStatus::at_start;
    tell(motion, a.tree, b.tree, 0, impact);
    impact.gap = 0;
    ++worker.counters.at_start;
    return impact;
  }
  if (pair.a == pair.b || stay_apart(motion, boxes[pair.a], boxes[pair.b])) return impact;
  const double tolerance = options.tolerance * std::min(a.diagonal, b.diagonal);
  const PairStop stop = worker.walk.find_stop(motion, a.tree, b.tree, tolerance, worker.counters);
  if (stop.triangle_a == kNoIndex) return impact;
  impact.t_safe = stop.time * options.duration * (1 - 0x1p-51);
  impact.triangle_a = stop.triangle_a;
  impact.triangle_b = stop.triangle_b;
  impact.status = ImpactStatus::found;
  tell(motion, a.tree, b.tree, stop.time, impact);
  ++worker.counters.found;
  return impact;
}

Status ImpactQuery::answer(SceneState& scene, const std::span<const ObjectPair>* given,
                           const ImpactOptions& options) {
  Status status = check(scene, options);
  if (status == Status::kOk) status = scene.require_float32_corners();
  if (status == Status::kOk && given != nullptr) status = scene.take_pairs(*given, pairs_);
  if (status != Status::kOk) return status;
  if (scene.device != nullptr) return scene.ask_device(options, given == nullptr, found());
  State* const state = state_.provide();
  if (state == nullptr) return scene.fail(Status::kOutOfMemory, 0);
  status = state->move(scene, options);
  if (status == Status::kOk && given == nullptr) status = state->find_pairs(scene, pairs_);
  if (status == Status::kOk) status = state->find_contacts_at_start(scene, pairs_.view());
  if (status != Status::kOk) return status;
  const std::uint32_t workers = scene.workers_for(pairs_.size(), kMovesAtOnce);
  if (!scene.threads->provide(workers)) return scene.fail(Status::kCannotStartThread, 0);
  if (!state->workers.provide(workers) || !rows_.resize(pairs_.size()))
    return scene.fail(Status::kOutOfMemory, 0);
  for (std::uint32_t i = 0; i < workers; ++i) state->workers[i].counters = {};
  scene.threads->for_parts(
      workers, pairs_.size(), kMovesAtOnce, [&](std::size_t i, std::size_t end, std::uint32_t worker) {
        for (; i < end; ++i)
          rows_[i] = state->impact_of(i, pairs_[i], scene, options, state->workers[worker]);
      });
  counters_ = {};
  for (std::uint32_t i = 0; i < workers; ++i) add_to(counters_, state->workers[i].counters);
  counters_.object_pairs = pairs_.size();
  return Status::kOk;
}

}  // namespace tandem
