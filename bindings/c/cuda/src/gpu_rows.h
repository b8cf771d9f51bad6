#pragma once
#include "rows.h"
#include "same_layout.h"
#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_containment_query.h"
#include "tandem/kernels/gpu_distance_query.h"
#include "tandem/kernels/gpu_impact_query.h"
#include "tandem/kernels/gpu_manifold_query.h"
#include "tandem/kernels/gpu_tolerance_query.h"
#include "tandem/tandem_cuda.h"

/// Rows of the interface that lie in GPU memory have the layout of the libraries'.
namespace tandem::c {

#define TANDEM_SAME_REPORT(ours, theirs) \
  TANDEM_SAME_SIZE(ours, theirs);        \
  static_assert(offsetof(ours, status) == 0 && offsetof(theirs, failed) == 0)

TANDEM_SAME_REPORT(GpuBroadPhaseReport, tandem_gpu_broad_phase_report);
TANDEM_SAME_PLACE(GpuBroadPhaseReport, tandem_gpu_broad_phase_report, complete);
TANDEM_SAME_PLACE(GpuBroadPhaseReport, tandem_gpu_broad_phase_report, where);
TANDEM_SAME_PLACE(GpuBroadPhaseReport, tandem_gpu_broad_phase_report, count);
TANDEM_SAME_PLACE(GpuBroadPhaseReport, tandem_gpu_broad_phase_report, found);

TANDEM_SAME_SIZE(GpuContactCapacity, tandem_gpu_query_capacity);
TANDEM_SAME_PLACE(GpuContactCapacity, tandem_gpu_query_capacity, contacts);
TANDEM_SAME_PLACE(GpuContactCapacity, tandem_gpu_query_capacity, undecided);
TANDEM_SAME_SIZE(ContactCounters, tandem_gpu_query_counters);
TANDEM_SAME_PLACE(ContactCounters, tandem_gpu_query_counters, candidates);
TANDEM_SAME_PLACE(ContactCounters, tandem_gpu_query_counters, decided_exactly);
TANDEM_SAME_PLACE(ContactCounters, tandem_gpu_query_counters, contacts);
TANDEM_SAME_REPORT(GpuContactReport, tandem_gpu_query_report);
TANDEM_SAME_PLACE(GpuContactReport, tandem_gpu_query_report, complete);
TANDEM_SAME_PLACE(GpuContactReport, tandem_gpu_query_report, where);
TANDEM_SAME_PLACE(GpuContactReport, tandem_gpu_query_report, needed);
TANDEM_SAME_PLACE(GpuContactReport, tandem_gpu_query_report, contacts);
TANDEM_SAME_PLACE(GpuContactReport, tandem_gpu_query_report, world_pairs);
TANDEM_SAME_PLACE(GpuContactReport, tandem_gpu_query_report, counters);
TANDEM_SAME_SIZE(GpuGroupCounts, tandem_gpu_group_counts);
TANDEM_SAME_PLACE(GpuGroupCounts, tandem_gpu_group_counts, contacts);
TANDEM_SAME_PLACE(GpuGroupCounts, tandem_gpu_group_counts, few);
TANDEM_SAME_PLACE(GpuGroupCounts, tandem_gpu_group_counts, many);

TANDEM_SAME_SIZE(GpuManifoldCapacity, tandem_gpu_manifold_capacity);
TANDEM_SAME_PLACE(GpuManifoldCapacity, tandem_gpu_manifold_capacity, contacts);
TANDEM_SAME_PLACE(GpuManifoldCapacity, tandem_gpu_manifold_capacity, manifolds);
TANDEM_SAME_PLACE(GpuManifoldCapacity, tandem_gpu_manifold_capacity, points);
TANDEM_SAME_SIZE(ManifoldCounters, tandem_gpu_manifold_counters);
TANDEM_SAME_PLACE(ManifoldCounters, tandem_gpu_manifold_counters, points);
TANDEM_SAME_PLACE(ManifoldCounters, tandem_gpu_manifold_counters, ambiguous_touches);
TANDEM_SAME_REPORT(GpuManifoldReport, tandem_gpu_manifold_report);
TANDEM_SAME_PLACE(GpuManifoldReport, tandem_gpu_manifold_report, complete);
TANDEM_SAME_PLACE(GpuManifoldReport, tandem_gpu_manifold_report, needed);
TANDEM_SAME_PLACE(GpuManifoldReport, tandem_gpu_manifold_report, manifolds);
TANDEM_SAME_PLACE(GpuManifoldReport, tandem_gpu_manifold_report, points);
TANDEM_SAME_PLACE(GpuManifoldReport, tandem_gpu_manifold_report, counters);

TANDEM_SAME_SIZE(GpuContainmentCapacity, tandem_gpu_containment_capacity);
TANDEM_SAME_PLACE(GpuContainmentCapacity, tandem_gpu_containment_capacity, contained);
TANDEM_SAME_REPORT(GpuContainmentReport, tandem_gpu_containment_report);
TANDEM_SAME_PLACE(GpuContainmentReport, tandem_gpu_containment_report, complete);
TANDEM_SAME_PLACE(GpuContainmentReport, tandem_gpu_containment_report, needed);
TANDEM_SAME_PLACE(GpuContainmentReport, tandem_gpu_containment_report, contained);

TANDEM_SAME_SIZE(GpuDistanceCapacity, tandem_gpu_distance_capacity);
TANDEM_SAME_PLACE(GpuDistanceCapacity, tandem_gpu_distance_capacity, block_pairs);
TANDEM_SAME_PLACE(GpuDistanceCapacity, tandem_gpu_distance_capacity, triangle_pairs);
TANDEM_SAME_PLACE(GpuDistanceCapacity, tandem_gpu_distance_capacity, settled);
TANDEM_SAME_PLACE(GpuDistanceCapacity, tandem_gpu_distance_capacity, words);
TANDEM_SAME_SIZE(DistanceCounters, tandem_gpu_distance_counters);
TANDEM_SAME_PLACE(DistanceCounters, tandem_gpu_distance_counters, by_float32);
TANDEM_SAME_PLACE(DistanceCounters, tandem_gpu_distance_counters, touching);
TANDEM_SAME_REPORT(GpuDistanceReport, tandem_gpu_distance_report);
TANDEM_SAME_PLACE(GpuDistanceReport, tandem_gpu_distance_report, complete);
TANDEM_SAME_PLACE(GpuDistanceReport, tandem_gpu_distance_report, where);
TANDEM_SAME_PLACE(GpuDistanceReport, tandem_gpu_distance_report, needed);
TANDEM_SAME_PLACE(GpuDistanceReport, tandem_gpu_distance_report, world_pairs);
TANDEM_SAME_PLACE(GpuDistanceReport, tandem_gpu_distance_report, rounds);
TANDEM_SAME_PLACE(GpuDistanceReport, tandem_gpu_distance_report, counters);

TANDEM_SAME_SIZE(GpuImpactCapacity, tandem_gpu_impact_capacity);
TANDEM_SAME_PLACE(GpuImpactCapacity, tandem_gpu_impact_capacity, pairs);
TANDEM_SAME_PLACE(GpuImpactCapacity, tandem_gpu_impact_capacity, contacts);
TANDEM_SAME_PLACE(GpuImpactCapacity, tandem_gpu_impact_capacity, undecided);
TANDEM_SAME_PLACE(GpuImpactCapacity, tandem_gpu_impact_capacity, parts);
TANDEM_SAME_PLACE(GpuImpactCapacity, tandem_gpu_impact_capacity, block_pairs);
TANDEM_SAME_PLACE(GpuImpactCapacity, tandem_gpu_impact_capacity, triangle_pairs);
TANDEM_SAME_SIZE(ImpactCounters, tandem_gpu_impact_counters);
TANDEM_SAME_PLACE(ImpactCounters, tandem_gpu_impact_counters, found);
TANDEM_SAME_PLACE(ImpactCounters, tandem_gpu_impact_counters, triangle_pairs);
TANDEM_SAME_PLACE(ImpactCounters, tandem_gpu_impact_counters, unconverged);
TANDEM_SAME_REPORT(GpuImpactReport, tandem_gpu_impact_report);
TANDEM_SAME_PLACE(GpuImpactReport, tandem_gpu_impact_report, complete);
TANDEM_SAME_PLACE(GpuImpactReport, tandem_gpu_impact_report, where);
TANDEM_SAME_PLACE(GpuImpactReport, tandem_gpu_impact_report, needed);
TANDEM_SAME_PLACE(GpuImpactReport, tandem_gpu_impact_report, impacts);
TANDEM_SAME_PLACE(GpuImpactReport, tandem_gpu_impact_report, counters);

TANDEM_SAME_SIZE(GpuToleranceCapacity, tandem_gpu_tolerance_capacity);
TANDEM_SAME_PLACE(GpuToleranceCapacity, tandem_gpu_tolerance_capacity, pairs);
TANDEM_SAME_PLACE(GpuToleranceCapacity, tandem_gpu_tolerance_capacity, undecided);
TANDEM_SAME_REPORT(GpuToleranceReport, tandem_gpu_tolerance_report);
TANDEM_SAME_PLACE(GpuToleranceReport, tandem_gpu_tolerance_report, complete);
TANDEM_SAME_PLACE(GpuToleranceReport, tandem_gpu_tolerance_report, where);
TANDEM_SAME_PLACE(GpuToleranceReport, tandem_gpu_tolerance_report, needed);
TANDEM_SAME_PLACE(GpuToleranceReport, tandem_gpu_tolerance_report, world_pairs);
static_assert(offsetof(GpuToleranceReport, counters) == offsetof(tandem_gpu_tolerance_report, apart));
static_assert(offsetof(ToleranceCounters, work) ==
              offsetof(tandem_gpu_tolerance_report, work) - offsetof(tandem_gpu_tolerance_report, apart));

#undef TANDEM_SAME_REPORT

static_assert(uint32_t(Status::kOk) == 0);

/// Pairs of a library as the caller reads them.
inline tandem_gpu_pairs pairs_to_c(const GpuPairs& pairs) {
  return {reinterpret_cast<const tandem_object_pair*>(pairs.pairs), pairs.count, pairs.capacity, 0};
}

}  // namespace tandem::c
