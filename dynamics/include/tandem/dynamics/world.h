#pragma once
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "tandem/dynamics/material.h"
#include "tandem/kernels/scene.h"

namespace tandem {

/// A body as it enters a world. Lengths are metres, masses kilograms, times seconds, angles radians.
struct BodyDescription {
  std::uint32_t asset = 0;    ///< by place in the list given to World::set_assets()
  Pose pose = kIdentityPose;  ///< of the file's coordinates
  BodyFilter filter;          ///< its motion, and what it may meet; a sleeping body starts awake
  double density = 1000;  ///< of a moving body: its mass is that of what the mesh encloses, or of a shell of
                          ///< 1/100 of its diagonal where it is open
  double velocity[3] = {};  ///< of its centre of mass; a kinematic body keeps its velocities
  double angular_velocity[3] = {};
  Material material;
  double gravity_scale = 1;  ///< part of the world's gravity that acts on it; 0: it floats
};

/// The place of a body, and how it moves.
struct BodyMotion {
  Pose pose;           ///< of the file's coordinates
  double centre[3];    ///< of mass, in the world; of a fixed body the origin of its file's coordinates
  double velocity[3];  ///< of the centre
  double angular_velocity[3];  ///< in the world
  bool sleeps;  ///< it rests with all that it touches, and is not looked at until it is touched
};

/// A point where two bodies touch, or nearly so, and what they did there in the last step.
struct WorldContact {
  std::uint32_t a, b;  ///< bodies, a < b
  double position[3];
  double normal[3];   ///< unit, from a towards b
  double depth;       ///< along the normal; less than 0 of a gap
  double impulse[3];  ///< on b, friction included; on a the opposite one. Newton seconds
};

/// Two bodies that touch, and how hard.
struct WorldTouch {
  std::uint32_t a, b;  ///< a < b
  double impulse;  ///< by which they push each other apart in a step: the sum over their contacts of those
                   ///< along the normals. Newton seconds
  double speed;    ///< at which they approach each other at the start of the step, the largest of their
                   ///< contacts along its normal; 0 where they part
  double position[3];  ///< of the contact that pushes hardest, or of the deepest where none pushes
};

/// Says how a joint lets body b move against body a.
enum class JointKind : std::uint8_t {
  ball,      ///< turns about the anchor
  hinge,     ///< turns about an axis through the anchor: by an angle, right-handed
  slider,    ///< moves along the axis: by a way
  fixed,     ///< not at all
  distance,  ///< its anchor keeps a distance from a's, between bounds: a rod, or a rope
};

/// A joint as it enters a world: two bodies, of which at least one moves, joined as they are placed. Anchors
/// and axes are those of the world at that time, and the bodies carry them along.
struct JointDescription {
  JointKind kind = JointKind::ball;
  std::uint32_t a = kNoIndex, b = kNoIndex;  ///< bodies; kNoIndex: the world
  double anchor[3] = {};                     ///< where they are joined; of a distance, the point of a
  double anchor_b[3] = {};                   ///< of a distance alone: the point of b
  double axis[3] = {0, 0, 1};                ///< of a hinge or slider: of any length
  /// Bounds of the angle or way, which are 0 as the bodies are placed; or of a distance, where none means
  /// that it stays what it is. Balls and fixed joints have none.
  double least = -std::numeric_limits<double>::infinity(), most = std::numeric_limits<double>::infinity();
  double speed = 0;        ///< that the motor of a hinge or slider drives b at, against a
  double most_effort = 0;  ///< its greatest torque or force; 0: there is no motor
  /// The mean force or torque in a step beyond which it lets go at the end of the step, its motor and limits
  /// included: about b's anchor, in newtons and newton metres.
  double breaking_force = std::numeric_limits<double>::infinity(),
         breaking_torque = std::numeric_limits<double>::infinity();
  bool may_touch = false;  ///< the two bodies have contacts with each other
};

/// What a joint did in the last step, and where it is.
struct WorldJoint {
  double position;      ///< angle, which counts whole turns, way, or distance; 0 of others
  double speed;         ///< by which it changes
  double impulse[3];    ///< on b at its anchor, on a the opposite one, in the world. Newton seconds
  double turning[3];    ///< the same of torques. Newton metre seconds
  double motor_effort;  ///< mean torque or force of the motor in the step, along the axis on b
  bool holds;           ///< false: it has broken, or been removed
};

struct WorldOptions {
  double gravity[3] = {0, 0, -9.81};
  double friction = 0.5;   ///< Coulomb's coefficient; as the next and rolling resistance, of bodies whose
                           ///< material says nothing
  double restitution = 0;  ///< part of the speed that an impact gives back, 0 to 1
  double slop = -1;        ///< overlap that is left alone; less than 0: 1/4000 of the least diagonal of
                           ///< an asset of a moving body
  double rolling_resistance = -1;  ///< lever at which the force between two bodies resists that they turn
                                   ///< against each other; less than 0: 16 slops
  std::uint32_t substeps = 16;     ///< parts of a step that share its contacts, from 1 to 10,000
  bool sleeping = true;            ///< bodies that rest with all that they touch are left alone
  bool continuous = false;         ///< fast bodies are carried to where they first meet others
  std::uint32_t threads = 1;       ///< from 1 to kMostSceneThreads; no result depends on it
};

/// Rigid bodies of meshes that move under gravity, contacts and joints. Contacts are those of ContactQuery
/// and ManifoldQuery, exact for any mesh; docs/dynamics.md says how they are solved and what holds. Throws
/// nothing. Movable, not copyable. One call at a time; several worlds may be used side by side. The same
/// calls give the same bytes, for any number of threads.
class World {
 public:
  World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;
  ~World();

