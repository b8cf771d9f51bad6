#include "kernels/random_scenes.h"
#include "made_patches.h"
#include "manifold_scene.h"

#ifdef TANDEM_HAVE_LANES
namespace tandem::test {
namespace {

// Compares all pairs of bodies by every variant that this machine has. Returns how many patches there are.
std::size_t compare_variants(std::span<const AssetView> views, std::span<const Instance> posed,
                             const ContactQuery& query) {
  std::size_t patches = 0;
  for_each_pair(views, posed, query,
                [&](const manifold::BodyPair& bodies, std::span<const Contact> contacts) {
                  const PatchesOfPair plain = patches_of(manifold::OneThread(), bodies, contacts);
                  patches += plain.patches.size();
                  for (const BlockPairVariant variant : kBlockPairVariants) {
                    const ManifoldLanes* const means = manifold_lanes(variant);
                    if (means == nullptr) continue;
                    SCOPED_TRACE(static_cast<int>(variant));
                    expect_same(plain, patches_of(MeansThread{{}, *means}, bodies, contacts));
                  }
                });
  return patches;
}

std::size_t compare_variants(ManifoldScene& scene) {
  scene.find();
  return compare_variants(scene.assets.views(), scene.posed, scene.query);
}

TEST(ManifoldLanes, EveryVariantGivesTheSameBytes) {
  std::size_t patches = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    ManifoldScene scene;
    RandomPoses random(seed);
    for (const Mesh& mesh : {cube(0.3f, 2), tetrahedron(), sphere(0.4, 3), pipe(12, 0.2, 0.4, 0.4f),
                             sheet(1, 6), project_mesh("cow_1500.obj")}) {
      scene.add_shape(mesh);
    }
    for (int i = 0; i < 40; ++i)
      scene.add_body(static_cast<std::uint32_t>(random.below(6)), any_motion(random, 1));
    patches += compare_variants(scene);
  }
  EXPECT_GT(patches, 500u);
}

// Soups of triangles among them, at any distance from the origin.
TEST(ManifoldLanes, PatchesOfRandomScenesAreTheSameToo) {
  const SampleAssets meshes = sample_meshes();
  std::size_t patches = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const RandomScene random = random_scene(meshes.views(), seed);
    SCOPED_TRACE(testing::Message() << random.kind << ", seed " << seed);
    for (const std::vector<Instance>& instances : random.steps) {
      Scene scene;
      ContactQuery query;
      ASSERT_EQ(scene.set_assets(meshes.views()), Status::kOk);
      ASSERT_EQ(scene.place(instances), Status::kOk);
      ASSERT_EQ(query.find(scene), Status::kOk);
      patches += compare_variants(meshes.views(), instances, query);
    }
  }
  EXPECT_GT(patches, 500u);
}

TEST(ManifoldLanes, CornersInPlanesAreTheSameToo) {
  std::size_t patches = 0;
  for (const double far : {0.0, 1e4}) {
    for (const int cells : {1, 3}) {
      ManifoldScene scene;
      scene.add_shape(cube(0.5f, cells));
      scene.add_shape(sheet(3, 4));
      for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 3; ++j) scene.add_body(0, shift(far + i, 0.25 * j, j));
      }
      scene.add_body(1, shift(far, 0, 0));
      scene.add_body(0, after(shift(far, 0, 2.9), turn(1, 0.3)));
      patches += compare_variants(scene);
    }
  }
  EXPECT_GT(patches, 40u);
}

}  // namespace
}  // namespace tandem::test
#endif
