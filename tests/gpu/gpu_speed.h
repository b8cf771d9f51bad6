#pragma once
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_stream.h"
#include "tandem/formats/status.h"

// Programs that measure on a GPU share this. They end with 77 where there is none, and with 1 at any other
// error.
namespace tandem {

inline void expect(Status status, const char* what) {
  if (status == Status::kOk) return;
  std::fprintf(stderr, "%s: %s\n", what, name(status));
  std::exit(status == Status::kNoGpu ? 77 : 1);
}
inline void expect(cudaError_t error, const char* what) {
  if (error == cudaSuccess) return;
  std::fprintf(stderr, "%s: %s\n", what, cudaGetErrorString(error));
  std::exit(1);
}

template <typename Element>
void upload(const std::vector<Element>& from, GpuArray<Element>& to, const char* what) {
  expect(to.upload(from, nullptr), what);
  expect(cudaStreamSynchronize(nullptr), what);
}

/// Returns the median time of a graph's launches, in ms, after some that do not count. enqueue(stream): a
/// Status.
template <typename Enqueue>
double median_of(int launches, cudaStream_t stream, const Enqueue& enqueue) {
  constexpr int kFirst = 5;
  GpuGraph graph;
  expect(graph.capture(stream, [&] { expect(enqueue(stream), "enqueue"); }), "capture");
  GpuEvent begin, end;
  expect(begin.create(), "event");
  expect(end.create(), "event");
  std::vector<float> times;
  for (int i = 0; i < launches + kFirst; ++i) {
    expect(begin.record(stream), "record");
    expect(graph.launch(stream), "launch");
    expect(end.record(stream), "record");
    expect(end.wait(), "wait");
    float milliseconds = 0;
    expect(milliseconds_between(begin, end, milliseconds), "time");
    if (i >= kFirst) times.push_back(milliseconds);
  }
  std::nth_element(times.begin(), times.begin() + launches / 2, times.end());
  return double{times[static_cast<std::size_t>(launches / 2)]};
}

}  // namespace tandem
