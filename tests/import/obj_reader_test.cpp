#include <cmath>
#include <string>

#include "bvhbuild/import/readers.h"
#include "reader_test.h"

namespace tandem::build {
namespace {

using namespace std::string_literals;

const std::string kFourVertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";

ReadResult read(const std::string& file) {
  return read_from(read_obj, file);
}

void expect_faces(const std::string& file, const std::vector<Face>& faces) {
  const ReadResult result = read(file);
  EXPECT_TRUE(result.ok) << result.error;
  EXPECT_EQ(faces_of(result), faces) << file;
}

TEST(ObjReader, KeepsCoordinatesInDoublePrecision) {
  const ReadResult result = read("v 0.1 -12345678.9 1e-300\n");
  ASSERT_EQ(result.mesh.points.size(), 1u);
  EXPECT_EQ(result.mesh.points[0], (Point{0.1, -12345678.9, 1e-300}));
  EXPECT_FALSE(result.mesh.single_precision);
}

TEST(ObjReader, PassesOverWeightsAndColoursOfVertices) {
  const ReadResult result = read("v 1 2 3 0.5\nv 4 5 6 1 0 0\nv 7 8 9 red\n");
  ASSERT_EQ(result.mesh.points.size(), 3u);
  EXPECT_EQ(result.mesh.points[2], (Point{7, 8, 9}));
}

TEST(ObjReader, TakesTheVertexOutOfEveryKindOfCorner) {
  expect_faces(
      kFourVertices + "f 1 2 3\nf 1/9 2/9 3/9\nf 1//9 2//9 3//9\nf 1/9/9 2/9/9 3/9/9\nf 1/ 2// 3/9/\n",
      {{0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {0, 1, 2}});
}

TEST(ObjReader, KeepsPolygonsWhole) {
  expect_faces(kFourVertices + "f 1 2 3 4\nf 4 3 2 1 4\n", {{0, 1, 2, 3}, {3, 2, 1, 0, 3}});
}

TEST(ObjReader, RelativeIndicesCountFromTheCurrentEnd) {
  expect_faces(kFourVertices + "f -4 -3 -2\nv 9 9 9\nf -1 -2 -5\n", {{0, 1, 2}, {4, 3, 0}});
}

TEST(ObjReader, FacesMayComeBeforeTheirVertices) {
  const ReadResult result = read("f 1 2 4\n" + kFourVertices);
  EXPECT_EQ(faces_of(result), (std::vector<Face>{{0, 1, 3}}));
  EXPECT_TRUE(result.mesh.remarks.empty());
}

TEST(ObjReader, RemarksIndicesThatNameNoVertexAndKeepsTheFace) {
  const ReadResult result = read(kFourVertices + "f 1 2 99\nf 0 1 2\nf -9 1 2\n");
  ASSERT_TRUE(result.ok);
  EXPECT_EQ(faces_of(result), (std::vector<Face>{{0, 1, 98}, {kNoVertex, 0, 1}, {kNoVertex, 0, 1}}));
  EXPECT_EQ(result.mesh.remarks,
            (std::vector<std::string>{"line 5: face index 99 of 4 vertices",
                                      "line 6: face index 0, but OBJ counts vertices from 1",
                                      "line 7: face index -9 counts back past the first vertex"}));
}

TEST(ObjReader, RemarksTheFirstIndexPastTheLastVertex) {
  EXPECT_EQ(read(kFourVertices + "f 1 2 4\nf 1 2 5\n").mesh.remarks,
            (std::vector<std::string>{"line 6: face index 5 of 4 vertices"}));
}

TEST(ObjReader, RemarksAnIndexThatNeverCameAmongThoseThatCameLater) {
  EXPECT_EQ(read("f 1 2 4\nf 1 99 2\nf 2 0 99\n" + kFourVertices).mesh.remarks,
            (std::vector<std::string>{"line 2: face index 99 of 4 vertices",
                                      "line 3: face index 0, but OBJ counts vertices from 1"}));
}

TEST(ObjReader, IndicesTooLargeForTheirTypeNameNoVertex) {
  expect_faces(kFourVertices + "f 1 2 4294967296\nf 1 2 4294967295\nf 1 2 99999999999999999999999\n",
               {{0, 1, kNoVertex}, {0, 1, kNoVertex - 1}, {0, 1, kNoVertex}});
}

TEST(ObjReader, RemarksAtMostFourIndices) {
  std::string file = kFourVertices;
  for (int i = 0; i < 100; ++i) file += "f 1 2 99\n";
  EXPECT_EQ(read(file).mesh.remarks.size(), 4u);
}

TEST(ObjReader, CountsFacesOfAnyNumberOfCornersButNoPointsAndLines) {
  const ReadResult result = read(kFourVertices + "p 1\nl 1 2 3\nf 1 2\nf 1\nf\nf 99 2\nf 2 3 4\n");
  EXPECT_EQ(faces_of(result), (std::vector<Face>{{0, 1}, {0}, {}, {98, 1}, {1, 2, 3}}));
  EXPECT_EQ(result.mesh.remarks.size(), 1u);
}

TEST(ObjReader, ReadsAllLineEnds) {
  for (const std::string end : {"\n", "\r\n", "\r"})
    expect_faces("v 0 0 0" + end + "v 1 0 0" + end + "v 0 1 0" + end + end + "f 1 2 3", {{0, 1, 2}});
}

TEST(ObjReader, ReadsTabsBlanksCommentsAndAByteOrderMark) {
  expect_faces(
      "\xEF\xBB\xBFv 0 0 0\n\t v\t1  0 0 \t\n  # v 5 5 5\nv 0 1 0# near\nv 0 0 1 # far\n f 1 2 4 # c 3\nf 1 "
      "2 3#\n",
      {{0, 1, 3}, {0, 1, 2}});
}

TEST(ObjReader, GoesOnBehindABackslash) {
  expect_faces("v 0 0 \\\n0\nv 1 \\ \r\n 0 0\nv 0 1 0 \\\n1 1 1\nf 1 2\\\n \\\n3\n", {{0, 1, 2}});
}

TEST(ObjReader, ABackslashAtTheEndOfACommentHidesNothing) {
  expect_faces("# C:\\meshes\\\nv 0 0 0\nv 1 0 0\no a\\\nv 0 1 0\nf 1 2 3 # \\\nf 3 2 1\n",
               {{0, 1, 2}, {2, 1, 0}});
}

TEST(ObjReader, ABackslashAtTheEndOfTheFileEndsTheFace) {
  expect_faces(kFourVertices + "f 1 2 3 \\", {{0, 1, 2}});
}

TEST(ObjReader, PassesOverUnknownStatements) {
  expect_faces(
      "mtllib a.mtl\nvn 0 0 1\nvt 0 0\nvp 1 2\ns off\nusemtl x\nweird 1 2\n" + kFourVertices + "f 1 2 3\n",
      {{0, 1, 2}});
}

TEST(ObjReader, MaterialsDoNotReorderFaces) {
  expect_faces(kFourVertices + "usemtl a\nf 1 2 3\nusemtl b\nf 2 3 4\nusemtl a\nf 1 3 4\n",
               {{0, 1, 2}, {1, 2, 3}, {0, 2, 3}});
}

TEST(ObjReader, ObjectsAndGroupsBecomeParts) {
  const ReadResult result =
      read(kFourVertices +
           "f 1 2 3\no body\nf 1 2 3\nf 1 2 3\ng horn\nf 1 2 3\ng horn\nf 2 3 4\no tail\ng\n"
           "f 1 2 4\no nothing\no tail\nf 1 2 4\n");
  ASSERT_EQ(result.mesh.parts.size(), 4u);
  const auto expect_part = [&](std::size_t i, const char* name, const char* path, std::uint64_t first,
                               std::uint64_t count) {
    const SourcePart& part = result.mesh.parts[i];
    EXPECT_EQ(part.name, name);
    EXPECT_EQ(part.node_path, path);
    EXPECT_EQ(part.first_face, first);
    EXPECT_EQ(part.face_count, count);
  };
  expect_part(0, "", "", 0, 1);
  expect_part(1, "body", "", 1, 2);
  expect_part(2, "horn", "body/horn", 3, 2);
  expect_part(3, "tail", "", 5, 2);
}

TEST(ObjReader, NamesOfPartsAreCleanText) {
  const ReadResult result = read(kFourVertices + "g K\xFChe 2  # cattle\nf 1 2 3\n");
  ASSERT_EQ(result.mesh.parts.size(), 1u);
  EXPECT_EQ(result.mesh.parts[0].name, "K\uFFFDhe 2");
}

TEST(ObjReader, LongNamesOfManyPartsTakeNoMoreThanTheFile) {
  std::string file = kFourVertices + "o " + std::string(100'000, 'x') + "\n";
  for (int i = 0; i < 5000; ++i) file += "g " + std::to_string(i) + "\nf 1 2 3\n";
  const ReadResult result = read(file);
  ASSERT_TRUE(result.ok);
  EXPECT_EQ(result.mesh.face_count(), 5000u);
  ASSERT_EQ(result.mesh.remarks.size(), 1u);
}

TEST(ObjReader, ReadsCoordinatesThatAreNotFinite) {
  const ReadResult result = read("v nan -nan 1.#QNAN\nv inf -INF 1.#INF\nv 1e400 -1e400 1e-400\n");
  ASSERT_TRUE(result.ok) << result.error;
  for (const double coordinate : result.mesh.points[0]) EXPECT_TRUE(std::isnan(coordinate));
  for (const double coordinate : result.mesh.points[1]) EXPECT_TRUE(std::isinf(coordinate));
  EXPECT_EQ(result.mesh.points[2], (Point{INFINITY, -INFINITY, 0}));
}

TEST(ObjReader, RemarksFreeFormSurfaces) {
  const ReadResult result =
      read(kFourVertices + "cstype bspline\ndeg 1 1\nsurf 0 1 0 1 1 2 \\\n3 4\nparm u 0 1\nend\n");
  ASSERT_TRUE(result.ok);
  EXPECT_EQ(result.mesh.remarks, (std::vector<std::string>{"free-form surfaces are not read"}));
}

TEST(ObjReader, NamesTheLineOfEachDefect) {
  EXPECT_EQ(read("v 0 0 0\nv 1 2\n").error, "line 2: a vertex needs three coordinates");
  EXPECT_EQ(read("v 0 0 0\r\n\r\nv 1 2 x\r\n").error, "line 3: 'x' is not a number");
  EXPECT_EQ(read("v 0x1 0 0\n").error, "line 1: '0x1' is not a number");
  EXPECT_EQ(read("v 1\rv 2").error, "line 1: a vertex needs three coordinates");
  EXPECT_EQ(read(kFourVertices + "f 1 2 3.0\n").error, "line 5: '3.0' is not a vertex index");
  EXPECT_EQ(read(kFourVertices + "f 1 2 \\\n/3\n").error, "line 6: '/3' is not a vertex index");
}

TEST(ObjReader, RefusesWhatIsNoObjFile) {
  EXPECT_EQ(read("").error, "the file is empty");
  EXPECT_EQ(read("# nothing\n").error, "no line begins with 'v' or 'f': this is not an OBJ file");
  EXPECT_EQ(read("\x89PNG\r\n\x1A\n").error, "no line begins with 'v' or 'f': this is not an OBJ file");
  EXPECT_EQ(read("v 0 0 0\n\0"s).error, "byte 8: a zero byte, where an OBJ file holds only text (UTF-8)");
}

TEST(ObjReader, AFileOfVerticesAloneHasNoFaces) {
  const ReadResult result = read(kFourVertices);
  EXPECT_TRUE(result.ok);
  EXPECT_EQ(result.mesh.face_count(), 0u);
  EXPECT_TRUE(result.mesh.parts.empty());
}

const std::string kAllSorts =
    "# c\r\no a\nv 0 0 0 1\nv 1e0 -.5 +0\ng b\nv 0 1 nan\nvt 0 0\nf 1/1 2/1 \\\n 3/1\nf -1 -2 -3 1\nl 1 2\nf "
    "1//2 2//2 9\n";

TEST(ObjReader, SurvivesEveryCut) {
  expect_cuts_are_harmless(read_obj, kAllSorts, 3);
}
TEST(ObjReader, SurvivesEveryChangedByte) {
  expect_changed_bytes_are_harmless(read_obj, kAllSorts);
}

}  // namespace
}  // namespace tandem::build
