/// Tandem's C interface: exact contacts, manifolds, distances and times of impact of posed meshes, on the
/// CPU. C99 and C++; link with -ltandem. docs/c.md is its page.
///
/// Conventions, of every function:
/// - It returns a tandem_status, TANDEM_OK or what is wrong; or the answer itself where nothing can be wrong.
///   A pointer that must be there and is null is TANDEM_NULL_ARGUMENT; only those marked "or null" may be.
///   Nothing is thrown, and no signal or global state is touched.
/// - An options struct begins with its size, so that it can grow: set struct_size to sizeof, all else to zero
///   for the defaults. A null pointer to options stands for the defaults too. A size that no version had, or
///   bytes that this version does not know and that are not zero, are TANDEM_BAD_STRUCT_SIZE. A struct that a
///   function fills begins with its size as well, which the caller sets. `reserved` is zero.
/// - Rows of arguments and results (instances, pairs, contacts, ...) never change their layout.
/// - Strings are UTF-8. Lengths are in the files' unit, angles in radians, times in seconds.
/// - A handle of a query takes one call at a time; several handles work side by side. Assets never change,
///   and any number of threads may use them. Queries start threads where options ask for them, and keep them.
/// - Rounding is to nearest, subnormals included, as every thread begins. A query takes about 100 KB of the
///   stack.
#ifndef TANDEM_TANDEM_H
#define TANDEM_TANDEM_H

#include <stddef.h>
#include <stdint.h>

#define TANDEM_VERSION_MAJOR 0
#define TANDEM_VERSION_MINOR 1
#define TANDEM_VERSION_PATCH 0

#if defined(__GNUC__)
#define TANDEM_API __attribute__((visibility("default")))
#else
#define TANDEM_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/// ---- Versions and statuses

/// The version of the library, as 10000 major + 100 minor + patch.
TANDEM_API uint32_t tandem_version(void);

/// What can be wrong. Numbers keep their meaning; later versions may add some.
typedef uint32_t tandem_status;

