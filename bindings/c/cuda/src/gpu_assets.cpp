#include <algorithm>
#include <span>

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

// Copies the records of the assets, and their bounds.
tandem_status list_assets(tandem_gpu_assets& made, PositionTypes positions, cudaStream_t stream) {
  const Status status = made.list.set(made.assets.view(), positions, stream);
  return told(status, status == Status::kOk ? cudaSuccess : cudaGetLastError());
}

tandem_status upload(tandem_gpu_assets& made, tandem_asset* const* assets, size_t count, Contents contents,
                     cudaStream_t stream) {
  Buffer<AssetView> views;
  if (!views.resize(count) || !made.assets.resize(count)) return TANDEM_OUT_OF_MEMORY;
  for (size_t i = 0; i < count; ++i) views[i] = view_of(assets[i]);
  const Status status = made.files.upload(views.view(), contents, stream);
  if (status != Status::kOk) return told(status, made.files);
  for (size_t i = 0; i < count; ++i) {
    for (uint32_t l = 0; l < views[i].levels.size(); ++l) {
      if (!made.levels.push(gpu_asset(made.files.level(i, l), views[i], l))) return TANDEM_OUT_OF_MEMORY;
      if (l == 0) made.assets[i] = made.levels[made.levels.size() - 1];
    }
  }
  return list_assets(made, PositionTypes::float32, stream);
}

// Returns how many of the numbers name an asset that can deform and ascend; `status`: what is wrong with the
// next.
size_t count_of_sound(const tandem_gpu_assets& assets, std::span<const uint32_t> deforming,
                      tandem_status& status) {
  for (size_t i = 0; i < deforming.size() && status == TANDEM_OK; ++i) {
    if (deforming[i] >= assets.assets.size())
      status = TANDEM_UNKNOWN_ASSET;
    else if (assets.assets[deforming[i]].tree.source_vertices == nullptr)
      status = TANDEM_NO_SOURCE_VERTICES;
    else if (i > 0 && deforming[i] <= deforming[i - 1])
      status = TANDEM_BAD_OPTION;
    if (status != TANDEM_OK) return i;
  }
  return deforming.size();
}

tandem_status make_deforming(tandem_gpu_assets& made, tandem_gpu_assets& at_rest,
                             std::span<const uint32_t> deforming, PositionTypes positions,
                             cudaStream_t stream) {
  tandem_gpu_assets_retain(&at_rest);
  made.at_rest = &at_rest;
  const std::span<const GpuAsset> assets = at_rest.assets.view();
  if (!made.assets.resize(assets.size())) return TANDEM_OUT_OF_MEMORY;
  std::copy(assets.begin(), assets.end(), made.assets.data());
  if (const tandem_status status = list_assets(made, positions, stream); status != TANDEM_OK) return status;
  GpuDeformer& deformer = made.deformer.emplace();
  return told(deformer.begin(assets, deforming, made.list.records(), stream), deformer);
}

// Runs the body of a function of assets of which some deform.
template <typename Body>
tandem_status with_deformer(tandem_gpu_assets* assets, const Body& body) noexcept {
  return guarded(assets, [&](tandem_gpu_assets& self) -> tandem_status {
    if (!self.deformer.has_value()) return TANDEM_ASSETS_MISSING;
    return body(*self.deformer);
  });
}

// Runs a call that deforms assets: call(deformer).
template <typename Call>
tandem_status deform(tandem_gpu_assets* assets, const float* const* positions,
                     const double* const* positions_f64, const Call& call) noexcept {
  return with_deformer(assets, [&](GpuDeformer& deformer) -> tandem_status {
    if (positions == nullptr && !is_there(positions_f64, deformer.bodies())) return TANDEM_NULL_ARGUMENT;
    return told(call(deformer, GpuPositions{positions, positions_f64}), deformer);
  });
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
  if (assets == nullptr) return 0;
  const size_t deformed = assets->deformer.has_value() ? assets->deformer->bytes() : 0;
  return assets->files.bytes() + assets->list.bytes() + deformed;
}

tandem_status tandem_gpu_assets_create_deforming(tandem_gpu_assets* assets, const uint32_t* deforming,
                                                 size_t count, uint32_t takes_f64, tandem_stream stream,
                                                 const tandem_allocator* allocator, tandem_gpu_assets** made,
                                                 uint64_t* where) {
  if (where != nullptr) *where = 0;
  if (made == nullptr) return TANDEM_NULL_ARGUMENT;
  *made = nullptr;
  if (assets == nullptr || !is_there(deforming, count)) return TANDEM_NULL_ARGUMENT;
  if (assets->deformer.has_value()) return TANDEM_BAD_OPTION;
  tandem_status status = TANDEM_OK;
  const size_t sound = count_of_sound(*assets, {deforming, count}, status);
  if (where != nullptr && status != TANDEM_OK) *where = sound;
  if (status != TANDEM_OK) return status;
  return create(allocator, made, [&](tandem_gpu_assets& of) {
    const PositionTypes positions =
        takes_f64 != 0 ? PositionTypes::float32_and_float64 : PositionTypes::float32;
    return make_deforming(of, *assets, {deforming, count}, positions, stream);
  });
}

size_t tandem_gpu_assets_deforming_count(const tandem_gpu_assets* assets) {
  return assets != nullptr && assets->deformer.has_value() ? assets->deformer->bodies() : 0;
}

tandem_status tandem_gpu_assets_enqueue_deform(tandem_gpu_assets* assets, const float* const* positions,
                                               const double* const* positions_f64, tandem_stream stream) {
  return deform(assets, positions, positions_f64,
                [&](GpuDeformer& deformer, const GpuPositions& of) { return deformer.enqueue(of, stream); });
}

tandem_status tandem_gpu_assets_deform(tandem_gpu_assets* assets, const float* const* positions,
                                       const double* const* positions_f64, tandem_stream stream) {
  return deform(assets, positions, positions_f64,
                [&](GpuDeformer& deformer, const GpuPositions& of) { return deformer.deform(of, stream); });
}

const tandem_gpu_deform_report* tandem_gpu_assets_device_report(const tandem_gpu_assets* assets) {
  if (assets == nullptr || !assets->deformer.has_value()) return nullptr;
  return reinterpret_cast<const tandem_gpu_deform_report*>(assets->deformer->device_report());
}

tandem_status tandem_gpu_assets_get_report(const tandem_gpu_assets* assets,
                                           tandem_gpu_deform_report* report) {
  if (report != nullptr) *report = {};
  if (assets == nullptr) return TANDEM_NULL_ARGUMENT;
  if (!assets->deformer.has_value()) return TANDEM_ASSETS_MISSING;
  const GpuDeformReport& found = assets->deformer->report();
  if (report != nullptr) *report = reinterpret_cast<const tandem_gpu_deform_report&>(found);
  return told(found.status, cudaSuccess);
}
