// Finds the contacts of a scene through the C interface and prints how many and their hash, by the rule of
// docs/scenes.md. With a tolerance: how many object pairs are apart, touch, and are within it. C99.
// Usage: scene_hash SCENE MODE FIRST_ONLY SELF_PAIRS WITHIN THREADS [TOLERANCE]
// SCENE: see scene_text.h.
#include "scene_text.h"

static void print_verdicts(tandem_scene* scene, double tolerance) {
  const tandem_tolerance_options options = {sizeof options, 0, tolerance, NULL, 0};
  CHECK_STATUS(tandem_scene_find_verdicts(scene, &options), TANDEM_OK);
  size_t found = 0, of[3] = {0, 0, 0};
  const tandem_verdict* verdicts = tandem_scene_verdicts(scene, &found);
  for (size_t i = 0; i < found; ++i) ++of[verdicts[i].verdict];
  printf("%zu %zu %zu\n", of[TANDEM_APART], of[TANDEM_TOUCH], of[TANDEM_WITHIN_TOLERANCE]);
}

int main(int argc, char** argv) {
  if (argc != 7 && argc != 8)
    return printf("usage: scene_hash SCENE MODE FIRST_ONLY SELF_PAIRS WITHIN THREADS [TOLERANCE]\n"), 1;
  Scene from = read_scene(argv[1]);
  const tandem_pair_filter filter = {sizeof filter, 0, from.count, from.motion, NULL, NULL, NULL};
  tandem_contact_options options = {.struct_size = sizeof options, .mode = (uint32_t)atoi(argv[2]),
                                    .first_contact_only = (uint32_t)atoi(argv[3]),
                                    .self_pairs = (uint32_t)atoi(argv[4]), .within = atof(argv[5]), .pairs = from.pairs, .pair_count
                                    = from.pair_count};
  tandem_scene* scene = scene_of(from.assets, from.asset_count, NULL);
  release_assets(&from);
  CHECK_STATUS(tandem_scene_set_threads(scene, (uint32_t)atoi(argv[6])), TANDEM_OK);
  CHECK_STATUS(tandem_scene_place(scene, from.instances, from.count, &filter), TANDEM_OK);
  if (argc == 8) print_verdicts(scene, atof(argv[7]));
  CHECK_STATUS(tandem_scene_find_contacts(scene, &options), TANDEM_OK);
  size_t found_pairs = 0, found = 0;
  const tandem_object_pair* of = tandem_scene_pairs(scene, TANDEM_CONTACTS, &found_pairs);
  const tandem_contact* contacts = tandem_scene_contacts(scene, &found);
  print_found(of, found_pairs, contacts, found);
  tandem_scene_destroy(scene);
  free_scene(&from);
  return failures != 0;
}
