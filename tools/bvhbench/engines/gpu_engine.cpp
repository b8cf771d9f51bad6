#include "gpu_engine.h"

#include <algorithm>
#include <memory>
#include <new>

#include "tandem/formats/gpu_status.h"

namespace tandem {
namespace {

std::string free_memory() {
  std::size_t free = 0, total = 0;
  if (cudaMemGetInfo(&free, &total) != cudaSuccess) return {};
  return std::to_string(free >> 20) + " of " + std::to_string(total >> 20) + " MiB are free";
}

std::string version(int number) {
  return std::to_string(number / 1000) + "." + std::to_string(number % 1000 / 10);
}

// CUDA calls a driver that is missing too old.
std::string driver_defect() {
  int driver = 0, runtime = 0;
  if (cudaDriverGetVersion(&driver) != cudaSuccess || driver == 0) return "no NVIDIA driver is installed";
  static_cast<void>(cudaRuntimeGetVersion(&runtime));
  return "it is for CUDA " + version(driver) + ", the program for CUDA " + version(runtime);
}

std::string reason_of(Status status, cudaError_t error) {
  if (status == Status::kOutOfGpuMemory) return free_memory();
  return error == cudaErrorInsufficientDriver ? driver_defect() : cudaGetErrorString(error);
}

}  // namespace

GpuError gpu_error(std::string_view who, Status status, cudaError_t error, const char* step) {
  const std::string told = error == cudaSuccess ? "" : std::string(": ") + cudaGetErrorString(error);
  return GpuError(std::string(who) + ": " + explain(status) + told, status, step, reason_of(status, error));
}

// The context is made first, so that nothing that is timed is charged with it.
GpuEngine::GpuEngine(std::string_view name, const GpuNeeds& needs) : Engine(name), needs_(needs) {
  std::size_t total = 0;
  check(cudaFree(nullptr), "start");
  check(cudaMemGetInfo(&free_at_start_, &total), "memory");
  check(stream_.create(), "a stream");
}

void GpuEngine::check(Status status, cudaError_t error, const char* step) const {
  if (status == Status::kOk) return;
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status == Status::kNoOrientedBlocks) require(status, 0);
  throw gpu_error(name(), status, error, step);
}

void GpuEngine::check(cudaError_t error, const char* step) const {
  check(status_of(error), error, step);
}

// Queues the copy of what get() makes of each element.
template <typename Elements, typename Element, typename Get>
void GpuEngine::stage(const Elements& elements, StagedArray<Element>& array, const char* step,
                      const Get& get) {
  check(array.grow(elements.size()), step);
  std::transform(elements.begin(), elements.end(), array.staged.data(), get);
  check(array.upload(elements.size(), stream()), step);
}

void GpuEngine::set_shapes(std::span<const AssetView> shapes) {
  Stopwatch watch;
  shapes_.clear();
  deforming_ = {};
  check(uploaded_.upload(shapes, needs_.contents, stream()), uploaded_.cuda_error(), "assets");
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const std::size_t levels = needs_.all_levels ? shapes[i].levels.size() : 1;
    for (std::uint32_t level = 0; level < levels; ++level)
      shapes_.push_back(gpu_asset(uploaded_.level(i, level), shapes[i], level));
  }
  if (!needs_.finds_pairs) {
    bounds_count_ = static_cast<std::uint32_t>(shapes.size());
    stage(shapes, bounds_, "instances", [](const AssetView& shape) { return asset_bounds(*shape.header); });
  }
  name_shapes();
  check(stream_.wait(), "upload");
  upload_of_shapes_ = watch.lap();
}

void GpuEngine::update(std::span<const BodyPose> bodies) {
  Stopwatch watch;
  check(shape_of_.grow(bodies.size()), "instances");
  check(poses_.grow(bodies.size()), "instances");
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    shape_of_.staged.data()[i] = bodies[i].asset;
    poses_.staged.data()[i] = bodies[i].pose;
  }
  check(shape_of_.upload(bodies.size(), stream()), "instances");
  check(poses_.upload(bodies.size(), stream()), "instances");
  if (!motion_.empty()) stage(motion_, motions_, "instances", std::identity());
  check(stream_.wait(), "upload");
  instances_ = {shape_of_.on_gpu.data(), poses_.on_gpu.data(), static_cast<std::uint32_t>(bodies.size())};
  check(broad_phase_.keep_fixed({}, {}, {}, nullptr, stream()), broad_phase_.cuda_error(), "broad phase");
  upload_of_bodies_ = watch.lap();
}

