#include <gtest/gtest.h>
#include <xxhash.h>

#include <bit>
#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "kernels/common/plain_boxes.h"
#include "kernels/geometry/box_test.h"
#include "tandem/formats/block.h"
#include "tandem/formats/box.h"
#include "tandem/formats/hash.h"
#include "tandem/formats/status.h"

namespace tandem::test {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kLargest = std::numeric_limits<float>::max();

// Everything that arithmetic can trip over.
const std::vector<float> kSpecial = {0.0f,     -0.0f,     1e-45f, -1e-45f,   1.0f,       -1.0f, 0.5f,
                                     kLargest, -kLargest, 3e38f,  kInfinity, -kInfinity, kNan};

Box imaginary_box() {
  Block block{};
  set_imaginary(block, 2);
  return box_of(block, 2);
}

float pick(std::mt19937_64& random) {
  if (random() % 4 == 0) return std::uniform_real_distribution<float>(-10, 10)(random);
  return kSpecial[random() % kSpecial.size()];
}

Box any_box(std::mt19937_64& random) {
  if (random() % 8 == 0) return imaginary_box();
  Box box;
  for (int k = 0; k < 3; ++k) {
    box.centre[k] = pick(random);
    box.half_extent[k] = pick(random);
  }
  return box;
}

RelativePose any_pose(std::mt19937_64& random) {
  RelativePose pose;
  const bool axis_aligned = random() % 3 == 0;  // zeros in the rotation: 0 * infinity
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      pose.rotation[i][j] = axis_aligned ? static_cast<float>(i == j) : pick(random);
    for (int j = 0; j < 3; ++j) pose.abs_rotation[i][j] = std::fabs(pose.rotation[i][j]);
    pose.translation[i] = pick(random);
    pose.slack_a[i] = random() % 2 == 0 ? 0 : pick(random);
    pose.slack_b[i] = random() % 2 == 0 ? 0 : pick(random);
  }
  return pose;
}

TEST(ImaginaryNode, IsRejectedByEveryBoxTestAgainstEveryOtherBox) {
  std::mt19937_64 random(2);
  const Box imaginary = imaginary_box();
  for (int i = 0; i < 500000; ++i) {
    const Box other = any_box(random);
    const RelativePose pose = any_pose(random);
    ASSERT_FALSE(overlap_6_axes(imaginary, other, pose)) << i;
    ASSERT_FALSE(overlap_6_axes(other, imaginary, pose)) << i;
    ASSERT_FALSE(overlap_15_axes(imaginary, other, pose)) << i;
    ASSERT_FALSE(overlap_15_axes(other, imaginary, pose)) << i;
    ASSERT_FALSE(overlap_aligned(imaginary, other)) << i;
    ASSERT_FALSE(overlap_aligned(other, imaginary)) << i;
  }
}

TEST(ImaginaryNode, IsRejectedOnEachAxisAlone) {
  std::mt19937_64 random(3);
  const Box imaginary = imaginary_box();
  for (int i = 0; i < 200000; ++i) {
    const Box other = any_box(random);
    const RelativePose pose = any_pose(random);
    const auto there = detail::distance(imaginary, other, pose),
               back = detail::distance(other, imaginary, pose);
    ASSERT_FALSE(detail::overlap_on_face_axes(there, pose)) << i;
    ASSERT_FALSE(detail::overlap_on_face_axes(back, pose)) << i;
    ASSERT_FALSE(detail::overlap_on_edge_axes(there, pose)) << i;
    ASSERT_FALSE(detail::overlap_on_edge_axes(back, pose)) << i;
  }
}

TEST(ImaginaryNode, IsTheNeutralElementOfAUnion) {
  const Box box = imaginary_box();
  EXPECT_EQ(std::min(1.0f, box.centre[0] - box.half_extent[0]), 1.0f);
  EXPECT_EQ(std::max(-1.0f, box.centre[0] + box.half_extent[0]), -1.0f);
}

