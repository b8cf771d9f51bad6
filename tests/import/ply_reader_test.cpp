#include <bit>
#include <cmath>
#include <string>

#include "bvhbuild/import/readers.h"
#include "reader_test.h"

namespace tandem::build {
namespace {

const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";
const std::string kIndices = "property list uchar int vertex_indices\n";
const std::string kThreeVertices = "0 0 0\n1 0 0\n0 1 0.1\n";

ReadResult read(const std::string& file) {
  return read_from(read_ply, file);
}

void expect_faces(const std::string& file, const std::vector<Face>& faces) {
  const ReadResult result = read(file);
  EXPECT_TRUE(result.ok) << result.error;
  EXPECT_EQ(faces_of(result), faces) << file;
}

std::string header(const std::string& format, const std::string& elements) {
  return "ply\nformat " + format + " 1.0\n" + elements + "end_header\n";
}

std::string text(int vertices, int faces, const std::string& data) {
  return header("ascii", "element vertex " + std::to_string(vertices) + "\n" + kXyz + "element face " +
                             std::to_string(faces) + "\n" + kIndices) +
         data;
}

std::string strips(const std::string& data) {
  return header("ascii",
                "element vertex 9\n" + kXyz + "element tristrips 1\nproperty list int int vertex_indices\n") +
         "0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n" + data;
}

// The bytes of `value`, in either order.
template <class T>
std::string raw(T value, bool big_endian) {
  const auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
  std::string text(bytes.begin(), bytes.end());
  if (big_endian != (std::endian::native == std::endian::big)) text = std::string(text.rbegin(), text.rend());
  return text;
}

// A triangle whose third vertex is (0.5, 2, 3), its faces' indices and lengths of the given types.
template <class Coordinate, class Length, class Index>
std::string binary(bool big, const std::string& coordinate, const std::string& length,
                   const std::string& index) {
  std::string file = header(big ? "binary_big_endian" : "binary_little_endian",
                            "element vertex 3\nproperty " + coordinate + " x\nproperty " + coordinate +
                                " y\nproperty " + coordinate + " z\nelement face 2\nproperty list " + length +
                                " " + index + " vertex_index\n");
  for (const int value : {10, 0, 0, 1, 0, 0, 7, 2, 3}) file += raw(static_cast<Coordinate>(value), big);
  for (int face = 0; face < 2; ++face) {
    file += raw(static_cast<Length>(3), big);
    for (const int value : {0, 1, 2}) file += raw(static_cast<Index>(value), big);
  }
  return file;
}

TEST(PlyReader, ReadsText) {
  const ReadResult result = read(text(3, 2, kThreeVertices + "3 0 1 2\n4 2 1 0 1\n"));
  ASSERT_TRUE(result.ok) << result.error;
  EXPECT_EQ(faces_of(result), (std::vector<Face>{{0, 1, 2}, {2, 1, 0, 1}}));
  EXPECT_EQ(result.mesh.points[2], (Point{0, 1, 0.1}));
}

TEST(PlyReader, ReadsAllTypesInBothByteOrders) {
  for (const bool big : {false, true}) {
    const std::vector<std::string> files = {
        binary<float, std::uint8_t, std::int32_t>(big, "float", "uchar", "int"),
        binary<float, std::uint8_t, std::uint32_t>(big, "float32", "uint8", "uint32"),
        binary<double, std::int32_t, std::int16_t>(big, "double", "int", "short"),
        binary<double, std::uint32_t, std::uint16_t>(big, "float64", "uint", "ushort"),
        binary<std::int16_t, std::int16_t, std::int8_t>(big, "int16", "int16", "int8"),
        binary<std::int32_t, std::uint16_t, std::uint8_t>(big, "int32", "uint16", "uchar"),
        binary<std::int8_t, std::int8_t, float>(big, "char", "char", "float"),
        binary<std::uint16_t, std::uint8_t, double>(big, "ushort", "uchar", "double")};
    for (const std::string& file : files) {
      const ReadResult result = read(file);
      ASSERT_TRUE(result.ok) << result.error << file;
      EXPECT_EQ(faces_of(result), (std::vector<Face>{{0, 1, 2}, {0, 1, 2}}));
      EXPECT_EQ(result.mesh.points[2], (Point{7, 2, 3}));
    }
  }
}

TEST(PlyReader, PropertiesMayComeInAnyOrderAmongOthers) {
  expect_faces(header("ascii",
                      "element vertex 3\nproperty uchar red\nproperty float z\nproperty list uchar int "
                      "ring\nproperty double y\n"
                      "property int x\nelement face 1\nproperty list uchar float texcoord\n" +
                          kIndices + "property uchar flag\n") +
                   "255 3 2 9 9 2 1\n255 0 0 0 0\n255 0 1 9 0 0\n6 0 0 0 0 0 0 3 0 1 2 7\n",
               {{0, 1, 2}});
  const ReadResult result =
      read(header("ascii", "element vertex 1\nproperty float z\nproperty float y\nproperty float x\n") +
           "3 2 1\n");
  EXPECT_EQ(result.mesh.points.at(0), (Point{1, 2, 3}));
}

TEST(PlyReader, PassesOverOtherElements) {
  expect_faces(
      header("ascii", "element camera 1\nproperty float f\nproperty list uchar int l\nelement vertex 3\n" +
                          kXyz + "element none 5\nelement edge 2\nproperty int a\nelement face 1\n" +
                          kIndices + "element last 1\nproperty list int int l\n") +
          "1 2 3 4\n" + kThreeVertices + "5\n6\n3 0 1 2\n1 1\n",
      {{0, 1, 2}});
}

TEST(PlyReader, FacesMayComeBeforeTheVertices) {
  const ReadResult result =
      read(header("ascii", "element face 1\n" + kIndices + "element vertex 3\n" + kXyz) + "3 0 1 2\n" +
           kThreeVertices);
  EXPECT_EQ(faces_of(result), (std::vector<Face>{{0, 1, 2}}));
  EXPECT_TRUE(result.mesh.remarks.empty());
}

TEST(PlyReader, StripsAlternateTheirOrientation) {
  expect_faces(strips("5 0 1 2 3 4\n"), {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}});
}

TEST(PlyReader, AStripBeginsAnewAtMinusOne) {
  expect_faces(strips("9 0 1 2 3 -1 4 5 6 7\n"), {{0, 1, 2}, {2, 1, 3}, {4, 5, 6}, {6, 5, 7}});
  EXPECT_TRUE(read(strips("9 0 1 2 3 -1 4 5 6 7\n")).mesh.remarks.empty());
}

TEST(PlyReader, EachStripBeginsAnew) {
  const std::string two = header(
      "ascii", "element vertex 1\n" + kXyz + "element tristrips 2\nproperty list int uint vertex_indices\n");
  expect_faces(two + "0 0 0\n4 0 1 2 3\n3 4 5 6\n", {{0, 1, 2}, {2, 1, 3}, {4, 5, 6}});
  expect_faces(two + "0 0 0\n8 0 1 2 3 4294967295 4 5 6\n0\n", {{0, 1, 2}, {2, 1, 3}, {4, 5, 6}});
}

TEST(PlyReader, StitchesOfAStripAreNoFacesButKeepTheRhythm) {
  expect_faces(strips("8 0 1 2 2 3 3 4 5\n"), {{0, 1, 2}, {4, 3, 5}});
  expect_faces(strips("7 0 1 2 2 3 4 5\n"), {{0, 1, 2}, {3, 2, 4}, {3, 4, 5}});
}

TEST(PlyReader, ShortStripsHaveNoFaces) {
  expect_faces(strips("0\n"), {});
  expect_faces(strips("2 0 1\n"), {});
  expect_faces(strips("5 0 1 -1 2 3\n"), {});
}

TEST(PlyReader, HeadersEndTheirLinesInEveryWay) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string file;
    for (const char c : text(3, 1, kThreeVertices + "3 0 1 2\n"))
      if (c == '\n') {
        file += end;
      } else {
        file += c;
      }
    expect_faces(file, {{0, 1, 2}});
  }
}

