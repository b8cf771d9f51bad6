#pragma once
#include "kernels/scene/broad_phase_tree.cuh"
#include "tandem/kernels/gpu_broad_phase.h"

// Writes the pairs and the report of a broad phase.
namespace tandem {
namespace {

// A rule says which of the pairs whose boxes meet are written.
struct EveryPair {
  TANDEM_HD const std::uint32_t* worlds() const { return nullptr; }
  __device__ bool operator()(std::uint32_t, std::uint32_t) const { return true; }
};
struct FilteredPairs {
  PairFilter filter;

  // By these, boxes are told apart before any pair of them is asked about.
  TANDEM_HD const std::uint32_t* worlds() const { return filter.world; }
  __device__ bool operator()(std::uint32_t a, std::uint32_t b) const { return filter.looks_at(a, b); }
};

// How pairs are written: a << shift_a | b << shift_b. An ObjectPair's bytes, or what sorts as it should.
struct Output {
  unsigned long long* pairs;
  std::uint32_t capacity;
  int shift_a, shift_b;
  Counters* counters;
  GpuBroadPhaseReport *report, *host_report;  // in GPU and in CPU memory

  __device__ void write(unsigned long long place, std::uint32_t a, std::uint32_t b) const {
    if (place < capacity) pairs[place] = key(a, b);
  }
  __device__ unsigned long long key(std::uint32_t a, std::uint32_t b) const {
    return static_cast<unsigned long long>(a) << shift_a | static_cast<unsigned long long>(b) << shift_b;
  }
};

// Writes the report, and readies the counters for the next time.
__device__ void write_report(const Output& output, unsigned long long found) {
  const unsigned long long error = *static_cast<volatile unsigned long long*>(&output.counters->error);
  if (error != kNoError) found = 0;
  *output.counters = kFreshCounters;
  GpuBroadPhaseReport report;
  report.status = error == kNoError ? Status::kOk : static_cast<Status>(error & 0xFFFFFFFFu);
  report.where = error == kNoError ? kNoIndex : static_cast<std::uint32_t>(error >> 32);
  report.complete = found <= output.capacity;
  report.found = found;
  report.count = static_cast<std::uint32_t>(min(found, 0xFFFFFFFFull));
  *output.report = *output.host_report = report;
}

}  // namespace
}  // namespace tandem