enum {
  TANDEM_OK = 0,
  // The use of this interface, and what the system refuses.
  TANDEM_NULL_ARGUMENT = 1,    ///< a pointer is null, or a list that is not empty; where: its place in a list
  TANDEM_BAD_STRUCT_SIZE = 2,  ///< of an options struct, or bytes of it that this version does not know
  TANDEM_BAD_OPTION = 3,       ///< a number that names no choice, or a reserved field that is not zero
  TANDEM_OUT_OF_MEMORY = 4,
  TANDEM_CANNOT_START_THREAD = 5,
  TANDEM_INTERNAL_ERROR = 6,       ///< a defect of the library
  TANDEM_UNKNOWN_LEVEL = 7,        ///< a level or part that the asset does not have
  TANDEM_FILTER_MISMATCH = 8,      ///< a filter of another number of instances
  TANDEM_CONTACTS_MISSING = 9,     ///< the query's last call did not find the contacts that this call needs
  TANDEM_NO_TRIANGLE = 11,         ///< none of the triangles can be used
  TANDEM_TOO_MANY_TRIANGLES = 12,  ///< 2^32 - 1 or more
  TANDEM_ASSETS_MISSING = 13,      ///< of a handle of tandem_cuda.h
  // A file, or bytes of one. Of the defects that are there, the first in this order.
  // clang-format off
  TANDEM_FILE_NOT_FOUND = 100, TANDEM_NOT_A_REGULAR_FILE = 101, TANDEM_CANNOT_OPEN = 102,
  TANDEM_CANNOT_READ = 103, TANDEM_MISALIGNED = 104, TANDEM_BIOVISION_MOTION_CAPTURE = 105,
  TANDEM_NOT_TANDEM = 106, TANDEM_DAMAGED_BY_TEXT_TRANSFER = 107, TANDEM_WRONG_BYTE_ORDER = 108,
  TANDEM_UNSUPPORTED_VERSION = 109, TANDEM_TRUNCATED = 110, TANDEM_TRAILING_BYTES = 111,
  TANDEM_CONTENT_CHANGED = 112,
  TANDEM_BAD_HEADER = 120, TANDEM_BAD_SECTION_TABLE = 121, TANDEM_UNKNOWN_SECTION = 122,
  TANDEM_SECTION_MISALIGNED = 123, TANDEM_SECTION_OUT_OF_BOUNDS = 124, TANDEM_SECTIONS_OVERLAP = 125,
  TANDEM_SECTION_SIZE_MISMATCH = 126, TANDEM_SECTION_MISSING = 127, TANDEM_SECTION_DUPLICATED = 128,
  TANDEM_BAD_GAP = 129, TANDEM_BAD_LEVEL = 130, TANDEM_BAD_PART = 131,
  TANDEM_BAD_NODE_KIND = 140, TANDEM_IMAGINARY_BEFORE_REAL = 141, TANDEM_EMPTY_BLOCK = 142,
  TANDEM_PARTIAL_LEAF_BLOCK = 143, TANDEM_BAD_IMAGINARY_NODE = 144, TANDEM_BAD_BOX = 145,
  TANDEM_CHILD_OUT_OF_RANGE = 146, TANDEM_CHILD_NOT_AFTER_PARENT = 147, TANDEM_CHILD_SHARED = 148,
  TANDEM_BLOCK_UNREACHABLE = 149, TANDEM_BLOCK_ORDER = 150, TANDEM_TOO_DEEP = 151,
  TANDEM_DEPTH_MISMATCH = 152, TANDEM_LEAF_COUNT_MISMATCH = 153, TANDEM_TRIANGLE_ORDER = 154,
  TANDEM_TRIANGLE_NOT_FINITE = 155, TANDEM_TRIANGLE_OUTSIDE_LEAF_BOX = 156,
  TANDEM_CHILD_OUTSIDE_PARENT_BOX = 157, TANDEM_BAD_FACE = 158, TANDEM_BOUNDS_MISMATCH = 159,
  TANDEM_LEVEL_OUTSIDE_BOUNDS = 160,
  TANDEM_ORIENTED_BLOCK_MISMATCH = 170, TANDEM_BAD_ROTATION = 171, TANDEM_BAD_ORIENTED_BOX = 172,
  TANDEM_TRIANGLE_OUTSIDE_ORIENTED_BOX = 173,
  TANDEM_BAD_TOPOLOGY = 180, TANDEM_VERTEX_ORDER = 181, TANDEM_VERTEX_MISMATCH = 182,
  TANDEM_EDGE_MISMATCH = 183, TANDEM_BAD_WINDING = 184, TANDEM_COMPONENT_MISMATCH = 185,
  // A query.
  TANDEM_OUT_OF_RANGE = 200, TANDEM_UNKNOWN_ASSET = 201, TANDEM_UNKNOWN_INSTANCE = 202,
  TANDEM_UNKNOWN_CONTACT = 203, TANDEM_POSE_NOT_RIGID = 204, TANDEM_TOO_MANY_INSTANCES = 205,
  TANDEM_TOO_MANY_PAIRS = 206, TANDEM_KEPT_MISMATCH = 207, TANDEM_MOTION_MISMATCH = 208,
  TANDEM_NO_ORIENTED_BLOCKS = 209, TANDEM_NO_AXIS_ALIGNED_BLOCKS = 210, TANDEM_NO_TOPOLOGY = 211, TANDEM_NO_FINEST_LEVEL = 212,
  // A GPU (tandem_cuda.h).
  TANDEM_NO_GPU = 300, TANDEM_DRIVER_TOO_OLD = 301, TANDEM_GPU_NOT_SUPPORTED = 302,
  TANDEM_OUT_OF_GPU_MEMORY = 303, TANDEM_CUDA_FAILED = 304
  // clang-format on
};

/// The name of a status, for logs: "ChildShared" of TANDEM_CHILD_SHARED. Never null.
TANDEM_API const char* tandem_status_name(tandem_status status);

/// One sentence for people, without a full stop: "a block has two parents". Never null.
TANDEM_API const char* tandem_status_explain(tandem_status status);

/// What the number counts that `where` gives: "instance", "pair", "section", "block"; null where there is no
/// such number.
TANDEM_API const char* tandem_status_subject(tandem_status status);

/// ---- Memory

/// Where memory comes from. A handle keeps a copy of it and takes all of its memory there, results included;
/// what `user` points to outlives the handle. Both functions may be called by several threads at a time, also
/// by those that queries start. The library's own are only what the C++ runtime and the system take to start
/// a thread. Null pointers to allocators stand for the C library's memory.
typedef struct tandem_allocator {
  uint32_t struct_size;
  uint32_t reserved;
  void* user;  ///< handed to both functions
  /// Memory of so many bytes at a multiple of `alignment`, a power of two; null where there is none.
  void* (*allocate)(void* user, size_t bytes, size_t alignment);
  /// Takes back what allocate() gave for these numbers.
  void (*deallocate)(void* user, void* memory, size_t bytes, size_t alignment);
} tandem_allocator;

/// ---- Assets

/// What one .bvh file holds, checked. It never changes, and its references are counted: whoever has it from a
/// function below has one, and a query has one of each of its assets. The count may be changed by several
/// threads at a time.
typedef struct tandem_asset tandem_asset;

enum { TANDEM_ACCESS_MAP = 0, TANDEM_ACCESS_READ = 1 };
enum { TANDEM_CHECK_FULL = 0, TANDEM_CHECK_QUICK = 1 };

