#pragma once
#include <memory>

#include "dynamics/contact_finder.h"
#include "dynamics/threads.h"

namespace tandem::dynamics {

/// Contacts of meshes by ContactQuery and ManifoldQuery; only pairs that have moved are asked about. What the
/// assets and the filter look at, and the filter, must outlive it. filter: or null; its motions are not
/// looked at, and what it excludes may change between calls.
std::unique_ptr<ContactFinder> make_scene_contacts(std::span<const AssetView> assets, const Threads& threads,
                                                   const PairFilter* filter = nullptr);

}  // namespace tandem::dynamics