// The tests above would pass if nothing ever overlapped.
TEST(BoxTest, RealBoxesThatTouchOverlap) {
  const Box unit = {{0, 0, 0}, {1, 1, 1}}, beside = {{2, 0, 0}, {1, 1, 1}}, apart = {{2.5f, 0, 0}, {1, 1, 1}};
  const RelativePose same = without_slack(kIdentityPose.rotation, kIdentityPose.translation);
  EXPECT_TRUE(overlap_15_axes(unit, beside, same));
  EXPECT_TRUE(overlap_aligned(unit, beside));
  EXPECT_FALSE(overlap_15_axes(unit, apart, same));
  EXPECT_FALSE(overlap_aligned(unit, apart));
}

// Two long rods crossing at a right angle, rolled by 45 degrees: only the cross product of their edges
// separates them.
TEST(BoxTest, EdgeAxesSeparateWhatFacesDoNot) {
  const double s = std::sqrt(0.5);
  const Box rod = {{0, 0, 0}, {10, 1, 1}};
  // b's axes in a's frame: turned by 45 degrees about x for both, then across.
  const RelativePose crossed = without_slack({{0, s, -s}, {s, 0.5, 0.5}, {-s, 0.5, 0.5}}, {0, 2.1, 2.1});
  EXPECT_TRUE(overlap_6_axes(rod, rod, crossed));
  EXPECT_FALSE(overlap_15_axes(rod, rod, crossed));
}

TEST(ImaginaryMinimum, IsTheBruteForceMinimumOverAllTrees) {
  // least[n]: fewest blocks of a pure tree over n leaves, by trying all ways to fill a block.
  constexpr int kLargestTree = 200;
  constexpr int kNever = 1 << 20;
  std::vector<int> least(kLargestTree + 1, kNever);
  for (int n = 1; n <= kLargestTree; ++n) {
    if (n <= 4) least[n] = 1;
    std::vector<std::vector<int>> ways(5, std::vector<int>(n + 1, kNever));
    ways[0][0] = 0;
    for (int slot = 1; slot <= 4; ++slot) {
      for (int sum = 0; sum <= n; ++sum) {
        ways[slot][sum] = ways[slot - 1][sum];  // an imaginary node
        for (int child = 1; child <= sum && child < n; ++child) {
          ways[slot][sum] = std::min(ways[slot][sum], ways[slot - 1][sum - child] + least[child]);
        }
      }
    }
    least[n] = std::min(least[n], 1 + ways[4][n]);
    const int imaginary = 4 * least[n] - n - (least[n] - 1);
    EXPECT_EQ(minimal_imaginary_nodes(n), imaginary) << n;
  }
}

// long double has 64 bits; sums of two floats are exact in it where their exponents differ by at most 40. The
// reference below therefore adds integers: every float is a multiple of 2^-149, and 2^128 of them fit into
// 300 bits.
class Exact {
 public:
  explicit Exact(float x) {
    const int sign = std::signbit(x) ? -1 : 1;
    int exponent = 0;
    const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(std::fabs(x), &exponent), 24));
    const int shift = exponent - 24 + 149;  // of the mantissa, at least -24 for denormals
    for (int bit = 0; bit < 24; ++bit) {
      if ((mantissa >> bit & 1) != 0)
        digits_[(shift + bit) / 16] += sign * (std::int64_t{1} << (shift + bit) % 16);
    }
  }
  Exact operator+(const Exact& other) const { return combine(other, 1); }
  Exact operator-(const Exact& other) const { return combine(other, -1); }
  int sign() const {
    std::int64_t digits[kDigits], carry = 0;
    for (int i = 0; i < kDigits; ++i) {
      const std::int64_t sum = digits_[i] + carry;
      carry = sum >> 16;
      digits[i] = sum - (carry << 16);
    }
    if (carry < 0) return -1;
    for (const std::int64_t digit : digits) {
      if (digit != 0) return 1;
    }
    return carry > 0 ? 1 : 0;
  }

 private:
  static constexpr int kDigits = 20;
  Exact combine(const Exact& other, int factor) const {
    Exact result = *this;
    for (int i = 0; i < kDigits; ++i) result.digits_[i] += factor * other.digits_[i];
    return result;
  }
  std::int64_t digits_[kDigits] = {};
};

