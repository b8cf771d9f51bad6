#include "peer.h"

#include <box3d/box3d.h>
#include <stdio.h>
#include <stdlib.h>

enum { kSubsteps = 4 };  // Box3D's documentation advises 4 at 60 Hz

static b3WorldId world;
static b3BodyId* ids;
static long body_count;

static b3Vec3 vector(const double* from) { return (b3Vec3){(float)from[0], (float)from[1], (float)from[2]}; }

const char* peer_version(void) {
  static char text[32];
  const b3Version version = b3GetVersion();
  snprintf(text, sizeof text, "%d.%d.%d", version.major, version.minor, version.revision);
  return text;
}
const char* peer_settings(void) { return "4 substeps"; }

static void add_shape(b3BodyId id, const struct PeerBody* body) {
  b3ShapeDef shape = b3DefaultShapeDef();
  shape.baseMaterial.friction = (float)body->friction;
  shape.density = (float)body->density;
  if (body->half[0] > 0) {
    const b3BoxHull box = b3MakeBoxHull((float)body->half[0], (float)body->half[1], (float)body->half[2]);
    b3CreateHullShape(id, &shape, &box.base);
    return;
  }
  b3Vec3* points = malloc((size_t)body->point_count * sizeof(b3Vec3));
  for (long i = 0; i < body->point_count; ++i) points[i] = vector(body->points + 3 * i);
  b3HullData* hull = b3CreateHull(points, (int)body->point_count, (int)body->point_count);
  b3CreateHullShape(id, &shape, hull);
  b3DestroyHull(hull);
  free(points);
}

void peer_create(double gravity, const struct PeerBody* bodies, long count) {
  if (ids) b3DestroyWorld(world);
  b3WorldDef definition = b3DefaultWorldDef();
  definition.gravity = (b3Vec3){0, 0, -(float)gravity};
  definition.enableSleep = false;
  definition.workerCount = 1;
  world = b3CreateWorld(&definition);
  body_count = count;
  ids = realloc(ids, (size_t)count * sizeof(b3BodyId));
  for (long i = 0; i < count; ++i) {
    const struct PeerBody* body = bodies + i;
    b3BodyDef made = b3DefaultBodyDef();
    made.type = body->density > 0 ? b3_dynamicBody : b3_staticBody;
    made.position = (b3Pos){(float)body->position[0], (float)body->position[1], (float)body->position[2]};
    made.rotation = (b3Quat){vector(body->quaternion), (float)body->quaternion[3]};
    made.linearVelocity = vector(body->velocity);
    made.angularVelocity = vector(body->angular_velocity);
    ids[i] = b3CreateBody(world, &made);
    add_shape(ids[i], body);
  }
}

void peer_step(double seconds) { b3World_Step(world, (float)seconds, kSubsteps); }

void peer_positions(double* positions) {
  for (long i = 0; i < body_count; ++i) {
    const b3Pos at = b3Body_GetPosition(ids[i]);
    positions[3 * i] = at.x, positions[3 * i + 1] = at.y, positions[3 * i + 2] = at.z;
  }
}
