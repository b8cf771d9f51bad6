// Finds the contacts of a scene through the C interface and prints how many and their hash, by the rule of
// docs/scenes.md. With a tolerance: how many object pairs are apart, touch, and are within it. C99.
// Usage: scene_hash SCENE MODE FIRST_ONLY SELF_PAIRS WITHIN THREADS [TOLERANCE]
// SCENE: see scene_text.h.
#include "scene_text.h"

static void print_verdicts(const Scene* scene, double tolerance, const tandem_query_options* from) {
  tandem_tolerance_options options = {sizeof options, from->threads, tolerance, from->filter};
  tandem_tolerance_query* query = NULL;
  CHECK_STATUS(tandem_tolerance_query_create(NULL, &query), TANDEM_OK);
  CHECK_STATUS(tandem_tolerance_query_set_assets(query, scene->assets, scene->asset_count), TANDEM_OK);
  CHECK_STATUS(tandem_tolerance_query_decide(query, scene->instances, scene->count, &options), TANDEM_OK);
  size_t found = 0, of[3] = {0, 0, 0};
  const tandem_verdict* verdicts = tandem_tolerance_query_verdicts(query, &found);
  for (size_t i = 0; i < found; ++i) ++of[verdicts[i].verdict];
  printf("%zu %zu %zu\n", of[TANDEM_APART], of[TANDEM_TOUCH], of[TANDEM_WITHIN_TOLERANCE]);
  tandem_tolerance_query_destroy(query);
}

int main(int argc, char** argv) {
  if (argc != 7 && argc != 8)
    return printf("usage: scene_hash SCENE MODE FIRST_ONLY SELF_PAIRS WITHIN THREADS [TOLERANCE]\n"), 1;
  Scene scene = read_scene(argv[1]);
  tandem_pair_filter filter;
  memset(&filter, 0, sizeof filter);
  filter.struct_size = sizeof filter;
  filter.count = scene.count;
  filter.motion = scene.motion;
  tandem_query_options options;
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.mode = (uint32_t)atoi(argv[2]);
  options.first_contact_only = (uint32_t)atoi(argv[3]);
  options.self_pairs = (uint32_t)atoi(argv[4]);
  options.within = atof(argv[5]);
  options.threads = (uint32_t)atoi(argv[6]);
  options.filter = &filter;
  if (argc == 8) print_verdicts(&scene, atof(argv[7]), &options);
  tandem_contact_query* query = NULL;
  CHECK_STATUS(tandem_contact_query_create(NULL, &query), TANDEM_OK);
  CHECK_STATUS(tandem_contact_query_set_assets(query, scene.assets, scene.asset_count), TANDEM_OK);
  release_assets(&scene);
  if (scene.pairs != NULL) {
    CHECK_STATUS(tandem_contact_query_find_contacts_of_pairs(query, scene.instances, scene.count, scene.pairs,
                                                             scene.pair_count, &options),
                 TANDEM_OK);
  } else {
    CHECK_STATUS(tandem_contact_query_find_contacts(query, scene.instances, scene.count, &options), TANDEM_OK);
  }
  size_t found_pairs = 0, found = 0;
  const tandem_object_pair* of = tandem_contact_query_pairs(query, &found_pairs);
  const tandem_contact* contacts = tandem_contact_query_contacts(query, &found);
  print_found(of, found_pairs, contacts, found);
  tandem_contact_query_destroy(query);
  free_scene(&scene);
  return failures != 0;
}
