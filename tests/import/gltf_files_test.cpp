// Tests what a glTF file is made of: JSON, containers, buffers.
#include <gtest/gtest.h>
#if !defined(_WIN32)
#include <sys/stat.h>
#endif

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "bvhbuild/import/gltf_model.h"
#include "bvhbuild/import/import.h"
#include "gltf_file.h"

namespace tandem::build {
namespace {

TEST_F(GltfFile, NamesMembersOfTheWrongType) {
  Gltf file = square({0, 1, 2});
  for (const auto& [nodes, words] :
       {std::pair{R"({}, {"mesh": "0"})", "nodes[1].mesh is not an unsigned integer"},
        {R"({"mesh": 4294967296})", "nodes[0].mesh is not an unsigned integer below 2147483648"},
        {R"({"mesh": -1})", "nodes[0].mesh is not"},
        {R"({"mesh": 0.0})", "nodes[0].mesh is not"},
        {R"({"mesh": 0, "children": 1})", "nodes[0].children is not an array"},
        {R"({"mesh": 0, "children": [1, [2]]})", "nodes[0].children[1] is not"},
        {"5", "nodes[0] is not an object"}}) {
    file.nodes = nodes;
    expect_error(file, words);
  }
  file = square({0, 1, 2});
  file.nodes = R"({"name": null, "mesh": 0, "rotation": null, "extras": {"mesh": "x", "nodes[].mesh": "y"}})";
  EXPECT_EQ(mesh(file).face_count(), 1u);
}

TEST_F(GltfFile, RefusesWhatIsNoGltf) {
  for (const auto& [text, words] :
       {std::pair{"hello", "its JSON cannot be read: parse error at line 1, column 1"},
        {"[]", "its JSON is not an object"},
        {"{}", "is no glTF: its JSON names no asset.version"},
        {R"({"asset": {"version": 2}})", "asset.version is not a text"},
        {R"({"asset": {"version": "3.0"}})", "is glTF '3.0'; Tandem reads glTF 2"},
        {R"({"asset": {"version": "1.0"}})", "is glTF 1"},
        {"{\"asset\": {\"version\": \"2.0\", \"x\": \"\xFF\"}}", "its JSON cannot be read"}}) {
    const ReadResult result = read(text);
    EXPECT_FALSE(result.ok);
    EXPECT_NE(result.error.find(words), std::string::npos) << result.error;
  }
}

TEST_F(GltfFile, RefusesJsonNestedWithoutEnd) {
  Gltf file = square({0, 1, 2});
  file.more = R"("extras": )" + std::string(100000, '[') + std::string(100000, ']');
  EXPECT_EQ(error(file), "its JSON is nested more than 500 deep");
}

TEST_F(GltfFile, OpensNoImages) {
  Gltf file = square({0, 1, 2});
  file.more = R"("images": [{"uri": "absent.png"}, {"uri": "data:image/png;base64,AAAA"},
                            {"bufferView": 0, "mimeType": "image/jpeg"}, {"bufferView": 77}, {}, 5],
                 "textures": [{"source": 0}])";
  EXPECT_EQ(mesh(file).face_count(), 1u);
  file.more = R"("images": "none")";
  EXPECT_EQ(mesh(file).face_count(), 1u);
}

TEST_F(GltfFile, NamesRequiredExtensionsThatHideTriangles) {
  Gltf file = square({0, 1, 2});
  const std::string scene = file.more;
  for (const char* name :
       {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "EXT_mesh_gpu_instancing"}) {
    file.more = scene + R"(, "extensionsRequired": [")" + name + "\"]";
    expect_error(file, name);
  }
  file.more = scene + R"(, "extensionsRequired": ["KHR_mesh_quantization", "KHR_materials_unlit", "FB_odd"])";
  EXPECT_EQ(joined(mesh(file).remarks), "requires the extension 'FB_odd', which is passed over\n");
}

TEST_F(GltfFile, NamesDracoWhereOnlyItHoldsTheTriangles) {
  Gltf file = square({0, 1, 2});
  file.more += R"(, "extensionsUsed": ["KHR_draco_mesh_compression"])";
  file.meshes = R"({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1,
      "extensions": {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}}]})";
  EXPECT_EQ(mesh(file).face_count(), 1u);  // the plain accessors are there too
  file.accessors = R"({"componentType": 5126, "count": 4, "type": "VEC3"},
                      {"componentType": 5123, "count": 3, "type": "SCALAR"})";
  expect_error(file, "KHR_draco_mesh_compression");
}

