// Measures the solver's step on a GPU, part by part: soft_step_speed
// Prints the median ms of 100 launches of a graph of each part, of heaps of 1,000 and of 100,000 bodies.
#include <cstdio>

#include "gpu/gpu_heap.cuh"
#include "gpu/gpu_speed.h"

namespace tandem::dynamics {
namespace {

void measure(const HeapOptions& options) {
  constexpr int kLaunches = 100;
  const RandomHeap heap(options);
  GpuStream stream;
  expect(status_of(stream.create()), "stream");
  GpuHeap gpu;
  expect(gpu.upload(heap, stream.get()), "upload");
  expect(gpu.make_step(), "step");
  auto& step = gpu.step();
  auto& executor = gpu.executor();
  const auto time = [&](const auto& part) {
    return median_of(kLaunches, stream.get(), [&](cudaStream_t) {
      part();
      return executor.status();
    });
  };
  const double colours = time([&] { step.find_colours(executor, gpu.input()); });
  const double groups = time([&] { step.make_groups(executor); });
  const double fill = time([&] { step.fill(executor, gpu.input(), gpu.options(), gpu.output()); });
  const double all = time([&] { step.step(executor, gpu.input(), gpu.options(), gpu.output()); });
  // Sweeps go on from rows that are filled.
  const double sweeps = time([&] {
                          step.fill(executor, gpu.input(), gpu.options(), gpu.output());
                          step.sweep(executor);
                        }) -
                        fill;
  const double write = time([&] { step.write(executor); });
  SoftStepNeeds needs = {};
  expect(download<SoftStepNeeds>(step.needs(), {&needs, 1}, stream.get()), "needs");
  std::printf("%zu bodies, %zu pairs, %zu contacts, %u groups, %u rows\n", heap.bodies.size(),
              heap.pairs.size(), heap.contacts.size(), needs.groups, needs.rows);
  std::printf("  colours %.3f, groups %.3f, fill %.3f, sweeps %.3f, write %.3f; all %.3f ms\n", colours,
              groups, fill, sweeps, write, all);
}

}  // namespace
}  // namespace tandem::dynamics

int main() {
  using namespace tandem::dynamics;
  measure({.bodies = 1000, .pairs = 2000, .least_contacts = 4, .most_contacts = 4, .is_near = true});
  measure({.bodies = 100000, .pairs = 300000, .least_contacts = 5, .most_contacts = 5, .is_near = true});
}