// Returns the positions, as many as the shape takes, or throws.
std::span<const float> GpuEngine::checked(const BentShape& bent) const {
  const auto& [shape, positions] = bent;
  if (!std::holds_alternative<std::span<const float>>(positions))
    require_bent(shape, Status::kNotFloat32, shape);
  const auto given = std::get<std::span<const float>>(positions);
  if (shapes_[shape].tree.source_vertices == nullptr) require_bent(shape, Status::kNoSourceVertices, shape);
  if (given.size() != 3 * shapes_[shape].source_vertices)
    require_bent(shape, Status::kVertexCountMismatch, shape);
  return given;
}

// Gives all shapes records, as the file has them, which the query follows from then on, and names those that
// deform. Condition: their positions and places are on the GPU.
void GpuEngine::begin_deforming() {
  check(list_.set(shapes_, PositionTypes::float32, stream()), cudaSuccess, "deformed shapes");
  std::vector<std::uint32_t> numbers;
  for (const auto& [shape, positions] : deforming_.positions) numbers.push_back(shape);
  GpuDeformer& deformer = deforming_.deformer;
  check(deformer.begin(shapes_, numbers, list_.records(), stream()), deformer.cuda_error(),
        "deformed shapes");
  deforming_.refit = captured([this, &deformer] {
    check(deformer.enqueue({.in_float32 = deforming_.places.on_gpu.data()}, stream()), deformer.cuda_error(),
          "refit");
  });
  name_shapes();
}

// If there is a new shape, all that deform are given their positions once more.
std::optional<double> GpuEngine::deform(std::span<const BentShape> bent) {
  if (needs_.all_levels || needs_.finds_pairs) cannot("deform shapes");
  bool is_new = false;
  for (const BentShape& each : bent) {
    const std::span<const float> given = checked(each);
    const auto [found, is_new_here] = deforming_.positions.try_emplace(each.shape);
    is_new = is_new || is_new_here;
    stage(given, found->second, "positions", std::identity());
  }
  stage(deforming_.positions, deforming_.places, "positions", [&](const auto& of) -> const float* {
    const auto is_it = [&](const BentShape& each) { return each.shape == of.first; };
    return is_new || std::any_of(bent.begin(), bent.end(), is_it) ? of.second.on_gpu.data() : nullptr;
  });
  if (is_new) begin_deforming();
  times_.update = time_repeats(1, deforming_.refit).front();
  const GpuDeformReport& report = deforming_.deformer.report();
  if (report.status != Status::kOk)
    require_bent(std::next(deforming_.positions.begin(), report.body)->first, report.status, report.where);
  return {};
}

void GpuEngine::keep_fixed() {
  if (filter_.motion == nullptr) return;
  const std::span<const Motion> motion(filter_.motion, instances_.count);
  const Status status =
      broad_phase_.keep_fixed(instances_, bounds(), motion, upload_filter().world, stream());
  check(status, broad_phase_, "broad phase");
}

// Returns where the copy lies, null where there is nothing of each body to copy.
template <typename Element>
const Element* GpuEngine::upload_of_each(const Element* of_each, StagedArray<Element>& array) {
  if (of_each == nullptr) return nullptr;
  stage(std::span(of_each, instances_.count), array, "filter", std::identity());
  return array.on_gpu.data();
}

const PairFilter& GpuEngine::upload_filter() {
  check(excluded_.upload(filter_.excluded, stream()), excluded_.cuda_error(), "filter");
  filter_on_gpu_ = {upload_of_each(filter_.motion, filter_motion_), upload_of_each(filter_.group, group_),
                    upload_of_each(filter_.mask, mask_), upload_of_each(filter_.world, world_),
                    excluded_.view()};
  return filter_on_gpu_;
}

GpuAssetBounds GpuEngine::bounds() const {
  if (!deforming_.positions.empty()) return list_.records().bounds_of_all();
  return {bounds_.on_gpu.data(), bounds_count_};
}

GpuBroadPhaseOptions GpuEngine::broad_phase_options(bool sorted) const {
  return {.sorted = sorted, .filter = filter_on_gpu_, .within = needs_.within};
}

