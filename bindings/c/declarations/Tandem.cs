// Tandem's C interface, without its comments. Written by scripts/write_interface from bindings/c/include/tandem/tandem.h. Do not edit it.
using System;
using System.Runtime.InteropServices;

namespace Tandem {
[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_allocator {
  public uint struct_size;
  public uint reserved;
  public void* user;
  public IntPtr allocate;
  public IntPtr deallocate;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_open_options {
  public uint struct_size;
  public uint access;
  public uint check_depth;
  public uint reserved;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_memory_options {
  public uint struct_size;
  public uint check_depth;
  public uint borrow;
  public uint reserved;
  public IntPtr released;
  public void* user;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_mesh_part {
  public byte* name;
  public byte* path;
  public ulong face_count;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_mesh {
  public uint struct_size;
  public uint reserved;
  public double* positions;
  public UIntPtr vertex_count;
  public uint* triangles;
  public UIntPtr triangle_count;
  public uint* faces;
  public tandem_mesh_part* parts;
  public UIntPtr part_count;
  public double* poses;
  public UIntPtr pose_count;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_build_options {
  public uint struct_size;
  public uint effort;
  public uint no_gpu_blocks;
  public uint no_topology;
  public uint no_refit;
  public uint threads;
  public double imaginary_share;
  public byte* provenance;
  public IntPtr progress;
  public void* user;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_build_report {
  public uint struct_size;
  public uint reserved;
  public ulong index_out_of_range;
  public ulong not_finite;
  public ulong too_large;
  public ulong degenerate;
  public ulong duplicate;
  public ulong duplicate_reversed;
  public ulong flattened;
  public ulong vertices_unreferenced;
  public ulong vertices_welded;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_asset_info {
  public uint struct_size;
  public uint level_count;
  public uint first_level;
  public uint part_count;
  public ulong file_bytes;
  public ulong hash;
  public ulong source_faces;
  public ulong source_vertices;
  public fixed double origin[3];
  public double rounding_error;
  public fixed float lower[3];
  public fixed float upper[3];
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_corner {
  public fixed float position[3];
  public uint w;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_triangle {
  public tandem_corner corner0;
  public tandem_corner corner1;
  public tandem_corner corner2;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_level {
  public uint struct_size;
  public uint triangle_count;
  public uint block_count;
  public uint leaf_block_count;
  public uint depth;
  public uint has_oriented_blocks;
  public uint has_topology;
  public uint vertex_count;
  public uint component_count;
  public uint closed;
  public double error_bound;
  public tandem_triangle* triangles;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_part {
  public uint struct_size;
  public uint reserved;
  public byte* name;
  public byte* path;
  public UIntPtr name_bytes;
  public UIntPtr path_bytes;
  public ulong first_face;
  public ulong face_count;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_pose {
  public fixed double rotation[9];
  public fixed double translation[3];
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_instance {
  public uint asset;
  public uint reserved;
  public tandem_pose pose;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_object_pair {
  public uint a;
  public uint b;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_pair_filter {
  public uint struct_size;
  public uint reserved;
  public UIntPtr count;
  public byte* motion;
  public uint* group;
  public uint* mask;
  public uint* world;
  public IntPtr excluded;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_pair_options {
  public uint struct_size;
  public uint self_pairs;
  public double reach;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_moved_options {
  public uint struct_size;
  public uint reserved;
  public double tolerance;
  public double* tolerance_of_pair;
  public UIntPtr tolerance_count;
  public tandem_object_pair* pairs;
  public UIntPtr pair_count;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_moved_counters {
  public ulong object_pairs;
  public ulong kept;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_contact_options {
  public uint struct_size;
  public uint mode;
  public uint first_contact_only;
  public uint self_pairs;
  public uint add_error_bounds;
  public uint leave_out_rings;
  public double within;
  public tandem_object_pair* pairs;
  public UIntPtr pair_count;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_contact {
  public uint pair;
  public uint triangle_a;
  public uint triangle_b;
  public uint face_a;
  public uint face_b;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_contact_counters {
  public ulong object_pairs;
  public ulong block_pairs;
  public ulong candidates;
  public ulong decided_by_float32;
  public ulong decided_by_float64;
  public ulong decided_exactly;
  public ulong contacts;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_manifold_options {
  public uint struct_size;
  public uint most_points;
  public uint ignore_previous;
  public uint keep;
  public uint quick_depths;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_manifold {
  public fixed double normal[3];
  public fixed double area_vector[3];
  public fixed double centre[3];
  public double depth;
  public uint pair;
  public uint first_point;
  public uint point_count;
  public uint flags;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_manifold_point {
  public fixed double position[3];
  public fixed double in_a[3];
  public fixed double in_b[3];
  public fixed double normal[3];
  public double depth;
  public ulong id;
  public uint face_a;
  public uint face_b;
  public uint previous;
  public uint manifold;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_manifold_counters {
  public ulong contacts;
  public ulong segments;
  public ulong manifolds;
  public ulong points;
  public ulong open_curves;
  public ulong ambiguous_touches;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_containment {
  public uint pair;
  public uint inner;
  public uint component;
  public uint flags;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_containment_counters {
  public ulong object_pairs;
  public ulong inside;
  public ulong outer_open;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_former_nearest {
  public uint a;
  public uint b;
  public uint triangle_a;
  public uint triangle_b;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_distance_options {
  public uint struct_size;
  public uint limit_reach;
  public double reach;
  public double absolute_tolerance;
  public double relative_tolerance;
  public tandem_former_nearest* former;
  public UIntPtr former_count;
  public tandem_object_pair* pairs;
  public UIntPtr pair_count;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_distance {
  public double lower;
  public double upper;
  public fixed double point_a[3];
  public fixed double point_b[3];
  public uint triangle_a;
  public uint triangle_b;
  public uint face_a;
  public uint face_b;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_distance_counters {
  public ulong object_pairs;
  public ulong block_pairs;
  public ulong by_float32;
  public ulong by_float64;
  public ulong touching;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_motion {
  public fixed double velocity[3];
  public fixed double angular_velocity[3];
  public fixed double centre[3];
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_impact_options {
  public uint struct_size;
  public uint reserved;
  public double duration;
  public double tolerance;
  public tandem_motion* motion;
  public UIntPtr motion_count;
  public tandem_object_pair* pairs;
  public UIntPtr pair_count;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_impact {
  public double t_safe;
  public double gap;
  public fixed double point_a[3];
  public fixed double point_b[3];
  public uint triangle_a;
  public uint triangle_b;
  public uint face_a;
  public uint face_b;
  public byte status;
  public fixed byte reserved[7];
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_impact_counters {
  public ulong object_pairs;
  public ulong at_start;
  public ulong found;
  public ulong walks;
  public ulong block_pairs;
  public ulong triangle_pairs;
  public ulong advanced;
  public ulong steps;
  public ulong most_steps;
  public ulong unconverged;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_tolerance_options {
  public uint struct_size;
  public uint reserved;
  public double tolerance;
  public tandem_object_pair* pairs;
  public UIntPtr pair_count;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_verdict {
  public byte verdict;
  public byte level_a;
  public byte level_b;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_tolerance_counters {
  public ulong apart;
  public ulong touching;
  public ulong within_tolerance;
  public tandem_contact_counters work;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_bodies_at_options {
  public uint struct_size;
  public uint reserved;
  public double* points;
  public UIntPtr point_count;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_body_at {
  public uint point;
  public uint body;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_configuration_options {
  public uint struct_size;
  public uint find;
  public uint* bodies;
  public UIntPtr body_count;
  public tandem_pose* poses;
  public UIntPtr pose_count;
  public double within;
  public double absolute_tolerance;
  public double relative_tolerance;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_configuration_pair {
  public ulong configuration;
  public uint a;
  public uint b;
  public double lower;
  public double upper;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_configuration_counters {
  public ulong configurations;
  public ulong touching;
  public ulong object_pairs;
  public ulong block_pairs;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_closest_options {
  public uint struct_size;
  public uint limit_reach;
  public uint sides;
  public uint reserved;
  public double reach;
  public double absolute_tolerance;
  public double relative_tolerance;
  public double* points;
  public UIntPtr point_count;
  public uint* bodies;
  public UIntPtr body_count;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_closest_point {
  public double lower;
  public double upper;
  public fixed double position[3];
  public uint body;
  public uint triangle;
  public uint face;
  public uint within;
  public int winding;
  public uint reserved;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_closest_counters {
  public ulong points;
  public ulong blocks;
  public ulong by_float64;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_ray_options {
  public uint struct_size;
  public uint hits;
  public uint limit_reach;
  public uint reserved;
  public double reach;
  public double* origins;
  public double* directions;
  public UIntPtr ray_count;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_ray_hit {
  public double t;
  public fixed double weight[2];
  public uint ray;
  public uint body;
  public uint triangle;
  public uint face;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_ray_counters {
  public ulong rays;
  public ulong hits;
  public ulong blocks;
  public ulong by_float64;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_questions {
  public uint struct_size;
  public uint contained;
  public tandem_pair_options* pairs;
  public tandem_contact_options* contacts;
  public tandem_manifold_options* manifolds;
  public tandem_distance_options* distances;
  public tandem_impact_options* impacts;
  public tandem_tolerance_options* verdicts;
  public tandem_bodies_at_options* bodies_at;
  public tandem_configuration_options* configurations;
  public tandem_closest_options* closest;
  public tandem_ray_options* rays;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_counters {
  public uint struct_size;
  public uint reserved;
  public tandem_contact_counters contacts;
  public tandem_manifold_counters manifolds;
  public tandem_containment_counters contained;
  public tandem_distance_counters distances;
  public tandem_impact_counters impacts;
  public tandem_tolerance_counters verdicts;
  public tandem_moved_counters moved;
  public tandem_configuration_counters configurations;
  public tandem_closest_counters closest;
  public tandem_ray_counters rays;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_world_options {
  public uint struct_size;
  public uint no_gravity;
  public uint no_friction;
  public uint no_slop;
  public uint no_rolling_resistance;
  public uint no_sleeping;
  public uint continuous;
  public uint substeps;
  public uint threads;
  public uint reserved;
  public fixed double gravity[3];
  public double friction;
  public double restitution;
  public double slop;
  public double rolling_resistance;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_joint {
  public uint kind;
  public uint a;
  public uint b;
  public byte has_limits;
  public byte may_touch;
  public fixed byte reserved[2];
  public fixed double anchor[3];
  public fixed double anchor_b[3];
  public fixed double axis[3];
  public double least;
  public double most;
  public double speed;
  public double most_effort;
  public double breaking_force;
  public double breaking_torque;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_body_start {
  public uint struct_size;
  public uint reserved;
  public UIntPtr count;
  public double* density;
  public double* velocity;
  public double* angular_velocity;
  public double* friction;
  public double* restitution;
  public double* rolling_resistance;
  public double* gravity_scale;
  public tandem_joint* joints;
  public UIntPtr joint_count;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_body_motion {
  public tandem_pose pose;
  public fixed double centre[3];
  public fixed double velocity[3];
  public fixed double angular_velocity[3];
  public byte sleeps;
  public fixed byte reserved[7];
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_world_contact {
  public uint a;
  public uint b;
  public fixed double position[3];
  public fixed double normal[3];
  public double depth;
  public fixed double impulse[3];
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_world_touch {
  public uint a;
  public uint b;
  public double impulse;
  public double speed;
  public fixed double position[3];
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct tandem_world_joint {
  public double position;
  public double speed;
  public fixed double impulse[3];
  public fixed double turning[3];
  public double motor_effort;
  public byte holds;
  public fixed byte reserved[7];
}

public static unsafe class Native {
  public const uint TANDEM_OK = 0;
  public const uint TANDEM_NULL_ARGUMENT = 1;
  public const uint TANDEM_BAD_STRUCT_SIZE = 2;
  public const uint TANDEM_BAD_OPTION = 3;
  public const uint TANDEM_OUT_OF_MEMORY = 4;
  public const uint TANDEM_CANNOT_START_THREAD = 5;
  public const uint TANDEM_INTERNAL_ERROR = 6;
  public const uint TANDEM_UNKNOWN_LEVEL = 7;
  public const uint TANDEM_FILTER_MISMATCH = 8;
  public const uint TANDEM_CONTACTS_MISSING = 9;
  public const uint TANDEM_BAD_MOTION = 10;
  public const uint TANDEM_NO_TRIANGLE = 11;
  public const uint TANDEM_TOO_MANY_TRIANGLES = 12;
  public const uint TANDEM_ASSETS_MISSING = 13;
  public const uint TANDEM_FILE_NOT_FOUND = 100;
  public const uint TANDEM_NOT_A_REGULAR_FILE = 101;
  public const uint TANDEM_CANNOT_OPEN = 102;
  public const uint TANDEM_CANNOT_READ = 103;
  public const uint TANDEM_MISALIGNED = 104;
  public const uint TANDEM_BIOVISION_MOTION_CAPTURE = 105;
  public const uint TANDEM_NOT_TANDEM = 106;
  public const uint TANDEM_DAMAGED_BY_TEXT_TRANSFER = 107;
  public const uint TANDEM_WRONG_BYTE_ORDER = 108;
  public const uint TANDEM_UNSUPPORTED_VERSION = 109;
  public const uint TANDEM_TRUNCATED = 110;
  public const uint TANDEM_TRAILING_BYTES = 111;
  public const uint TANDEM_CONTENT_CHANGED = 112;
  public const uint TANDEM_BAD_HEADER = 120;
  public const uint TANDEM_BAD_SECTION_TABLE = 121;
  public const uint TANDEM_UNKNOWN_SECTION = 122;
  public const uint TANDEM_SECTION_MISALIGNED = 123;
  public const uint TANDEM_SECTION_OUT_OF_BOUNDS = 124;
  public const uint TANDEM_SECTIONS_OVERLAP = 125;
  public const uint TANDEM_SECTION_SIZE_MISMATCH = 126;
  public const uint TANDEM_SECTION_MISSING = 127;
  public const uint TANDEM_SECTION_DUPLICATED = 128;
  public const uint TANDEM_BAD_GAP = 129;
  public const uint TANDEM_BAD_LEVEL = 130;
  public const uint TANDEM_BAD_PART = 131;
  public const uint TANDEM_BAD_NODE_KIND = 140;
  public const uint TANDEM_IMAGINARY_BEFORE_REAL = 141;
  public const uint TANDEM_EMPTY_BLOCK = 142;
  public const uint TANDEM_PARTIAL_LEAF_BLOCK = 143;
  public const uint TANDEM_BAD_IMAGINARY_NODE = 144;
  public const uint TANDEM_BAD_BOX = 145;
  public const uint TANDEM_CHILD_OUT_OF_RANGE = 146;
  public const uint TANDEM_CHILD_NOT_AFTER_PARENT = 147;
  public const uint TANDEM_CHILD_SHARED = 148;
  public const uint TANDEM_BLOCK_UNREACHABLE = 149;
  public const uint TANDEM_BLOCK_ORDER = 150;
  public const uint TANDEM_TOO_DEEP = 151;
  public const uint TANDEM_DEPTH_MISMATCH = 152;
  public const uint TANDEM_LEAF_COUNT_MISMATCH = 153;
  public const uint TANDEM_TRIANGLE_ORDER = 154;
  public const uint TANDEM_TRIANGLE_NOT_FINITE = 155;
  public const uint TANDEM_TRIANGLE_OUTSIDE_LEAF_BOX = 156;
  public const uint TANDEM_CHILD_OUTSIDE_PARENT_BOX = 157;
  public const uint TANDEM_BAD_FACE = 158;
  public const uint TANDEM_BOUNDS_MISMATCH = 159;
  public const uint TANDEM_LEVEL_OUTSIDE_BOUNDS = 160;
  public const uint TANDEM_ORIENTED_BLOCK_MISMATCH = 170;
  public const uint TANDEM_BAD_ROTATION = 171;
  public const uint TANDEM_BAD_ORIENTED_BOX = 172;
  public const uint TANDEM_TRIANGLE_OUTSIDE_ORIENTED_BOX = 173;
  public const uint TANDEM_BAD_TOPOLOGY = 180;
  public const uint TANDEM_VERTEX_ORDER = 181;
  public const uint TANDEM_VERTEX_MISMATCH = 182;
  public const uint TANDEM_EDGE_MISMATCH = 183;
  public const uint TANDEM_BAD_WINDING = 184;
  public const uint TANDEM_COMPONENT_MISMATCH = 185;
  public const uint TANDEM_SOURCE_VERTEX_MISMATCH = 186;
  public const uint TANDEM_OUT_OF_RANGE = 200;
  public const uint TANDEM_UNKNOWN_ASSET = 201;
  public const uint TANDEM_UNKNOWN_INSTANCE = 202;
  public const uint TANDEM_UNKNOWN_CONTACT = 203;
  public const uint TANDEM_POSE_NOT_RIGID = 204;
  public const uint TANDEM_TOO_MANY_INSTANCES = 205;
  public const uint TANDEM_TOO_MANY_PAIRS = 206;
  public const uint TANDEM_KEPT_MISMATCH = 207;
  public const uint TANDEM_MOTION_MISMATCH = 208;
  public const uint TANDEM_NO_ORIENTED_BLOCKS = 209;
  public const uint TANDEM_NO_AXIS_ALIGNED_BLOCKS = 210;
  public const uint TANDEM_NO_TOPOLOGY = 211;
  public const uint TANDEM_NO_FINEST_LEVEL = 212;
  public const uint TANDEM_BAD_REACH = 213;
  public const uint TANDEM_BAD_TOLERANCE = 214;
  public const uint TANDEM_BAD_DURATION = 215;
  public const uint TANDEM_NO_MASS = 216;
  public const uint TANDEM_BAD_JOINT = 217;
  public const uint TANDEM_NO_AXIS = 218;
  public const uint TANDEM_JOINS_NOTHING = 219;
  public const uint TANDEM_NO_SOURCE_VERTICES = 220;
  public const uint TANDEM_VERTEX_COUNT_MISMATCH = 221;
  public const uint TANDEM_DEFORMED = 222;
  public const uint TANDEM_NOT_FLOAT32 = 223;
  public const uint TANDEM_NO_DIRECTION = 224;
  public const uint TANDEM_NO_GPU = 300;
  public const uint TANDEM_DRIVER_TOO_OLD = 301;
  public const uint TANDEM_GPU_NOT_SUPPORTED = 302;
  public const uint TANDEM_OUT_OF_GPU_MEMORY = 303;
  public const uint TANDEM_CUDA_FAILED = 304;
  public const uint TANDEM_ACCESS_MAP = 0;
  public const uint TANDEM_ACCESS_READ = 1;
  public const uint TANDEM_CHECK_FULL = 0;
  public const uint TANDEM_CHECK_QUICK = 1;
  public const uint TANDEM_EFFORT_DEFAULT = 0;
  public const uint TANDEM_EFFORT_FAST = 1;
  public const uint TANDEM_EFFORT_BEST = 2;
  public const uint TANDEM_MOVING = 0;
  public const uint TANDEM_FIXED = 1;
  public const uint TANDEM_KINEMATIC = 2;
  public const uint TANDEM_SLEEPING = 3;
  public const uint TANDEM_PAIRS = 0;
  public const uint TANDEM_CONTACTS = 1;
  public const uint TANDEM_DISTANCES = 2;
  public const uint TANDEM_IMPACTS = 3;
  public const uint TANDEM_VERDICTS = 4;
  public const uint TANDEM_MOVED = 5;
  public const uint TANDEM_EXACT = 0;
  public const uint TANDEM_FAST = 1;
  public const uint TANDEM_BOXES = 2;
  public const uint TANDEM_TOUCHING = 1;
  public const uint TANDEM_OPEN_CURVE = 2;
  public const uint TANDEM_GOES_THROUGH = 4;
  public const uint TANDEM_AMBIGUOUS = 8;
  public const uint TANDEM_INSIDE = 1;
  public const uint TANDEM_OUTER_OPEN = 2;
  public const uint TANDEM_NO_IMPACT = 0;
  public const uint TANDEM_IMPACT = 1;
  public const uint TANDEM_IMPACT_AT_START = 2;
  public const uint TANDEM_APART = 0;
  public const uint TANDEM_TOUCH = 1;
  public const uint TANDEM_WITHIN_TOLERANCE = 2;
  public const uint TANDEM_FIRST_HIT = 0;
  public const uint TANDEM_ANY_HIT = 1;
  public const uint TANDEM_ALL_HITS = 2;
  public const uint TANDEM_BALL = 0;
  public const uint TANDEM_HINGE = 1;
  public const uint TANDEM_SLIDER = 2;
  public const uint TANDEM_FIXED_JOINT = 3;
  public const uint TANDEM_DISTANCE = 4;
  public const uint TANDEM_VERSION_MAJOR = 0;
  public const uint TANDEM_VERSION_MINOR = 1;
  public const uint TANDEM_VERSION_PATCH = 0;
  public const uint TANDEM_NO_INDEX = 4294967295;
  public const uint TANDEM_EVERY_WORLD = 4294967295;
  [DllImport("tandem")] public static extern uint tandem_version();
  [DllImport("tandem")] public static extern byte* tandem_status_name(uint status);
  [DllImport("tandem")] public static extern byte* tandem_status_explain(uint status);
  [DllImport("tandem")] public static extern byte* tandem_status_subject(uint status);
  [DllImport("tandem")] public static extern uint tandem_asset_open(byte* path, tandem_open_options* options, tandem_allocator* allocator, IntPtr* asset, ulong* where);
  [DllImport("tandem")] public static extern uint tandem_asset_from_memory(void* data, UIntPtr bytes, tandem_memory_options* options, tandem_allocator* allocator, IntPtr* asset, ulong* where);
  [DllImport("tandem")] public static extern uint tandem_asset_build(tandem_mesh* mesh, tandem_build_options* options, tandem_allocator* allocator, IntPtr* asset, tandem_build_report* report);
  [DllImport("tandem")] public static extern void tandem_asset_retain(IntPtr asset);
  [DllImport("tandem")] public static extern void tandem_asset_release(IntPtr asset);
  [DllImport("tandem")] public static extern void* tandem_asset_data(IntPtr asset, UIntPtr* bytes);
  [DllImport("tandem")] public static extern uint tandem_asset_get_info(IntPtr asset, tandem_asset_info* info);
  [DllImport("tandem")] public static extern uint tandem_asset_get_level(IntPtr asset, uint level, tandem_level* result);
  [DllImport("tandem")] public static extern uint tandem_asset_coarsest_level(IntPtr asset, double tolerance);
  [DllImport("tandem")] public static extern uint tandem_asset_levels_from(IntPtr asset, uint first, uint count, IntPtr* levels);
  [DllImport("tandem")] public static extern uint tandem_asset_get_part(IntPtr asset, uint part, tandem_part* result);
  [DllImport("tandem")] public static extern byte* tandem_asset_provenance(IntPtr asset, UIntPtr* bytes);
  [DllImport("tandem")] public static extern uint tandem_excluded_pairs_create(tandem_object_pair* pairs, UIntPtr count, tandem_allocator* allocator, IntPtr* excluded);
  [DllImport("tandem")] public static extern void tandem_excluded_pairs_destroy(IntPtr excluded);
  [DllImport("tandem")] public static extern uint tandem_scene_create(tandem_allocator* allocator, IntPtr* scene);
  [DllImport("tandem")] public static extern uint tandem_scene_create_on(IntPtr device, tandem_allocator* allocator, IntPtr* scene);
  [DllImport("tandem")] public static extern void tandem_device_destroy(IntPtr device);
  [DllImport("tandem")] public static extern void tandem_scene_destroy(IntPtr scene);
  [DllImport("tandem")] public static extern uint tandem_scene_set_threads(IntPtr scene, uint threads);
  [DllImport("tandem")] public static extern uint tandem_scene_set_assets(IntPtr scene, IntPtr* assets, UIntPtr count);
  [DllImport("tandem")] public static extern uint tandem_scene_deform(IntPtr scene, uint asset, float* positions, UIntPtr vertex_count);
  [DllImport("tandem")] public static extern uint tandem_scene_deform_f64(IntPtr scene, uint asset, double* positions, UIntPtr vertex_count);
  [DllImport("tandem")] public static extern double tandem_scene_looseness(IntPtr scene, uint asset);
  [DllImport("tandem")] public static extern uint tandem_scene_place(IntPtr scene, tandem_instance* instances, UIntPtr count, tandem_pair_filter* filter);
  [DllImport("tandem")] public static extern uint tandem_scene_place_alone(IntPtr scene, IntPtr asset);
  [DllImport("tandem")] public static extern uint tandem_scene_add(IntPtr scene, tandem_instance* instance, tandem_pair_filter* filter, uint* body);
  [DllImport("tandem")] public static extern uint tandem_scene_move(IntPtr scene, uint* bodies, tandem_pose* poses, UIntPtr count);
  [DllImport("tandem")] public static extern uint tandem_scene_set_motion(IntPtr scene, uint body, uint motion);
  [DllImport("tandem")] public static extern uint tandem_scene_remove(IntPtr scene, uint body);
  [DllImport("tandem")] public static extern tandem_instance* tandem_scene_instances(IntPtr scene, UIntPtr* count);
  [DllImport("tandem")] public static extern ulong tandem_scene_where(IntPtr scene);
  [DllImport("tandem")] public static extern tandem_object_pair* tandem_scene_pairs(IntPtr scene, uint question, UIntPtr* count);
  [DllImport("tandem")] public static extern uint tandem_scene_find_pairs(IntPtr scene, tandem_pair_options* options);
  [DllImport("tandem")] public static extern uint tandem_scene_find_moved(IntPtr scene, tandem_moved_options* options);
  [DllImport("tandem")] public static extern tandem_object_pair* tandem_scene_moved(IntPtr scene, UIntPtr* count);
  [DllImport("tandem")] public static extern uint tandem_scene_find_contacts(IntPtr scene, tandem_contact_options* options);
  [DllImport("tandem")] public static extern tandem_contact* tandem_scene_contacts(IntPtr scene, UIntPtr* count);
  [DllImport("tandem")] public static extern uint tandem_scene_find_manifolds(IntPtr scene, tandem_manifold_options* options);
  [DllImport("tandem")] public static extern tandem_manifold* tandem_scene_manifolds(IntPtr scene, UIntPtr* count);
  [DllImport("tandem")] public static extern tandem_manifold_point* tandem_scene_points(IntPtr scene, UIntPtr* count);
  [DllImport("tandem")] public static extern uint tandem_scene_find_contained(IntPtr scene);
  [DllImport("tandem")] public static extern tandem_containment* tandem_scene_contained(IntPtr scene, UIntPtr* count);
  [DllImport("tandem")] public static extern uint tandem_scene_find_distances(IntPtr scene, tandem_distance_options* options);
  [DllImport("tandem")] public static extern tandem_distance* tandem_scene_distances(IntPtr scene, UIntPtr* count);
  [DllImport("tandem")] public static extern uint tandem_scene_find_impacts(IntPtr scene, tandem_impact_options* options);
  [DllImport("tandem")] public static extern tandem_impact* tandem_scene_impacts(IntPtr scene, UIntPtr* count);
  [DllImport("tandem")] public static extern uint tandem_pose_at(tandem_pose* start, tandem_motion* motion, double t, tandem_pose* pose);
  [DllImport("tandem")] public static extern uint tandem_scene_find_verdicts(IntPtr scene, tandem_tolerance_options* options);
  [DllImport("tandem")] public static extern tandem_verdict* tandem_scene_verdicts(IntPtr scene, UIntPtr* count);
  [DllImport("tandem")] public static extern uint tandem_scene_find_bodies_at(IntPtr scene, tandem_bodies_at_options* options);
  [DllImport("tandem")] public static extern tandem_body_at* tandem_scene_bodies_at(IntPtr scene, UIntPtr* count);
  [DllImport("tandem")] public static extern uint tandem_scene_find_configurations(IntPtr scene, tandem_configuration_options* options);
  [DllImport("tandem")] public static extern tandem_configuration_pair* tandem_scene_configurations(IntPtr scene, UIntPtr* count);
  [DllImport("tandem")] public static extern uint tandem_scene_find_closest(IntPtr scene, tandem_closest_options* options);
  [DllImport("tandem")] public static extern tandem_closest_point* tandem_scene_closest(IntPtr scene, UIntPtr* count);
  [DllImport("tandem")] public static extern uint tandem_scene_find_rays(IntPtr scene, tandem_ray_options* options);
  [DllImport("tandem")] public static extern tandem_ray_hit* tandem_scene_rays(IntPtr scene, UIntPtr* count);
  [DllImport("tandem")] public static extern uint tandem_scene_find(IntPtr scene, tandem_questions* questions);
  [DllImport("tandem")] public static extern uint tandem_scene_get_counters(IntPtr scene, tandem_counters* counters);
  [DllImport("tandem")] public static extern uint tandem_world_create(tandem_world_options* options, tandem_allocator* allocator, IntPtr* world);
  [DllImport("tandem")] public static extern void tandem_world_destroy(IntPtr world);
  [DllImport("tandem")] public static extern uint tandem_world_set_assets(IntPtr world, IntPtr* assets, UIntPtr count);
  [DllImport("tandem")] public static extern uint tandem_world_set_bodies(IntPtr world, tandem_instance* instances, UIntPtr count, tandem_pair_filter* filter, tandem_body_start* start);
  [DllImport("tandem")] public static extern uint tandem_world_step(IntPtr world, double dt, uint steps);
  [DllImport("tandem")] public static extern uint tandem_world_step_more(IntPtr world, double dt, uint steps);
  [DllImport("tandem")] public static extern tandem_body_motion* tandem_world_bodies(IntPtr world, UIntPtr* count);
  [DllImport("tandem")] public static extern tandem_world_contact* tandem_world_contacts(IntPtr world, UIntPtr* count);
  [DllImport("tandem")] public static extern tandem_world_touch* tandem_world_touching(IntPtr world, UIntPtr* count);
  [DllImport("tandem")] public static extern tandem_world_touch* tandem_world_began(IntPtr world, UIntPtr* count);
  [DllImport("tandem")] public static extern tandem_object_pair* tandem_world_ended(IntPtr world, UIntPtr* count);
  [DllImport("tandem")] public static extern tandem_world_joint* tandem_world_joints(IntPtr world, UIntPtr* count);
  [DllImport("tandem")] public static extern uint* tandem_world_broken(IntPtr world, UIntPtr* count);
  [DllImport("tandem")] public static extern uint tandem_world_add_joint(IntPtr world, tandem_joint* joint, uint* place);
  [DllImport("tandem")] public static extern uint tandem_world_remove_joint(IntPtr world, uint joint);
  [DllImport("tandem")] public static extern uint tandem_world_set_motor(IntPtr world, uint joint, double speed, double most_effort);
  [DllImport("tandem")] public static extern double tandem_world_time(IntPtr world);
  [DllImport("tandem")] public static extern double tandem_world_mass(IntPtr world, uint body);
  [DllImport("tandem")] public static extern uint tandem_world_set_body(IntPtr world, uint body, tandem_body_motion* motion);
  [DllImport("tandem")] public static extern uint tandem_world_set_material(IntPtr world, uint body, double friction, double restitution, double rolling_resistance);
  [DllImport("tandem")] public static extern uint tandem_world_set_gravity_scale(IntPtr world, uint body, double gravity_scale);
  [DllImport("tandem")] public static extern uint tandem_world_push(IntPtr world, uint body, double* impulse, double* at);
  [DllImport("tandem")] public static extern uint tandem_world_set_force(IntPtr world, uint body, double* force, double* torque);
  [DllImport("tandem")] public static extern uint tandem_world_save(IntPtr world, IntPtr* state);
  [DllImport("tandem")] public static extern uint tandem_world_restore(IntPtr world, IntPtr state);
  [DllImport("tandem")] public static extern void tandem_world_state_destroy(IntPtr state);
  [DllImport("tandem")] public static extern ulong tandem_world_where(IntPtr world);
}
}