TEST_F(GltfFile, ReadsBuffersBesideIt) {
  Gltf file = square({0, 1, 2});
  const std::string bytes = kSquare + bytes_of<std::uint16_t>({0, 1, 2});
  write("a b+c.bin", bytes + "more than the buffer has");
  file.buffers = R"({"byteLength": 54, "uri": "a%20b+c.bin"})";
  EXPECT_EQ(mesh(file).face_count(), 1u);
  fs::create_directory(folder_ / "sub");
  write("sub/d.bin", bytes);
  file.buffers = R"({"byteLength": 54, "uri": "sub/../sub/d.bin"})";
  EXPECT_EQ(mesh(file).face_count(), 1u);
}

TEST_F(GltfFile, KnowsEachBufferByItsPlace) {
  // The second buffer lies in a file, between two that do not.
  Gltf file = square({0, 1, 2});
  write("b.bin", kSquare);
  file.buffers = data_buffer(bytes_of<std::uint16_t>({0, 1, 2})) +
                 R"(, {"byteLength": 48, "uri": "b.bin"}, )" + data_buffer("other");
  file.views = R"({"buffer": 1, "byteLength": 48}, {"buffer": 0, "byteLength": 6})";
  expect_points(mesh(file), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}});
}

TEST_F(GltfFile, NamesBuffersThatAreNotThere) {
  Gltf file = square({0, 1, 2});
  file.buffers = R"({"byteLength": 54, "uri": "wheel.bin", "name": "wheel"})";
  EXPECT_EQ(error(file), "buffers[0] 'wheel': 'wheel.bin': no such file");
  write("wheel.bin", "short");
  EXPECT_EQ(error(file), "buffers[0] 'wheel': 'wheel.bin': holds 5 bytes, 54 are needed");
#if !defined(_WIN32)
  ASSERT_EQ(mkfifo((folder_ / "pipe.bin").c_str(), 0600), 0);
  file.buffers = R"({"byteLength": 54, "uri": "pipe.bin"})";
  EXPECT_EQ(error(file), "buffers[0]: 'pipe.bin': is not a regular file");
#endif
  file.buffers = R"({"byteLength": 54, "uri": "https://example.org/wheel.bin"})";
  expect_error(file, "is not a file beside the glTF");
  file.buffers = R"({"byteLength": 54, "uri": "data:text/html,AAAA"})";
  expect_error(file, "is not the kind of data that a buffer has");
  file.buffers = R"({"byteLength": 54})";
  EXPECT_EQ(error(file), "buffers[0] has no uri, so its bytes are nowhere");
  file.buffers = R"({"byteLength": 54, "uri": "data:application/octet-stream;base64,AAA*AAAA"})";
  EXPECT_EQ(error(file), "buffers[0]: its data URI holds 2 bytes, its byteLength says 54");
  file.buffers = R"({"uri": "wheel.bin"})";
  EXPECT_EQ(error(file), "buffers[0] has no byteLength");
}

TEST_F(GltfFile, ReadsBuffersInItsFolderAndBelowAlone) {
  fs::create_directories(folder_ / "scene/below");
  const std::string bytes = kSquare + bytes_of<std::uint16_t>({0, 1, 2});
  write("outside.bin", bytes);
  write("scene/inside.bin", bytes);
  std::error_code no_links;
  fs::create_symlink("../outside.bin", folder_ / "scene/link.bin", no_links);
  if (no_links) GTEST_SKIP() << "no symbolic links here";
  fs::create_symlink("..", folder_ / "scene/up");
  fs::create_symlink("../inside.bin", folder_ / "scene/below/link.bin");
  ReadLimits anywhere;
  anywhere.outside_files = true;
  const auto read_uri = [&](const std::string& uri, const ReadLimits& limits) {
    Gltf file = square({0, 1, 2});
    file.buffers = R"({"byteLength": 54, "uri": ")" + uri + "\"}";
    return read_gltf(file.json(), folder_ / "scene", limits);
  };
  for (const std::string uri :
       {"inside.bin", "./inside.bin", "below/../inside.bin", "below/link.bin", "up/scene/inside.bin"}) {
    const ReadResult result = read_uri(uri, {});
    EXPECT_EQ(result.error, "") << uri;
    ASSERT_EQ(result.files.size(), 1u) << uri;
    EXPECT_TRUE(fs::equivalent(result.files[0], folder_ / "scene/inside.bin"));
  }
  const std::string absolute = (folder_ / "outside.bin").string();
  for (const std::string& uri : {std::string("../outside.bin"), std::string("%2e%2e/outside.bin"),
                                 std::string("below/../../outside.bin"), std::string("link.bin"),
                                 std::string("up/outside.bin"), absolute}) {
    EXPECT_TRUE(read_uri(uri, {}).error.ends_with(
        ": lies outside the folder of the file that names it (--allow-outside-files)"))
        << read_uri(uri, {}).error;
    EXPECT_EQ(read_uri(uri, anywhere).error, "") << uri;
  }
  EXPECT_EQ(
      read_uri("../none.bin", {}).error,
      "buffers[0]: '../none.bin': lies outside the folder of the file that names it (--allow-outside-files)");
}

