#include "tandem/dynamics/gpu_world.h"

#include <cstring>
#include <new>
#include <optional>
#include <vector>

#include "dynamics/cuda/cuda_executor.cuh"
#include "dynamics/cuda/cuda_questions.cuh"
#include "dynamics/cuda/parallel_newton_step.cuh"
#include "dynamics/parallel/parallel_simulation.h"
#include "dynamics/parallel/wake_step.h"
#include "dynamics/world_rows.h"
#include "dynamics/world_setup.h"
#include "tandem/kernels/excluded_pairs.h"
#include "tandem/runtime/upload.h"

namespace tandem {

using namespace dynamics;

static_assert(sizeof(GpuBodyState) == sizeof(BodyState));

struct GpuWorld::Parts {
  std::vector<AssetView> assets;
  std::vector<GpuAsset> on_gpu;
  DeviceAssets files;
  std::vector<double> inner_radii;
  std::vector<AssetBox> boxes;
  cudaStream_t own_stream = nullptr;
  CudaExecutor executor;
  CudaQuestions questions{executor};
  std::optional<ParallelSimulation<CudaExecutor, CudaQuestions>> simulation;
  std::vector<BodyProperties> properties;
  GpuArray<std::uint32_t> group, mask, world;
  GpuExcludedPairs excluded;
  ParallelOptions options;
  double time = 0;
  std::uint64_t where = 0;

  // Copies from the GPU, for callers.
  std::vector<BodyState> states;
  std::vector<std::uint32_t> groups;
  std::vector<BodyMotion> bodies;
  std::vector<PairRecord> records;
  std::vector<ContactPoint> points;
  std::vector<ContactImpulse> done;
  std::vector<WorldContact> contacts;
  std::vector<ObjectPair> touching;

  Parts() = default;
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;
  ~Parts() {
    if (own_stream != nullptr) static_cast<void>(cudaStreamDestroy(own_stream));
  }

