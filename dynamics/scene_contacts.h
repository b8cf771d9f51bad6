#pragma once
#include <memory>

#include "dynamics/contact_finder.h"

namespace tandem::dynamics {

/// Contacts of meshes by ContactQuery and ManifoldQuery; only pairs that have moved are asked about. What the
/// assets and the filter's table look at must outlive it. The filter's motions are not looked at.
std::unique_ptr<ContactFinder> make_scene_contacts(std::span<const AssetView> assets, std::uint32_t threads,
                                                   const PairFilter& filter = {});

}  // namespace tandem::dynamics
