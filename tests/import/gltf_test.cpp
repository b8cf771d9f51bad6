// The scene of a glTF file, in this process, where sanitizers see the reader.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "gltf_file.h"

namespace tandem::build {
namespace {

TEST_F(GltfFile, KeepsTranslationsInFloat64) {
  Gltf file = square({0, 1, 2});
  file.nodes = R"({"mesh": 0, "translation": [5811430.07, -446123.125001, 1e-9]})";
  const PolygonMesh read = mesh(file);
  EXPECT_FALSE(read.single_precision);
  EXPECT_EQ(read.points[0], (Point{5811430.07, -446123.125001, 1e-9}));
  EXPECT_EQ(read.points[1], (Point{1 + 5811430.07, -446123.125001, 1e-9}));
}

TEST_F(GltfFile, AccumulatesNestedTransformsInFloat64) {
  Gltf file = square({0, 1, 2});
  file.nodes =
      R"({"translation": [1e9, 0, 0], "children": [1]}, {"translation": [0.001, 0, 0], "children": [2]},
                  {"mesh": 0, "scale": [0.25, 2, 3]})";
  expect_points(
      mesh(file),
      {{0.001 + 1e9, 0, 0}, {0.25 + (0.001 + 1e9), 0, 0}, {0.001 + 1e9, 2, 0}, {0.25 + (0.001 + 1e9), 2, 0}});
}

TEST_F(GltfFile, ReadsAMatrixAndItsPartsAlike) {
  Gltf file = square({0, 1, 2});
  // A quarter turn about z after a scale by 2, then 10 along x.
  const std::vector<Point> expected{{10, 0, 0}, {10, 2, 0}, {8, 0, 0}, {8, 2, 0}};
  file.nodes = R"({"mesh": 0, "matrix": [0, 2, 0, 0,  -2, 0, 0, 0,  0, 0, 2, 0,  10, 0, 0, 1]})";
  expect_points(mesh(file), expected);
  file.nodes = R"({"mesh": 0, "scale": [2, 2, 2], "rotation": [0, 0, 0.70710678, 0.70710678],
                   "translation": [10, 0, 0]})";
  expect_points(mesh(file), expected, 1e-14);
}

TEST_F(GltfFile, MakesOnePartOfEachMeshAtANodeDepthFirst) {
  Gltf file = square({0, 1, 2, 2, 1, 3});
  file.nodes = R"({"name": "root", "children": [3, 1]}, {"name": "late", "mesh": 0}, {"mesh": 0},
                  {"name": "early", "mesh": 0, "children": [2]})";
  file.meshes = R"({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]})";
  const PolygonMesh read = mesh(file);
  ASSERT_EQ(read.parts.size(), 3u);
  const char* const paths[] = {"root/early", "root/early/nodes[2]", "root/late"};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(read.parts[i].node_path, paths[i]);
    EXPECT_EQ(read.parts[i].name, "meshes[0]");
    EXPECT_EQ(read.parts[i].first_face, 2 * i);
    EXPECT_EQ(read.parts[i].face_count, 2u);
  }
}

TEST_F(GltfFile, ReadsTheDefaultSceneElseTheFirstElseAllNodes) {
  Gltf file = square({0, 1, 2});
  file.nodes =
      R"({"name": "a", "mesh": 0}, {"name": "b", "mesh": 0, "children": [2]}, {"name": "c", "mesh": 0})";
  file.more = R"("scene": 1, "scenes": [{"nodes": [1]}, {"nodes": [0]}])";
  EXPECT_EQ(mesh(file).parts.at(0).node_path, "a");
  EXPECT_EQ(joined(mesh(file).remarks), "scenes[1] of 2 is read\n");
  file.more = R"("scenes": [{"nodes": [1]}, {"nodes": [0]}])";
  EXPECT_EQ(mesh(file).parts.at(0).node_path, "b");
  file.more = R"("extras": 0)";
  EXPECT_EQ(mesh(file).parts.size(), 3u);
  file.more = R"("scenes": [{}])";
  EXPECT_EQ(mesh(file).face_count(), 0u);
  file.more = R"("scene": 1, "scenes": [{"nodes": [1]}])";
  EXPECT_EQ(error(file), "its default scene is scenes[1] of 1");
}

