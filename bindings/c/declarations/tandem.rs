//! Tandem's C interface, without its comments. Written by scripts/write_interface from bindings/c/include/tandem/tandem.h. Do not edit it.
#![allow(dead_code, non_camel_case_types)]
use std::ffi::{c_char, c_void};

pub type tandem_status = u32;
pub const TANDEM_OK: u32 = 0;
pub const TANDEM_NULL_ARGUMENT: u32 = 1;
pub const TANDEM_BAD_STRUCT_SIZE: u32 = 2;
pub const TANDEM_BAD_OPTION: u32 = 3;
pub const TANDEM_OUT_OF_MEMORY: u32 = 4;
pub const TANDEM_CANNOT_START_THREAD: u32 = 5;
pub const TANDEM_INTERNAL_ERROR: u32 = 6;
pub const TANDEM_UNKNOWN_LEVEL: u32 = 7;
pub const TANDEM_FILTER_MISMATCH: u32 = 8;
pub const TANDEM_CONTACTS_MISSING: u32 = 9;
pub const TANDEM_BAD_MOTION: u32 = 10;
pub const TANDEM_NO_TRIANGLE: u32 = 11;
pub const TANDEM_TOO_MANY_TRIANGLES: u32 = 12;
pub const TANDEM_ASSETS_MISSING: u32 = 13;
pub const TANDEM_FILE_NOT_FOUND: u32 = 100;
pub const TANDEM_NOT_A_REGULAR_FILE: u32 = 101;
pub const TANDEM_CANNOT_OPEN: u32 = 102;
pub const TANDEM_CANNOT_READ: u32 = 103;
pub const TANDEM_MISALIGNED: u32 = 104;
pub const TANDEM_BIOVISION_MOTION_CAPTURE: u32 = 105;
pub const TANDEM_NOT_TANDEM: u32 = 106;
pub const TANDEM_DAMAGED_BY_TEXT_TRANSFER: u32 = 107;
pub const TANDEM_WRONG_BYTE_ORDER: u32 = 108;
pub const TANDEM_UNSUPPORTED_VERSION: u32 = 109;
pub const TANDEM_TRUNCATED: u32 = 110;
pub const TANDEM_TRAILING_BYTES: u32 = 111;
pub const TANDEM_CONTENT_CHANGED: u32 = 112;
pub const TANDEM_BAD_HEADER: u32 = 120;
pub const TANDEM_BAD_SECTION_TABLE: u32 = 121;
pub const TANDEM_UNKNOWN_SECTION: u32 = 122;
pub const TANDEM_SECTION_MISALIGNED: u32 = 123;
pub const TANDEM_SECTION_OUT_OF_BOUNDS: u32 = 124;
pub const TANDEM_SECTIONS_OVERLAP: u32 = 125;
pub const TANDEM_SECTION_SIZE_MISMATCH: u32 = 126;
pub const TANDEM_SECTION_MISSING: u32 = 127;
pub const TANDEM_SECTION_DUPLICATED: u32 = 128;
pub const TANDEM_BAD_GAP: u32 = 129;
pub const TANDEM_BAD_LEVEL: u32 = 130;
pub const TANDEM_BAD_PART: u32 = 131;
pub const TANDEM_BAD_NODE_KIND: u32 = 140;
pub const TANDEM_IMAGINARY_BEFORE_REAL: u32 = 141;
pub const TANDEM_EMPTY_BLOCK: u32 = 142;
pub const TANDEM_PARTIAL_LEAF_BLOCK: u32 = 143;
pub const TANDEM_BAD_IMAGINARY_NODE: u32 = 144;
pub const TANDEM_BAD_BOX: u32 = 145;
pub const TANDEM_CHILD_OUT_OF_RANGE: u32 = 146;
pub const TANDEM_CHILD_NOT_AFTER_PARENT: u32 = 147;
pub const TANDEM_CHILD_SHARED: u32 = 148;
pub const TANDEM_BLOCK_UNREACHABLE: u32 = 149;
pub const TANDEM_BLOCK_ORDER: u32 = 150;
pub const TANDEM_TOO_DEEP: u32 = 151;
pub const TANDEM_DEPTH_MISMATCH: u32 = 152;
pub const TANDEM_LEAF_COUNT_MISMATCH: u32 = 153;
pub const TANDEM_TRIANGLE_ORDER: u32 = 154;
pub const TANDEM_TRIANGLE_NOT_FINITE: u32 = 155;
pub const TANDEM_TRIANGLE_OUTSIDE_LEAF_BOX: u32 = 156;
pub const TANDEM_CHILD_OUTSIDE_PARENT_BOX: u32 = 157;
pub const TANDEM_BAD_FACE: u32 = 158;
pub const TANDEM_BOUNDS_MISMATCH: u32 = 159;
pub const TANDEM_LEVEL_OUTSIDE_BOUNDS: u32 = 160;
pub const TANDEM_ORIENTED_BLOCK_MISMATCH: u32 = 170;
pub const TANDEM_BAD_ROTATION: u32 = 171;
pub const TANDEM_BAD_ORIENTED_BOX: u32 = 172;
pub const TANDEM_TRIANGLE_OUTSIDE_ORIENTED_BOX: u32 = 173;
pub const TANDEM_BAD_TOPOLOGY: u32 = 180;
pub const TANDEM_VERTEX_ORDER: u32 = 181;
pub const TANDEM_VERTEX_MISMATCH: u32 = 182;
pub const TANDEM_EDGE_MISMATCH: u32 = 183;
pub const TANDEM_BAD_WINDING: u32 = 184;
pub const TANDEM_COMPONENT_MISMATCH: u32 = 185;
pub const TANDEM_SOURCE_VERTEX_MISMATCH: u32 = 186;
pub const TANDEM_OUT_OF_RANGE: u32 = 200;
pub const TANDEM_UNKNOWN_ASSET: u32 = 201;
pub const TANDEM_UNKNOWN_INSTANCE: u32 = 202;
pub const TANDEM_UNKNOWN_CONTACT: u32 = 203;
pub const TANDEM_POSE_NOT_RIGID: u32 = 204;
pub const TANDEM_TOO_MANY_INSTANCES: u32 = 205;
pub const TANDEM_TOO_MANY_PAIRS: u32 = 206;
pub const TANDEM_KEPT_MISMATCH: u32 = 207;
pub const TANDEM_MOTION_MISMATCH: u32 = 208;
pub const TANDEM_NO_ORIENTED_BLOCKS: u32 = 209;
pub const TANDEM_NO_AXIS_ALIGNED_BLOCKS: u32 = 210;
pub const TANDEM_NO_TOPOLOGY: u32 = 211;
pub const TANDEM_NO_FINEST_LEVEL: u32 = 212;
pub const TANDEM_BAD_REACH: u32 = 213;
pub const TANDEM_BAD_TOLERANCE: u32 = 214;
pub const TANDEM_BAD_DURATION: u32 = 215;
pub const TANDEM_NO_MASS: u32 = 216;
pub const TANDEM_BAD_JOINT: u32 = 217;
pub const TANDEM_NO_AXIS: u32 = 218;
pub const TANDEM_JOINS_NOTHING: u32 = 219;
pub const TANDEM_NO_SOURCE_VERTICES: u32 = 220;
pub const TANDEM_VERTEX_COUNT_MISMATCH: u32 = 221;
pub const TANDEM_DEFORMED: u32 = 222;
pub const TANDEM_NOT_FLOAT32: u32 = 223;
pub const TANDEM_NO_DIRECTION: u32 = 224;
pub const TANDEM_NO_GPU: u32 = 300;
pub const TANDEM_DRIVER_TOO_OLD: u32 = 301;
pub const TANDEM_GPU_NOT_SUPPORTED: u32 = 302;
pub const TANDEM_OUT_OF_GPU_MEMORY: u32 = 303;
pub const TANDEM_CUDA_FAILED: u32 = 304;
pub const TANDEM_ACCESS_MAP: u32 = 0;
pub const TANDEM_ACCESS_READ: u32 = 1;
pub const TANDEM_CHECK_FULL: u32 = 0;
pub const TANDEM_CHECK_QUICK: u32 = 1;
pub const TANDEM_EFFORT_DEFAULT: u32 = 0;
pub const TANDEM_EFFORT_FAST: u32 = 1;
pub const TANDEM_EFFORT_BEST: u32 = 2;
pub const TANDEM_MOVING: u32 = 0;
pub const TANDEM_FIXED: u32 = 1;
pub const TANDEM_KINEMATIC: u32 = 2;
pub const TANDEM_SLEEPING: u32 = 3;
pub const TANDEM_PAIRS: u32 = 0;
pub const TANDEM_CONTACTS: u32 = 1;
pub const TANDEM_DISTANCES: u32 = 2;
pub const TANDEM_IMPACTS: u32 = 3;
pub const TANDEM_VERDICTS: u32 = 4;
pub const TANDEM_MOVED: u32 = 5;
pub const TANDEM_EXACT: u32 = 0;
pub const TANDEM_FAST: u32 = 1;
pub const TANDEM_BOXES: u32 = 2;
pub const TANDEM_TOUCHING: u32 = 1;
pub const TANDEM_OPEN_CURVE: u32 = 2;
pub const TANDEM_GOES_THROUGH: u32 = 4;
pub const TANDEM_AMBIGUOUS: u32 = 8;
pub const TANDEM_INSIDE: u32 = 1;
pub const TANDEM_OUTER_OPEN: u32 = 2;
pub const TANDEM_NO_IMPACT: u32 = 0;
pub const TANDEM_IMPACT: u32 = 1;
pub const TANDEM_IMPACT_AT_START: u32 = 2;
pub const TANDEM_APART: u32 = 0;
pub const TANDEM_TOUCH: u32 = 1;
pub const TANDEM_WITHIN_TOLERANCE: u32 = 2;
pub const TANDEM_FIRST_HIT: u32 = 0;
pub const TANDEM_ANY_HIT: u32 = 1;
pub const TANDEM_ALL_HITS: u32 = 2;
pub const TANDEM_BALL: u32 = 0;
pub const TANDEM_HINGE: u32 = 1;
pub const TANDEM_SLIDER: u32 = 2;
pub const TANDEM_FIXED_JOINT: u32 = 3;
pub const TANDEM_DISTANCE: u32 = 4;
pub const TANDEM_VERSION_MAJOR: u32 = 0;
pub const TANDEM_VERSION_MINOR: u32 = 1;
pub const TANDEM_VERSION_PATCH: u32 = 0;
pub const TANDEM_NO_INDEX: u32 = 4294967295;
pub const TANDEM_EVERY_WORLD: u32 = 4294967295;