TEST(PlyReader, BinaryDataMayBeginWithALineEnd) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string file;
    const std::string lines =
        header("binary_little_endian",
               "element vertex 3\nproperty uchar x\nproperty uchar y\nproperty uchar z\n"
               "element face 1\nproperty list uchar uchar vertex_indices\n");
    for (const char c : lines) file += c == '\n' ? end : std::string(1, c);
    // With CR at the ends of lines, a first byte LF would make the first one look like CR LF.
    const ReadResult result =
        read(file + "\x0A\x0D\x0A\x01\x02\x03\x04\x05\x06\x03" + std::string("\0\1\2", 3));
    ASSERT_TRUE(result.ok) << result.error;
    EXPECT_EQ(result.mesh.points.at(0), (Point{10, 13, 10}));
    EXPECT_EQ(faces_of(result), (std::vector<Face>{{0, 1, 2}}));
  }
}

TEST(PlyReader, PassesOverAByteOrderMark) {
  expect_faces("\xEF\xBB\xBF" + text(3, 1, kThreeVertices + "3 0 1 2\n"), {{0, 1, 2}});
}

TEST(PlyReader, TheFirstListOfIndicesCounts) {
  expect_faces(header("ascii", "element vertex 3\n" + kXyz + "element face 1\n" + kIndices +
                                   "property list uchar int vertex_index\n") +
                   kThreeVertices + "3 0 1 2 4 2 2 2 2\n",
               {{0, 1, 2}});
}

