/// Tandem's C interface: exact contacts, manifolds, distances and times of impact of posed meshes, and worlds
/// of rigid bodies, on the CPU. C99 and C++; link with -ltandem. docs/c.md is its page.
/// scripts/write_interface writes from this header what other languages and the libraries' own rows need to
/// know of it.
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
/// - A scene or world takes one call at a time; several work side by side. Assets never change, and any
/// number
///   of threads may use them. A scene or world starts the threads that it may use, and keeps them.
/// - Rounding is to nearest, subnormals included, as every thread begins. A question takes about 100 KB of
///   the stack.
#ifndef TANDEM_TANDEM_H
#define TANDEM_TANDEM_H

#include <stddef.h>
#include <stdint.h>

#define TANDEM_VERSION_MAJOR 0
#define TANDEM_VERSION_MINOR 1
#define TANDEM_VERSION_PATCH 0

#if defined(_WIN32) && defined(TANDEM_BUILDS_LIBRARY)
#define TANDEM_API __declspec(dllexport)
#elif defined(__GNUC__) && !defined(_WIN32)
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

/// Says what is wrong. Numbers keep their meaning; later versions may add some.
typedef uint32_t tandem_status;

enum {
  TANDEM_OK = 0,
  // The use of this interface, and what the system refuses.
  TANDEM_NULL_ARGUMENT = 1,    ///< a pointer that must be there is null; where: its place in a list
  TANDEM_BAD_STRUCT_SIZE = 2,  ///< struct_size was not set, or a field is set that this version does not know
  TANDEM_BAD_OPTION = 3,       ///< an option cannot have this number, or a reserved field is not zero
  TANDEM_OUT_OF_MEMORY = 4,    ///< the allocator, or the machine, has not enough memory
  TANDEM_CANNOT_START_THREAD = 5,  ///< the system refuses to start a thread
  TANDEM_INTERNAL_ERROR = 6,       ///< a defect of the library
  TANDEM_UNKNOWN_LEVEL = 7,        ///< the asset does not have the level or part
  TANDEM_FILTER_MISMATCH = 8,      ///< a filter's arrays do not have one entry for each body
  TANDEM_CONTACTS_MISSING = 9,     ///< manifolds or contained bodies need contacts that were not found, or
                                   ///< bodies have moved since
  TANDEM_BAD_MOTION = 10,          ///< a body's motion is none of tandem_motion's
  TANDEM_NO_TRIANGLE = 11,         ///< none of the triangles can be used
  TANDEM_TOO_MANY_TRIANGLES = 12,  ///< there are 2^32 - 1 triangles or more
  TANDEM_ASSETS_MISSING = 13,  ///< a handle of tandem_cuda.h has no assets, or others than the query whose
                               ///< contacts it takes
  // A file, or bytes of one. Of a file with several defects one is returned.
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
  TANDEM_SOURCE_VERTEX_MISMATCH = 186,
  // Bodies and questions.
  TANDEM_OUT_OF_RANGE = 200, TANDEM_UNKNOWN_ASSET = 201, TANDEM_UNKNOWN_INSTANCE = 202,
  TANDEM_UNKNOWN_CONTACT = 203, TANDEM_POSE_NOT_RIGID = 204, TANDEM_TOO_MANY_INSTANCES = 205,
  TANDEM_TOO_MANY_PAIRS = 206, TANDEM_KEPT_MISMATCH = 207, TANDEM_MOTION_MISMATCH = 208,
  TANDEM_NO_ORIENTED_BLOCKS = 209, TANDEM_NO_AXIS_ALIGNED_BLOCKS = 210, TANDEM_NO_TOPOLOGY = 211, TANDEM_NO_FINEST_LEVEL = 212,
  TANDEM_BAD_REACH = 213, TANDEM_BAD_TOLERANCE = 214, TANDEM_BAD_DURATION = 215, TANDEM_NO_MASS = 216,
  TANDEM_BAD_JOINT = 217, TANDEM_NO_AXIS = 218, TANDEM_JOINS_NOTHING = 219,
  TANDEM_NO_SOURCE_VERTICES = 220, TANDEM_VERTEX_COUNT_MISMATCH = 221, TANDEM_DEFORMED = 222,
  TANDEM_NOT_FLOAT32 = 223, TANDEM_NO_DIRECTION = 224,
  // A GPU (tandem_cuda.h).
  TANDEM_NO_GPU = 300, TANDEM_DRIVER_TOO_OLD = 301, TANDEM_GPU_NOT_SUPPORTED = 302,
  TANDEM_OUT_OF_GPU_MEMORY = 303, TANDEM_CUDA_FAILED = 304
  // clang-format on
};

/// The name of a status, for logs: "ChildShared" of TANDEM_CHILD_SHARED. Never null.
TANDEM_API const char* tandem_status_name(tandem_status status);

/// Returns one sentence for people, without a full stop: "a block has two parents". Never null.
TANDEM_API const char* tandem_status_explain(tandem_status status);

/// Returns what the number counts that `where` gives: "instance", "pair", "section", "block"; null where
/// there is no such number.
TANDEM_API const char* tandem_status_subject(tandem_status status);

/// ---- Memory

/// The functions that memory comes from. A handle keeps a copy of the struct and takes all of its memory
/// there, results included; what `user` points to outlives the handle. Both functions may be called by
/// several threads at a time, also by those that scenes start. The library's own are only what the C++
/// runtime and the system take to start a thread. Null pointers to allocators stand for the C library's
/// memory.
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

/// The checked contents of one .bvh file. It never changes, and its references are counted: whoever has it
/// from a function below has one, and a scene has one of each of its assets. The count may be changed by
/// several threads at a time.
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
  /// Null, or where the vertices are in other shapes that the mesh takes, one shape after the other, each as
  /// `positions`. The tree is then made for the mean over all of them, for tandem_scene_deform().
  const double* poses;
  size_t pose_count;
} tandem_mesh;

enum { TANDEM_EFFORT_DEFAULT = 0, TANDEM_EFFORT_FAST = 1, TANDEM_EFFORT_BEST = 2 };

/// The options of bvhbuild.
typedef struct tandem_build_options {
  uint32_t struct_size;
  uint32_t effort;         ///< TANDEM_EFFORT_DEFAULT, ...; the best takes minutes for 100,000 triangles
  uint32_t no_gpu_blocks;  ///< 1: without the blocks that exact queries on a GPU walk
  uint32_t no_topology;    ///< 1: without what manifolds and contained bodies need
  uint32_t no_refit;       ///< 1: without what refitting the tree to a bent mesh needs
  uint32_t threads;        ///< at most; 0: as many as the machine has. The bytes do not depend on it
  double imaginary_share;  ///< padding nodes: 0: the proven fewest; to 1: as many as a free tree has
  const char* provenance;  ///< JSON that the file says of its making, or null: options and findings
  /// Null, or a function that is called now and then, by one thread at a time, with the share of the
  /// optimisation that is done; where it returns 1, optimisation ends soon, with the best tree so far.
  uint32_t (*progress)(void* user, double share);
  void* user;
} tandem_build_options;