TEST_F(GltfFile, ReadsNoMoreOfFilesThanTheMemoryLimit) {
  Gltf file = square({0, 1, 2});
  write("a.bin", std::string(60000, 'a'));
  write("b.bin", std::string(60000, 'b'));
  file.buffers = R"({"byteLength": 60000, "uri": "a.bin"}, {"byteLength": 60000, "uri": "b.bin"})";
  EXPECT_TRUE(read(file.json(), ReadLimits{120000}).ok);
  EXPECT_EQ(read(file.json(), ReadLimits{119999}).error,
            "buffers[1]: 'b.bin': its bytes take more than the memory limit (--memory-limit)");
}

TEST_F(GltfFile, ReadsAFileOnceWhateverNamesItsBuffersGiveIt) {
  Gltf file = square({0, 1, 2});
  write("a.bin", kSquare + bytes_of<std::uint16_t>({0, 1, 2}));
  fs::create_hard_link(folder_ / "a.bin", folder_ / "b.bin");
  file.buffers = R"({"byteLength": 48, "uri": "a.bin"}, {"byteLength": 54, "uri": "./a.bin"},
                    {"byteLength": 1, "uri": "b.bin"})";
  file.views = R"({"buffer": 0, "byteLength": 48}, {"buffer": 1, "byteOffset": 48, "byteLength": 6})";
  const ReadResult result = read(file.json(), {std::uint64_t{1} << 20});
  EXPECT_EQ(faces_of(result.mesh), (std::vector<Face>{{0, 1, 2}})) << result.error;
  for (int i = 0; i < 100; ++i) {
    write("c.bin", std::string(60000, 'c'));
    file.buffers += R"(, {"byteLength": 60000, "uri": "c.bin"})";
  }
  EXPECT_TRUE(read(file.json(), ReadLimits{120000}).ok);
}

TEST_F(GltfFile, ReadsDataUrisOfAnyKindThatAreLongEnough) {
  Gltf file = square({0, 1, 2});
  const std::string bytes = kSquare + bytes_of<std::uint16_t>({0, 1, 2});
  for (const char* kind : {"application/octet-stream", "application/gltf-buffer", "text/plain;x=y", ""})
    for (const std::string& text : {base64(bytes), base64(bytes + "more"), base64(bytes) + "*"}) {
      file.buffers = R"({"byteLength": 54, "uri": "data:)" + std::string(kind) + ";base64," + text + "\"}";
      EXPECT_EQ(mesh(file).face_count(), 1u) << kind;
    }
}

TEST(GltfBuffer, DecodesBase64UpToTheFirstOtherSign) {
  const auto decoded = [](std::string_view text, std::uint64_t most_bytes = 100) {
    const std::vector<char> bytes = base64_decoded(text, most_bytes);
    return std::string(bytes.begin(), bytes.end());
  };
  EXPECT_EQ(decoded("Zm9vYmFy"), "foobar");
  EXPECT_EQ(decoded("Zm9vYmE="), "fooba");
  EXPECT_EQ(decoded("Zm9vYmE"), "fooba");
  EXPECT_EQ(decoded("Zm9vYg=="), "foob");
  EXPECT_EQ(decoded("Zm9vY"), "foo");
  EXPECT_EQ(decoded("Zm9v-YmFy"), "foo");
  EXPECT_EQ(decoded("+/+/"), "\xFB\xFF\xBF");
  EXPECT_EQ(decoded("Zm9vYmFy", 4), "foob");
  EXPECT_EQ(decoded("Zm9vYmFy", 0), "");
  EXPECT_EQ(decoded(""), "");
  std::string all;
  for (int c = 0; c < 256; ++c) all += static_cast<char>(c);
  EXPECT_EQ(decoded(base64(all), 1000), all);
}

