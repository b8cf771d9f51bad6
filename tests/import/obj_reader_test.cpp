#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "bvhbuild/import/readers.h"
#include "bvhbuild/import/scanner.h"
#include "reader_test.h"

namespace tandem::build {
namespace {

using namespace std::string_literals;

const std::string kFourVertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";

ReadResult read(const std::string& file) {
  return read_from(read_obj, file);
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

TEST(ObjReader, ReadsFacesAndRemarksWhatIsOdd) {
  expect_faces(
      read_obj,
      {
          {"the vertex of every kind of corner",
           kFourVertices + "f 1 2 3\nf 1/9 2/9 3/9\nf 1//9 2//9 3//9\nf 1/9/9 2/9/9 3/9/9\nf 1/ 2// 3/9/\n",
           {{0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {0, 1, 2}}},
          {"polygons stay whole",
           kFourVertices + "f 1 2 3 4\nf 4 3 2 1 4\n",
           {{0, 1, 2, 3}, {3, 2, 1, 0, 3}}},
          {"relative indices count from the current end",
           kFourVertices + "f -4 -3 -2\nv 9 9 9\nf -1 -2 -5\n",
           {{0, 1, 2}, {4, 3, 0}}},
          {"indices too large for their type",
           kFourVertices + "f 1 2 4294967296\nf 1 2 4294967295\nf 1 2 99999999999999999999999\n",
           {{0, 1, kNoVertex}, {0, 1, kNoVertex - 1}, {0, 1, kNoVertex}},
           {},
           true},
          {"tabs, blanks, comments and a byte order mark",
           "\xEF\xBB\xBFv 0 0 0\n\t v\t1  0 0 \t\n  # v 5 5 5\nv 0 1 0# near\nv 0 0 1 # far\n f 1 2 4 # c "
           "3\nf 1 "
           "2 3#\n",
           {{0, 1, 3}, {0, 1, 2}}},
          {"a line goes on behind a backslash",
           "v 0 0 \\\n0\nv 1 \\ \r\n 0 0\nv 0 1 0 \\\n1 1 1\nf 1 2\\\n \\\n3\n",
           {{0, 1, 2}}},
          {"a backslash at the end of a comment",
           "# C:\\meshes\\\nv 0 0 0\nv 1 0 0\no a\\\nv 0 1 0\nf 1 2 3 # \\\nf 3 2 1\n",
           {{0, 1, 2}, {2, 1, 0}}},
          {"a backslash at the end of the file", kFourVertices + "f 1 2 3 \\", {{0, 1, 2}}},
          {"unknown statements",
           "mtllib a.mtl\nvn 0 0 1\nvt 0 0\nvp 1 2\ns off\nusemtl x\nweird 1 2\n" + kFourVertices +
               "f 1 2 3\n",
           {{0, 1, 2}}},
          {"materials do not reorder faces",
           kFourVertices + "usemtl a\nf 1 2 3\nusemtl b\nf 2 3 4\nusemtl a\nf 1 3 4\n",
           {{0, 1, 2}, {1, 2, 3}, {0, 2, 3}}},
          {"faces before their vertices", "f 1 2 4\n" + kFourVertices, {{0, 1, 3}}},
          {"the first index past the last vertex",
           kFourVertices + "f 1 2 4\nf 1 2 5\n",
           {{0, 1, 3}, {0, 1, 4}},
           {"line 6: face index 5 of 4 vertices"}},
          {"indices that name no vertex",
           kFourVertices + "f 1 2 99\nf 0 1 2\nf -9 1 2\n",
           {{0, 1, 98}, {kNoVertex, 0, 1}, {kNoVertex, 0, 1}},
           {"line 5: face index 99 of 4 vertices", "line 6: face index 0, but OBJ counts vertices from 1",
            "line 7: face index -9 counts back past the first vertex"}},
          {"an index that never comes among those that come later",
           "f 1 2 4\nf 1 99 2\nf 2 0 99\n" + kFourVertices,
           {{0, 1, 3}, {0, 98, 1}, {1, kNoVertex, 98}},
           {"line 2: face index 99 of 4 vertices", "line 3: face index 0, but OBJ counts vertices from 1"}},
          {"any number of corners, but no points and lines",
           kFourVertices + "p 1\nl 1 2 3\nf 1 2\nf 1\nf\nf 99 2\nf 2 3 4\n",
           {{0, 1}, {0}, {}, {98, 1}, {1, 2, 3}},
           {"line 10: face index 99 of 4 vertices"}},
          {"free-form surfaces",
           kFourVertices + "cstype bspline\ndeg 1 1\nsurf 0 1 0 1 1 2 \\\n3 4\nparm u 0 1\nend\n",
           {},
           {"free-form surfaces are not read"}},
      });
}

TEST(ObjReader, RemarksAtMostFourIndices) {
  std::string file = kFourVertices;
  for (int i = 0; i < 100; ++i) file += "f 1 2 99\n";
  EXPECT_EQ(read(file).mesh.remarks.size(), 4u);
}

TEST(ObjReader, ReadsAllLineEnds) {
  for (const std::string end : {"\n", "\r\n", "\r"})
    expect_faces(
        read_obj,
        {{"a line end", "v 0 0 0" + end + "v 1 0 0" + end + "v 0 1 0" + end + end + "f 1 2 3", {{0, 1, 2}}}});
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

TEST(ObjReader, NamesTheLineOfEachDefectAndRefusesWhatIsNoObjFile) {
  expect_errors(read_obj,
                {
                    {"v 0 0 0\nv 1 2\n", "line 2: a vertex needs three coordinates"},
                    {"v 0 0 0\r\n\r\nv 1 2 x\r\n", "line 3: 'x' is not a number"},
                    {"v 0x1 0 0\n", "line 1: '0x1' is not a number"},
                    {"v 1\rv 2", "line 1: a vertex needs three coordinates"},
                    {kFourVertices + "f 1 2 3.0\n", "line 5: '3.0' is not a vertex index"},
                    {kFourVertices + "f 1 2 \\\n/3\n", "line 6: '/3' is not a vertex index"},
                    {"", "the file is empty"},
                    {"# nothing\n", "no line begins with 'v' or 'f': this is not an OBJ file"},
                    {"\x89PNG\r\n\x1A\n", "no line begins with 'v' or 'f': this is not an OBJ file"},
                    {"v 0 0 0\n\0"s, "byte 8: a zero byte, where an OBJ file holds only text (UTF-8)"},
                });
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

constexpr double kInf = std::numeric_limits<double>::infinity();

// The number that all of `text` is, or -77 where it is none.
double real(std::string_view text) {
  double value = -77;
  const char* const last = text.data() + text.size();
  return parse_real(text.data(), last, value) == last ? value : -77;
}

std::int64_t integer(std::string_view text) {
  std::int64_t value = -77;
  const char* const last = text.data() + text.size();
  return parse_integer(text.data(), last, value) == last ? value : -77;
}

TEST(NumberText, ReadsEveryWayToWriteADecimalAndKeepsAllBitsOfADouble) {
  const std::pair<std::string, double> numbers[] = {{"0", 0.0},
                                                    {"-1.5", -1.5},
                                                    {"+1.5", 1.5},
                                                    {"1.", 1.0},
                                                    {".5", 0.5},
                                                    {"-.5e+1", -5.0},
                                                    {"25E-2", 0.25},
                                                    {"0.1", 0.1},
                                                    {"0.1000000000000000055511151231257827", 0.1},
                                                    {"9007199254740993", 9007199254740992.0},
                                                    {"2.2250738585072011e-308", 2.2250738585072011e-308},
                                                    {"5e-324", 5e-324},
                                                    {"1e-42", 1e-42}};
  for (const auto& [text, value] : numbers) EXPECT_EQ(real(text), value) << text;
  EXPECT_TRUE(std::signbit(real("-0")));
  const std::pair<const char*, std::int64_t> integers[] = {
      {"0", 0}, {"+12", 12}, {"-12", -12}, {"007", 7}, {"4294967295", 4294967295}};
  for (const auto& [text, value] : integers) EXPECT_EQ(integer(text), value) << text;
}

TEST(NumberText, TooLargeIsInfiniteAndTooSmallIsZero) {
  const std::pair<std::string, double> numbers[] = {
      {"1e400", kInf},
      {"-1e400", -kInf},
      {"1e-400", 0.0},
      {"0.0001e400", kInf},
      {"10000e-400", 0.0},
      {"1e99999999999999999999999", kInf},
      {"1e-99999999999999999999999", 0.0},
      {"0e99999999999999999999999", 0.0},
      {std::string(400, '9'), kInf},
      {"0." + std::string(400, '0') + "1", 0.0},
      {"0." + std::string(1000, '0') + "1e400", 0.0},
      {std::string("1") + std::string(1000, '0') + "e-400", kInf}};
  for (const auto& [text, value] : numbers) EXPECT_EQ(real(text), value) << text;
  EXPECT_TRUE(std::signbit(real("-1e-400")));
}

TEST(NumberText, ReadsNonFiniteNumbersOfAnyProgram) {
  for (const char* text : {"nan", "NaN", "-nan", "NAN", "nan(ind)", "-nan(ind)", "1.#QNAN", "1.#qnan0",
                           "-1.#IND", "1.#IND00", "1.#SNAN"})
    EXPECT_TRUE(std::isnan(real(text))) << text;
  for (const char* text : {"inf", "+Inf", "INF", "infinity", "Infinity", "1.#INF", "1.#inf", "1.#INF00"})
    EXPECT_EQ(real(text), kInf) << text;
  for (const char* text : {"-inf", "-1.#INF", "-INFINITY"}) EXPECT_EQ(real(text), -kInf) << text;
}

TEST(NumberText, RefusesWhatIsNoDecimal) {
  for (const char* text :
       {"", "-", "+", ".", "e5", "+-1", "-+1", "--1", "0x10", "1e", "1,5", "one", "1.#", "1.#FOO", "2.#INF"})
    EXPECT_EQ(real(text), -77) << text;
}

TEST(NumberText, IntegersPastEveryCountStayPastIt) {
  EXPECT_GT(integer("99999999999999999999999999"), std::int64_t{1} << 56);
  EXPECT_LT(integer("-99999999999999999999999999"), -(std::int64_t{1} << 56));
}

TEST(NumberText, RefusesWhatIsNoInteger) {
  for (const char* text : {"", "-", "3.0", "1e3", "0x10", "--1", "+-1", "12a"})
    EXPECT_EQ(integer(text), -77) << text;
}

}  // namespace
}  // namespace tandem::build