  /// Names the assets that bodies refer to. What the views look at must outlive the world's use. There are no
  /// bodies afterwards. Result: as of Scene::set_assets().
  Status set_assets(std::span<const AssetView> assets);

  /// Places all bodies anew, at time 0. excluded: pairs that are not to meet. Result: kOk; as of
  /// Scene::place(), and where() is the body; kOutOfRange where a velocity is beyond 1e10 along an axis, a
  /// mass is not from 1e-30 to 1e30 kg, a gravity_scale is beyond 1e6, or a number of the material is larger
  /// than WorldOptions may have; kNoTopology where its mesh has none, and
  /// kNoMass where it has no extent or the density is not positive, of a moving body; kBadOption, where
  /// where() is 0: an option is out of its range; kOutOfMemory. Of a joint, where where() is its place in the
  /// list: kUnknownInstance, kBadJoint, kNoAxis, kJoinsNothing. After an error there are no bodies.
  Status set_bodies(std::span<const BodyDescription> bodies, const WorldOptions& options = {},
                    std::span<const ObjectPair> excluded = {}, std::span<const JointDescription> joints = {});

  /// Makes steps of dt seconds. Result: kOk; kBadDuration where dt is not more than 0 or more than 1000;
  /// kOutOfRange where a body has left the range of numbers that questions take or has become faster than
  /// set_bodies() allows, and where() is the body; kOutOfMemory. After an error bodies are as after the last
  /// step that was whole, and there are no contacts.
  Status step(double dt, std::uint32_t steps = 1);

  /// Makes more steps, which began(), ended() and broken() take for steps of the last call of step(). Result:
  /// as of step().
  Status step_more(double dt, std::uint32_t steps = 1);

  /// The bodies as they are now. Valid until the next call.
  std::span<const BodyMotion> bodies() const;

  /// The contacts that the last step solved, by ascending pair of bodies; not those of two sleeping bodies.
  /// Valid until the next call.
  std::span<const WorldContact> contacts() const;

  /// Return pairs of bodies, ascending. touching: those that touch in the last step: at its start they had a
  /// contact that is no gap, or one of their contacts pushed in it. Two bodies that sleep go on as they were.
  /// began, ended: those that came to touch, or to touch no longer, in any of the steps of the last call of
  /// step(); a pair that bounced in the call is in both. Pairs of began have the numbers of
  /// the step of the call, from when they began to touch, in which they pushed hardest, and the largest
  /// speed: an impact often takes two steps, the first of which lets the bodies come as far as they meet.
  /// touching() less began() have touched all along, but for pairs that are in ended() too. Valid until the
  /// next call; restore() leaves began and ended empty.
  std::span<const WorldTouch> touching() const;
  std::span<const WorldTouch> began() const;
  std::span<const ObjectPair> ended() const;