/// Counts what became of the triangles; faces are triangles here.
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
/// TANDEM_BAD_PART where faces lie in no part, or the parts have 2^32 - 1 faces or more; TANDEM_OUT_OF_RANGE
/// where a coordinate of `poses` is NaN or beyond 3.4e38.
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
  uint64_t source_vertices;  ///< vertices of the mesh file; 0: the asset cannot be deformed
  double origin[3];          ///< the mesh file's coordinates = stored coordinates + origin
  double rounding_error;     ///< of a coordinate, at most
  float lower[3], upper[3];  ///< bounds in stored coordinates, of every level
} tandem_asset_info;

TANDEM_API tandem_status tandem_asset_get_info(const tandem_asset* asset, tandem_asset_info* info);

typedef struct tandem_corner {
  float position[3];  ///< in stored coordinates
  uint32_t w;         ///< of corner 0: the face of the mesh file; of corner 1: the part; of corner 2: 0
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
  double error_bound;        ///< no point of this surface or of the file's finest is farther from the other,
                             ///< by the file's word
  const tandem_triangle* triangles;  ///< in leaf order, as contacts number them
} tandem_level;

/// Result: TANDEM_UNKNOWN_LEVEL where there is no such level.
TANDEM_API tandem_status tandem_asset_get_level(const tandem_asset* asset, uint32_t level,
                                                tandem_level* result);

/// The coarsest level whose error_bound is at most `tolerance`; 0 where none is.
TANDEM_API uint32_t tandem_asset_coarsest_level(const tandem_asset* asset, double tolerance);

/// An asset that shows `count` levels of another from level `first` on, or as many as there are; 0: all.
/// Questions look at the first that an asset shows. The bytes are the same, and stay as long as either.
/// Result: TANDEM_UNKNOWN_LEVEL where there is no level `first`.
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

/// ---- Bodies

/// The place of a body: world = rotation x + translation, x in the mesh file's coordinates; rows of the
/// rotation are consecutive. Rigid to 1e-6, else TANDEM_POSE_NOT_RIGID.
typedef struct tandem_pose {
  double rotation[3][3];
  double translation[3];
} tandem_pose;

/// An asset as a body.
typedef struct tandem_instance {
  uint32_t asset;     ///< place in the list of the scene's assets; TANDEM_NO_INDEX: the body was removed
  uint32_t reserved;  ///< not looked at
  tandem_pose pose;
} tandem_instance;

/// Two bodies.
typedef struct tandem_object_pair {
  uint32_t a, b;
} tandem_object_pair;

/// The index of what does not exist: a triangle, a face, a former point, the asset of a removed body.
#define TANDEM_NO_INDEX 0xFFFFFFFFu

/// Says what moves a body: forces; nothing; the caller; nothing until the caller wakes it.
enum { TANDEM_MOVING = 0, TANDEM_FIXED = 1, TANDEM_KINEMATIC = 2, TANDEM_SLEEPING = 3 };

/// A set of pairs of bodies, which scenes do not look at. A scene that was given it keeps it.
typedef struct tandem_excluded_pairs tandem_excluded_pairs;

/// Takes pairs in any order, each as often as wanted. Result: TANDEM_UNKNOWN_INSTANCE where one names
/// body 2^32 - 1. A scene asks whether there are the others.
TANDEM_API tandem_status tandem_excluded_pairs_create(const tandem_object_pair* pairs, size_t count,
                                                      const tandem_allocator* allocator,
                                                      tandem_excluded_pairs** excluded);
/// Destroys the handle; null does nothing.
TANDEM_API void tandem_excluded_pairs_destroy(tandem_excluded_pairs* excluded);

/// The world of a body that is in all worlds.
#define TANDEM_EVERY_WORLD 0xFFFFFFFFu

/// Says which pairs a scene looks at (docs/queries.md). Arrays have `count` entries, one for each body
/// (TANDEM_FILTER_MISMATCH where there are others), or are null. The scene copies them.
typedef struct tandem_pair_filter {
  uint32_t struct_size;
  uint32_t reserved;
  size_t count;
  const uint8_t* motion;  ///< TANDEM_MOVING, ...; null: all move
  const uint32_t* group;  ///< the groups that a body is in, a bit each; null: all
  const uint32_t* mask;   ///< the groups that it meets; null: all
  const uint32_t* world;  ///< only bodies of one world meet; TANDEM_EVERY_WORLD: a body of all;
                          ///< null: there is one world
  const tandem_excluded_pairs* excluded;  ///< or null
} tandem_pair_filter;

/// ---- Scenes

/// Bodies, of which any number of questions can be asked. Poses are checked when bodies are placed or moved,
/// and object pairs are found once for all questions of one reach. A body is known by its number: its place
/// in the list that was placed, or what tandem_scene_add() gave. The number of a removed body is used again.
typedef struct tandem_scene tandem_scene;

TANDEM_API tandem_status tandem_scene_create(const tandem_allocator* allocator, tandem_scene** scene);

/// A device that answers the questions of a scene in place of the CPU: tandem_gpu_device_create() makes one.
typedef struct tandem_device tandem_device;
/// Makes a scene whose questions a device answers, and which owns the device; after an error the device is
/// destroyed. Result: also TANDEM_UNSUPPORTED_VERSION, where the two libraries are not of one version.
TANDEM_API tandem_status tandem_scene_create_on(tandem_device* device, const tandem_allocator* allocator,
                                                tandem_scene** scene);
/// Destroys a device that no scene was made of. Null does nothing.
TANDEM_API void tandem_device_destroy(tandem_device* device);

/// Gives up its assets, and its results are gone. Null does nothing.
TANDEM_API void tandem_scene_destroy(tandem_scene* scene);

/// Sets how many threads a call may use, the caller's included: 1 at first, at most 1,024; 0: 1. No result
/// depends on it. Result: TANDEM_BAD_OPTION for more, and nothing has changed.
TANDEM_API tandem_status tandem_scene_set_threads(tandem_scene* scene, uint32_t threads);

/// Names the assets that bodies refer to, and takes a reference to each. Questions look at the first level
/// that each shows; tandem_scene_find_verdicts() looks at all. There are no bodies and no results afterwards;
/// after an error there are no assets either. where: the place of an asset that is null.
TANDEM_API tandem_status tandem_scene_set_assets(tandem_scene* scene, tandem_asset* const* assets,
                                                 size_t count);

/// Gives the vertices of an asset other positions, as often as the caller likes: all its bodies take the
/// shape of the triangles between these. A body that bends alone gets an entry of its own in the list of
/// assets, where an asset may stand several times. Questions are then about these positions, posed as usual,
/// and decide as exactly as for rigid bodies: all but tandem_scene_find_verdicts() (TANDEM_DEFORMED), and,
/// where some coordinate is no float32 number, but those about manifolds, containment and impacts
/// (TANDEM_NOT_FLOAT32).
///
/// positions: x, y, z of each source vertex, in the file's coordinates; vertex_count: as in
/// tandem_asset_info, in the order of the vertices that the asset was built from. They are copied. Takes time
/// and, the first time, memory in proportion to the triangles. Result: TANDEM_UNKNOWN_ASSET;
/// TANDEM_NO_SOURCE_VERTICES; TANDEM_VERTEX_COUNT_MISMATCH; TANDEM_OUT_OF_RANGE, where tandem_scene_where()
/// is the first vertex with a coordinate that is NaN or beyond 3.4e38, or vertex_count where a body then
/// reaches beyond 1e300; or TANDEM_OUT_OF_MEMORY. After an error nothing has changed.
TANDEM_API tandem_status tandem_scene_deform(tandem_scene* scene, uint32_t asset, const float* positions,
                                             size_t vertex_count);
