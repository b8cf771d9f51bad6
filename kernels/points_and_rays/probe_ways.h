#pragma once
#include "kernels/common/block_pair.h"
#include "kernels/points_and_rays/probe_walk.h"

namespace tandem {

/// The named ways, or null where this machine or this build lacks them; all give the same.
RayWalk ray_walk(BlockPairVariant variant);
RayStreamWalk ray_stream_walk(BlockPairVariant variant);
const RayGroupWays* ray_group_ways(BlockPairVariant variant);
PointWalk point_walk(BlockPairVariant variant);

}  // namespace tandem
