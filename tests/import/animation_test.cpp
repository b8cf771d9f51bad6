// Tests where skins, morph targets and moving nodes of glTF files put vertices.
#include "bvhbuild/import/animation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "gltf_file.h"

namespace tandem::build {
namespace {

using Points = std::vector<Point>;

constexpr double kSine45 = 0.70710678118654752440;

/// A file that is put together accessor by accessor, each in a buffer of its own.
class MotionFile {
 public:
  /// Returns the number of the accessor.
  int add(const std::string& type, int component_type, const std::string& bytes, std::size_t count) {
    const std::string number = std::to_string(accessors_);
    const std::string comma = accessors_ == 0 ? "" : ", ";
    gltf.buffers += comma + data_buffer(bytes);
    gltf.views +=
        comma + R"({"buffer": )" + number + R"(, "byteLength": )" + std::to_string(bytes.size()) + "}";
    gltf.accessors += comma + R"({"bufferView": )" + number + R"(, "componentType": )" +
                      std::to_string(component_type) + R"(, "count": )" + std::to_string(count) +
                      R"(, "type": ")" + type + "\"}";
    return accessors_++;
  }
  int add_floats(const std::string& type, std::size_t width, const std::vector<float>& numbers) {
    return add(type, 5126, bytes_of(numbers), numbers.size() / width);
  }

  AnimatedMesh read() const {
    const test::TempFolder folder;
    std::ofstream(folder.path() / "a.gltf") << gltf.json();
    return import_animated(folder.path() / "a.gltf", {});
  }

  Gltf gltf;

 private:
  int accessors_ = 0;
};

void expect_near(const Points& actual, const Points& expected) {
  ASSERT_EQ(actual.size(), expected.size());
  for (std::size_t i = 0; i < actual.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(actual[i][k], expected[i][k], 1e-7) << i << " " << k;
  }
}

Points positions_at(const Animation& animation, double seconds, std::size_t clip = 0) {
  Points points;
  animation.at({clip, seconds}, points);
  return points;
}

/// An arm of two bones along y. The lower one stands at the origin, the upper one at (0, 1, 0), and turns
/// about z by 90 degrees from second 1 to second 3. The mesh's node stands elsewhere, which must not matter.
/// The vertices: at the foot, at the joint, at the tip, and twice at one place of both bones.
MotionFile arm() {
  MotionFile file;
  const int positions =
      file.add_floats("VEC3", 3, {0, 0, 0, 0, 1, 0, 0, 2, 0, 0.5, 1.25, 0.5, 0.5, 1.25, 0.5});
  const int indices = file.add("SCALAR", 5123, bytes_of<std::uint16_t>({0, 1, 3, 1, 2, 4}), 6);
  const int joints = file.add(
      "VEC4", 5121, bytes_of<std::uint8_t>({0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0}), 5);
  const int weights = file.add_floats(
      "VEC4", 4, {1, 0, 0, 0, 0.5, 0.5, 0, 0, 1, 0, 0, 0, 0.3f, 0.6f, 0, 0, 0.6f, 0.3f, 0, 0});
  const int inverse = file.add_floats("MAT4", 16, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0,  0, 1,
                                                   1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, 0, 1});
  const int times = file.add_floats("SCALAR", 1, {1, 3});
  const auto sine = static_cast<float>(kSine45);
  const int turns = file.add_floats("VEC4", 4, {0, 0, 0, 1, 0, 0, sine, sine});
  const auto text = [](int number) { return std::to_string(number); };
  file.gltf.nodes = R"({"mesh": 0, "skin": 0, "translation": [5, 6, 7]}, {"children": [2]},
                       {"translation": [0, 1, 0]})";
  file.gltf.meshes = R"({"primitives": [{"attributes": {"POSITION": )" + text(positions) +
                     R"(, "JOINTS_0": )" + text(joints) + R"(, "WEIGHTS_0": )" + text(weights) +
                     R"(}, "indices": )" + text(indices) + "}]}";
  file.gltf.more = R"("scenes": [{"nodes": [0, 1]}], "skins": [{"joints": [1, 2], "inverseBindMatrices": )" +
                   text(inverse) +
                   R"(}], "animations": [{"name": "bend", "channels": [{"sampler": 0, "target":
                   {"node": 2, "path": "rotation"}}], "samplers": [{"input": )" +
                   text(times) + R"(, "output": )" + text(turns) + "}]}]";
  return file;
}