TEST_F(GltfFile, RefusesTransformsThatAreNoneAndNodesThatAreNoTree) {
  Gltf file = square({0, 1, 2});
  for (const auto& [nodes, words] :
       {std::pair{R"({"mesh": 0, "matrix": [1, 0, 0]})", "nodes[0].matrix has 3 numbers, not 16"},
        {R"({"mesh": 0}, {"rotation": [0, 0, 0, 0]})", "nodes[1].rotation is zero, which is no rotation"},
        {R"({"mesh": 0, "scale": [1, "1", 1]})", "nodes[0].scale[1] is not a number"},
        {R"({"mesh": 0, "matrix": [1, 0, 0, 1,  0, 1, 0, 0,  0, 0, 1, 0,  0, 0, 0, 1]})",
         "matrix is not affine"},
        {R"({"children": [0]})", "is reached twice"},
        {R"({"children": [1]}, {"mesh": 0, "children": [0]})", "is reached twice"},
        {R"({"children": [1, 2]}, {"children": [2]}, {"mesh": 0})", "is reached twice"},
        {R"({"children": [1]})", "nodes[1] is named, but there are 1"},
        {R"({"mesh": 7})", "nodes[0] names meshes[7] of 1"}}) {
    file.nodes = nodes;
    expect_error(file, words);
  }
  file.nodes = R"({"children": [1]}, {"mesh": 0, "children": [0]})";
  file.more = R"("extras": {})";
  expect_error(file, "its nodes are a cycle");
}

TEST_F(GltfFile, WalksChainsOfNodesDeeperThanAStack) {
  Gltf file = square({0, 1, 2});
  constexpr int kDepth = 30000;
  file.nodes.clear();
  for (int i = 1; i <= kDepth; ++i)
    file.nodes += R"({"translation": [1, 0, 0], "children": [)" + std::to_string(i) + "]},";
  file.nodes += R"({"mesh": 0})";
  EXPECT_EQ(mesh(file).points[0], (Point{kDepth, 0, 0}));
}

TEST_F(GltfFile, BoundsWhatInstancesAddUpTo) {
  // A mesh of 2^20 vertices, all zero, which takes no bytes in the file, at many nodes.
  Gltf file;
  file.more = R"("extras": 0)";
  file.meshes = R"({"primitives": [{"attributes": {"POSITION": 0}}]})";
  file.accessors = R"({"componentType": 5126, "count": 1048576, "type": "VEC3"})";
  for (int i = 0; i < 100; ++i) file.nodes += R"(, {"mesh": 0})";
  expect_error(file, "more than 4000000 vertices and faces beyond what its");
  const std::uint64_t endless = std::uint64_t{1} << 60;
  EXPECT_EQ(read(file.json(), {std::uint64_t{1} << 30, endless}).error,
            "its triangles, counting each instance of a mesh, take 1026 MiB, more than the memory limit "
            "(--memory-limit)");
  for (int i = 0; i < 4000; ++i) file.nodes += R"(, {"mesh": 0})";
  const ReadResult result = read(file.json(), {endless, endless});
  EXPECT_NE(result.error.find("more than 4294967294 vertices or corners"), std::string::npos) << result.error;
}

TEST_F(GltfFile, CountsPrimitivesThatMakeNoTriangleAmongWhatInstancesAddUpTo) {
  Gltf file;
  file.more = R"("extras": 0)";
  for (int i = 0; i < 4000; ++i) file.nodes += R"(, {"mesh": 0})";
  file.accessors = R"({"componentType": 5126, "count": 0, "type": "VEC3"})";
  std::string primitives = R"({"attributes": {"POSITION": 0}})";
  for (int i = 0; i < 5000; ++i) primitives += R"(, {"attributes": {"POSITION": 0}})";
  file.meshes = R"({"primitives": [)" + primitives + "]}";
  expect_error(file, "(--expansion-limit)");
}

TEST_F(GltfFile, BoundsWhatCountsPromiseWithoutAByte) {
  Gltf file;
  file.accessors = R"({"componentType": 5126, "count": 100000000, "type": "VEC3"},
                      {"componentType": 5125, "count": 300000000, "type": "SCALAR"})";
  expect_error(file,
               "instances of meshes, or counts without data, make more than 4000000 vertices and faces");
  file.accessors = R"({"componentType": 5126, "count": 9007199254740991, "type": "VEC3"},
                      {"componentType": 5125, "count": 3, "type": "SCALAR"})";
  expect_error(file, "more than 4294967294 vertices");
}

