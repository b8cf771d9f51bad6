// Written by scripts/write_interface from bindings/c/cuda/include/tandem/tandem_cuda.h. Do not edit it.
// clang-format off
TANDEM_SAME_SIZE(GpuBroadPhaseReport, tandem_gpu_broad_phase_report); TANDEM_SAME_PLACE(GpuBroadPhaseReport, tandem_gpu_broad_phase_report, status);
  TANDEM_SAME_PLACE(GpuBroadPhaseReport, tandem_gpu_broad_phase_report, complete); TANDEM_SAME_PLACE(GpuBroadPhaseReport,
  tandem_gpu_broad_phase_report, where); TANDEM_SAME_PLACE(GpuBroadPhaseReport, tandem_gpu_broad_phase_report, count);
  TANDEM_SAME_PLACE(GpuBroadPhaseReport, tandem_gpu_broad_phase_report, found);
TANDEM_SAME_SIZE(GpuContactCapacity, tandem_gpu_query_capacity); TANDEM_SAME_PLACE(GpuContactCapacity, tandem_gpu_query_capacity, pairs);
  TANDEM_SAME_PLACE(GpuContactCapacity, tandem_gpu_query_capacity, contacts); TANDEM_SAME_PLACE(GpuContactCapacity, tandem_gpu_query_capacity,
  undecided);
TANDEM_SAME_SIZE(GpuContactReport, tandem_gpu_query_report); TANDEM_SAME_PLACE(GpuContactReport, tandem_gpu_query_report, status);
  TANDEM_SAME_PLACE(GpuContactReport, tandem_gpu_query_report, complete); TANDEM_SAME_PLACE(GpuContactReport, tandem_gpu_query_report, where);
  TANDEM_SAME_PLACE(GpuContactReport, tandem_gpu_query_report, needed); TANDEM_SAME_PLACE(GpuContactReport, tandem_gpu_query_report, contacts);
  TANDEM_SAME_PLACE(GpuContactReport, tandem_gpu_query_report, world_pairs); TANDEM_SAME_PLACE(GpuContactReport, tandem_gpu_query_report, counters);
TANDEM_SAME_SIZE(GpuGroupCounts, tandem_gpu_group_counts); TANDEM_SAME_PLACE(GpuGroupCounts, tandem_gpu_group_counts, pairs);
  TANDEM_SAME_PLACE(GpuGroupCounts, tandem_gpu_group_counts, contacts); TANDEM_SAME_PLACE(GpuGroupCounts, tandem_gpu_group_counts, few);
  TANDEM_SAME_PLACE(GpuGroupCounts, tandem_gpu_group_counts, many);
TANDEM_SAME_SIZE(GpuManifoldCapacity, tandem_gpu_manifold_capacity); TANDEM_SAME_PLACE(GpuManifoldCapacity, tandem_gpu_manifold_capacity, pairs);
  TANDEM_SAME_PLACE(GpuManifoldCapacity, tandem_gpu_manifold_capacity, contacts); TANDEM_SAME_PLACE(GpuManifoldCapacity, tandem_gpu_manifold_capacity,
  manifolds); TANDEM_SAME_PLACE(GpuManifoldCapacity, tandem_gpu_manifold_capacity, points);
TANDEM_SAME_SIZE(GpuManifoldReport, tandem_gpu_manifold_report); TANDEM_SAME_PLACE(GpuManifoldReport, tandem_gpu_manifold_report, status);
  TANDEM_SAME_PLACE(GpuManifoldReport, tandem_gpu_manifold_report, complete); TANDEM_SAME_PLACE(GpuManifoldReport, tandem_gpu_manifold_report,
  needed); TANDEM_SAME_PLACE(GpuManifoldReport, tandem_gpu_manifold_report, manifolds); TANDEM_SAME_PLACE(GpuManifoldReport,
  tandem_gpu_manifold_report, points); TANDEM_SAME_PLACE(GpuManifoldReport, tandem_gpu_manifold_report, counters);
TANDEM_SAME_SIZE(GpuContainmentCapacity, tandem_gpu_containment_capacity); TANDEM_SAME_PLACE(GpuContainmentCapacity, tandem_gpu_containment_capacity,
  pairs); TANDEM_SAME_PLACE(GpuContainmentCapacity, tandem_gpu_containment_capacity, contained);
TANDEM_SAME_SIZE(GpuContainmentReport, tandem_gpu_containment_report); TANDEM_SAME_PLACE(GpuContainmentReport, tandem_gpu_containment_report, status);
  TANDEM_SAME_PLACE(GpuContainmentReport, tandem_gpu_containment_report, complete); TANDEM_SAME_PLACE(GpuContainmentReport,
  tandem_gpu_containment_report, needed); TANDEM_SAME_PLACE(GpuContainmentReport, tandem_gpu_containment_report, contained);
