#pragma once
#include <span>

#include "entry.h"
#include "handles.h"
#include "tandem/kernels/detail/buffer.h"

/// What scenes and worlds are given in the same way.
namespace tandem::c {

/// A reference to each of some assets.
class AssetReferences {
 public:
  AssetReferences() = default;
  ~AssetReferences() { release(); }
  AssetReferences(const AssetReferences&) = delete;
  AssetReferences& operator=(const AssetReferences&) = delete;

  /// Takes references to these assets instead of those before, and hands the views to `use`, whose result is
  /// a tandem_status. After an error there are none, and `use` was given none. Result: that of `use`;
  /// TANDEM_NULL_ARGUMENT, where `where` is the place; TANDEM_OUT_OF_MEMORY.
  template <typename Use>
  tandem_status replace(tandem_asset* const* given, size_t count, uint64_t& where, const Use& use) {
    tandem_status status = is_there(given, count) ? TANDEM_OK : TANDEM_NULL_ARGUMENT;
    for (size_t i = 0; i < count && status == TANDEM_OK; ++i) {
      if (given[i] == nullptr) status = TANDEM_NULL_ARGUMENT, where = i;
    }
    // New assets are taken before old ones are released, because they may be the same.
    Buffer<tandem_asset*> taken;
    Buffer<AssetView> views;
    if (status == TANDEM_OK && (!taken.resize(count) || !views.resize(count))) status = TANDEM_OUT_OF_MEMORY;
    for (size_t i = 0; i < count && status == TANDEM_OK; ++i) {
      tandem_asset_retain(taken[i] = given[i]);
      views[i] = given[i]->view;
    }
    release();
    if (status == TANDEM_OK) {
      assets_ = std::move(taken);
      status = use(views.view());
    }
    if (status == TANDEM_OK) return status;
    const uint64_t blamed = where;
    (void)use(std::span<const AssetView>());
    where = blamed;
    release();
    return status;
  }

 private:
  void release() {
    for (tandem_asset* asset : assets_.view()) tandem_asset_release(asset);
    assets_.clear();
  }

  Buffer<tandem_asset*> assets_;
};

/// The filter of so many bodies, which is zeros where none is given. Result: TANDEM_OK,
/// TANDEM_BAD_STRUCT_SIZE, TANDEM_BAD_OPTION, TANDEM_BAD_MOTION, where `where` is the body, or
/// TANDEM_FILTER_MISMATCH.
inline tandem_status read_filter(const tandem_pair_filter* given, size_t bodies, tandem_pair_filter& read,
                                 uint64_t& where) {
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.reserved != 0) return TANDEM_BAD_OPTION;
  const bool has_rows =
      read.motion != nullptr || read.group != nullptr || read.mask != nullptr || read.world != nullptr;
  if (has_rows && read.count != bodies) return TANDEM_FILTER_MISMATCH;
  const size_t unknown = read.motion != nullptr ? first_unknown_motion(read.motion, bodies) : bodies;
  if (unknown == bodies) return TANDEM_OK;
  where = unknown;
  return TANDEM_BAD_MOTION;
}

}  // namespace tandem::c