TEST_F(GltfFile, AllowsExactlyWhatItsBytesAndTheLimitAddUpTo) {
  Gltf file;
  file.accessors = R"({"componentType": 5126, "count": 5000, "type": "VEC3"},
                      {"componentType": 5125, "count": 300, "type": "SCALAR"})";
  const std::string json = file.json();
  const std::uint64_t elements = 5000 + 100 + 1;  // vertices, triangles, primitives
  EXPECT_TRUE(read(json, {1 << 20, elements - json.size()}).ok);
  EXPECT_FALSE(read(json, {1 << 20, elements - json.size() - 1}).ok);
  EXPECT_TRUE(read(json + std::string(elements - json.size(), ' '), {1 << 20, 0}).ok);
}

TEST_F(GltfFile, NeverRefusesWhatItsBytesHold) {
  // The smallest that elements can be: bytes for coordinates and for the indices of a strip.
  const std::size_t count = 200000;
  Gltf file;
  file.meshes = R"({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 5}]})";
  file.accessors = R"({"bufferView": 0, "componentType": 5120, "count": 200, "type": "VEC3"},
                      {"bufferView": 1, "componentType": 5121, "count": 200000, "type": "SCALAR"})";
  file.views = R"({"buffer": 0, "byteLength": 600}, {"buffer": 0, "byteOffset": 600, "byteLength": 200000})";
  file.buffers = R"({"byteLength": 200600})";
  std::string binary(600 + count, '\0');
  for (std::size_t i = 0; i < count; ++i) binary[600 + i] = static_cast<char>(i % 200);
  const ReadResult indexed = read_gltf(glb(file.json(), binary), folder_, {1 << 26, 0});
  EXPECT_EQ(indexed.mesh.face_count(), count - 2) << indexed.error;
  file.meshes = R"({"primitives": [{"attributes": {"POSITION": 0}, "mode": 5}]})";
  file.accessors = R"({"bufferView": 0, "componentType": 5120, "count": 66000, "type": "VEC3"})";
  file.views = R"({"buffer": 0, "byteLength": 198000})";
  const ReadResult plain = read_gltf(glb(file.json(), binary), folder_, {1 << 26, 0});
  EXPECT_EQ(plain.mesh.face_count(), 65998u) << plain.error;
}

TEST_F(GltfFile, RemarksPosesThatAreNotApplied) {
  Gltf file = square({0, 1, 2});
  for (const auto& [nodes, remarks] :
       {std::pair{R"({"name": "arm", "mesh": 0, "skin": 0})",
                  "nodes[0] 'arm' has a skin; its mesh is read unposed\n"},
        {R"({"name": "face", "mesh": 0, "weights": [0, 0.5]})",
         "nodes[0] 'face' has a morphed mesh; its mesh is read unmorphed\n"},
        {R"({"mesh": 0, "weights": [0]})", ""},
        {R"({"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {}}}})",
         "nodes[0] repeats its mesh by EXT_mesh_gpu_instancing; it is read once\n"}}) {
    file.nodes = nodes;
    EXPECT_EQ(joined(mesh(file).remarks), remarks);
  }
}

TEST_F(GltfFile, ReadsTrianglesStripsAndFans) {
  EXPECT_EQ(faces_of(mesh(square({0, 1, 2, 2, 1, 3}))), (std::vector<Face>{{0, 1, 2}, {2, 1, 3}}));
  EXPECT_EQ(faces_of(mesh(square({0, 1, 2, 3}, "5"))), (std::vector<Face>{{0, 1, 2}, {2, 1, 3}}));
  EXPECT_EQ(faces_of(mesh(square({0, 1, 3, 2}, "6"))), (std::vector<Face>{{1, 3, 0}, {3, 2, 0}}));
}

TEST_F(GltfFile, TakesVerticesInOrderWithoutIndices) {
  for (const auto& [mode, faces] : {std::pair<std::string, std::vector<Face>>{"4", {{0, 1, 2}}},
                                    {"5", {{0, 1, 2}, {2, 1, 3}}},
                                    {"6", {{1, 2, 0}, {2, 3, 0}}}}) {
    Gltf file = square({});
    file.meshes = R"({"primitives": [{"attributes": {"POSITION": 0}, "mode": )" + mode + "}]}";
    EXPECT_EQ(faces_of(mesh(file)), faces) << mode;
  }
}

