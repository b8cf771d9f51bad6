#include "../world.h"

#include <cstdint>

#include "arrays.h"

namespace tandem::python {
namespace {

struct OnGpu {
  int device = 0;

  TANDEM_WORLD_ENGINE(tandem_gpu_world);
  static constexpr auto bodies = tandem_gpu_world_bodies;
  static constexpr auto contacts = tandem_gpu_world_contacts;
  static constexpr auto touching = tandem_gpu_world_touching;
  static constexpr auto began = tandem_gpu_world_began;
  static constexpr auto ended = tandem_gpu_world_ended;
  static constexpr auto joints = tandem_gpu_world_joints;
  static constexpr auto broken = tandem_gpu_world_broken;

  static tandem_status set_assets(tandem_gpu_world* world, tandem_asset* const* assets, std::size_t count) {
    return tandem_gpu_world_set_assets(world, assets, count, nullptr);
  }
  static std::size_t count(const tandem_gpu_world* world) {
    std::size_t bodies;
    tandem_gpu_world_states(world, &bodies);
    return bodies;
  }
  OnDevice here() const { return OnDevice(device); }
};

class GpuWorld : public WorldOf<OnGpu> {
 public:
  GpuWorld(nb::list assets, const GivenOptions& options, int device)
      : WorldOf(std::move(assets), options, OnGpu{require_gpu(device)}) {}

  // The states of the bodies where the steps read and write them.
  Array states() {
    const Turn turn = take_turn();
    std::size_t count;
    const tandem_gpu_body_state* const first = tandem_gpu_world_states(world(), &count);
    constexpr std::int64_t kWidth = sizeof *first / sizeof(double);
    return {{keeper(), engine().device, {}, true},
            first,
            kF64,
            {static_cast<std::int64_t>(count), kWidth},
            {kWidth, 1}};
  }

  void wake() {
    const Turn turn = take_turn();
    ask(tandem_gpu_world_wake);
  }

  std::size_t bytes() {
    const Turn turn = take_turn();
    return tandem_gpu_world_bytes(world());
  }
};

}  // namespace

void add_gpu_worlds(nb::module_& module) {
  add_world<GpuWorld, int>(module)
      .def("states", &GpuWorld::states)
      .def("wake", &GpuWorld::wake)
      .def("bytes", &GpuWorld::bytes);
}

}  // namespace tandem::python
