/// Tandem's C interface to queries and worlds on a GPU: libtandem_cuda.so, beside libtandem.so, whose assets
/// it takes. C99 and C++; needs no header of CUDA's. docs/c_gpu.md is its page; what calls mean is in
/// docs/gpu.md.
///
/// The conventions are those of tandem.h, and these:
/// - Poses, pairs and results lie in GPU memory. Arrays of results belong to their query: they stay where
/// they
///   are until its next reserve(), and their contents until its next call. Arrays of arguments stay as they
///   are until the stream has passed the call.
/// - Work is queued on the caller's stream. ..._enqueue() neither waits for the GPU nor allocates, and may be
///   captured into a CUDA graph. ..._find() enqueues, waits for the stream, and where there was too little
///   room makes some and starts again. Uploads, ..._set_assets(), ..._reserve() and ..._destroy() wait too.
/// - Functions work on the calling thread's current device (cudaSetDevice()); a handle belongs to the device
///   that was current when it was given its assets.
/// - A query's report has the status of what the GPU finds wrong: ..._device_report() in GPU memory, for
///   kernels that follow; ..._get_report(), once the stream has passed the call, in CPU memory, with the
///   status as its result too.
/// - Structs that lie in GPU memory, and capacities, are rows: they have no struct_size and never change.
/// - A handle that was not given assets yet, or others than the query whose contacts it takes, returns
///   TANDEM_ASSETS_MISSING. Any call may return TANDEM_OUT_OF_MEMORY, and of the GPU TANDEM_NO_GPU,
///   TANDEM_DRIVER_TOO_OLD, TANDEM_GPU_NOT_SUPPORTED, TANDEM_OUT_OF_GPU_MEMORY or TANDEM_CUDA_FAILED.
/// - GPU memory comes from cudaMalloc(). An allocator gives the memory of the handle itself; what its query
///   keeps in CPU memory, some kilobytes, comes from the C++ runtime.
#ifndef TANDEM_TANDEM_CUDA_H
#define TANDEM_TANDEM_CUDA_H

#include <tandem/tandem.h>