typedef struct tandem_open_options {
  uint32_t struct_size;
  /// TANDEM_ACCESS_MAP: the pages of the file, which nobody may write to or cut short meanwhile (replacing it
  /// by a rename is safe), or a copy where it cannot be mapped; TANDEM_ACCESS_READ: a copy.
  uint32_t access;
  /// TANDEM_CHECK_FULL; TANDEM_CHECK_QUICK believes what oriented boxes hold and what topology says: of a
  /// file that lies, manifolds may be wrong then, but nothing is read out of bounds.
  uint32_t check_depth;
  uint32_t reserved;
} tandem_open_options;

/// Opens and checks a file. where (or null): the section, block, ... with the defect, see
/// tandem_status_subject(). After an error *asset is null.
TANDEM_API tandem_status tandem_asset_open(const char* path, const tandem_open_options* options,
                                           const tandem_allocator* allocator, tandem_asset** asset,
                                           uint64_t* where);

typedef struct tandem_memory_options {
  uint32_t struct_size;
  uint32_t check_depth;  ///< as above
  /// 0: the bytes are copied, and need not stay. 1: they are used where they are: they start at a multiple of
  /// 128, else TANDEM_MISALIGNED, and stay as they are until released() is called.
  uint32_t borrow;
  uint32_t reserved;
  void (*released)(void* user);  ///< or null: called once when the last reference to borrowed bytes goes, by
                                 ///< the thread that gives it up; never after an error
  void* user;
} tandem_memory_options;

/// Checks the bytes of a file in memory. Result: as of tandem_asset_open().
TANDEM_API tandem_status tandem_asset_from_memory(const void* data, size_t bytes,
                                                  const tandem_memory_options* options,
                                                  const tandem_allocator* allocator, tandem_asset** asset,
                                                  uint64_t* where);

/// A run of faces with a name: an object, a group, a mesh at a node.
typedef struct tandem_mesh_part {
  const char *name, *path;  ///< or null
  uint64_t face_count;
} tandem_mesh_part;

/// Triangles in memory, to build an asset of. What cannot be used of them is left out, and counted.
typedef struct tandem_mesh {
  uint32_t struct_size;
  uint32_t reserved;
  const double* positions;  ///< three for each vertex
  size_t vertex_count;
  const uint32_t* triangles;  ///< three vertices for each
  size_t triangle_count;
  const uint32_t* faces;          ///< of each triangle: the face that it is a piece of; null: its own number
  const tandem_mesh_part* parts;  ///< that the faces are in, one after the other; null: one without a name
  size_t part_count;              ///< the parts' faces together are more than each of `faces`
} tandem_mesh;

enum { TANDEM_EFFORT_DEFAULT = 0, TANDEM_EFFORT_FAST = 1, TANDEM_EFFORT_BEST = 2 };

/// As bvhbuild's options.
typedef struct tandem_build_options {
  uint32_t struct_size;
  uint32_t effort;         ///< TANDEM_EFFORT_DEFAULT, ...; the best takes minutes for 100,000 triangles
  uint32_t no_gpu_blocks;  ///< 1: without the blocks that exact queries on a GPU walk
  uint32_t no_topology;    ///< 1: without what manifolds and contained bodies need
  uint32_t threads;        ///< at most; 0: as many as the machine has. The bytes do not depend on it
  uint32_t reserved;
  double imaginary_share;  ///< padding nodes: 0: the proven fewest; to 1: as many as a free tree has
  const char* provenance;  ///< JSON that the file says of its making, or null: options and findings
  /// Or null: called now and then, by one thread at a time, with the share of the optimisation that is done;
  /// where it returns 1, optimisation ends soon, with the best tree so far.
  uint32_t (*progress)(void* user, double share);
  void* user;
} tandem_build_options;

/// What became of the triangles; faces are triangles here.
typedef struct tandem_build_report {
  uint32_t struct_size;
  uint32_t reserved;
  // Left out, each under the first cause that holds.
  uint64_t index_out_of_range, not_finite, too_large;
  uint64_t degenerate;  ///< left out: the corners lie on one line
  // Kept.
  uint64_t duplicate, duplicate_reversed;  ///< the three places of an earlier one; of these, wound otherwise
  uint64_t flattened;                      ///< on one line only once rounded to float32
  uint64_t vertices_unreferenced, vertices_welded;  ///< named by no triangle; at the place of an earlier one
} tandem_build_report;

/// Builds an asset, whose bytes (tandem_asset_data()) are those that bvhbuild writes for the same triangles,
/// but for the provenance, and the same whatever the threads. report: or null; filled also where no triangle
/// can be used. The bytes come from the allocator; what building takes meanwhile, from the C++ runtime.
/// Result: TANDEM_NO_TRIANGLE; TANDEM_TOO_MANY_TRIANGLES, also where one of `faces` is 2^32 - 2 or more;
/// TANDEM_BAD_PART where faces lie in no part, or the parts have 2^32 - 1 faces or more.
TANDEM_API tandem_status tandem_asset_build(const tandem_mesh* mesh, const tandem_build_options* options,
                                            const tandem_allocator* allocator, tandem_asset** asset,
                                            tandem_build_report* report);