bool within(float c_i, float h_i, float c, float h) {
  const Exact low_inside = (Exact(c_i) - Exact(h_i)) - (Exact(c) - Exact(h));
  const Exact high_inside = (Exact(c) + Exact(h)) - (Exact(c_i) + Exact(h_i));
  return low_inside.sign() >= 0 && high_inside.sign() >= 0;
}

// Floats of all magnitudes up to the limit, denormals and zeros, often close to one another.
float any_float(std::mt19937_64& random) {
  switch (random() % 6) {
    case 0:
      return 0.0f;
    case 1:
      return std::bit_cast<float>(static_cast<std::uint32_t>(random() & 0x807FFFFFu));  // denormal
    case 2:
      return std::ldexp(1.0f, static_cast<int>(random() % 250) - 125);
    case 3:
      return (random() % 2 == 0 ? 1.0f : -1.0f) * kMaxCoordinate;
    case 4:
      return 1.0f + static_cast<float>(random() % 16) * 0x1p-23f;
    default: {
      const float x = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
      return std::fabs(x) <= kMaxCoordinate ? x : 1.0f;
    }
  }
}

TEST(Enclose, ContainsBothPointsAndNoSmallerFloatWould) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 200000; ++i) {
    float a = any_float(random), b = any_float(random);
    if (a > b) std::swap(a, b);
    const Box box = enclose({a, a, a}, {b, b, b});
    const float c = box.centre[1], h = box.half_extent[1];
    ASSERT_TRUE(std::isfinite(c) && std::isfinite(h));
    ASSERT_TRUE(within(a, 0, c, h) && within(b, 0, c, h)) << a << " " << b;
    if (h > 0) {
      const float smaller = std::nextafter(h, 0.0f);
      ASSERT_FALSE(within(a, 0, c, smaller) && within(b, 0, c, smaller)) << a << " " << b;
    }
  }
}

TEST(Enclose, ABlocksBoxContainsItsNodesAndNoSmallerFloatWould) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 100000; ++i) {
    Block block;
    const int real = 1 + static_cast<int>(random() % 4);
    for (int n = 0; n < 4; ++n) {
      float a = any_float(random), b = any_float(random);
      if (a > b) std::swap(a, b);
      if (n < real) set_node(block, n, enclose({a, a, a}, {b, b, b}), n, NodeKind::leaf);
      if (n >= real) set_imaginary(block, n);
    }
    const Box box = enclose(block);
    const float c = box.centre[2], h = box.half_extent[2];
    ASSERT_TRUE(std::isfinite(h));
    bool smaller_would_do = h > 0;
    for (int n = 0; n < real; ++n) {
      ASSERT_TRUE(within(block.centre[2][n], block.half_extent[2][n], c, h)) << i;
      smaller_would_do =
          smaller_would_do && within(block.centre[2][n], block.half_extent[2][n], c, std::nextafter(h, 0.0f));
    }
    ASSERT_FALSE(smaller_would_do) << i;
  }
}

TEST(Contains, AgreesWithIntegerArithmetic) {
  std::mt19937_64 random(6);
  int inside = 0, outside = 0;
  for (int i = 0; i < 300000; ++i) {
    const float c = any_float(random), h = std::fabs(any_float(random)), c_i = any_float(random);
    float h_i = std::fabs(any_float(random));
    if (random() % 2 == 0)
      h_i = std::nextafter(std::fabs(h - std::fabs(c_i - c)),
                           random() % 2 == 0 ? 0.0f : 1e30f);  // nearly touching
    if (!std::isfinite(h_i)) continue;
    const Box outer = {{c, c, c}, {h, h, h}}, inner = {{c_i, c_i, c_i}, {h_i, h_i, h_i}};
    const bool expected = within(c_i, h_i, c, h);
    ASSERT_EQ(contains(outer, inner), expected) << c << " " << h << " " << c_i << " " << h_i;
    ASSERT_EQ(contains(outer, {c_i, c_i, c_i}), within(c_i, 0, c, h));
    (expected ? inside : outside)++;
  }
  EXPECT_GT(inside, 10000);
  EXPECT_GT(outside, 10000);
}