TANDEM_API tandem_status tandem_scene_deform_f64(tandem_scene* scene, uint32_t asset, const double* positions,
                                                 size_t vertex_count);

/// Returns how much looser the tree of a deformed asset is than as it was built: the surface of its inner
/// boxes by that of the box around all of them, divided by the same of the file's tree. Above 1.75 queries
/// most likely look at 1.2 times as many block pairs as in a tree that is built for the positions, so a new
/// one may pay. 1 where the asset is not deformed, or there is none.
TANDEM_API double tandem_scene_looseness(const tandem_scene* scene, uint32_t asset);

/// Places all bodies anew; those that stand as before cost next to nothing. filter: or null. Result:
/// TANDEM_OK, or, where tandem_scene_where() is the body: TANDEM_UNKNOWN_ASSET, TANDEM_POSE_NOT_RIGID,
/// TANDEM_OUT_OF_RANGE (beyond 1e300), TANDEM_BAD_MOTION; TANDEM_UNKNOWN_INSTANCE, where it is
/// the filter's excluded pair; TANDEM_FILTER_MISMATCH, TANDEM_TOO_MANY_INSTANCES, TANDEM_OUT_OF_MEMORY,
/// TANDEM_CANNOT_START_THREAD. After an error there are no bodies.
TANDEM_API tandem_status tandem_scene_place(tandem_scene* scene, const tandem_instance* instances,
                                            size_t count, const tandem_pair_filter* filter);

/// Makes this a scene of one body, the asset at the identity, for questions about the asset alone. Result: as
/// of tandem_scene_set_assets() and tandem_scene_place().
TANDEM_API tandem_status tandem_scene_place_alone(tandem_scene* scene, tandem_asset* asset);

/// Adds a body, whose number becomes *body: the lowest that is free. filter: or null; its arrays have one
/// entry, and it excludes no pairs (else TANDEM_BAD_OPTION): those that tandem_scene_place() was given stay.
/// Result: as of tandem_scene_place(). After an error nothing has changed, and *body is TANDEM_NO_INDEX.
TANDEM_API tandem_status tandem_scene_add(tandem_scene* scene, const tandem_instance* instance,
                                          const tandem_pair_filter* filter, uint32_t* body);

/// Moves bodies to other poses. Result: as of tandem_scene_place(), where tandem_scene_where() is the place
/// in these lists; TANDEM_UNKNOWN_INSTANCE where there is no such body. After an error nothing has changed.
TANDEM_API tandem_status tandem_scene_move(tandem_scene* scene, const uint32_t* bodies,
                                           const tandem_pose* poses, size_t count);

/// Changes what moves a body. Result: TANDEM_UNKNOWN_INSTANCE, TANDEM_BAD_MOTION, TANDEM_OUT_OF_MEMORY.
TANDEM_API tandem_status tandem_scene_set_motion(tandem_scene* scene, uint32_t body, uint32_t motion);

/// Removes a body: no question finds it any more. Result: TANDEM_UNKNOWN_INSTANCE.
TANDEM_API tandem_status tandem_scene_remove(tandem_scene* scene, uint32_t body);

/// Returns all bodies by number, valid until bodies are placed, added or removed.
TANDEM_API const tandem_instance* tandem_scene_instances(const tandem_scene* scene, size_t* count);

/// The asset, body, pair or contact that is to blame for the last call's error; 0 after TANDEM_OK, and where
/// the status alone says what is wrong.
TANDEM_API uint64_t tandem_scene_where(const tandem_scene* scene);

/// ---- Questions
///
/// A question is asked by its tandem_scene_find_...(). Its rows, the object pairs that it was about, and its
/// counters stay until it is asked again, or the assets are set; after an error it has none. Functions that
/// give rows return null and 0 where there are none, or with null for the scene. Where options have `pairs`,
/// the question is about these, in either order of a and b, and the filter is not asked; they may be those
/// that any question has, or a part of them. With null the scene finds the pairs. Results of all:
/// TANDEM_UNKNOWN_INSTANCE, where tandem_scene_where() is the given pair; TANDEM_TOO_MANY_PAIRS,
/// TANDEM_OUT_OF_MEMORY, TANDEM_CANNOT_START_THREAD.

/// The questions that are about object pairs. Manifolds and contained bodies are about those of contacts.
enum {
  TANDEM_PAIRS = 0,
  TANDEM_CONTACTS = 1,
  TANDEM_DISTANCES = 2,
  TANDEM_IMPACTS = 3,
  TANDEM_VERDICTS = 4,
  TANDEM_MOVED = 5
};

/// The object pairs of a question: sorted, a < b, or a = b for self pairs, where the scene found them; as
/// given else. Null and 0 where there is no such question.
TANDEM_API const tandem_object_pair* tandem_scene_pairs(const tandem_scene* scene, uint32_t question,
                                                        size_t* count);

/// ---- Object pairs

typedef struct tandem_pair_options {
  uint32_t struct_size;
  uint32_t self_pairs;  ///< 1: also each body with itself
  double reach;         ///< pairs whose world boxes are at most so far apart, or a little beyond
} tandem_pair_options;

/// Finds the object pairs whose world boxes overlap, or are within reach of each other, so that the caller
/// can leave some out before asking about them. Result: TANDEM_BAD_REACH where reach is negative or NaN.
TANDEM_API tandem_status tandem_scene_find_pairs(tandem_scene* scene, const tandem_pair_options* options);

/// ---- Pairs that have moved

typedef struct tandem_moved_options {
  uint32_t struct_size;
  uint32_t reserved;
  double tolerance;                 ///< how far a point of the smaller body may move against the larger one
  const double* tolerance_of_pair;  ///< or null: one for each pair instead
  size_t tolerance_count;
  const tandem_object_pair* pairs;  ///< or null
  size_t pair_count;
} tandem_moved_options;

typedef struct tandem_moved_counters {
  uint64_t object_pairs, kept;
} tandem_moved_counters;

/// Finds the pairs that have moved by more than the tolerance since they last were rows, or were not among
/// the pairs of the call before. Contacts need only be asked of these: the manifolds of the others can be
/// kept (tandem_manifold_options::keep). Result: TANDEM_BAD_TOLERANCE where a tolerance is negative or NaN,
/// and `where` is the pair; TANDEM_BAD_OPTION where there are not as many as pairs.
TANDEM_API tandem_status tandem_scene_find_moved(tandem_scene* scene, const tandem_moved_options* options);
/// Returns the pairs that have moved, in the order of the question's pairs.
TANDEM_API const tandem_object_pair* tandem_scene_moved(const tandem_scene* scene, size_t* count);

/// ---- Contacts

enum {
  TANDEM_EXACT = 0,  ///< contact pairs, as exact arithmetic on the posed vertices finds them
  TANDEM_FAST = 1,   ///< by float32, which may err where rounding does
  TANDEM_BOXES = 2   ///< candidates: triangles whose boxes overlap
};

