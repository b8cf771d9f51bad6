#include "import/gltf_transform.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tandem::build {
namespace {

using Numbers = const std::vector<double>&;

/// glTF keeps matrices column by column. Their fourth row has no meaning but 0 0 0 1.
Affine from_matrix(Numbers m) {
  Affine t{};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) t[row][column] = m[4 * column + row];
  return t;
}

/// Scale, then rotation by a quaternion x y z w, then translation. A quaternion stored in decimal is never
/// quite of length 1; dividing by its length leaves a rotation.
Affine from_parts(Numbers q, Numbers s, Numbers t) {
  Affine result = kIdentity;
  if (!q.empty()) {
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double f = 2 / (x * x + y * y + z * z + w * w);
    result = {{{1 - f * (y * y + z * z), f * (x * y - z * w), f * (x * z + y * w), 0},
               {f * (x * y + z * w), 1 - f * (x * x + z * z), f * (y * z - x * w), 0},
               {f * (x * z - y * w), f * (y * z + x * w), 1 - f * (x * x + y * y), 0}}};
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3 && !s.empty(); ++column) result[row][column] *= s[column];
    if (!t.empty()) result[row][3] = t[row];
  }
  return result;
}

/// Empty, or that a part has a wrong number of numbers.
std::string check_length(const char* name, Numbers numbers, std::size_t wanted) {
  if (numbers.empty() || numbers.size() == wanted) return {};
  return std::string(name) + " has " + std::to_string(numbers.size()) + " numbers, not " +
         std::to_string(wanted);
}

bool is_affine(Numbers m) {
  return m[3] == 0 && m[7] == 0 && m[11] == 0 && std::abs(m[15] - 1) < 1e-6;
}

}  // namespace

std::string check_transform(const GltfTransform& transform) {
  std::string wrong = check_length("matrix", transform.matrix, 16);
  if (wrong.empty()) wrong = check_length("rotation", transform.rotation, 4);
  if (wrong.empty()) wrong = check_length("scale", transform.scale, 3);
  if (wrong.empty()) wrong = check_length("translation", transform.translation, 3);
  if (!wrong.empty()) return wrong;
  Numbers q = transform.rotation;
  if (!q.empty() && std::all_of(q.begin(), q.end(), [](double x) { return x == 0; }))
    return "rotation is zero, which is no rotation";
  if (!transform.matrix.empty() && !is_affine(transform.matrix))
    return "matrix is not affine: its last row is not 0 0 0 1";
  return {};
}

Affine local_transform(const GltfTransform& transform) {
  if (!transform.matrix.empty()) return from_matrix(transform.matrix);
  return from_parts(transform.rotation, transform.scale, transform.translation);
}

}  // namespace tandem::build
