#include "tandem/kernels/containment_query.h"

#include <algorithm>
#include <new>
#include <tuple>

#include "kernels/common/instance_check.h"
#include "kernels/common/worker_threads.h"
#include "kernels/containment/component_labels.h"
#include "kernels/containment/containment_rule.h"
#include "tandem/kernels/detail/buffer.h"

namespace tandem {
namespace {

using containment::below;
using containment::kOfOpenComponent;
using containment::PosedSurface;
using containment::Surface;

// Pairs that a thread takes at a time.
constexpr std::size_t kPairsAtOnce = 64;

Surface surface_of(const FileHeader& header, const LevelView& level) {
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
  std::copy_n(header.origin, 3, surface.origin);
  std::copy_n(header.lower, 3, surface.lower);
  std::copy_n(header.upper, 3, surface.upper);
  surface.farthest = farthest_of(extent_of(level.blocks[0]));
  return surface;
}

// Whether the ray from p crosses the closed components an odd number of times. The stack: each block on the
// way down leaves three beside it, and the lowest gives four.
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

struct alignas(64) Found : Allocated {
  Buffer<Containment> rows;
  bool enough_memory = true;
};

}  // namespace

struct ContainmentQuery::State : Allocated {
  Buffer<Surface> surfaces;
  Buffer<std::uint32_t> labels;
  Buffer<Pose> poses;           // of stored coordinates
  Buffer<std::uint32_t> begin;  // of each pair's contacts
  Buffer<Containment> contained;
  std::uint64_t where = 0;

  WorkerThreads threads;
  std::unique_ptr<Found[]> found;
  std::uint32_t found_count = 0;

  Status fail(Status status, std::uint64_t at) {
    where = at;
    contained.clear();
    return status;
  }
  Status set_assets(std::span<const AssetView> assets);
  Status pose(std::span<const Instance> instances);
  Status check(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
               std::span<const Contact> contacts);
  Status provide_workers(std::uint32_t wanted);
  void find(std::uint32_t pair, std::span<const Instance> instances, const ObjectPair& bodies,
            std::span<const Contact> contacts, Found& out) const;
  Status gather(std::uint32_t workers);
};

Status ContainmentQuery::State::set_assets(std::span<const AssetView> assets) {
  surfaces.clear();
  std::size_t labelled = 0;
  for (std::size_t i = 0; i < assets.size(); ++i) {
    if (assets[i].header == nullptr || assets[i].levels.empty()) return fail(Status::kUnknownAsset, i);
    const LevelView level = assets[i].level();
    if (level.topology == nullptr) return fail(Status::kNoTopology, i);
    if (!surfaces.push(surface_of(*assets[i].header, level))) return fail(Status::kOutOfMemory, i);
    if (level.component_count != 1) labelled += level.triangle_count;
  }
  if (!labels.resize(labelled)) return fail(Status::kOutOfMemory, 0);
  std::uint32_t* next = labels.data();
  for (std::size_t i = 0; i < assets.size(); ++i) {
    const LevelView level = assets[i].level();
    if (level.component_count == 1) continue;
    if (!containment::label_triangles(level, next)) return fail(Status::kOutOfMemory, i);
    surfaces[i].labels = next;
    next += level.triangle_count;
  }
  return Status::kOk;
}

Status ContainmentQuery::State::pose(std::span<const Instance> instances) {
  if (instances.size() >= kNoIndex) return fail(Status::kTooManyInstances, 0);
  if (!poses.resize(instances.size())) return fail(Status::kOutOfMemory, 0);
  for (std::size_t i = 0; i < instances.size(); ++i) {
    WorldBox box;
    const Status status = pose_instance(surfaces.data(), static_cast<std::uint32_t>(surfaces.size()),
                                        instances[i].asset, instances[i].pose, poses[i], box);
    if (status != Status::kOk) return fail(status, i);
  }
  return Status::kOk;
}

// Checks pairs and contacts, and finds where each pair's contacts begin.
Status ContainmentQuery::State::check(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
                                      std::span<const Contact> contacts) {
  if (pairs.size() >= kNoIndex) return fail(Status::kTooManyPairs, 0);
  if (contacts.size() >= kNoIndex) return fail(Status::kOutOfRange, contacts.size());
  if (!begin.resize(pairs.size() + 1)) return fail(Status::kOutOfMemory, 0);
  std::size_t next = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Status status = check_pair(pairs[i], static_cast<std::uint32_t>(instances.size()));
    if (status != Status::kOk) return fail(status, i);
    begin[i] = static_cast<std::uint32_t>(next);
    const Surface &a = surfaces[instances[pairs[i].a].asset], &b = surfaces[instances[pairs[i].b].asset];
    for (; next < contacts.size() && contacts[next].pair == i; ++next) {
      if (contacts[next].triangle_a >= a.triangle_count || contacts[next].triangle_b >= b.triangle_count)
        return fail(Status::kUnknownContact, next);
    }
  }
  begin[pairs.size()] = static_cast<std::uint32_t>(next);
  return next == contacts.size() ? Status::kOk : fail(Status::kUnknownContact, next);
}

