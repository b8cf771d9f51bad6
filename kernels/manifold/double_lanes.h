#pragma once
#include "kernels/common/lanes.h"

#ifdef TANDEM_HAVE_LANES
#include "kernels/manifold/body.h"
#include "tandem/formats/view.h"

// Vectors of float64, with the operations of vector3.h lane by lane and in its order: the same bits.
namespace tandem {
namespace {

/// Bit i for lane i.
TANDEM_INLINE unsigned bits_of_mask(const DoubleMask<2>& mask) {
#if defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(mask)));
#else
  return static_cast<unsigned>((mask[0] & 1) | (mask[1] & 2));
#endif
}
TANDEM_INLINE unsigned bits_of_mask(const DoubleMask<4>& mask) {
#if defined(__AVX__)
  return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask)));
#else
  const auto low = __builtin_shufflevector(mask, mask, 0, 1),
             high = __builtin_shufflevector(mask, mask, 2, 3);
  return bits_of_mask(low) | bits_of_mask(high) << 2;
#endif
}

TANDEM_INLINE DoubleLanes<2> square_root(const DoubleLanes<2>& x) {
#if defined(__SSE2__)
  return reinterpret_cast<DoubleLanes<2>>(_mm_sqrt_pd(reinterpret_cast<__m128d>(x)));
#elif defined(__aarch64__)
  return reinterpret_cast<DoubleLanes<2>>(vsqrtq_f64(reinterpret_cast<float64x2_t>(x)));
#else
  return DoubleLanes<2>{std::sqrt(x[0]), std::sqrt(x[1])};
#endif
}
TANDEM_INLINE DoubleLanes<4> square_root(const DoubleLanes<4>& x) {
#if defined(__AVX__)
  return reinterpret_cast<DoubleLanes<4>>(_mm256_sqrt_pd(reinterpret_cast<__m256d>(x)));
#else
  const DoubleLanes<2> low = square_root(__builtin_shufflevector(x, x, 0, 1)),
                       high = square_root(__builtin_shufflevector(x, x, 2, 3));
  return __builtin_shufflevector(low, high, 0, 1, 2, 3);
#endif
}

template <int kCount>
TANDEM_INLINE DoubleLanes<kCount> magnitude_of(const DoubleLanes<kCount>& x) {
  return reinterpret_cast<DoubleLanes<kCount>>(reinterpret_cast<DoubleMask<kCount>>(x) & 0x7FFFFFFFFFFFFFFF);
}

/// A vector in each lane.
template <int kCount>
struct Vector3Lanes {
  DoubleLanes<kCount> x, y, z;

  TANDEM_INLINE friend Vector3Lanes operator-(const Vector3Lanes& p, const Vector3Lanes& q) {
    return {p.x - q.x, p.y - q.y, p.z - q.z};
  }
  TANDEM_INLINE friend Vector3Lanes operator-(const Vector3Lanes& p, const manifold::Vector3& q) {
    return {p.x - q.x, p.y - q.y, p.z - q.z};
  }
  TANDEM_INLINE friend DoubleLanes<kCount> dot(const Vector3Lanes& p, const Vector3Lanes& q) {
    return p.x * q.x + p.y * q.y + p.z * q.z;
  }
  TANDEM_INLINE friend DoubleLanes<kCount> dot(const manifold::Vector3& p, const Vector3Lanes& q) {
    return p.x * q.x + p.y * q.y + p.z * q.z;
  }
  TANDEM_INLINE friend Vector3Lanes cross(const Vector3Lanes& p, const Vector3Lanes& q) {
    return {p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
  }
};

/// apply(), lane by lane.
template <int kCount>
TANDEM_INLINE Vector3Lanes<kCount> posed(const Pose& pose, const Vector3Lanes<kCount>& p) {
  const auto row = [&](int i) {
    const double* r = pose.rotation[i];
    return r[0] * p.x + r[1] * p.y + r[2] * p.z + pose.translation[i];
  };
  return {row(0), row(1), row(2)};
}

/// transpose() of rows of four float64.
TANDEM_INLINE void transpose(DoubleLanes<4> (&rows)[4]) {
  const auto a = __builtin_shufflevector(rows[0], rows[1], 0, 4, 2, 6),
             b = __builtin_shufflevector(rows[0], rows[1], 1, 5, 3, 7),
             c = __builtin_shufflevector(rows[2], rows[3], 0, 4, 2, 6),
             d = __builtin_shufflevector(rows[2], rows[3], 1, 5, 3, 7);
  rows[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  rows[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  rows[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  rows[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

/// A corner of four triangles, by their indices, posed.
TANDEM_INLINE Vector3Lanes<4> posed_corner(const manifold::Body& body, const std::uint32_t* index,
                                           int corner) {
  Lanes4 rows[4];
  for (int i = 0; i < 4; ++i) rows[i] = load(body.shape->triangles[index[i]].corner[corner].position);
  transpose(rows);
  return posed<4>(body.pose, {__builtin_convertvector(rows[0].v, DoubleLanes<4>),
                              __builtin_convertvector(rows[1].v, DoubleLanes<4>),
                              __builtin_convertvector(rows[2].v, DoubleLanes<4>)});
}

/// 1 for each of four triangles that is turned, else 0.
TANDEM_INLINE Vector<4>::Bits turned_lanes(const manifold::Body& body, const std::uint32_t* index) {
  const TriangleTopology* const t = body.shape->topology;
  const auto flags = [&](int i) { return static_cast<std::int32_t>(t[index[i]].flags); };
  static_assert(kTurned == 1);
  return Vector<4>::Bits{flags(0), flags(1), flags(2), flags(3)} & 1;
}

}  // namespace
}  // namespace tandem
#endif
