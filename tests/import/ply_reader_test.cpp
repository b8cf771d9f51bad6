#include <bit>
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
  EXPECT_EQ(faces_of(result.mesh), (std::vector<Face>{{0, 1, 2}, {2, 1, 0, 1}}));
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
      EXPECT_EQ(faces_of(result.mesh), (std::vector<Face>{{0, 1, 2}, {0, 1, 2}}));
      EXPECT_EQ(result.mesh.points[2], (Point{7, 2, 3}));
    }
  }
}

TEST(PlyReader, PropertiesMayComeInAnyOrderAmongOthers) {
  expect_faces(read_ply,
               {{"any order",
                 header("ascii",
                        "element vertex 3\nproperty uchar red\nproperty float z\nproperty list uchar int "
                        "ring\nproperty double y\n"
                        "property int x\nelement face 1\nproperty list uchar float texcoord\n" +
                            kIndices + "property uchar flag\n") +
                     "255 3 2 9 9 2 1\n255 0 0 0 0\n255 0 1 9 0 0\n6 0 0 0 0 0 0 3 0 1 2 7\n",
                 {{0, 1, 2}}}});
  const ReadResult result =
      read(header("ascii", "element vertex 1\nproperty float z\nproperty float y\nproperty float x\n") +
           "3 2 1\n");
  EXPECT_EQ(result.mesh.points.at(0), (Point{1, 2, 3}));
}

TEST(PlyReader, ReadsStrips) {
  const std::string two = header(
      "ascii", "element vertex 1\n" + kXyz + "element tristrips 2\nproperty list int uint vertex_indices\n");
  expect_faces(
      read_ply,
      {{"orientations alternate", strips("5 0 1 2 3 4\n"), {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}}},
       {"a strip begins anew at -1",
        strips("9 0 1 2 3 -1 4 5 6 7\n"),
        {{0, 1, 2}, {2, 1, 3}, {4, 5, 6}, {6, 5, 7}}},
       {"each strip begins anew",
        two + "0 0 0\n4 0 1 2 3\n3 4 5 6\n",
        {{0, 1, 2}, {2, 1, 3}, {4, 5, 6}},
        {},
        true},
       {"a strip begins anew at 2^32 - 1",
        two + "0 0 0\n8 0 1 2 3 4294967295 4 5 6\n0\n",
        {{0, 1, 2}, {2, 1, 3}, {4, 5, 6}},
        {},
        true},
       {"stitches are no faces but keep the rhythm", strips("8 0 1 2 2 3 3 4 5\n"), {{0, 1, 2}, {4, 3, 5}}},
       {"a stitch of one corner", strips("7 0 1 2 2 3 4 5\n"), {{0, 1, 2}, {3, 2, 4}, {3, 4, 5}}},
       {"an empty strip", strips("0\n"), {}},
       {"a strip of two corners", strips("2 0 1\n"), {}},
       {"two short strips", strips("5 0 1 -1 2 3\n"), {}}});
}

TEST(PlyReader, ReadsFacesAndRemarksWhatIsOdd) {
  expect_faces(
      read_ply,
      {
          {"other elements",
           header("ascii",
                  "element camera 1\nproperty float f\nproperty list uchar int l\nelement vertex 3\n" + kXyz +
                      "element none 5\nelement edge 2\nproperty int a\nelement face 1\n" + kIndices +
                      "element last 1\nproperty list int int l\n") +
               "1 2 3 4\n" + kThreeVertices + "5\n6\n3 0 1 2\n1 1\n",
           {{0, 1, 2}}},
          {"a byte order mark", "\xEF\xBB\xBF" + text(3, 1, kThreeVertices + "3 0 1 2\n"), {{0, 1, 2}}},
          {"the first list of indices counts",
           header("ascii", "element vertex 3\n" + kXyz + "element face 1\n" + kIndices +
                               "property list uchar int vertex_index\n") +
               kThreeVertices + "3 0 1 2 4 2 2 2 2\n",
           {{0, 1, 2}}},
          {"comments anywhere in the header",
           "ply\ncomment a\nformat ascii 1.0\nobj_info b\n\nelement vertex 3\ncomment element face 9\n" +
               kXyz + "comment end_header \nelement face 1\n" + kIndices + "comment\nend_header\n" +
               kThreeVertices + "\n3 0 1 2",
           {{0, 1, 2}}},
          {"faces of any number of corners",
           text(3, 3, kThreeVertices + "2 0 1\n0\n3 0 1 2\n"),
           {{0, 1}, {}, {0, 1, 2}}},
          {"faces before the vertices",
           header("ascii", "element face 1\n" + kIndices + "element vertex 3\n" + kXyz) + "3 0 1 2\n" +
               kThreeVertices,
           {{0, 1, 2}}},
          {"indices that name no vertex",
           text(3, 2, kThreeVertices + "3 0 1 3\n3 -1 1 2\n"),
           {{0, 1, 3}, {kNoVertex, 1, 2}},
           {"line 13: face index 3 of 3 vertices", "line 14: face index -1 of 3 vertices"}},
          {"more than the header lists",
           text(3, 2, kThreeVertices + "3 0 1 2 7\n3 0 1 2 7\nmore\n"),
           {{0, 1, 2}, {0, 1, 2}},
           {"line 13: more values than the header lists for 'face'",
            "5 bytes after the last element are passed over"}},
          {"indices that are no integers",
           header("ascii",
                  "element vertex 3\n" + kXyz + "element face 1\nproperty list uchar float vertex_index\n") +
               kThreeVertices + "4 0 1.0 2.5 nan\n",
           {{0, 1, kNoVertex, kNoVertex}},
           {},
           true},
      });
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
    expect_faces(read_ply, {{"a line end", file, {{0, 1, 2}}}});
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
    EXPECT_EQ(faces_of(result.mesh), (std::vector<Face>{{0, 1, 2}}));
  }
}

