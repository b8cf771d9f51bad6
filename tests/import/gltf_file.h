#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "bvhbuild/import/readers.h"
#include "reader_test.h"
#include "temp_folder.h"

namespace tandem::build {
namespace fs = std::filesystem;

template <class T>
inline std::string bytes_of(const std::vector<T>& numbers) {
  std::string bytes(numbers.size() * sizeof(T), '\0');
  if (!numbers.empty()) std::memcpy(bytes.data(), numbers.data(), bytes.size());
  return bytes;
}

inline std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k <= bytes.size() ? kDigits[three >> (18 - 6 * k) & 63u] : '=';
  }
  return text;
}

inline std::string data_buffer(const std::string& bytes) {
  return R"({"byteLength": )" + std::to_string(bytes.size()) +
         R"(, "uri": "data:application/octet-stream;base64,)" + base64(bytes) + "\"}";
}

/// The lists of a glTF file, as JSON without their brackets.
struct Gltf {
  std::string more = R"("scene": 0, "scenes": [{"nodes": [0]}])";
  std::string nodes = R"({"name": "n", "mesh": 0})";
  std::string meshes = R"({"name": "m", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]})";
  std::string accessors;
  std::string views;
  std::string buffers;

  std::string json() const {
    return R"({"asset": {"version": "2.0"}, )" + more + R"(, "nodes": [)" + nodes + R"(], "meshes": [)" +
           meshes + R"(], "accessors": [)" + accessors + R"(], "bufferViews": [)" + views +
           R"(], "buffers": [)" + buffers + "]}";
  }
};

inline const std::string kSquare = bytes_of<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
inline constexpr const char* kSquareAccessor =
    R"({"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"})";

/// Four corners of a square and these indices.
inline Gltf square(const std::vector<std::uint16_t>& indices, const std::string& mode = "4") {
  Gltf file;
  file.meshes =
      R"({"name": "m", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": )" + mode + "}]}";
  file.accessors = std::string(kSquareAccessor) + R"(, {"bufferView": 1, "componentType": 5123, "count": )" +
                   std::to_string(indices.size()) + R"(, "type": "SCALAR"})";
  file.views = R"({"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": )" +
               std::to_string(2 * indices.size()) + "}";
  file.buffers = data_buffer(kSquare + bytes_of(indices));
  return file;
}

/// A triangle of three vertices whose bytes and accessor are given.
inline Gltf triangle(const std::string& bytes, const std::string& accessor, const std::string& view = "") {
  Gltf file;
  file.meshes = R"({"name": "m", "primitives": [{"attributes": {"POSITION": 0}}]})";
  file.accessors = R"({"bufferView": 0, "count": 3, )" + accessor + "}";
  file.views = R"({"buffer": 0, "byteLength": )" + std::to_string(bytes.size()) + view + "}";
  file.buffers = data_buffer(bytes);
  return file;
}

inline std::string glb(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const auto word = [](std::size_t value) {
    return bytes_of<std::uint32_t>({static_cast<std::uint32_t>(value)});
  };
  std::string chunks = word(json.size()) + "JSON" + json;
  if (!binary.empty()) chunks += word(binary.size()) + std::string("BIN\0", 4) + binary;
  return "glTF" + word(2) + word(12 + chunks.size()) + chunks;
}

/// A folder of its own for each test.
class GltfFile : public ::testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& bytes) const {
    return temporary_.write(name, bytes);
  }

  ReadResult read(const std::string& bytes, const ReadLimits& limits = {}) const {
    return read_gltf(bytes, folder_, limits);
  }
  PolygonMesh mesh(const Gltf& file) const {
    ReadResult result = read(file.json());
    EXPECT_TRUE(result.ok) << result.error << "\n" << file.json();
    return std::move(result.mesh);
  }
  std::string error(const Gltf& file) const {
    const ReadResult result = read(file.json());
    EXPECT_FALSE(result.ok) << file.json();
    return result.error;
  }
  /// The error, which must have these words.
  void expect_error(const Gltf& file, const std::string& words) const {
    const std::string text = error(file);
    EXPECT_NE(text.find(words), std::string::npos) << "'" << text << "' lacks '" << words << "'";
  }

  test::TempFolder temporary_;
  fs::path folder_ = temporary_.path();
};

inline std::string joined(const std::vector<std::string>& remarks) {
  std::string text;
  for (const std::string& remark : remarks) text += remark + "\n";
  return text;
}

inline void expect_points(const PolygonMesh& mesh, const std::vector<Point>& expected, double tolerance = 0) {
  ASSERT_EQ(mesh.points.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i)
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(mesh.points[i][k], expected[i][k], tolerance) << i << " " << k;
}

}  // namespace tandem::build
