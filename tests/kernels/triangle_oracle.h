#pragma once
#include "tandem/kernels/triangle_test.h"

namespace tandem {

/// Whether the triangles meet, by CGAL's exact constructions: a flat triangle is dispatched as the segment or
/// point that it is.
bool oracle_contact(const TrianglePair& pair);

/// The sign of det(q - p, r - p, s - p), by rational numbers.
int oracle_volume_sign(const double* p, const double* q, const double* r, const double* s);

}  // namespace tandem
