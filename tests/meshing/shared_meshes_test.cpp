// Every file of a folder of meshes, good and bad, from import to the triangles that are stored. The folder is
// named by the environment variable TANDEM_MESHES; without it, it is looked for beside the source tree.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

#include "bvhbuild/import/import.h"
#include "bvhbuild/meshing/meshing.h"

namespace tandem::build {
namespace {

namespace fs = std::filesystem;

fs::path mesh_folder() {
  if (const char* named = std::getenv("TANDEM_MESHES")) return named;
  return fs::path(TANDEM_SOURCE_DIR) / ".." / "shared" / "meshes";
}

/// A row of shared_meshes.csv.
struct Expected {
  std::string file;
  int triangles;                                       ///< that are stored; -1 when the file cannot be read
  std::map<std::string, std::uint64_t> findings = {};  ///< counts that the report must show
};

void PrintTo(const Expected& expected, std::ostream* out) {
  *out << expected.file;
}

std::vector<Expected> expected_meshes() {
  std::vector<Expected> rows;
  std::ifstream table(TANDEM_SOURCE_DIR "/tests/meshing/shared_meshes.csv");
  std::string line, triangles, message, finding;
  for (std::getline(table, line); std::getline(table, line);) {
    std::istringstream cells(line);
    Expected& row = rows.emplace_back();
    std::getline(cells, row.file, ',');
    std::getline(cells, triangles, ',');
    std::getline(cells, message, ',');
    row.triangles = std::stoi(triangles);
    std::getline(cells, line, ',');
    for (std::istringstream findings(line); std::getline(findings, finding, ';');)
      row.findings[finding.substr(0, finding.find('='))] = std::stoull(finding.substr(finding.find('=') + 1));
  }
  return rows;
}

std::uint64_t count_of(const CleanReport& report, const std::string& key) {
  for (const Finding& finding : findings(report))
    if (finding.key == key) return finding.count;
  ADD_FAILURE() << "no finding is called " << key;
  return 0;
}

struct Walked {
  ImportResult imported;
  CleanReport report;
  StoredMesh stored;
};

Walked walk(const fs::path& path, const ImportOptions& options = {}) {
  Walked walked;
  walked.imported = import_mesh(path, options);
  TriangleMesh mesh = triangulate(walked.imported.mesh, walked.report);
  clean(mesh, walked.report);
  walked.stored = to_single_precision(mesh, walked.report);
  return walked;
}

/// gtest_discover_tests runs the tests one by one, so a file that is missing skips its own test alone.
class SharedMesh : public ::testing::TestWithParam<Expected> {
 protected:
  void SetUp() override {
    path_ = mesh_folder() / GetParam().file;
    if (!fs::exists(path_)) GTEST_SKIP() << path_ << " is not here (set TANDEM_MESHES)";
  }
  fs::path path_;
};

TEST_P(SharedMesh, GivesTheTrianglesThatItHolds) {
  const Expected& expected = GetParam();
  const Walked walked = walk(path_);
  EXPECT_EQ(walked.imported.ok, expected.triangles >= 0) << walked.imported.error;
  if (!walked.imported.ok) {
    EXPECT_FALSE(walked.imported.error.empty());
    return;
  }
  EXPECT_EQ(walked.stored.triangles.size(), static_cast<std::size_t>(expected.triangles));
  EXPECT_EQ(walked.stored.face.size(), walked.stored.triangles.size());
  for (const auto& [key, count] : expected.findings) EXPECT_EQ(count_of(walked.report, key), count) << key;
}

/// Whatever assimp does with it, this process survives, in little time, with a mesh or a reason.
TEST_P(SharedMesh, EndsWellWithAssimpToo) {
  ImportOptions options;
  options.reader = Reader::assimp;
  options.time_limit_seconds = 2;
  const Walked walked = walk(path_, options);
  EXPECT_NE(walked.imported.ok, !walked.imported.error.empty());
  for (const TriangleIndices& t : walked.stored.triangles)
    for (const std::uint32_t corner : t) ASSERT_LT(corner, walked.stored.points.size());
}

INSTANTIATE_TEST_SUITE_P(Files, SharedMesh, ::testing::ValuesIn(expected_meshes()), [](const auto& test) {
  std::string name = test.param.file;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
});

struct Box {
  Point low{1e300, 1e300, 1e300};
  Point high{-1e300, -1e300, -1e300};
};

Box box_of_part(const PolygonMesh& mesh, const SourcePart& part) {
  Box box;
  for (std::uint32_t c = mesh.face_begin[part.first_face];
       c < mesh.face_begin[part.first_face + part.face_count]; ++c)
    for (int k = 0; k < 3; ++k) {
      box.low[k] = std::min(box.low[k], mesh.points[mesh.corners[c]][k]);
      box.high[k] = std::max(box.high[k], mesh.points[mesh.corners[c]][k]);
    }
  return box;
}

/// The boxes follow from the matrices of the file: unit cubes, turned about x by each node and moved along x
/// or y.
TEST(SharedMeshes, CubeHierarchyStandsWhereItsNodesSay) {
  const fs::path path = mesh_folder() / "CubeHierarchy.gltf";
  if (!fs::exists(path)) GTEST_SKIP() << path << " is not here (set TANDEM_MESHES)";
  const ImportResult result = import_mesh(path, {});
  ASSERT_TRUE(result.ok) << result.error;
  ASSERT_EQ(result.mesh.parts.size(), 4u);
  const Box expected[] = {{{1.5, -0.5, -0.5}, {2.5, 0.5, 0.5}},
                          {{-0.5, -0.5, -2.5}, {0.5, 0.5, -1.5}},
                          {{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}},
                          {{-0.5, 1.5, -0.5}, {0.5, 2.5, 0.5}}};
  for (int i = 0; i < 4; ++i) {
    const Box box = box_of_part(result.mesh, result.mesh.parts[i]);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(box.low[k], expected[i].low[k], 1e-6) << i << " " << k;
      EXPECT_NEAR(box.high[k], expected[i].high[k], 1e-6) << i << " " << k;
    }
  }
}

}  // namespace
}  // namespace tandem::build