typedef struct tandem_contact_options {
  uint32_t struct_size;
  uint32_t mode;                ///< TANDEM_EXACT, TANDEM_FAST or TANDEM_BOXES
  uint32_t first_contact_only;  ///< 1: one contact for each object pair that touches
  uint32_t self_pairs;          ///< 1: where the scene finds the pairs, also each body with itself
  uint32_t add_error_bounds;    ///< 1: a pair without a contact is surely apart at the finest levels too
  uint32_t leave_out_rings;     ///< of a body with itself: 0: all count; 1: triangles that share a vertex are
                                ///< left out; n, at most 8: those that n - 1 edges join
  double within;                ///< clearance: triangles at most so far apart count, decided exactly
  const tandem_object_pair* pairs;  ///< or null
  size_t pair_count;
} tandem_contact_options;

/// Two triangles that meet: triangle_a belongs to body a of the object pair, triangle_b to b.
typedef struct tandem_contact {
  uint32_t pair;                    ///< row of the list of object pairs
  uint32_t triangle_a, triangle_b;  ///< tandem_level::triangles[triangle_a]
  uint32_t face_a, face_b;          ///< of the mesh files
} tandem_contact;

typedef struct tandem_contact_counters {
  uint64_t object_pairs, block_pairs, candidates;
  uint64_t decided_by_float32, decided_by_float64, decided_exactly;
  uint64_t contacts;
} tandem_contact_counters;

/// Finds every pair of triangles that meet. A given pair of a body with itself asks for the contacts within
/// it. Result: TANDEM_BAD_REACH where `within` is not from 0 to 1e300; TANDEM_BAD_OPTION where
/// leave_out_rings is too large; TANDEM_NO_TOPOLOGY, where `where` is the asset of a body that meets itself
/// and whose neighbours are to be left out.
TANDEM_API tandem_status tandem_scene_find_contacts(tandem_scene* scene,
                                                    const tandem_contact_options* options);
/// Returns the contacts by ascending pair, and within a pair in an order that is the same on every run and
/// machine.
TANDEM_API const tandem_contact* tandem_scene_contacts(const tandem_scene* scene, size_t* count);

/// ---- Manifolds

typedef struct tandem_manifold_options {
  uint32_t struct_size;
  uint32_t most_points;      ///< of a manifold, 1 to 7, else TANDEM_BAD_OPTION; 0: 7
  uint32_t ignore_previous;  ///< 1: points are not looked for among those of the last call
  uint32_t keep;  ///< 1: the contacts are those of tandem_scene_moved(); manifolds of pairs that have not
                  ///< moved are the ones that were found, moved with the bodies (docs/contacts.md), and
                  ///< tandem_manifold::pair is a row of the pairs of TANDEM_MOVED
  uint32_t quick_depths;  ///< 1: less time for deep overlaps of bodies that are not convex, more of whose
                          ///< depths are too small then (docs/contacts.md)
} tandem_manifold_options;

enum { TANDEM_TOUCHING = 1, TANDEM_OPEN_CURVE = 2, TANDEM_GOES_THROUGH = 4, TANDEM_AMBIGUOUS = 8 };

/// A connected region in which the surfaces of two bodies meet (docs/contacts.md).
typedef struct tandem_manifold {
  double normal[3];       ///< unit, from a towards b; or 0 (TANDEM_AMBIGUOUS)
  double area_vector[3];  ///< of a's surface inside b
  double centre[3];       ///< of that area, in the world
  double depth;           ///< how far b is to be moved along the normal to end the overlap
  uint32_t pair;          ///< row of the list of object pairs
  uint32_t first_point, point_count;
  uint32_t flags;  ///< TANDEM_TOUCHING: without overlap; TANDEM_OPEN_CURVE: the curve in which the surfaces
                   ///< cross does not close; TANDEM_GOES_THROUGH: one body goes through the other here;
                   ///< TANDEM_AMBIGUOUS: corner on corner or edge along edge, normal 0 and no points
} tandem_manifold;

/// A point of a manifold.
typedef struct tandem_manifold_point {
  double position[3];       ///< world, half-way between the surfaces
  double in_a[3], in_b[3];  ///< on the surface of a, of b, in the coordinates of its mesh file
  double normal[3];         ///< unit: the manifold's, or where the patch is bent the surfaces' here
  double depth;             ///< along the point's normal
  uint64_t id;              ///< never 0; the same in successive steps for what is the same contact
  uint32_t face_a, face_b;  ///< of the mesh files
  uint32_t previous;        ///< the same point among those of the step before, or TANDEM_NO_INDEX
  uint32_t manifold;        ///< that it belongs to
} tandem_manifold_point;

typedef struct tandem_manifold_counters {
  uint64_t contacts;
  uint64_t segments;  ///< contacts whose triangles share a line
  uint64_t manifolds, points;
  uint64_t open_curves;        ///< manifolds with TANDEM_OPEN_CURVE
  uint64_t ambiguous_touches;  ///< manifolds with TANDEM_AMBIGUOUS
} tandem_manifold_counters;

/// Makes contact manifolds of the contacts, which are those of all bodies as they stand: else
/// TANDEM_CONTACTS_MISSING. Needs topology of all assets: TANDEM_NO_TOPOLOGY, where tandem_scene_where() is
/// the asset. After an error the next call finds no points before it, and with `keep` the next
/// tandem_scene_find_moved() keeps nothing. TANDEM_KEPT_MISMATCH: with `keep`, if the contacts are of other
/// pairs, or the call before had no `keep`.
TANDEM_API tandem_status tandem_scene_find_manifolds(tandem_scene* scene,
                                                     const tandem_manifold_options* options);
/// Return the manifolds by ascending pair, and their points, manifold by manifold. Both are gone when
/// contacts are found again.
TANDEM_API const tandem_manifold* tandem_scene_manifolds(const tandem_scene* scene, size_t* count);
TANDEM_API const tandem_manifold_point* tandem_scene_points(const tandem_scene* scene, size_t* count);

/// ---- Contained bodies

/// A component of a body that meets nothing of another and lies within it.
typedef struct tandem_containment {
  uint32_t pair;
  uint32_t inner;      ///< 0: a component of a, which lies in b; 1: of b, in a
  uint32_t component;  ///< its number in the inner body's file
  uint32_t flags;      ///< TANDEM_INSIDE, TANDEM_OUTER_OPEN: of open components there is no inside
} tandem_containment;

enum { TANDEM_INSIDE = 1, TANDEM_OUTER_OPEN = 2 };

typedef struct tandem_containment_counters {
  uint64_t object_pairs;
  uint64_t inside, outer_open;  ///< rows with these flags
} tandem_containment_counters;

/// Finds bodies within others, which no contact tells, among the object pairs of the contacts.
/// TANDEM_CONTACTS_MISSING where these are not all contacts of the bodies as they stand, in mode TANDEM_EXACT
/// with `within` 0. Needs, results: as of manifolds.
TANDEM_API tandem_status tandem_scene_find_contained(tandem_scene* scene);
TANDEM_API const tandem_containment* tandem_scene_contained(const tandem_scene* scene, size_t* count);

/// ---- Distances

/// Triangles of a pair of bodies that were nearest a step ago.
typedef struct tandem_former_nearest {
  uint32_t a, b;
  uint32_t triangle_a, triangle_b;
} tandem_former_nearest;

typedef struct tandem_distance_options {
  uint32_t struct_size;
  uint32_t limit_reach;  ///< 1: pairs surely farther apart than `reach` have no nearest points
  double reach;
  double absolute_tolerance;            ///< upper - lower <= max(absolute, relative * upper)
  double relative_tolerance;            ///< 0: 1e-6; at the finest 2^-48
  const tandem_former_nearest* former;  ///< or null: by ascending a, then b, where to begin to look
  size_t former_count;
  const tandem_object_pair* pairs;  ///< or null
  size_t pair_count;
} tandem_distance_options;