TEST_F(GltfFile, PassesOverPointsAndLines) {
  for (const char* mode : {"0", "1", "2", "3"}) {
    const PolygonMesh read = mesh(square({0, 1, 2, 9}, mode));
    EXPECT_EQ(read.face_count(), 0u);
    EXPECT_EQ(read.points.size(), 0u);
    EXPECT_TRUE(read.remarks.empty());
  }
  expect_error(square({0, 1, 2}, "7"), "mode 7 is none of glTF");
}

TEST_F(GltfFile, LeavesOutStripTrianglesThatOnlyLeadElsewhere) {
  // Two strips joined by repeated vertices; the turn of the second one continues.
  EXPECT_EQ(faces_of(mesh(square({0, 1, 2, 2, 3, 3, 1, 0}, "5"))), (std::vector<Face>{{0, 1, 2}, {1, 3, 0}}));
}

TEST_F(GltfFile, CountsDegenerateTrianglesAsFaces) {
  EXPECT_EQ(mesh(square({0, 0, 1, 1, 2, 3})).face_count(), 2u);
}

TEST_F(GltfFile, RemarksVerticesThatMakeNoTriangle) {
  EXPECT_EQ(joined(mesh(square({0, 1, 2, 3, 1})).remarks),
            "meshes[0] 'm', primitive 0: the last 2 of 5 indices make no triangle\n");
  const PolygonMesh strip = mesh(square({0, 1}, "5"));
  EXPECT_EQ(strip.face_count(), 0u);
  EXPECT_EQ(joined(strip.remarks), "meshes[0] 'm', primitive 0: the last 2 of 2 indices make no triangle\n");
  EXPECT_EQ(mesh(square({}, "6")).remarks.size(), 0u);
}

TEST_F(GltfFile, PassesOnIndicesOutOfRange) {
  const PolygonMesh read = mesh(square({0, 1, 4, 2, 1, 3}));
  EXPECT_EQ(faces_of(read), (std::vector<Face>{{0, 1, kNoVertex}, {2, 1, 3}}));
  EXPECT_EQ(joined(read.remarks), "meshes[0] 'm', primitive 0: index 4 of 4 vertices\n");
  const PolygonMesh many = mesh(square(std::vector<std::uint16_t>(300, 9)));
  EXPECT_EQ(many.face_count(), 100u);
  EXPECT_EQ(many.remarks.size(), 4u);
  // In a strip, two different ones are no repeated vertex.
  EXPECT_EQ(faces_of(mesh(square({0, 8, 9}, "5"))), (std::vector<Face>{{0, kNoVertex, kNoVertex}}));
}

TEST_F(GltfFile, NeverTakesAnIndexForAVertexOfTheNextPrimitive) {
  Gltf file = square({0, 1, 4});
  file.meshes = R"({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1},
                                   {"attributes": {"POSITION": 2}, "indices": 1}]})";
  file.accessors += std::string(", ") + kSquareAccessor;
  EXPECT_EQ(faces_of(mesh(file)), (std::vector<Face>{{0, 1, kNoVertex}, {4, 5, kNoVertex}}));
}

TEST_F(GltfFile, TakesNoRestartValueForAVertex) {
  for (const auto& [type, bytes] : {std::pair{"5121", bytes_of<std::uint8_t>({0, 1, 255})},
                                    {"5123", bytes_of<std::uint16_t>({0, 1, 65535})},
                                    {"5125", bytes_of<std::uint32_t>({0, 1, 4294967295u})}}) {
    Gltf file = square({});
    file.accessors =
        R"({"componentType": 5126, "count": 70000, "type": "VEC3"}, {"bufferView": 0, "componentType": )" +
        std::string(type) + R"(, "count": 3, "type": "SCALAR"})";
    file.views = R"({"buffer": 0, "byteLength": )" + std::to_string(bytes.size()) + "}";
    file.buffers = data_buffer(bytes);
    const PolygonMesh read = mesh(file);
    EXPECT_EQ(faces_of(read), (std::vector<Face>{{0, 1, kNoVertex}})) << type;
    EXPECT_NE(joined(read.remarks).find("the largest of its type"), std::string::npos);
  }
}

