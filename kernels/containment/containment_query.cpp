#include "tandem/kernels/containment_query.h"

#include <algorithm>
#include <tuple>

#include "kernels/common/component_labels.h"
#include "kernels/containment/containment_rule.h"
#include "kernels/scene/scene_state.h"

namespace tandem {
namespace {

using containment::below;
using containment::kOfOpenComponent;
using containment::PosedSurface;
using containment::Surface;

// Pairs that a thread takes at a time.
constexpr std::size_t kPairsAtOnce = 64;

Surface surface_of(const SceneAsset& asset) {
  const LevelView& level = asset.tree;
  Surface surface = {};
  surface.triangles = level.triangles;
  surface.blocks = level.blocks;
  surface.oriented_blocks = level.oriented_blocks;
  surface.components = level.components;
  surface.triangle_count = level.triangle_count;
  surface.component_count = level.component_count;
  surface.closed = level.closed;
  for (std::uint32_t c = 0; c < level.component_count; ++c)
    surface.any_closed = surface.any_closed || is_closed(level.components[c]);
  std::copy_n(asset.origin, 3, surface.origin);
  std::copy_n(asset.lower, 3, surface.lower);
  std::copy_n(asset.upper, 3, surface.upper);
  surface.farthest = farthest_of(asset.extent);
  return surface;
}

// Returns whether the ray from p crosses the closed components an odd number of times. The stack: each block
// on the way down leaves three beside it, and the lowest gives four.
bool is_inside(const PosedSurface& body, const double* p) {
  const Block* blocks = body.surface->blocks;
  std::uint32_t stack[3 * kMaxDepth + 1];
  int waiting = 0;
  stack[waiting++] = 0;
  bool odd = false;
  while (waiting > 0) {
    const Block& block = blocks[stack[--waiting]];
    for (int i = 0; i < kNodesPerBlock; ++i) {
      if (!ray_may_cross(body, block, i, p)) continue;
      if (block.is_leaf_block()) {
        odd = odd != ray_crosses(body, below(block, i), p);
      } else {
        stack[waiting++] = below(block, i);
      }
    }
  }
  return odd;
}

struct Found {
  Buffer<Containment> rows;
  bool enough_memory = true;
};

}  // namespace

struct ContainmentQuery::State : Allocated {
  std::uint64_t assets_id = 0, shapes_id = 0;  // whose surfaces these are
  Buffer<Surface> surfaces;
  Buffer<std::uint32_t> labels;
  Buffer<std::uint32_t> begin;  // of each pair's contacts
  PerWorker<Found> found;

  Status name_surfaces(SceneState& scene);
  Status check(SceneState& scene, std::span<const ObjectPair> pairs, std::span<const Contact> contacts);
  void find(std::uint32_t pair, const SceneState& scene, const ObjectPair& bodies,
            std::span<const Contact> contacts, Found& out) const;
};

Status ContainmentQuery::State::name_surfaces(SceneState& scene) {
  if (assets_id == scene.assets_id && shapes_id == scene.shapes_id) return Status::kOk;
  const bool label_all = assets_id != scene.assets_id;
  assets_id = 0;
  surfaces.clear();
  std::size_t labelled = 0;
  for (std::size_t i = 0; i < scene.assets.size(); ++i) {
    const LevelView& level = scene.assets[i].tree;
    if (!surfaces.push(surface_of(scene.assets[i]))) return scene.fail(Status::kOutOfMemory, i);
    if (level.component_count != 1) labelled += level.triangle_count;
  }
  if (!labels.resize(labelled)) return scene.fail(Status::kOutOfMemory, 0);
  std::uint32_t* next = labels.data();
  for (std::size_t i = 0; i < scene.assets.size(); ++i) {
    const LevelView& level = scene.assets[i].tree;
    if (level.component_count == 1) continue;
    if (label_all && !containment::label_triangles(level, next)) return scene.fail(Status::kOutOfMemory, i);
    surfaces[i].labels = next;
    next += level.triangle_count;
  }
  assets_id = scene.assets_id;
  shapes_id = scene.shapes_id;
  return Status::kOk;
}

// Checks contacts, and finds where each pair's begin.
Status ContainmentQuery::State::check(SceneState& scene, std::span<const ObjectPair> pairs,
                                      std::span<const Contact> contacts) {
  if (contacts.size() >= kNoIndex) return scene.fail(Status::kOutOfRange, contacts.size());
  if (!begin.resize(pairs.size() + 1)) return scene.fail(Status::kOutOfMemory, 0);
  std::size_t next = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    begin[i] = static_cast<std::uint32_t>(next);
    const LevelView &a = scene.bodies[pairs[i].a].tree, &b = scene.bodies[pairs[i].b].tree;
    for (; next < contacts.size() && contacts[next].pair == i; ++next) {
      if (contacts[next].triangle_a >= a.triangle_count || contacts[next].triangle_b >= b.triangle_count)
        return scene.fail(Status::kUnknownContact, next);
    }
  }
  begin[pairs.size()] = static_cast<std::uint32_t>(next);
  return next == contacts.size() ? Status::kOk : scene.fail(Status::kUnknownContact, next);
}