/// The distance of the surfaces of two bodies (docs/distance.md).
typedef struct tandem_distance {
  double lower, upper;              ///< lower <= distance <= upper; 0, 0 exactly where triangles meet
  double point_a[3], point_b[3];    ///< the nearest points that were found
  uint32_t triangle_a, triangle_b;  ///< that they are on; TANDEM_NO_INDEX: beyond reach
  uint32_t face_a, face_b;
} tandem_distance;

typedef struct tandem_distance_counters {
  uint64_t object_pairs, block_pairs;
  uint64_t by_float32, by_float64;  ///< triangle pairs
  uint64_t touching;                ///< object pairs at distance 0
} tandem_distance_counters;

/// Finds the distances of object pairs; the scene finds those whose world boxes are within reach. Result:
/// TANDEM_BAD_TOLERANCE or TANDEM_BAD_REACH where a tolerance or the reach is negative or NaN.
TANDEM_API tandem_status tandem_scene_find_distances(tandem_scene* scene,
                                                     const tandem_distance_options* options);
/// Returns the distance of each pair.
TANDEM_API const tandem_distance* tandem_scene_distances(const tandem_scene* scene, size_t* count);

/// ---- Times of impact

/// The centre goes straight ahead and the body turns about it, both at constant speed.
typedef struct tandem_motion {
  double velocity[3];          ///< of the centre
  double angular_velocity[3];  ///< radians a second
  double centre[3];            ///< in the world, at the start
} tandem_motion;

typedef struct tandem_impact_options {
  uint32_t struct_size;
  uint32_t reserved;
  double duration;   ///< of the step
  double tolerance;  ///< how near triangles come before they stop a pair, as a part of the diagonal
                     ///< of the smaller body's bounds; 0: 1e-6
  const tandem_motion* motion;  ///< of each body, else TANDEM_MOTION_MISMATCH
  size_t motion_count;
  const tandem_object_pair* pairs;  ///< or null
  size_t pair_count;
} tandem_impact_options;

enum { TANDEM_NO_IMPACT = 0, TANDEM_IMPACT = 1, TANDEM_IMPACT_AT_START = 2 };

/// Says until when two moving bodies surely do not meet (docs/impact.md).
typedef struct tandem_impact {
  double t_safe;  ///< no triangles of the two meet before; the whole step where there is no impact
  double gap;     ///< of the two triangles then
  double point_a[3], point_b[3];
  uint32_t triangle_a, triangle_b;
  uint32_t face_a, face_b;
  uint8_t status;  ///< TANDEM_NO_IMPACT, ...
  uint8_t reserved[7];
} tandem_impact;

typedef struct tandem_impact_counters {
  uint64_t object_pairs, at_start, found;
  uint64_t walks, block_pairs, triangle_pairs;
  uint64_t advanced, steps, most_steps, unconverged;
} tandem_impact_counters;

/// Finds when object pairs meet in a step; the scene finds those whose boxes, swept by the motions, meet.
/// Result: TANDEM_OUT_OF_RANGE of motions, where tandem_scene_where() is the body; TANDEM_BAD_DURATION or
/// TANDEM_BAD_TOLERANCE where the duration or the tolerance is negative or not finite.
TANDEM_API tandem_status tandem_scene_find_impacts(tandem_scene* scene, const tandem_impact_options* options);
/// Returns the impact of each pair.
TANDEM_API const tandem_impact* tandem_scene_impacts(const tandem_scene* scene, size_t* count);

/// The pose at time t of what stands at `start` at time 0; t_safe holds for it too.
TANDEM_API tandem_status tandem_pose_at(const tandem_pose* start, const tandem_motion* motion, double t,
                                        tandem_pose* pose);

/// ---- Levels of detail

typedef struct tandem_tolerance_options {
  uint32_t struct_size;
  uint32_t reserved;
  double tolerance;                 ///< what need not be told apart from touching; 0: all is decided
  const tandem_object_pair* pairs;  ///< or null
  size_t pair_count;
} tandem_tolerance_options;

enum { TANDEM_APART = 0, TANDEM_TOUCH = 1, TANDEM_WITHIN_TOLERANCE = 2 };

/// Says whether two bodies meet (docs/levels.md).
typedef struct tandem_verdict {
  uint8_t verdict;           ///< TANDEM_APART: the finest surfaces do not meet, TANDEM_TOUCH: they do, ...
  uint8_t level_a, level_b;  ///< of the bodies, that it was asked of
} tandem_verdict;

typedef struct tandem_tolerance_counters {
  uint64_t apart, touching, within_tolerance;  ///< object pairs
  tandem_contact_counters work;
} tandem_tolerance_counters;

/// Tells of object pairs whether they surely do not meet, surely meet, or are within a tolerance. Each body
/// is looked at at the coarsest of its levels that can tell. Result: TANDEM_NO_FINEST_LEVEL, where
/// tandem_scene_where() is the asset, where an asset does not show the file's level 0; TANDEM_BAD_TOLERANCE
/// where the tolerance is not from 0 to 1e300.
TANDEM_API tandem_status tandem_scene_find_verdicts(tandem_scene* scene,
                                                    const tandem_tolerance_options* options);
/// Returns the verdict of each pair.
TANDEM_API const tandem_verdict* tandem_scene_verdicts(const tandem_scene* scene, size_t* count);

/// ---- Bodies at points

typedef struct tandem_bodies_at_options {
  uint32_t struct_size;
  uint32_t reserved;
  const double* points;  ///< in the world, x, y, z of each
  size_t point_count;
} tandem_bodies_at_options;

/// A body whose world box contains a point.
typedef struct tandem_body_at {
  uint32_t point, body;
} tandem_body_at;

/// Finds which bodies' world boxes contain points: rows by point, then by body. Result: TANDEM_OUT_OF_RANGE,
/// where `where` is the point.
TANDEM_API tandem_status tandem_scene_find_bodies_at(tandem_scene* scene,
                                                     const tandem_bodies_at_options* options);
TANDEM_API const tandem_body_at* tandem_scene_bodies_at(const tandem_scene* scene, size_t* count);

/// ---- Configurations

/// Poses of the bodies that move in each configuration, one configuration after the other: pose_count is a
/// multiple of body_count.
typedef struct tandem_configuration_options {
  uint32_t struct_size;
  uint32_t find;           ///< tandem_configuration_pairs
  const uint32_t* bodies;  ///< that move, each once; all others stand where they are
  size_t body_count;
  const tandem_pose* poses;
  size_t pose_count;
  double within;              ///< bodies touch where their distance is at most this; or how far is looked
  double absolute_tolerance;  ///< of TANDEM_CONFIGURATION_NEAREST, as of tandem_distance_options
  double relative_tolerance;
} tandem_configuration_options;

/// Says which pairs of a configuration are found.
typedef enum tandem_configuration_pairs {
  TANDEM_CONFIGURATION_FIRST = 0,   ///< one that touches, if any does: lower is 0, upper is `within`
  TANDEM_CONFIGURATION_ALL = 1,     ///< all that touch; as above
  TANDEM_CONFIGURATION_NEAREST = 2  ///< the nearest, unless all are surely farther apart than `within`, which
                                    ///< may be infinite; bounds are of the least distance of all pairs
} tandem_configuration_pairs;

