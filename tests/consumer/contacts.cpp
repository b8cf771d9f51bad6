#include <tandem/kernels/contact_query.h>
#include <tandem/runtime/map.h>
#include <cstdio>
#include <vector>

// Moves a row of ten bodies together, a step at a time, and counts what meets.
int main(int, char** argv) {
  tandem::MappedAsset file;
  if (const tandem::Status status = file.open(argv[1]); status != tandem::Status::kOk) {
    return std::printf("%s: %s\n", argv[1], tandem::explain(status)), 1;
  }
  tandem::Scene scene;
  tandem::ContactQuery query;
  const tandem::AssetView assets[] = {file.view()};
  if (scene.set_assets(assets) != tandem::Status::kOk) return std::puts("not enough memory"), 1;

  std::vector<tandem::Instance> bodies(10, {.asset = 0, .pose = tandem::kIdentityPose});
  for (const double spacing : {1.5, 1.0, 0.5}) {
    for (std::size_t i = 0; i < bodies.size(); ++i)
      bodies[i].pose.translation[0] = spacing * static_cast<double>(i);
    tandem::Status status = scene.place(bodies);
    if (status == tandem::Status::kOk) status = query.find(scene);
    if (status != tandem::Status::kOk)
      return std::printf("body %d: %s\n", static_cast<int>(scene.where()), tandem::explain(status)), 1;
    std::printf("spacing %.1f: %zu pairs of bodies, %zu of triangles\n", spacing, query.pairs().size(),
                query.rows().size());
    if (query.rows().empty()) continue;
    const tandem::Contact& first = query.rows()[0];
    const tandem::ObjectPair& pair = query.pairs()[first.pair];
    std::printf("  such as face %u of body %u and face %u of body %u\n", first.face_a, pair.a, first.face_b,
                pair.b);
  }
}