TEST(PlyReader, CommentsMayStandAnywhereInTheHeader) {
  expect_faces("ply\ncomment a\nformat ascii 1.0\nobj_info b\n\nelement vertex 3\ncomment element face 9\n" +
                   kXyz + "comment end_header \nelement face 1\n" + kIndices + "comment\nend_header\n" +
                   kThreeVertices + "\n3 0 1 2",
               {{0, 1, 2}});
}

TEST(PlyReader, PointsAloneAreNoError) {
  const ReadResult result = read(header("ascii", "element vertex 1\n" + kXyz) + "1 2 nan\n");
  EXPECT_TRUE(result.ok) << result.error;
  EXPECT_EQ(result.mesh.points.size(), 1u);
  EXPECT_EQ(result.mesh.face_count(), 0u);
  EXPECT_TRUE(read("ply\nformat ascii 1.0\nelement vertex 0\n" + kXyz + "end_header").ok);
}

TEST(PlyReader, RemarksIndicesThatNameNoVertexAndKeepsTheFace) {
  const ReadResult result = read(text(3, 2, kThreeVertices + "3 0 1 3\n3 -1 1 2\n"));
  ASSERT_TRUE(result.ok) << result.error;
  EXPECT_EQ(faces_of(result), (std::vector<Face>{{0, 1, 3}, {kNoVertex, 1, 2}}));
  EXPECT_EQ(result.mesh.remarks, (std::vector<std::string>{"line 13: face index 3 of 3 vertices",
                                                           "line 14: face index -1 of 3 vertices"}));
  std::string file = binary<float, std::uint8_t, std::uint8_t>(false, "float", "uchar", "uchar");
  file.back() = 9;
  EXPECT_EQ(read(file).mesh.remarks, (std::vector<std::string>{"face 1: index 9 of 3 vertices"}));
}

TEST(PlyReader, CountsFacesOfAnyNumberOfCorners) {
  expect_faces(text(3, 3, kThreeVertices + "2 0 1\n0\n3 0 1 2\n"), {{0, 1}, {}, {0, 1, 2}});
}

TEST(PlyReader, RefusesAHeaderThatIsCut) {
  EXPECT_EQ(read("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n").error,
            "the header has no 'end_header' line: the file was cut in its header");
  EXPECT_EQ(read("").error, "the file is empty");
}

TEST(PlyReader, NamesTheLineOfEachDefectInTheHeader) {
  EXPECT_EQ(read("plx\n").error, "line 1: the first line is not 'ply'");
  EXPECT_EQ(read("ply\nformat ascii 2.0\n").error, "line 2: PLY version '2.0' is not 1.0");
  EXPECT_EQ(read("ply\nformat morse 1.0\n").error, "line 2: 'morse' is no format of a PLY file");
  EXPECT_EQ(read("ply\nelement vertex -3\n").error, "line 2: '-3' is no count of 'vertex'");
  EXPECT_EQ(read("ply\nelement vertex 3.5\n").error, "line 2: '3.5' is no count of 'vertex'");
  EXPECT_EQ(read("ply\nproperty float x\n").error, "line 2: a property before the first element");
  EXPECT_EQ(read("ply\nelement vertex 3\nproperty flout x\n").error,
            "line 3: 'flout' is no type of a PLY property");
  EXPECT_EQ(read("ply\nelement vertex 3\nproperty float\n").error, "line 3: a property without a name");
  EXPECT_EQ(read("ply\nelement face 3\nproperty list float int a\n").error,
            "line 3: the length of a list is no integer");
  EXPECT_EQ(read("ply\nelemant vertex 3\n").error, "line 2: 'elemant' is no keyword of a PLY header");
}

TEST(PlyReader, RefusesElementsThatMakeNoMesh) {
  EXPECT_EQ(read("ply\nelement vertex 0\nend_header\n").error, "the header has no 'format' line");
  EXPECT_EQ(read(header("ascii", "element vertex 0\n" + kXyz + "element vertex 0\n" + kXyz)).error,
            "the header has 2 elements 'vertex', not one");
  EXPECT_EQ(read(header("ascii", "")).error, "the header has 0 elements 'vertex', not one");
  EXPECT_EQ(read(header("ascii", "element vertex 1\nproperty float x\nproperty float y\n")).error,
            "the element 'vertex' has no x, y and z");
  EXPECT_EQ(
      read(header("ascii", "element vertex 0\n" + kXyz + "element face 1\nproperty int vertex_indices\n"))
          .error,
      "the element 'face' has no list 'vertex_indices'");
}