TEST_F(GltfFile, SharesVerticesAmongThePrimitivesOfAMesh) {
  Gltf file = square({0, 1, 2});
  file.meshes = R"({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1},
                                   {"attributes": {"POSITION": 0}, "indices": 1}]})";
  const PolygonMesh read = mesh(file);
  EXPECT_EQ(read.points.size(), 4u);
  EXPECT_EQ(faces_of(read), (std::vector<Face>{{0, 1, 2}, {0, 1, 2}}));
}

TEST_F(GltfFile, RemarksPrimitivesWithoutPositions) {
  Gltf file = square({0, 1, 2});
  file.meshes = R"({"name": "m", "primitives": [{"attributes": {"NORMAL": 0}},
                                                {"attributes": {"POSITION": 0}, "indices": 1}]})";
  const PolygonMesh read = mesh(file);
  EXPECT_EQ(read.face_count(), 1u);
  EXPECT_EQ(joined(read.remarks), "meshes[0] 'm', primitive 0 has no POSITION and is passed over\n");
  file.meshes = R"({"primitives": [{"indices": 1}, {"attributes": {"POSITION": 0}, "indices": 1}]})";
  EXPECT_EQ(joined(mesh(file).remarks), "meshes[0], primitive 0 has no POSITION and is passed over\n");
}

TEST_F(GltfFile, ReadsQuantisedPositions) {
  const std::string vec3 = R"("type": "VEC3", "componentType": )";
  const std::vector<Point> corners{{1, 0, 0}, {0, 1, 0}, {0, 0, -1}};
  expect_points(mesh(triangle(bytes_of<std::int8_t>({127, 0, 0, 0, 127, 0, 0, 0, -128}),
                              vec3 + R"(5120, "normalized": true)")),
                corners);
  expect_points(mesh(triangle(bytes_of<std::int16_t>({32767, 0, 0, 0, 32767, 0, 0, 0, -32767}),
                              vec3 + R"(5122, "normalized": true)")),
                corners);
  expect_points(mesh(triangle(bytes_of<std::uint8_t>({255, 51, 0, 0, 0, 0, 0, 0, 0}),
                              vec3 + R"(5121, "normalized": true)")),
                {{1, 0.2, 0}, {0, 0, 0}, {0, 0, 0}});
  expect_points(mesh(triangle(bytes_of<std::uint16_t>({65535, 13107, 0, 0, 0, 0, 0, 0, 0}),
                              vec3 + R"(5123, "normalized": true)")),
                {{1, 0.2, 0}, {0, 0, 0}, {0, 0, 0}});
  expect_points(mesh(triangle(bytes_of<std::int16_t>({-300, 7, 0, 0, 0, 0, 0, 0, 0}), vec3 + "5122")),
                {{-300, 7, 0}, {0, 0, 0}, {0, 0, 0}});
  expect_points(mesh(triangle(bytes_of<double>({1e-300, 0.1, 1e300, 0, 0, 0, 0, 0, 0}), vec3 + "5130")),
                {{1e-300, 0.1, 1e300}, {0, 0, 0}, {0, 0, 0}});
}

TEST_F(GltfFile, FollowsStridesAndOffsetsToTheLastByte) {
  const std::string bytes =
      bytes_of<float>({9, 1, 2, 3, 9, 4, 5, 6, 9, 7, 8, 10});  // the last element ends with the view
  const std::string accessor = R"("byteOffset": 4, "componentType": 5126, "type": "VEC3")";
  expect_points(mesh(triangle(bytes, accessor, R"(, "byteStride": 16)")), {{1, 2, 3}, {4, 5, 6}, {7, 8, 10}});
  expect_error(triangle(bytes.substr(0, 47), accessor, R"(, "byteStride": 16)"),
               "accessors[0] ends at byte 48 of bufferViews[0], which has 47");
  expect_error(triangle(bytes, accessor, R"(, "byteStride": 8)"),
               "has a stride of 8 bytes, an element of accessors[0] has 12");
}

