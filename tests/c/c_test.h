/// The C programs here share these checks, and the mesh of an OBJ file. C99.
#ifndef TANDEM_TESTS_C_TEST_H
#define TANDEM_TESTS_C_TEST_H
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tandem/tandem.h>

static int failures = 0;

/// Returns memory that free_aligned() gives back, or null. alignment: a power of two.
static inline void* allocate_aligned(size_t bytes, size_t alignment) {
  if (alignment < sizeof(void*)) alignment = sizeof(void*);
  char* const memory = (char*)malloc(bytes + alignment + sizeof(void*));
  if (memory == NULL) return NULL;
  char* const first = memory + sizeof(void*) + alignment - 1;
  void** const place = (void**)(void*)(first - (uintptr_t)first % alignment);
  place[-1] = memory;
  return place;
}

static inline void free_aligned(void* memory) {
  if (memory != NULL) free(((void**)memory)[-1]);
}

#define CHECK(condition)                                                   \
  do {                                                                     \
    if (!(condition)) {                                                    \
      printf("%s:%d: %s does not hold\n", __FILE__, __LINE__, #condition); \
      ++failures;                                                          \
    }                                                                      \
  } while (0)

#define CHECK_STATUS(call, expected)                                                              \
  do {                                                                                            \
    const tandem_status status_ = (call);                                                         \
    if (status_ != (expected)) {                                                                  \
      printf("%s:%d: %s is %s, not %s\n", __FILE__, __LINE__, #call, tandem_status_name(status_), \
             #expected);                                                                          \
      ++failures;                                                                                 \
    }                                                                                             \
  } while (0)

/// An allocator that has no memory.
static inline void* refuse(void* user, size_t bytes, size_t alignment) {
  (void)user;
  (void)bytes;
  (void)alignment;
  return NULL;
}

static inline void take_back(void* user, void* memory, size_t bytes, size_t alignment) {
  (void)user;
  (void)memory;
  (void)bytes;
  (void)alignment;
  ++failures;  // it gave none
}

typedef struct Triangles {
  double* positions;
  uint32_t* triangles;
  size_t vertex_count, triangle_count;
} Triangles;

/// Reads the v and f lines of an OBJ file of triangles.
static inline Triangles read_obj(const char* folder, const char* name) {
  Triangles mesh = {NULL, NULL, 0, 0};
  char path[4096], line[256];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE* file = fopen(path, "r");
  if (file == NULL) {
    printf("%s cannot be opened\n", path);
    exit(1);
  }
  while (fgets(line, sizeof line, file) != NULL) {
    if (line[0] == 'v' && line[1] == ' ') {
      mesh.positions = (double*)realloc(mesh.positions, 3 * (mesh.vertex_count + 1) * sizeof(double));
      double* p = mesh.positions + 3 * mesh.vertex_count++;
      if (sscanf(line, "v %lf %lf %lf", p, p + 1, p + 2) != 3) exit(1);
    } else if (line[0] == 'f') {
      mesh.triangles = (uint32_t*)realloc(mesh.triangles, 3 * (mesh.triangle_count + 1) * sizeof(uint32_t));
      uint32_t* t = mesh.triangles + 3 * mesh.triangle_count++;
      if (sscanf(line, "f %u %u %u", t, t + 1, t + 2) != 3) exit(1);
      for (int k = 0; k < 3; ++k) --t[k];
    }
  }
  fclose(file);
  return mesh;
}

static inline void free_mesh(Triangles* mesh) {
  free(mesh->positions);
  free(mesh->triangles);
}

static inline tandem_mesh mesh_of(const Triangles* from) {
  tandem_mesh mesh = {.struct_size = sizeof mesh,
                      .positions = from->positions,
                      .vertex_count = from->vertex_count,
                      .triangles = from->triangles,
                      .triangle_count = from->triangle_count};
  return mesh;
}

static inline tandem_asset* build_obj(const char* folder, const char* name,
                                      const tandem_allocator* allocator) {
  Triangles triangles = read_obj(folder, name);
  const tandem_mesh mesh = mesh_of(&triangles);
  tandem_asset* asset = NULL;
  CHECK_STATUS(tandem_asset_build(&mesh, NULL, allocator, &asset, NULL), TANDEM_OK);
  free_mesh(&triangles);
  if (asset == NULL) exit(1);
  return asset;
}

/// A scene of these assets.
static inline tandem_scene* scene_of(tandem_asset* const* assets, size_t count,
                                     const tandem_allocator* allocator) {
  tandem_scene* scene = NULL;
  CHECK_STATUS(tandem_scene_create(allocator, &scene), TANDEM_OK);
  CHECK_STATUS(tandem_scene_set_assets(scene, assets, count), TANDEM_OK);
  return scene;
}

static inline size_t contact_count(const tandem_scene* scene) {
  size_t count = 0;
  (void)tandem_scene_contacts(scene, &count);
  return count;
}

/// How many object pairs a question was about.
static inline size_t pair_count(const tandem_scene* scene, uint32_t question) {
  size_t count = 0;
  (void)tandem_scene_pairs(scene, question, &count);
  return count;
}

/// An instance of asset 0 that is not turned.
static inline tandem_instance at(double x, double y, double z) {
  tandem_instance instance = {0};
  for (int k = 0; k < 3; ++k) instance.pose.rotation[k][k] = 1;
  instance.pose.translation[0] = x;
  instance.pose.translation[1] = y;
  instance.pose.translation[2] = z;
  return instance;
}

#endif
