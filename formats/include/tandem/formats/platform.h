#pragma once
#include <bit>

/// Marks functions that run on the CPU and on the GPU alike.
#if defined(__CUDACC__)
#define TANDEM_HD __host__ __device__
#else
#define TANDEM_HD
#endif

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ != 0)
#error \
    "Tandem relies on IEEE infinities and NaN (imaginary nodes, exact predicates): build without -ffast-math"
#endif

static_assert(std::endian::native == std::endian::little,
              "a .bvh file is little endian and is used in place");