TEST(PlyReader, RefusesCountsThatTheFileHasNoRoomFor) {
  EXPECT_EQ(
      read(header("binary_little_endian", "element vertex 4000000000\n" + kXyz) + "abcdefghijklmnop").error,
      "the header promises 4000000000 vertices, the file has room for at most 1");
  EXPECT_EQ(read(header("binary_little_endian", "element vertex 2\n" + kXyz) + "abcdefghijklmnop").error,
            "the header promises 2 vertices, the file has room for at most 1");
  EXPECT_EQ(read(text(3, 1'000'000'000, kThreeVertices + "3 0 1 2\n")).error,
            "the header promises 1000000000 faces, the file has room for at most 5");
}

TEST(PlyReader, RefusesDataThatIsCut) {
  EXPECT_EQ(read(text(3, 3, kThreeVertices + "3 0 1 2\n3 0 1\n")).error.substr(0, 7), "line 14");
  EXPECT_EQ(read(text(3, 3, kThreeVertices + "3 0 1 2\n3 0 1")).error,
            "the header promises 3 faces, the data ends after 1");
  EXPECT_EQ(read(text(3, 3, kThreeVertices + "3 0 1 2\n")).error,
            "the header promises 3 faces, the data ends after 1");
  std::string file = binary<float, std::uint8_t, std::int32_t>(false, "float", "uchar", "int");
  file.pop_back();
  EXPECT_EQ(read(file).error, "the header promises 2 faces, the data ends after 1");
}

TEST(PlyReader, NamesTheLineOfEachDefectInTheData) {
  EXPECT_EQ(read(text(3, 1, "0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n")).error, "line 11: 'x' is not a number");
  EXPECT_EQ(read(text(3, 1, "0 0 0\n1 0\n0 1 0\n3 0 1 2\n")).error,
            "line 11: the line ends before its values do");
  EXPECT_EQ(read(text(3, 1, kThreeVertices + "3 0 1 2.0\n")).error, "line 13: '2.0' is not an integer");
  EXPECT_EQ(read(text(3, 1, kThreeVertices + "-3 0 1 2\n")).error, "face 0 has a list of length -3");
}

TEST(PlyReader, RemarksWhatItPassesOver) {
  const ReadResult result = read(text(3, 2, kThreeVertices + "3 0 1 2 7\n3 0 1 2 7\nmore\n"));
  ASSERT_TRUE(result.ok) << result.error;
  EXPECT_EQ(result.mesh.remarks,
            (std::vector<std::string>{"line 13: more values than the header lists for 'face'",
                                      "5 bytes after the last element are passed over"}));
}

TEST(PlyReader, IndicesThatAreNoIntegersNameNoVertex) {
  const std::string real_indices = header(
      "ascii", "element vertex 3\n" + kXyz + "element face 1\nproperty list uchar float vertex_index\n");
  const ReadResult result = read(real_indices + kThreeVertices + "4 0 1.0 2.5 nan\n");
  ASSERT_TRUE(result.ok) << result.error;
  EXPECT_EQ(faces_of(result), (std::vector<Face>{{0, 1, kNoVertex, kNoVertex}}));
}

const std::string kText = text(3, 3, kThreeVertices + "3 0 1 2\n4 0 1 2 9\n3 2 1 0\n");

TEST(PlyReader, SurvivesEveryCut) {
  expect_cuts_are_harmless(read_ply, kText, 3);
  expect_cuts_are_harmless(read_ply, strips("9 0 1 2 3 -1 4 5 6 7\n"), 4);
  expect_cuts_are_harmless(read_ply,
                           binary<float, std::uint8_t, std::int32_t>(false, "float", "uchar", "int"), 2);
}
TEST(PlyReader, EveryCutOfABinaryFileIsAnError) {
  const std::string file = binary<double, std::int32_t, std::int16_t>(true, "double", "int", "short");
  for (std::size_t size = 0; size < file.size(); ++size)
    EXPECT_FALSE(read(file.substr(0, size)).ok) << "cut at byte " << size;
}
TEST(PlyReader, SurvivesEveryChangedByte) {
  expect_changed_bytes_are_harmless(read_ply, kText);
  expect_changed_bytes_are_harmless(read_ply, strips("9 0 1 2 3 -1 4 5 6 7\n"));
  expect_changed_bytes_are_harmless(
      read_ply, binary<float, std::uint8_t, std::int32_t>(false, "float", "uchar", "int"));
}

}  // namespace
}  // namespace tandem::build
