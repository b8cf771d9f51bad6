#include <array>
#include <bit>
#include <cmath>

#include "statistics.h"
#include "tandem/kernels/block_pair.h"
#include "tandem/kernels/traversal.h"

namespace tandem {
namespace {

using Vector = std::array<double, 3>;
using Matrix = std::array<Vector, 3>;

// SplitMix64 (Steele, Lea and Flood 2014): the same numbers on every platform, which standard distributions
// are not.
class Random {
 public:
  double uniform() {  // in [0, 1)
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return static_cast<double>((z ^ z >> 31) >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t state_ = 2009;
};

// A uniformly distributed rotation from a random unit quaternion (Shoemake 1992).
Matrix random_rotation(Random& random) {
  constexpr double kTurn = 6.283185307179586;
  const double u = random.uniform(), v = kTurn * random.uniform(), w = kTurn * random.uniform();
  const double x = std::sqrt(1 - u) * std::sin(v), y = std::sqrt(1 - u) * std::cos(v);
  const double z = std::sqrt(u) * std::sin(w), s = std::sqrt(u) * std::cos(w);
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - s * z), 2 * (x * z + s * y)},
           {2 * (x * y + s * z), 1 - 2 * (x * x + z * z), 2 * (y * z - s * x)},
           {2 * (x * z - s * y), 2 * (y * z + s * x), 1 - 2 * (x * x + y * y)}}};
}

Vector random_direction(Random& random) {
  const double z = 2 * random.uniform() - 1, angle = 6.283185307179586 * random.uniform(),
               r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

// What a sample may cost, a second or so: a mesh whose triangles all lie in one place would take their number
// squared.
constexpr std::uint64_t kMostBlockPairs = 5'000'000;

struct Work {
  std::uint64_t block_pairs = 0, candidates = 0;
};

// The traversal that queries make, of a tree against itself, posed.
// Once `budget`, a number of block pairs, is used up, nothing is met any more.
Work query(const LevelView& tree, const RelativePose& b_in_a, bool stop_at_first, std::uint64_t& budget) {
  const BlockPairTest of_blocks = block_pair_test();
  const auto test = [&](const Block& a, const Block& b) -> std::uint32_t {
    if (budget == 0) return 0;
    --budget;
    return of_blocks(a, b, b_in_a);
  };
  Work work;
  work.block_pairs = traverse(tree, tree, test, [&](const Block&, const Block&, std::uint32_t mask) {
    work.candidates += static_cast<std::uint64_t>(std::popcount(mask));
    return !stop_at_first;
  });
  return work;
}

// Turns about the centre of the bounds, then moves by `distance` along `direction`.
RelativePose make_pose(const Matrix& rotation, const Vector& direction, double distance,
                       const Vector& center) {
  double matrix[3][3], translation[3];
  for (int i = 0; i < 3; ++i) {
    translation[i] = center[i] + distance * direction[i];
    for (int j = 0; j < 3; ++j) {
      matrix[i][j] = rotation[i][j];
      translation[i] -= rotation[i][j] * center[j];
    }
  }
  return without_slack(matrix, translation);
}

}  // namespace

ExpectedWork sample_near_contact(const LevelView& level, const float* lower, const float* upper,
                                 std::uint32_t poses) {
  Vector center{};
  double radius = 0;
  for (int k = 0; k < 3; ++k) {
    center[k] = 0.5 * (static_cast<double>(lower[k]) + upper[k]);
    radius = std::hypot(radius, 0.5 * (static_cast<double>(upper[k]) - lower[k]));
  }
  Random random;
  ExpectedWork sum;
  sum.poses = poses;
  std::uint64_t budget = kMostBlockPairs;
  for (std::uint32_t i = 0; i < poses; ++i) {
    const Matrix rotation = random_rotation(random);
    const Vector direction = random_direction(random);
    const auto work_at = [&](double distance, bool stop_at_first) {
      return query(level, make_pose(rotation, direction, distance, center), stop_at_first, budget);
    };
    double touching = 0, apart = 2.1 * radius;
    for (int step = 0; step < 20; ++step) {
      const double middle = 0.5 * (touching + apart);
      (work_at(middle, true).candidates > 0 ? touching : apart) = middle;
    }
    const Work work = work_at(touching - 0.05 * random.uniform() * radius, false);
    if (budget == 0) return {};
    sum.block_pairs += static_cast<double>(work.block_pairs) / poses;
    sum.candidates += static_cast<double>(work.candidates) / poses;
  }
  return sum;
}

}  // namespace tandem
