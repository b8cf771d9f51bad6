// Written by scripts/write_interface from bindings/c/include/tandem/tandem.h. Do not edit it.

export interface Corner {
  position: number[];
  w: number;
}

export interface Triangle {
  corner: Corner[];
}

/** The place of a body: world = rotation x + translation, x in the mesh file's coordinates; rows of the rotation are consecutive. Rigid to 1e-6, else
 * TANDEM_POSE_NOT_RIGID. */
export interface Pose {
  rotation: number[][];
  translation: number[];
}

/** An asset as a body. */
export interface Instance {
  asset: number;
  pose: Pose;
}

/** Two bodies. */
export interface ObjectPair {
  a: number;
  b: number;
}

export interface MovedCounters {
  object_pairs: number;
  kept: number;
}

/** Two triangles that meet: triangle_a belongs to body a of the object pair, triangle_b to b. */
export interface Contact {
  pair: number;
  triangle_a: number;
  triangle_b: number;
  face_a: number;
  face_b: number;
}

export interface ContactCounters {
  object_pairs: number;
  block_pairs: number;
  candidates: number;
  decided_by_float32: number;
  decided_by_float64: number;
  decided_exactly: number;
  contacts: number;
}

/** A connected region in which the surfaces of two bodies meet (docs/contacts.md). */
export interface Manifold {
  normal: number[];
  area_vector: number[];
  centre: number[];
  depth: number;
  pair: number;
  first_point: number;
  point_count: number;
  flags: number;
}

/** A point of a manifold. */
export interface ManifoldPoint {
  position: number[];
  in_a: number[];
  in_b: number[];
  normal: number[];
  depth: number;
  id: bigint;
  face_a: number;
  face_b: number;
  previous: number;
  manifold: number;
}

export interface ManifoldCounters {
  contacts: number;
  segments: number;
  manifolds: number;
  points: number;
  open_curves: number;
  ambiguous_touches: number;
}

/** A component of a body that meets nothing of another and lies within it. */
export interface Containment {
  pair: number;
  inner: number;
  component: number;
  flags: number;
}

export interface ContainmentCounters {
  object_pairs: number;
  inside: number;
  outer_open: number;
}

/** Triangles of a pair of bodies that were nearest a step ago. */
export interface FormerNearest {
  a: number;
  b: number;
  triangle_a: number;
  triangle_b: number;
}

/** The distance of the surfaces of two bodies (docs/distance.md). */
export interface Distance {
  lower: number;
  upper: number;
  point_a: number[];
  point_b: number[];
  triangle_a: number;
  triangle_b: number;
  face_a: number;
  face_b: number;
}

export interface DistanceCounters {
  object_pairs: number;
  block_pairs: number;
  by_float32: number;
  by_float64: number;
  touching: number;
}

/** The centre goes straight ahead and the body turns about it, both at constant speed. */
export interface Motion {
  velocity: number[];
  angular_velocity: number[];
  centre: number[];
}

/** Says until when two moving bodies surely do not meet (docs/impact.md). */
export interface Impact {
  t_safe: number;
  gap: number;
  point_a: number[];
  point_b: number[];
  triangle_a: number;
  triangle_b: number;
  face_a: number;
  face_b: number;
  status: number;
}

export interface ImpactCounters {
  object_pairs: number;
  at_start: number;
  found: number;
  walks: number;
  block_pairs: number;
  triangle_pairs: number;
  advanced: number;
  steps: number;
  most_steps: number;
  unconverged: number;
}

/** Says whether two bodies meet (docs/levels.md). */
export interface Verdict {
  verdict: number;
  level_a: number;
  level_b: number;
}

export interface ToleranceCounters {
  apart: number;
  touching: number;
  within_tolerance: number;
  work: ContactCounters;
}

/** A body whose world box contains a point. */
export interface BodyAt {
  point: number;
  body: number;
}

/** Two bodies of a configuration, a < b, and bounds of their distance. */
export interface ConfigurationPair {
  configuration: number;
  a: number;
  b: number;
  lower: number;
  upper: number;
}

export interface ConfigurationCounters {
  configurations: number;
  touching: number;
  object_pairs: number;
  block_pairs: number;
}

/** The closest point of the bodies of a scene (docs/points_and_rays.md). */
export interface ClosestPoint {
  lower: number;
  upper: number;
  position: number[];
  body: number;
  triangle: number;
  face: number;
  within: number;
  winding: number;
}

export interface ClosestCounters {
  points: number;
  blocks: number;
  by_float64: number;
}

/** A place where a ray meets a triangle of a body (docs/points_and_rays.md). */
export interface RayHit {
  t: number;
  weight: number[];
  ray: number;
  body: number;
  triangle: number;
  face: number;
}

export interface RayCounters {
  rays: number;
  hits: number;
  blocks: number;
  by_float64: number;
}
