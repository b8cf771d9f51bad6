#include <tandem/kernels/distance_query.h>
#include <tandem/runtime/map.h>
#include <cstdio>
#include <vector>

// How near each of three bodies in a row is to the others, where that is at most 2.
int main(int, char** argv) {
  tandem::MappedAsset file;
  if (const tandem::Status status = file.open(argv[1]); status != tandem::Status::kOk) {
    return std::printf("%s: %s\n", argv[1], tandem::explain(status)), 1;
  }
  tandem::Scene scene;
  tandem::DistanceQuery query;
  const tandem::AssetView assets[] = {file.view()};
  if (scene.set_assets(assets) != tandem::Status::kOk) return std::puts("not enough memory"), 1;

  std::vector<tandem::Instance> bodies(3, {.asset = 0, .pose = tandem::kIdentityPose});
  for (std::size_t i = 0; i < bodies.size(); ++i)
    bodies[i].pose.translation[0] = 1.5 * static_cast<double>(i);
  tandem::Status status = scene.place(bodies);
  if (status == tandem::Status::kOk) status = query.find(scene, {.reach = 2});
  if (status != tandem::Status::kOk)
    return std::printf("body %d: %s\n", static_cast<int>(scene.where()), tandem::explain(status)), 1;
  for (std::size_t i = 0; i < query.pairs().size(); ++i) {
    const tandem::ObjectPair& pair = query.pairs()[i];
    const tandem::ObjectDistance& found = query.rows()[i];
    std::printf("bodies %u and %u: %.6f to %.6f, from x = %.2f to x = %.2f\n", pair.a, pair.b, found.lower,
                found.upper, found.point_a[0], found.point_b[0]);
  }
}
