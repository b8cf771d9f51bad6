#include "tandem/kernels/bodies_at_query.h"

#include <algorithm>

#include "kernels/points_and_rays/scene_probe.h"

namespace tandem {
namespace {

bool contains(const WorldBox& box, const std::array<double, 3>& point) {
  bool inside = true;
  for (int k = 0; k < 3; ++k) inside = inside && box.lo[k] <= point[k] && point[k] <= box.hi[k];
  return inside;
}

}  // namespace

struct BodiesAtQuery::State : Allocated {
  ProbedBodies bodies;
};

Status BodiesAtQuery::answer(SceneState& scene, const BodiesAtOptions& options) {
  if (options.points.size() >= kNoIndex) return scene.fail(Status::kBadOption, 0);
  State* const state = state_.provide();
  if (state == nullptr) return scene.fail(Status::kOutOfMemory, 0);
  if (const Status status = state->bodies.make(scene); status != Status::kOk) return status;
  rows_.clear();
  counters_ = {options.points.size(), 0};
  for (std::uint32_t p = 0; p < options.points.size(); ++p) {
    const std::array<double, 3>& point = options.points[p];
    if (!is_in_range(point)) return scene.fail(Status::kOutOfRange, p);
    const std::size_t first = rows_.size();
    bool enough_memory = true;
    const auto bound = [&](const WorldBox& box) {
      ++counters_.boxes;
      return contains(box, point) ? 0 : HUGE_VAL;
    };
    state->bodies.visit(bound, 0, [&](std::uint32_t body) {
      if (contains(scene.boxes[body], point)) enough_memory = enough_memory && rows_.push({p, body});
    });
    if (!enough_memory) return scene.fail(Status::kOutOfMemory, p);
    std::sort(rows_.data() + first, rows_.data() + rows_.size(),
              [](const BodyAt& x, const BodyAt& y) { return x.body < y.body; });
  }
  return Status::kOk;
}

Status BodiesAtQuery::find(Scene& in, const BodiesAtOptions& options) {
  return ask_scene(in, [&](SceneState& scene) { return answer(scene, options); });
}

}  // namespace tandem
