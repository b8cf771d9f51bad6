#include <bit>
#include <cmath>
#include <string>

#include "bvhbuild/import/readers.h"
#include "reader_test.h"

namespace tandem::build {
namespace {

ReadResult read(const std::string& file) {
  return read_from(read_stl, file);
}

void append(std::string& file, float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  for (int shift = 0; shift < 32; shift += 8) file += static_cast<char>(bits >> shift);
}

// A binary file whose header begins with `title`, promises `promised` triangles and holds `held`, the i-th at
// x = i.
std::string binary(const std::string& title, std::uint32_t promised, int held) {
  std::string file = title;
  file.resize(80, ' ');
  append(file, std::bit_cast<float>(promised));
  for (int i = 0; i < held; ++i) {
    const float x = static_cast<float>(i);
    for (const float value : {NAN, 0.f, 1.f, x, 0.f, 0.f, x, 1.f, 0.f, x, 0.f, 0.1f}) append(file, value);
    file += "ab";
  }
  return file;
}

std::string facet(const std::string& vertices) {
  return " facet normal 0 0 1\n  outer loop\n" + vertices + "  endloop\n endfacet\n";
}
const std::string kCorners = "   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1e-1 0\n";

TEST(StlReader, ReadsFacesAndRemarksWhatIsOdd) {
  expect_faces(read_stl, {{"binary facets", binary("made by hand", 2, 2), {{0, 1, 2}, {3, 4, 5}}},
                          {"bytes after the last triangle",
                           binary("x", 1, 1) + "more",
                           {{0, 1, 2}},
                           {"4 bytes after the last triangle are passed over"}},
                          {"facets of more or fewer vertices",
                           "solid\n" + facet(kCorners + "vertex 0 0 1\n") +
                               facet("vertex 0 0 0\nvertex 1 1 1\n") + facet(kCorners) + "endsolid\n",
                           {{0, 1, 2, 3}, {4, 5}, {6, 7, 8}}},
                          {"no triangles", binary("x", 0, 0), {}},
                          {"a solid of nothing", "solid x\nendsolid x\n", {}}});
  EXPECT_EQ(read(binary("made by hand", 2, 2)).mesh.points[5], (Point{1, 0, 0.1f}));
}

TEST(StlReader, SizeDecidesBeforeTheWordSolid) {
  EXPECT_EQ(read(binary("solid facet", 2, 2)).mesh.face_count(), 2u);
  EXPECT_EQ(read(binary("solid\nfacet normal 0 0 0", 1, 1) + "x").mesh.face_count(), 1u);
}

TEST(StlReader, ReadsTextInAnyCaseAndLayout) {
  const ReadResult result = read(
      "SOLID a\rFacet NORMAL 0 0 1 Outer LOOP Vertex 0 0 .1 VERTEX\r\n1 0 0\n\tvertex 0 1 0 EndLoop "
      "endfacet\nEndSolid");
  ASSERT_TRUE(result.ok) << result.error;
  EXPECT_EQ(faces_of(result.mesh), (std::vector<Face>{{0, 1, 2}}));
  EXPECT_EQ(result.mesh.points[0], (Point{0, 0, 0.1}));
}

TEST(StlReader, NormalsMayBeAnything) {
  const std::string loop = " outer loop\n" + kCorners + "endloop endfacet\n";
  for (const char* normal : {"facet normal nan nan nan", "facet normal -1.#IND 0 0", "facet normal", "facet",
                             "facet normal a b c"})
    EXPECT_EQ(read("solid\n" + std::string(normal) + loop + "endsolid\n").mesh.face_count(), 1u) << normal;
}

TEST(StlReader, SolidsBecomeParts) {
  const ReadResult result = read("solid left horn \n" + facet(kCorners) +
                                 "endsolid left horn\nsolid none\nendsolid none\n\nsolid\n" +
                                 facet(kCorners) + facet(kCorners) + "endsolid\n");
  ASSERT_TRUE(result.ok) << result.error;
  ASSERT_EQ(result.mesh.parts.size(), 2u);
  EXPECT_EQ(result.mesh.parts[0].name, "left horn");
  EXPECT_EQ(result.mesh.parts[1].name, "");
  EXPECT_EQ(result.mesh.parts[1].first_face, 1u);
  EXPECT_EQ(result.mesh.parts[1].face_count, 2u);
}

TEST(StlReader, PassesOverComments) {
  const ReadResult result = read("# by hand\nsolid a\n; one\n" + facet(kCorners) + "// two\n" +
                                 facet("# three\n" + kCorners) + "endsolid a # end\n");
  ASSERT_TRUE(result.ok) << result.error;
  EXPECT_EQ(result.mesh.face_count(), 2u);
}

TEST(StlReader, ReadsCoordinatesThatAreNotFinite) {
  const ReadResult result =
      read("solid\n" + facet("vertex nan inf -1e400\nvertex 1 0 0\nvertex 0 1 0\n") + "endsolid\n");
  ASSERT_TRUE(result.ok) << result.error;
  EXPECT_TRUE(std::isnan(result.mesh.points[0][0]));
  EXPECT_EQ(result.mesh.points[0][2], -INFINITY);
}

TEST(StlReader, NamesTheLineOfEachDefectAndRefusesWhatIsNoStlFile) {
  expect_errors(
      read_stl,
      {
          {"solid a\nfacit\n", "line 2: 'facit' where 'facet' or 'endsolid' is expected"},
          {"solid a\n" + facet("vertex 0 0\n" + kCorners) + "endsolid",
           "line 5: 'vertex' where a coordinate is expected"},
          {"solid a\n" + facet(kCorners), "line 8: the file ends where 'facet' or 'endsolid' is expected"},
          {"solid a\nendsolid a\nmore\n", "line 3: 'more' where 'solid' is expected"},
          {"solid a\nfacet normal 0 0 0\nloop\n", "line 3: 'loop' where 'outer' is expected"},
          {"", "the file is empty"},
          {"v 0 0 0\n",
           "neither a text STL, which begins with 'solid', nor a binary one, which has at least 84 bytes: "
           "this has 8"},
          {binary("x", 4294967295u, 12),
           "the header promises 4294967295 triangles (200 GiB), the file holds 12"},
          {binary("solid x", 3, 2), "the header promises 3 triangles (150 bytes), the file holds 2"},
      });
}

const std::string kText =
    "solid a b\n" + facet(kCorners) + "# c\n" + facet(kCorners + "vertex 1 1 1\n") + "endsolid a b\n";

TEST(StlReader, SurvivesEveryCutOfText) {
  expect_cuts_are_harmless(read_stl, kText, 2);
}
TEST(StlReader, SurvivesEveryChangedByteOfText) {
  expect_changed_bytes_are_harmless(read_stl, kText);
}
TEST(StlReader, SurvivesEveryCutOfABinaryFile) {
  expect_cuts_are_harmless(read_stl, binary("x", 3, 3), 3);
  expect_cuts_are_harmless(read_stl, binary("solid x", 3, 3), 3);
}
TEST(StlReader, SurvivesEveryChangedByteOfABinaryFile) {
  expect_changed_bytes_are_harmless(read_stl, binary("solid x", 3, 3));
}

TEST(StlReader, ACutTextIsAnError) {
  // Behind "endsolid", the rest of the line is the solid's name once more.
  const std::size_t whole = kText.find("endsolid") + std::string("endsolid").size();
  for (std::size_t size = 0; size < whole; ++size)
    EXPECT_FALSE(read(kText.substr(0, size)).ok) << "cut at byte " << size;
}

}  // namespace
}  // namespace tandem::build