TANDEM_SAME_SIZE(GpuDistanceCapacity, tandem_gpu_distance_capacity); TANDEM_SAME_PLACE(GpuDistanceCapacity, tandem_gpu_distance_capacity, pairs);
  TANDEM_SAME_PLACE(GpuDistanceCapacity, tandem_gpu_distance_capacity, block_pairs); TANDEM_SAME_PLACE(GpuDistanceCapacity,
  tandem_gpu_distance_capacity, triangle_pairs); TANDEM_SAME_PLACE(GpuDistanceCapacity, tandem_gpu_distance_capacity, settled);
  TANDEM_SAME_PLACE(GpuDistanceCapacity, tandem_gpu_distance_capacity, words);
TANDEM_SAME_SIZE(GpuDistanceReport, tandem_gpu_distance_report); TANDEM_SAME_PLACE(GpuDistanceReport, tandem_gpu_distance_report, status);
  TANDEM_SAME_PLACE(GpuDistanceReport, tandem_gpu_distance_report, complete); TANDEM_SAME_PLACE(GpuDistanceReport, tandem_gpu_distance_report, where);
  TANDEM_SAME_PLACE(GpuDistanceReport, tandem_gpu_distance_report, needed); TANDEM_SAME_PLACE(GpuDistanceReport, tandem_gpu_distance_report,
  world_pairs); TANDEM_SAME_PLACE(GpuDistanceReport, tandem_gpu_distance_report, rounds); TANDEM_SAME_PLACE(GpuDistanceReport,
  tandem_gpu_distance_report, counters);
TANDEM_SAME_SIZE(GpuImpactCapacity, tandem_gpu_impact_capacity); TANDEM_SAME_PLACE(GpuImpactCapacity, tandem_gpu_impact_capacity, instances);
  TANDEM_SAME_PLACE(GpuImpactCapacity, tandem_gpu_impact_capacity, pairs); TANDEM_SAME_PLACE(GpuImpactCapacity, tandem_gpu_impact_capacity, contacts);
  TANDEM_SAME_PLACE(GpuImpactCapacity, tandem_gpu_impact_capacity, undecided); TANDEM_SAME_PLACE(GpuImpactCapacity, tandem_gpu_impact_capacity,
  parts); TANDEM_SAME_PLACE(GpuImpactCapacity, tandem_gpu_impact_capacity, block_pairs); TANDEM_SAME_PLACE(GpuImpactCapacity,
  tandem_gpu_impact_capacity, triangle_pairs);
TANDEM_SAME_SIZE(GpuImpactReport, tandem_gpu_impact_report); TANDEM_SAME_PLACE(GpuImpactReport, tandem_gpu_impact_report, status);
  TANDEM_SAME_PLACE(GpuImpactReport, tandem_gpu_impact_report, complete); TANDEM_SAME_PLACE(GpuImpactReport, tandem_gpu_impact_report, where);
  TANDEM_SAME_PLACE(GpuImpactReport, tandem_gpu_impact_report, needed); TANDEM_SAME_PLACE(GpuImpactReport, tandem_gpu_impact_report, impacts);
  TANDEM_SAME_PLACE(GpuImpactReport, tandem_gpu_impact_report, rounds); TANDEM_SAME_PLACE(GpuImpactReport, tandem_gpu_impact_report, counters);
TANDEM_SAME_SIZE(GpuToleranceCapacity, tandem_gpu_tolerance_capacity); TANDEM_SAME_PLACE(GpuToleranceCapacity, tandem_gpu_tolerance_capacity,
  instances); TANDEM_SAME_PLACE(GpuToleranceCapacity, tandem_gpu_tolerance_capacity, pairs); TANDEM_SAME_PLACE(GpuToleranceCapacity,
  tandem_gpu_tolerance_capacity, undecided);
TANDEM_SAME_SIZE(GpuToleranceReport, tandem_gpu_tolerance_report); TANDEM_SAME_PLACE(GpuToleranceReport, tandem_gpu_tolerance_report, status);
  TANDEM_SAME_PLACE(GpuToleranceReport, tandem_gpu_tolerance_report, complete); TANDEM_SAME_PLACE(GpuToleranceReport, tandem_gpu_tolerance_report,
  where); TANDEM_SAME_PLACE(GpuToleranceReport, tandem_gpu_tolerance_report, needed); TANDEM_SAME_PLACE(GpuToleranceReport,
  tandem_gpu_tolerance_report, world_pairs); TANDEM_SAME_PLACE(GpuToleranceReport, tandem_gpu_tolerance_report, counters);
