#pragma once

// Vectors of GCC and clang; a compiler without them builds the scalar ways alone.
#if defined(__GNUC__) && defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector)
#define TANDEM_HAVE_LANES 1
#endif
#endif

#ifdef TANDEM_HAVE_LANES
#if defined(__SSE2__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif
#include <cstdint>

// Vectors wider than the machine's have no way to be passed, and need none: all is inlined.
#pragma GCC diagnostic ignored "-Wpsabi"

// Vectors of 4, 8 or 16 float32, and of float64. Included by files that are compiled for different machines:
// all of it has internal linkage, also what is instantiated with the types of this file, so that no function
// compiled for one machine is linked into code for another.
namespace tandem {
namespace {

#define TANDEM_INLINE [[gnu::always_inline]] inline

template <int kCount>
struct Vector {
  using Floats [[gnu::vector_size(4 * kCount)]] = float;
  using Bits [[gnu::vector_size(4 * kCount)]] = std::int32_t;
};

template <int kCount>
struct Lanes;

/// A truth value for each lane.
template <int kCount>
struct LaneMask {
  using Bits = typename Vector<kCount>::Bits;
  Bits bits;

  TANDEM_INLINE static LaneMask all() { return {~Bits{}}; }
  TANDEM_INLINE friend LaneMask operator&(LaneMask a, LaneMask b) { return {a.bits & b.bits}; }
  TANDEM_INLINE friend LaneMask operator|(LaneMask a, LaneMask b) { return {a.bits | b.bits}; }
  TANDEM_INLINE friend LaneMask operator^(LaneMask a, LaneMask b) { return {a.bits ^ b.bits}; }
  TANDEM_INLINE friend LaneMask operator!(LaneMask a) { return {~a.bits}; }
  TANDEM_INLINE friend bool any(LaneMask a) { return a.mask() != 0; }

  /// Drops the lanes where x <= y is not true.
  TANDEM_INLINE void require(const Lanes<kCount>& x, const Lanes<kCount>& y) { bits &= x.v <= y.v; }

  /// Bit i for lane i.
  TANDEM_INLINE unsigned mask() const {
#if defined(__AVX__)
    if constexpr (kCount == 8)
      return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(bits)));
#endif
#if defined(__SSE2__)
    if constexpr (kCount == 4) return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(bits)));
#elif defined(__aarch64__)
    const typename LaneMask<4>::Bits place = {1, 2, 4, 8};
    return static_cast<unsigned>(vaddvq_s32(reinterpret_cast<int32x4_t>(bits & place)));
#endif
    unsigned out = 0;
    for (int i = 0; i < kCount; ++i) out |= (bits[i] & 1u) << i;
    return out;
  }
};

#if defined(__AVX512F__)
template <>
struct LaneMask<16> {
  __mmask16 bits;

  TANDEM_INLINE static LaneMask all() { return {0xFFFF}; }
  TANDEM_INLINE friend LaneMask operator&(LaneMask a, LaneMask b) { return {_kand_mask16(a.bits, b.bits)}; }
  TANDEM_INLINE friend LaneMask operator|(LaneMask a, LaneMask b) { return {_kor_mask16(a.bits, b.bits)}; }
  TANDEM_INLINE friend LaneMask operator^(LaneMask a, LaneMask b) { return {_kxor_mask16(a.bits, b.bits)}; }
  TANDEM_INLINE friend LaneMask operator!(LaneMask a) { return {_knot_mask16(a.bits)}; }
  TANDEM_INLINE friend bool any(LaneMask a) { return a.bits != 0; }
  TANDEM_INLINE void require(const Lanes<16>& x, const Lanes<16>& y);
  TANDEM_INLINE unsigned mask() const { return bits; }
};
#endif

template <int kCount>
struct Lanes {
  static constexpr int kLanes = kCount;
  using Floats = typename Vector<kCount>::Floats;
  using Bits = typename Vector<kCount>::Bits;
  Floats v;