#[repr(C)]
pub struct tandem_asset {
    _private: [u8; 0],
}

#[repr(C)]
pub struct tandem_excluded_pairs {
    _private: [u8; 0],
}

#[repr(C)]
pub struct tandem_scene {
    _private: [u8; 0],
}

#[repr(C)]
pub struct tandem_device {
    _private: [u8; 0],
}

#[repr(C)]
pub struct tandem_world {
    _private: [u8; 0],
}

#[repr(C)]
pub struct tandem_world_state {
    _private: [u8; 0],
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_allocator {
    pub struct_size: u32,
    pub reserved: u32,
    pub user: *mut c_void,
    pub allocate: Option<unsafe extern "C" fn(user: *mut c_void, bytes: usize, alignment: usize) -> *mut c_void>,
    pub deallocate: Option<unsafe extern "C" fn(user: *mut c_void, memory: *mut c_void, bytes: usize, alignment: usize)>,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_open_options {
    pub struct_size: u32,
    pub access: u32,
    pub check_depth: u32,
    pub reserved: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_memory_options {
    pub struct_size: u32,
    pub check_depth: u32,
    pub borrow: u32,
    pub reserved: u32,
    pub released: Option<unsafe extern "C" fn(user: *mut c_void)>,
    pub user: *mut c_void,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_mesh_part {
    pub name: *const c_char,
    pub path: *const c_char,
    pub face_count: u64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_mesh {
    pub struct_size: u32,
    pub reserved: u32,
    pub positions: *const f64,
    pub vertex_count: usize,
    pub triangles: *const u32,
    pub triangle_count: usize,
    pub faces: *const u32,
    pub parts: *const tandem_mesh_part,
    pub part_count: usize,
    pub poses: *const f64,
    pub pose_count: usize,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_build_options {
    pub struct_size: u32,
    pub effort: u32,
    pub no_gpu_blocks: u32,
    pub no_topology: u32,
    pub no_refit: u32,
    pub threads: u32,
    pub imaginary_share: f64,
    pub provenance: *const c_char,
    pub progress: Option<unsafe extern "C" fn(user: *mut c_void, share: f64) -> u32>,
    pub user: *mut c_void,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_build_report {
    pub struct_size: u32,
    pub reserved: u32,
    pub index_out_of_range: u64,
    pub not_finite: u64,
    pub too_large: u64,
    pub degenerate: u64,
    pub duplicate: u64,
    pub duplicate_reversed: u64,
    pub flattened: u64,
    pub vertices_unreferenced: u64,
    pub vertices_welded: u64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_asset_info {
    pub struct_size: u32,
    pub level_count: u32,
    pub first_level: u32,
    pub part_count: u32,
    pub file_bytes: u64,
    pub hash: u64,
    pub source_faces: u64,
    pub source_vertices: u64,
    pub origin: [f64; 3],
    pub rounding_error: f64,
    pub lower: [f32; 3],
    pub upper: [f32; 3],
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_corner {
    pub position: [f32; 3],
    pub w: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_triangle {
    pub corner: [tandem_corner; 3],
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_level {
    pub struct_size: u32,
    pub triangle_count: u32,
    pub block_count: u32,
    pub leaf_block_count: u32,
    pub depth: u32,
    pub has_oriented_blocks: u32,
    pub has_topology: u32,
    pub vertex_count: u32,
    pub component_count: u32,
    pub closed: u32,
    pub error_bound: f64,
    pub triangles: *const tandem_triangle,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_part {
    pub struct_size: u32,
    pub reserved: u32,
    pub name: *const c_char,
    pub path: *const c_char,
    pub name_bytes: usize,
    pub path_bytes: usize,
    pub first_face: u64,
    pub face_count: u64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_pose {
    pub rotation: [[f64; 3]; 3],
    pub translation: [f64; 3],
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_instance {
    pub asset: u32,
    pub reserved: u32,
    pub pose: tandem_pose,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_object_pair {
    pub a: u32,
    pub b: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_pair_filter {
    pub struct_size: u32,
    pub reserved: u32,
    pub count: usize,
    pub motion: *const u8,
    pub group: *const u32,
    pub mask: *const u32,
    pub world: *const u32,
    pub excluded: *const tandem_excluded_pairs,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_pair_options {
    pub struct_size: u32,
    pub self_pairs: u32,
    pub reach: f64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_moved_options {
    pub struct_size: u32,
    pub reserved: u32,
    pub tolerance: f64,
    pub tolerance_of_pair: *const f64,
    pub tolerance_count: usize,
    pub pairs: *const tandem_object_pair,
    pub pair_count: usize,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_moved_counters {
    pub object_pairs: u64,
    pub kept: u64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_contact_options {
    pub struct_size: u32,
    pub mode: u32,
    pub first_contact_only: u32,
    pub self_pairs: u32,
    pub add_error_bounds: u32,
    pub leave_out_rings: u32,
    pub within: f64,
    pub pairs: *const tandem_object_pair,
    pub pair_count: usize,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_contact {
    pub pair: u32,
    pub triangle_a: u32,
    pub triangle_b: u32,
    pub face_a: u32,
    pub face_b: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_contact_counters {
    pub object_pairs: u64,
    pub block_pairs: u64,
    pub candidates: u64,
    pub decided_by_float32: u64,
    pub decided_by_float64: u64,
    pub decided_exactly: u64,
    pub contacts: u64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_manifold_options {
    pub struct_size: u32,
    pub most_points: u32,
    pub ignore_previous: u32,
    pub keep: u32,
    pub quick_depths: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_manifold {
    pub normal: [f64; 3],
    pub area_vector: [f64; 3],
    pub centre: [f64; 3],
    pub depth: f64,
    pub pair: u32,
    pub first_point: u32,
    pub point_count: u32,
    pub flags: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_manifold_point {
    pub position: [f64; 3],
    pub in_a: [f64; 3],
    pub in_b: [f64; 3],
    pub normal: [f64; 3],
    pub depth: f64,
    pub id: u64,
    pub face_a: u32,
    pub face_b: u32,
    pub previous: u32,
    pub manifold: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_manifold_counters {
    pub contacts: u64,
    pub segments: u64,
    pub manifolds: u64,
    pub points: u64,
    pub open_curves: u64,
    pub ambiguous_touches: u64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_containment {
    pub pair: u32,
    pub inner: u32,
    pub component: u32,
    pub flags: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_containment_counters {
    pub object_pairs: u64,
    pub inside: u64,
    pub outer_open: u64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_former_nearest {
    pub a: u32,
    pub b: u32,
    pub triangle_a: u32,
    pub triangle_b: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_distance_options {
    pub struct_size: u32,
    pub limit_reach: u32,
    pub reach: f64,
    pub absolute_tolerance: f64,
    pub relative_tolerance: f64,
    pub former: *const tandem_former_nearest,
    pub former_count: usize,
    pub pairs: *const tandem_object_pair,
    pub pair_count: usize,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_distance {
    pub lower: f64,
    pub upper: f64,
    pub point_a: [f64; 3],
    pub point_b: [f64; 3],
    pub triangle_a: u32,
    pub triangle_b: u32,
    pub face_a: u32,
    pub face_b: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_distance_counters {
    pub object_pairs: u64,
    pub block_pairs: u64,
    pub by_float32: u64,
    pub by_float64: u64,
    pub touching: u64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_motion {
    pub velocity: [f64; 3],
    pub angular_velocity: [f64; 3],
    pub centre: [f64; 3],
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_impact_options {
    pub struct_size: u32,
    pub reserved: u32,
    pub duration: f64,
    pub tolerance: f64,
    pub motion: *const tandem_motion,
    pub motion_count: usize,
    pub pairs: *const tandem_object_pair,
    pub pair_count: usize,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_impact {
    pub t_safe: f64,
    pub gap: f64,
    pub point_a: [f64; 3],
    pub point_b: [f64; 3],
    pub triangle_a: u32,
    pub triangle_b: u32,
    pub face_a: u32,
    pub face_b: u32,
    pub status: u8,
    pub reserved: [u8; 7],
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_impact_counters {
    pub object_pairs: u64,
    pub at_start: u64,
    pub found: u64,
    pub walks: u64,
    pub block_pairs: u64,
    pub triangle_pairs: u64,
    pub advanced: u64,
    pub steps: u64,
    pub most_steps: u64,
    pub unconverged: u64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_tolerance_options {
    pub struct_size: u32,
    pub reserved: u32,
    pub tolerance: f64,
    pub pairs: *const tandem_object_pair,
    pub pair_count: usize,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_verdict {
    pub verdict: u8,
    pub level_a: u8,
    pub level_b: u8,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_tolerance_counters {
    pub apart: u64,
    pub touching: u64,
    pub within_tolerance: u64,
    pub work: tandem_contact_counters,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_bodies_at_options {
    pub struct_size: u32,
    pub reserved: u32,
    pub points: *const f64,
    pub point_count: usize,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_body_at {
    pub point: u32,
    pub body: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_configuration_options {
    pub struct_size: u32,
    pub find: u32,
    pub bodies: *const u32,
    pub body_count: usize,
    pub poses: *const tandem_pose,
    pub pose_count: usize,
    pub within: f64,
    pub absolute_tolerance: f64,
    pub relative_tolerance: f64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_configuration_pair {
    pub configuration: u64,
    pub a: u32,
    pub b: u32,
    pub lower: f64,
    pub upper: f64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_configuration_counters {
    pub configurations: u64,
    pub touching: u64,
    pub object_pairs: u64,
    pub block_pairs: u64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_closest_options {
    pub struct_size: u32,
    pub limit_reach: u32,
    pub sides: u32,
    pub reserved: u32,
    pub reach: f64,
    pub absolute_tolerance: f64,
    pub relative_tolerance: f64,
    pub points: *const f64,
    pub point_count: usize,
    pub bodies: *const u32,
    pub body_count: usize,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_closest_point {
    pub lower: f64,
    pub upper: f64,
    pub position: [f64; 3],
    pub body: u32,
    pub triangle: u32,
    pub face: u32,
    pub within: u32,
    pub winding: i32,
    pub reserved: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_closest_counters {
    pub points: u64,
    pub blocks: u64,
    pub by_float64: u64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_ray_options {
    pub struct_size: u32,
    pub hits: u32,
    pub limit_reach: u32,
    pub reserved: u32,
    pub reach: f64,
    pub origins: *const f64,
    pub directions: *const f64,
    pub ray_count: usize,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_ray_hit {
    pub t: f64,
    pub weight: [f64; 2],
    pub ray: u32,
    pub body: u32,
    pub triangle: u32,
    pub face: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_ray_counters {
    pub rays: u64,
    pub hits: u64,
    pub blocks: u64,
    pub by_float64: u64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_questions {
    pub struct_size: u32,
    pub contained: u32,
    pub pairs: *const tandem_pair_options,
    pub contacts: *const tandem_contact_options,
    pub manifolds: *const tandem_manifold_options,
    pub distances: *const tandem_distance_options,
    pub impacts: *const tandem_impact_options,
    pub verdicts: *const tandem_tolerance_options,
    pub bodies_at: *const tandem_bodies_at_options,
    pub configurations: *const tandem_configuration_options,
    pub closest: *const tandem_closest_options,
    pub rays: *const tandem_ray_options,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_counters {
    pub struct_size: u32,
    pub reserved: u32,
    pub contacts: tandem_contact_counters,
    pub manifolds: tandem_manifold_counters,
    pub contained: tandem_containment_counters,
    pub distances: tandem_distance_counters,
    pub impacts: tandem_impact_counters,
    pub verdicts: tandem_tolerance_counters,
    pub moved: tandem_moved_counters,
    pub configurations: tandem_configuration_counters,
    pub closest: tandem_closest_counters,
    pub rays: tandem_ray_counters,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_world_options {
    pub struct_size: u32,
    pub no_gravity: u32,
    pub no_friction: u32,
    pub no_slop: u32,
    pub no_rolling_resistance: u32,
    pub no_sleeping: u32,
    pub continuous: u32,
    pub substeps: u32,
    pub threads: u32,
    pub reserved: u32,
    pub gravity: [f64; 3],
    pub friction: f64,
    pub restitution: f64,
    pub slop: f64,
    pub rolling_resistance: f64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_joint {
    pub kind: u32,
    pub a: u32,
    pub b: u32,
    pub has_limits: u8,
    pub may_touch: u8,
    pub reserved: [u8; 2],
    pub anchor: [f64; 3],
    pub anchor_b: [f64; 3],
    pub axis: [f64; 3],
    pub least: f64,
    pub most: f64,
    pub speed: f64,
    pub most_effort: f64,
    pub breaking_force: f64,
    pub breaking_torque: f64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_body_start {
    pub struct_size: u32,
    pub reserved: u32,
    pub count: usize,
    pub density: *const f64,
    pub velocity: *const f64,
    pub angular_velocity: *const f64,
    pub friction: *const f64,
    pub restitution: *const f64,
    pub rolling_resistance: *const f64,
    pub gravity_scale: *const f64,
    pub joints: *const tandem_joint,
    pub joint_count: usize,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_body_motion {
    pub pose: tandem_pose,
    pub centre: [f64; 3],
    pub velocity: [f64; 3],
    pub angular_velocity: [f64; 3],
    pub sleeps: u8,
    pub reserved: [u8; 7],
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_world_contact {
    pub a: u32,
    pub b: u32,
    pub position: [f64; 3],
    pub normal: [f64; 3],
    pub depth: f64,
    pub impulse: [f64; 3],
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_world_touch {
    pub a: u32,
    pub b: u32,
    pub impulse: f64,
    pub speed: f64,
    pub position: [f64; 3],
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct tandem_world_joint {
    pub position: f64,
    pub speed: f64,
    pub impulse: [f64; 3],
    pub turning: [f64; 3],
    pub motor_effort: f64,
    pub holds: u8,
    pub reserved: [u8; 7],
}

#[link(name = "tandem")]
extern "C" {
    pub fn tandem_version() -> u32;
    pub fn tandem_status_name(status: tandem_status) -> *const c_char;
    pub fn tandem_status_explain(status: tandem_status) -> *const c_char;
    pub fn tandem_status_subject(status: tandem_status) -> *const c_char;
    pub fn tandem_asset_open(path: *const c_char, options: *const tandem_open_options, allocator: *const tandem_allocator, asset: *mut *mut tandem_asset, at: *mut u64) -> tandem_status;
    pub fn tandem_asset_from_memory(data: *const c_void, bytes: usize, options: *const tandem_memory_options, allocator: *const tandem_allocator, asset: *mut *mut tandem_asset, at: *mut u64) -> tandem_status;
    pub fn tandem_asset_build(mesh: *const tandem_mesh, options: *const tandem_build_options, allocator: *const tandem_allocator, asset: *mut *mut tandem_asset, report: *mut tandem_build_report) -> tandem_status;
    pub fn tandem_asset_retain(asset: *mut tandem_asset);
    pub fn tandem_asset_release(asset: *mut tandem_asset);
    pub fn tandem_asset_data(asset: *const tandem_asset, bytes: *mut usize) -> *const c_void;
    pub fn tandem_asset_get_info(asset: *const tandem_asset, info: *mut tandem_asset_info) -> tandem_status;
    pub fn tandem_asset_get_level(asset: *const tandem_asset, level: u32, result: *mut tandem_level) -> tandem_status;
    pub fn tandem_asset_coarsest_level(asset: *const tandem_asset, tolerance: f64) -> u32;
    pub fn tandem_asset_levels_from(asset: *mut tandem_asset, first: u32, count: u32, levels: *mut *mut tandem_asset) -> tandem_status;
    pub fn tandem_asset_get_part(asset: *const tandem_asset, part: u32, result: *mut tandem_part) -> tandem_status;
    pub fn tandem_asset_provenance(asset: *const tandem_asset, bytes: *mut usize) -> *const c_char;
    pub fn tandem_excluded_pairs_create(pairs: *const tandem_object_pair, count: usize, allocator: *const tandem_allocator, excluded: *mut *mut tandem_excluded_pairs) -> tandem_status;
    pub fn tandem_excluded_pairs_destroy(excluded: *mut tandem_excluded_pairs);
    pub fn tandem_scene_create(allocator: *const tandem_allocator, scene: *mut *mut tandem_scene) -> tandem_status;
    pub fn tandem_scene_create_on(device: *mut tandem_device, allocator: *const tandem_allocator, scene: *mut *mut tandem_scene) -> tandem_status;
    pub fn tandem_device_destroy(device: *mut tandem_device);
    pub fn tandem_scene_destroy(scene: *mut tandem_scene);
    pub fn tandem_scene_set_threads(scene: *mut tandem_scene, threads: u32) -> tandem_status;
    pub fn tandem_scene_set_assets(scene: *mut tandem_scene, assets: *const *mut tandem_asset, count: usize) -> tandem_status;
    pub fn tandem_scene_deform(scene: *mut tandem_scene, asset: u32, positions: *const f32, vertex_count: usize) -> tandem_status;
    pub fn tandem_scene_deform_f64(scene: *mut tandem_scene, asset: u32, positions: *const f64, vertex_count: usize) -> tandem_status;
    pub fn tandem_scene_looseness(scene: *const tandem_scene, asset: u32) -> f64;
    pub fn tandem_scene_place(scene: *mut tandem_scene, instances: *const tandem_instance, count: usize, filter: *const tandem_pair_filter) -> tandem_status;
    pub fn tandem_scene_place_alone(scene: *mut tandem_scene, asset: *mut tandem_asset) -> tandem_status;
    pub fn tandem_scene_add(scene: *mut tandem_scene, instance: *const tandem_instance, filter: *const tandem_pair_filter, body: *mut u32) -> tandem_status;
    pub fn tandem_scene_move(scene: *mut tandem_scene, bodies: *const u32, poses: *const tandem_pose, count: usize) -> tandem_status;
    pub fn tandem_scene_set_motion(scene: *mut tandem_scene, body: u32, motion: u32) -> tandem_status;
    pub fn tandem_scene_remove(scene: *mut tandem_scene, body: u32) -> tandem_status;
    pub fn tandem_scene_instances(scene: *const tandem_scene, count: *mut usize) -> *const tandem_instance;
    pub fn tandem_scene_where(scene: *const tandem_scene) -> u64;
    pub fn tandem_scene_pairs(scene: *const tandem_scene, question: u32, count: *mut usize) -> *const tandem_object_pair;
    pub fn tandem_scene_find_pairs(scene: *mut tandem_scene, options: *const tandem_pair_options) -> tandem_status;
    pub fn tandem_scene_find_moved(scene: *mut tandem_scene, options: *const tandem_moved_options) -> tandem_status;
    pub fn tandem_scene_moved(scene: *const tandem_scene, count: *mut usize) -> *const tandem_object_pair;
    pub fn tandem_scene_find_contacts(scene: *mut tandem_scene, options: *const tandem_contact_options) -> tandem_status;
    pub fn tandem_scene_contacts(scene: *const tandem_scene, count: *mut usize) -> *const tandem_contact;
    pub fn tandem_scene_find_manifolds(scene: *mut tandem_scene, options: *const tandem_manifold_options) -> tandem_status;
    pub fn tandem_scene_manifolds(scene: *const tandem_scene, count: *mut usize) -> *const tandem_manifold;
    pub fn tandem_scene_points(scene: *const tandem_scene, count: *mut usize) -> *const tandem_manifold_point;
    pub fn tandem_scene_find_contained(scene: *mut tandem_scene) -> tandem_status;
    pub fn tandem_scene_contained(scene: *const tandem_scene, count: *mut usize) -> *const tandem_containment;
    pub fn tandem_scene_find_distances(scene: *mut tandem_scene, options: *const tandem_distance_options) -> tandem_status;
    pub fn tandem_scene_distances(scene: *const tandem_scene, count: *mut usize) -> *const tandem_distance;
    pub fn tandem_scene_find_impacts(scene: *mut tandem_scene, options: *const tandem_impact_options) -> tandem_status;
    pub fn tandem_scene_impacts(scene: *const tandem_scene, count: *mut usize) -> *const tandem_impact;
    pub fn tandem_pose_at(start: *const tandem_pose, motion: *const tandem_motion, t: f64, pose: *mut tandem_pose) -> tandem_status;
    pub fn tandem_scene_find_verdicts(scene: *mut tandem_scene, options: *const tandem_tolerance_options) -> tandem_status;
    pub fn tandem_scene_verdicts(scene: *const tandem_scene, count: *mut usize) -> *const tandem_verdict;
    pub fn tandem_scene_find_bodies_at(scene: *mut tandem_scene, options: *const tandem_bodies_at_options) -> tandem_status;
    pub fn tandem_scene_bodies_at(scene: *const tandem_scene, count: *mut usize) -> *const tandem_body_at;
    pub fn tandem_scene_find_configurations(scene: *mut tandem_scene, options: *const tandem_configuration_options) -> tandem_status;
    pub fn tandem_scene_configurations(scene: *const tandem_scene, count: *mut usize) -> *const tandem_configuration_pair;
    pub fn tandem_scene_find_closest(scene: *mut tandem_scene, options: *const tandem_closest_options) -> tandem_status;
    pub fn tandem_scene_closest(scene: *const tandem_scene, count: *mut usize) -> *const tandem_closest_point;
    pub fn tandem_scene_find_rays(scene: *mut tandem_scene, options: *const tandem_ray_options) -> tandem_status;
    pub fn tandem_scene_rays(scene: *const tandem_scene, count: *mut usize) -> *const tandem_ray_hit;
    pub fn tandem_scene_find(scene: *mut tandem_scene, questions: *const tandem_questions) -> tandem_status;
    pub fn tandem_scene_get_counters(scene: *const tandem_scene, counters: *mut tandem_counters) -> tandem_status;
    pub fn tandem_world_create(options: *const tandem_world_options, allocator: *const tandem_allocator, world: *mut *mut tandem_world) -> tandem_status;
    pub fn tandem_world_destroy(world: *mut tandem_world);
    pub fn tandem_world_set_assets(world: *mut tandem_world, assets: *const *mut tandem_asset, count: usize) -> tandem_status;
    pub fn tandem_world_set_bodies(world: *mut tandem_world, instances: *const tandem_instance, count: usize, filter: *const tandem_pair_filter, start: *const tandem_body_start) -> tandem_status;
    pub fn tandem_world_step(world: *mut tandem_world, dt: f64, steps: u32) -> tandem_status;
    pub fn tandem_world_step_more(world: *mut tandem_world, dt: f64, steps: u32) -> tandem_status;
    pub fn tandem_world_bodies(world: *const tandem_world, count: *mut usize) -> *const tandem_body_motion;
    pub fn tandem_world_contacts(world: *const tandem_world, count: *mut usize) -> *const tandem_world_contact;
    pub fn tandem_world_touching(world: *const tandem_world, count: *mut usize) -> *const tandem_world_touch;
    pub fn tandem_world_began(world: *const tandem_world, count: *mut usize) -> *const tandem_world_touch;
    pub fn tandem_world_ended(world: *const tandem_world, count: *mut usize) -> *const tandem_object_pair;
    pub fn tandem_world_joints(world: *const tandem_world, count: *mut usize) -> *const tandem_world_joint;
    pub fn tandem_world_broken(world: *const tandem_world, count: *mut usize) -> *const u32;
    pub fn tandem_world_add_joint(world: *mut tandem_world, joint: *const tandem_joint, place: *mut u32) -> tandem_status;
    pub fn tandem_world_remove_joint(world: *mut tandem_world, joint: u32) -> tandem_status;
    pub fn tandem_world_set_motor(world: *mut tandem_world, joint: u32, speed: f64, most_effort: f64) -> tandem_status;
    pub fn tandem_world_time(world: *const tandem_world) -> f64;
    pub fn tandem_world_mass(world: *const tandem_world, body: u32) -> f64;
    pub fn tandem_world_set_body(world: *mut tandem_world, body: u32, motion: *const tandem_body_motion) -> tandem_status;
    pub fn tandem_world_set_material(world: *mut tandem_world, body: u32, friction: f64, restitution: f64, rolling_resistance: f64) -> tandem_status;
    pub fn tandem_world_set_gravity_scale(world: *mut tandem_world, body: u32, gravity_scale: f64) -> tandem_status;
    pub fn tandem_world_push(world: *mut tandem_world, body: u32, impulse: *const f64, at: *const f64) -> tandem_status;
    pub fn tandem_world_set_force(world: *mut tandem_world, body: u32, force: *const f64, torque: *const f64) -> tandem_status;
    pub fn tandem_world_save(world: *const tandem_world, state: *mut *mut tandem_world_state) -> tandem_status;
    pub fn tandem_world_restore(world: *mut tandem_world, state: *const tandem_world_state) -> tandem_status;
    pub fn tandem_world_state_destroy(state: *mut tandem_world_state);
    pub fn tandem_world_where(world: *const tandem_world) -> u64;
}
