#pragma once
#include <array>

#include "polygon_mesh.h"

namespace tandem::build {

using Point2 = std::array<double, 2>;

/// Sign of the signed area of triangle a b c: 1 counter-clockwise, -1 clockwise, 0 on one line.
/// Exact for all finite coordinates, denormal and huge ones included.
int orientation(const Point2& a, const Point2& b, const Point2& c);

/// Whether a, b and c lie exactly on one line (or on one point). Exact for all finite coordinates.
bool collinear(const Point& a, const Point& b, const Point& c);

}  // namespace tandem::build
