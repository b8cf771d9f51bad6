#include "random_pose.h"

#include <algorithm>
#include <cmath>

namespace tandem {
namespace {

constexpr std::uint64_t kStep = 0x9E3779B97F4A7C15u;

}  // namespace

void Random::skip(std::uint64_t draws) {
  state_ += draws * kStep;
}

// A state for each draw, as kStep is odd, and a number for each state, as the rest can be undone.
std::uint64_t Random::next() {
  std::uint64_t z = state_ += kStep;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return z ^ z >> 31;
}

double Random::uniform() {
  return static_cast<double>(next() >> 11) * 0x1p-53;
}

double Random::between(double lower, double upper) {
  return lower + (upper - lower) * uniform();
}

Rotation rotation_of(double w, double x, double y, double z) {
  const double s = 2 / (w * w + x * x + y * y + z * z);
  return {{{1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)},
           {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)},
           {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)}}};
}

Rotation random_rotation(Random& random) {
  for (;;) {
    const double w = random.between(-1, 1), x = random.between(-1, 1), y = random.between(-1, 1),
                 z = random.between(-1, 1);
    const double squared = w * w + x * x + y * y + z * z;
    if (squared <= 1 && squared > 1e-3) return rotation_of(w, x, y, z);
  }
}

Vector random_direction(Random& random) {
  for (;;) {
    const double x = random.between(-1, 1), y = random.between(-1, 1), z = random.between(-1, 1);
    const double squared = x * x + y * y + z * z;
    if (squared > 1 || squared <= 1e-3) continue;
    const double length = std::sqrt(squared);
    return {x / length, y / length, z / length};
  }
}

Vector multiply(const Rotation& a, const Vector& x) {
  Vector product;
  for (int i = 0; i < 3; ++i) product[i] = a[i][0] * x[0] + a[i][1] * x[1] + a[i][2] * x[2];
  return product;
}

Rotation multiply(const Rotation& a, const Rotation& b) {
  Rotation product;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      product[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
    }
  }
  return product;
}

Vector Bounds::centre() const {
  Vector centre;
  for (int k = 0; k < 3; ++k) centre[k] = 0.5 * lower[k] + 0.5 * upper[k];
  return centre;
}

double Bounds::diagonal() const {
  double squared = 0;
  for (int k = 0; k < 3; ++k) squared += (upper[k] - lower[k]) * (upper[k] - lower[k]);
  return std::sqrt(squared);
}

Bounds bounds_of(const AssetView& asset) {
  Bounds bounds;
  for (int k = 0; k < 3; ++k) {
    bounds.lower[k] = asset.header->lower[k] + asset.header->origin[k];
    bounds.upper[k] = asset.header->upper[k] + asset.header->origin[k];
  }
  return bounds;
}

Instance place(std::uint32_t asset, const Rotation& rotation, const Vector& centre, const Vector& position) {
  const Vector turned = multiply(rotation, centre);
  Instance instance{asset, kIdentityPose};
  for (int i = 0; i < 3; ++i) {
    std::copy(rotation[i].begin(), rotation[i].end(), instance.pose.rotation[i]);
    instance.pose.translation[i] = position[i] - turned[i];
  }
  return instance;
}

}  // namespace tandem
