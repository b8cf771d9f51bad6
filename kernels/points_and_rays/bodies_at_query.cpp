#include "tandem/kernels/bodies_at_query.h"

#include "kernels/points_and_rays/scene_probe.h"

namespace tandem {
namespace {

bool contains(const WorldBox& box, const std::array<double, 3>& point) {
  bool inside = true;
  for (int k = 0; k < 3; ++k) inside = inside && box.lo[k] <= point[k] && point[k] <= box.hi[k];
  return inside;
}

}  // namespace

Status BodiesAtQuery::find(Scene& in, const BodiesAtOptions& options) {
  return ask_scene(in, [&](SceneState& scene) {
    rows_.clear();
    for (std::uint32_t p = 0; p < options.points.size(); ++p) {
      if (!is_in_range(options.points[p])) return scene.fail(Status::kOutOfRange, p);
      for (std::uint32_t body = 0; body < scene.boxes.size(); ++body) {
        if (contains(scene.boxes[body], options.points[p]) && !rows_.push({p, body}))
          return scene.fail(Status::kOutOfMemory, p);
      }
    }
    counters_ = {options.points.size(), options.points.size() * scene.boxes.size()};
    return Status::kOk;
  });
}

}  // namespace tandem
