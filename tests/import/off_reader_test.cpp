#include <bit>
#include <cmath>
#include <string>

#include "bvhbuild/import/readers.h"
#include "reader_test.h"

namespace tandem::build {
namespace {

const std::string kThreeVertices = "5 0 0\n1 0 0\n0 1 0.1\n";

ReadResult read(const std::string& file) {
  return read_from(read_off, file);
}

void append(std::string& file, std::uint32_t bits) {
  for (int shift = 24; shift >= 0; shift -= 8) file += static_cast<char>(bits >> shift);
}

// Three vertices with `extra` further numbers each, and two triangles, the second with a colour of three
// numbers.
std::string binary(const std::string& keyword, int extra) {
  std::string file = keyword + " BINARY\n";
  for (const std::uint32_t count : {3u, 2u, 0u}) append(file, count);
  for (const float x : {0.f, 1.f, 2.5f}) {
    append(file, std::bit_cast<std::uint32_t>(x));
    for (int i = 0; i < 2 + extra; ++i) append(file, std::bit_cast<std::uint32_t>(1.f));
  }
  for (const std::uint32_t number : {3u, 0u, 1u, 2u, 0u, 3u, 2u, 1u, 0u, 3u, 7u, 7u, 7u})
    append(file, number);
  return file;
}

TEST(OffReader, ReadsPointsAndFacesInOrder) {
  const ReadResult result = read("OFF\n3 2 0\n" + kThreeVertices + "3 0 1 2\n4 2 1 0 1\n");
  ASSERT_TRUE(result.ok) << result.error;
  EXPECT_EQ(faces_of(result.mesh), (std::vector<Face>{{0, 1, 2}, {2, 1, 0, 1}}));
  EXPECT_EQ(result.mesh.points[2], (Point{0, 1, 0.1}));
}

TEST(OffReader, CountsMayStandOnTheKeywordsLineOrWithoutIt) {
  for (const char* head : {"OFF 3 1 0\n", "OFF 3 1\n", "OFF\n3 1\n", "OFF\n3\n1\n0\n", "3 1 0\n", "3 1\n",
                           "OFF\n3 1 0 # edges\n", "OFF\n3 1 # no edges\n", "OFF\r\n\r\n3 1 0\r\n",
                           "\xEF\xBB\xBFOFF\r3 1 0\r", "# c\nOFF # c\n# c\n3 1 0\n"}) {
    const ReadResult result = read(head + kThreeVertices + "3 0 1 2\n");
    ASSERT_TRUE(result.ok) << result.error << head;
    EXPECT_EQ(faces_of(result.mesh), (std::vector<Face>{{0, 1, 2}}));
    EXPECT_EQ(result.mesh.points[0], (Point{5, 0, 0})) << head;
  }
}

TEST(OffReader, ReadsFacesAndRemarksWhatIsOdd) {
  expect_faces(read_off, {
                             {"faces over several lines",
                              "OFF\n3 3 0\n" + kThreeVertices + "3\n0 1\n2\n3 2 1 # c\n# c\n\n0\n 3 0 2 1",
                              {{0, 1, 2}, {2, 1, 0}, {0, 2, 1}}},
                             {"colours of faces",
                              "OFF\n3 4 0\n" + kThreeVertices +
                                  "3 0 1 2 255 0 0\n3 0 1 2 0.5 0.5 0.5 1\n3 0 1\n2 7\n3 2 1 0 # red\n",
                              {{0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {2, 1, 0}}},
                             {"faces of any number of corners",
                              "OFF\n3 4 0\n" + kThreeVertices + "2 0 1\n0\n1 2\n3 0 1 2\n",
                              {{0, 1}, {}, {2}, {0, 1, 2}}},
                             {"indices that name no vertex",
                              "OFF\n3 2 0\n" + kThreeVertices + "3 0 1 3\n3\n-1 4294967295\n 2\n",
                              {{0, 1, 3}, {kNoVertex, kNoVertex, 2}},
                              {"line 6: face index 3 of 3 vertices", "line 8: face index -1 of 3 vertices",
                               "line 8: face index 4294967295 of 3 vertices"}},
                             {"no vertices and faces", "OFF\n0 0 0\n", {}},
                             {"no line end behind none", "OFF\n0 0 0", {}},
                         });
}

TEST(OffReader, PassesOverWhatThePrefixPromisesOfVertices) {
  for (const char* keyword : {"COFF", "NOFF", "STOFF", "CNOFF", "NCOFF", "STCNOFF", "OFF"})
    expect_faces(read_off, {{keyword,
                             std::string(keyword) +
                                 "\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1 # c\n0 1 0 0 0 0 0\n3 0 1 2\n",
                             {{0, 1, 2}}}});
}

TEST(OffReader, NamesTheLineOfEachDefect) {
  expect_errors(
      read_off,
      {
          {"4OFF\n3 1 0\n", "line 1: '4OFF' holds points of other than three dimensions, which are not read"},
          {"C4nOFF\n3 1 0\n",
           "line 1: 'C4nOFF' holds points of other than three dimensions, which are not read"},
          {"XOFF\n", "line 1: 'XOFF' is no kind of OFF file known here"},
          {"ply\n", "line 1: 'ply' where 'OFF' is expected"},
          {"OFF\n4 1 0\n" + kThreeVertices + "3 0 1 2\n",
           "line 6: the header promises 1 faces, the data ends after 0"},
          {"OFF\n3 2 0\n" + kThreeVertices + "3 0 1 2\n",
           "line 6: the header promises 2 faces, the data ends after 1"},
          {"OFF\n3 1 0\n" + kThreeVertices + "3 0 1 2\n3 0 1 2\n",
           "line 7: the file goes on after the vertices and faces that its header promises"},
          {"OFF\n6 1 0\n" + kThreeVertices + "3 0 1 2 9 9 9 9 9 9\n3 0 1\n",
           "line 7: the header promises 6 vertices, the data ends after 5"},
          {"OFF\n4000000000 1 0\n0 0 0\n",
           "line 2: the header promises 4000000000 vertices, the file has room for at most 1"},
          {"OFF\n1 1 0\n0 0 0\n999999999 0 0 0\n",
           "line 4: the header promises 1 faces, the data ends after 0"},
          {"OFF\n-1 1 0\n", "line 2: a count of -1"},
          {"OFF\n3 x 0\n", "line 2: 'x' where a count is expected"},
          {"OFF\n1 0 0\n0 zero 0\n", "line 3: 'zero' where a coordinate is expected"},
          {"OFF\n3 1 0\n" + kThreeVertices + "3 0 1 2.0\n", "line 6: '2.0' where a vertex index is expected"},
          {"OFF\n3 1 0\n" + kThreeVertices + "-3 0 1 2\n", "line 6: a face of -3 corners"},
          {"OFF", "line 1: the file ends where a count is expected"},
          {"", "the file is empty"},
      });
}

TEST(OffReader, RefusesACountPastEveryNumber) {
  EXPECT_EQ(read("OFF\n0 99999999999999999999 0\n").error.substr(0, 27), "line 2: the header promises");
}

TEST(OffReader, ReadsCoordinatesThatAreNotFinite) {
  const ReadResult result = read("OFF\n1 0 0\nnan -INF 1e400\n");
  ASSERT_TRUE(result.ok) << result.error;
  EXPECT_TRUE(std::isnan(result.mesh.points[0][0]));
  EXPECT_EQ(result.mesh.points[0][1], -INFINITY);
}

TEST(OffReader, ReadsBinaryFiles) {
  for (const auto& [keyword, extra] :
       {std::pair{"OFF", 0}, {"NOFF", 3}, {"COFF", 4}, {"STOFF", 2}, {"STCNOFF", 9}}) {
    const ReadResult result = read(binary(keyword, extra));
    ASSERT_TRUE(result.ok) << result.error;
    EXPECT_EQ(faces_of(result.mesh), (std::vector<Face>{{0, 1, 2}, {2, 1, 0}}));
    EXPECT_EQ(result.mesh.points[2], (Point{2.5, 1, 1}));
  }
}

TEST(OffReader, RemarksIndicesOfBinaryFilesByFace) {
  std::string file = binary("OFF", 0);
  file[file.size() - 21] = 9;
  EXPECT_EQ(read(file).mesh.remarks, (std::vector<std::string>{"face 1: index 9 of 3 vertices"}));
}

TEST(OffReader, EveryCutOfABinaryFileIsAnError) {
  const std::string file = binary("COFF", 4);
  for (std::size_t size = 0; size < file.size(); ++size)
    EXPECT_FALSE(read(file.substr(0, size)).ok) << "cut at byte " << size;
}

const std::string kAllSorts =
    "STOFF # c\n3 3 0\n0 0 0 0 0\n1 0 0 1 0\n0 1e0 -.5 0 1\n3 0 1 2 0.5 0 0\n4\n0 1\n2 0\n3 0 1 9\n";

TEST(OffReader, SurvivesEveryCut) {
  expect_cuts_are_harmless(read_off, kAllSorts, 3);
  expect_cuts_are_harmless(read_off, binary("NOFF", 3), 2);
}
TEST(OffReader, SurvivesEveryChangedByte) {
  expect_changed_bytes_are_harmless(read_off, kAllSorts);
  expect_changed_bytes_are_harmless(read_off, binary("NOFF", 3));
}

}  // namespace
}  // namespace tandem::build
