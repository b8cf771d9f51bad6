#pragma once
#include "kernels/contact/leaf_planes.h"
#include "kernels/geometry/triangle_test.h"
#include "tandem/kernels/contact_query.h"

/// The two triangles of a candidate as the stages after the first take them, and the contact that they make.
namespace tandem {

/// The posed float64 points of a triangle's corners. pose: of stored coordinates; precise: the corners where
/// they are no float32 numbers, or null.
TANDEM_HD inline void pose_corners(const Pose& pose, const Triangle& triangle, const PreciseCorners* precise,
                                   double (&out)[3][3]) {
  for (int c = 0; c < 3; ++c) {
    const float* const p = triangle.corner[c].position;
    double x[3] = {p[0], p[1], p[2]};
    for (int k = 0; k < 3 && precise != nullptr; ++k) x[k] = precise->position[c][k];
    apply(pose, x[0], x[1], x[2], out[c]);
  }
}

TANDEM_HD inline void pose_corners(const Pose& pose, const LevelView& tree, std::uint32_t triangle,
                                   double (&out)[3][3]) {
  pose_corners(pose, tree.triangles[triangle], tree.precise != nullptr ? &tree.precise[triangle] : nullptr,
               out);
}

/// The posed float64 points. The poses are those of stored coordinates.
TANDEM_HD inline TrianglePair posed_pair(const Pose& pose_a, const LevelView& tree_a, std::uint32_t a,
                                         const Pose& pose_b, const LevelView& tree_b, std::uint32_t b) {
  TrianglePair pair;
  pose_corners(pose_a, tree_a, a, pair.a);
  pose_corners(pose_b, tree_b, b, pair.b);
  return pair;
}

/// As above, of trees whose corners are float32 numbers.
TANDEM_HD inline TrianglePair posed_pair(const Pose& pose_a, const Triangle& a, const Pose& pose_b,
                                         const Triangle& b) {
  TrianglePair pair;
  pose_corners(pose_a, a, nullptr, pair.a);
  pose_corners(pose_b, b, nullptr, pair.b);
  return pair;
}

/// float32 points in a's frame, which mode fast decides on.
TANDEM_HD inline TrianglePair framed_pair(const RelativePose& b_in_a, const Triangle& a, const Triangle& b) {
  const TriangleInFrame in_a = stored_triangle(a), of_b = posed_triangle(b_in_a, b);
  TrianglePair pair;
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < 3; ++k) {
      pair.a[c][k] = static_cast<double>(in_a.corner[c].x[k]);
      pair.b[c][k] = static_cast<double>(of_b.corner[c].x[k]);
    }
  }
  return pair;
}

/// In a pair of an instance with itself the triangle with the lower index comes first.
TANDEM_HD inline Contact make_contact(std::uint32_t pair, bool self, std::uint32_t a, std::uint32_t b,
                                      std::uint32_t face_a, std::uint32_t face_b) {
  return self && a > b ? Contact{pair, b, a, face_b, face_a} : Contact{pair, a, b, face_a, face_b};
}

}  // namespace tandem