void GpuEngine::find_pairs_on_gpu(bool sorted) {
  upload_filter();
  const Status status = broad_phase_.find_pairs(instances_, bounds(), broad_phase_options(sorted), stream());
  check(status, broad_phase_, "broad phase");
}

void GpuEngine::enqueue_broad_phase(bool sorted) {
  check(broad_phase_.enqueue(instances_, bounds(), broad_phase_options(sorted), stream()),
        broad_phase_.cuda_error(), "broad phase");
}

std::span<const ObjectPair> GpuEngine::find_pairs() {
  find_pairs_on_gpu(true);
  check(found_pairs_.grow(count_found()), "download");
  const std::span<ObjectPair> pairs(found_pairs_.data(), count_found());
  check(download(pairs_found().pairs, pairs, stream()), "download");
  return pairs;
}

bool GpuEngine::are_on_gpu(std::span<const ObjectPair> pairs) const {
  return !pairs.empty() && pairs.data() == found_pairs_.data() && pairs.size() == count_found();
}

GpuPairs GpuEngine::upload(std::span<const ObjectPair> pairs) {
  const std::uint32_t count[] = {static_cast<std::uint32_t>(pairs.size())};
  stage(pairs, given_pairs_, "instances", std::identity());
  stage(std::span(count), pair_count_, "instances", std::identity());
  return {given_pairs_.on_gpu.data(), pair_count_.on_gpu.data(), count[0]};
}

GpuPairs GpuEngine::pairs_of(const TimedQuery& asked, bool sorted) {
  if (asked.given != nullptr) return upload(*asked.given);
  if (needs_.finds_pairs) return {};
  find_pairs_on_gpu(sorted);
  return pairs_found();
}

std::function<void()> GpuEngine::captured(const std::function<void()>& work) {
  const auto graph = std::make_shared<GpuGraph>();
  check(graph->capture(stream(), work), "a graph");
  return [this, graph] { check(graph->launch(stream()), "a graph"); };
}

void GpuEngine::run_between(const GpuEvent& begin, const std::function<void()>& run,
                            const GpuEvent& end) const {
  check(begin.record(stream()), "an event");
  run();
  check(end.record(stream()), "an event");
  check(stream_.wait(), "the query");
}

double GpuEngine::seconds_between(const GpuEvent& begin, const GpuEvent& end) const {
  float milliseconds = 0;
  check(milliseconds_between(begin, end, milliseconds), "time");
  return 1e-3 * static_cast<double>(milliseconds);
}

Seconds GpuEngine::time_repeats(std::uint32_t repeats, const std::function<void()>& run) const {
  GpuEvent begin, end;
  for (GpuEvent* event : {&begin, &end}) check(event->create(), "an event");
  Seconds seconds;
  for (std::uint32_t i = 0; i < repeats; ++i) {
    run_between(begin, run, end);
    seconds.push_back(seconds_between(begin, end));
  }
  return seconds;
}

std::size_t GpuEngine::scene_bytes(const TimedQuery& asked) const {
  return uploaded_.bytes() + bounds_count_ * sizeof(AssetBounds) +
         instances_.count * (sizeof(Pose) + sizeof(std::uint32_t)) + motions_.on_gpu.bytes() +
         filter_motion_.on_gpu.bytes() + group_.on_gpu.bytes() + mask_.on_gpu.bytes() +
         world_.on_gpu.bytes() + excluded_.bytes() +
         (asked.given != nullptr ? asked.given->size() * sizeof(ObjectPair) : 0);
}

std::string GpuEngine::gpu_name() const {
  int device = 0;
  cudaDeviceProp properties;
  check(cudaGetDevice(&device), "start");
  check(cudaGetDeviceProperties(&properties, device), "start");
  return properties.name;
}

GpuUse GpuEngine::use(const TimedQuery& asked, std::size_t bytes, std::size_t bound) const {
  GpuUse use;
  std::size_t free = 0, total = 0;
  check(cudaMemGetInfo(&free, &total), "memory");
  use.name = gpu_name();
  use.upload = upload_of_shapes_ + upload_of_bodies_;
  use.bytes = scene_bytes(asked) + broad_phase_.bytes() + bytes;
  use.bytes_bound = bound == 0 ? 0 : scene_bytes(asked) + bound;
  use.bytes_taken = free_at_start_ - free;
  return use;
}

}  // namespace tandem
