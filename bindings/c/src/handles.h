#pragma once
#include <atomic>

#include "entry.h"
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
  mutable std::atomic<size_t> references = 1;  ///< the caller's, and one for each scene that has it
  tandem::ExcludedPairTable table;
  tandem::Allocator allocator;
};
