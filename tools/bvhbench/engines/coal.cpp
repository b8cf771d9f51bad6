#include <coal/BVH/BVH_model.h>
#include <coal/distance.h>

#include "bvh_models.h"

namespace tandem {
namespace {

struct Coal : BvhLibrary<coal::BVHModel, coal::Vec3s, coal::Triangle, coal::Transform3s> {
  static Transform transform(const Pose& pose) {
    coal::Matrix3s rotation;
    coal::Vec3s translation;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) rotation(i, j) = pose.rotation[i][j];
      translation[i] = pose.translation[i];
    }
    return {rotation, translation};
  }

  template <typename Model>
  static double distance(const Model* a, const Transform& at_a, const Model* b, const Transform& at_b) {
    coal::DistanceRequest request;
    request.rel_err = 1e-6;
    request.enable_signed_distance = false;
    coal::DistanceResult result;
    coal::distance(a, at_a, b, at_b, request, result);
    return result.min_distance;
  }
};

}  // namespace

std::unique_ptr<Engine> make_coal(std::string_view name, const Question&) {
  if (name == "coal-rss") return std::make_unique<BvhDistances<Coal, coal::RSS>>(name, "Coal RSS", "RSS");
  return std::make_unique<BvhDistances<Coal, coal::OBBRSS>>(name, "Coal OBBRSS", "OBBRSS");
}

}  // namespace tandem
