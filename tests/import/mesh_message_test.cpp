#include "bvhbuild/import/mesh_message.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <string>

namespace tandem::build {
namespace {

constexpr std::uint64_t kPlenty = 1 << 20;

ReadResult small_mesh() {
  ReadResult result;
  result.ok = true;
  result.mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  result.mesh.corners = {0, 1, 2, 3, kNoVertex, 7, 0};
  result.mesh.face_begin = {0, 4, 7};
  result.mesh.parts = {{"first", "root/a", 0, 1}, {"", "", 1, 1}};
  result.mesh.remarks = {"odd"};
  result.mesh.left_out = {true, false, true};
  result.mesh.reader = "somebody";
  result.mesh.single_precision = true;
  return result;
}

std::string message(const ReadResult& result) {
  std::string bytes;
  write_message(result, [&](const void* from, std::size_t count) {
    bytes.append(static_cast<const char*>(from), count);
  });
  return bytes;
}

bool read(const std::string& bytes, ReadResult& result, std::uint64_t most_bytes = kPlenty) {
  std::size_t at = 0;
  const auto source = [&](void* to, std::size_t count) {
    if (bytes.size() - at < count) return false;
    std::memcpy(to, bytes.data() + at, count);
    at += count;
    return true;
  };
  return read_message(source, most_bytes, result);
}

void expect_sound(const PolygonMesh& mesh) {
  ASSERT_FALSE(mesh.face_begin.empty());
  EXPECT_EQ(mesh.face_begin.front(), 0u);
  EXPECT_EQ(mesh.face_begin.back(), mesh.corners.size());
  for (std::size_t f = 0; f + 1 < mesh.face_begin.size(); ++f)
    EXPECT_GE(mesh.face_begin[f + 1], mesh.face_begin[f] + 3);
  std::uint64_t next = 0;
  for (const SourcePart& part : mesh.parts) {
    EXPECT_EQ(part.first_face, next);
    next += part.face_count;
  }
  EXPECT_EQ(next, mesh.face_count());
}

TEST(MeshMessage, BringsAMeshAcross) {
  ReadResult result;
  ASSERT_TRUE(read(message(small_mesh()), result));
  const PolygonMesh sent = small_mesh().mesh;
  EXPECT_TRUE(result.ok);
  EXPECT_EQ(result.mesh.points, sent.points);
  EXPECT_EQ(result.mesh.corners, sent.corners);
  EXPECT_EQ(result.mesh.face_begin, sent.face_begin);
  ASSERT_EQ(result.mesh.parts.size(), 2u);
  EXPECT_EQ(result.mesh.parts[0].name, "first");
  EXPECT_EQ(result.mesh.parts[0].node_path, "root/a");
  EXPECT_EQ(result.mesh.parts[1].first_face, 1u);
  EXPECT_EQ(result.mesh.remarks, sent.remarks);
  EXPECT_TRUE(result.mesh.left_out.points && !result.mesh.left_out.lines && result.mesh.left_out.strip_turns);
  EXPECT_EQ(result.mesh.reader, "somebody");
  EXPECT_TRUE(result.mesh.single_precision);
}

TEST(MeshMessage, BringsAnErrorAcross) {
  ReadResult result;
  ASSERT_TRUE(read(message(read_failure("line 3: nonsense")), result));
  EXPECT_FALSE(result.ok);
  EXPECT_EQ(result.error, "line 3: nonsense");
}

TEST(MeshMessage, RejectsEveryTruncation) {
  const std::string whole = message(small_mesh());
  for (std::size_t length = 0; length < whole.size(); ++length) {
    ReadResult result;
    EXPECT_FALSE(read(whole.substr(0, length), result)) << length;
  }
}

TEST(MeshMessage, RejectsMoreThanTheLimit) {
  ReadResult result;
  EXPECT_FALSE(read(message(small_mesh()), result, 100));
}

TEST(MeshMessage, RejectsBrokenFacesAndParts) {
  const auto breaks = [](const auto& change) {
    ReadResult broken = small_mesh();
    change(broken.mesh);
    ReadResult result;
    return !read(message(broken), result);
  };
  EXPECT_TRUE(breaks([](PolygonMesh& m) { m.face_begin = {}; }));
  EXPECT_TRUE(breaks([](PolygonMesh& m) { m.face_begin = {1, 4, 7}; }));
  EXPECT_TRUE(breaks([](PolygonMesh& m) { m.face_begin = {0, 4, 8}; }));
  EXPECT_TRUE(breaks([](PolygonMesh& m) { m.face_begin = {0, 5, 7}; }));
  EXPECT_TRUE(breaks([](PolygonMesh& m) { m.face_begin = {0, 0xFFFFFFF0u, 7}; }));
  EXPECT_TRUE(breaks([](PolygonMesh& m) { m.parts[1].first_face = 0; }));
  EXPECT_TRUE(breaks([](PolygonMesh& m) { m.parts[1].face_count = ~std::uint64_t{0}; }));
  EXPECT_TRUE(breaks([](PolygonMesh& m) { m.parts.pop_back(); }));
  EXPECT_FALSE(breaks([](PolygonMesh&) {}));
}

/// A child with a broken heap can say anything; what is accepted has the promised shape all the same.
TEST(MeshMessage, BelievesNoFlippedByte) {
  const std::string whole = message(small_mesh());
  for (std::size_t at = 0; at < whole.size(); ++at)
    for (int change = 1; change < 256; ++change) {
      std::string bytes = whole;
      bytes[at] = static_cast<char>(bytes[at] ^ change);
      ReadResult result;
      if (read(bytes, result) && result.ok) expect_sound(result.mesh);
    }
}

TEST(MeshMessage, BelievesNoNoise) {
  std::mt19937 random(5);
  for (int i = 0; i < 2000; ++i) {
    std::string bytes = message(small_mesh()).substr(0, 24);
    for (int k = 0; k < 400; ++k) bytes += static_cast<char>(random() % 5 == 0 ? random() : 0);
    ReadResult result;
    if (read(bytes, result) && result.ok) expect_sound(result.mesh);
  }
}

}  // namespace
}  // namespace tandem::build