/// Takes or gives up a reference. The last one that goes takes the asset's memory with it. Null does nothing.
TANDEM_API void tandem_asset_retain(tandem_asset* asset);
TANDEM_API void tandem_asset_release(tandem_asset* asset);

/// The bytes of the file; with null, null. They stay as long as the asset, as all that follows.
TANDEM_API const void* tandem_asset_data(const tandem_asset* asset, size_t* bytes);

typedef struct tandem_asset_info {
  uint32_t struct_size;
  uint32_t level_count;  ///< that the asset shows
  uint32_t first_level;  ///< the file's number of the first of them
  uint32_t part_count;
  uint64_t file_bytes;
  uint64_t hash;             ///< of the content, as bvhinfo prints it
  uint64_t source_faces;     ///< faces of the mesh file
  double origin[3];          ///< the mesh file's coordinates = stored coordinates + origin
  double rounding_error;     ///< of a coordinate, at most
  float lower[3], upper[3];  ///< bounds in stored coordinates, of every level
} tandem_asset_info;

TANDEM_API tandem_status tandem_asset_get_info(const tandem_asset* asset, tandem_asset_info* info);

typedef struct tandem_corner {
  float position[3];  ///< in stored coordinates
  uint32_t word;      ///< of corner 0: the face of the mesh file; of corner 1: the part; of corner 2: 0
} tandem_corner;

typedef struct tandem_triangle {
  tandem_corner corner[3];
} tandem_triangle;

/// A level of detail: level 0 is the finest that the asset shows.
typedef struct tandem_level {
  uint32_t struct_size;
  uint32_t triangle_count, block_count, leaf_block_count;
  uint32_t depth;                ///< of the tree, in blocks
  uint32_t has_oriented_blocks;  ///< which exact queries on a GPU walk
  uint32_t has_topology;         ///< which manifolds and contained bodies need
  uint32_t vertex_count;     ///< different positions of corners; this and the next two: 0 without topology
  uint32_t component_count;  ///< triangles that edges join
  uint32_t closed;           ///< all components are
  double error_bound;        ///< no point of this surface or of the file's finest is farther from the other
  const tandem_triangle* triangles;  ///< in leaf order, as contacts number them
} tandem_level;

/// Result: TANDEM_UNKNOWN_LEVEL where there is no such level.
TANDEM_API tandem_status tandem_asset_get_level(const tandem_asset* asset, uint32_t level,
                                                tandem_level* result);

/// The coarsest level whose error_bound is at most `tolerance`; 0 where none is.
TANDEM_API uint32_t tandem_asset_coarsest_level(const tandem_asset* asset, double tolerance);

/// An asset that shows `count` levels of another from level `first` on, or as many as there are; 0: all.
/// Queries use the first that an asset shows. The bytes are the same, and stay as long as either. Result:
/// TANDEM_UNKNOWN_LEVEL where there is no level `first`.
TANDEM_API tandem_status tandem_asset_levels_from(tandem_asset* asset, uint32_t first, uint32_t count,
                                                  tandem_asset** levels);

/// A run of faces that the mesh file gives a name.
typedef struct tandem_part {
  uint32_t struct_size;
  uint32_t reserved;
  const char *name, *path;  ///< without a zero at the end; path: of scene nodes, joined by '/'
  size_t name_bytes, path_bytes;
  uint64_t first_face, face_count;
} tandem_part;

/// Result: TANDEM_UNKNOWN_LEVEL where there is no such part.
TANDEM_API tandem_status tandem_asset_get_part(const tandem_asset* asset, uint32_t part, tandem_part* result);

/// JSON that says how the file was made; without a zero at the end.
TANDEM_API const char* tandem_asset_provenance(const tandem_asset* asset, size_t* bytes);

/// ---- Rows

/// Where an instance stands: world = rotation x + translation, x in the mesh file's coordinates; rows of the
/// rotation are consecutive. Rigid to 1e-6, else TANDEM_POSE_NOT_RIGID.
typedef struct tandem_pose {
  double rotation[3][3];
  double translation[3];
} tandem_pose;

typedef struct tandem_instance {
  uint32_t asset;     ///< place in the list of the query's assets
  uint32_t reserved;  ///< not looked at
  tandem_pose pose;
} tandem_instance;

typedef struct tandem_object_pair {
  uint32_t a, b;  ///< instances
} tandem_object_pair;

/// What is not there: a triangle, a face, a former point.
#define TANDEM_NO_INDEX 0xFFFFFFFFu

