#include "peer.h"

#include <Jolt/Jolt.h>

#include <Jolt/Core/Factory.h>
#include <Jolt/Core/JobSystemSingleThreaded.h>
#include <Jolt/Core/TempAllocator.h>
#include <Jolt/Physics/Body/BodyCreationSettings.h>
#include <Jolt/Physics/Collision/BroadPhase/BroadPhaseLayerInterfaceTable.h>
#include <Jolt/Physics/Collision/BroadPhase/ObjectVsBroadPhaseLayerFilterTable.h>
#include <Jolt/Physics/Collision/ObjectLayerPairFilterTable.h>
#include <Jolt/Physics/Collision/Shape/BoxShape.h>
#include <Jolt/Physics/Collision/Shape/ConvexHullShape.h>
#include <Jolt/Physics/PhysicsSystem.h>
#include <Jolt/RegisterTypes.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

using namespace JPH;

namespace {

constexpr ObjectLayer kFixed = 0, kMoving = 1;
constexpr uint kMostBodies = 65536, kMostPairs = 65536, kMostContacts = 65536;
constexpr uint kBytesOfStep = 256 << 20;

struct Setup {
  Setup() {
    RegisterDefaultAllocator();
    Factory::sInstance = new Factory;
    RegisterTypes();
  }
};

struct World {
  World() {
    pairs.EnableCollision(kFixed, kMoving);
    pairs.EnableCollision(kMoving, kMoving);
    layers.MapObjectToBroadPhaseLayer(kFixed, BroadPhaseLayer(0));
    layers.MapObjectToBroadPhaseLayer(kMoving, BroadPhaseLayer(1));
    against_layers = std::make_unique<ObjectVsBroadPhaseLayerFilterTable>(layers, 2, pairs, 2);
    system.Init(kMostBodies, 0, kMostPairs, kMostContacts, layers, *against_layers, pairs);
    PhysicsSettings settings;
    settings.mAllowSleeping = false;
    system.SetPhysicsSettings(settings);
  }

  ObjectLayerPairFilterTable pairs{2};
  BroadPhaseLayerInterfaceTable layers{2, 2};
  std::unique_ptr<ObjectVsBroadPhaseLayerFilterTable> against_layers;
  TempAllocatorImpl memory{kBytesOfStep};
  JobSystemSingleThreaded jobs{cMaxPhysicsJobs};
  PhysicsSystem system;
  std::vector<BodyID> bodies;
};

std::unique_ptr<World> world;

Vec3 vector(const double* from) {
  return Vec3(static_cast<float>(from[0]), static_cast<float>(from[1]), static_cast<float>(from[2]));
}

ShapeRefC shape_of(const PeerBody& body) {
  const float density = body.density > 0 ? static_cast<float>(body.density) : 1;
  if (body.half[0] > 0) {
    const Vec3 half = vector(body.half);
    BoxShapeSettings box(half, std::min(cDefaultConvexRadius, half.ReduceMin()));
    box.SetEmbedded();
    box.SetDensity(density);
    return box.Create().Get();
  }
  Array<Vec3> points;
  for (long i = 0; i < body.point_count; ++i) points.push_back(vector(body.points + 3 * i));
  ConvexHullShapeSettings hull(points);
  hull.SetEmbedded();
  hull.SetDensity(density);
  return hull.Create().Get();
}

}  // namespace

const char* peer_version() {
  static const std::string text = std::to_string(JPH_VERSION_MAJOR) + "." +
                                  std::to_string(JPH_VERSION_MINOR) + "." + std::to_string(JPH_VERSION_PATCH);
  return text.c_str();
}
const char* peer_settings() {
  return "10 velocity and 2 position iterations; no damping";
}

void peer_create(double gravity, const PeerBody* bodies, long count) {
  static const Setup setup;
  world = nullptr;
  world = std::make_unique<World>();
  world->system.SetGravity(Vec3(0, 0, -static_cast<float>(gravity)));
  BodyInterface& made = world->system.GetBodyInterface();
  for (const PeerBody* body = bodies; body < bodies + count; ++body) {
    const bool moves = body->density > 0;
    const double* q = body->quaternion;
    const Quat turned(static_cast<float>(q[0]), static_cast<float>(q[1]), static_cast<float>(q[2]),
                      static_cast<float>(q[3]));
    BodyCreationSettings settings(shape_of(*body), RVec3(vector(body->position)), turned.Normalized(),
                                  moves ? EMotionType::Dynamic : EMotionType::Static,
                                  moves ? kMoving : kFixed);
    settings.mFriction = static_cast<float>(body->friction);
    settings.mLinearDamping = settings.mAngularDamping = 0;
    settings.mLinearVelocity = vector(body->velocity);
    settings.mAngularVelocity = vector(body->angular_velocity);
    world->bodies.push_back(
        made.CreateAndAddBody(settings, moves ? EActivation::Activate : EActivation::DontActivate));
  }
  world->system.OptimizeBroadPhase();
}

void peer_step(double seconds) {
  world->system.Update(static_cast<float>(seconds), 1, &world->memory, &world->jobs);
}

void peer_positions(double* positions) {
  const BodyInterface& bodies = world->system.GetBodyInterfaceNoLock();
  for (const BodyID id : world->bodies) {
    const RVec3 at = bodies.GetPosition(id);
    for (int k = 0; k < 3; ++k) *positions++ = at[k];
  }
}
