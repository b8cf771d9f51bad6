#pragma once
#include <math_constants.h>

#include "kernels/scene/broad_phase_boxes.cuh"

// Makes the keys that the broad phase sorts boxes by.
namespace tandem {
namespace {

// ---------------------------------------------------------------------------------------------------------
// The survey: four blocks, one for each axis and one for sizes.

constexpr std::uint32_t kSamples = 256;
constexpr std::uint32_t kThreadsPerSample = 4;

template <typename Boxes>
__global__ void __launch_bounds__(kSamples* kThreadsPerSample)
    survey_boxes(const __grid_constant__ Boxes boxes, std::uint32_t count, Survey* survey) {
  gpu::wait_for_kernel_before();
  __shared__ double given[kSamples], samples[kSamples];
  const std::uint32_t taken = min(count, kSamples), axis = blockIdx.x;
  if (threadIdx.x < kSamples) {
    double sample = CUDART_INF;
    if (threadIdx.x < taken) {
      const std::uint64_t i = static_cast<std::uint64_t>(threadIdx.x) * count / taken;
      WorldBox box;
      static_cast<void>(boxes.get(static_cast<std::uint32_t>(i), box));
      sample = axis == 0   ? centre(box, 0)
               : axis == 1 ? centre(box, 1)
               : axis == 2 ? centre(box, 2)
                           : longest_edge(box);
    }
    if (isnan(sample)) sample = CUDART_INF;  // of a box that will be refused
    given[threadIdx.x] = sample;
  }
  __syncthreads();
  // Sorted by counting those before, a part of them in each thread.
  const std::uint32_t i = threadIdx.x / kThreadsPerSample;
  const double sample = given[i];
  std::uint32_t rank = 0;
  for (std::uint32_t j = threadIdx.x % kThreadsPerSample; j < kSamples; j += kThreadsPerSample)
    rank += given[j] < sample || (given[j] == sample && j < i);
  for (std::uint32_t step = 1; step < kThreadsPerSample; step *= 2)
    rank += __shfl_xor_sync(kAllLanes, rank, step);
  if (threadIdx.x % kThreadsPerSample == 0) samples[rank] = sample;
  __syncthreads();
  if (threadIdx.x != 0) return;
  const std::uint32_t last = taken - 1, margin = taken / 64;
  const double median = samples[taken / 2];
  if (axis == 3) {
    survey->edge = median;
    return;
  }
  double reach = 1.125 * fmax(median - samples[margin], samples[last - margin] - median);
  if (!(reach > 0)) reach = fmax(median - samples[0], samples[last] - median);
  survey->median[axis] = median;
  survey->reach[axis] = reach;
}

// ---------------------------------------------------------------------------------------------------------
// Keys.

// float(x) of the text above. Distances to the median in reaches.
struct Scale {
  double origin[3];
  double factor;

  __device__ float operator()(double x, int axis) const {
    return static_cast<float>((x - origin[axis]) * factor);
  }
};

__device__ Scale scale_of(const Survey& survey) {
  Scale scale;
  for (int k = 0; k < 3; ++k) scale.origin[k] = survey.median[k];
  // At least 1e-290: its inverse is finite.
  scale.factor = 1 / fmax(fmax(survey.reach[0], survey.reach[1]), fmax(survey.reach[2], 1e-290));
  return scale;
}

// 7/8 of the cells divide [-1, 1] evenly; the others, on either side, get longer and longer, up to the ends
// of float32's range. So a body that has flown away costs the others no resolution.
__device__ std::uint32_t cell_of(float x) {
  constexpr int kBeyondBits = kAxisBits - 4;
  constexpr std::uint32_t kBeyond = 1u << kBeyondBits;
  const float distance = fabsf(x);
  if (distance < 1)
    return static_cast<std::uint32_t>((x + 1) * static_cast<float>(kCells / 2 - kBeyond)) + kBeyond;
  // From 1.0f to infinity there are 2^30 floats.
  const std::uint32_t floats = __float_as_uint(distance) - __float_as_uint(1.0f);
  const std::uint32_t beyond = min(floats >> (30 - kBeyondBits), kBeyond - 1);
  return x > 0 ? kCells - kBeyond + beyond : kBeyond - 1 - beyond;
}

// Puts two zeros between bits.
__device__ std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 32) & 0x001F00000000FFFFull;
  x = (x | x << 16) & 0x001F0000FF0000FFull;
  x = (x | x << 8) & 0x100F00F00F00F00Full;
  x = (x | x << 4) & 0x10C30C30C30C30C3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

// Position on Hilbert's curve. Source: Skilling, Programming the Hilbert curve, 2004.
__device__ std::uint64_t along_curve(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  for (std::uint32_t bit = kCells / 2; bit > 1; bit /= 2) {
    const std::uint32_t below = bit - 1;
    if (x & bit) x ^= below;
    std::uint32_t swap = (x ^ y) & below;
    if (y & bit) {
      x ^= below;
    } else {
      x ^= swap;
      y ^= swap;
    }
    swap = (x ^ z) & below;
    if (z & bit) {
      x ^= below;
    } else {
      x ^= swap;
      z ^= swap;
    }
  }
  y ^= x;
  z ^= y;
  std::uint32_t parity = z >> 1;  // of the bits above each
  for (int shift = 1; shift < kAxisBits; shift *= 2) parity ^= parity >> shift;
  return spread(x ^ parity) << 2 | spread(y ^ parity) << 1 | spread(z ^ parity);
}

// Boxes up to four times the median are of class 0, and each class reaches four times as far as the one
// before. A group of boxes is then about as large as its boxes or its share of space, never as large as a
// huge box that happens to lie among small ones.
__device__ std::uint32_t class_of(double edge, const Survey& survey, const Scale& scale) {
  const float least = fmaxf(static_cast<float>(survey.edge * scale.factor), 0x1p-20f);
  const float ratio = static_cast<float>(edge * scale.factor) / least;
  if (!(ratio >= 4)) return 0;
  const std::uint32_t octaves = (__float_as_uint(ratio) >> 23) - 127;
  return min(octaves / 2, (1u << kClassBits) - 1);
}

// The worlds of boxes and how keys begin with them; null: there is one.
struct WorldKeys {
  const std::uint32_t* world;
  int bits;  ///< so many of its lowest bits: the others of worlds that share them are told apart by the tree

  __device__ Key before(Key rest, std::uint32_t box) const {
    if (world == nullptr) return rest;
    return rest >> bits | static_cast<Key>(world[box]) << (64 - bits);
  }
};

template <typename Boxes>
__global__ void __launch_bounds__(256)
    make_keys(const __grid_constant__ Boxes boxes, std::uint32_t count, int index_bits, const Survey* survey,
              const __grid_constant__ WorldKeys worlds, Key* keys, Counters* counters) {
  gpu::wait_for_kernel_before();
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  WorldBox box;
  take(boxes, i, counters, box);
  const Survey known = *survey;
  const Scale scale = scale_of(known);
  std::uint32_t cell[3];
  for (int k = 0; k < 3; ++k) cell[k] = cell_of(scale(centre(box, k), k));
  const Key place = static_cast<Key>(class_of(longest_edge(box), known, scale)) << 3 * kAxisBits |
                    along_curve(cell[0], cell[1], cell[2]);
  const std::uint32_t number = boxes.number(i);
  keys[i] = worlds.before(place << kUnusedBits, number) >> index_bits << index_bits | number;
}

}  // namespace
}  // namespace tandem
