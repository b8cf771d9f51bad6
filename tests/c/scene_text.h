/// Scenes as scripts/gpu_doors writes them: lines "asset PATH", then "instances N" and N lines of an asset's
/// number and twelve numbers of a pose, then "motion" with N numbers or "pairs M" with M lines of two. And
/// the hash of contacts, by the rule of docs/scenes.md. C99.
#ifndef TANDEM_TESTS_C_SCENE_TEXT_H
#define TANDEM_TESTS_C_SCENE_TEXT_H
#include "c_test.h"

typedef struct Row {
  uint32_t pair, face_a, face_b;
} Row;

static inline int compare_rows(const void* x, const void* y) {
  const Row *a = (const Row*)x, *b = (const Row*)y;
  if (a->pair != b->pair) return a->pair < b->pair ? -1 : 1;
  if (a->face_a != b->face_a) return a->face_a < b->face_a ? -1 : 1;
  return a->face_b < b->face_b ? -1 : a->face_b > b->face_b;
}

static inline int compare_pairs(const void* x, const void* y) {
  const tandem_object_pair *a = (const tandem_object_pair*)x, *b = (const tandem_object_pair*)y;
  if (a->a != b->a) return a->a < b->a ? -1 : 1;
  return a->b < b->b ? -1 : a->b > b->b;
}

// XXH64 with seed 0 of 32-bit words, as its specification has it.
static const uint64_t kPrime[5] = {0x9E3779B185EBCA87u, 0xC2B2AE3D27D4EB4Fu, 0x165667B19E3779F9u,
                                   0x85EBCA77C2B2AE63u, 0x27D4EB2F165667C5u};

static inline uint64_t rotated(uint64_t x, int by) {
  return x << by | x >> (64 - by);
}

static inline uint64_t stirred(uint64_t sum, uint64_t lane) {
  return rotated(sum + lane * kPrime[1], 31) * kPrime[0];
}

static inline uint64_t lane_at(const uint32_t* words) {
  return words[0] | (uint64_t)words[1] << 32;
}

static inline uint64_t xxh64(const uint32_t* words, size_t count) {
  const uint32_t* end = words + count;
  uint64_t hash = kPrime[4];
  const uint64_t bytes = 4 * (uint64_t)count;
  if (count >= 8) {
    uint64_t sum[4] = {kPrime[0] + kPrime[1], kPrime[1], 0, 0 - kPrime[0]};
    for (; end - words >= 8; words += 8)
      for (int i = 0; i < 4; ++i) sum[i] = stirred(sum[i], lane_at(words + 2 * i));
    hash = rotated(sum[0], 1) + rotated(sum[1], 7) + rotated(sum[2], 12) + rotated(sum[3], 18);
    for (int i = 0; i < 4; ++i) hash = (hash ^ stirred(0, sum[i])) * kPrime[0] + kPrime[3];
  }
  hash += bytes;
  for (; end - words >= 2; words += 2)
    hash = rotated(hash ^ stirred(0, lane_at(words)), 27) * kPrime[0] + kPrime[3];
  if (words != end) hash = rotated(hash ^ words[0] * kPrime[0], 23) * kPrime[1] + kPrime[2];
  hash = (hash ^ hash >> 33) * kPrime[1];
  hash = (hash ^ hash >> 29) * kPrime[2];
  return hash ^ hash >> 32;
}

static inline uint64_t hash_of(const tandem_object_pair* pairs, size_t pair_count,
                               const tandem_contact* contacts, size_t count) {
  Row* rows = (Row*)malloc((count + 1) * sizeof(Row));
  uint32_t* words = (uint32_t*)malloc((2 * pair_count + 3 * count + 1) * sizeof(uint32_t));
  for (size_t i = 0; i < count; ++i) {
    const tandem_object_pair* pair = &pairs[contacts[i].pair];
    const int swapped = pair->a == pair->b && contacts[i].face_b < contacts[i].face_a;
    rows[i].pair = contacts[i].pair;
    rows[i].face_a = swapped ? contacts[i].face_b : contacts[i].face_a;
    rows[i].face_b = swapped ? contacts[i].face_a : contacts[i].face_b;
  }
  qsort(rows, count, sizeof(Row), compare_rows);
  uint32_t* next = words;
  for (size_t i = 0; i < pair_count; ++i) {
    *next++ = pairs[i].a;
    *next++ = pairs[i].b;
  }
  for (size_t i = 0; i < count; ++i) *next++ = rows[i].pair;
  for (size_t i = 0; i < count; ++i) *next++ = rows[i].face_a;
  for (size_t i = 0; i < count; ++i) *next++ = rows[i].face_b;
  const uint64_t hash = xxh64(words, (size_t)(next - words));
  free(rows);
  free(words);
  return hash;
}