void ContainmentQuery::State::find(std::uint32_t pair, const SceneState& scene, const ObjectPair& bodies,
                                   std::span<const Contact> contacts, Found& out) const {
  if (bodies.a == bodies.b) return;
  const PosedSurface body[2] = {{&surfaces[scene.instances[bodies.a].asset], scene.bodies[bodies.a].pose},
                                {&surfaces[scene.instances[bodies.b].asset], scene.bodies[bodies.b].pose}};
  for (std::uint32_t inner = 0; inner < 2; ++inner) {
    const PosedSurface& outer = body[1 - inner];
    const std::uint32_t* label = body[inner].surface->labels;
    containment::find_contained(
        body[inner], outer, !contacts.empty(), [&](const double* p) { return is_inside(outer, p); },
        [&](std::uint32_t first) {
          return std::any_of(contacts.begin(), contacts.end(), [&](const Contact& contact) {
            const std::uint32_t t = inner == 0 ? contact.triangle_a : contact.triangle_b;
            return (label[t] & ~kOfOpenComponent) == first;
          });
        },
        [&](std::uint32_t component, std::uint32_t flags) {
          out.enough_memory = out.enough_memory && out.rows.push({pair, inner, component, flags});
        });
  }
}

// Which worker found what is chance; the order of the rows is not.
Status ContainmentQuery::answer(SceneState& scene, std::span<const Contact> contacts) {
  const std::span<const ObjectPair> pairs = pairs_.view();
  State* const provided = state_.provide();
  if (provided == nullptr) return scene.fail(Status::kOutOfMemory, 0);
  State& state = *provided;
  Status status = state.name_surfaces(scene);
  if (status == Status::kOk) status = state.check(scene, pairs, contacts);
  if (status != Status::kOk) return status;
  const std::uint32_t workers = scene.workers_for(pairs.size(), kPairsAtOnce);
  if (!scene.threads->provide(workers)) return scene.fail(Status::kCannotStartThread, 0);
  if (!state.found.provide(workers)) return scene.fail(Status::kOutOfMemory, 0);
  for (std::uint32_t i = 0; i < workers; ++i) {
    state.found[i].rows.clear();
    state.found[i].enough_memory = true;
  }
  scene.threads->for_parts(workers, pairs.size(), kPairsAtOnce,
                           [&](std::size_t from, std::size_t to, std::uint32_t worker) {
                             for (std::size_t i = from; i < to; ++i) {
                               const std::uint32_t first = state.begin[i], end = state.begin[i + 1];
                               state.find(static_cast<std::uint32_t>(i), scene, pairs[i],
                                          contacts.subspan(first, end - first), state.found[worker]);
                             }
                           });
  rows_.clear();
  counters_ = {pairs.size(), 0, 0};
  for (std::uint32_t i = 0; i < workers; ++i) {
    if (!state.found[i].enough_memory) return scene.fail(Status::kOutOfMemory, 0);
    for (const Containment& row : state.found[i].rows.view()) {
      if (!rows_.push(row)) return scene.fail(Status::kOutOfMemory, 0);
      counters_.inside += (row.flags & kInside) != 0;
      counters_.outer_open += (row.flags & kOuterOpen) != 0;
    }
  }
  std::sort(rows_.data(), rows_.data() + rows_.size(), [](const Containment& x, const Containment& y) {
    return std::tie(x.pair, x.inner, x.component) < std::tie(y.pair, y.inner, y.component);
  });
  return Status::kOk;
}

// query: that has found the contacts, or null.
Status ContainmentQuery::ask(Scene& in, std::span<const ObjectPair> pairs, std::span<const Contact> contacts,
                             const ContactQuery* query) {
  return ask_scene(in, [&](SceneState& scene) {
    const DeviceMemory* const on_device = query != nullptr ? query->on_device_of(scene) : nullptr;
    Status status = scene.require_topology();
    if (status == Status::kOk) status = scene.require_float32_corners();
    if (status == Status::kOk) status = scene.take_pairs(pairs, pairs_);
    if (status != Status::kOk) return status;
    return on_device != nullptr ? scene.ask_device(*on_device, found()) : answer(scene, contacts);
  });
}

Status ContainmentQuery::find(Scene& scene, std::span<const ObjectPair> pairs,
                              std::span<const Contact> contacts) {
  return ask(scene, pairs, contacts, nullptr);
}

Status ContainmentQuery::find(Scene& scene, const ContactQuery& contacts) {
  return ask(scene, contacts.pairs(), contacts.rows(), &contacts);
}

}  // namespace tandem
