#include "gpu_run.h"

#include "tandem/formats/gpu_status.h"

namespace tandem {
namespace {

template <typename Element>
std::span<const Element> of_each(const Element* elements, std::size_t count) {
  return {elements, elements != nullptr ? count : 0};
}

}  // namespace

GpuRun::GpuRun(std::span<const AssetView> shapes, std::span<const Instance> bodies,
               const std::vector<ObjectPair>* given, const PairFilter& filter, double reach)
    : shapes_(shapes), given_(given), bodies_(bodies), filter_(filter), reach_(reach) {
  std::size_t total = 0;
  check(cudaFree(nullptr), "start");
  check(cudaMemGetInfo(&free_at_start_, &total), "memory");
  check(stream_.create(), "a stream");
  watch_.lap();
}

void GpuRun::check(Status status, cudaError_t error, const char* step) const {
  check_on_gpu("tandem-cuda", status, error, step);
}

void GpuRun::check(cudaError_t error, const char* step) const {
  check(status_of(error), error, step);
}

void GpuRun::require(Status status, cudaError_t error, std::uint64_t where, const char* step) const {
  if (subject(status) != nullptr)
    throw EngineError(std::string("tandem-cuda: ") + explain(status), status, where);
  check(status, error, step);
}

void GpuRun::upload_shapes(Contents contents) {
  check(uploaded_.upload(shapes_, contents, stream_.get()), uploaded_.cuda_error(), "assets");
  for (const AssetView& shape : shapes_) bounds_of_shape_.push_back(asset_bounds(*shape.header));
  upload<AssetBounds>(bounds_of_, bounds_of_shape_, "assets");
  bounds_ = {bounds_of_.data(), static_cast<std::uint32_t>(shapes_.size())};
}

void GpuRun::end_upload() {
  for (const Instance& body : bodies_) {
    shape_of_body_.push_back(body.asset);
    pose_of_body_.push_back(body.pose);
  }
  upload<std::uint32_t>(shape_of_, shape_of_body_, "instances");
  upload<Pose>(poses_, pose_of_body_, "instances");
  instances_ = {shape_of_.data(), poses_.data(), static_cast<std::uint32_t>(bodies_.size())};
  check(stream_.wait(), "upload");
  upload_seconds_ = watch_.lap();
}

void GpuRun::find_pairs() {
  if (given_ != nullptr) {
    pair_count_ = static_cast<std::uint32_t>(given_->size());
    upload<ObjectPair>(given_on_gpu_, *given_, "instances");
    upload<std::uint32_t>(count_, {&pair_count_, 1}, "instances");
    pairs_ = {given_on_gpu_.data(), count_.data(), pair_count_};
    return;
  }
  const std::size_t count = bodies_.size();
  check(excluded_.upload(filter_.excluded, stream_.get()), excluded_.cuda_error(), "filter");
  upload(motion_, of_each(filter_.motion, count), "filter");
  upload(group_, of_each(filter_.group, count), "filter");
  upload(mask_, of_each(filter_.mask, count), "filter");
  near_pairs_ = {.sorted = true,
                 .filter = {motion_.data(), group_.data(), mask_.data(), excluded_.view()},
                 .within = reach_};
  const Status status = broad_phase_.find_pairs(instances_, bounds_, near_pairs_, stream_.get());
  require(status, broad_phase_.cuda_error(), broad_phase_.report().where, "broad phase");
  pairs_ = broad_phase_.pairs();
  pair_count_ = broad_phase_.report().count;
}

void GpuRun::enqueue_broad_phase() {
  check(broad_phase_.enqueue(instances_, bounds_, near_pairs_, stream_.get()), broad_phase_.cuda_error(),
        "broad phase");
}

GpuUse GpuRun::use(std::size_t bytes, std::size_t bytes_bound) const {
  GpuUse use;
  int device = 0;
  cudaDeviceProp properties;
  std::size_t free = 0, total = 0;
  check(cudaMemGetInfo(&free, &total), "memory");
  check(cudaGetDevice(&device), "start");
  check(cudaGetDeviceProperties(&properties, device), "start");
  const std::size_t scene = uploaded_.bytes() + bounds_of_.bytes() + shape_of_.bytes() + poses_.bytes() +
                            given_on_gpu_.bytes() + count_.bytes() + motion_.bytes() + group_.bytes() +
                            mask_.bytes() + excluded_.bytes() + broad_phase_.bytes();
  use.name = properties.name;
  use.upload = upload_seconds_;
  use.bytes = scene + bytes;
  use.bytes_bound = scene + bytes_bound;
  use.bytes_taken = free_at_start_ - free;
  return use;
}

}  // namespace tandem
