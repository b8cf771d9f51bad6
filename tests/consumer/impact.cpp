#include <tandem/kernels/impact_query.h>
#include <tandem/runtime/map.h>
#include <cstdio>

// Shoots a body at another one, fast enough to pass through it within a step.
int main(int, char** argv) {
  tandem::MappedAsset file;
  if (const tandem::Status status = file.open(argv[1]); status != tandem::Status::kOk) {
    return std::printf("%s: %s\n", argv[1], tandem::explain(status)), 1;
  }
  tandem::Scene scene;
  tandem::ImpactQuery query;
  const tandem::AssetView assets[] = {file.view()};
  if (scene.set_assets(assets) != tandem::Status::kOk) return std::puts("not enough memory"), 1;

  tandem::Instance bodies[] = {{0, tandem::kIdentityPose}, {0, tandem::kIdentityPose}};
  bodies[1].pose.translation[0] = 3;
  tandem::RigidMotion motion[] = {tandem::kAtRest, tandem::kAtRest};
  for (int k = 0; k < 3; ++k) motion[1].centre[k] = bodies[1].pose.translation[k];
  motion[1].velocity[0] = -400;
  const double step = 1.0 / 60;
  tandem::Status status = scene.place(bodies);
  if (status == tandem::Status::kOk) status = query.find(scene, {.motion = motion, .duration = step});
  if (status != tandem::Status::kOk)
    return std::printf("body %d: %s\n", static_cast<int>(scene.where()), tandem::explain(status)), 1;
  for (std::size_t i = 0; i < query.pairs().size(); ++i) {
    const tandem::Impact& impact = query.rows()[i];
    if (impact.status != tandem::ImpactStatus::found) continue;
    const tandem::ObjectPair& pair = query.pairs()[i];
    std::printf("bodies %u and %u do not meet for %.6f s; then faces %u and %u are %.1e apart\n", pair.a,
                pair.b, impact.t_safe, impact.face_a, impact.face_b, impact.gap);
    for (const std::uint32_t body : {pair.a, pair.b})
      bodies[body].pose = tandem::pose_at(bodies[body].pose, motion[body], impact.t_safe);
  }
  std::printf("body 1 stops at %.4f\n", bodies[1].pose.translation[0]);
}