/// Two bodies of a configuration, a < b, and bounds of their distance.
typedef struct tandem_configuration_pair {
  uint64_t configuration;
  uint32_t a, b;
  double lower, upper;  ///< of their distance
} tandem_configuration_pair;

typedef struct tandem_configuration_counters {
  uint64_t configurations, touching, object_pairs, block_pairs;
} tandem_configuration_counters;

/// Asks of many configurations of a scene whether anything touches, or how near it comes. What stands is
/// prepared once, and the scene stays as it is. Pairs of two bodies that stand are not looked at. Rows ascend
/// by configuration. Result: TANDEM_UNKNOWN_INSTANCE, where `where` is the place in `bodies` of one that does
/// not exist or stands there twice; TANDEM_MOTION_MISMATCH; TANDEM_BAD_REACH; TANDEM_BAD_TOLERANCE;
/// TANDEM_POSE_NOT_RIGID or TANDEM_OUT_OF_RANGE, where `where` is the first such pose; or as of contacts and
/// distances.
TANDEM_API tandem_status tandem_scene_find_configurations(tandem_scene* scene,
                                                          const tandem_configuration_options* options);
TANDEM_API const tandem_configuration_pair* tandem_scene_configurations(const tandem_scene* scene,
                                                                        size_t* count);

/// ---- Points and rays

typedef struct tandem_closest_options {
  uint32_t struct_size;
  uint32_t limit_reach;  ///< 1: points surely farther away than `reach` have no closest point
  uint32_t sides;        ///< 1: `within` and `winding` are asked for
  uint32_t reserved;
  double reach;
  double absolute_tolerance;  ///< upper - lower <= max(absolute, relative * upper)
  double relative_tolerance;  ///< 0: 1e-6; at the finest 2^-48
  const double* points;       ///< in the world, x, y, z of each
  size_t point_count;
  const uint32_t* bodies;  ///< if there are any: each point is asked about each of these bodies alone
  size_t body_count;
} tandem_closest_options;

/// The closest point of the bodies of a scene (docs/points_and_rays.md).
typedef struct tandem_closest_point {
  double lower, upper;  ///< lower <= distance <= upper; 0, 0 exactly where the point is on a triangle
  double position[3];   ///< the closest point that was found
  uint32_t body;        ///< that it is on; TANDEM_NO_INDEX: all are beyond reach
  uint32_t triangle, face;
  uint32_t within;  ///< the lowest body that the point is inside of; TANDEM_NO_INDEX: none, or not asked
  int32_t winding;  ///< how often the closed surfaces of all bodies wind around the point
  uint32_t reserved;
} tandem_closest_point;

typedef struct tandem_closest_counters {
  uint64_t points;
  uint64_t blocks;      ///< four boxes or four triangles each
  uint64_t by_float64;  ///< triangles that float64 bounded
} tandem_closest_counters;

/// Finds the closest points of the bodies' surfaces. Result: TANDEM_OUT_OF_RANGE, where `where` is the point;
/// TANDEM_UNKNOWN_INSTANCE, where it is the place in `bodies`;
/// TANDEM_BAD_TOLERANCE or TANDEM_BAD_REACH where a tolerance or the reach is negative or NaN;
/// TANDEM_NO_TOPOLOGY, where sides are asked for and `where` is an asset whose file has none.
TANDEM_API tandem_status tandem_scene_find_closest(tandem_scene* scene,
                                                   const tandem_closest_options* options);
/// Returns the row of each point, or where bodies were named, of each point and each of these.
TANDEM_API const tandem_closest_point* tandem_scene_closest(const tandem_scene* scene, size_t* count);

/// The hit of the least parameter of each ray; some hit of each; or all hits.
enum { TANDEM_FIRST_HIT = 0, TANDEM_ANY_HIT = 1, TANDEM_ALL_HITS = 2 };

typedef struct tandem_ray_options {
  uint32_t struct_size;
  uint32_t hits;         ///< TANDEM_FIRST_HIT, TANDEM_ANY_HIT or TANDEM_ALL_HITS
  uint32_t limit_reach;  ///< 1: parameters beyond `reach` do not count
  uint32_t reserved;
  double reach;
  const double* origins;     ///< in the world, x, y, z of each
  const double* directions;  ///< of any length but 0
  size_t ray_count;
} tandem_ray_options;

/// A place where a ray meets a triangle of a body (docs/points_and_rays.md).
typedef struct tandem_ray_hit {
  double t;          ///< the parameter, within 2^-40 of itself; infinite: there is no hit
  double weight[2];  ///< of corners 1 and 2, within 2^-30
  uint32_t ray;
  uint32_t body;  ///< TANDEM_NO_INDEX: there is no hit
  uint32_t triangle, face;
} tandem_ray_hit;

typedef struct tandem_ray_counters {
  uint64_t rays;
  uint64_t hits;        ///< rows with a hit
  uint64_t blocks;      ///< four boxes or four triangles each
  uint64_t by_float64;  ///< triangles that float32 did not rule out
} tandem_ray_counters;

/// Finds where rays meet the bodies; decides exactly which do, and what is hit first. Result:
/// TANDEM_OUT_OF_RANGE or, where the direction is 0, TANDEM_NO_DIRECTION, where `where` is the ray;
/// TANDEM_BAD_REACH where the reach is negative or NaN.
TANDEM_API tandem_status tandem_scene_find_rays(tandem_scene* scene, const tandem_ray_options* options);
/// Returns the row of each ray, or all hits by ascending ray, parameter, body and triangle.
TANDEM_API const tandem_ray_hit* tandem_scene_rays(const tandem_scene* scene, size_t* count);

/// ---- Several questions

/// The questions that tandem_scene_find() asks. Null: the question is not asked.
typedef struct tandem_questions {
  uint32_t struct_size;
  uint32_t contained;  ///< 1: bodies within others
  const tandem_pair_options* pairs;
  const tandem_contact_options* contacts;
  const tandem_manifold_options* manifolds;
  const tandem_distance_options* distances;
  const tandem_impact_options* impacts;
  const tandem_tolerance_options* verdicts;
  const tandem_bodies_at_options* bodies_at;
  const tandem_configuration_options* configurations;
  const tandem_closest_options* closest;
  const tandem_ray_options* rays;
} tandem_questions;

/// Asks several questions, in the order of tandem_questions but bodies within others behind manifolds, until
/// one fails. Result: that of the one that fails.
TANDEM_API tandem_status tandem_scene_find(tandem_scene* scene, const tandem_questions* questions);

/// Counts what the questions did. Counters depend neither on the number of threads nor on the machine; those
/// of a question that has no results are 0.
typedef struct tandem_counters {
  uint32_t struct_size;
  uint32_t reserved;
  tandem_contact_counters contacts;
  tandem_manifold_counters manifolds;
  tandem_containment_counters contained;
  tandem_distance_counters distances;
  tandem_impact_counters impacts;
  tandem_tolerance_counters verdicts;
  tandem_moved_counters moved;
  tandem_configuration_counters configurations;
  tandem_closest_counters closest;
  tandem_ray_counters rays;
} tandem_counters;

TANDEM_API tandem_status tandem_scene_get_counters(const tandem_scene* scene, tandem_counters* counters);

/// ---- Worlds

