/// The C programs that ask a GPU about falling bodies share this: assets, places and queries of these. C99.
#ifndef TANDEM_TESTS_C_GPU_BODIES_H
#define TANDEM_TESTS_C_GPU_BODIES_H
#include <math.h>

#include "gpu_c_test.h"

enum { kBodies = 80, kSteps = 3 };

static cudaStream_t stream;
static tandem_asset* assets[3];
static tandem_gpu_assets* gpu_assets;

static uint64_t seed = 12345;

static inline double random_number(void) {
  seed = seed * 6364136223846793005u + 1442695040888963407u;
  return (double)(seed >> 11) / 9007199254740992.0;
}

// A box of ten times the size, a box and a cow, of about the same size: the large boxes have others within.
static inline void build_assets(const char* folder) {
  Triangles large = read_obj(folder, "box_12.obj");
  for (size_t i = 0; i < 3 * large.vertex_count; ++i) large.positions[i] *= 10;
  const tandem_mesh mesh = mesh_of(&large);
  CHECK_STATUS(tandem_asset_build(&mesh, NULL, NULL, &assets[0], NULL), TANDEM_OK);
  free_mesh(&large);
  assets[1] = build_obj(folder, "box_12.obj", NULL);
  Triangles cow = read_obj(folder, "cow_1500.obj");
  const tandem_mesh cow_mesh = mesh_of(&cow);
  tandem_build_options options = {.struct_size = sizeof options, .effort = TANDEM_EFFORT_FAST};
  CHECK_STATUS(tandem_asset_build(&cow_mesh, &options, NULL, &assets[2], NULL), TANDEM_OK);
  free_mesh(&cow);
}

// Bodies at random in a cube; those with even numbers move a little from step to step.
static inline void place(tandem_instance* bodies, int step) {
  tandem_asset_info cow;
  cow.struct_size = sizeof cow;
  CHECK_STATUS(tandem_asset_get_info(assets[2], &cow), TANDEM_OK);
  const double size = 12 * (cow.upper[0] - cow.lower[0]);
  seed = 4711;
  for (int i = 0; i < kBodies; ++i) {
    double q[4], length = 0;
    tandem_instance* body = &bodies[i];
    body->asset = i < 2 ? 0 : 1 + (uint32_t)i % 2;
    body->reserved = 0;
    for (int k = 0; k < 4; ++k) q[k] = random_number() - 0.5;
    for (int k = 0; k < 4; ++k) length += q[k] * q[k];
    for (int k = 0; k < 4; ++k) q[k] /= sqrt(length);
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const double rotation[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                                   {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                                   {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
    memcpy(body->pose.rotation, rotation, sizeof rotation);
    for (int k = 0; k < 3; ++k)
      body->pose.translation[k] = size * random_number() / 4 + (i % 2 == 0 ? 1e-4 * size * step : 0);
  }
}

static inline int compare_contacts(const void* x, const void* y) {
  const tandem_contact *a = (const tandem_contact*)x, *b = (const tandem_contact*)y;
  if (a->pair != b->pair) return a->pair < b->pair ? -1 : 1;
  if (a->face_a != b->face_a) return a->face_a < b->face_a ? -1 : 1;
  if (a->face_b != b->face_b) return a->face_b < b->face_b ? -1 : 1;
  if (a->triangle_a != b->triangle_a) return a->triangle_a < b->triangle_a ? -1 : 1;
  return a->triangle_b < b->triangle_b ? -1 : a->triangle_b > b->triangle_b;
}

// Whether rows in GPU memory have the bytes of rows in CPU memory.
static inline int same(const void* on_gpu, const void* on_cpu, size_t bytes) {
  void* copy = from_gpu(on_gpu, bytes);
  const int equal = memcmp(copy, on_cpu, bytes) == 0;
  free(copy);
  return equal;
}

// Whether the GPU's contacts, in any order, are those of the CPU.
static inline int same_contacts(const tandem_gpu_contact_query* query, const tandem_scene* expected) {
  size_t count = 0;
  tandem_gpu_query_report report;
  const tandem_contact* on_cpu = tandem_scene_contacts(expected, &count);
  CHECK_STATUS(tandem_gpu_contact_query_get_report(query, &report), TANDEM_OK);
  if (report.complete != 1 || report.contacts != count || count == 0) return 0;
  tandem_contact* sorted = (tandem_contact*)malloc(count * sizeof *sorted);
  tandem_contact* found =
      (tandem_contact*)from_gpu(tandem_gpu_contact_query_contacts(query), count * sizeof *found);
  memcpy(sorted, on_cpu, count * sizeof *sorted);
  qsort(sorted, count, sizeof *sorted, compare_contacts);
  qsort(found, count, sizeof *found, compare_contacts);
  const int equal = memcmp(sorted, found, count * sizeof *found) == 0;
  free(sorted);
  free(found);
  return equal;
}

typedef struct Queries {
  tandem_gpu_broad_phase* near;
  tandem_gpu_contact_query* contacts;
  tandem_gpu_manifolds* manifolds;
  tandem_gpu_containment_query* contained;
} Queries;

static inline Queries queries_of(tandem_gpu_assets* of) {
  Queries made = {NULL, NULL, NULL, NULL};
  CHECK_STATUS(tandem_gpu_broad_phase_create(NULL, &made.near), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_contact_query_create(NULL, &made.contacts), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_manifolds_create(NULL, &made.manifolds), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_containment_query_create(NULL, &made.contained), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_broad_phase_set_assets(made.near, of), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_contact_query_set_assets(made.contacts, of, stream), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_manifolds_set_assets(made.manifolds, of, stream), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_containment_query_set_assets(made.contained, of, stream), TANDEM_OK);
  return made;
}

static inline Queries make_queries(void) {
  return queries_of(gpu_assets);
}

static inline void destroy(Queries* queries) {
  tandem_gpu_containment_query_destroy(queries->contained);
  tandem_gpu_manifolds_destroy(queries->manifolds);
  tandem_gpu_contact_query_destroy(queries->contacts);
  tandem_gpu_broad_phase_destroy(queries->near);
}

static inline tandem_gpu_broad_phase_options sorted_pairs(void) {
  tandem_gpu_broad_phase_options options = {.struct_size = sizeof options, .sorted = 1};
  return options;
}

static inline tandem_gpu_query_options grouped_contacts(void) {
  tandem_gpu_query_options options = {.struct_size = sizeof options, .grouped = 1};
  return options;
}

/// Returns a scene of the same bodies on the CPU.
static inline tandem_scene* cpu_scene(const tandem_instance* bodies) {
  tandem_scene* scene = scene_of(assets, 3, NULL);
  CHECK_STATUS(tandem_scene_place(scene, bodies, kBodies, NULL), TANDEM_OK);
  return scene;
}

// Makes the stream and the assets.
static inline void begin(const char* folder) {
  cuda_must(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  build_assets(folder);
  CHECK_STATUS(tandem_gpu_assets_upload(assets, 3, NULL, stream, NULL, &gpu_assets, NULL), TANDEM_OK);
}

static inline void end(void) {
  tandem_gpu_assets_release(gpu_assets);
  for (int i = 0; i < 3; ++i) tandem_asset_release(assets[i]);
  cuda_must(cudaStreamDestroy(stream));
}

#endif