/// What moves an instance: forces; nothing; the caller; nothing until the caller wakes it.
enum { TANDEM_MOVING = 0, TANDEM_FIXED = 1, TANDEM_KINEMATIC = 2, TANDEM_SLEEPING = 3 };

/// A set of pairs of instances, which queries do not look at.
typedef struct tandem_excluded_pairs tandem_excluded_pairs;

/// Takes pairs in any order, each as often as wanted. Result: TANDEM_UNKNOWN_INSTANCE where one names
/// instance 2^32 - 1. A query asks whether there are the others.
TANDEM_API tandem_status tandem_excluded_pairs_create(const tandem_object_pair* pairs, size_t count,
                                                      const tandem_allocator* allocator,
                                                      tandem_excluded_pairs** excluded);
TANDEM_API void tandem_excluded_pairs_destroy(tandem_excluded_pairs* excluded);

/// Which pairs a query looks at, of all whose world boxes meet (docs/queries.md). Arrays have `count`
/// entries, one for each instance (TANDEM_FILTER_MISMATCH where there are others), or are null. All stay as
/// long as the call that has the filter among its options.
typedef struct tandem_pair_filter {
  uint32_t struct_size;
  uint32_t reserved;
  size_t count;
  const uint8_t* motion;                  ///< TANDEM_MOVING, ...; null: all move
  const uint32_t* group;                  ///< the groups that an instance is in, a bit each; null: all
  const uint32_t* mask;                   ///< the groups that it meets; null: all
  const tandem_excluded_pairs* excluded;  ///< or null
} tandem_pair_filter;

/// ---- Contacts, manifolds, contained bodies

/// Finds every pair of triangles that meet, and what follows from them.
typedef struct tandem_contact_query tandem_contact_query;

TANDEM_API tandem_status tandem_contact_query_create(const tandem_allocator* allocator,
                                                     tandem_contact_query** query);
/// Gives up its assets, and its results are gone. Null does nothing.
TANDEM_API void tandem_contact_query_destroy(tandem_contact_query* query);

/// Names the assets that instances refer to, and takes a reference to each. Queries use the first level that
/// each shows. After an error there are no assets. Forgets results, fixed instances and former points.
TANDEM_API tandem_status tandem_contact_query_set_assets(tandem_contact_query* query,
                                                         tandem_asset* const* assets, size_t count);

enum {
  TANDEM_EXACT = 0,  ///< contact pairs, as exact arithmetic on the posed vertices finds them
  TANDEM_FAST = 1,   ///< by float32, which may err where rounding does
  TANDEM_BOXES = 2   ///< candidates: triangles whose boxes overlap
};

typedef struct tandem_query_options {
  uint32_t struct_size;
  uint32_t mode;                     ///< TANDEM_EXACT, TANDEM_FAST or TANDEM_BOXES
  uint32_t first_contact_only;       ///< 1: one contact for each object pair that touches
  uint32_t self_pairs;               ///< 1: where the query finds the pairs, also each instance with itself
  uint32_t threads;                  ///< with the caller's; 0: 1, at most 1,024. Results do not depend on it
  uint32_t add_error_bounds;         ///< 1: a pair without a contact is surely apart at the finest levels too
  double within;                     ///< clearance: triangles at most so far apart count, decided exactly
  const tandem_pair_filter* filter;  ///< or null; where the query finds the pairs
} tandem_query_options;

/// Two triangles that meet: triangle_a belongs to instance a of the object pair, triangle_b to b.
typedef struct tandem_contact {
  uint32_t pair;                    ///< row of the list of object pairs
  uint32_t triangle_a, triangle_b;  ///< tandem_level::triangles[triangle_a]
  uint32_t face_a, face_b;          ///< of the mesh files
} tandem_contact;

/// Keeps the instances whose motion is TANDEM_FIXED as they stand: calls to come, which must be of as many
/// instances (TANDEM_KEPT_MISMATCH), take the time of the others. Again when one of them has moved or others
/// are fixed. motion: `count` entries. Results are forgotten.
TANDEM_API tandem_status tandem_contact_query_keep_fixed(tandem_contact_query* query,
                                                         const tandem_instance* instances,
                                                         const uint8_t* motion, size_t count,
                                                         uint32_t threads);

/// Finds the object pairs whose world boxes overlap, without their contacts.
TANDEM_API tandem_status tandem_contact_query_find_pairs(tandem_contact_query* query,
                                                         const tandem_instance* instances, size_t count,
                                                         const tandem_query_options* options);

