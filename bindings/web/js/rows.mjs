// Written by scripts/write_interface from bindings/c/include/tandem/tandem.h. Do not edit it.
// Each field is [kind, offset, ...counts of an array]; "big" is a u64 that becomes a BigInt.
export const layouts = {
  tandem_open_options: { bytes: 16, fields: { struct_size: ["u32", 0], access: ["u32", 4], check_depth: ["u32", 8], reserved: ["u32", 12] } },
  tandem_memory_options: { bytes: 24, fields: { struct_size: ["u32", 0], check_depth: ["u32", 4], borrow: ["u32", 8], reserved: ["u32", 12], released:
    ["u32", 16], user: ["u32", 20] } },
  tandem_mesh_part: { bytes: 16, fields: { name: ["u32", 0], path: ["u32", 4], face_count: ["u64", 8] } },
  tandem_mesh: { bytes: 44, fields: { struct_size: ["u32", 0], reserved: ["u32", 4], positions: ["u32", 8], vertex_count: ["u32", 12], triangles:
    ["u32", 16], triangle_count: ["u32", 20], faces: ["u32", 24], parts: ["u32", 28], part_count: ["u32", 32], poses: ["u32", 36], pose_count: ["u32",
    40] } },
  tandem_build_options: { bytes: 48, fields: { struct_size: ["u32", 0], effort: ["u32", 4], no_gpu_blocks: ["u32", 8], no_topology: ["u32", 12],
    no_refit: ["u32", 16], threads: ["u32", 20], imaginary_share: ["f64", 24], provenance: ["u32", 32], progress: ["u32", 36], user: ["u32", 40] } },
  tandem_build_report: { bytes: 80, fields: { struct_size: ["u32", 0], reserved: ["u32", 4], index_out_of_range: ["u64", 8], not_finite: ["u64", 16],
    too_large: ["u64", 24], degenerate: ["u64", 32], duplicate: ["u64", 40], duplicate_reversed: ["u64", 48], flattened: ["u64", 56],
    vertices_unreferenced: ["u64", 64], vertices_welded: ["u64", 72] } },
  tandem_asset_info: { bytes: 104, fields: { struct_size: ["u32", 0], level_count: ["u32", 4], first_level: ["u32", 8], part_count: ["u32", 12],
    file_bytes: ["u64", 16], hash: ["big", 24], source_faces: ["u64", 32], source_vertices: ["u64", 40], origin: ["f64", 48, 3], rounding_error:
    ["f64", 72], lower: ["f32", 80, 3], upper: ["f32", 92, 3] } },
  tandem_corner: { bytes: 16, fields: { position: ["f32", 0, 3], w: ["u32", 12] } },
  tandem_triangle: { bytes: 48, fields: { corner: ["tandem_corner", 0, 3] } },
  tandem_level: { bytes: 56, fields: { struct_size: ["u32", 0], triangle_count: ["u32", 4], block_count: ["u32", 8], leaf_block_count: ["u32", 12],
    depth: ["u32", 16], has_oriented_blocks: ["u32", 20], has_topology: ["u32", 24], vertex_count: ["u32", 28], component_count: ["u32", 32], closed:
    ["u32", 36], error_bound: ["f64", 40], triangles: ["u32", 48] } },
  tandem_part: { bytes: 40, fields: { struct_size: ["u32", 0], reserved: ["u32", 4], name: ["u32", 8], path: ["u32", 12], name_bytes: ["u32", 16],
    path_bytes: ["u32", 20], first_face: ["u64", 24], face_count: ["u64", 32] } },
  tandem_pose: { bytes: 96, fields: { rotation: ["f64", 0, 3, 3], translation: ["f64", 72, 3] } },
  tandem_instance: { bytes: 104, fields: { asset: ["u32", 0], reserved: ["u32", 4], pose: ["tandem_pose", 8] } },
  tandem_object_pair: { bytes: 8, fields: { a: ["u32", 0], b: ["u32", 4] } },
  tandem_pair_filter: { bytes: 32, fields: { struct_size: ["u32", 0], reserved: ["u32", 4], count: ["u32", 8], motion: ["u32", 12], group: ["u32",
    16], mask: ["u32", 20], world: ["u32", 24], excluded: ["u32", 28] } },
  tandem_pair_options: { bytes: 16, fields: { struct_size: ["u32", 0], self_pairs: ["u32", 4], reach: ["f64", 8] } },
  tandem_moved_options: { bytes: 32, fields: { struct_size: ["u32", 0], reserved: ["u32", 4], tolerance: ["f64", 8], tolerance_of_pair: ["u32", 16],
    tolerance_count: ["u32", 20], pairs: ["u32", 24], pair_count: ["u32", 28] } },
  tandem_moved_counters: { bytes: 16, fields: { object_pairs: ["u64", 0], kept: ["u64", 8] } },
  tandem_contact_options: { bytes: 40, fields: { struct_size: ["u32", 0], mode: ["u32", 4], first_contact_only: ["u32", 8], self_pairs: ["u32", 12],
    add_error_bounds: ["u32", 16], leave_out_rings: ["u32", 20], within: ["f64", 24], pairs: ["u32", 32], pair_count: ["u32", 36] } },
  tandem_contact: { bytes: 20, fields: { pair: ["u32", 0], triangle_a: ["u32", 4], triangle_b: ["u32", 8], face_a: ["u32", 12], face_b: ["u32", 16] }
    },
  tandem_contact_counters: { bytes: 56, fields: { object_pairs: ["u64", 0], block_pairs: ["u64", 8], candidates: ["u64", 16], decided_by_float32:
    ["u64", 24], decided_by_float64: ["u64", 32], decided_exactly: ["u64", 40], contacts: ["u64", 48] } },
  tandem_manifold_options: { bytes: 20, fields: { struct_size: ["u32", 0], most_points: ["u32", 4], ignore_previous: ["u32", 8], keep: ["u32", 12],
    quick_depths: ["u32", 16] } },
  tandem_manifold: { bytes: 96, fields: { normal: ["f64", 0, 3], area_vector: ["f64", 24, 3], centre: ["f64", 48, 3], depth: ["f64", 72], pair:
    ["u32", 80], first_point: ["u32", 84], point_count: ["u32", 88], flags: ["u32", 92] } },
  tandem_manifold_point: { bytes: 128, fields: { position: ["f64", 0, 3], in_a: ["f64", 24, 3], in_b: ["f64", 48, 3], normal: ["f64", 72, 3], depth:
    ["f64", 96], id: ["big", 104], face_a: ["u32", 112], face_b: ["u32", 116], previous: ["u32", 120], manifold: ["u32", 124] } },
  tandem_manifold_counters: { bytes: 48, fields: { contacts: ["u64", 0], segments: ["u64", 8], manifolds: ["u64", 16], points: ["u64", 24],
    open_curves: ["u64", 32], ambiguous_touches: ["u64", 40] } },
  tandem_containment: { bytes: 16, fields: { pair: ["u32", 0], inner: ["u32", 4], component: ["u32", 8], flags: ["u32", 12] } },
  tandem_containment_counters: { bytes: 24, fields: { object_pairs: ["u64", 0], inside: ["u64", 8], outer_open: ["u64", 16] } },
  tandem_former_nearest: { bytes: 16, fields: { a: ["u32", 0], b: ["u32", 4], triangle_a: ["u32", 8], triangle_b: ["u32", 12] } },
  tandem_distance_options: { bytes: 48, fields: { struct_size: ["u32", 0], limit_reach: ["u32", 4], reach: ["f64", 8], absolute_tolerance: ["f64",
    16], relative_tolerance: ["f64", 24], former: ["u32", 32], former_count: ["u32", 36], pairs: ["u32", 40], pair_count: ["u32", 44] } },
  tandem_distance: { bytes: 80, fields: { lower: ["f64", 0], upper: ["f64", 8], point_a: ["f64", 16, 3], point_b: ["f64", 40, 3], triangle_a: ["u32",
    64], triangle_b: ["u32", 68], face_a: ["u32", 72], face_b: ["u32", 76] } },
  tandem_distance_counters: { bytes: 40, fields: { object_pairs: ["u64", 0], block_pairs: ["u64", 8], by_float32: ["u64", 16], by_float64: ["u64",
    24], touching: ["u64", 32] } },
  tandem_motion: { bytes: 72, fields: { velocity: ["f64", 0, 3], angular_velocity: ["f64", 24, 3], centre: ["f64", 48, 3] } },
  tandem_impact_options: { bytes: 40, fields: { struct_size: ["u32", 0], reserved: ["u32", 4], duration: ["f64", 8], tolerance: ["f64", 16], motion:
    ["u32", 24], motion_count: ["u32", 28], pairs: ["u32", 32], pair_count: ["u32", 36] } },
  tandem_impact: { bytes: 88, fields: { t_safe: ["f64", 0], gap: ["f64", 8], point_a: ["f64", 16, 3], point_b: ["f64", 40, 3], triangle_a: ["u32",
    64], triangle_b: ["u32", 68], face_a: ["u32", 72], face_b: ["u32", 76], status: ["u8", 80], reserved: ["u8", 81, 7] } },
  tandem_impact_counters: { bytes: 80, fields: { object_pairs: ["u64", 0], at_start: ["u64", 8], found: ["u64", 16], walks: ["u64", 24], block_pairs:
    ["u64", 32], triangle_pairs: ["u64", 40], advanced: ["u64", 48], steps: ["u64", 56], most_steps: ["u64", 64], unconverged: ["u64", 72] } },
  tandem_tolerance_options: { bytes: 24, fields: { struct_size: ["u32", 0], reserved: ["u32", 4], tolerance: ["f64", 8], pairs: ["u32", 16],
    pair_count: ["u32", 20] } },
  tandem_verdict: { bytes: 3, fields: { verdict: ["u8", 0], level_a: ["u8", 1], level_b: ["u8", 2] } },
  tandem_tolerance_counters: { bytes: 80, fields: { apart: ["u64", 0], touching: ["u64", 8], within_tolerance: ["u64", 16], work:
    ["tandem_contact_counters", 24] } },
  tandem_bodies_at_options: { bytes: 16, fields: { struct_size: ["u32", 0], reserved: ["u32", 4], points: ["u32", 8], point_count: ["u32", 12] } },
  tandem_body_at: { bytes: 8, fields: { point: ["u32", 0], body: ["u32", 4] } },
  tandem_configuration_options: { bytes: 48, fields: { struct_size: ["u32", 0], find: ["u32", 4], bodies: ["u32", 8], body_count: ["u32", 12], poses:
    ["u32", 16], pose_count: ["u32", 20], within: ["f64", 24], absolute_tolerance: ["f64", 32], relative_tolerance: ["f64", 40] } },
  tandem_configuration_pair: { bytes: 32, fields: { configuration: ["u64", 0], a: ["u32", 8], b: ["u32", 12], lower: ["f64", 16], upper: ["f64", 24] }
    },
  tandem_configuration_counters: { bytes: 32, fields: { configurations: ["u64", 0], touching: ["u64", 8], object_pairs: ["u64", 16], block_pairs:
    ["u64", 24] } },
  tandem_closest_options: { bytes: 56, fields: { struct_size: ["u32", 0], limit_reach: ["u32", 4], sides: ["u32", 8], reserved: ["u32", 12], reach:
    ["f64", 16], absolute_tolerance: ["f64", 24], relative_tolerance: ["f64", 32], points: ["u32", 40], point_count: ["u32", 44], bodies: ["u32", 48],
    body_count: ["u32", 52] } },
  tandem_closest_point: { bytes: 64, fields: { lower: ["f64", 0], upper: ["f64", 8], position: ["f64", 16, 3], body: ["u32", 40], triangle: ["u32",
    44], face: ["u32", 48], within: ["u32", 52], winding: ["i32", 56], reserved: ["u32", 60] } },
  tandem_closest_counters: { bytes: 24, fields: { points: ["u64", 0], blocks: ["u64", 8], by_float64: ["u64", 16] } },
  tandem_ray_options: { bytes: 40, fields: { struct_size: ["u32", 0], hits: ["u32", 4], limit_reach: ["u32", 8], reserved: ["u32", 12], reach: ["f64",
    16], origins: ["u32", 24], directions: ["u32", 28], ray_count: ["u32", 32] } },
  tandem_ray_hit: { bytes: 40, fields: { t: ["f64", 0], weight: ["f64", 8, 2], ray: ["u32", 24], body: ["u32", 28], triangle: ["u32", 32], face:
    ["u32", 36] } },
  tandem_ray_counters: { bytes: 32, fields: { rays: ["u64", 0], hits: ["u64", 8], blocks: ["u64", 16], by_float64: ["u64", 24] } },
  tandem_questions: { bytes: 48, fields: { struct_size: ["u32", 0], contained: ["u32", 4], pairs: ["u32", 8], contacts: ["u32", 12], manifolds:
    ["u32", 16], distances: ["u32", 20], impacts: ["u32", 24], verdicts: ["u32", 28], bodies_at: ["u32", 32], configurations: ["u32", 36], closest:
    ["u32", 40], rays: ["u32", 44] } },
  tandem_counters: { bytes: 440, fields: { struct_size: ["u32", 0], reserved: ["u32", 4], contacts: ["tandem_contact_counters", 8], manifolds:
    ["tandem_manifold_counters", 64], contained: ["tandem_containment_counters", 112], distances: ["tandem_distance_counters", 136], impacts:
    ["tandem_impact_counters", 176], verdicts: ["tandem_tolerance_counters", 256], moved: ["tandem_moved_counters", 336], configurations:
    ["tandem_configuration_counters", 352], closest: ["tandem_closest_counters", 384], rays: ["tandem_ray_counters", 408] } },
};