Status ContainmentQuery::State::provide_workers(std::uint32_t wanted) {
  if (!threads.provide(wanted)) return fail(Status::kCannotStartThread, 0);
  if (wanted > found_count) {
    found.reset(new (std::nothrow) Found[wanted]);
    found_count = found == nullptr ? 0 : wanted;
    if (found == nullptr) return fail(Status::kOutOfMemory, 0);
  }
  for (std::uint32_t i = 0; i < wanted; ++i) {
    found[i].rows.clear();
    found[i].enough_memory = true;
  }
  return Status::kOk;
}

void ContainmentQuery::State::find(std::uint32_t pair, std::span<const Instance> instances,
                                   const ObjectPair& bodies, std::span<const Contact> contacts,
                                   Found& out) const {
  if (bodies.a == bodies.b) return;
  const PosedSurface body[2] = {{&surfaces[instances[bodies.a].asset], poses[bodies.a]},
                                {&surfaces[instances[bodies.b].asset], poses[bodies.b]}};
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
Status ContainmentQuery::State::gather(std::uint32_t workers) {
  contained.clear();
  for (std::uint32_t i = 0; i < workers; ++i) {
    if (!found[i].enough_memory) return fail(Status::kOutOfMemory, 0);
    for (const Containment& row : found[i].rows.view()) {
      if (!contained.push(row)) return fail(Status::kOutOfMemory, 0);
    }
  }
  std::sort(contained.data(), contained.data() + contained.size(),
            [](const Containment& x, const Containment& y) {
              return std::tie(x.pair, x.inner, x.component) < std::tie(y.pair, y.inner, y.component);
            });
  return Status::kOk;
}

ContainmentQuery::ContainmentQuery() : state_(new (std::nothrow) State) {}
ContainmentQuery::ContainmentQuery(ContainmentQuery&&) noexcept = default;
ContainmentQuery& ContainmentQuery::operator=(ContainmentQuery&&) noexcept = default;
ContainmentQuery::~ContainmentQuery() = default;

Status ContainmentQuery::set_assets(std::span<const AssetView> assets) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  const Status status = state_->set_assets(assets);
  if (status != Status::kOk) state_->surfaces.clear();
  return status;
}

Status ContainmentQuery::find(std::span<const Instance> instances, std::span<const ObjectPair> pairs,
                              std::span<const Contact> contacts, std::uint32_t threads) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  State& state = *state_;
  Status status = state.pose(instances);
  if (status == Status::kOk) status = state.check(instances, pairs, contacts);
  if (status != Status::kOk) return status;
  const auto workers = static_cast<std::uint32_t>(
      std::clamp<std::size_t>(pairs.size() / kPairsAtOnce, 1, std::clamp(threads, 1u, kMostQueryThreads)));
  if ((status = state.provide_workers(workers)) != Status::kOk) return status;
  state.threads.for_parts(workers, pairs.size(), kPairsAtOnce,
                          [&](std::size_t from, std::size_t to, std::uint32_t worker) {
                            for (std::size_t i = from; i < to; ++i) {
                              const std::uint32_t first = state.begin[i], end = state.begin[i + 1];
                              state.find(static_cast<std::uint32_t>(i), instances, pairs[i],
                                         contacts.subspan(first, end - first), state.found[worker]);
                            }
                          });
  return state.gather(workers);
}

std::span<const Containment> ContainmentQuery::contained() const {
  return state_ != nullptr ? state_->contained.view() : std::span<const Containment>();
}

std::uint64_t ContainmentQuery::where() const {
  return state_ != nullptr ? state_->where : 0;
}

}  // namespace tandem