TEST(Animation, ASkinFollowsItsJoints) {
  const AnimatedMesh arm_file = arm().read();
  ASSERT_TRUE(arm_file.read.ok) << arm_file.read.error;
  const Animation& animation = *arm_file.animation;
  ASSERT_EQ(animation.clips().size(), 1u);
  EXPECT_EQ(animation.clips()[0].name, "bend");
  EXPECT_EQ(animation.clips()[0].begin, 1);
  EXPECT_EQ(animation.clips()[0].end, 3);
  EXPECT_EQ(animation.vertex_count(), 5u);
  EXPECT_TRUE(arm_file.read.mesh.remarks.empty());

  const Points rest = {{0, 0, 0}, {0, 1, 0}, {0, 2, 0}, {0.5, 1.25, 0.5}, {0.5, 1.25, 0.5}};
  expect_near(arm_file.read.mesh.points, rest);
  expect_near(positions_at(animation, 1), rest);
  expect_near(positions_at(animation, -1), rest);
  // The joint carries (0.5, 0.25) to (-0.25, 0.5) in its own frame, with a share of two thirds.
  const Point bent = {0.5 / 3 - 0.25 * 2 / 3, 1.25 / 3 + 1.5 * 2 / 3, 0.5};
  expect_near(positions_at(animation, 3), {{0, 0, 0}, {0, 1, 0}, {-1, 1, 0}, bent, bent});
  expect_near(positions_at(animation, 9), positions_at(animation, 3));
  const Points half = positions_at(animation, 2);
  expect_near({half[2]}, {{-kSine45, 1 + kSine45, 0}});
}

TEST(Animation, VerticesWithTheSameInfluencesStayTogetherToTheLastBit) {
  const Animation animation = *arm().read().animation;
  for (int i = 0; i <= 20; ++i) {
    const Points points = positions_at(animation, 1 + 0.1 * i);
    EXPECT_EQ(points[3], points[4]) << i;
  }
}

TEST(Animation, TurnsGoAtAnEvenPaceTheShorterWay) {
  const Animation animation = *arm().read().animation;
  for (int i = 0; i <= 16; ++i) {
    const double angle = std::acos(-1.0) / 2 * i / 16;
    const Points points = positions_at(animation, 1 + 2.0 * i / 16);
    expect_near({points[2]}, {{-std::sin(angle), 1 + std::cos(angle), 0}});
  }
}

/// A triangle with two morph targets, at a node that moves. Weights run by the interpolation that is named.
MotionFile morphing(const std::string& interpolation, const std::vector<float>& weights) {
  MotionFile file;
  file.add_floats("VEC3", 3, {0, 0, 0, 1, 0, 0, 0, 1, 0});
  file.add_floats("VEC3", 3, {0, 0, 1, 0, 0, 2, 0, 0, 4});
  file.add_floats("VEC3", 3, {8, 0, 0, 0, 0, 0, 0, 0, 0});
  file.add_floats("SCALAR", 1, {0, 1, 3});
  file.add_floats("SCALAR", 1, weights);
  file.add_floats("VEC3", 3, {0, 0, 0, 2, 0, 0, 2, 4, 0});
  file.gltf.nodes = R"({"mesh": 0, "scale": [2, 2, 2]})";
  file.gltf.meshes = R"({"weights": [0, 0.5], "primitives": [{"attributes": {"POSITION": 0},
                        "targets": [{"POSITION": 1}, {"POSITION": 2}]}]})";
  file.gltf.more = R"("animations": [{"channels": [
    {"sampler": 0, "target": {"node": 0, "path": "weights"}},
    {"sampler": 1, "target": {"node": 0, "path": "translation"}}],
    "samplers": [{"input": 3, "output": 4, "interpolation": ")" +
                   interpolation + R"("}, {"input": 3, "output": 5}]}])";
  return file;
}

TEST(Animation, MorphTargetsAndNodesMove) {
  const AnimatedMesh read = morphing("LINEAR", {0, 0, 1, 0, 0, 0.25}).read();
  ASSERT_TRUE(read.read.ok) << read.read.error;
  const Animation& animation = *read.animation;
  expect_near(read.read.mesh.points, {{8, 0, 0}, {2, 0, 0}, {0, 2, 0}});  // half of target 1, doubled
  expect_near(positions_at(animation, 0), {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}});
  expect_near(positions_at(animation, 0.5), {{1, 0, 1}, {3, 0, 2}, {1, 2, 4}});
  expect_near(positions_at(animation, 1), {{2, 0, 2}, {4, 0, 4}, {2, 2, 8}});
  expect_near(positions_at(animation, 3), {{6, 4, 0}, {4, 4, 0}, {2, 6, 0}});
}

