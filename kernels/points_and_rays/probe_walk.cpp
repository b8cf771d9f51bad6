#include "kernels/points_and_rays/probe_walk.h"

#include "kernels/common/lane_variant.h"
#include "kernels/points_and_rays/probe_lanes.h"
#include "kernels/points_and_rays/probe_ways.h"
#include "kernels/points_and_rays/ray_lanes.h"

namespace tandem {

float bound_limit(const FrameLengths& lengths, double distance) {
  return distance::limit_of(lengths, distance);
}

float length_limit(const FrameLengths& lengths, double distance) {
  return probe::length_limit_of(lengths, distance);
}

double world_upper(const FrameLengths& lengths, float length) {
  return probe::world_upper_of(lengths, length);
}

RayWalk ray_walk(BlockPairVariant variant) {
  return way_of(variant, RayWalk{ray_walk_by<PlainFour>}, &LaneVariant::ray_walk);
}

RayStreamWalk ray_stream_walk(BlockPairVariant variant) {
  return way_of(variant, RayStreamWalk{ray_stream_by<PlainFour, PlainFour>}, &LaneVariant::ray_stream_walk);
}

const RayGroupWays* ray_group_ways(BlockPairVariant variant) {
  return way_of(variant, &kRayGroupWaysOf<PlainReal>, &LaneVariant::ray_group_ways);
}

PointWalk point_walk(BlockPairVariant variant) {
  return way_of(variant, PointWalk{point_walk_by<PlainFour>}, &LaneVariant::point_walk);
}

}  // namespace tandem