static inline void* list(size_t count, size_t size) {
  void* made = calloc(count + 1, size);
  if (made == NULL) exit(1);
  return made;
}

typedef struct Scene {
  tandem_asset* assets[16];
  size_t asset_count, count, pair_count;
  tandem_instance* instances;
  tandem_object_pair* pairs;  ///< sorted; null: none are given
  uint8_t* motion;            ///< or null
} Scene;

static inline Scene read_scene(const char* file) {
  Scene scene = {{NULL}, 0, 0, 0, NULL, NULL, NULL};
  size_t value = 0;
  char word[16], path[4096];
  FILE* from = fopen(file, "r");
  if (from == NULL) {
    printf("%s cannot be opened\n", file);
    exit(1);
  }
  while (fscanf(from, "%15s", word) == 1) {
    if (strcmp(word, "asset") == 0 && scene.asset_count < 16 && fscanf(from, " %4095[^\n]", path) == 1) {
      CHECK_STATUS(tandem_asset_open(path, NULL, NULL, &scene.assets[scene.asset_count++], NULL), TANDEM_OK);
    } else if (strcmp(word, "instances") == 0 && fscanf(from, "%zu", &scene.count) == 1) {
      scene.instances = (tandem_instance*)list(scene.count, sizeof *scene.instances);
      for (size_t i = 0; i < scene.count; ++i) {
        tandem_instance* instance = &scene.instances[i];
        double* numbers = &instance->pose.rotation[0][0];
        CHECK(fscanf(from, "%u", &instance->asset) == 1);
        for (int k = 0; k < 9; ++k) CHECK(fscanf(from, "%lf", numbers + k) == 1);
        for (int k = 0; k < 3; ++k) CHECK(fscanf(from, "%lf", &instance->pose.translation[k]) == 1);
      }
    } else if (strcmp(word, "motion") == 0) {
      scene.motion = (uint8_t*)list(scene.count, 1);
      for (size_t i = 0; i < scene.count; ++i) {
        CHECK(fscanf(from, "%zu", &value) == 1);
        scene.motion[i] = (uint8_t)value;
      }
    } else if (strcmp(word, "pairs") == 0 && fscanf(from, "%zu", &scene.pair_count) == 1) {
      scene.pairs = (tandem_object_pair*)list(scene.pair_count, sizeof *scene.pairs);
      for (size_t i = 0; i < scene.pair_count; ++i)
        CHECK(fscanf(from, "%u %u", &scene.pairs[i].a, &scene.pairs[i].b) == 2);
      qsort(scene.pairs, scene.pair_count, sizeof *scene.pairs, compare_pairs);
    } else {
      printf("%s: %s is not understood\n", file, word);
      exit(1);
    }
  }
  fclose(from);
  return scene;
}

static inline void release_assets(Scene* scene) {
  while (scene->asset_count > 0) tandem_asset_release(scene->assets[--scene->asset_count]);
}

static inline void free_scene(Scene* scene) {
  release_assets(scene);
  free(scene->instances);
  free(scene->pairs);
  free(scene->motion);
}

static inline void print_found(const tandem_object_pair* pairs, size_t pair_count,
                               const tandem_contact* contacts, size_t count) {
  const uint64_t hash = hash_of(pairs, pair_count, contacts, count);
  printf("%zu %zu %08x%08x\n", pair_count, count, (unsigned)(hash >> 32), (unsigned)hash);
}

#endif