  bool has_bodies() const { return simulation.has_value() && !properties.empty(); }
  void clear() {
    simulation.reset();
    properties.clear(), bodies.clear(), contacts.clear(), touching.clear();
    time = 0, where = 0;
  }
  Status upload_filter(const WorldSetup& setup, std::span<const ObjectPair> excluded_pairs);
  Status read_records();
  Status write_state(std::uint32_t body, const BodyState& state);
};

namespace {

template <typename T>
Status read(CudaExecutor& executor, const T* from, std::size_t count, std::vector<T>& to) {
  to.resize(count);
  return count > 0 ? executor.copy(from, std::span<T>(to)) : executor.status();
}

}  // namespace

GpuWorld::GpuWorld() : parts_(new (std::nothrow) Parts) {}
GpuWorld::GpuWorld(GpuWorld&&) noexcept = default;
GpuWorld& GpuWorld::operator=(GpuWorld&&) noexcept = default;
GpuWorld::~GpuWorld() = default;

Status GpuWorld::fail(Status status, std::uint64_t where) const {
  if (parts_ != nullptr) parts_->where = where;
  return status;
}

Status GpuWorld::set_assets(std::span<const AssetView> assets, cudaStream_t stream) {
  if (parts_ == nullptr) return Status::kOutOfMemory;
  Parts& parts = *parts_;
  parts.clear();
  parts.assets.clear();
  Scene scene;
  if (const Status status = scene.set_assets(assets); status != Status::kOk)
    return fail(status, scene.where());
  try {
    // The default stream cannot be captured into a graph; one of its own waits for that, and it for this.
    if (stream == nullptr && parts.own_stream == nullptr) {
      const Status status = status_of(cudaStreamCreate(&parts.own_stream));
      if (status != Status::kOk) return fail(status);
    }
    stream = stream != nullptr ? stream : parts.own_stream;
    parts.executor.set_stream(stream);
    if (const Status status = parts.files.upload(assets, Contents::all, stream); status != Status::kOk)
      return fail(status);
    parts.on_gpu.clear(), parts.boxes.clear();
    for (std::size_t i = 0; i < assets.size(); ++i) {
      const LevelView level = parts.files.level(i);
      if (level.oriented_blocks == nullptr) return fail(Status::kNoOrientedBlocks, i);
      if (level.topology == nullptr) return fail(Status::kNoTopology, i);
      parts.on_gpu.push_back(gpu_asset(level, assets[i]));
      const FileHeader& header = *assets[i].header;
      parts.boxes.push_back(asset_box(header.lower, header.upper, header.origin));
    }
    parts.inner_radii = inner_radii(assets);
    if (const Status status = parts.questions.set_assets(parts.on_gpu); status != Status::kOk)
      return fail(status);
    parts.assets.assign(assets.begin(), assets.end());
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  return Status::kOk;
}

Status GpuWorld::set_bodies(std::span<const BodyDescription> bodies, const WorldOptions& options,
                            std::span<const ObjectPair> excluded) {
  if (parts_ == nullptr) return Status::kOutOfMemory;
  Parts& parts = *parts_;
  parts.clear();
  try {
    WorldSetup setup;
    std::uint64_t blamed = 0;
    Status status = set_up(parts.assets, bodies, options, {}, setup, blamed);
    if (status == Status::kOk && options.continuous) status = Status::kBadOption;
    if (status != Status::kOk) return fail(status, blamed);
    parts.options = {setup.options.gravity, setup.options.solver, setup.options.sleep};
    status = parts.upload_filter(setup, excluded);
    if (status != Status::kOk) return fail(status);
    parts.simulation.emplace(parts.executor, parts.questions);
    status = parts.simulation->set_bodies({setup.properties, setup.states, parts.inner_radii, parts.boxes},
                                          parts.options);
    if (status != Status::kOk) {
      parts.clear();
      return fail(status);
    }
    parts.properties = std::move(setup.properties);
  } catch (const std::bad_alloc&) {
    parts.clear();
    return fail(Status::kOutOfMemory);
  }
  return Status::kOk;
}

Status GpuWorld::Parts::upload_filter(const WorldSetup& setup, std::span<const ObjectPair> excluded_pairs) {
  ExcludedPairTable table;
  Status status = table.set(excluded_pairs);
  if (status == Status::kOk) status = excluded.upload(table.view(), executor.stream());
  for (const auto& [from, to] :
       {std::pair(&setup.group, &group), {&setup.mask, &mask}, {&setup.world, &world}}) {
    if (status == Status::kOk) status = status_of(to->upload(*from, executor.stream()));
  }
  if (status == Status::kOk) status = executor.wait();
  const bool one_world = std::ranges::all_of(setup.world, [](std::uint32_t of) { return of == kEveryWorld; });
  questions.set_filter(
      {nullptr, group.data(), mask.data(), one_world ? nullptr : world.data(), excluded.view()});
  return status;
}

Status GpuWorld::step(double dt, std::uint32_t steps) {
  if (parts_ == nullptr) return Status::kOutOfMemory;
  if (!(dt > 0 && dt <= 1000)) return fail(Status::kBadDuration);
  if (!parts_->has_bodies()) return fail(Status::kOk);
  Parts& parts = *parts_;
  for (std::uint32_t i = 0; i < steps; ++i) {
    const Status status = parts.simulation->step(dt);
    if (status != Status::kOk) {
      const bool of_body = status == Status::kOutOfRange && parts.simulation->bad_body() != kNoIndex;
      return fail(status, of_body ? parts.simulation->bad_body() : parts.questions.where());
    }
    parts.time += dt;
  }
  return fail(parts.executor.wait());
}

Status GpuWorld::bodies(std::span<const BodyMotion>& bodies) {
  bodies = {};
  if (parts_ == nullptr) return Status::kOutOfMemory;
  if (!parts_->has_bodies()) return Status::kOk;
  Parts& parts = *parts_;
  try {
    const StepArrays a = parts.simulation->arrays();
    Status status = read(parts.executor, a.start, a.bodies, parts.states);
    if (status == Status::kOk) status = read(parts.executor, a.group, a.bodies, parts.groups);
    if (status != Status::kOk) return fail(status);
    parts.bodies.resize(a.bodies);
    for (std::uint32_t i = 0; i < a.bodies; ++i) {
      parts.bodies[i] = motion_of(parts.properties[i], parts.states[i], parts.groups[i] != Sleep::kAwake);
    }
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  bodies = parts.bodies;
  return Status::kOk;
}

// The records of the last step are those before the next one.
Status GpuWorld::Parts::read_records() {
  return read(executor, simulation->arrays().records_before, simulation->counts().pairs, records);
}

Status GpuWorld::contacts(std::span<const WorldContact>& contacts) {
  contacts = {};
  if (parts_ == nullptr) return Status::kOutOfMemory;
  if (!parts_->has_bodies()) return Status::kOk;
  Parts& parts = *parts_;
  try {
    const StepArrays a = parts.simulation->arrays();
    const std::size_t room = std::min(parts.simulation->counts().remembered, a.most_remembered);
    Status status = parts.read_records();
    if (status == Status::kOk) status = read(parts.executor, a.contacts, room, parts.points);
    if (status == Status::kOk) status = read(parts.executor, a.done, room, parts.done);
    if (status != Status::kOk) return fail(status);
    parts.contacts.clear();
    for (const PairRecord& record : parts.records) {
      for (std::uint32_t k = record.first_contact; k < record.first_contact + record.contacts; ++k) {
        parts.contacts.push_back(contact_of(parts.points[k], parts.done[k]));
      }
    }
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  contacts = parts.contacts;
  return Status::kOk;
}

Status GpuWorld::touching(std::span<const ObjectPair>& touching) {
  touching = {};
  if (parts_ == nullptr) return Status::kOutOfMemory;
  if (!parts_->has_bodies()) return Status::kOk;
  Parts& parts = *parts_;
  try {
    if (const Status status = parts.read_records(); status != Status::kOk) return fail(status);
    parts.touching.clear();
    for (const PairRecord& record : parts.records) {
      if (record.touches) parts.touching.push_back(record.pair);
    }
  } catch (const std::bad_alloc&) {
    return fail(Status::kOutOfMemory);
  }
  touching = parts.touching;
  return Status::kOk;
}

GpuBodyState* GpuWorld::states() const {
  if (parts_ == nullptr || !parts_->has_bodies()) return nullptr;
  return reinterpret_cast<GpuBodyState*>(parts_->simulation->arrays().start);
}

std::uint32_t GpuWorld::body_count() const {
  return parts_ != nullptr ? static_cast<std::uint32_t>(parts_->properties.size()) : 0;
}

Status GpuWorld::wake() {
  if (body_count() == 0) return fail(Status::kOk);
  wake_all(parts_->executor, parts_->simulation->arrays());
  return fail(parts_->executor.wait());
}

Status GpuWorld::Parts::write_state(std::uint32_t body, const BodyState& state) {
  const StepArrays a = simulation->arrays();
  const Status status = executor.copy(std::span<const BodyState>(&state, 1), a.start + body);
  if (status == Status::kOk) wake_body(executor, a, body);
  return executor.wait();
}

Status GpuWorld::set(std::uint32_t body, const BodyMotion& motion) {
  if (body >= body_count()) return fail(Status::kUnknownInstance, body);
  if (!is_rigid(motion.pose)) return fail(Status::kPoseNotRigid, body);
  const BodyProperties& of = parts_->properties[body];
  BodyState state = state_of(of, motion.pose);
  state.velocity = vector_of(motion.velocity);
  state.angular_velocity = vector_of(motion.angular_velocity);
  if (!is_usable(state)) return fail(Status::kOutOfRange, body);
  if (of.motion == Motion::fixed) state.velocity = state.angular_velocity = Vector3{};
  return fail(parts_->write_state(body, state));
}

Status GpuWorld::push(std::uint32_t body, const double (&impulse)[3], const double (&at)[3]) {
  if (body >= body_count()) return fail(Status::kUnknownInstance, body);
  const BodyProperties& of = parts_->properties[body];
  if (of.motion != Motion::moving) return fail(Status::kOk);
  BodyState state;
  const Status status =
      parts_->executor.copy(parts_->simulation->arrays().start + body, std::span(&state, 1));
  if (status != Status::kOk) return fail(status);
  push_at(of, vector_of(impulse), vector_of(at), state);
  if (!is_usable(state)) return fail(Status::kOutOfRange, body);
  return fail(parts_->write_state(body, state));
}

Status GpuWorld::set_force(std::uint32_t body, const double (&force)[3], const double (&torque)[3]) {
  if (body >= body_count()) return fail(Status::kUnknownInstance, body);
  const BodyProperties& of = parts_->properties[body];
  if (of.motion != Motion::moving) return fail(Status::kOk);
  const BodyForce to = {vector_of(force), vector_of(torque)};
  BodyState state;
  Status status = parts_->executor.copy(parts_->simulation->arrays().start + body, std::span(&state, 1));
  if (status != Status::kOk) return fail(status);
  if (!(pull_on(of, state, {}, to).most() <= kFastest)) return fail(Status::kOutOfRange, body);
  bool is_new = false;
  status = parts_->simulation->set_force(body, to, is_new);
  if (status == Status::kOk && is_new) wake_body(parts_->executor, parts_->simulation->arrays(), body);
  return fail(status == Status::kOk ? parts_->executor.wait() : status);
}

double GpuWorld::mass_of(std::uint32_t body) const {
  if (body >= body_count()) return 0;
  const BodyProperties& of = parts_->properties[body];
  return of.motion == Motion::moving ? of.mass : 0;
}

cudaError_t GpuWorld::cuda_error() const {
  if (parts_ == nullptr) return cudaErrorUnknown;
  const Parts& parts = *parts_;
  for (const cudaError_t error : {parts.files.cuda_error(), parts.excluded.cuda_error(),
                                  parts.executor.error(), parts.questions.error()}) {
    if (error != cudaSuccess) return error;
  }
  return cudaErrorUnknown;
}

double GpuWorld::time() const {
  return parts_ != nullptr ? parts_->time : 0;
}

std::uint64_t GpuWorld::where() const {
  return parts_ != nullptr ? parts_->where : 0;
}

}  // namespace tandem
