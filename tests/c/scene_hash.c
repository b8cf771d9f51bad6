// Finds the contacts of a scene through the C interface and prints how many and their hash, by the rule of
// docs/scenes.md. With a tolerance: how many object pairs are apart, touch, and are within it. C99.
// Usage: scene_hash SCENE MODE FIRST_ONLY SELF_PAIRS WITHIN THREADS [TOLERANCE]
//
// SCENE is what c_scenes_test.py writes of a scene file: lines "asset PATH", then "instances N" and N lines of an
// asset's number and twelve numbers of a pose, then "motion" with N numbers or "pairs M" with M lines of two.
#include "c_test.h"

typedef struct Row {
  uint32_t pair, face_a, face_b;
} Row;

static int compare_rows(const void* x, const void* y) {
  const Row *a = (const Row*)x, *b = (const Row*)y;
  if (a->pair != b->pair) return a->pair < b->pair ? -1 : 1;
  if (a->face_a != b->face_a) return a->face_a < b->face_a ? -1 : 1;
  return a->face_b < b->face_b ? -1 : a->face_b > b->face_b;
}

static int compare_pairs(const void* x, const void* y) {
  const tandem_object_pair *a = (const tandem_object_pair*)x, *b = (const tandem_object_pair*)y;
  if (a->a != b->a) return a->a < b->a ? -1 : 1;
  return a->b < b->b ? -1 : a->b > b->b;
}

// XXH64 with seed 0 of 32-bit words, as its specification has it.
static const uint64_t kPrime[5] = {0x9E3779B185EBCA87u, 0xC2B2AE3D27D4EB4Fu, 0x165667B19E3779F9u,
                                   0x85EBCA77C2B2AE63u, 0x27D4EB2F165667C5u};

static uint64_t rotated(uint64_t x, int by) {
  return x << by | x >> (64 - by);
}

static uint64_t stirred(uint64_t sum, uint64_t lane) {
  return rotated(sum + lane * kPrime[1], 31) * kPrime[0];
}

static uint64_t lane_at(const uint32_t* words) {
  return words[0] | (uint64_t)words[1] << 32;
}