TEST(PlyReader, PointsAloneAreNoError) {
  const ReadResult result = read(header("ascii", "element vertex 1\n" + kXyz) + "1 2 nan\n");
  EXPECT_TRUE(result.ok) << result.error;
  EXPECT_EQ(result.mesh.points.size(), 1u);
  EXPECT_EQ(result.mesh.face_count(), 0u);
  EXPECT_TRUE(read("ply\nformat ascii 1.0\nelement vertex 0\n" + kXyz + "end_header").ok);
}

TEST(PlyReader, RemarksIndicesOfBinaryFilesByFace) {
  std::string file = binary<float, std::uint8_t, std::uint8_t>(false, "float", "uchar", "uchar");
  file.back() = 9;
  EXPECT_EQ(read(file).mesh.remarks, (std::vector<std::string>{"face 1: index 9 of 3 vertices"}));
}

TEST(PlyReader, NamesEachDefectOfTheHeader) {
  expect_errors(
      read_ply,
      {
          {"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n",
           "the header has no 'end_header' line: the file was cut in its header"},
          {"", "the file is empty"},
          {"plx\n", "line 1: the first line is not 'ply'"},
          {"ply\nformat ascii 2.0\n", "line 2: PLY version '2.0' is not 1.0"},
          {"ply\nformat morse 1.0\n", "line 2: 'morse' is no format of a PLY file"},
          {"ply\nelement vertex -3\n", "line 2: '-3' is no count of 'vertex'"},
          {"ply\nelement vertex 3.5\n", "line 2: '3.5' is no count of 'vertex'"},
          {"ply\nproperty float x\n", "line 2: a property before the first element"},
          {"ply\nelement vertex 3\nproperty flout x\n", "line 3: 'flout' is no type of a PLY property"},
          {"ply\nelement vertex 3\nproperty float\n", "line 3: a property without a name"},
          {"ply\nelement face 3\nproperty list float int a\n", "line 3: the length of a list is no integer"},
          {"ply\nelemant vertex 3\n", "line 2: 'elemant' is no keyword of a PLY header"},
          {"ply\nelement vertex 0\nend_header\n", "the header has no 'format' line"},
          {header("ascii", "element vertex 0\n" + kXyz + "element vertex 0\n" + kXyz),
           "the header has 2 elements 'vertex', not one"},
          {header("ascii", ""), "the header has 0 elements 'vertex', not one"},
          {header("ascii", "element vertex 1\nproperty float x\nproperty float y\n"),
           "the element 'vertex' has no x, y and z"},
          {header("ascii", "element vertex 0\n" + kXyz + "element face 1\nproperty int vertex_indices\n"),
           "the element 'face' has no list 'vertex_indices'"},
      });
}

TEST(PlyReader, NamesEachDefectOfTheData) {
  EXPECT_EQ(read(text(3, 3, kThreeVertices + "3 0 1 2\n3 0 1\n")).error.substr(0, 7), "line 14");
  std::string file = binary<float, std::uint8_t, std::int32_t>(false, "float", "uchar", "int");
  file.pop_back();
  EXPECT_EQ(read(file).error, "the header promises 2 faces, the data ends after 1");
  expect_errors(
      read_ply,
      {
          {header("binary_little_endian", "element vertex 4000000000\n" + kXyz) + "abcdefghijklmnop",
           "the header promises 4000000000 vertices, the file has room for at most 1"},
          {header("binary_little_endian", "element vertex 2\n" + kXyz) + "abcdefghijklmnop",
           "the header promises 2 vertices, the file has room for at most 1"},
          {text(3, 1'000'000'000, kThreeVertices + "3 0 1 2\n"),
           "the header promises 1000000000 faces, the file has room for at most 5"},
          {text(3, 3, kThreeVertices + "3 0 1 2\n3 0 1"),
           "the header promises 3 faces, the data ends after 1"},
          {text(3, 3, kThreeVertices + "3 0 1 2\n"), "the header promises 3 faces, the data ends after 1"},
          {text(3, 1, "0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n"), "line 11: 'x' is not a number"},
          {text(3, 1, "0 0 0\n1 0\n0 1 0\n3 0 1 2\n"), "line 11: the line ends before its values do"},
          {text(3, 1, kThreeVertices + "3 0 1 2.0\n"), "line 13: '2.0' is not an integer"},
          {text(3, 1, kThreeVertices + "-3 0 1 2\n"), "face 0 has a list of length -3"},
      });
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
