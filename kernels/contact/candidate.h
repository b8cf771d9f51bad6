#pragma once
#include "kernels/contact/leaf_planes.h"
#include "kernels/geometry/triangle_test.h"
#include "tandem/kernels/contact_query.h"

/// The two triangles of a candidate as the stages after the first take them, and the contact that they make.
namespace tandem {

/// The posed float64 points. The poses are those of stored coordinates.
TANDEM_HD inline TrianglePair posed_pair(const Pose& pose_a, const Triangle& a, const Pose& pose_b,
                                         const Triangle& b) {
  TrianglePair pair;
  for (int c = 0; c < 3; ++c) {
    const float *p = a.corner[c].position, *q = b.corner[c].position;
    apply(pose_a, p[0], p[1], p[2], pair.a[c]);
    apply(pose_b, q[0], q[1], q[2], pair.b[c]);
  }
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
