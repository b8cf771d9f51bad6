#pragma once
#include <atomic>
#include <memory>
#include <span>

#include "entry.h"
#include "status.h"
#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/excluded_pairs.h"
#include "tandem/runtime/map.h"

struct tandem_asset : tandem::Allocated {
  std::atomic<size_t> references = 1;
  tandem::MappedAsset file;                ///< of an asset that was opened
  void* copy = nullptr;                    ///< of one that was copied
  void (*released)(void* user) = nullptr;  ///< of one that was borrowed
  void* user = nullptr;
  tandem_asset* whole = nullptr;  ///< of one that shows levels of another
  tandem::AssetView view;
  tandem::Allocator allocator;

  ~tandem_asset();
};

struct tandem_excluded_pairs : tandem::Allocated {
  tandem::ExcludedPairTable table;
};

namespace tandem::c {

/// The assets that a query was given, a reference to each.
class AssetList {
 public:
  ~AssetList() { clear(); }
  /// Takes references to these instead of those before. Result: TANDEM_OK; TANDEM_NULL_ARGUMENT, with its
  /// place; or TANDEM_OUT_OF_MEMORY; then there are none.
  tandem_status set(tandem_asset* const* assets, size_t count, uint64_t& where);
  void clear();
  std::span<const AssetView> views() const { return views_.view(); }

 private:
  Buffer<tandem_asset*> assets_;
  Buffer<AssetView> views_;
};

/// What every handle of a query has.
struct Handle : Allocated {
  Allocator allocator;
  AssetList assets;
  uint64_t where = 0;

  tandem_status fail(tandem_status status, uint64_t at) {
    where = at;
    return status;
  }
  /// Names the assets of a query of the libraries. After an error there are none.
  template <typename Query>
  tandem_status name_assets(Query& query, tandem_asset* const* given, size_t count) {
    const tandem_status status = assets.set(given, count, where);
    const Status named = query.set_assets(assets.views());
    if (status == TANDEM_OK && named == Status::kOk) return TANDEM_OK;
    assets.clear();
    (void)query.set_assets({});
    return status != TANDEM_OK ? status : fail(to_c(named), query.where());
  }
};

/// Runs the body of a function, see guarded(); `where` begins as 0.
template <typename Of, typename Body>
tandem_status enter(Of* handle, const Body& body) noexcept {
  return guarded(handle, [&](Of& self) {
    self.where = 0;
    return body(self);
  });
}

/// Makes the handle of a query.
template <typename Of>
tandem_status create(const tandem_allocator* given, Of** handle) noexcept {
  if (handle == nullptr) return TANDEM_NULL_ARGUMENT;
  *handle = nullptr;
  Allocator allocator;
  if (const tandem_status status = read_allocator(given, allocator); status != TANDEM_OK) return status;
  const AllocatorScope scope(allocator);
  Of* const made = new (std::nothrow) Of;
  if (made == nullptr) return TANDEM_OUT_OF_MEMORY;
  made->allocator = allocator;
  if (made->query.set_assets({}) != Status::kOk) {
    delete made;
    return TANDEM_OUT_OF_MEMORY;
  }
  *handle = made;
  return TANDEM_OK;
}

/// Makes an asset of what `fill` does to an empty one, with the caller's allocator.
template <typename Fill>
tandem_status make_asset(const tandem_allocator* given, tandem_asset** asset, const Fill& fill) {
  Allocator allocator;
  if (const tandem_status status = read_allocator(given, allocator); status != TANDEM_OK) return status;
  const AllocatorScope scope(allocator);
  std::unique_ptr<tandem_asset> made(new (std::nothrow) tandem_asset);
  if (made == nullptr) return TANDEM_OUT_OF_MEMORY;
  made->allocator = allocator;
  const tandem_status status = fill(*made);
  if (status == TANDEM_OK) *asset = made.release();
  return status;
}

/// The filter of a call with so many instances. Result: TANDEM_OK, TANDEM_BAD_STRUCT_SIZE, TANDEM_BAD_OPTION,
/// where `where` is the instance with a motion that there is not, or TANDEM_FILTER_MISMATCH.
tandem_status read_filter(const tandem_pair_filter& given, size_t instances, PairFilter& filter,
                          uint64_t& where);

}  // namespace tandem::c
