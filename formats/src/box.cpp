#include "tandem/formats/box.h"

#include <algorithm>
#include <cmath>

namespace tandem {
namespace {

// x + y = sum + error exactly (Knuth's two-sum; no operation below overflows or underflows: all operands are
// floats or sums of a few floats, far inside the range of double, and IEEE addition is exact where its result
// is subnormal).
struct TwoSum {
  double sum, error;
  TwoSum(double x, double y) : sum(x + y) {
    const double y_part = sum - x;
    error = (x - (sum - y_part)) + (y - y_part);
  }
};

// The sign of a + b + c + d in real arithmetic, where a + b and c + d come as two-sums.
// If both errors vanish, the rounded sum of the two has the sign of the exact one, because rounding keeps
// signs. Otherwise the four terms are summed into a nonoverlapping expansion, whose largest component has the
// sign of the whole (Shewchuk 1997, theorem 10: grow-expansion keeps the components nonoverlapping and
// increasing in magnitude).
int sign_of_sum(const TwoSum& p, const TwoSum& q) {
  double expansion[4] = {0, 0, 0, 0};
  if (p.error == 0 && q.error == 0) {
    expansion[3] = p.sum + q.sum;
  } else {
    int count = 0;
    for (const double term : {p.error, p.sum, q.error, q.sum}) {
      double carry = term;
      for (int i = 0; i < count; ++i) {
        const TwoSum s(carry, expansion[i]);
        expansion[i] = s.error;
        carry = s.sum;
      }
      expansion[count++] = carry;
    }
  }
  for (int i = 3; i >= 0; --i) {
    if (expansion[i] != 0) return expansion[i] > 0 ? 1 : -1;
  }
  return 0;
}

// Returns whether [c_i - h_i, c_i + h_i] lies within [c_o - h_o, c_o + h_o], in real arithmetic: |c_i - c_o|
// + h_i <= h_o. If the distance is exact, only one rounding is left, and rounding is monotone: a sum that
// rounds to less than the double h_o is less than h_o, one that rounds to more is more. Only a tie needs the
// exact sign.
inline bool within(float c_i, float h_i, float c_o, float h_o) {
  const TwoSum distance(std::max(c_i, c_o), -static_cast<double>(std::min(c_i, c_o)));
  if (distance.error == 0) {
    const double reach = distance.sum + h_i;
    if (reach != h_o) return reach < h_o;
  }
  return sign_of_sum(distance, TwoSum(h_i, -static_cast<double>(h_o))) <= 0;
}

// Halves are summed, so that nothing overflows.
float midpoint(float lo, float hi) {
  return 0.5f * lo + 0.5f * hi;
}

}  // namespace

Box enclose(const Position& lo, const Position& hi) {
  Box box;
  for (int k = 0; k < 3; ++k) {
    const float c = midpoint(lo[k], hi[k]);
    box.centre[k] = c;
    box.half_extent[k] = std::max(half_extent_around(c, lo[k], 0), half_extent_around(c, hi[k], 0));
  }
  return box;
}

Box enclose(const Block& block) {
  Box box;
  for (int k = 0; k < 3; ++k) {
    const float* centre = block.centre[k];
    const float* half_extent = block.half_extent[k];
    float lo = std::numeric_limits<float>::infinity(), hi = -lo;
    for (int i = 0; i < kNodesPerBlock; ++i) {  // an imaginary node changes neither: it is [+inf, -inf]
      lo = std::min(lo, centre[i] - half_extent[i]);
      hi = std::max(hi, centre[i] + half_extent[i]);
    }
    const float c = midpoint(lo, hi);
    float h = 0;
    for (int i = 0; i < kNodesPerBlock && block.kind[i] != NodeKind::imaginary; ++i)
      h = std::max(h, half_extent_around(c, centre[i], half_extent[i]));
    box.centre[k] = c;
    box.half_extent[k] = h;
  }
  return box;
}

bool contains(const Box& box, const Position& point) {
  for (int k = 0; k < 3; ++k) {
    if (!within(point[k], 0, box.centre[k], box.half_extent[k])) return false;
  }
  return true;
}

bool contains(const Box& outer, const Box& inner) {
  for (int k = 0; k < 3; ++k) {
    if (!within(inner.centre[k], inner.half_extent[k], outer.centre[k], outer.half_extent[k])) return false;
  }
  return true;
}

bool is_imaginary_box(const Box& box) {
  bool imaginary = true;
  for (int k = 0; k < 3; ++k) {
    imaginary = imaginary && box.centre[k] == 0 && !std::signbit(box.centre[k]) &&
                box.half_extent[k] == kImaginaryHalfExtent;
  }
  return imaginary;
}

}  // namespace tandem
