// Writes what the C library of this machine answers, for tandem_test.mjs to compare byte for byte.
//   answers A.bvh B.bvh POSES OUT
// POSES: 24 float64 for each case, the rotations and translations of both bodies. OUT, for each case: contacts, manifolds, points and
// distances, each a count of 64 bits and the rows; then the counters of contacts.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tandem/tandem.h"

static void must(tandem_status status) {
  if (status == TANDEM_OK) return;
  fprintf(stderr, "answers: %s\n", tandem_status_explain(status));
  exit(1);
}

static void write_rows(FILE* out, const void* rows, size_t count, size_t bytes) {
  const uint64_t number = count;
  fwrite(&number, sizeof number, 1, out);
  if (count != 0) fwrite(rows, bytes, count, out);
}

static void answer(tandem_scene* scene, const double* poses, FILE* out) {
  tandem_instance bodies[2];
  memset(bodies, 0, sizeof bodies);
  for (uint32_t i = 0; i < 2; ++i) {
    bodies[i].asset = i;
    memcpy(&bodies[i].pose, poses + 12 * i, sizeof(tandem_pose));
  }
  must(tandem_scene_place(scene, bodies, 2, NULL));
  const tandem_object_pair pair = {0, 1};
  tandem_contact_options contacts = {sizeof contacts};
  tandem_distance_options distances = {sizeof distances};
  contacts.pairs = distances.pairs = &pair;
  contacts.pair_count = distances.pair_count = 1;
  must(tandem_scene_find_contacts(scene, &contacts));
  must(tandem_scene_find_manifolds(scene, NULL));
  must(tandem_scene_find_distances(scene, &distances));
  size_t count;
  const void* rows = tandem_scene_contacts(scene, &count);
  write_rows(out, rows, count, sizeof(tandem_contact));
  rows = tandem_scene_manifolds(scene, &count);
  write_rows(out, rows, count, sizeof(tandem_manifold));
  rows = tandem_scene_points(scene, &count);
  write_rows(out, rows, count, sizeof(tandem_manifold_point));
  rows = tandem_scene_distances(scene, &count);
  write_rows(out, rows, count, sizeof(tandem_distance));
  tandem_counters counters = {sizeof counters};
  must(tandem_scene_get_counters(scene, &counters));
  fwrite(&counters.contacts, sizeof counters.contacts, 1, out);
}

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  tandem_asset* assets[2];
  for (int i = 0; i < 2; ++i) must(tandem_asset_open(argv[1 + i], NULL, NULL, &assets[i], NULL));
  tandem_scene* scene;
  must(tandem_scene_create(NULL, &scene));
  must(tandem_scene_set_assets(scene, assets, 2));
  FILE* const in = fopen(argv[3], "rb");
  FILE* const out = fopen(argv[4], "wb");
  if (in == NULL || out == NULL) return 1;
  double poses[24];
  while (fread(poses, sizeof poses, 1, in) == 1) answer(scene, poses, out);
  tandem_scene_destroy(scene);
  for (int i = 0; i < 2; ++i) tandem_asset_release(assets[i]);
  fclose(in);
  return fclose(out) == 0 ? 0 : 1;
}