// 64 levels of boxes around boxes at the limit of the coordinates, each pushed as far out as rounding allows.
TEST(Enclose, StaysFiniteAtTheDeepestTreeOfTheLargestCoordinates) {
  const float m = kMaxCoordinate;
  Box box = enclose({-m, -m, -m}, {m, std::nextafter(m, 0.0f), m});
  for (std::uint32_t depth = 0; depth < kMaxDepth; ++depth) {
    Block block;
    set_node(block, 0, box, 1, NodeKind::internal);
    const float near = std::nextafter(m, 0.0f);
    set_node(block, 1, enclose({-near, -near, -m}, {m, m, near}), 2, NodeKind::internal);
    for (int n = 2; n < 4; ++n) set_imaginary(block, n);
    box = enclose(block);
    for (const float h : box.half_extent) ASSERT_TRUE(std::isfinite(h)) << depth;
  }
}

TEST(Hash, EqualsTheReferenceLibraryForEveryLengthAndSeed) {
  std::mt19937_64 random(1);
  std::vector<unsigned char> bytes(600);
  for (auto& byte : bytes) byte = static_cast<unsigned char>(random());
  for (std::size_t length = 0; length <= bytes.size(); ++length) {
    const std::uint64_t seed = length % 3 == 0 ? 0 : random();
    EXPECT_EQ(xxh64(bytes.data(), length, seed), XXH64(bytes.data(), length, seed)) << length;
  }
}

TEST(Hash, ReadsUnalignedBytes) {
  std::vector<unsigned char> bytes(100, 7);
  for (std::size_t offset = 0; offset < 16; ++offset) {
    EXPECT_EQ(xxh64(bytes.data() + offset, 64), XXH64(bytes.data() + offset, 64, 0));
  }
}

// Every name of a status is its own and has words; nothing else to link, so this also shows that the headers
// stand alone.

// The enumerators, as the header has them.
std::set<std::string> declared_names() {
  std::ifstream file(TANDEM_SOURCE_DIR "/formats/include/tandem/formats/status.h");
  const std::regex enumerator("\\bk([A-Z]\\w*)( = \\d+)?,");
  std::set<std::string> names;
  for (std::string line; std::getline(file, line);) {
    const std::string code = line.substr(0, line.find("//"));
    for (std::sregex_iterator found(code.begin(), code.end(), enumerator), end; found != end; ++found)
      EXPECT_TRUE(names.insert((*found)[1]).second) << line;
  }
  return names;
}

TEST(Status, EveryDefectHasANameAndASentenceOfItsOwn) {
  std::set<std::string> names, sentences;
  for (std::uint32_t i = 0; i <= static_cast<std::uint32_t>(Status::kCudaFailed); ++i) {
    const auto status = static_cast<Status>(i);
    if (std::string(name(status)) == "Unnamed") continue;
    EXPECT_TRUE(names.insert(name(status)).second) << name(status);
    EXPECT_TRUE(sentences.insert(explain(status)).second) << explain(status);
  }
  EXPECT_EQ(names, declared_names());
  EXPECT_GT(names.size(), 70u);
}

TEST(Status, ANumberOutsideTheEnumerationDoesNoHarm) {
  EXPECT_STREQ(name(static_cast<Status>(9999)), "Unnamed");
  EXPECT_EQ(subject(static_cast<Status>(9999)), nullptr);
}

}  // namespace
}  // namespace tandem::test
