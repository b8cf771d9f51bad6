#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/dynamics/world.h"

namespace tandem {

/// How a body of a GpuWorld stands and moves, in GPU memory.
struct GpuBodyState {
  double position[3];     ///< of the centre of mass, in the world
  double orientation[4];  ///< of the file's axes, as a unit quaternion w, x, y, z
  double velocity[3], angular_velocity[3];
};

/// Rigid bodies of meshes that move on a GPU: those of World, by the same rules, but that joints, and large
/// groups of bodies, are always soft. Contacts are found, solved and remembered in GPU memory; the CPU reads
/// a few numbers once a step, and limits continuous motion in steps that have fast bodies. Throws nothing.
/// Movable, not copyable. One call at a time, and all with the GPU that was the current one at set_assets().
/// The same calls give the same bytes on GPUs of one kind; docs/dynamics.md says how they differ from
/// World's.
///
/// All functions may also return kNoGpu, kDriverTooOld, kGpuNotSupported, kOutOfGpuMemory or kCudaFailed.
class GpuWorld {
 public:
  GpuWorld();
  GpuWorld(GpuWorld&&) noexcept;
  GpuWorld& operator=(GpuWorld&&) noexcept;
  ~GpuWorld();  ///< waits for the GPU

  /// Copies the assets that bodies refer to to the GPU; what the views look at must outlive the world's use.
  /// There are no bodies afterwards. stream: what the world does is queued there. Result: as of
  /// Scene::set_assets(), and kNoOrientedBlocks or kNoTopology, where where() is the asset.
  Status set_assets(std::span<const AssetView> assets, cudaStream_t stream = nullptr);

  /// Places all bodies anew, at time 0. Result: as of World::set_bodies(). WorldOptions::threads: of the CPU,
  /// which limits continuous motion.
  Status set_bodies(std::span<const BodyDescription> bodies, const WorldOptions& options = {},
                    std::span<const ObjectPair> excluded = {}, std::span<const JointDescription> joints = {});

  /// Makes steps of dt seconds, and waits for them. Result: as of World::step(), and kOutOfRange too where
  /// somebody wrote to states() what no step can begin with. After an error bodies are as after the last step
  /// that was whole, and there are no contacts.
  Status step(double dt, std::uint32_t steps = 1);

  /// Makes more steps of the last call, see World::step_more(). Result: as of step().
  Status step_more(double dt, std::uint32_t steps = 1);

  /// Copy from the GPU what World's functions of these names return; valid until the next call. What began
  /// and ended is followed on the GPU, and lists are made when they are asked for.
  Status bodies(std::span<const BodyMotion>& bodies);
  Status contacts(std::span<const WorldContact>& contacts);
  Status touching(std::span<const WorldTouch>& touching);
  Status began(std::span<const WorldTouch>& began);
  Status ended(std::span<const ObjectPair>& ended);
  Status joints(std::span<const WorldJoint>& joints);
  Status broken(std::span<const std::uint32_t>& broken);

  /// Join bodies, part them and drive them, see World.
  Status add_joint(const JointDescription& description, std::uint32_t& joint);
  Status remove_joint(std::uint32_t joint);
  Status set_motor(std::uint32_t joint, double speed, double most_effort);

  /// Returns the state of each body, in GPU memory, as it is after the last step; null without bodies. It
  /// stays where it is until set_bodies(). Who writes there calls wake() then.
  GpuBodyState* states() const;
  std::uint32_t body_count() const;

  /// Wakes all bodies.
  Status wake();

  /// Puts a body elsewhere or gives it other velocities, as World::set() does. push(): see World.
  Status set(std::uint32_t body, const BodyMotion& motion);
  Status push(std::uint32_t body, const double (&impulse)[3], const double (&at)[3]);

  /// Sets a force and a torque that act on a moving body from now on, see World.
  Status set_force(std::uint32_t body, const double (&force)[3], const double (&torque)[3]);

  /// Gives a body another material, or lets another part of gravity act on it, see World.
  Status set_material(std::uint32_t body, const Material& material);
  Status set_gravity_scale(std::uint32_t body, double gravity_scale);

  /// Keeps all that the next steps depend on, in GPU memory, and goes back to it: they have the same bytes
  /// then. See World. States may outlive the world.
  class State;
  Status save(std::shared_ptr<const State>& state) const;
  Status restore(const State& state);

  /// Returns the body's mass; 0 of one that contacts do not move.
  double mass_of(std::uint32_t body) const;

  /// Returns the error behind the last status of a GPU; cudaErrorUnknown where it is not known.
  cudaError_t cuda_error() const;

  double time() const;          ///< seconds of all steps since set_bodies()
  std::uint64_t where() const;  ///< see World
  std::size_t bytes() const;    ///< of GPU memory held, but for assets and states

 private:
  struct Parts;
  template <typename Change>
  Status change(std::uint32_t body, const Change& change);
  Status fail(Status status, std::uint64_t where = 0) const;
  std::unique_ptr<Parts> parts_;
};

}  // namespace tandem
