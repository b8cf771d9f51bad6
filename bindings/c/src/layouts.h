// Written by scripts/write_interface from bindings/c/include/tandem/tandem.h. Do not edit it.
// clang-format off
TANDEM_SAME_SIZE(Triangle::Corner, tandem_corner); TANDEM_SAME_PLACE(Triangle::Corner, tandem_corner, position); TANDEM_SAME_PLACE(Triangle::Corner,
  tandem_corner, w);
TANDEM_SAME_SIZE(Triangle, tandem_triangle); TANDEM_SAME_PLACE(Triangle, tandem_triangle, corner);
TANDEM_SAME_SIZE(Pose, tandem_pose); TANDEM_SAME_PLACE(Pose, tandem_pose, rotation); TANDEM_SAME_PLACE(Pose, tandem_pose, translation);
TANDEM_SAME_SIZE(Instance, tandem_instance); TANDEM_SAME_PLACE(Instance, tandem_instance, asset); TANDEM_SAME_PLACE(Instance, tandem_instance, pose);
TANDEM_SAME_SIZE(ObjectPair, tandem_object_pair); TANDEM_SAME_PLACE(ObjectPair, tandem_object_pair, a); TANDEM_SAME_PLACE(ObjectPair,
  tandem_object_pair, b);
TANDEM_SAME_SIZE(Contact, tandem_contact); TANDEM_SAME_PLACE(Contact, tandem_contact, pair); TANDEM_SAME_PLACE(Contact, tandem_contact, triangle_a);
  TANDEM_SAME_PLACE(Contact, tandem_contact, triangle_b); TANDEM_SAME_PLACE(Contact, tandem_contact, face_a); TANDEM_SAME_PLACE(Contact,
  tandem_contact, face_b);
TANDEM_SAME_SIZE(ContactCounters, tandem_contact_counters); TANDEM_SAME_PLACE(ContactCounters, tandem_contact_counters, object_pairs);
  TANDEM_SAME_PLACE(ContactCounters, tandem_contact_counters, block_pairs); TANDEM_SAME_PLACE(ContactCounters, tandem_contact_counters, candidates);
  TANDEM_SAME_PLACE(ContactCounters, tandem_contact_counters, decided_by_float32); TANDEM_SAME_PLACE(ContactCounters, tandem_contact_counters,
  decided_by_float64); TANDEM_SAME_PLACE(ContactCounters, tandem_contact_counters, decided_exactly); TANDEM_SAME_PLACE(ContactCounters,
  tandem_contact_counters, contacts);
TANDEM_SAME_SIZE(Manifold, tandem_manifold); TANDEM_SAME_PLACE(Manifold, tandem_manifold, normal); TANDEM_SAME_PLACE(Manifold, tandem_manifold,
  area_vector); TANDEM_SAME_PLACE(Manifold, tandem_manifold, centre); TANDEM_SAME_PLACE(Manifold, tandem_manifold, depth); TANDEM_SAME_PLACE(Manifold,
  tandem_manifold, pair); TANDEM_SAME_PLACE(Manifold, tandem_manifold, first_point); TANDEM_SAME_PLACE(Manifold, tandem_manifold, point_count);
  TANDEM_SAME_PLACE(Manifold, tandem_manifold, flags);
TANDEM_SAME_SIZE(ManifoldPoint, tandem_manifold_point); TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, position);
  TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, in_a); TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, in_b);
  TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, depth); TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, id);
  TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, face_a); TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, face_b);
  TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, previous); TANDEM_SAME_PLACE(ManifoldPoint, tandem_manifold_point, manifold);
TANDEM_SAME_SIZE(ManifoldCounters, tandem_manifold_counters); TANDEM_SAME_PLACE(ManifoldCounters, tandem_manifold_counters, contacts);
  TANDEM_SAME_PLACE(ManifoldCounters, tandem_manifold_counters, segments); TANDEM_SAME_PLACE(ManifoldCounters, tandem_manifold_counters, manifolds);
  TANDEM_SAME_PLACE(ManifoldCounters, tandem_manifold_counters, points); TANDEM_SAME_PLACE(ManifoldCounters, tandem_manifold_counters, open_curves);
  TANDEM_SAME_PLACE(ManifoldCounters, tandem_manifold_counters, ambiguous_touches);
TANDEM_SAME_SIZE(Containment, tandem_containment); TANDEM_SAME_PLACE(Containment, tandem_containment, pair); TANDEM_SAME_PLACE(Containment,
  tandem_containment, inner); TANDEM_SAME_PLACE(Containment, tandem_containment, component); TANDEM_SAME_PLACE(Containment, tandem_containment,
  flags);
