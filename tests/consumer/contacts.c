#include <stdio.h>
#include <tandem/tandem.h>

/* Two bodies half a length apart: how many of their triangles meet. */
int main(int argc, char** argv) {
  tandem_asset* asset = NULL;
  tandem_scene* scene = NULL;
  const tandem_instance bodies[2] = {{0, 0, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.0, 0, 0}}},
                                     {0, 0, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.5, 0, 0}}}};
  tandem_status status = tandem_asset_open(argc > 1 ? argv[1] : "", NULL, NULL, &asset, NULL);
  if (status == TANDEM_OK) status = tandem_scene_create(NULL, &scene);
  if (status == TANDEM_OK) status = tandem_scene_set_assets(scene, &asset, 1);
  if (status == TANDEM_OK) status = tandem_scene_place(scene, bodies, 2, NULL);
  if (status == TANDEM_OK) status = tandem_scene_find_contacts(scene, NULL);
  if (status == TANDEM_OK) {
    size_t count;
    const tandem_contact* contacts = tandem_scene_contacts(scene, &count);
    printf("%zu pairs of triangles meet", count);
    if (count > 0)
      printf(", such as faces %u and %u", (unsigned)contacts[0].face_a, (unsigned)contacts[0].face_b);
    printf("\n");
  } else {
    printf("%s\n", tandem_status_explain(status));
  }
  tandem_scene_destroy(scene);
  tandem_asset_release(asset);
  return status != TANDEM_OK;
}