TEST(Animation, StepsAndCubicSplinesGoByTheirRules) {
  const Animation steps = *morphing("STEP", {0, 0, 1, 0, 0, 0}).read().animation;
  expect_near({positions_at(steps, 0.75)[2]}, {{1.5, 2, 0}});
  expect_near({positions_at(steps, 2)[2]}, {{2, 4, 8}});
  // In-tangent, value and out-tangent of both weights at each of three times.
  const Animation cubic =
      *morphing("CUBICSPLINE", {0, 0, 0, 0, 1, 0, 2, 0, 1, 0, 3, 0, 0, 0, 0, 0, 0, 0}).read().animation;
  // Halfway: 0.125 of the first out-tangent 1, half of the value 1, -0.125 of the in-tangent 2.
  expect_near({positions_at(cubic, 0.5)[2]}, {{1, 2, 8 * (0.125 + 0.5 - 0.25)}});
  // The second piece is two seconds long, and tangents count so many times.
  expect_near({positions_at(cubic, 2)[2]}, {{2, 4, 8 * (0.5 + 0.125 * 2 * 3)}});
}

TEST(Animation, TimesAreSpreadOverAllClipsByTheirLength) {
  const std::vector<AnimationClip> clips = {{"a", 1, 2}, {"b", 5, 8}, {"still", 0, 0}};
  const std::vector<AnimationTime> times = spread_times(clips, 4);
  ASSERT_EQ(times.size(), 4u);
  EXPECT_EQ(times[0].clip, 0u);
  EXPECT_EQ(times[0].seconds, 1.5);
  for (std::size_t i = 1; i < 4; ++i) {
    EXPECT_EQ(times[i].clip, 1u);
    EXPECT_EQ(times[i].seconds, 4.5 + static_cast<double>(i));
  }
  EXPECT_EQ(spread_times({{"a", 2, 2}, {"b", 0, 0}}, 5).size(), 2u);
}

std::string error_of(MotionFile file, const std::string& wrong, const std::string& right) {
  std::string& text = file.gltf.more;
  const std::size_t at = text.find(right);
  EXPECT_NE(at, std::string::npos) << right;
  text.replace(at, right.size(), wrong);
  const AnimatedMesh read = file.read();
  EXPECT_FALSE(read.read.ok);
  return read.read.error;
}

TEST(Animation, WhatIsAmissIsNamed) {
  EXPECT_EQ(error_of(arm(), R"("joints": [1, 9])", R"("joints": [1, 2])"), "skins[0] names nodes[9] of 3");
  EXPECT_EQ(error_of(arm(), R"("joints": [1])", R"("joints": [1, 2])"),
            "meshes[0], primitive 0: a vertex names joint 1 of 1");
  EXPECT_EQ(error_of(arm(), R"("joints": [1, 2, 1])", R"("joints": [1, 2])"),
            "skins[0] has 2 matrices for 3 joints");
  EXPECT_EQ(error_of(arm(), R"("sampler": 4)", R"("sampler": 0)"), "animations[0] names samplers[4] of 1");
  EXPECT_EQ(error_of(arm(), R"("node": 7)", R"("node": 2)"), "animations[0] names nodes[7] of 3");
  EXPECT_EQ(error_of(arm(), R"("scenes": [{"nodes": [0]}])", R"("scenes": [{"nodes": [0, 1]}])"),
            "skins[0] names nodes[1], which is not in the scene");
  EXPECT_EQ(error_of(arm(), "\"elsewhere\": ", "\"animations\": "), "it has no animation");
  EXPECT_EQ(error_of(arm(), "translation", "rotation"),
            "accessors[6] has 4 numbers in an element, where a value of an animation needs 3");
  EXPECT_EQ(error_of(morphing("LINEAR", {0, 0, 1, 0, 0, 0}), "CUBIC", "LINEAR"),
            "animations[0] has an interpolation that is none of glTF: CUBIC");
  const AnimatedMesh few = morphing("LINEAR", {0, 0, 1, 0}).read();
  EXPECT_EQ(few.read.error, "animations[0] has 4 numbers where 6 belong to its 3 times");
}

}  // namespace
}  // namespace tandem::build
