#include "make_scene_parts.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>

#include "tandem/kernels/broad_phase.h"
#include "tandem/kernels/world_box.h"

namespace tandem::bench {

double Random::uniform() {
  std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return static_cast<double>((z ^ z >> 31) >> 11) * 0x1p-53;
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

void move(std::vector<Instance>& instances, const Vector& offset) {
  for (Instance& instance : instances) {
    for (int k = 0; k < 3; ++k) instance.pose.translation[k] += offset[k];
  }
}

std::uint32_t root_above(std::uint32_t count, int power) {
  const auto enough = [&](std::uint64_t n) { return (power == 2 ? n * n : n * n * n) >= count; };
  std::uint32_t n = 1;
  while (!enough(n)) ++n;
  return n;
}

std::uint64_t count_box_pairs(const std::vector<AssetView>& assets, const std::vector<Instance>& instances) {
  std::vector<WorldBox> boxes;
  boxes.reserve(instances.size());
  for (const Instance& instance : instances) {
    const FileHeader& header = *assets[instance.asset].header;
    boxes.push_back(
        world_box(for_stored_coordinates(instance.pose, header.origin), header.lower, header.upper));
  }
  BroadPhase broad_phase;
  const Status status = broad_phase.find_pairs(boxes);
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status != Status::kOk) throw std::runtime_error(explain(status));
  return broad_phase.pairs().size();
}

}  // namespace tandem::bench
