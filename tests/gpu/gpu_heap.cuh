#pragma once
#include "dynamics/cuda/parallel_newton_step.cuh"
#include "dynamics/cuda/parallel_soft_step.cuh"
#include "dynamics/random_heap.h"
#include "tandem/formats/gpu_stream.h"

namespace tandem::dynamics {

/// A RandomHeap in the memory of a GPU, and its step.
class GpuHeap {
 public:
  /// Copies the heap, which must stay until that is done, and makes room for its step as usual_room() says.
  Status upload(const RandomHeap& heap, cudaStream_t stream) {
    executor_.set_stream(stream);
    body_count_ = static_cast<std::uint32_t>(heap.bodies.size());
    pair_count_ = static_cast<std::uint32_t>(heap.pairs.size());
    contact_count_ = static_cast<std::uint32_t>(heap.contacts.size());
    options_ = heap.options, dt_ = heap.dt;
    count_of_pairs_.assign(1, pair_count_);
    for (const cudaError_t error :
         {bodies_.upload(heap.bodies, stream), states_.upload(heap.states, stream),
          states_after_.upload(heap.states, stream), pulls_.upload(heap.pulls, stream),
          contacts_.upload(heap.contacts, stream), impulses_.upload(heap.impulses, stream),
          impulses_after_.upload(heap.impulses, stream), done_.upload(heap.impulses, stream),
          pairs_.upload(heap.pairs, stream), count_.upload(count_of_pairs_, stream)})
      executor_.take(error);
    if (executor_.status() != Status::kOk) return executor_.status();
    const Status status = step_.reserve(executor_, usual_room(body_count_, pair_count_, contact_count_));
    return status == Status::kOk ? newton_.reserve(executor_, body_count_, pair_count_, kUnits) : status;
  }

  SoftStepInput input() const {
    return {bodies_.data(),   states_.data(), pulls_.data(), body_count_, contacts_.data(),
            impulses_.data(), pairs_.data(),  count_.data(), pair_count_, dt_};
  }
  SoftStepOutput output() const { return {states_after_.data(), impulses_after_.data(), done_.data()}; }
  const SolverOptions& options() const { return options_; }
  ParallelSoftStep<CudaExecutor>& step() { return step_; }
  CudaExecutor& executor() { return executor_; }

  /// Queues the step: by Newton's method too, unless the options say soft.
  void queue() {
    SoftStepInput left = input();
    if (options_.kind != SolverKind::soft) left = newton_.step(executor_, left, options_, output());
    step_.step(executor_, left, options_, output());
  }

  /// Makes the step, and room for it where there is too little. Waits for the GPU.
  Status make_step() {
    for (;;) {
      queue();
      SoftStepNeeds needs = {};
      executor_.take(download<SoftStepNeeds>(step_.needs(), {&needs, 1}, executor_.stream()));
      newton_needs_ = {.has_room = 1};
      if (options_.kind != SolverKind::soft)
        executor_.take(download<NewtonNeeds>(newton_.needs(), {&newton_needs_, 1}, executor_.stream()));
      const bool has_room = needs.has_room != 0 && newton_needs_.has_room != 0;
      if (executor_.status() != Status::kOk || has_room) return executor_.status();
      Status status = step_.reserve(executor_, larger_room(step_.room(), needs));
      if (status == Status::kOk)
        status = newton_.reserve(executor_, body_count_, pair_count_, newton_needs_.units);
      if (status != Status::kOk) return status;
    }
  }
  /// Captures the step in a graph, and makes it as often as that. Condition: there is room; it has a stream.
  cudaError_t make_steps_in_graph(int steps) {
    GpuGraph graph;
    cudaError_t error = graph.capture(executor_.stream(), [&] { queue(); });
    for (int i = 0; i < steps && error == cudaSuccess; ++i) error = graph.launch(executor_.stream());
    return error == cudaSuccess ? cudaStreamSynchronize(executor_.stream()) : error;
  }

  /// Returns what Newton's method did in the last step that was made.
  const NewtonNeeds& newton_needs() const { return newton_needs_; }

  Status read(HeapResult& result) {
    result.states.resize(body_count_), result.impulses.resize(contact_count_);
    result.done.resize(contact_count_);
    executor_.take(download<BodyState>(states_after_.data(), result.states, executor_.stream()));
    executor_.take(download<ContactImpulse>(impulses_after_.data(), result.impulses, executor_.stream()));
    executor_.take(download<ContactImpulse>(done_.data(), result.done, executor_.stream()));
    return executor_.status();
  }

 private:
  static constexpr std::uint32_t kUnits = 1024;  // to begin with

  CudaExecutor executor_;
  ParallelSoftStep<CudaExecutor> step_;
  ParallelNewtonStep<CudaExecutor> newton_;
  NewtonNeeds newton_needs_ = {};
  SolverOptions options_;
  double dt_ = 0;
  std::uint32_t body_count_ = 0, pair_count_ = 0, contact_count_ = 0;
  std::vector<std::uint32_t> count_of_pairs_;
  GpuArray<BodyProperties> bodies_;
  GpuArray<BodyState> states_, states_after_;
  GpuArray<Pull> pulls_;
  GpuArray<ContactPoint> contacts_;
  GpuArray<ContactImpulse> impulses_, impulses_after_, done_;
  GpuArray<ContactPair> pairs_;
  GpuArray<std::uint32_t> count_;
};

}  // namespace tandem::dynamics