static uint64_t xxh64(const uint32_t* words, size_t count) {
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

static uint64_t hash_of(const tandem_object_pair* pairs, size_t pair_count, const tandem_contact* contacts,
                        size_t count) {
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

static void* list(size_t count, size_t size) {
  void* made = calloc(count + 1, size);
  if (made == NULL) exit(1);
  return made;
}

static void print_verdicts(tandem_asset* const* assets, size_t asset_count, const tandem_instance* instances,
                           size_t count, double tolerance, const tandem_query_options* from) {
  tandem_tolerance_options options = {sizeof options, from->threads, tolerance, from->filter};
  tandem_tolerance_query* query = NULL;
  CHECK_STATUS(tandem_tolerance_query_create(NULL, &query), TANDEM_OK);
  CHECK_STATUS(tandem_tolerance_query_set_assets(query, assets, asset_count), TANDEM_OK);
  CHECK_STATUS(tandem_tolerance_query_decide(query, instances, count, &options), TANDEM_OK);
  size_t found = 0, of[3] = {0, 0, 0};
  const tandem_verdict* verdicts = tandem_tolerance_query_verdicts(query, &found);
  for (size_t i = 0; i < found; ++i) ++of[verdicts[i].verdict];
  printf("%zu %zu %zu\n", of[TANDEM_APART], of[TANDEM_TOUCH], of[TANDEM_WITHIN_TOLERANCE]);
  tandem_tolerance_query_destroy(query);
}

int main(int argc, char** argv) {
  if (argc != 7 && argc != 8) return printf("usage: scene_hash SCENE MODE FIRST_ONLY SELF_PAIRS WITHIN THREADS [TOLERANCE]\n"), 1;
  FILE* scene = fopen(argv[1], "r");
  if (scene == NULL) return printf("%s cannot be opened\n", argv[1]), 1;
  tandem_asset* assets[16];
  size_t asset_count = 0, count = 0, pair_count = 0, value = 0;
  tandem_instance* instances = NULL;
  tandem_object_pair* pairs = NULL;
  uint8_t* motion = NULL;
  char word[16], path[4096];
  while (fscanf(scene, "%15s", word) == 1) {
    if (strcmp(word, "asset") == 0 && asset_count < 16 && fscanf(scene, " %4095[^\n]", path) == 1) {
      CHECK_STATUS(tandem_asset_open(path, NULL, NULL, &assets[asset_count++], NULL), TANDEM_OK);
    } else if (strcmp(word, "instances") == 0 && fscanf(scene, "%zu", &count) == 1) {
      instances = (tandem_instance*)list(count, sizeof *instances);
      for (size_t i = 0; i < count; ++i) {
        double* numbers = &instances[i].pose.rotation[0][0];
        CHECK(fscanf(scene, "%u", &instances[i].asset) == 1);
        for (int k = 0; k < 9; ++k) CHECK(fscanf(scene, "%lf", numbers + k) == 1);
        for (int k = 0; k < 3; ++k) CHECK(fscanf(scene, "%lf", &instances[i].pose.translation[k]) == 1);
      }
    } else if (strcmp(word, "motion") == 0) {
      motion = (uint8_t*)list(count, 1);
      for (size_t i = 0; i < count; ++i) {
        CHECK(fscanf(scene, "%zu", &value) == 1);
        motion[i] = (uint8_t)value;
      }
    } else if (strcmp(word, "pairs") == 0 && fscanf(scene, "%zu", &pair_count) == 1) {
      pairs = (tandem_object_pair*)list(pair_count, sizeof *pairs);
      for (size_t i = 0; i < pair_count; ++i) CHECK(fscanf(scene, "%u %u", &pairs[i].a, &pairs[i].b) == 2);
      qsort(pairs, pair_count, sizeof *pairs, compare_pairs);
    } else {
      return printf("%s: %s is not understood\n", argv[1], word), 1;
    }
  }
  fclose(scene);

  tandem_pair_filter filter;
  memset(&filter, 0, sizeof filter);
  filter.struct_size = sizeof filter;
  filter.count = count;
  filter.motion = motion;
  tandem_query_options options;
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.mode = (uint32_t)atoi(argv[2]);
  options.first_contact_only = (uint32_t)atoi(argv[3]);
  options.self_pairs = (uint32_t)atoi(argv[4]);
  options.within = atof(argv[5]);
  options.threads = (uint32_t)atoi(argv[6]);
  options.filter = &filter;
  if (argc == 8) print_verdicts(assets, asset_count, instances, count, atof(argv[7]), &options);
  tandem_contact_query* query = NULL;
  CHECK_STATUS(tandem_contact_query_create(NULL, &query), TANDEM_OK);
  CHECK_STATUS(tandem_contact_query_set_assets(query, assets, asset_count), TANDEM_OK);
  while (asset_count > 0) tandem_asset_release(assets[--asset_count]);
  if (pairs != NULL) {
    CHECK_STATUS(tandem_contact_query_find_contacts_of_pairs(query, instances, count, pairs, pair_count, &options),
                 TANDEM_OK);
  } else {
    CHECK_STATUS(tandem_contact_query_find_contacts(query, instances, count, &options), TANDEM_OK);
  }
  size_t found_pairs = 0, found = 0;
  const tandem_object_pair* of = tandem_contact_query_pairs(query, &found_pairs);
  const tandem_contact* contacts = tandem_contact_query_contacts(query, &found);
  const uint64_t hash = hash_of(of, found_pairs, contacts, found);
  printf("%zu %zu %08x%08x\n", found_pairs, found, (unsigned)(hash >> 32), (unsigned)hash);
  tandem_contact_query_destroy(query);
  free(instances);
  free(pairs);
  free(motion);
  return failures != 0;
}
