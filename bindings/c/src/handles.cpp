#include "handles.h"

#include "rows.h"

namespace tandem::c {

tandem_status AssetList::set(tandem_asset* const* assets, size_t count, uint64_t& where) {
  where = 0;
  tandem_status status = is_there(assets, count) ? TANDEM_OK : TANDEM_NULL_ARGUMENT;
  for (size_t i = 0; i < count && status == TANDEM_OK; ++i) {
    if (assets[i] != nullptr) continue;
    status = TANDEM_NULL_ARGUMENT;
    where = i;
  }
  // Those that come are taken before others go: they may be the same.
  Buffer<tandem_asset*> taken;
  Buffer<AssetView> views;
  if (status == TANDEM_OK && (!taken.resize(count) || !views.resize(count))) status = TANDEM_OUT_OF_MEMORY;
  for (size_t i = 0; i < count && status == TANDEM_OK; ++i) {
    tandem_asset_retain(taken[i] = assets[i]);
    views[i] = assets[i]->view;
  }
  clear();
  if (status != TANDEM_OK) return status;
  assets_ = std::move(taken);
  views_ = std::move(views);
  return TANDEM_OK;
}

void AssetList::clear() {
  for (tandem_asset* asset : assets_.view()) tandem_asset_release(asset);
  assets_.clear();
  views_.clear();
}

tandem_status read_filter(const tandem_pair_filter& given, size_t instances, PairFilter& filter,
                          uint64_t& where) {
  tandem_pair_filter read;
  if (const tandem_status status = read_struct(&given, read); status != TANDEM_OK) return status;
  if (read.reserved != 0) return TANDEM_BAD_OPTION;
  const bool has_rows = read.motion != nullptr || read.group != nullptr || read.mask != nullptr;
  if (has_rows && read.count != instances) return TANDEM_FILTER_MISMATCH;
  if (read.motion != nullptr) {
    where = first_unknown_motion(read.motion, instances);
    if (where != instances) return TANDEM_BAD_OPTION;
    where = 0;
  }
  filter.motion = reinterpret_cast<const Motion*>(read.motion);
  filter.group = read.group;
  filter.mask = read.mask;
  filter.excluded = read.excluded != nullptr ? read.excluded->table.view() : ExcludedPairs();
  return TANDEM_OK;
}

}  // namespace tandem::c

using namespace tandem;
using namespace tandem::c;

tandem_status tandem_excluded_pairs_create(const tandem_object_pair* pairs, size_t count,
                                           const tandem_allocator* allocator,
                                           tandem_excluded_pairs** excluded) {
  if (excluded == nullptr) return TANDEM_NULL_ARGUMENT;
  *excluded = nullptr;
  if (!is_there(pairs, count)) return TANDEM_NULL_ARGUMENT;
  Allocator from;
  if (const tandem_status status = read_allocator(allocator, from); status != TANDEM_OK) return status;
  const AllocatorScope scope(from);
  auto* const made = new (std::nothrow) tandem_excluded_pairs;
  if (made == nullptr) return TANDEM_OUT_OF_MEMORY;
  const Status status = made->table.set(rows<ObjectPair>(pairs, count));
  if (status == Status::kOk) {
    *excluded = made;
  } else {
    delete made;
  }
  return to_c(status);
}

void tandem_excluded_pairs_destroy(tandem_excluded_pairs* excluded) {
  delete excluded;
}