/// Rigid bodies that move under gravity and contacts, which are those of a scene: exact, for any mesh.
/// Lengths are metres, masses kilograms, times seconds. The same calls give the same bytes, for any number of
/// threads.
typedef struct tandem_world tandem_world;

typedef struct tandem_world_options {
  uint32_t struct_size;
  uint32_t no_gravity;             ///< 1: there is none
  uint32_t no_friction;            ///< 1: it is 0
  uint32_t no_slop;                ///< 1: it is 0
  uint32_t no_rolling_resistance;  ///< 1: it is 0
  uint32_t no_sleeping;            ///< 1: bodies that rest are not left alone
  uint32_t continuous;             ///< 1: fast bodies are carried to where they first meet others
  uint32_t substeps;               ///< parts of a step that share its contacts, at most 10,000; 0: 16
  uint32_t threads;                ///< that a call may use, the caller's included, at most 1,024; 0: 1
  uint32_t reserved;
  double gravity[3];          ///< of components up to 1e6; 0: 0, 0, -9.81
  double friction;            ///< Coulomb's coefficient, at most 1e6; 0: 0.5
  double restitution;         ///< part of the speed that an impact gives back, 0 to 1
  double slop;                ///< overlap that is left alone, at most 1e6; 0: 1/4000 of the least diagonal of
                              ///< an asset of a moving body
  double rolling_resistance;  ///< lever at which the force between two bodies resists that they turn against
                              ///< each other, at most 1e6; 0: 16 slops
} tandem_world_options;

/// Makes a world, which has the options for good. Its handle, and what the questions in a step take, come
/// from the allocator; bodies, contacts and what solving takes, from the C++ runtime. Result:
/// TANDEM_BAD_OPTION, also where an option is not 0 beside the flag that says it is.
TANDEM_API tandem_status tandem_world_create(const tandem_world_options* options,
                                             const tandem_allocator* allocator, tandem_world** world);
/// Gives up its assets, and its bodies are gone. Null does nothing.
TANDEM_API void tandem_world_destroy(tandem_world* world);

/// Names the assets that bodies refer to, as tandem_scene_set_assets(). There are no bodies afterwards.
TANDEM_API tandem_status tandem_world_set_assets(tandem_world* world, tandem_asset* const* assets,
                                                 size_t count);

/// Says how a joint lets body b move against body a: about the anchor; about an axis through it, by an angle;
/// along the axis, by a way; not at all; or so that the anchors keep a distance between bounds.
enum { TANDEM_BALL = 0, TANDEM_HINGE = 1, TANDEM_SLIDER = 2, TANDEM_FIXED_JOINT = 3, TANDEM_DISTANCE = 4 };

/// Two bodies, of which at least one moves, joined as they are placed. Anchors and axis are those of the
/// world at that time, and the bodies carry them along.
typedef struct tandem_joint {
  uint32_t kind;       ///< TANDEM_BALL, ...
  uint32_t a, b;       ///< bodies; TANDEM_NO_INDEX: the world
  uint8_t has_limits;  ///< 1: least and most count, of a hinge, slider or distance
  uint8_t may_touch;   ///< 1: the two bodies have contacts with each other
  uint8_t reserved[2];
  double anchor[3];    ///< where they are joined; of a distance, the point of a
  double anchor_b[3];  ///< of a distance alone: the point of b
  double axis[3];      ///< of a hinge or slider: of any length
  double least, most;  ///< of the angle or way, which is 0 as the bodies are placed, or of the distance,
                       ///< which without limits stays what it is; may be infinite
  double speed;        ///< that the motor of a hinge or slider drives b at, against a
  double most_effort;  ///< its greatest torque or force; 0: there is no motor
  /// The mean force or torque in a step beyond which it lets go at the end of the step, its motor and limits
  /// included: about b's anchor, in newtons and newton metres. 0: it does not break.
  double breaking_force, breaking_torque;
} tandem_joint;

/// How bodies start. Arrays have `count` entries, one for each body (TANDEM_MOTION_MISMATCH where there are
/// others), or are null.
typedef struct tandem_body_start {
  uint32_t struct_size;
  uint32_t reserved;
  size_t count;
  const double* density;  ///< of bodies that move; null: 1000. The mass is that of what the mesh encloses; an
                          ///< open mesh is a shell, a hundredth of its diagonal thick
  const double* velocity;  ///< of the centre of mass, x, y, z of each; null: 0. A kinematic body keeps it
  const double* angular_velocity;  ///< x, y, z of each; null: 0
  /// Of bodies that touch: they have the geometric mean of their frictions, the larger restitution and the
  /// larger rolling resistance. Null, or less than 0: as the world's options say.
  const double* friction;
  const double* restitution;
  const double* rolling_resistance;
  const double* gravity_scale;  ///< part of gravity that acts on each; null: 1. 0: it floats
  const tandem_joint* joints;   ///< joint_count of them, or null
  size_t joint_count;
} tandem_body_start;

/// Places all bodies anew, at time 0. filter: or null; a sleeping body starts awake. start: or null. Result:
/// as of tandem_scene_place(); also, where tandem_world_where() is the body, TANDEM_OUT_OF_RANGE of a
/// velocity beyond 1e10 along an axis, a mass that is not from 1e-30 to 1e30 kg, a gravity_scale beyond 1e6,
/// or a friction, restitution or rolling resistance that is larger than options may be, and TANDEM_NO_MASS
/// where a moving body's mesh has no extent or its density is not positive; TANDEM_NO_TOPOLOGY, where it is
/// the asset; and where it is the joint, TANDEM_UNKNOWN_INSTANCE, TANDEM_JOINS_NOTHING, TANDEM_NO_AXIS and,
/// of numbers that its kind cannot have, TANDEM_BAD_JOINT. After an error there are no bodies.
TANDEM_API tandem_status tandem_world_set_bodies(tandem_world* world, const tandem_instance* instances,
                                                 size_t count, const tandem_pair_filter* filter,
                                                 const tandem_body_start* start);

/// Makes steps of dt seconds. Result: TANDEM_BAD_DURATION where dt is not more than 0 or more than 1000;
/// TANDEM_OUT_OF_RANGE, where tandem_world_where() is the body, where one has left the range of numbers that
/// questions take or has become faster than tandem_world_set_bodies() allows; TANDEM_OUT_OF_MEMORY. After an
/// error bodies are as after the last step that was whole, and there are no contacts.
TANDEM_API tandem_status tandem_world_step(tandem_world* world, double dt, uint32_t steps);
/// Makes more steps, which tandem_world_began(), tandem_world_ended() and tandem_world_broken() take for
/// steps of the last tandem_world_step(). Result: as of that.
TANDEM_API tandem_status tandem_world_step_more(tandem_world* world, double dt, uint32_t steps);

/// Where a body is, and how it moves.
typedef struct tandem_body_motion {
  tandem_pose pose;
  double centre[3];            ///< of mass, in the world; of a fixed body the translation
  double velocity[3];          ///< of the centre
  double angular_velocity[3];  ///< in the world
  uint8_t sleeps;  ///< 1: it rests with all that it touches, and is not looked at until it is touched
  uint8_t reserved[7];
} tandem_body_motion;

/// Returns the bodies by number, and null and 0 where there are none. Valid until the next call that may
/// change them.
TANDEM_API const tandem_body_motion* tandem_world_bodies(const tandem_world* world, size_t* count);

