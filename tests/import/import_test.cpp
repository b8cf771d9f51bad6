#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <random>
#include <string>

#include "bvhbuild/import/import.h"
#include "bvhbuild/import/mesh_message.h"
#include "common/limited_child.h"
#include "temp_folder.h"

namespace tandem::build {
namespace {

namespace fs = std::filesystem;

/// A folder of its own for each test.
class Import : public ::testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& bytes) const {
    return temporary_.write(name, bytes);
  }

  std::string error(const fs::path& path, Reader reader = Reader::automatic) const {
    ImportOptions options;
    options.reader = reader;
    const ImportResult result = import_mesh(path, options);
    EXPECT_FALSE(result.ok);
    return result.error;
  }

  test::TempFolder temporary_;
  fs::path folder_ = temporary_.path();
};

constexpr const char* kTriangleObj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
constexpr const char* kTrianglePly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
constexpr const char* kTriangleOff = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
constexpr const char* kPentagonObj =
    "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 1 0\nv 0 2 0\nf 1 2 3 4 5\nf 1 2 3\np 1\nl 1 2\n";

/// A node with a mesh, moved by the node above it and turned by its own rotation; a second node has the same
/// mesh.
constexpr const char* kInstancesGltf = R"({
  "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
  "nodes": [
    {"name": "world", "translation": [10, 0, 0], "children": [1, 2]},
    {"name": "left", "mesh": 0, "rotation": [0, 0, 1, 0]},
    {"name": "right", "mesh": 0, "scale": [-2, 2, 2]}],
  "meshes": [{"name": "tile", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
  "buffers": [{"byteLength": 42, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA"}],
  "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
  "accessors": [
    {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
    {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}]})";

TEST_F(Import, NamesWhyAFileCannotBeOpened) {
  EXPECT_EQ(error(folder_ / "absent.obj"), "no such file");
  EXPECT_EQ(error(folder_), "is a folder");
  EXPECT_EQ(error(write("empty.obj", "")), "the file is empty");
  EXPECT_EQ(error("/dev/null"), "is not a regular file");
  const fs::path pipe = folder_ / "pipe.obj";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(error(pipe), "is not a regular file");
}

TEST_F(Import, NamesAMissingPermission) {
  if (geteuid() == 0) GTEST_SKIP() << "root may read everything";
  const fs::path path = write("closed.obj", kTriangleObj);
  fs::permissions(path, fs::perms::none);
  EXPECT_EQ(error(path), "permission denied");
}

TEST_F(Import, ChoosesTheReaderByEndingInAnyCase) {
  for (const auto& [name, bytes] : {std::pair{"a.obj", kTriangleObj},
                                    {"a.OBJ", kTriangleObj},
                                    {"a.Ply", kTrianglePly},
                                    {"a.off", kTriangleOff}}) {
    const ImportResult result = import_mesh(write(name, bytes), {});
    EXPECT_TRUE(result.ok) << name << ": " << result.error;
    EXPECT_EQ(result.mesh.face_count(), 1u);
    EXPECT_EQ(result.mesh.reader.find("tandem"), 0u) << result.mesh.reader;
  }
}

TEST_F(Import, LooksInsideWhenTheEndingSaysNothing) {
  for (const auto& [name, bytes] : {std::pair{"mesh", kTrianglePly}, {"mesh.data", kTriangleOff}}) {
    const ImportResult result = import_mesh(write(name, bytes), {});
    EXPECT_TRUE(result.ok) << name << ": " << result.error;
    EXPECT_EQ(result.mesh.reader.find("tandem"), 0u) << result.mesh.reader;
  }
}

TEST_F(Import, RefusesMotionCaptureAndTreesByName) {
  EXPECT_NE(error(write("walk.bvh", "HIERARCHY\nROOT hip\n")).find("Biovision motion capture"),
            std::string::npos);
  EXPECT_NE(error(write("walk.BVH", "\r\nHIERARCHY\n")).find("Biovision motion capture"), std::string::npos);
  EXPECT_NE(error(write("cow.bvh",
                        "\x89"
                        "BVH\r\n\x1a\n"))
                .find("already a Tandem tree"),
            std::string::npos);
  EXPECT_NE(error(write("cow.obj",
                        "\x89"
                        "BVH\r\n\x1a\n"))
                .find("already a Tandem tree"),
            std::string::npos);
  EXPECT_NE(error(write("x.bvh", "something")).find("neither"), std::string::npos);
}

TEST_F(Import, KeepsToItsOwnReadersWhenTold) {
  EXPECT_NE(error(write("a.dae", "<COLLADA/>"), Reader::tandem).find("OBJ, PLY, STL, OFF and glTF"),
            std::string::npos);
}

TEST_F(Import, DoesNotReadMoreThanTheMemoryLimit) {
  ImportOptions options;
  options.limits.memory_bytes = 10;
  const ImportResult result = import_mesh(write("a.obj", kTriangleObj), options);
  EXPECT_FALSE(result.ok);
  EXPECT_NE(result.error.find("--memory-limit"), std::string::npos);
}

ImportOptions with_assimp(double seconds = 20) {
  ImportOptions options;
  options.reader = Reader::assimp;
  options.time_limit_seconds = seconds;
  return options;
}

TEST_F(Import, TakesPolygonsFromAssimpAsTheyAre) {
  const ImportResult result = import_mesh(write("a.obj", kPentagonObj), with_assimp());
  ASSERT_TRUE(result.ok) << result.error;
  EXPECT_EQ(result.mesh.reader.find("assimp "), 0u);
  EXPECT_TRUE(result.mesh.single_precision);
  EXPECT_EQ(result.mesh.face_begin, (std::vector<std::uint32_t>{0, 5, 8}));
}

TEST_F(Import, AppliesNodeTransformsAndRepeatsInstances) {
  const ImportResult result = import_mesh(write("a.gltf", kInstancesGltf), {});
  ASSERT_TRUE(result.ok) << result.error;
  const PolygonMesh& mesh = result.mesh;
  ASSERT_EQ(mesh.face_count(), 2u);
  ASSERT_EQ(mesh.parts.size(), 2u);
  EXPECT_EQ(mesh.parts[0].name, "tile");
  EXPECT_EQ(mesh.parts[0].node_path, "world/left");
  EXPECT_EQ(mesh.parts[1].node_path, "world/right");
  const std::vector<Point> expected{{10, 0, 0}, {9, 0, 0}, {10, -1, 0}, {10, 0, 0}, {8, 0, 0}, {10, 2, 0}};
  ASSERT_EQ(mesh.points.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i)
    for (int k = 0; k < 3; ++k) EXPECT_EQ(mesh.points[i][k], expected[i][k]) << i << " " << k;
  // The second node mirrors its mesh; the order of the corners stays.
  EXPECT_EQ(mesh.corners, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5}));
}

TEST_F(Import, PassesOnWhatAssimpSays) {
  const ImportResult result =
      import_mesh(write("a.dae", "not a dae file at all, but long enough to look"), {});
  EXPECT_FALSE(result.ok);
  EXPECT_EQ(result.error.find("assimp: "), 0u) << result.error;
}

TEST_F(Import, StopsAssimpWhenItHangs) {
  // assimp 5.2.5 never ends on a PLY file that is cut inside its header. A repaired one may say so instead.
  const fs::path path = write("cut.ply", "ply\nformat ascii 1.0\nelement vertex 8\nproperty float");
  const ImportResult result = import_mesh(path, with_assimp(0.5));
  EXPECT_FALSE(result.ok);
  const bool stopped = result.error == "assimp did not finish within 0.5 s (--time-limit)";
  EXPECT_TRUE(stopped || result.error.find("assimp: ") == 0) << result.error;
}

/// COLLADA of nodes that each show the next one `copies` times; the last one shows a triangle.
std::string nested_collada(int depth, int copies) {
  std::string nodes;
  for (int i = 0; i < depth; ++i) {
    nodes += "<node id=\"n" + std::to_string(i) + "\">";
    for (int k = 0; k < copies; ++k) nodes += "<instance_node url=\"#n" + std::to_string(i + 1) + "\"/>";
    nodes += "</node>";
  }
  nodes += "<node id=\"n" + std::to_string(depth) + "\"><instance_geometry url=\"#g\"/></node>";
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/>
    <library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="9">0 0 0 1 0 0 0 1 0</float_array>
    <technique_common><accessor source="#a" count="3" stride="3"><param name="X" type="float"/>
    <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>
    </library_geometries><library_nodes>)" +
         nodes + R"(</library_nodes><library_visual_scenes><visual_scene id="s"><node id="r">
    <instance_node url="#n0"/></node></visual_scene></library_visual_scenes>
    <scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

TEST_F(Import, BoundsWhatInstancesAddUpToInAssimpsScenes) {
  const fs::path path = write("nested.dae", nested_collada(6, 4));
  ImportOptions options;
  const ImportResult all = import_mesh(path, options);
  EXPECT_EQ(all.mesh.face_count(), 4096u) << all.error;
  options.limits.expansion = 4095 * 5;  // each repeats three vertices, a face and a mesh
  EXPECT_TRUE(import_mesh(path, options).ok);
  options.limits.expansion -= 1;
  EXPECT_EQ(
      import_mesh(path, options).error,
      "instances of meshes repeat 20475 vertices and faces, of 20474 that are allowed (--expansion-limit)");
}

TEST_F(Import, StopsAssimpWhenNodesRepeatNodesWithoutEnd) {
  if (!limits_memory()) GTEST_SKIP() << "sanitizers need the address space that this limits";
  const ImportResult result = import_mesh(write("nested.dae", nested_collada(30, 2)), {});
  EXPECT_EQ(result.error.find("assimp needed more than 79"), 0u) << result.error;
  EXPECT_NE(result.error.find("MiB of memory (--expansion-limit)"), std::string::npos) << result.error;
}

TEST_F(Import, StopsAssimpAtItsMemoryLimit) {
  if (!limits_memory()) GTEST_SKIP() << "sanitizers need the address space that this limits";
  std::string many = "v 0 0 0\n";
  for (int i = 0; i < 200000; ++i) many += "v 1 2 3\n";
  for (int i = 1; i < 200000; ++i) many += "f " + std::to_string(i) + " 1 2\n";
  ImportOptions options = with_assimp();
  options.limits.memory_bytes = 8 << 20;
  const ImportResult result = import_mesh(write("many.obj", many), options);
  EXPECT_FALSE(result.ok);
  EXPECT_EQ(result.error, "assimp needed more than 8 MiB of memory (--memory-limit)");
}

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