  TANDEM_INLINE friend Lanes operator+(const Lanes& a, const Lanes& b) { return {a.v + b.v}; }
  TANDEM_INLINE friend Lanes operator+(const Lanes& a, float b) { return {a.v + b}; }
  TANDEM_INLINE friend Lanes operator-(const Lanes& a, const Lanes& b) { return {a.v - b.v}; }
  TANDEM_INLINE friend Lanes operator-(const Lanes& a) { return {-a.v}; }
  TANDEM_INLINE friend Lanes operator*(const Lanes& a, const Lanes& b) { return {a.v * b.v}; }
  TANDEM_INLINE friend Lanes operator*(float a, const Lanes& b) { return {a * b.v}; }
  TANDEM_INLINE friend Lanes operator/(const Lanes& a, const Lanes& b) { return {a.v / b.v}; }
  TANDEM_INLINE friend LaneMask<kCount> less(const Lanes& a, const Lanes& b) {
#if defined(__AVX512F__)
    if constexpr (kCount == 16) {
      return {_mm512_cmp_ps_mask(reinterpret_cast<__m512>(a.v), reinterpret_cast<__m512>(b.v), _CMP_LT_OQ)};
    } else
#endif
    {
      return {a.v < b.v};
    }
  }
  TANDEM_INLINE friend Lanes magnitude(const Lanes& a) {
    return {reinterpret_cast<Floats>(reinterpret_cast<Bits>(a.v) & 0x7FFFFFFF)};
  }
  TANDEM_INLINE friend Lanes square_root(const Lanes& a) {
#if defined(__AVX512F__)
    if constexpr (kCount == 16)
      return {reinterpret_cast<Floats>(_mm512_maskz_sqrt_ps(0xFFFF, reinterpret_cast<__m512>(a.v)))};
#endif
#if defined(__AVX__)
    if constexpr (kCount == 8)
      return {reinterpret_cast<Floats>(_mm256_sqrt_ps(reinterpret_cast<__m256>(a.v)))};
#endif
#if defined(__SSE2__)
    if constexpr (kCount == 4) return {reinterpret_cast<Floats>(_mm_sqrt_ps(reinterpret_cast<__m128>(a.v)))};
#elif defined(__aarch64__)
    if constexpr (kCount == 4)
      return {reinterpret_cast<Floats>(vsqrtq_f32(reinterpret_cast<float32x4_t>(a.v)))};
#endif
    Lanes out;
    for (int i = 0; i < kCount; ++i) out.v[i] = __builtin_sqrtf(a.v[i]);
    return out;
  }
  TANDEM_INLINE friend Lanes select(LaneMask<kCount> mask, const Lanes& a, const Lanes& b) {
#if defined(__AVX512F__)
    if constexpr (kCount == 16) {
      return {reinterpret_cast<Floats>(
          _mm512_mask_blend_ps(mask.bits, reinterpret_cast<__m512>(b.v), reinterpret_cast<__m512>(a.v)))};
    } else
#endif
    {
      return {mask.bits ? a.v : b.v};
    }
  }
  TANDEM_INLINE friend Lanes larger(const Lanes& a, const Lanes& b) {
#if defined(__SSE2__)
    if constexpr (kCount == 4) return {_mm_max_ps(b.v, a.v)};
#endif
#if defined(__AVX512F__)
    if constexpr (kCount == 16)
      return {reinterpret_cast<Floats>(
          _mm512_maskz_max_ps(0xFFFF, reinterpret_cast<__m512>(b.v), reinterpret_cast<__m512>(a.v)))};
#endif
    return select(less(a, b), b, a);
  }
  TANDEM_INLINE friend Lanes lesser(const Lanes& a, const Lanes& b) {
#if defined(__SSE2__)
    if constexpr (kCount == 4) return {_mm_min_ps(b.v, a.v)};
#endif
#if defined(__AVX512F__)
    if constexpr (kCount == 16)
      return {reinterpret_cast<Floats>(
          _mm512_maskz_min_ps(0xFFFF, reinterpret_cast<__m512>(b.v), reinterpret_cast<__m512>(a.v)))};
#endif
    return select(less(b, a), b, a);
  }
};

#if defined(__AVX512F__)
TANDEM_INLINE void LaneMask<16>::require(const Lanes<16>& x, const Lanes<16>& y) {
  bits =
      _mm512_mask_cmp_ps_mask(bits, reinterpret_cast<__m512>(x.v), reinterpret_cast<__m512>(y.v), _CMP_LE_OQ);
}
#endif

using Lanes4 = Lanes<4>;

template <int kCount>
struct DoubleVector {
  using Doubles [[gnu::vector_size(8 * kCount)]] = double;
  using Bits [[gnu::vector_size(8 * kCount)]] = std::int64_t;
};

template <int kCount>
using DoubleLanes = typename DoubleVector<kCount>::Doubles;

/// Truth values, 0 or -1 each.
template <int kCount>
using DoubleMask = typename DoubleVector<kCount>::Bits;

TANDEM_INLINE Lanes4 load(const float* four) {
  Lanes4 out;
  __builtin_memcpy(&out, four, sizeof out);
  return out;
}

/// Turns rows into columns, as those of the corners of 4 triangles: lane by lane x, y, z and w.
TANDEM_INLINE void transpose(Lanes4 (&rows)[4]) {
  const auto low01 = __builtin_shufflevector(rows[0].v, rows[1].v, 0, 4, 1, 5);
  const auto high01 = __builtin_shufflevector(rows[0].v, rows[1].v, 2, 6, 3, 7);
  const auto low23 = __builtin_shufflevector(rows[2].v, rows[3].v, 0, 4, 1, 5);
  const auto high23 = __builtin_shufflevector(rows[2].v, rows[3].v, 2, 6, 3, 7);
  rows[0].v = __builtin_shufflevector(low01, low23, 0, 1, 4, 5);
  rows[1].v = __builtin_shufflevector(low01, low23, 2, 3, 6, 7);
  rows[2].v = __builtin_shufflevector(high01, high23, 0, 1, 4, 5);
  rows[3].v = __builtin_shufflevector(high01, high23, 2, 3, 6, 7);
}

}  // namespace
}  // namespace tandem
#endif
