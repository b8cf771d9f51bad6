#include <stdio.h>
#include <tandem/tandem.h>

/* A game loop: a box falls on a fixed one, is kicked once it lies there, and falls off. */
int main(int argc, char** argv) {
  tandem_asset* box = NULL;
  tandem_world* world = NULL;
  const tandem_instance bodies[2] = {{0, 0, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}},
                                     {0, 0, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.2, 0, 2}}}};
  const uint8_t motion[2] = {TANDEM_FIXED, TANDEM_MOVING};
  const tandem_pair_filter filter = {sizeof filter, 0, 2, motion, NULL, NULL, NULL, NULL};
  tandem_status status = tandem_asset_open(argc > 1 ? argv[1] : "", NULL, NULL, &box, NULL);
  if (status == TANDEM_OK) status = tandem_world_create(NULL, NULL, &world);
  if (status == TANDEM_OK) status = tandem_world_set_assets(world, &box, 1);
  if (status == TANDEM_OK) status = tandem_world_set_bodies(world, bodies, 2, &filter, NULL);
  for (int frame = 0, kicks = 0; status == TANDEM_OK && frame < 240; ++frame) {
    status = tandem_world_step(world, 1.0 / 60, 1);
    if (status != TANDEM_OK) break;
    const tandem_body_motion* body = &tandem_world_bodies(world, NULL)[1]; /* to be drawn */
    if (body->sleeps && kicks++ == 0) {
      const double impulse[3] = {4 * tandem_world_mass(world, 1), 0, 0};
      printf("it lies %.2f m high\n", body->centre[2]);
      status = tandem_world_push(world, 1, impulse, body->centre);
    } else if (body->centre[2] < -5) {
      printf("it has fallen off\n");
      break;
    }
  }
  if (status != TANDEM_OK) printf("%s\n", tandem_status_explain(status));
  tandem_world_destroy(world);
  tandem_asset_release(box);
  return status != TANDEM_OK;
}