TEST_F(GltfFile, ReadsSparseAccessors) {
  // Element 1 of the square moves; with nothing under it, the others are zero.
  Gltf file = square({0, 1, 2});
  const std::string sparse = R"("componentType": 5126, "count": 4, "type": "VEC3", "sparse": {"count": 1,
      "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": 2, "byteOffset": 4}}})";
  const std::string indices = R"(, {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"})";
  const auto with_element = [&](char element, const std::string& base) {
    file.accessors = base + sparse + indices;
    const std::string bytes = kSquare + bytes_of<std::uint16_t>({0, 1, 2, 0}) +
                              std::string{element, 0, 0, 0} + bytes_of<float>({7, 8, 9});
    file.views = R"({"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 6},
                    {"buffer": 0, "byteOffset": 56, "byteLength": 16})";
    file.buffers = data_buffer(bytes);
    return file;
  };
  expect_points(mesh(with_element(1, R"({"bufferView": 0, )")), {{0, 0, 0}, {7, 8, 9}, {0, 1, 0}, {1, 1, 0}});
  expect_points(mesh(with_element(3, "{")), {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {7, 8, 9}});
  expect_error(with_element(4, "{"), "accessors[0].sparse replaces element 4 of 4");
  file.views = R"({"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 6},
                  {"buffer": 0, "byteOffset": 56, "byteLength": 15})";
  expect_error(file, "accessors[0].sparse.values ends at byte 16 of bufferViews[2], which has 15");
  file.accessors = R"({"componentType": 5126, "count": 4, "type": "VEC3", "sparse": {"count": 5,
      "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": 2}}})" +
                   indices;
  expect_error(file, "accessors[0].sparse replaces 5 elements of 4");
}

TEST_F(GltfFile, RefusesAccessorsOutsideTheirBuffers) {
  Gltf file = square({0, 1, 2});
  file.views = R"({"buffer": 0, "byteLength": 55}, {"buffer": 0, "byteOffset": 48, "byteLength": 6})";
  expect_error(file, "bufferViews[0] ends at byte 55 of buffers[0], which has 54");
  file.views = R"({"buffer": 3, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 6})";
  expect_error(file, "bufferViews[0] names buffers[3] of 1");
  file.views = R"({"buffer": 0, "byteLength": 48})";
  expect_error(file, "accessors[1] names bufferViews[1] of 1");
  file = square({0, 1, 2});
  for (const char* offset : {"9007199254740991", "1125899906842624", "48", "1"}) {
    file.accessors = std::string(R"({"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
        "byteOffset": )") +
                     offset + R"(}, {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"})";
    expect_error(file, "meshes[0] 'm', primitive 0: accessors[0]");
  }
}

TEST_F(GltfFile, RefusesAccessorsOfAnotherType) {
  Gltf file = square({0, 1, 2});
  const std::string index = R"(, {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"})";
  file.accessors = R"({"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC2"})" + index;
  expect_error(file, "accessors[0] has 2 numbers in an element, where POSITION needs 3");
  file.accessors = R"({"bufferView": 0, "componentType": 5125, "count": 4, "type": "VEC3"})" + index;
  expect_error(file, "accessors[0] has numbers of type 5125, which POSITION cannot have");
  file.accessors = std::string(kSquareAccessor) +
                   R"(, {"bufferView": 1, "componentType": 5126, "count": 1, "type": "SCALAR"})";
  expect_error(file, "accessors[1] has numbers of type 5126, which an index cannot have");
  file.accessors = kSquareAccessor;
  expect_error(file, "an index names accessors[1] of 1");
  file = square({0, 1, 2});
  file.meshes = R"({"primitives": [{"attributes": {"POSITION": 9}}]})";
  expect_error(file, "POSITION names accessors[9] of 2");
  file.accessors = R"({"bufferView": 0, "componentType": 5126, "type": "VEC3"})";
  EXPECT_EQ(error(file), "accessors[0].count is missing");
}

TEST_F(GltfFile, TakesZerosForAnAccessorWithoutABufferView) {
  Gltf file = square({0, 1, 2});
  file.accessors = R"({"componentType": 5126, "count": 2, "type": "VEC3"},
                      {"componentType": 5123, "count": 3, "type": "SCALAR"})";
  const PolygonMesh read = mesh(file);
  expect_points(read, {{0, 0, 0}, {0, 0, 0}});
  EXPECT_EQ(faces_of(read), (std::vector<Face>{{0, 0, 0}}));
}

}  // namespace
}  // namespace tandem::build