  /// What the joints did in the last step, in the order given to set_bodies(), and then to add_joint(). Valid
  /// until the next call.
  std::span<const WorldJoint> joints() const;

  /// Returns the joints that broke in any of the steps of the last call of step(), ascending; see
  /// JointDescription. A broken joint keeps its place in the list until it is removed, and its bodies may
  /// touch from the next step on. Valid until the next call; restore() leaves it empty.
  std::span<const std::uint32_t> broken() const;

  /// Joins bodies as they are now, and wakes them. joint: its place in joints(), the first from which a joint
  /// has been removed, or else one at the end. Result: kOk; kUnknownInstance, kBadJoint, kNoAxis,
  /// kJoinsNothing; kOutOfMemory. After an error nothing has changed.
  Status add_joint(const JointDescription& description, std::uint32_t& joint);

  /// Removes a joint, broken or not, and wakes the bodies. Others keep their places. Result: kOk; kBadJoint
  /// where there is none; kOutOfMemory.
  Status remove_joint(std::uint32_t joint);

  /// Gives the motor of a hinge or slider another speed and greatest effort, see JointDescription, and wakes
  /// the bodies. Result: kOk; kBadJoint, also of a joint that has broken.
  Status set_motor(std::uint32_t joint, double speed, double most_effort);

  /// Returns the seconds of all steps since set_bodies().
  double time() const;

  /// Returns the body's mass; 0 of one that contacts do not move.
  double mass_of(std::uint32_t body) const;

  /// Puts a body elsewhere or gives it other velocities, and wakes it; `sleeps` and `centre` are not looked
  /// at. A fixed or kinematic body wakes what touches it or is joined to it, there and at its new place; a
  /// fixed one has no velocities. Result: kOk; kUnknownInstance; kPoseNotRigid; kOutOfRange where a number is
  /// not finite or a velocity beyond 1e10; kOutOfMemory.
  Status set(std::uint32_t body, const BodyMotion& motion);

  /// Gives a body another material, or lets another part of gravity act on it, from the next step on; save()
  /// keeps both. Where that is not what it was, the body wakes, and of a fixed or kinematic body what touches
  /// it or is joined to it. Result: kOk; kUnknownInstance; kOutOfRange of numbers that set_bodies() refuses.
  Status set_material(std::uint32_t body, const Material& material);
  Status set_gravity_scale(std::uint32_t body, double gravity_scale);

  /// Adds to a moving body's velocities what an impulse at a point of the world does, and wakes it. Result:
  /// kOk; kUnknownInstance; kOutOfRange where a number is not finite or a velocity becomes
  /// larger than 1e10.
  Status push(std::uint32_t body, const double (&impulse)[3], const double (&at)[3]);

  /// Sets a force that acts on a moving body's centre of mass in all steps from now on, in newtons, and a
  /// torque about it, in newton metres, both along the world's axes, in place of those before. They are 0 at
  /// the start, and save() keeps them. Wakes the body where they are not what they were. Result: kOk;
  /// kUnknownInstance; kOutOfRange where a number is not finite or the acceleration of a point beyond 1e10.
  Status set_force(std::uint32_t body, const double (&force)[3], const double (&torque)[3]);

  /// Keeps all that the next steps depend on, and goes back to it. restore() takes what save() of this world
  /// made since its bodies were placed. Result: kOk; kKeptMismatch of another state; kOutOfMemory.
  class State;
  Status save(std::shared_ptr<const State>& state) const;
  Status restore(const State& state);

  /// The asset or body to blame for the last error; 0 where the status alone says what is wrong.
  std::uint64_t where() const;

 private:
  struct Parts;
  template <typename Change>
  Status change(std::uint32_t body, const Change& change);
  Status fail(Status status, std::uint64_t where = 0) const;
  std::unique_ptr<Parts> parts_;
};

}  // namespace tandem
