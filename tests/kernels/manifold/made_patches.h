#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <vector>

#include "kernels/manifold/pair_patches.h"
#include "kernels/manifold/shape.h"
#include "tandem/kernels/contact_query.h"

namespace tandem::test {

using manifold::Patch;

struct PatchesOfPair {
  std::vector<Patch> patches;
  std::uint64_t segments, ambiguous_touches;
};

inline PatchesOfPair sorted(PatchesOfPair of) {
  std::ranges::sort(of.patches, {}, &Patch::key);
  return of;
}

template <typename Team>
PatchesOfPair patches_of(const Team& team, const manifold::BodyPair& bodies,
                         std::span<const Contact> contacts) {
  PairPatches made;
  EXPECT_TRUE(made.add(team, bodies, contacts.data(), static_cast<std::uint32_t>(contacts.size()),
                       {static_cast<int>(kMostManifoldPoints), false}));
  const Patch* const first = made.patches.data();
  return sorted({{first, first + made.patches.size()}, made.segments, made.ambiguous_touches});
}

inline void expect_same(const PatchesOfPair& x, const PatchesOfPair& y) {
  EXPECT_EQ(x.segments, y.segments);
  EXPECT_EQ(x.ambiguous_touches, y.ambiguous_touches);
  ASSERT_EQ(x.patches.size(), y.patches.size());
  for (std::size_t i = 0; i < x.patches.size(); ++i) {
    const Patch &p = x.patches[i], &q = y.patches[i];
    EXPECT_EQ(p.key, q.key);
    EXPECT_EQ(std::memcmp(&p.manifold, &q.manifold, sizeof(Manifold)), 0);
    EXPECT_EQ(std::memcmp(p.point, q.point, p.manifold.point_count * sizeof(ManifoldPoint)), 0);
  }
}

/// Calls of(bodies, contacts) for each pair of bodies that has contacts.
template <typename Of>
void for_each_pair(std::span<const AssetView> views, std::span<const Instance> posed,
                   const ContactQuery& query, const Of& of) {
  std::vector<manifold::Shape> shapes;
  for (const AssetView& view : views)
    shapes.push_back(
        manifold::shape_of(view.level(), view.header->lower, view.header->upper, view.header->origin));
  const std::span<const Contact> contacts = query.rows();
  for (std::size_t first = 0, end = 0; first < contacts.size(); first = end) {
    while (end < contacts.size() && contacts[end].pair == contacts[first].pair) ++end;
    const ObjectPair pair = query.pairs()[contacts[first].pair];
    const Instance &a = posed[pair.a], &b = posed[pair.b];
    of(manifold::BodyPair{{shapes[a.asset], a.pose}, {shapes[b.asset], b.pose}},
       contacts.subspan(first, end - first));
  }
}

}  // namespace tandem::test
