#include "gpu_handles.h"

using namespace tandem;
using namespace tandem::c;

namespace {

static_assert(TANDEM_CONTENTS_ALL == int(Contents::all) &&
              TANDEM_CONTENTS_EXACT_QUERIES == int(Contents::exact_queries) &&
              TANDEM_CONTENTS_MANIFOLDS == int(Contents::manifolds));

// The levels that an asset of libtandem.so shows, by what that library tells everybody.
AssetView view_of(const tandem_asset* asset) {
  tandem_asset_info info = {};
  info.struct_size = sizeof info;
  (void)tandem_asset_get_info(asset, &info);
  return view_of_checked(tandem_asset_data(asset, nullptr)).levels_from(info.first_level, info.level_count);
}

tandem_status upload(tandem_gpu_assets& made, tandem_asset* const* assets, size_t count, Contents contents,
                     cudaStream_t stream) {
  Buffer<AssetView> views;
  Buffer<AssetBounds> bounds;
  if (!views.resize(count) || !bounds.resize(count) || !made.assets.resize(count))
    return TANDEM_OUT_OF_MEMORY;
  for (size_t i = 0; i < count; ++i) {
    views[i] = view_of(assets[i]);
    bounds[i] = asset_bounds(*views[i].header);
  }
  const Status status = made.files.upload(views.view(), contents, stream);
  if (status != Status::kOk) return told(status, made.files);
  for (size_t i = 0; i < count; ++i) {
    for (uint32_t l = 0; l < views[i].levels.size(); ++l) {
      if (!made.levels.push(gpu_asset(made.files.level(i, l), views[i], l))) return TANDEM_OUT_OF_MEMORY;
      if (l == 0) made.assets[i] = made.levels[made.levels.size() - 1];
    }
  }
  cudaError_t error = made.bounds.upload(bounds.view(), stream);
  if (error == cudaSuccess) error = cudaStreamSynchronize(stream);
  return told(status_of(error), error);
}

}  // namespace

tandem_status tandem_gpu_assets_upload(tandem_asset* const* assets, size_t count,
                                       const tandem_upload_options* options, tandem_stream stream,
                                       const tandem_allocator* allocator, tandem_gpu_assets** uploaded,
                                       uint64_t* where) {
  if (where != nullptr) *where = 0;
  if (uploaded == nullptr) return TANDEM_NULL_ARGUMENT;
  *uploaded = nullptr;
  if (!is_there(assets, count)) return TANDEM_NULL_ARGUMENT;
  for (size_t i = 0; i < count; ++i) {
    if (assets[i] != nullptr) continue;
    if (where != nullptr) *where = i;
    return TANDEM_NULL_ARGUMENT;
  }
  tandem_upload_options read;
  if (const tandem_status status = read_struct(options, read); status != TANDEM_OK) return status;
  if (read.contents > TANDEM_CONTENTS_MANIFOLDS) return TANDEM_BAD_OPTION;
  return create(allocator, uploaded, [&](tandem_gpu_assets& made) {
    return upload(made, assets, count, static_cast<Contents>(read.contents), stream);
  });
}

void tandem_gpu_assets_retain(tandem_gpu_assets* assets) {
  if (assets != nullptr) assets->references.fetch_add(1, std::memory_order_relaxed);
}

void tandem_gpu_assets_release(tandem_gpu_assets* assets) {
  if (assets != nullptr && assets->references.fetch_sub(1, std::memory_order_acq_rel) == 1) delete assets;
}

size_t tandem_gpu_assets_count(const tandem_gpu_assets* assets) {
  return assets != nullptr ? assets->assets.size() : 0;
}

size_t tandem_gpu_assets_bytes(const tandem_gpu_assets* assets) {
  return assets != nullptr ? assets->files.bytes() + assets->bounds.bytes() : 0;
}
