// The readers on real files: the collection of public meshes, where it is at hand, and what each fixed bug
// left behind.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "bvhbuild/import/readers.h"
#include "reader_test.h"

namespace tandem::build {
namespace {

namespace fs = std::filesystem;

fs::path collection() {
  const char* const named = std::getenv("TANDEM_MESHES");
  return named ? fs::path(named) : fs::path(TANDEM_SOURCE_DIR) / "../shared/meshes";
}

Read reader_of(const fs::path& file) {
  std::string ending = file.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (ending == ".obj") return read_obj;
  if (ending == ".ply") return read_ply;
  if (ending == ".stl") return read_stl;
  return ending == ".off" ? read_off : nullptr;
}

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

struct Expected {
  const char* file;
  std::size_t triangles;  // when each face of n corners is cut into n - 2
  std::size_t points;
};

// Prints what a test calls its parameter.
void PrintTo(const Expected& expected, std::ostream* stream) {
  *stream << expected.file;
}

class CollectedMesh : public testing::TestWithParam<Expected> {};

TEST_P(CollectedMesh, HasItsTriangles) {
  const fs::path file = collection() / GetParam().file;
  if (!fs::exists(file)) GTEST_SKIP() << file << " is not there; set TANDEM_MESHES to the folder of meshes";
  const ReadResult result = read_from(reader_of(file), bytes_of(file));
  ASSERT_TRUE(result.ok) << result.error;
  const PolygonMesh& mesh = result.mesh;
  EXPECT_EQ(mesh.corners.size() - 2 * mesh.face_count(), GetParam().triangles);
  EXPECT_EQ(mesh.points.size(), GetParam().points);
}

INSTANTIATE_TEST_SUITE_P(
    Reader, CollectedMesh,
    testing::Values(Expected{"cow.obj", 5804, 2903}, Expected{"koala.obj", 99994, 49999},
                    Expected{"cubevt.obj", 12, 24}, Expected{"negative_indices.obj", 12, 8},
                    Expected{"test-nan.obj", 36, 76}, Expected{"test_lines.obj", 0, 484},
                    Expected{"dodecahedron_poly.obj", 36, 20}, Expected{"bun_zipper.ply", 69451, 35947},
                    Expected{"cycloidal.ply", 43368, 21384}, Expected{"elephant.ply", 39290, 19753},
                    Expected{"cube_binary_starts_with_nl.ply", 12, 8}, Expected{"ply_points_bin.ply", 0, 8},
                    Expected{"featuretype.STL", 3476, 10428}, Expected{"Spider_ascii.stl", 1368, 4104},
                    Expected{"stl_empty_bin.stl", 0, 0}, Expected{"ballA.off", 3796, 1900},
                    Expected{"w_index_oob.off", 4, 4}),
    [](const auto& given) {
      std::string name = given.param.file;
      for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
      return name;
    });

TEST(CollectedMeshes, NoneBreaksAPromise) {
  if (!fs::is_directory(collection())) GTEST_SKIP() << collection() << " is not there; set TANDEM_MESHES";
  for (const fs::directory_entry& entry : fs::directory_iterator(collection())) {
    const Read read = reader_of(entry.path());
    if (!read) continue;
    SCOPED_TRACE(entry.path());
    read_from(read, bytes_of(entry.path()));
  }
}

TEST(CollectedMeshes, BrokenOnesAreRefusedWithTheirDefect) {
  if (!fs::is_directory(collection())) GTEST_SKIP() << collection() << " is not there; set TANDEM_MESHES";
  const auto error_of = [](const char* name) {
    const fs::path file = collection() / name;
    return read_from(reader_of(file), bytes_of(file)).error;
  };
  EXPECT_EQ(error_of("empty.obj"), "the file is empty");
  EXPECT_EQ(error_of("w_count_lies.stl"),
            "the header promises 4294967295 triangles (200 GiB), the file holds 12");
  EXPECT_EQ(error_of("w_truncated.stl"), "the header promises 300 triangles (15 KiB), the file holds 179");
  EXPECT_EQ(error_of("w_truncated.ply"), "the header promises 1000 faces, the data ends after 519");
  EXPECT_EQ(error_of("w_ply_header_cut.ply"),
            "the header has no 'end_header' line: the file was cut in its header");
}

ReadResult read_data(const char* name) {
  const fs::path file = fs::path(TANDEM_SOURCE_DIR) / "tests/data" / name;
  return read_from(reader_of(file), bytes_of(file));
}

TEST(FixedBugs, AFaceElementWithoutFacesNeedsNoIndices) {
  const ReadResult result = read_data("no_faces_no_indices.ply");
  EXPECT_TRUE(result.ok) << result.error;
  EXPECT_EQ(result.mesh.points.size(), 1u);
}

TEST(FixedBugs, AnErrorNamesAnElementInCleanText) {
  EXPECT_EQ(read_data("negative_list_odd_name.ply").error, "K\uFFFDhe 0 has a list of length -1");
}

}  // namespace
}  // namespace tandem::build