TEST(GltfBuffer, DecodesPercentEscapesAndNothingElse) {
  EXPECT_EQ(percent_decoded("a%20b+c%2F%c3%A9"), "a b+c/\xC3\xA9");
  for (const char* plain : {"", "%", "a%", "%2", "%g0", "%0g", "100%25%"})
    EXPECT_EQ(percent_decoded(plain), plain == std::string("100%25%") ? "100%%" : plain);
  EXPECT_EQ(percent_decoded("%41"), "A");
}

std::string square_glb() {
  Gltf file = square({0, 1, 2, 2, 1, 3});
  file.buffers = R"({"byteLength": 60})";
  return glb(file.json(), kSquare + bytes_of<std::uint16_t>({0, 1, 2, 2, 1, 3}));
}

TEST_F(GltfFile, ReadsBinaryContainers) {
  const ReadResult result = read(square_glb());
  ASSERT_TRUE(result.ok) << result.error;
  EXPECT_EQ(faces_of(result.mesh), (std::vector<Face>{{0, 1, 2}, {2, 1, 3}}));
  EXPECT_TRUE(read(glb(square({0, 1, 2}).json(), "")).ok);
}

std::string word(std::size_t value) {
  return bytes_of<std::uint32_t>({static_cast<std::uint32_t>(value)});
}

/// A container of these chunks as they are, each with its type.
std::string container(const std::vector<std::pair<std::string, std::string>>& chunks) {
  std::string bytes;
  for (const auto& [type, chunk] : chunks) bytes += word(chunk.size()) + type + chunk;
  return "glTF" + word(2) + word(12 + bytes.size()) + bytes;
}

TEST_F(GltfFile, ReadsChunksThatAreNotPaddedAndPassesOverOthers) {
  Gltf file = square({0, 1, 2});
  file.buffers = R"({"byteLength": 54})";
  const std::string bytes = kSquare + bytes_of<std::uint16_t>({0, 1, 2}), bin("BIN\0", 4);
  for (std::string json = file.json(); json.size() < file.json().size() + 4; json += ' ') {
    EXPECT_EQ(read(container({{"JSON", json}, {bin, bytes}})).error, "") << json.size();
    EXPECT_EQ(read(container({{"JSON", json}, {"MORE", "12345"}, {bin, bytes}, {"LAST", ""}})).error, "");
    EXPECT_EQ(read(container({{"JSON", json}, {"MORE", bytes}})).error,
              "buffers[0]: the binary chunk holds 0 bytes, its byteLength says 54");
  }
  EXPECT_EQ(read(container({{bin, bytes}, {"JSON", file.json()}})).error, "its first chunk is not JSON");
}

TEST_F(GltfFile, RefusesContainersCutAnywhere) {
  const std::string whole = square_glb();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const ReadResult cut = read(whole.substr(0, size));
    EXPECT_FALSE(cut.ok) << size;
    EXPECT_FALSE(cut.error.empty()) << size;
  }
}

TEST_F(GltfFile, RefusesChunksThatReachOutOfTheFile) {
  const std::string whole = square_glb();
  const std::size_t binary = whole.find(std::string("BIN\0", 4)) - 4;
  for (const std::uint32_t more : {4u, 8u, 4096u, 0xFFFFFF00u}) {
    std::string longer = whole;
    std::uint32_t length = 0;
    std::memcpy(&length, &longer[binary], 4);
    length += more;
    std::memcpy(&longer[binary], &length, 4);
    EXPECT_EQ(read(longer).error, "its binary chunk is cut short") << more;
  }
  std::string other = whole;
  other[4] = 7;
  EXPECT_EQ(read(other).error, "is glTF '7.0'; Tandem reads glTF 2");
  Gltf file = square({0, 1, 2});
  file.buffers = R"({"byteLength": 60})";
  EXPECT_NE(read(glb(file.json(), kSquare)).error.find("byteLength"), std::string::npos);
}

TEST_F(GltfFile, IsReadByTandemWhateverItsEndingSays) {
  ImportOptions own;
  own.reader = Reader::tandem;
  for (const char* name : {"a.glb", "a.GLTF", "a.mesh"})
    for (const ImportOptions& options : {ImportOptions{}, own}) {
      const ImportResult result = import_mesh(write(name, square_glb()), options);
      ASSERT_TRUE(result.ok) << result.error;
      EXPECT_EQ(result.mesh.reader, "tandem glTF");
      EXPECT_EQ(result.mesh.face_count(), 2u);
    }
}

