#include "dynamics/cuda/gpu_simulation.h"

#include <algorithm>
#include <vector>

#include "dynamics/cuda/cuda_simulation.cuh"
#include "kernels/common/stopwatch.h"

namespace tandem::dynamics {

struct GpuSimulation::Parts {
  CudaSimulation on_gpu;
  GpuFilter filter;
  std::unique_ptr<ContinuousMotion> continuous;
  std::vector<BodyProperties> bodies;
  std::vector<BodyState> states;
  std::vector<std::uint32_t> groups;
  SimulationOptions options;
  std::uint64_t steps = 0;

  void check(Status status, std::uint64_t where = 0) const {
    if (status == Status::kOk) return;
    if (status == Status::kOutOfMemory) throw std::bad_alloc();
    if (subject(status) != nullptr) throw QueryFailed{status, where};
    const cudaError_t error = on_gpu.error() != cudaSuccess ? on_gpu.error() : filter.error();
    throw GpuFailed{status, error != cudaSuccess ? error : cudaErrorUnknown};
  }

  ParallelSimulation<CudaExecutor, CudaQuestions>& simulation() { return *on_gpu.simulation; }
  void read_states() { check(on_gpu.executor.copy(simulation().arrays().start, std::span(states))); }
};

GpuSimulation::GpuSimulation(std::span<const AssetView> assets, std::span<const BodyProperties> bodies,
                             std::span<const BodyState> states, const PairFilter& filter,
                             const SimulationOptions& options, bool is_continuous)
    : parts_(std::make_unique<Parts>()) {
  Parts& parts = *parts_;
  parts.bodies.assign(bodies.begin(), bodies.end());
  parts.states.assign(states.begin(), states.end());
  parts.groups.assign(bodies.size(), Sleep::kAwake);
  parts.options = options;
  std::uint64_t where = 0;
  const Status status = parts.on_gpu.set_assets(assets, nullptr, where);
  parts.check(status, where);
  parts.check(parts.filter.upload(filter, bodies.size(), parts.on_gpu.executor));
  parts.check(parts.filter.exclude(filter.excluded, parts.on_gpu.executor));
  parts.on_gpu.questions.set_filter(parts.filter.view());
  if (is_continuous) parts.continuous = std::make_unique<ContinuousMotion>(assets, options.threads, &filter);
  parts.check(parts.on_gpu.set_bodies(
      bodies, states, {}, {options.gravity, options.solver, options.sleep, parts.continuous.get()}));
}

GpuSimulation::~GpuSimulation() = default;

StepRecord GpuSimulation::step() {
  Parts& parts = *parts_;
  Stopwatch stopwatch;
  StepRecord record;
  const Status status = parts.simulation().step(parts.options.dt);
  const bool of_body = status == Status::kOutOfRange && parts.simulation().bad_body() != kNoIndex;
  parts.check(status, of_body ? parts.simulation().bad_body() : parts.on_gpu.questions.where());
  parts.check(parts.on_gpu.executor.wait());
  record.step_seconds = stopwatch.lap();
  record.time = static_cast<double>(++parts.steps) * parts.options.dt;
  ContactSums sums;
  parts.check(parts.simulation().sum_contacts(sums));
  record.contacts = sums.contacts;
  record.penetration_max = sums.deepest, record.penetration_mean = sums.mean_depth(parts.options.solver.slop);
  const auto& [contacts, manifolds] = parts.on_gpu.questions.found();
  record.triangle_pairs = contacts.contacts;
  record.segments = manifolds.segments, record.patches = manifolds.manifolds;
  record.open_curves = manifolds.open_curves;
  parts.read_states();
  parts.check(parts.on_gpu.executor.copy(parts.simulation().arrays().group, std::span(parts.groups)));
  record.sleeping =
      parts.groups.size() - static_cast<std::size_t>(std::ranges::count(parts.groups, Sleep::kAwake));
  measure(parts.bodies, parts.states, parts.options.gravity, record);
  return record;
}

std::span<const BodyProperties> GpuSimulation::bodies() const {
  return parts_->bodies;
}

std::span<const BodyState> GpuSimulation::states() const {
  return parts_->states;
}

void GpuSimulation::place(std::uint32_t body, const BodyState& state) {
  Parts& parts = *parts_;
  parts.states[body] = state;
  parts.check(parts.simulation().place(body, state));
}

SimulationState GpuSimulation::save() {
  SimulationState state;
  parts_->check(parts_->simulation().save(parts_->bodies, state));
  state.step = parts_->steps;
  return state;
}

void GpuSimulation::restore(const SimulationState& state) {
  parts_->check(parts_->simulation().restore(parts_->bodies, state));
  parts_->steps = state.step;
  parts_->states = state.states;
}

}  // namespace tandem::dynamics
