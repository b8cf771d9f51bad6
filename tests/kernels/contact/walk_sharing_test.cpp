// Warps of the walk that share work: few thread blocks use their mailboxes again and again.
#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>
#include <vector>

#include "gpu/gpu_scene_fixture.h"
#include "kernels/asked.h"
#include "tandem/kernels/contact_query.h"

namespace tandem {
namespace {

using test::BodyScene;
using test::GpuScene;

class WalkSharing : public test::GpuTest {};

std::vector<Contact> in_order(std::vector<Contact> contacts) {
  const auto key = [](const Contact& c) {
    return std::tie(c.pair, c.triangle_a, c.triangle_b, c.face_a, c.face_b);
  };
  std::sort(contacts.begin(), contacts.end(),
            [&](const Contact& x, const Contact& y) { return key(x) < key(y); });
  return contacts;
}

/// Few thread blocks, and the CPU, find the same contacts, whoever gives work to whom.
void expect_contacts_of_the_cpu(const BodyScene& scene, const std::vector<ObjectPair>& pairs) {
  test::Asked<ContactQuery> cpu;
  ASSERT_EQ(cpu.set_assets(scene.assets.views()), Status::kOk);
  ASSERT_EQ(cpu.find(scene.instances, pairs, {}), Status::kOk);
  const std::vector<Contact> expected = in_order({cpu.rows().begin(), cpu.rows().end()});
  ASSERT_GT(expected.size(), 1000u);
  const GpuScene on_gpu(scene.assets, scene.instances, pairs);
  GpuContactQuery gpu;
  ASSERT_EQ(gpu.set_assets(on_gpu.assets(), nullptr), Status::kOk);
  for (const std::uint32_t blocks : {1u, 2u, 3u, 16u}) {
    for (int repeat = 0; repeat < 3; ++repeat) {
      GpuContactOptions options;
      options.most_blocks = blocks;
      ASSERT_EQ(gpu.find_contacts(on_gpu.instances(), on_gpu.pairs(), options, nullptr), Status::kOk);
      ASSERT_EQ(in_order(test::download(gpu.contacts(), gpu.report().contacts)), expected)
          << blocks << " blocks, repeat " << repeat;
    }
  }
}

TEST_F(WalkSharing, OfFewBlocksFindsTheContactsOfTheCpu) {
  const BodyScene scene = test::pile(24, 1500, 1, 41);
  std::vector<ObjectPair> pairs;
  for (std::uint32_t a = 0; a < 24; ++a) {
    for (std::uint32_t b = a; b < 24; ++b) pairs.push_back({a, b});  // each with itself too
  }
  expect_contacts_of_the_cpu(scene, pairs);
}

/// All work begins in one warp.
TEST_F(WalkSharing, OfOneObjectPairFindsTheContactsOfTheCpu) {
  expect_contacts_of_the_cpu(test::pile(3, 30'000, 0.1, 42), {{0, 2}});
}

}  // namespace
}  // namespace tandem
