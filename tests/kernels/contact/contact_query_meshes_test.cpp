// Every mesh of a folder, posed so that it just touches itself and another, against a sweep over the boxes of
// posed triangles. The folder is named by the environment variable TANDEM_MESHES; without it, it is looked
// for beside the source tree.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "bvhbuild/import/import.h"
#include "bvhbuild/meshing/meshing.h"
#include "kernels/asked.h"
#include "kernels/query_scenes.h"

namespace tandem {
namespace {

namespace fs = std::filesystem;
using test::BodyScene;
using test::centred_at;
using test::FaceContacts;
using test::found_contacts;
using test::Mesh;
using test::PosedTriangle;
using test::radius_of;
using test::RandomPoses;

fs::path mesh_folder() {
  if (const char* named = std::getenv("TANDEM_MESHES")) return named;
  return fs::path(TANDEM_SOURCE_DIR) / ".." / "shared" / "meshes";
}

/// Continuous integration has time for meshes of so many triangles.
std::size_t most_triangles() {
  return std::getenv("TANDEM_LONG") != nullptr ? 1'000'000 : 20'000;
}

struct MeshFile {
  const char* name;
};
void PrintTo(const MeshFile& file, std::ostream* out) {
  *out << file.name;
}

constexpr MeshFile kFiles[] = {{"spot.obj"},
                               {"cow.obj"},
                               {"teapot.obj"},
                               {"bun_zipper.ply"},
                               {"armadillo.obj"},
                               {"koala.obj"},
                               {"featuretype.STL"},
                               {"cycloidal.ply"},
                               {"scallop.glb"},
                               {"link5.stl"},
                               {"forearm.stl"},
                               {"CesiumMilkTruck.glb"},
                               {"CubeHierarchy.gltf"},
                               {"spheres_scaled_instances.gltf"},
                               {"ballA.off"},
                               {"ballB.off"},
                               {"self_intersectA.obj"},
                               {"self_intersectB.obj"},
                               {"Star_ascii.stl"},
                               {"Spider_ascii.stl"},
                               {"triple_vierbein.obj"},
                               {"moebius.obj"},
                               {"dodecahedron_poly.obj"},
                               {"busted.STL"},
                               {"negative_indices.obj"},
                               {"cubevt.obj"},
                               {"test-nan.obj"},
                               {"issue-295-trianguation-failure.obj"},
                               {"malformed.obj"},
                               {"IndexOutOfRange.gltf"},
                               {"cube_binary_starts_with_nl.ply"},
                               {"elephant.ply"},
                               {"w_degtri_four.off"},
                               {"w_duplicates.obj"},
                               {"w_degenerate.obj"},
                               {"w_huge_coords.stl"},
                               {"w_nan.ply"},
                               {"w_index_oob.ply"},
                               {"w_index_oob.off"}};

struct Imported {
  Mesh mesh;
  std::array<double, 3> origin{};
};

Imported import(const char* name) {
  build::ImportOptions options;
  options.reader = build::Reader::tandem;  // in this process: none is forked where threads may be
  build::ImportResult imported = build::import_mesh(mesh_folder() / name, options);
  EXPECT_TRUE(imported.ok) << imported.error;
  build::CleanReport report;
  build::TriangleMesh mesh = build::triangulate(imported.mesh, report);
  build::clean(mesh, report);
  const build::StoredMesh stored = build::to_single_precision(mesh, report);
  Imported out;
  out.mesh.points = stored.points;
  for (const auto& triangle : stored.triangles)
    out.mesh.triangles.push_back({triangle[0], triangle[1], triangle[2]});
  std::copy_n(&stored.origin[0], 3, out.origin.begin());
  return out;
}

/// The box of a posed triangle.
struct Swept {
  double lo[3], hi[3];
  std::uint32_t face;
};

std::vector<Swept> boxes_of(const std::vector<PosedTriangle>& triangles) {
  std::vector<Swept> out;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    Swept& box = out.emplace_back();
    box.face = t;
    for (std::size_t k = 0; k < 3; ++k) {
      box.lo[k] = std::min({triangles[t][0][k], triangles[t][1][k], triangles[t][2][k]});
      box.hi[k] = std::max({triangles[t][0][k], triangles[t][1][k], triangles[t][2][k]});
    }
  }
  return out;
}

bool boxes_meet(const Swept& a, const Swept& b) {
  bool meet = true;
  for (int k = 0; k < 3; ++k) meet = meet && a.lo[k] <= b.hi[k] && b.lo[k] <= a.hi[k];
  return meet;
}

void leave_out_what_misses(std::vector<Swept>& boxes, const std::vector<Swept>& others) {
  Swept all = others[0];
  for (const Swept& box : others) {
    for (int k = 0; k < 3; ++k) {
      all.lo[k] = std::min(all.lo[k], box.lo[k]);
      all.hi[k] = std::max(all.hi[k], box.hi[k]);
    }
  }
  std::erase_if(boxes, [&](const Swept& box) { return !boxes_meet(box, all); });
}

/// Every two of the triangles whose boxes meet, decided exactly: sorted along x, no tree, no float32.
FaceContacts sweep(const BodyScene& scene, std::uint32_t a, std::uint32_t b) {
  const auto of_a = posed_triangles(scene, a), of_b = posed_triangles(scene, b);
  std::vector<Swept> boxes_a = boxes_of(of_a), boxes_b = boxes_of(of_b);
  const std::vector<Swept> all_b = boxes_b;
  leave_out_what_misses(boxes_b, boxes_a);
  leave_out_what_misses(boxes_a, all_b);
  const auto by_x = [](const Swept& p, const Swept& q) { return p.lo[0] < q.lo[0]; };
  std::sort(boxes_a.begin(), boxes_a.end(), by_x);
  std::sort(boxes_b.begin(), boxes_b.end(), by_x);
  FaceContacts out;
  const auto decide_pair = [&](const Swept& p, const Swept& q) {
    if ((a == b && p.face >= q.face) || !boxes_meet(p, q)) return;
    if (decide_exact(test::pair_of(of_a[p.face], of_b[q.face])) == Verdict::contact)
      out.push_back({a, b, p.face, q.face});
  };
  std::size_t i = 0, j = 0;
  while (i < boxes_a.size() && j < boxes_b.size()) {
    if (boxes_a[i].lo[0] <= boxes_b[j].lo[0]) {
      for (std::size_t k = j; k < boxes_b.size() && boxes_b[k].lo[0] <= boxes_a[i].hi[0]; ++k)
        decide_pair(boxes_a[i], boxes_b[k]);
      ++i;
    } else {
      for (std::size_t k = i; k < boxes_a.size() && boxes_a[k].lo[0] <= boxes_b[j].hi[0]; ++k)
        decide_pair(boxes_a[k], boxes_b[j]);
      ++j;
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

/// gtest_discover_tests runs the tests one by one, so a file that is missing skips its own test alone.
class QueryOfSharedMesh : public ::testing::TestWithParam<MeshFile> {
 protected:
  void SetUp() override {
    for (const char* name : {GetParam().name, kOther}) {
      if (!fs::exists(mesh_folder() / name)) GTEST_SKIP() << name << " is not here (set TANDEM_MESHES)";
    }
    const Imported mesh = import(GetParam().name);
    ASSERT_FALSE(mesh.mesh.triangles.empty());
    if (mesh.mesh.triangles.size() > most_triangles()) GTEST_SKIP() << "is large (set TANDEM_LONG)";
    scene_.assets.add(mesh.mesh, mesh.origin);
    // The other, at the size of this one.
    Imported other = import(kOther);
    test::SampleAssets unscaled;
    unscaled.add(other.mesh);
    radius_ = radius_of(scene_.assets.views()[0]);
    test::scale(other.mesh, radius_ / radius_of(unscaled.views()[0]));
    scene_.assets.add(other.mesh);
    ASSERT_EQ(query_.set_assets(scene_.assets.views()), Status::kOk);
  }

  bool touch() {
    ContactOptions options;
    options.first_contact_only = true;
    EXPECT_EQ(query_.find(scene_.instances, options), Status::kOk);
    return !query_.rows().empty();
  }

  /// Instance 1 on its way to instance 0 along a direction.
  void stand_at(double distance, const Pose& rotation, const double (&direction)[3]) {
    const double place[3] = {distance * direction[0], distance * direction[1], distance * direction[2]};
    Instance& instance = scene_.instances[1];
    instance.pose = centred_at(scene_.assets.views()[instance.asset], rotation, place);
  }

  static constexpr const char* kOther = "link5.stl";
  BodyScene scene_;
  double radius_ = 0;
  test::Asked<ContactQuery> query_;
};

TEST_P(QueryOfSharedMesh, FindsTheContactsOfNearPosesThatASweepFinds) {
  RandomPoses random(21);
  std::size_t contacts = 0;
  for (int i = 0; i < test::trials(4, 5); ++i) {
    const double origin[3] = {0, 0, 0};
    const Pose turned = any_rotation(random), rotation = any_rotation(random);
    scene_.instances = {{0, centred_at(scene_.assets.views()[0], turned, origin)},
                        {static_cast<std::uint32_t>(i % 2), kIdentityPose}};
    double direction[3], length = 0;
    for (double& x : direction) length = std::hypot(length, x = random.symmetric(1));
    for (double& x : direction) x /= length;
    double touching = 0, apart = 2.1 * radius_;
    stand_at(apart, rotation, direction);
    ASSERT_FALSE(touch());
    for (int step = 0; step < 40; ++step) {
      const double middle = 0.5 * (touching + apart);
      stand_at(middle, rotation, direction);
      (touch() ? touching : apart) = middle;
    }
    for (const double depth : {0.0, 1e-12, 0.01, 0.03}) {
      stand_at(touching - depth * radius_, rotation, direction);
      ASSERT_EQ(query_.find(scene_.instances), Status::kOk);
      ASSERT_EQ(found_contacts(query_), sweep(scene_, 0, 1)) << "pose " << i << ", depth " << depth;
      contacts += query_.rows().size();
    }
  }
  EXPECT_GT(contacts, 0u);
}

TEST_P(QueryOfSharedMesh, FindsTheContactsWithinThatASweepFinds) {
  RandomPoses random(22);
  const double origin[3] = {0, 0, 0};
  scene_.instances = {{0, centred_at(scene_.assets.views()[0], any_rotation(random), origin)}};
  ContactOptions options;
  options.self_pairs = true;
  ASSERT_EQ(query_.find(scene_.instances, options), Status::kOk);
  EXPECT_EQ(found_contacts(query_), sweep(scene_, 0, 0));
}

/// Coincident: hard cases throughout.
TEST_P(QueryOfSharedMesh, FindsTheContactsWithItsCopyThatASweepFinds) {
  RandomPoses random(23);
  const double origin[3] = {0, 0, 0};
  const Pose pose = centred_at(scene_.assets.views()[0], any_rotation(random), origin);
  scene_.instances = {{0, pose}, {0, pose}};
  ASSERT_EQ(query_.find(scene_.instances), Status::kOk);
  EXPECT_EQ(found_contacts(query_), sweep(scene_, 0, 1));
  EXPECT_GE(query_.rows().size(), scene_.assets.mesh(0).triangles.size());
}

INSTANTIATE_TEST_SUITE_P(All, QueryOfSharedMesh, testing::ValuesIn(kFiles), [](const auto& test) {
  std::string name = test.param.name;
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return name;
});

}  // namespace
}  // namespace tandem