#ifdef __cplusplus
extern "C" {
#endif

/// A cudaStream_t or CUstream; null: the default stream.
typedef struct CUstream_st* tandem_stream;

/// The cudaError_t behind the last status from TANDEM_NO_GPU to TANDEM_CUDA_FAILED that a function of this
/// header returned on the calling thread; 0 before.
TANDEM_API int tandem_cuda_error(void);

/// ---- Scenes whose questions a GPU answers

/// Makes a scene whose questions the current GPU answers: all functions of tandem.h take it, and rows come
/// back to CPU memory. A program whose scenes tandem_scene_create() makes runs on a GPU with this one word.
/// Contacts, manifolds, contained bodies, verdicts and rays (but any hit) are those of the CPU; distances,
/// closest points and impacts are as certified, but not the same bytes. tandem_scene_set_assets() copies
/// assets to the GPU, questions copy bodies that have changed. Any function may return a status of the GPU,
/// and TANDEM_NO_ORIENTED_BLOCKS. The rest of this header is for programs whose poses or results lie in GPU
/// memory.
TANDEM_API tandem_status tandem_gpu_scene_create(const tandem_allocator* allocator, tandem_scene** scene);
/// Makes what answers on the current GPU, for tandem_scene_create_on().
TANDEM_API tandem_status tandem_gpu_device_create(const tandem_allocator* allocator, tandem_device** device);

/// ---- Assets in GPU memory

/// Copies of assets in the memory of one GPU: the levels that they show. They never change but by
/// tandem_gpu_assets_deform(), and references are counted, as those of tandem_asset; each handle that is
/// given them has one.
typedef struct tandem_gpu_assets tandem_gpu_assets;

enum {
  TANDEM_CONTENTS_ALL = 0,            ///< whatever the files hold
  TANDEM_CONTENTS_EXACT_QUERIES = 1,  ///< what queries of mode TANDEM_EXACT take, and those by tolerance
  TANDEM_CONTENTS_MANIFOLDS =
      2  ///< these, topology, which manifolds and contained bodies take, and what refitting needs
};

typedef struct tandem_upload_options {
  uint32_t struct_size;
  uint32_t contents;  ///< TANDEM_CONTENTS_ALL, ...
} tandem_upload_options;

/// Copies assets into one allocation of the current device's memory; it returns when all is there. The assets
/// need not stay. where (or null): the place of an asset that is null. After an error *uploaded is null.
TANDEM_API tandem_status tandem_gpu_assets_upload(tandem_asset* const* assets, size_t count,
                                                  const tandem_upload_options* options, tandem_stream stream,
                                                  const tandem_allocator* allocator,
                                                  tandem_gpu_assets** uploaded, uint64_t* where);
TANDEM_API void tandem_gpu_assets_retain(tandem_gpu_assets* assets);
/// The last reference frees the memory, which waits for the device. Null does nothing.
TANDEM_API void tandem_gpu_assets_release(tandem_gpu_assets* assets);
TANDEM_API size_t tandem_gpu_assets_count(const tandem_gpu_assets* assets);
/// GPU memory that they hold; of assets of which some deform, without what they share with those at rest.
TANDEM_API size_t tandem_gpu_assets_bytes(const tandem_gpu_assets* assets);

/// ---- Assets that deform

/// The outcome of a call that deforms assets.
typedef struct tandem_gpu_deform_report {
  tandem_status status;  ///< TANDEM_OK or TANDEM_OUT_OF_RANGE
  uint32_t body;   ///< the first array with a coordinate that is NaN or beyond 3.4e38: its place in the call
  uint64_t where;  ///< the first such vertex
} tandem_gpu_deform_report;

/// Makes assets of which some deform: those that `deforming` names, ascending, by their places in `assets`.
/// Each of them gets a tree of its own, which takes 48 bytes a triangle and 240 a block; all else is shared
/// with `assets`, to which the new ones keep a reference. They are given to queries as other assets are, and
/// what queries then find is about the deformed shapes. Tolerance queries refuse them (TANDEM_DEFORMED).
/// takes_f64: not 0 where positions may be in float64, which takes 72 bytes more a triangle; manifold,
/// containment and impact queries refuse such assets (TANDEM_NOT_FLOAT32). Waits for the stream.
///
/// Result: TANDEM_UNKNOWN_ASSET; TANDEM_NO_SOURCE_VERTICES, where a file has none or `assets` were uploaded
/// with TANDEM_CONTENTS_EXACT_QUERIES; TANDEM_BAD_OPTION, where numbers do not ascend or `assets` deform
/// themselves. where (or null): the place in `deforming`. After an error *made is null.
TANDEM_API tandem_status tandem_gpu_assets_create_deforming(tandem_gpu_assets* assets,
                                                            const uint32_t* deforming, size_t count,
                                                            uint32_t takes_f64, tandem_stream stream,
                                                            const tandem_allocator* allocator,
                                                            tandem_gpu_assets** made, uint64_t* where);
/// How many of them deform.
TANDEM_API size_t tandem_gpu_assets_deforming_count(const tandem_gpu_assets* assets);
/// Queues new shapes for assets that deform; queries that are queued behind it find them.
///
/// positions, positions_f64: for each asset that deforms, in their order, x, y, z of each source vertex in
/// float32 or float64, in the file's coordinates, as many as tandem_asset_info says; one of the two arrays of
/// pointers may be null. An asset with a pointer in neither stays as it is, and float32 counts where it has
/// one in both. The arrays of pointers lie in GPU memory too, and are read when the stream comes to them: a
/// graph that captured the call may be launched with other pointers in them. An asset whose positions are bad
/// stays as it is, and the report says so. Where a deformed asset is that of a fixed instance, call
/// tandem_gpu_broad_phase_keep_fixed() again. Result: TANDEM_ASSETS_MISSING where none deform;
/// TANDEM_NOT_FLOAT32, where positions_f64 is not null and the assets were made without takes_f64.
TANDEM_API tandem_status tandem_gpu_assets_enqueue_deform(tandem_gpu_assets* assets,
                                                          const float* const* positions,
                                                          const double* const* positions_f64,
                                                          tandem_stream stream);
/// Deforms assets and waits. Result: as of enqueue, or TANDEM_OUT_OF_RANGE, where the report says which.
TANDEM_API tandem_status tandem_gpu_assets_deform(tandem_gpu_assets* assets, const float* const* positions,
                                                  const double* const* positions_f64, tandem_stream stream);
TANDEM_API const tandem_gpu_deform_report* tandem_gpu_assets_device_report(const tandem_gpu_assets* assets);
TANDEM_API tandem_status tandem_gpu_assets_get_report(const tandem_gpu_assets* assets,
                                                      tandem_gpu_deform_report* report);

/// ---- Scenes in GPU memory

/// Instances as two arrays in GPU memory, which a simulation may write there.
typedef struct tandem_gpu_instances {
  const uint32_t* asset;    ///< place in the list of assets, of each
  const tandem_pose* pose;  ///< of each
  uint32_t count;
  uint32_t reserved;
} tandem_gpu_instances;

/// Object pairs in GPU memory.
typedef struct tandem_gpu_pairs {
  const tandem_object_pair* pairs;
  const uint32_t* count;  ///< how many, in GPU memory; null: `capacity`
  uint32_t capacity;      ///< room in `pairs`; where *count is more, queries of them are not complete
  uint32_t reserved;
} tandem_gpu_pairs;

/// A table of pairs that a filter excludes, in GPU memory.
typedef struct tandem_gpu_excluded_pairs tandem_gpu_excluded_pairs;

/// Makes a table on the GPU, as tandem_excluded_pairs_create() does; `pairs` lie in CPU memory. Waits for the
/// stream.
TANDEM_API tandem_status tandem_gpu_excluded_pairs_create(const tandem_object_pair* pairs, size_t count,
                                                          tandem_stream stream,
                                                          const tandem_allocator* allocator,
                                                          tandem_gpu_excluded_pairs** excluded);
TANDEM_API void tandem_gpu_excluded_pairs_destroy(tandem_gpu_excluded_pairs* excluded);

/// Says which pairs a call looks at, as tandem_pair_filter does. Its arrays lie in GPU memory and have an
/// entry for each instance, or are null. All stay, with the table, until the stream has passed the call.
typedef struct tandem_gpu_pair_filter {
  uint32_t struct_size;
  uint32_t reserved;
  const uint8_t* motion;
  const uint32_t* group;
  const uint32_t* mask;
  const uint32_t* world;
  const tandem_gpu_excluded_pairs* excluded;
} tandem_gpu_pair_filter;

/// ---- Broad phase

/// Finds the pairs of instances whose world boxes overlap.
typedef struct tandem_gpu_broad_phase tandem_gpu_broad_phase;

typedef struct tandem_gpu_broad_phase_options {
  uint32_t struct_size;
  uint32_t sorted;                       ///< 1: pairs ascend; reserve() has to know too
  double within;                         ///< pairs for a query of clearance with the same; reserve() too
  const tandem_gpu_pair_filter* filter;  ///< or null
} tandem_gpu_broad_phase_options;

typedef struct tandem_gpu_broad_phase_capacity {
  uint32_t instances, pairs;
} tandem_gpu_broad_phase_capacity;

typedef struct tandem_gpu_broad_phase_report {
  tandem_status status;  ///< TANDEM_OK, or an error; then there are no pairs
  uint32_t complete;     ///< 0: there was no room for all pairs
  uint32_t where;        ///< the instance to blame
  uint32_t count;        ///< pairs; 2^32 - 1 where there are as many or more
  uint64_t found;        ///< pairs, stored or not
} tandem_gpu_broad_phase_report;

TANDEM_API tandem_status tandem_gpu_broad_phase_create(const tandem_allocator* allocator,
                                                       tandem_gpu_broad_phase** broad_phase);
TANDEM_API void tandem_gpu_broad_phase_destroy(tandem_gpu_broad_phase* broad_phase);
/// Names the assets that instances refer to. What was kept of fixed instances is forgotten.
TANDEM_API tandem_status tandem_gpu_broad_phase_set_assets(tandem_gpu_broad_phase* broad_phase,
                                                           tandem_gpu_assets* assets);
/// Room for at least so much. Result: TANDEM_OUT_OF_RANGE for 2^32 - 1 instances.
TANDEM_API tandem_status tandem_gpu_broad_phase_reserve(tandem_gpu_broad_phase* broad_phase,
                                                        const tandem_gpu_broad_phase_capacity* capacity,
                                                        const tandem_gpu_broad_phase_options* options);
/// Keeps the instances whose motion is TANDEM_FIXED as they stand, and waits: calls to come take the time of
/// the others. motion: instances->count entries, in CPU memory; world: as many, in GPU memory, or null where
/// the filters of the calls have none. Room for more instances forgets what was
/// kept, and calls return TANDEM_KEPT_MISMATCH then. Result: as of find().
TANDEM_API tandem_status tandem_gpu_broad_phase_keep_fixed(tandem_gpu_broad_phase* broad_phase,
                                                           const tandem_gpu_instances* instances,
                                                           const uint8_t* motion, const uint32_t* world,
                                                           tandem_stream stream);
/// Result: TANDEM_OUT_OF_RANGE where less was reserved, or without these options; TANDEM_BAD_REACH where
/// `within` is negative or NaN; TANDEM_UNKNOWN_INSTANCE: an excluded pair names one that there is not;
/// TANDEM_KEPT_MISMATCH.
TANDEM_API tandem_status tandem_gpu_broad_phase_enqueue(tandem_gpu_broad_phase* broad_phase,
                                                        const tandem_gpu_instances* instances,
                                                        const tandem_gpu_broad_phase_options* options,
                                                        tandem_stream stream);
/// Result: as of enqueue(), or what the GPU found: TANDEM_UNKNOWN_ASSET, TANDEM_POSE_NOT_RIGID,
/// TANDEM_OUT_OF_RANGE, where the report says which instance; TANDEM_TOO_MANY_PAIRS.
TANDEM_API tandem_status tandem_gpu_broad_phase_find(tandem_gpu_broad_phase* broad_phase,
                                                     const tandem_gpu_instances* instances,
                                                     const tandem_gpu_broad_phase_options* options,
                                                     tandem_stream stream);
/// Returns where the pairs lie, for the queries below: a < b. The result's arrays are null before assets are
/// set.
TANDEM_API tandem_gpu_pairs tandem_gpu_broad_phase_pairs(const tandem_gpu_broad_phase* broad_phase);
TANDEM_API const tandem_gpu_broad_phase_report* tandem_gpu_broad_phase_device_report(
    const tandem_gpu_broad_phase* broad_phase);
TANDEM_API tandem_status tandem_gpu_broad_phase_get_report(const tandem_gpu_broad_phase* broad_phase,
                                                           tandem_gpu_broad_phase_report* report);
TANDEM_API size_t tandem_gpu_broad_phase_bytes(const tandem_gpu_broad_phase* broad_phase);

/// ---- Contacts

/// Finds every pair of triangles that meet, of given object pairs: the set of tandem_scene_find_contacts().
typedef struct tandem_gpu_contact_query tandem_gpu_contact_query;

/// reserve() has to know of sorted, grouped, within and add_error_bounds too.
typedef struct tandem_gpu_query_options {
  uint32_t struct_size;
  uint32_t mode;  ///< TANDEM_EXACT, ...; the other two walk blocks that TANDEM_CONTENTS_ALL alone has
  uint32_t first_contact_only;
  uint32_t sorted;  ///< 1: by pair, face_a, face_b, triangles: the same bytes on every run; costs the time of
                    ///< as many contacts as there is room for
  uint32_t grouped;  ///< 1: contacts lie pair by pair, and groups() tells where
  uint32_t add_error_bounds;
  double within;
  uint32_t most_blocks;      ///< thread blocks that look for contacts at a time; 0: as many as the GPU holds
  uint32_t leave_out_rings;  ///< as tandem_contact_options says; reserve() makes what it takes
} tandem_gpu_query_options;

typedef struct tandem_gpu_query_capacity {
  uint32_t pairs;
  uint32_t reserved;
  uint64_t contacts;
  uint64_t undecided;  ///< candidates that are not decided quickly
} tandem_gpu_query_capacity;

typedef struct tandem_gpu_query_report {
  tandem_status status;              ///< TANDEM_OK, or an error; then there are no contacts
  uint32_t complete;                 ///< 0: something did not fit, and contacts are missing
  uint64_t where;                    ///< the instance or pair to blame
  tandem_gpu_query_capacity needed;  ///< exact for what follows from things that did fit
  uint64_t contacts;                 ///< how many are stored
  uint64_t world_pairs;              ///< object pairs beyond float32, which take long
  tandem_contact_counters counters;
} tandem_gpu_query_report;

typedef struct tandem_gpu_group_counts {
  uint32_t pairs, contacts;
  uint32_t few, many;
} tandem_gpu_group_counts;

/// The arrays in GPU memory that say where the contacts of each pair lie.
typedef struct tandem_gpu_contact_groups {
  const tandem_contact* contacts;
  const uint32_t*
      first_contact;           ///< pairs + 1: those of pair p are first_contact[p] up to first_contact[p + 1]
  const uint32_t *few, *many;  ///< pairs with 1 to 64 contacts, and with more, ascending
  const tandem_gpu_group_counts* counts;
} tandem_gpu_contact_groups;

TANDEM_API tandem_status tandem_gpu_contact_query_create(const tandem_allocator* allocator,
                                                         tandem_gpu_contact_query** query);
TANDEM_API void tandem_gpu_contact_query_destroy(tandem_gpu_contact_query* query);
TANDEM_API tandem_status tandem_gpu_contact_query_set_assets(tandem_gpu_contact_query* query,
                                                             tandem_gpu_assets* assets, tandem_stream stream);
/// Result: TANDEM_OUT_OF_RANGE for 2^32 - 1 sorted or grouped contacts or more.
TANDEM_API tandem_status tandem_gpu_contact_query_reserve(tandem_gpu_contact_query* query,
                                                          const tandem_gpu_query_capacity* capacity,
                                                          const tandem_gpu_query_options* options);
/// A pair of an instance with itself asks for the contacts within it. Result: TANDEM_NO_ORIENTED_BLOCKS or
/// TANDEM_NO_AXIS_ALIGNED_BLOCKS, where an asset lacks what the mode walks; TANDEM_OUT_OF_RANGE: reserved
/// without these options; TANDEM_BAD_REACH: `within` is not from 0 to 1e300.
TANDEM_API tandem_status tandem_gpu_contact_query_enqueue(tandem_gpu_contact_query* query,
                                                          const tandem_gpu_instances* instances,
                                                          const tandem_gpu_pairs* pairs,
                                                          const tandem_gpu_query_options* options,
                                                          tandem_stream stream);
/// Result: as of enqueue(), or what the GPU found: as of the broad phase, or TANDEM_UNKNOWN_INSTANCE, where
/// the report says which pair; TANDEM_OUT_OF_RANGE where there are more pairs than capacity.
TANDEM_API tandem_status tandem_gpu_contact_query_find(tandem_gpu_contact_query* query,
                                                       const tandem_gpu_instances* instances,
                                                       const tandem_gpu_pairs* pairs,
                                                       const tandem_gpu_query_options* options,
                                                       tandem_stream stream);
/// Returns the contacts, in GPU memory, as many as the report says. All results are null before assets are
/// set.
TANDEM_API const tandem_contact* tandem_gpu_contact_query_contacts(const tandem_gpu_contact_query* query);
TANDEM_API tandem_gpu_contact_groups tandem_gpu_contact_query_groups(const tandem_gpu_contact_query* query);
/// Returns a number for each pair, not 0 where the pair has a contact. It is valid behind a complete query
/// with first_contact_only.
TANDEM_API const uint32_t* tandem_gpu_contact_query_met(const tandem_gpu_contact_query* query);
TANDEM_API const tandem_gpu_query_report* tandem_gpu_contact_query_device_report(
    const tandem_gpu_contact_query* query);
TANDEM_API tandem_status tandem_gpu_contact_query_get_report(const tandem_gpu_contact_query* query,
                                                             tandem_gpu_query_report* report);
TANDEM_API size_t tandem_gpu_contact_query_bytes(const tandem_gpu_contact_query* query);

/// ---- Contact manifolds

/// Makes the manifolds of grouped contacts: the bytes that tandem_scene_find_manifolds() makes.
typedef struct tandem_gpu_manifolds tandem_gpu_manifolds;

typedef struct tandem_gpu_manifold_capacity {
  uint32_t pairs;
  uint32_t reserved;
  uint64_t contacts;
  uint32_t manifolds, points;
} tandem_gpu_manifold_capacity;

typedef struct tandem_gpu_manifold_report {
  tandem_status status;
  uint32_t complete;  ///< 0: something did not fit, or the query is not complete; there are no manifolds then
  tandem_gpu_manifold_capacity needed;  ///< where the query is complete
  uint32_t manifolds, points;
  tandem_manifold_counters counters;
} tandem_gpu_manifold_report;

TANDEM_API tandem_status tandem_gpu_manifolds_create(const tandem_allocator* allocator,
                                                     tandem_gpu_manifolds** manifolds);
TANDEM_API void tandem_gpu_manifolds_destroy(tandem_gpu_manifolds* manifolds);
/// Result: TANDEM_NO_TOPOLOGY, where an asset was uploaded without. Forgets the points of the last call.
TANDEM_API tandem_status tandem_gpu_manifolds_set_assets(tandem_gpu_manifolds* manifolds,
                                                         tandem_gpu_assets* assets, tandem_stream stream);
TANDEM_API tandem_status tandem_gpu_manifolds_reserve(tandem_gpu_manifolds* manifolds,
                                                      const tandem_gpu_manifold_capacity* capacity);
/// Queues manifolds behind a call of `query`, with that call's instances and pairs. Result:
/// TANDEM_CONTACTS_MISSING where its last call did not group contacts.
TANDEM_API tandem_status tandem_gpu_manifolds_enqueue(
    tandem_gpu_manifolds* manifolds, const tandem_gpu_instances* instances, const tandem_gpu_pairs* pairs,
    const tandem_gpu_contact_query* query, const tandem_manifold_options* options, tandem_stream stream);
/// Makes manifolds of a query that has ended and is complete, and waits for them.
TANDEM_API tandem_status tandem_gpu_manifolds_find(
    tandem_gpu_manifolds* manifolds, const tandem_gpu_instances* instances, const tandem_gpu_pairs* pairs,
    const tandem_gpu_contact_query* query, const tandem_manifold_options* options, tandem_stream stream);
TANDEM_API const tandem_manifold* tandem_gpu_manifolds_manifolds(const tandem_gpu_manifolds* manifolds);
TANDEM_API const tandem_manifold_point* tandem_gpu_manifolds_points(const tandem_gpu_manifolds* manifolds);
TANDEM_API const tandem_gpu_manifold_report* tandem_gpu_manifolds_device_report(
    const tandem_gpu_manifolds* manifolds);
TANDEM_API tandem_status tandem_gpu_manifolds_get_report(const tandem_gpu_manifolds* manifolds,
                                                         tandem_gpu_manifold_report* report);
TANDEM_API size_t tandem_gpu_manifolds_bytes(const tandem_gpu_manifolds* manifolds);

/// ---- Contained bodies

/// Finds bodies within others, which no contact tells: the rows of tandem_scene_find_contained().
typedef struct tandem_gpu_containment_query tandem_gpu_containment_query;

typedef struct tandem_gpu_containment_capacity {
  uint32_t pairs, contained;
} tandem_gpu_containment_capacity;

typedef struct tandem_gpu_containment_report {
  tandem_status status;
  uint32_t complete;  ///< 0: something did not fit, or the query was not complete; then nothing is contained
  tandem_gpu_containment_capacity needed;
  uint32_t contained;
} tandem_gpu_containment_report;

TANDEM_API tandem_status tandem_gpu_containment_query_create(const tandem_allocator* allocator,
                                                             tandem_gpu_containment_query** query);
TANDEM_API void tandem_gpu_containment_query_destroy(tandem_gpu_containment_query* query);
/// Result: TANDEM_NO_TOPOLOGY, where an asset was uploaded without.
TANDEM_API tandem_status tandem_gpu_containment_query_set_assets(tandem_gpu_containment_query* query,
                                                                 tandem_gpu_assets* assets,
                                                                 tandem_stream stream);
TANDEM_API tandem_status tandem_gpu_containment_query_reserve(
    tandem_gpu_containment_query* query, const tandem_gpu_containment_capacity* capacity);
/// Queues the question behind a call of `query`, with that call's instances and pairs. Result:
/// TANDEM_CONTACTS_MISSING where that call did not group contacts, was not in mode TANDEM_EXACT, was of
/// clearance, or found the first contacts only.
TANDEM_API tandem_status tandem_gpu_containment_query_enqueue(tandem_gpu_containment_query* query,
                                                              const tandem_gpu_instances* instances,
                                                              const tandem_gpu_pairs* pairs,
                                                              const tandem_gpu_contact_query* contacts,
                                                              tandem_stream stream);
TANDEM_API tandem_status tandem_gpu_containment_query_find(tandem_gpu_containment_query* query,
                                                           const tandem_gpu_instances* instances,
                                                           const tandem_gpu_pairs* pairs,
                                                           const tandem_gpu_contact_query* contacts,
                                                           tandem_stream stream);
TANDEM_API const tandem_containment* tandem_gpu_containment_query_contained(
    const tandem_gpu_containment_query* query);
TANDEM_API const tandem_gpu_containment_report* tandem_gpu_containment_query_device_report(
    const tandem_gpu_containment_query* query);
TANDEM_API tandem_status tandem_gpu_containment_query_get_report(const tandem_gpu_containment_query* query,
                                                                 tandem_gpu_containment_report* report);
TANDEM_API size_t tandem_gpu_containment_query_bytes(const tandem_gpu_containment_query* query);

/// ---- Distances

/// Finds how near the bodies of given pairs are: as certified as tandem_scene_find_distances()
/// finds it, but not the same bytes.
typedef struct tandem_gpu_distance_query tandem_gpu_distance_query;

typedef struct tandem_gpu_distance_options {
  uint32_t struct_size;
  uint32_t limit_reach;  ///< 1: pairs surely farther apart than `reach` have no nearest points
  double reach;
  double absolute_tolerance;  ///< upper - lower <= max(absolute, relative * upper)
  double relative_tolerance;  ///< 0: 1e-6; at the finest 2^-48
  /// The distance of each pair a step ago, in GPU memory, or null; the query's own distances will do.
  const tandem_distance* former;
} tandem_gpu_distance_options;

typedef struct tandem_gpu_distance_capacity {
  uint32_t pairs;
  uint32_t block_pairs;     ///< of one round of the walk
  uint32_t triangle_pairs;  ///< that boxes and the direction of the nearest leave
  uint32_t settled;         ///< of these: bounded by float64
  uint32_t words;           ///< of a coordinate in exact arithmetic; 0: 8
} tandem_gpu_distance_capacity;

typedef struct tandem_gpu_distance_report {
  tandem_status status;
  uint32_t complete;  ///< 0: something did not fit; then distances mean nothing
  uint64_t where;     ///< the instance or pair to blame
  tandem_gpu_distance_capacity needed;
  uint64_t world_pairs;
  uint32_t rounds;  ///< of the walk
  tandem_distance_counters counters;
} tandem_gpu_distance_report;

TANDEM_API tandem_status tandem_gpu_distance_query_create(const tandem_allocator* allocator,
                                                          tandem_gpu_distance_query** query);
TANDEM_API void tandem_gpu_distance_query_destroy(tandem_gpu_distance_query* query);
/// Result: TANDEM_NO_AXIS_ALIGNED_BLOCKS, where an asset was not uploaded with TANDEM_CONTENTS_ALL.
TANDEM_API tandem_status tandem_gpu_distance_query_set_assets(tandem_gpu_distance_query* query,
                                                              tandem_gpu_assets* assets,
                                                              tandem_stream stream);
TANDEM_API tandem_status tandem_gpu_distance_query_reserve(tandem_gpu_distance_query* query,
                                                           const tandem_gpu_distance_capacity* capacity);
/// Result: TANDEM_BAD_TOLERANCE or TANDEM_BAD_REACH where it is negative or NaN.
TANDEM_API tandem_status tandem_gpu_distance_query_enqueue(tandem_gpu_distance_query* query,
                                                           const tandem_gpu_instances* instances,
                                                           const tandem_gpu_pairs* pairs,
                                                           const tandem_gpu_distance_options* options,
                                                           tandem_stream stream);
TANDEM_API tandem_status tandem_gpu_distance_query_find(tandem_gpu_distance_query* query,
                                                        const tandem_gpu_instances* instances,
                                                        const tandem_gpu_pairs* pairs,
                                                        const tandem_gpu_distance_options* options,
                                                        tandem_stream stream);
/// Returns the distance of each pair, in GPU memory.
TANDEM_API const tandem_distance* tandem_gpu_distance_query_distances(const tandem_gpu_distance_query* query);
TANDEM_API const tandem_gpu_distance_report* tandem_gpu_distance_query_device_report(
    const tandem_gpu_distance_query* query);
TANDEM_API tandem_status tandem_gpu_distance_query_get_report(const tandem_gpu_distance_query* query,
                                                              tandem_gpu_distance_report* report);
TANDEM_API size_t tandem_gpu_distance_query_bytes(const tandem_gpu_distance_query* query);

/// ---- Times of impact

/// Finds until when moving bodies surely do not meet: the guarantee of
/// tandem_scene_find_impacts(), but not the same bytes.
typedef struct tandem_gpu_impact_query tandem_gpu_impact_query;

typedef struct tandem_gpu_impact_options {
  uint32_t struct_size;
  uint32_t sorted;                       ///< 1: the pairs that it finds ascend; reserve() has to know too
  double tolerance;                      ///< as of tandem_impact_options
  const tandem_gpu_pair_filter* filter;  ///< or null; where the query finds the pairs
  uint32_t most_blocks;                  ///< as of tandem_gpu_query_options
  uint32_t reserved;
} tandem_gpu_impact_options;

typedef struct tandem_gpu_impact_capacity {
  uint32_t instances, pairs;
  uint64_t contacts;   ///< at the start
  uint64_t undecided;  ///< as of tandem_gpu_query_capacity
  uint32_t parts;      ///< of the step, of all pairs: half radians of turn
  uint32_t block_pairs, triangle_pairs;
  uint32_t reserved;
} tandem_gpu_impact_capacity;

typedef struct tandem_gpu_impact_report {
  tandem_status status;
  uint32_t complete;  ///< 0: something did not fit; then there are no impacts
  uint64_t where;     ///< the instance or pair to blame
  tandem_gpu_impact_capacity needed;
  uint32_t impacts;  ///< one for each object pair
  uint32_t rounds;
  tandem_impact_counters counters;
} tandem_gpu_impact_report;

TANDEM_API tandem_status tandem_gpu_impact_query_create(const tandem_allocator* allocator,
                                                        tandem_gpu_impact_query** query);
TANDEM_API void tandem_gpu_impact_query_destroy(tandem_gpu_impact_query* query);
/// Assets are uploaded with TANDEM_CONTENTS_ALL.
TANDEM_API tandem_status tandem_gpu_impact_query_set_assets(tandem_gpu_impact_query* query,
                                                            tandem_gpu_assets* assets, tandem_stream stream);
TANDEM_API tandem_status tandem_gpu_impact_query_reserve(tandem_gpu_impact_query* query,
                                                         const tandem_gpu_impact_capacity* capacity,
                                                         const tandem_gpu_impact_options* options);
/// Queues a query of the given pairs, or of those whose boxes, swept by the motions of a step of `duration`,
/// meet. motion: that of each instance, in GPU memory. pairs: or null. Result:
/// TANDEM_BAD_DURATION or TANDEM_BAD_TOLERANCE where it is negative or not finite; TANDEM_OUT_OF_RANGE for
/// more instances than reserved; as of tandem_gpu_broad_phase_enqueue().
TANDEM_API tandem_status tandem_gpu_impact_query_enqueue(tandem_gpu_impact_query* query,
                                                         const tandem_gpu_instances* instances,
                                                         const tandem_motion* motion, double duration,
                                                         const tandem_gpu_pairs* pairs,
                                                         const tandem_gpu_impact_options* options,
                                                         tandem_stream stream);
TANDEM_API tandem_status tandem_gpu_impact_query_find(tandem_gpu_impact_query* query,
                                                      const tandem_gpu_instances* instances,
                                                      const tandem_motion* motion, double duration,
                                                      const tandem_gpu_pairs* pairs,
                                                      const tandem_gpu_impact_options* options,
                                                      tandem_stream stream);
/// Returns the pairs that the query found.
TANDEM_API tandem_gpu_pairs tandem_gpu_impact_query_pairs(const tandem_gpu_impact_query* query);
/// Returns the impact of each pair, as many as the report says.
TANDEM_API const tandem_impact* tandem_gpu_impact_query_impacts(const tandem_gpu_impact_query* query);
TANDEM_API const tandem_gpu_impact_report* tandem_gpu_impact_query_device_report(
    const tandem_gpu_impact_query* query);
TANDEM_API tandem_status tandem_gpu_impact_query_get_report(const tandem_gpu_impact_query* query,
                                                            tandem_gpu_impact_report* report);
TANDEM_API size_t tandem_gpu_impact_query_bytes(const tandem_gpu_impact_query* query);

/// ---- Levels of detail

/// Comes to the verdicts of tandem_scene_find_verdicts(), at the same levels, on given pairs.
typedef struct tandem_gpu_tolerance_query tandem_gpu_tolerance_query;

typedef struct tandem_gpu_tolerance_capacity {
  uint32_t instances, pairs;
  uint64_t undecided;
} tandem_gpu_tolerance_capacity;

typedef struct tandem_gpu_tolerance_report {
  tandem_status status;
  uint32_t complete;  ///< 0: something did not fit; then verdicts mean nothing
  uint64_t where;     ///< the instance or pair to blame
  tandem_gpu_tolerance_capacity needed;
  uint64_t world_pairs;
  tandem_tolerance_counters counters;
} tandem_gpu_tolerance_report;

TANDEM_API tandem_status tandem_gpu_tolerance_query_create(const tandem_allocator* allocator,
                                                           tandem_gpu_tolerance_query** query);
TANDEM_API void tandem_gpu_tolerance_query_destroy(tandem_gpu_tolerance_query* query);
/// Result: TANDEM_NO_FINEST_LEVEL where an asset does not show the file's level 0; TANDEM_NO_ORIENTED_BLOCKS.
TANDEM_API tandem_status tandem_gpu_tolerance_query_set_assets(tandem_gpu_tolerance_query* query,
                                                               tandem_gpu_assets* assets,
                                                               tandem_stream stream);
TANDEM_API tandem_status tandem_gpu_tolerance_query_reserve(tandem_gpu_tolerance_query* query,
                                                            const tandem_gpu_tolerance_capacity* capacity);
/// tolerance: what need not be told apart from touching. Result: TANDEM_BAD_TOLERANCE where it is not from 0
/// to 1e300; TANDEM_OUT_OF_RANGE for more instances than reserved.
TANDEM_API tandem_status tandem_gpu_tolerance_query_enqueue(tandem_gpu_tolerance_query* query,
                                                            const tandem_gpu_instances* instances,
                                                            const tandem_gpu_pairs* pairs, double tolerance,
                                                            tandem_stream stream);
TANDEM_API tandem_status tandem_gpu_tolerance_query_find(tandem_gpu_tolerance_query* query,
                                                         const tandem_gpu_instances* instances,
                                                         const tandem_gpu_pairs* pairs, double tolerance,
                                                         tandem_stream stream);
/// Returns the verdict of each pair, in GPU memory.
TANDEM_API const tandem_verdict* tandem_gpu_tolerance_query_verdicts(const tandem_gpu_tolerance_query* query);
TANDEM_API const tandem_gpu_tolerance_report* tandem_gpu_tolerance_query_device_report(
    const tandem_gpu_tolerance_query* query);
TANDEM_API tandem_status tandem_gpu_tolerance_query_get_report(const tandem_gpu_tolerance_query* query,
                                                               tandem_gpu_tolerance_report* report);
TANDEM_API size_t tandem_gpu_tolerance_query_bytes(const tandem_gpu_tolerance_query* query);

/// ---- Points and rays

/// Asks bodies about points and rays, "probes" (docs/points_and_rays.md). Of points it finds what
/// tandem_scene_find_closest() finds, as certified, with the same sides, but not the same bytes. Of rays it
/// finds the rows of tandem_scene_find_rays(), byte for byte, but that of any hit another may be named.
typedef struct tandem_gpu_probe_query tandem_gpu_probe_query;

typedef struct tandem_gpu_closest_options {
  uint32_t struct_size;
  uint32_t limit_reach;       ///< 1: points surely farther away than `reach` have no closest point
  double reach;               ///< where limit_reach is 1
  double absolute_tolerance;  ///< upper - lower <= max(absolute, relative * upper)
  double relative_tolerance;  ///< 0: 1e-6; at the finest 2^-48
  const double* points;       ///< in GPU memory: x, y, z of each
  const uint8_t* looked_at;   ///< in GPU memory, of each instance: 0 where it is passed over. Null: all are
  uint32_t point_count;
  uint32_t sides;  ///< 1: `within` and `winding` are asked for
} tandem_gpu_closest_options;

typedef struct tandem_gpu_ray_options {
  uint32_t struct_size;
  uint32_t hits;         ///< TANDEM_FIRST_HIT, TANDEM_ANY_HIT or TANDEM_ALL_HITS
  uint32_t limit_reach;  ///< 1: parameters beyond `reach` do not count
  uint32_t ray_count;
  double reach;              ///< where limit_reach is 1
  const double* origins;     ///< in GPU memory: x, y, z of each
  const double* directions;  ///< likewise, of any length but 0
  const uint8_t* looked_at;  ///< as of tandem_gpu_closest_options
} tandem_gpu_ray_options;

typedef struct tandem_gpu_probe_capacity {
  uint32_t instances;
  uint32_t probes;  ///< points or rays
  uint32_t hits;    ///< where all hits are asked for: rows, and those that float64 gives up again
  uint32_t words;   ///< of a coordinate in exact arithmetic; 0: 8
} tandem_gpu_probe_capacity;

typedef struct tandem_gpu_probe_counters {
  uint64_t probes;
  uint64_t hits;        ///< of rays: those that were found
  uint64_t blocks;      ///< four boxes or four triangles each
  uint64_t by_float64;  ///< triangles that float64 looked at
} tandem_gpu_probe_counters;

typedef struct tandem_gpu_probe_report {
  tandem_status status;
  uint32_t complete;  ///< 0: something did not fit; then rows mean nothing
  uint64_t where;     ///< the instance, point or ray to blame
  tandem_gpu_probe_capacity needed;
  uint32_t rows;
  uint32_t exact;  ///< probes that float64 did not decide
  tandem_gpu_probe_counters counters;
} tandem_gpu_probe_report;

TANDEM_API tandem_status tandem_gpu_probe_query_create(const tandem_allocator* allocator,
                                                       tandem_gpu_probe_query** query);
TANDEM_API void tandem_gpu_probe_query_destroy(tandem_gpu_probe_query* query);
/// Result: TANDEM_NO_AXIS_ALIGNED_BLOCKS, where an asset was not uploaded with TANDEM_CONTENTS_ALL.
TANDEM_API tandem_status tandem_gpu_probe_query_set_assets(tandem_gpu_probe_query* query,
                                                           tandem_gpu_assets* assets, tandem_stream stream);
TANDEM_API tandem_status tandem_gpu_probe_query_reserve(tandem_gpu_probe_query* query,
                                                        const tandem_gpu_probe_capacity* capacity);
/// Result: TANDEM_BAD_TOLERANCE or TANDEM_BAD_REACH where it is negative or NaN; TANDEM_NO_TOPOLOGY where
/// sides are asked for and an asset has none; TANDEM_OUT_OF_RANGE for more instances or points than reserved.
TANDEM_API tandem_status tandem_gpu_probe_query_enqueue_closest(tandem_gpu_probe_query* query,
                                                                const tandem_gpu_instances* instances,
                                                                const tandem_gpu_closest_options* options,
                                                                tandem_stream stream);
TANDEM_API tandem_status tandem_gpu_probe_query_find_closest(tandem_gpu_probe_query* query,
                                                             const tandem_gpu_instances* instances,
                                                             const tandem_gpu_closest_options* options,
                                                             tandem_stream stream);
/// Returns the row of each point that was asked about last, in GPU memory.
TANDEM_API const tandem_closest_point* tandem_gpu_probe_query_closest(const tandem_gpu_probe_query* query);
/// Result: TANDEM_BAD_REACH where it is negative or NaN; TANDEM_OUT_OF_RANGE for more instances or rays than
/// reserved, or where all hits are asked for and no room for hits was reserved.
TANDEM_API tandem_status tandem_gpu_probe_query_enqueue_rays(tandem_gpu_probe_query* query,
                                                             const tandem_gpu_instances* instances,
                                                             const tandem_gpu_ray_options* options,
                                                             tandem_stream stream);
TANDEM_API tandem_status tandem_gpu_probe_query_find_rays(tandem_gpu_probe_query* query,
                                                          const tandem_gpu_instances* instances,
                                                          const tandem_gpu_ray_options* options,
                                                          tandem_stream stream);
/// Returns the rows of the rays that were asked about last, in GPU memory: as many as the report says.
TANDEM_API const tandem_ray_hit* tandem_gpu_probe_query_rays(const tandem_gpu_probe_query* query);
TANDEM_API const tandem_gpu_probe_report* tandem_gpu_probe_query_device_report(
    const tandem_gpu_probe_query* query);
TANDEM_API tandem_status tandem_gpu_probe_query_get_report(const tandem_gpu_probe_query* query,
                                                           tandem_gpu_probe_report* report);
TANDEM_API size_t tandem_gpu_probe_query_bytes(const tandem_gpu_probe_query* query);

/// ---- Worlds on a GPU

/// Rigid bodies that move on a GPU, by the rules of a tandem_world and from the same structs. Bodies,
/// contacts and pairs stay in GPU memory. Joints and large groups of bodies are always soft; see
/// docs/dynamics.md. The same calls give the same bytes on GPUs of one kind, but not those of a tandem_world.
/// A world takes one call at a time, and belongs to the device that was current when it was given its assets.
typedef struct tandem_gpu_world tandem_gpu_world;

/// How a body stands and moves, in GPU memory: 13 numbers.
typedef struct tandem_gpu_body_state {
  double position[3];          ///< of the centre of mass, in the world
  double orientation[4];       ///< of the file's axes, as a unit quaternion w, x, y, z
  double velocity[3];          ///< of the centre
  double angular_velocity[3];  ///< in the world
} tandem_gpu_body_state;

/// Makes a world, which has the options for good; `threads` are those of the CPU, which limits continuous
/// motion. It needs no GPU yet. Result: as of tandem_world_create().
TANDEM_API tandem_status tandem_gpu_world_create(const tandem_world_options* options,
                                                 const tandem_allocator* allocator, tandem_gpu_world** world);
/// Waits for the GPU. Null does nothing.
TANDEM_API void tandem_gpu_world_destroy(tandem_gpu_world* world);
/// Copies the assets that bodies refer to to the GPU, and waits; what the world does from then on is queued
/// on the stream. There are no bodies afterwards. Result: as of tandem_world_set_assets(); also, where
/// tandem_gpu_world_where() is the asset, TANDEM_NO_ORIENTED_BLOCKS and TANDEM_NO_TOPOLOGY.
TANDEM_API tandem_status tandem_gpu_world_set_assets(tandem_gpu_world* world, tandem_asset* const* assets,
                                                     size_t count, tandem_stream stream);
/// Places all bodies anew, at time 0. The arguments lie in CPU memory. Result: as of
/// tandem_world_set_bodies(). After an error there are no bodies.
TANDEM_API tandem_status tandem_gpu_world_set_bodies(tandem_gpu_world* world,
                                                     const tandem_instance* instances, size_t count,
                                                     const tandem_pair_filter* filter,
                                                     const tandem_body_start* start);
/// Makes steps of dt seconds, and waits for them. Result: as of tandem_world_step(), and TANDEM_OUT_OF_RANGE
/// too where the caller wrote to tandem_gpu_world_states() what no step can begin with. After an error bodies
/// are as after the last step that was whole, and there are no contacts.
TANDEM_API tandem_status tandem_gpu_world_step(tandem_gpu_world* world, double dt, uint32_t steps);
/// Makes more steps of the last call, as tandem_world_step_more().
TANDEM_API tandem_status tandem_gpu_world_step_more(tandem_gpu_world* world, double dt, uint32_t steps);
/// Copy from the GPU what tandem_world_bodies(), tandem_world_contacts(), tandem_world_touching(),
/// tandem_world_began(), tandem_world_ended(), tandem_world_joints() and tandem_world_broken() return: null
/// and 0 where there are none, and after an error. Valid until the next call. count: or null. What began and
/// ended is followed on the GPU; lists are made when they are asked for.
TANDEM_API tandem_status tandem_gpu_world_bodies(tandem_gpu_world* world, const tandem_body_motion** bodies,
                                                 size_t* count);
TANDEM_API tandem_status tandem_gpu_world_contacts(tandem_gpu_world* world,
                                                   const tandem_world_contact** contacts, size_t* count);
TANDEM_API tandem_status tandem_gpu_world_touching(tandem_gpu_world* world,
                                                   const tandem_world_touch** touching, size_t* count);
TANDEM_API tandem_status tandem_gpu_world_began(tandem_gpu_world* world, const tandem_world_touch** began,
                                                size_t* count);
TANDEM_API tandem_status tandem_gpu_world_ended(tandem_gpu_world* world, const tandem_object_pair** ended,
                                                size_t* count);
TANDEM_API tandem_status tandem_gpu_world_joints(tandem_gpu_world* world, const tandem_world_joint** joints,
                                                 size_t* count);
TANDEM_API tandem_status tandem_gpu_world_broken(tandem_gpu_world* world, const uint32_t** broken,
                                                 size_t* count);
/// Do what tandem_world_add_joint(), tandem_world_remove_joint() and tandem_world_set_motor() do.
TANDEM_API tandem_status tandem_gpu_world_add_joint(tandem_gpu_world* world, const tandem_joint* joint,
                                                    uint32_t* place);
TANDEM_API tandem_status tandem_gpu_world_remove_joint(tandem_gpu_world* world, uint32_t joint);
TANDEM_API tandem_status tandem_gpu_world_set_motor(tandem_gpu_world* world, uint32_t joint, double speed,
                                                    double most_effort);
/// Returns the state of each body, in GPU memory, as it is after the last step, and how many there are; null
/// and 0 without bodies. It stays where it is until bodies are placed or assets are set. Who writes there
/// calls tandem_gpu_world_wake() once that is done.
TANDEM_API tandem_gpu_body_state* tandem_gpu_world_states(const tandem_gpu_world* world, size_t* count);
/// Wakes all bodies.
TANDEM_API tandem_status tandem_gpu_world_wake(tandem_gpu_world* world);
/// Do what tandem_world_set_body(), tandem_world_set_material(), tandem_world_set_gravity_scale(),
/// tandem_world_push() and tandem_world_set_force() do.
TANDEM_API tandem_status tandem_gpu_world_set_body(tandem_gpu_world* world, uint32_t body,
                                                   const tandem_body_motion* motion);
TANDEM_API tandem_status tandem_gpu_world_set_material(tandem_gpu_world* world, uint32_t body,
                                                       double friction, double restitution,
                                                       double rolling_resistance);
TANDEM_API tandem_status tandem_gpu_world_set_gravity_scale(tandem_gpu_world* world, uint32_t body,
                                                            double gravity_scale);
TANDEM_API tandem_status tandem_gpu_world_push(tandem_gpu_world* world, uint32_t body, const double* impulse,
                                               const double* at);
TANDEM_API tandem_status tandem_gpu_world_set_force(tandem_gpu_world* world, uint32_t body,
                                                    const double* force, const double* torque);
/// All that the next steps of a world depend on, beside options, assets and what bodies are, in GPU memory.
typedef struct tandem_gpu_world_state tandem_gpu_world_state;

/// Keeps the state of the world, goes back to it, and destroys its handle, as tandem_world_save() and its
/// like do. The steps that follow have the same bytes.
TANDEM_API tandem_status tandem_gpu_world_save(const tandem_gpu_world* world, tandem_gpu_world_state** state);
TANDEM_API tandem_status tandem_gpu_world_restore(tandem_gpu_world* world,
                                                  const tandem_gpu_world_state* state);
TANDEM_API void tandem_gpu_world_state_destroy(tandem_gpu_world_state* state);
/// Returns the bytes of GPU memory that the world holds, but for its assets and states.
TANDEM_API size_t tandem_gpu_world_bytes(const tandem_gpu_world* world);
/// Return what tandem_world_time(), tandem_world_mass() and tandem_world_where() do.
TANDEM_API double tandem_gpu_world_time(const tandem_gpu_world* world);
TANDEM_API double tandem_gpu_world_mass(const tandem_gpu_world* world, uint32_t body);
TANDEM_API uint64_t tandem_gpu_world_where(const tandem_gpu_world* world);

#ifdef __cplusplus
}
#endif

#endif