TANDEM_SAME_SIZE(ContainmentCounters, tandem_containment_counters); TANDEM_SAME_PLACE(ContainmentCounters, tandem_containment_counters, object_pairs);
  TANDEM_SAME_PLACE(ContainmentCounters, tandem_containment_counters, inside); TANDEM_SAME_PLACE(ContainmentCounters, tandem_containment_counters,
  outer_open);
TANDEM_SAME_SIZE(FormerNearest, tandem_former_nearest); TANDEM_SAME_PLACE(FormerNearest, tandem_former_nearest, a); TANDEM_SAME_PLACE(FormerNearest,
  tandem_former_nearest, b); TANDEM_SAME_PLACE(FormerNearest, tandem_former_nearest, triangle_a); TANDEM_SAME_PLACE(FormerNearest,
  tandem_former_nearest, triangle_b);
TANDEM_SAME_SIZE(ObjectDistance, tandem_distance); TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, lower); TANDEM_SAME_PLACE(ObjectDistance,
  tandem_distance, upper); TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, point_a); TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, point_b);
  TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, triangle_a); TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, triangle_b);
  TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, face_a); TANDEM_SAME_PLACE(ObjectDistance, tandem_distance, face_b);
TANDEM_SAME_SIZE(DistanceCounters, tandem_distance_counters); TANDEM_SAME_PLACE(DistanceCounters, tandem_distance_counters, object_pairs);
  TANDEM_SAME_PLACE(DistanceCounters, tandem_distance_counters, block_pairs); TANDEM_SAME_PLACE(DistanceCounters, tandem_distance_counters,
  by_float32); TANDEM_SAME_PLACE(DistanceCounters, tandem_distance_counters, by_float64); TANDEM_SAME_PLACE(DistanceCounters,
  tandem_distance_counters, touching);
TANDEM_SAME_SIZE(RigidMotion, tandem_motion); TANDEM_SAME_PLACE(RigidMotion, tandem_motion, velocity); TANDEM_SAME_PLACE(RigidMotion, tandem_motion,
  angular_velocity); TANDEM_SAME_PLACE(RigidMotion, tandem_motion, center);
TANDEM_SAME_SIZE(Impact, tandem_impact); TANDEM_SAME_PLACE(Impact, tandem_impact, t_safe); TANDEM_SAME_PLACE(Impact, tandem_impact, gap);
  TANDEM_SAME_PLACE(Impact, tandem_impact, point_a); TANDEM_SAME_PLACE(Impact, tandem_impact, point_b); TANDEM_SAME_PLACE(Impact, tandem_impact,
  triangle_a); TANDEM_SAME_PLACE(Impact, tandem_impact, triangle_b); TANDEM_SAME_PLACE(Impact, tandem_impact, face_a); TANDEM_SAME_PLACE(Impact,
  tandem_impact, face_b); TANDEM_SAME_PLACE(Impact, tandem_impact, status);
TANDEM_SAME_SIZE(ImpactCounters, tandem_impact_counters); TANDEM_SAME_PLACE(ImpactCounters, tandem_impact_counters, object_pairs);
  TANDEM_SAME_PLACE(ImpactCounters, tandem_impact_counters, at_start); TANDEM_SAME_PLACE(ImpactCounters, tandem_impact_counters, found);
  TANDEM_SAME_PLACE(ImpactCounters, tandem_impact_counters, walks); TANDEM_SAME_PLACE(ImpactCounters, tandem_impact_counters, block_pairs);
  TANDEM_SAME_PLACE(ImpactCounters, tandem_impact_counters, triangle_pairs); TANDEM_SAME_PLACE(ImpactCounters, tandem_impact_counters, advanced);
  TANDEM_SAME_PLACE(ImpactCounters, tandem_impact_counters, steps); TANDEM_SAME_PLACE(ImpactCounters, tandem_impact_counters, most_steps);
  TANDEM_SAME_PLACE(ImpactCounters, tandem_impact_counters, unconverged);
TANDEM_SAME_SIZE(PairVerdict, tandem_verdict); TANDEM_SAME_PLACE(PairVerdict, tandem_verdict, verdict); TANDEM_SAME_PLACE(PairVerdict, tandem_verdict,
  level_a); TANDEM_SAME_PLACE(PairVerdict, tandem_verdict, level_b);
TANDEM_SAME_SIZE(ToleranceCounters, tandem_tolerance_counters); TANDEM_SAME_PLACE(ToleranceCounters, tandem_tolerance_counters, apart);
  TANDEM_SAME_PLACE(ToleranceCounters, tandem_tolerance_counters, touching); TANDEM_SAME_PLACE(ToleranceCounters, tandem_tolerance_counters,
  within_tolerance); TANDEM_SAME_PLACE(ToleranceCounters, tandem_tolerance_counters, work);
