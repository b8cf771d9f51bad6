#include "gpu_handles.h"

#include "fill_count.h"
#include "tandem/kernels/excluded_pairs.h"

namespace tandem::c {
namespace {

thread_local int last_cuda_error = 0;

}  // namespace

tandem_status told(Status status, cudaError_t error) {
  const tandem_status number = to_c(status);
  if (number >= TANDEM_NO_GPU && number <= TANDEM_CUDA_FAILED) last_cuda_error = error;
  return number;
}

tandem_status read_instances(const tandem_gpu_instances* given, GpuInstances& instances) {
  if (given == nullptr || !is_there(given->asset, given->count) || !is_there(given->pose, given->count))
    return TANDEM_NULL_ARGUMENT;
  if (given->reserved != 0) return TANDEM_BAD_OPTION;
  instances = {given->asset, reinterpret_cast<const Pose*>(given->pose), given->count};
  return TANDEM_OK;
}

tandem_status read_pairs(const tandem_gpu_pairs* given, uint32_t* room, GpuPairs& pairs,
                         cudaStream_t stream) {
  if (given == nullptr || !is_there(given->pairs, given->capacity)) return TANDEM_NULL_ARGUMENT;
  if (given->reserved != 0) return TANDEM_BAD_OPTION;
  pairs = {reinterpret_cast<const ObjectPair*>(given->pairs), given->count, given->capacity};
  if (given->count != nullptr) return TANDEM_OK;
  pairs.count = room;
  const cudaError_t error = fill_count(room, given->capacity, stream);
  return told(status_of(error), error);
}

tandem_status read_gpu_filter(const tandem_gpu_pair_filter* given, PairFilter& filter) {
  if (given == nullptr) return TANDEM_OK;
  tandem_gpu_pair_filter read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.reserved != 0) return TANDEM_BAD_OPTION;
  filter.motion = reinterpret_cast<const Motion*>(read.motion);
  filter.group = read.group;
  filter.mask = read.mask;
  filter.world = read.world;
  filter.excluded = read.excluded != nullptr ? read.excluded->table.view() : ExcludedPairs();
  return TANDEM_OK;
}

}  // namespace tandem::c

using namespace tandem;
using namespace tandem::c;

int tandem_cuda_error(void) {
  return last_cuda_error;
}

tandem_status tandem_gpu_device_create(const tandem_allocator* given, tandem_device** device) {
  if (device == nullptr) return TANDEM_NULL_ARGUMENT;
  *device = nullptr;
  Allocator allocator;
  if (const tandem_status status = read_allocator(given, allocator); status != TANDEM_OK) return status;
  const AllocatorScope scope(allocator);
  *device = reinterpret_cast<tandem_device*>(gpu_scene_device());
  return *device != nullptr ? TANDEM_OK : TANDEM_OUT_OF_MEMORY;
}

tandem_status tandem_gpu_excluded_pairs_create(const tandem_object_pair* pairs, size_t count,
                                               tandem_stream stream, const tandem_allocator* allocator,
                                               tandem_gpu_excluded_pairs** excluded) {
  return create(allocator, excluded, [&](tandem_gpu_excluded_pairs& made) -> tandem_status {
    if (!is_there(pairs, count)) return TANDEM_NULL_ARGUMENT;
    ExcludedPairTable table;
    if (const Status set = table.set(rows<ObjectPair>(pairs, count)); set != Status::kOk) return to_c(set);
    return told(made.table.upload(table.view(), stream), made.table);
  });
}

void tandem_gpu_excluded_pairs_destroy(tandem_gpu_excluded_pairs* excluded) {
  delete excluded;
}