TEST_F(GltfFile, GoesToAssimpWhenAskedOrWhenOnlyAssimpMayKnow) {
#if !defined(TANDEM_ASSIMP)
  GTEST_SKIP() << "built without assimp";
#endif
  ImportOptions options;
  options.reader = Reader::assimp;
  const ImportResult asked = import_mesh(write("a.glb", square_glb()), options);
  EXPECT_EQ(asked.mesh.reader.find("assimp"), 0u) << asked.error;
  Gltf file = square({0, 1, 2});
  file.more += R"(, "extensionsRequired": ["KHR_draco_mesh_compression"])";
  const fs::path draco = write("draco.gltf", file.json());
  const ImportResult automatic = import_mesh(draco, {});
  EXPECT_TRUE(automatic.ok || automatic.error.find("assimp") == 0) << automatic.error;
  options.reader = Reader::tandem;
  EXPECT_NE(import_mesh(draco, options).error.find("KHR_draco_mesh_compression"), std::string::npos);
}

/// Bytes changed, cut out, doubled and put in, at places drawn from a seed.
std::string mutated(std::string bytes, std::mt19937& random) {
  const auto below = [&](std::size_t bound) { return random() % std::max<std::size_t>(bound, 1); };
  for (std::size_t change = 0; change <= below(4); ++change) {
    const std::size_t at = below(bytes.size()), count = std::min(below(12), bytes.size() - at);
    switch (below(4)) {
      case 0:
        bytes[at] = static_cast<char>(random());
        break;
      case 1:
        bytes.erase(at, count);
        break;
      case 2:
        bytes.insert(at, bytes.substr(at, count));
        break;
      default:
        bytes[at] = "0123456789-[]{},:\"e.\xFF"[below(21)];
    }
  }
  return bytes;
}

TEST_F(GltfFile, AnswersEveryMutatedFileWithAMeshOrAReason) {
  Gltf rich = square({0, 1, 2, 3, 2, 1}, "5");
  rich.nodes = R"({"mesh": 0, "children": [1], "matrix": [1, 0, 0, 0,  0, 1, 0, 0,  0, 0, 1, 0,  0, 0, 0, 1]},
                  {"mesh": 0, "rotation": [0, 0, 0, 1], "skin": 0, "extras": {"a": [1, {"b": null}]}})";
  rich.accessors =
      R"({"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "sparse": {"count": 1,
      "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 0}}},
      {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"})";
  const std::string seeds[] = {square_glb(), rich.json()};
  std::mt19937 random(20240229);
  int meshes = 0;
  for (int i = 0; i < 4000; ++i) {
    const std::string bytes = mutated(seeds[i % 2], random);
    const ReadResult result = read(bytes, {std::uint64_t{1} << 28});
    ASSERT_NE(result.ok, !result.error.empty()) << bytes;
    meshes += result.ok ? 1 : 0;
  }
  EXPECT_GT(meshes, 100);
  EXPECT_LT(meshes, 3900);
}

/// Looked for as in shared_meshes_test.cpp.
fs::path mesh_folder() {
  if (const char* named = std::getenv("TANDEM_MESHES")) return named;
  return fs::path(TANDEM_SOURCE_DIR) / ".." / "shared" / "meshes";
}

TEST(SharedGltf, HoldTheFacesThatTheirAuthorsWrote) {
  for (const auto& [name, faces] : {std::pair<const char*, std::size_t>{"CesiumMilkTruck.glb", 3624},
                                    {"CubeHierarchy.gltf", 48},
                                    {"spheres_scaled_instances.gltf", 672},
                                    {"scallop.glb", 120000},
                                    {"IndexOutOfRange.gltf", 12},
                                    {"Mesh_PrimitiveMode_00.gltf", 0}}) {
    const fs::path path = mesh_folder() / name;
    if (!fs::exists(path)) GTEST_SKIP() << path << " is not here (set TANDEM_MESHES)";
    const ImportResult result = import_mesh(path, {});
    ASSERT_TRUE(result.ok) << name << ": " << result.error;
    EXPECT_EQ(result.mesh.face_count(), faces) << name;
    EXPECT_EQ(std::count(result.mesh.corners.begin(), result.mesh.corners.end(), kNoVertex),
              name == std::string("IndexOutOfRange.gltf") ? 1 : 0);
  }
}

}  // namespace
}  // namespace tandem::build