/// A point where two bodies touch, or nearly so, and what they did there in the last step.
typedef struct tandem_world_contact {
  uint32_t a, b;  ///< bodies, a < b
  double position[3];
  double normal[3];   ///< unit, from a towards b
  double depth;       ///< along the normal; less than 0 of a gap
  double impulse[3];  ///< on b, friction included; on a the opposite one. Newton seconds
} tandem_world_contact;

/// Returns the contacts that the last step solved, by ascending pair of bodies; not those of two sleeping
/// bodies. Valid as long as tandem_world_bodies().
TANDEM_API const tandem_world_contact* tandem_world_contacts(const tandem_world* world, size_t* count);

/// Two bodies that touch, and how hard.
typedef struct tandem_world_touch {
  uint32_t a, b;   ///< a < b
  double impulse;  ///< by which they push each other apart in a step: the sum over their contacts of those
                   ///< along the normals. Newton seconds
  double speed;    ///< at which they approach each other at the start of the step, the largest of their
                   ///< contacts along its normal; 0 where they part
  double position[3];  ///< of the contact that pushes hardest, or of the deepest where none pushes
} tandem_world_touch;

/// Return pairs of bodies, a < b, ascending. Valid as long as tandem_world_bodies().
/// touching: the pairs that touch in the last step: at its start they had a contact that is no gap, or one of
/// their contacts pushed in it. Two bodies that sleep go on as they were.
/// began, ended: the pairs that came to touch, or to touch no longer, in any of the steps of the last
/// tandem_world_step(); a pair that bounced in it is in both. Pairs of began have the numbers of
/// the step of the call, from when they began to touch, in which they pushed hardest, and the largest speed:
/// an impact often takes two steps, the first of which lets the bodies come as far as they meet. Empty after
/// tandem_world_restore().
TANDEM_API const tandem_world_touch* tandem_world_touching(const tandem_world* world, size_t* count);
TANDEM_API const tandem_world_touch* tandem_world_began(const tandem_world* world, size_t* count);
TANDEM_API const tandem_object_pair* tandem_world_ended(const tandem_world* world, size_t* count);

/// What a joint did in the last step, and where it is.
typedef struct tandem_world_joint {
  double position;      ///< angle, which counts whole turns, way, or distance; 0 of others
  double speed;         ///< by which it changes
  double impulse[3];    ///< on b at its anchor, on a the opposite one, in the world. Newton seconds
  double turning[3];    ///< the same of torques. Newton metre seconds
  double motor_effort;  ///< mean torque or force of the motor in the step, along the axis on b
  uint8_t holds;        ///< 0: it has broken, or been removed
  uint8_t reserved[7];
} tandem_world_joint;

/// Returns the joints in the order they were given. Valid as long as tandem_world_bodies().
TANDEM_API const tandem_world_joint* tandem_world_joints(const tandem_world* world, size_t* count);

/// Returns the joints that broke in any of the steps of the last tandem_world_step(), ascending. A broken
/// joint keeps its place until it is removed, and its bodies may touch from the next step on. Empty after
/// tandem_world_restore(). Valid as long as tandem_world_bodies().
TANDEM_API const uint32_t* tandem_world_broken(const tandem_world* world, size_t* count);

/// Joins bodies as they are now, and wakes them. place: of the joint among tandem_world_joints(), the first
/// from which one has been removed, or else one at the end. Result: as of joints in
/// tandem_world_set_bodies(). After an error nothing has changed.
TANDEM_API tandem_status tandem_world_add_joint(tandem_world* world, const tandem_joint* joint,
                                                uint32_t* place);

/// Removes a joint, broken or not, and wakes the bodies. Others keep their places. Result: TANDEM_BAD_JOINT,
/// where tandem_world_where() is the joint.
TANDEM_API tandem_status tandem_world_remove_joint(tandem_world* world, uint32_t joint);

/// Gives the motor of a hinge or slider another speed and greatest effort, and wakes the bodies. Result:
/// TANDEM_BAD_JOINT, where tandem_world_where() is the joint, also of one that has broken.
TANDEM_API tandem_status tandem_world_set_motor(tandem_world* world, uint32_t joint, double speed,
                                                double most_effort);

/// Returns the seconds of all steps since bodies were placed.
TANDEM_API double tandem_world_time(const tandem_world* world);

/// Returns a body's mass; 0 of one that contacts do not move.
TANDEM_API double tandem_world_mass(const tandem_world* world, uint32_t body);

/// Puts a body elsewhere or gives it other velocities, and wakes it. `centre` and `sleeps` are not looked at.
/// A fixed or kinematic body wakes what touches it or is joined to it, there and at its new place; a fixed
/// one has no velocities. Result, where tandem_world_where() is the body: TANDEM_UNKNOWN_INSTANCE,
/// TANDEM_POSE_NOT_RIGID, TANDEM_OUT_OF_RANGE. After an error nothing has changed.
TANDEM_API tandem_status tandem_world_set_body(tandem_world* world, uint32_t body,
                                               const tandem_body_motion* motion);

/// Gives a body another material, or lets another part of gravity act on it, from the next step on; see
/// tandem_body_start. States keep both. Where that is not what it was, the body wakes, and of a fixed or
/// kinematic body what touches it or is joined to it. Result, where tandem_world_where() is the body:
/// TANDEM_UNKNOWN_INSTANCE, TANDEM_OUT_OF_RANGE.
TANDEM_API tandem_status tandem_world_set_material(tandem_world* world, uint32_t body, double friction,
                                                   double restitution, double rolling_resistance);
TANDEM_API tandem_status tandem_world_set_gravity_scale(tandem_world* world, uint32_t body,
                                                        double gravity_scale);

/// Adds to a moving body's velocities what an impulse at a point of the world does, both x, y, z, and wakes
/// it; others stay as they are. Result: as of tandem_world_set_body().
TANDEM_API tandem_status tandem_world_push(tandem_world* world, uint32_t body, const double* impulse,
                                           const double* at);

/// Sets a force that acts on a moving body's centre of mass in all steps from now on, in newtons, and a
/// torque about it, in newton metres, both x, y, z along the world's axes, in place of those before; others
/// stay as they are. Both are 0 at the start, and states keep them. Wakes the body where they are not what
/// they were. Result: as of tandem_world_set_body().
TANDEM_API tandem_status tandem_world_set_force(tandem_world* world, uint32_t body, const double* force,
                                                const double* torque);

/// All that the next steps of a world depend on, beside options, assets and what bodies are.
typedef struct tandem_world_state tandem_world_state;

/// Keeps the state of the world. It may outlive the world.
TANDEM_API tandem_status tandem_world_save(const tandem_world* world, tandem_world_state** state);
/// Goes back to a state. There are no contacts until the next step. Result: TANDEM_KEPT_MISMATCH where it is
/// of another world, or of bodies that were placed before.
TANDEM_API tandem_status tandem_world_restore(tandem_world* world, const tandem_world_state* state);
/// Destroys the handle; null does nothing.
TANDEM_API void tandem_world_state_destroy(tandem_world_state* state);

/// The asset, body or joint that is to blame for the last call's error; 0 after TANDEM_OK, and where the
/// status alone says what is wrong.
TANDEM_API uint64_t tandem_world_where(const tandem_world* world);

#ifdef __cplusplus
}
#endif

#endif
