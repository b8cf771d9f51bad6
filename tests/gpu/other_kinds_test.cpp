// A GPU plays others: less shared memory for the walk's stacks, more or fewer multiprocessors, no early
// launches. Trees as deep as the format allows need the most shared memory.
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "gpu_scene_fixture.h"
#include "kernels/common/device_limits.h"
#include "kernels/contact/walk_shape.h"
#include "tandem/kernels/gpu_broad_phase.h"

namespace tandem {
namespace {

using test::BodyScene;
using test::GpuScene;

struct Kind {
  const char* name;
  gpu::DeviceLimits limits;
};

void PrintTo(const Kind& kind, std::ostream* out) {
  *out << kind.name;
}

// The first two are all that an RTX 30 or 40, and an A100, differ in for a launch; the RTX 50 of most
// multiprocessors has more than an H200, and LeastMemory less memory than any GPU.
constexpr Kind kKinds[] = {{"Rtx3080", {101'376, 68, false}},
                           {"A100", {166'912, 108, false}},
                           {"B200", {232'448, 148, true}},
                           {"RtxPro6000", {101'376, 188, true}},
                           {"LeastMemory", {49'152, 20, false}}};

/// The kind of GPU is that at the time of set_assets().
class GpuOfKind : public test::GpuTestOf<Kind> {
 protected:
  void expect_contacts_of_the_cpu(const BodyScene& scene, const std::vector<ObjectPair>& pairs) {
    const GpuScene on_gpu(scene.assets, scene.instances, pairs);
    GpuContactQuery gpu;
    {
      const gpu::PretendedDevice pretended(GetParam().limits);
      ASSERT_EQ(gpu.set_assets(on_gpu.assets(), nullptr), Status::kOk);
    }
    EXPECT_GE(gpu.bytes(), 512 * gpu::most_mailboxes(GetParam().limits));
    for (const QueryMode mode : test::kModes) {
      const std::vector<Contact> expected = test::ask_cpu(scene, pairs, {.mode = mode}).contacts;
      ASSERT_GT(expected.size(), 10'000u);
      for (int repeat = 0; repeat < 3; ++repeat) {
        ASSERT_EQ(gpu.find_contacts(on_gpu.instances(), on_gpu.pairs(), test::gpu_options(mode), nullptr),
                  Status::kOk)
            << cudaGetErrorString(gpu.cuda_error());
        ASSERT_EQ(test::sorted(test::download(gpu.contacts(), gpu.report().contacts)), expected)
            << "mode " << static_cast<int>(mode) << ", repeat " << repeat;
      }
    }
  }
};

TEST_P(GpuOfKind, FindsTheContactsOfTheDeepestTrees) {
  test::RandomPoses random(51);
  BodyScene scene;
  const test::Mesh mesh = test::soup(random, test::kTrianglesOfDeepestTree, 0.7);
  scene.assets.add(mesh, test::make_file(mesh, test::deepest_tree(mesh)));
  ASSERT_EQ(scene.assets.views()[0].level().depth, kMaxDepth);
  for (int i = 0; i < 4; ++i) scene.instances.push_back({0, random.pose({1, 1, 0.1, 0, 4})});
  expect_contacts_of_the_cpu(scene, test::all_pairs(scene.instances, true, random));
}

TEST_P(GpuOfKind, FindsTheContactsOfAPile) {
  test::RandomPoses random(52);
  const BodyScene scene = test::pile(60, 1500, 2, 52);
  expect_contacts_of_the_cpu(scene, test::all_pairs(scene.instances, false, random));
}

/// Beyond the reach of float32, bodies are walked by world boxes.
TEST_P(GpuOfKind, FindsContactsFarAway) {
  test::RandomPoses random(53);
  BodyScene scene;
  scene.assets.add(test::soup(random, 400, 0.1));
  for (int i = 0; i < 8; ++i) scene.instances.push_back({0, random.pose({1, 1, 0.1, 0, 4})});
  for (Instance& instance : scene.instances) instance.pose.translation[1] += 1e52;
  expect_contacts_of_the_cpu(scene, test::all_pairs(scene.instances, false, random));
}

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

Pairs sorted_pairs_of(GpuBroadPhase& broad, const GpuScene& scene, const GpuAssetBounds& bounds) {
  EXPECT_EQ(broad.find_pairs(scene.instances(), bounds, {.sorted = true}, nullptr), Status::kOk);
  Pairs pairs;
  for (const ObjectPair& pair : test::download(broad.pairs().pairs, broad.report().count))
    pairs.emplace_back(pair.a, pair.b);
  return pairs;
}

TEST_P(GpuOfKind, FindsObjectPairs) {
  const BodyScene scene = test::pile(20'000, 12, 30, 54);
  const GpuScene on_gpu(scene.assets, scene.instances, {});
  const test::GpuBounds bounds(scene.assets);
  GpuBroadPhase as_it_is, other;
  const Pairs expected = sorted_pairs_of(as_it_is, on_gpu, bounds.view());
  ASSERT_GT(expected.size(), 1000u);
  const gpu::PretendedDevice pretended(GetParam().limits);
  EXPECT_EQ(sorted_pairs_of(other, on_gpu, bounds.view()), expected);
}

INSTANTIATE_TEST_SUITE_P(, GpuOfKind, testing::ValuesIn(kKinds),
                         [](const auto& kind) { return std::string(kind.param.name); });

}  // namespace
}  // namespace tandem