/// Finds the object pairs whose world boxes overlap, and their contacts. Result: TANDEM_OK, or, where
/// tandem_contact_query_where() is the instance: TANDEM_UNKNOWN_ASSET, TANDEM_POSE_NOT_RIGID,
/// TANDEM_OUT_OF_RANGE (beyond 1e300), TANDEM_BAD_OPTION (its motion); TANDEM_UNKNOWN_INSTANCE, where it is
/// the filter's excluded pair; TANDEM_FILTER_MISMATCH, TANDEM_KEPT_MISMATCH, TANDEM_TOO_MANY_INSTANCES,
/// TANDEM_TOO_MANY_PAIRS, TANDEM_OUT_OF_MEMORY, TANDEM_CANNOT_START_THREAD. After an error there are no
/// results.
TANDEM_API tandem_status tandem_contact_query_find_contacts(tandem_contact_query* query,
                                                            const tandem_instance* instances, size_t count,
                                                            const tandem_query_options* options);

/// The same of given object pairs, in either order of a and b; the filter is not asked. A pair of an instance
/// with itself asks for the contacts within it. They may be tandem_contact_query_pairs(), or a part of them.
/// Result: as above, or TANDEM_UNKNOWN_INSTANCE: where is the pair.
TANDEM_API tandem_status tandem_contact_query_find_contacts_of_pairs(
    tandem_contact_query* query, const tandem_instance* instances, size_t count,
    const tandem_object_pair* pairs, size_t pair_count, const tandem_query_options* options);

/// The object pairs of the last call: sorted, a < b, or a = b for self pairs, where the query found them; as
/// given else. Valid, as all results are, until the query's next call. With null: null and 0.
TANDEM_API const tandem_object_pair* tandem_contact_query_pairs(const tandem_contact_query* query,
                                                                size_t* count);
/// By ascending pair; within a pair in an order that is the same on every run and machine.
TANDEM_API const tandem_contact* tandem_contact_query_contacts(const tandem_contact_query* query,
                                                               size_t* count);
/// The asset, instance, pair or contact that is to blame for the last error; 0 after TANDEM_OK.
TANDEM_API uint64_t tandem_contact_query_where(const tandem_contact_query* query);

typedef struct tandem_query_counters {
  uint32_t struct_size;
  uint32_t reserved;
  uint64_t object_pairs, block_pairs, candidates;
  uint64_t decided_by_float32, decided_by_float64, decided_exactly;
  uint64_t contacts;
} tandem_query_counters;

TANDEM_API tandem_status tandem_contact_query_get_counters(const tandem_contact_query* query,
                                                           tandem_query_counters* counters);

typedef struct tandem_manifold_options {
  uint32_t struct_size;
  uint32_t threads;
  uint32_t most_points;      ///< of a manifold, 1 to 7; 0: 7
  uint32_t ignore_previous;  ///< 1: points are not looked for among those of the last call
} tandem_manifold_options;

enum { TANDEM_TOUCHING = 1, TANDEM_OPEN_CURVE = 2, TANDEM_GOES_THROUGH = 4 };

/// A connected region in which the surfaces of two bodies meet (docs/contacts.md).
typedef struct tandem_manifold {
  double normal[3];       ///< unit, from a towards b
  double area_vector[3];  ///< of a's surface inside b
  double centre[3];       ///< of that area, in the world
  double depth;           ///< the largest that was found
  uint32_t pair;          ///< row of the list of object pairs
  uint32_t first_point, point_count;
  uint32_t flags;  ///< TANDEM_TOUCHING: without overlap; TANDEM_OPEN_CURVE: the curve in which the surfaces
                   ///< cross does not close; TANDEM_GOES_THROUGH: one body goes through the other here
} tandem_manifold;

typedef struct tandem_manifold_point {
  double position[3];       ///< world, half-way between the surfaces
  double in_a[3], in_b[3];  ///< on the surface of a, of b, in the coordinates of its mesh file
  double depth;             ///< along the manifold's normal
  uint64_t id;              ///< never 0; the same in successive steps for what is the same contact
  uint32_t face_a, face_b;  ///< of the mesh files
  uint32_t previous;        ///< the same point among those of the step before, or TANDEM_NO_INDEX
  uint32_t manifold;        ///< that it belongs to
} tandem_manifold_point;

/// Makes contact manifolds of the query's last contacts: TANDEM_CONTACTS_MISSING where its last call found
/// none or failed. instances: those of that call. Needs topology of all assets: TANDEM_NO_TOPOLOGY, where is
/// the asset. Contacts and pairs stay. After an error there are no manifolds, and the next call finds no
/// points before it.
TANDEM_API tandem_status tandem_contact_query_make_manifolds(tandem_contact_query* query,
                                                             const tandem_instance* instances, size_t count,
                                                             const tandem_manifold_options* options);
/// By ascending pair; their points, manifold by manifold. Valid until manifolds are made again, or the assets
/// are set.
TANDEM_API const tandem_manifold* tandem_contact_query_manifolds(const tandem_contact_query* query,
                                                                 size_t* count);
TANDEM_API const tandem_manifold_point* tandem_contact_query_points(const tandem_contact_query* query,
                                                                    size_t* count);

