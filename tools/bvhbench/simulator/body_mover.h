#pragma once
#include <memory>
#include <span>
#include <utility>

#include "simulator.h"

namespace tandem::simulation {

/// The bodies of a run, and what moves them; see Simulation. Functions also throw GpuError.
class BodyMover {
 public:
  virtual ~BodyMover() = default;
  virtual StepRecord step() = 0;
  virtual std::span<const BodyProperties> bodies() const = 0;
  virtual std::span<const BodyState> states() const = 0;
  virtual void place(std::uint32_t body, const BodyState& state) = 0;
  virtual SimulationState save() = 0;
  virtual void restore(SimulationState state) = 0;
};

/// Calls as they are.
struct CallAsItIs {
  template <typename Call>
  static auto of(const Call& call) {
    return call();
  }
};

/// Moves bodies by Simulator or GpuSimulation. Calling: makes the errors of its calls those of a BodyMover.
template <typename Simulation, typename Calling = CallAsItIs>
class MovesBy final : public BodyMover {
 public:
  template <typename... Arguments>
  explicit MovesBy(Arguments&&... arguments)
      : by_(Calling::of(
            [&] { return std::make_unique<Simulation>(std::forward<Arguments>(arguments)...); })) {}

  StepRecord step() override {
    return Calling::of([&] { return by_->step(); });
  }
  std::span<const BodyProperties> bodies() const override { return by_->bodies(); }
  std::span<const BodyState> states() const override { return by_->states(); }
  void place(std::uint32_t body, const BodyState& state) override {
    Calling::of([&] { by_->place(body, state); });
  }
  SimulationState save() override {
    return Calling::of([&] { return by_->save(); });
  }
  void restore(SimulationState state) override {
    Calling::of([&] { by_->restore(std::move(state)); });
  }

 private:
  std::unique_ptr<Simulation> by_;
};

/// Makes what moves bodies on the current GPU, by soft steps or Newton's method, as options say. continuous:
/// fast bodies are limited. What the
/// arguments look at must outlive it. Condition: this program was built with CUDA.
std::unique_ptr<BodyMover> make_gpu_mover(std::span<const AssetView> shapes,
                                          std::span<const BodyProperties> bodies,
                                          std::span<const BodyState> states, const PairFilter& filter,
                                          const SimulatorOptions& options, bool continuous);

}  // namespace tandem::simulation
