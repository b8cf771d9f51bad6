// Contact manifolds on the GPU: the bytes of the CPU.
#include <gtest/gtest.h>

#include <cstring>

#include "gpu_scene_fixture.h"
#include "tandem/kernels/gpu_contact_manifolds.h"

namespace tandem {
namespace {

using test::download;
using test::GpuScene;
using test::Scene;

GpuQueryOptions grouped() {
  GpuQueryOptions options = test::gpu_options(QueryMode::exact);
  options.grouped = true;
  return options;
}

struct Result {
  std::vector<Manifold> manifolds;
  std::vector<ManifoldPoint> points;
  ManifoldCounters counters;
};

Result result_of(const GpuContactManifolds& made) {
  return {download(made.manifolds(), made.report().manifolds), download(made.points(), made.report().points),
          made.report().counters};
}

template <typename Element>
bool same_bytes(const std::vector<Element>& x, const std::vector<Element>& y) {
  return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(Element)) == 0;
}

/// The first difference, for people.
void explain_difference(const Result& cpu, const Result& gpu) {
  for (std::size_t i = 0; i < std::min(cpu.manifolds.size(), gpu.manifolds.size()); ++i) {
    const Manifold &x = cpu.manifolds[i], &y = gpu.manifolds[i];
    if (std::memcmp(&x, &y, sizeof x) == 0) continue;
    ADD_FAILURE() << "manifold " << i << " of pair " << x.pair << " " << y.pair << ", points " << x.point_count << " "
                  << y.point_count << ", flags " << x.flags << " " << y.flags << ", depth " << x.depth << " "
                  << y.depth - x.depth << ", normal off " << x.normal[0] - y.normal[0] << " "
                  << x.normal[1] - y.normal[1] << " " << x.normal[2] - y.normal[2] << ", centre off "
                  << x.centre[0] - y.centre[0] << ", area off " << x.area_vector[0] - y.area_vector[0];
    break;
  }
  for (std::size_t i = 0; i < std::min(cpu.points.size(), gpu.points.size()); ++i) {
    const ManifoldPoint &x = cpu.points[i], &y = gpu.points[i];
    if (std::memcmp(&x, &y, sizeof x) == 0) continue;
    ADD_FAILURE() << "point " << i << " of manifold " << x.manifold << " " << y.manifold << ", id " << x.id << " "
                  << y.id << ", depth " << x.depth << " " << y.depth - x.depth << ", position off "
                  << x.position[0] - y.position[0] << ", in a off " << x.in_a[0] - y.in_a[0] << ", faces " << x.face_a
                  << " " << y.face_a << " " << x.face_b << " " << y.face_b << ", previous " << x.previous << " "
                  << y.previous;
    return;
  }
}

void expect_same(const Result& cpu, const Result& gpu) {
  EXPECT_EQ(cpu.manifolds.size(), gpu.manifolds.size());
  EXPECT_EQ(cpu.points.size(), gpu.points.size());
  EXPECT_EQ(cpu.counters.segments, gpu.counters.segments);
  EXPECT_EQ(cpu.counters, gpu.counters);
  if (!same_bytes(cpu.manifolds, gpu.manifolds) || !same_bytes(cpu.points, gpu.points)) explain_difference(cpu, gpu);
}

/// Both sides of a scene, which goes on from step to step.
class BothSides {
 public:
  explicit BothSides(const test::SampleAssets& assets, Contents contents = Contents::manifolds)
      : assets_(assets), contents_(contents) {
    EXPECT_EQ(query_.set_assets(assets.views()), Status::kOk);
    EXPECT_EQ(manifolds_.set_assets(assets.views()), Status::kOk);
  }

  /// Result: how many points there are.
  std::size_t step(const std::vector<Instance>& instances, const std::vector<ObjectPair>& pairs,
                   bool match_previous = true) {
    EXPECT_EQ(query_.find_contacts(instances, pairs, {}), Status::kOk);
    EXPECT_EQ(manifolds_.make(instances, pairs, query_.contacts(), {.match_previous = match_previous}), Status::kOk);
    const Result cpu = {{manifolds_.manifolds().begin(), manifolds_.manifolds().end()},
                        {manifolds_.points().begin(), manifolds_.points().end()},
                        manifolds_.counters()};
    const GpuScene scene(assets_, instances, pairs, contents_);
    GpuContactQuery query;
    EXPECT_EQ(query.set_assets(scene.assets(), nullptr), Status::kOk);
    if (first_) EXPECT_EQ(gpu_.set_assets(scene.assets(), nullptr), Status::kOk);
    if (!first_) EXPECT_EQ(gpu_.replace_assets_for_test(scene.assets()), Status::kOk);
    first_ = false;
    EXPECT_EQ(query.find_contacts(scene.instances(), scene.pairs(), grouped(), nullptr), Status::kOk);
    EXPECT_EQ(gpu_.make(scene.instances(), scene.pairs(), query, {.match_previous = match_previous}, nullptr),
              Status::kOk);
    EXPECT_LE(gpu_.bytes(), most_manifold_bytes(gpu_.capacity(), assets_.views().size()));
    expect_same(cpu, result_of(gpu_));
    return cpu.points.size();
  }

 private:
  const test::SampleAssets& assets_;
  Contents contents_;
  ContactQuery query_;
  ContactManifolds manifolds_;
  GpuContactManifolds gpu_;
  bool first_ = true;
};

}  // namespace
}  // namespace tandem