/// A component of a body that meets nothing of another and lies within it.
typedef struct tandem_containment {
  uint32_t pair;
  uint32_t inner;      ///< 0: a component of a, which lies in b; 1: of b, in a
  uint32_t component;  ///< its number in the inner body's file
  uint32_t flags;      ///< TANDEM_INSIDE, TANDEM_OUTER_OPEN: of open components there is no inside
} tandem_containment;

enum { TANDEM_INSIDE = 1, TANDEM_OUTER_OPEN = 2 };

/// Finds bodies within others, which no contact tells, of the query's last object pairs.
/// TANDEM_CONTACTS_MISSING where that call was not in mode TANDEM_EXACT with `within` 0, or found the first
/// contacts only. instances, needs, results: as of manifolds. threads: 0: 1.
TANDEM_API tandem_status tandem_contact_query_find_contained(tandem_contact_query* query,
                                                             const tandem_instance* instances, size_t count,
                                                             uint32_t threads);
TANDEM_API const tandem_containment* tandem_contact_query_contained(const tandem_contact_query* query,
                                                                    size_t* count);

/// ---- Levels of detail

/// Tells of pairs of bodies with levels of detail whether they surely do not meet, surely meet, or are within
/// a tolerance (docs/levels.md). Each body is looked at at the coarsest of its levels that can tell.
typedef struct tandem_tolerance_query tandem_tolerance_query;

TANDEM_API tandem_status tandem_tolerance_query_create(const tandem_allocator* allocator,
                                                       tandem_tolerance_query** query);
TANDEM_API void tandem_tolerance_query_destroy(tandem_tolerance_query* query);
/// Result: TANDEM_NO_FINEST_LEVEL, where is the asset, where an asset does not show the file's level 0.
TANDEM_API tandem_status tandem_tolerance_query_set_assets(tandem_tolerance_query* query,
                                                           tandem_asset* const* assets, size_t count);

typedef struct tandem_tolerance_options {
  uint32_t struct_size;
  uint32_t threads;
  double tolerance;                  ///< what need not be told apart from touching; 0: all is decided
  const tandem_pair_filter* filter;  ///< or null; where the query finds the pairs
} tandem_tolerance_options;

enum { TANDEM_APART = 0, TANDEM_TOUCH = 1, TANDEM_WITHIN_TOLERANCE = 2 };

typedef struct tandem_verdict {
  uint8_t verdict;           ///< TANDEM_APART: the finest surfaces do not meet, TANDEM_TOUCH: they do, ...
  uint8_t level_a, level_b;  ///< of the bodies, that it was asked of
} tandem_verdict;

/// Finds the object pairs whose world boxes overlap, and the verdicts on them; or those on given pairs.
/// Result: as of tandem_contact_query_find_contacts().
TANDEM_API tandem_status tandem_tolerance_query_decide(tandem_tolerance_query* query,
                                                       const tandem_instance* instances, size_t count,
                                                       const tandem_tolerance_options* options);
TANDEM_API tandem_status tandem_tolerance_query_decide_pairs(tandem_tolerance_query* query,
                                                             const tandem_instance* instances, size_t count,
                                                             const tandem_object_pair* pairs,
                                                             size_t pair_count,
                                                             const tandem_tolerance_options* options);
TANDEM_API const tandem_object_pair* tandem_tolerance_query_pairs(const tandem_tolerance_query* query,
                                                                  size_t* count);
/// One for each pair.
TANDEM_API const tandem_verdict* tandem_tolerance_query_verdicts(const tandem_tolerance_query* query,
                                                                 size_t* count);
TANDEM_API uint64_t tandem_tolerance_query_where(const tandem_tolerance_query* query);

/// ---- Distances

/// Finds how near the surfaces of bodies are (docs/distance.md).
typedef struct tandem_distance_query tandem_distance_query;

TANDEM_API tandem_status tandem_distance_query_create(const tandem_allocator* allocator,
                                                      tandem_distance_query** query);
TANDEM_API void tandem_distance_query_destroy(tandem_distance_query* query);
TANDEM_API tandem_status tandem_distance_query_set_assets(tandem_distance_query* query,
                                                          tandem_asset* const* assets, size_t count);

/// Triangles of a pair of instances that were nearest a step ago.
typedef struct tandem_former_nearest {
  uint32_t a, b;
  uint32_t triangle_a, triangle_b;
} tandem_former_nearest;

typedef struct tandem_distance_options {
  uint32_t struct_size;
  uint32_t threads;
  uint32_t limit_reach;  ///< 1: pairs surely farther apart than `reach` have no nearest points
  uint32_t reserved;
  double reach;
  double absolute_tolerance;            ///< upper - lower <= max(absolute, relative * upper)
  double relative_tolerance;            ///< 0: 1e-6; at the finest 2^-48
  const tandem_pair_filter* filter;     ///< or null; where the query finds the pairs
  const tandem_former_nearest* former;  ///< or null: by ascending a, then b, where to begin to look
  size_t former_count;
} tandem_distance_options;

