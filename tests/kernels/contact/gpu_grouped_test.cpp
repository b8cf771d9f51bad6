// Contacts grouped by pair on the GPU: those of the CPU, and ranges that are theirs.
#include <gtest/gtest.h>

#include "gpu/gpu_scene_fixture.h"

namespace tandem {
namespace {

using test::AskedContacts;
using test::BodyScene;
using test::download;

/// Holds in CPU memory what groups() tells.
struct Groups {
  explicit Groups(const AskedContacts& asked) : Groups(asked.query) {}
  explicit Groups(const GpuContactQuery& query)
      : counts(download(query.groups().counts, 1).front()),
        contacts(download(query.groups().contacts, counts.contacts)),
        first_contact(download(query.groups().first_contact, counts.pairs + std::size_t{1})),
        few(download(query.groups().few, counts.few)),
        many(download(query.groups().many, counts.many)) {}

  GpuGroupCounts counts;
  std::vector<Contact> contacts;
  std::vector<std::uint32_t> first_contact, few, many;
};

/// Each range holds contacts of its pair alone, and each pair with contacts is in its list.
void check_ranges(const Groups& groups) {
  EXPECT_EQ(groups.first_contact.front(), 0u);
  EXPECT_EQ(groups.first_contact.back(), groups.contacts.size());
  EXPECT_TRUE(std::is_sorted(groups.first_contact.begin(), groups.first_contact.end()));
  std::vector<std::uint32_t> few, many, pair_of;
  for (std::uint32_t pair = 0; pair < groups.counts.pairs; ++pair) {
    const std::uint32_t count = groups.first_contact[pair + 1] - groups.first_contact[pair];
    if (count != 0) (count <= kFewContacts ? few : many).push_back(pair);
    pair_of.resize(groups.first_contact[pair + 1], pair);
  }
  EXPECT_EQ(groups.few, few);
  EXPECT_EQ(groups.many, many);
  EXPECT_TRUE(std::ranges::equal(groups.contacts, pair_of, {}, &Contact::pair));
}

Groups groups_of(const BodyScene& scene, const std::vector<ObjectPair>& pairs) {
  AskedContacts gpu(scene, pairs);
  EXPECT_EQ(gpu.find(test::grouped_options()), Status::kOk);
  const Groups groups(gpu);
  check_ranges(groups);
  return groups;
}

class GpuGrouped : public test::GpuTest {};

TEST_F(GpuGrouped, ContactsAreTheCpus) {
  const BodyScene scene = test::pile(60, 800, 2, 41);
  test::RandomPoses random(42);
  const std::vector<ObjectPair> all = test::all_pairs(scene.instances, true, random);
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{60}, all.size()}) {
    const std::vector<ObjectPair> pairs(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
    AskedContacts gpu(scene, pairs);
    for (const QueryMode mode : test::kModes) {
      ASSERT_EQ(gpu.find(test::grouped_options(mode)), Status::kOk);
      const Groups groups(gpu);
      EXPECT_EQ(groups.counts.pairs, count);
      EXPECT_EQ(test::sorted(groups.contacts), test::ask_cpu(scene, pairs, {.mode = mode}).contacts);
      check_ranges(groups);
    }
  }
}

/// A body of one triangle twice, and the same body aside: pairs of one contact, in a pattern, and of none.
TEST_F(GpuGrouped, ManyPairsOfOneContact) {
  BodyScene scene;
  test::RandomPoses random(43);
  scene.assets.add(test::soup(random, 1, 0.5));
  scene.instances = {{0, kIdentityPose}, {0, kIdentityPose}, {0, kIdentityPose}};
  scene.instances[2].pose.translation[0] = 10;
  std::vector<ObjectPair> pairs;
  std::uint32_t touching = 0;
  for (std::uint32_t i = 0; i < 250'000; ++i) {
    pairs.push_back(random.below(5) < 2 ? ObjectPair{0, 1} : ObjectPair{0, 2});
    touching += pairs.back().b == 1;
  }
  const Groups groups = groups_of(scene, pairs);
  EXPECT_EQ(groups.counts.contacts, touching);
  EXPECT_EQ(groups.counts.few, touching);
  for (const std::uint32_t pair : groups.few) EXPECT_EQ(pairs[pair].b, 1u);
}

TEST_F(GpuGrouped, OnePairHasAllContacts) {
  BodyScene scene = test::pile(2, 3000, 0, 44);
  scene.instances[1].asset = 0;
  const std::vector<ObjectPair> pairs = {{0, 1}};
  const std::vector<Contact> expected = test::ask_cpu(scene, pairs).contacts;
  ASSERT_GT(expected.size(), kFewContacts);
  const Groups groups = groups_of(scene, pairs);
  EXPECT_EQ(groups.counts.many, 1u);
  EXPECT_EQ(test::sorted(groups.contacts), expected);
}

TEST_F(GpuGrouped, FewEndsWhereManyBegins) {
  BodyScene scene;
  test::RandomPoses random(45);
  test::Mesh mesh = test::soup(random, 1, 0.5);
  scene.assets.add(mesh);
  while (mesh.triangles.size() < kFewContacts) mesh.triangles.push_back(mesh.triangles.front());
  scene.assets.add(mesh);
  mesh.triangles.push_back(mesh.triangles.front());
  scene.assets.add(mesh);
  scene.instances = {{0, kIdentityPose}, {1, kIdentityPose}, {2, kIdentityPose}};
  const Groups groups = groups_of(scene, {{0, 1}, {0, 2}});
  EXPECT_EQ(groups.first_contact, (std::vector<std::uint32_t>{0, kFewContacts, 2 * kFewContacts + 1}));
}

TEST_F(GpuGrouped, AGraphGroupsAgainAndSortedContactsHaveTheSameRanges) {
  const BodyScene scene = test::pile(20, 500, 1, 46);
  const std::vector<ObjectPair> pairs = {{0, 1}, {7, 2}, {3, 8}, {4, 19}, {5, 6}};
  const std::vector<Contact> expected = test::ask_cpu(scene, pairs).contacts;
  test::GraphStream stream;
  AskedContacts gpu(scene, pairs, Contents::all, stream.get());
  GpuContactOptions both = test::grouped_options();
  both.sorted = true;
  ASSERT_EQ(gpu.find(both, stream.get()), Status::kOk);
  const Groups in_order(gpu);
  EXPECT_EQ(test::sorted(in_order.contacts), expected);
  check_ranges(in_order);
  EXPECT_TRUE(std::ranges::is_sorted(in_order.contacts, {}, test::order_of));
  stream.capture([&] { return gpu.enqueue(stream.get(), test::grouped_options()); });
  for (int run = 0; run < 3; ++run) {
    ASSERT_EQ(gpu.find({}, stream.get()), Status::kOk);
    EXPECT_EQ(gpu.contacts(), expected);
    stream.launch();
    const Groups again(gpu);
    EXPECT_EQ(test::sorted(again.contacts), expected);
    EXPECT_EQ(again.first_contact, in_order.first_contact);
    check_ranges(again);
  }
}

TEST_F(GpuGrouped, WhatDoesNotFitOrFailsIsToldAsEver) {
  BodyScene scene = test::pile(10, 500, 1, 23);
  const std::vector<ObjectPair> pairs = {{0, 1}, {2, 3}, {4, 5}, {6, 7}};
  AskedContacts gpu(scene, pairs);
  test::expect_what_fits(gpu, test::grouped_options());
  const Groups some(gpu);
  EXPECT_EQ(some.counts.contacts, 50u);
  check_ranges(some);
  scene.instances[3].pose.rotation[0][0] += 1;
  test::expect_not_rigid(gpu, scene, pairs, test::grouped_options());
  const Groups none(gpu);
  EXPECT_EQ(none.counts.contacts, 0u);
  EXPECT_EQ(none.first_contact, std::vector<std::uint32_t>(5, 0));
  check_ranges(none);
}

TEST_F(GpuGrouped, PairsThatDoNotFitHaveNoRange) {
  const BodyScene scene = test::pile(10, 500, 1, 47);
  AskedContacts gpu(scene, {{0, 1}, {2, 3}, {4, 5}, {6, 7}});
  ASSERT_EQ(gpu.query.reserve({3, 10'000, 10'000}, test::grouped_options()), Status::kOk);
  gpu.run(test::grouped_options());
  EXPECT_EQ(gpu.report().complete, 0u);
  const Groups groups(gpu);
  EXPECT_EQ(groups.counts.pairs, 3u);
  check_ranges(groups);
}

}  // namespace
}  // namespace tandem