typedef struct tandem_distance {
  double lower, upper;              ///< lower <= distance <= upper; 0, 0 exactly where triangles meet
  double point_a[3], point_b[3];    ///< the nearest points that were found
  uint32_t triangle_a, triangle_b;  ///< that they are on; TANDEM_NO_INDEX: beyond reach
  uint32_t face_a, face_b;
} tandem_distance;

/// Finds the object pairs whose world boxes are within reach, and their distances; or those of given pairs.
/// Result: as of tandem_contact_query_find_contacts(); a tolerance or reach that is negative or NaN is
/// TANDEM_OUT_OF_RANGE.
TANDEM_API tandem_status tandem_distance_query_find(tandem_distance_query* query,
                                                    const tandem_instance* instances, size_t count,
                                                    const tandem_distance_options* options);
TANDEM_API tandem_status tandem_distance_query_find_of_pairs(tandem_distance_query* query,
                                                             const tandem_instance* instances, size_t count,
                                                             const tandem_object_pair* pairs,
                                                             size_t pair_count,
                                                             const tandem_distance_options* options);
TANDEM_API const tandem_object_pair* tandem_distance_query_pairs(const tandem_distance_query* query,
                                                                 size_t* count);
/// One for each pair.
TANDEM_API const tandem_distance* tandem_distance_query_distances(const tandem_distance_query* query,
                                                                  size_t* count);
TANDEM_API uint64_t tandem_distance_query_where(const tandem_distance_query* query);

/// ---- Times of impact

/// Finds until when moving bodies surely do not meet (docs/impact.md).
typedef struct tandem_impact_query tandem_impact_query;

TANDEM_API tandem_status tandem_impact_query_create(const tandem_allocator* allocator,
                                                    tandem_impact_query** query);
TANDEM_API void tandem_impact_query_destroy(tandem_impact_query* query);
TANDEM_API tandem_status tandem_impact_query_set_assets(tandem_impact_query* query,
                                                        tandem_asset* const* assets, size_t count);

/// The centre goes straight ahead and the instance turns about it, both at constant speed.
typedef struct tandem_motion {
  double velocity[3];          ///< of the centre
  double angular_velocity[3];  ///< radians a second
  double center[3];            ///< in the world, at the start
} tandem_motion;

typedef struct tandem_impact_options {
  uint32_t struct_size;
  uint32_t threads;
  double tolerance;  ///< how near triangles come before they stop a pair, as a part of the diagonal of the
                     ///< smaller body's bounds; 0: 1e-6
  const tandem_pair_filter* filter;  ///< or null; where the query finds the pairs
} tandem_impact_options;

enum { TANDEM_NO_IMPACT = 0, TANDEM_IMPACT = 1, TANDEM_IMPACT_AT_START = 2 };

typedef struct tandem_impact {
  double t_safe;  ///< no triangles of the two meet before; the whole step where there is no impact
  double gap;     ///< of the two triangles then
  double point_a[3], point_b[3];
  uint32_t triangle_a, triangle_b;
  uint32_t face_a, face_b;
  uint8_t status;  ///< TANDEM_NO_IMPACT, ...
  uint8_t reserved[7];
} tandem_impact;

/// Finds the object pairs whose boxes meet when swept by the motions of a step of `duration`, and when each
/// of them does; or that of given pairs. motion: `count` entries. Result: as of
/// tandem_contact_query_find_contacts(); TANDEM_OUT_OF_RANGE also of motions, the duration and the tolerance.
TANDEM_API tandem_status tandem_impact_query_find(tandem_impact_query* query,
                                                  const tandem_instance* instances,
                                                  const tandem_motion* motion, size_t count, double duration,
                                                  const tandem_impact_options* options);
TANDEM_API tandem_status tandem_impact_query_find_of_pairs(tandem_impact_query* query,
                                                           const tandem_instance* instances,
                                                           const tandem_motion* motion, size_t count,
                                                           double duration, const tandem_object_pair* pairs,
                                                           size_t pair_count,
                                                           const tandem_impact_options* options);
TANDEM_API const tandem_object_pair* tandem_impact_query_pairs(const tandem_impact_query* query,
                                                               size_t* count);
/// One for each pair.
TANDEM_API const tandem_impact* tandem_impact_query_impacts(const tandem_impact_query* query, size_t* count);
TANDEM_API uint64_t tandem_impact_query_where(const tandem_impact_query* query);

/// The pose at time t of what stands at `start` at time 0; t_safe holds for it too.
TANDEM_API tandem_status tandem_pose_at(const tandem_pose* start, const tandem_motion* motion, double t,
                                        tandem_pose* pose);

#ifdef __cplusplus
}
#endif

#endif
