#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/formats/status.h"
#include "tandem/formats/view.h"
#include "tandem/kernels/object_pair.h"
#include "tandem/kernels/pair_filter.h"
#include "tandem/kernels/pose.h"
#include "tandem/kernels/world_box.h"

namespace tandem {

/// A body and its place. The asset is known by its place in the list given to Scene::set_assets(); the pose
/// applies to the file's coordinates.
struct Instance {
  std::uint32_t asset;
  Pose pose;
};

/// The entries of one body in the arrays of a PairFilter.
struct BodyFilter {
  Motion motion = Motion::moving;
  std::uint32_t group = ~std::uint32_t{0}, mask = ~std::uint32_t{0};
  std::uint32_t world = kEveryWorld;
};

inline constexpr std::uint32_t kMostSceneThreads = 1024;

struct SceneState;

/// A device that answers the questions of a scene in place of the CPU; see GpuScene.
class SceneDevice;

/// Destroys a device that no scene owns; null too.
void destroy(SceneDevice* device);

/// Bodies, of which any number of questions can be asked, on the CPU: contacts, manifolds, distances and so
/// on. The scene owns the instances, their motions and groups, their world boxes, the broad phase, the
/// threads and the memory of these. It checks each pose once, when a body is placed or moved, and finds the
/// object pairs once for all questions of one reach. It keeps its memory from call to call: in a steady state
/// nothing is allocated. Throws nothing. Movable, not copyable. One call at a time; several scenes may be
/// used side by side. Rounds to nearest and keeps subnormals: the floating-point environment that every
/// thread starts with.
///
/// A body is known by its number: its place in the list given to place(), or what add() returned. A number
/// stays that of its body; that of a removed body is used again by add().
class Scene {
 public:
  Scene();
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;
  ~Scene();

  /// Sets how many threads a call may use, the caller's included, from 1 (the default) to kMostSceneThreads.
  /// No result depends on it. Result: kOk; kBadOption for another number, or kOutOfMemory, and nothing has
  /// changed.
  Status set_threads(std::uint32_t threads);

  /// Names the assets that instances refer to. Questions look at the first level that each view shows
  /// (AssetView::levels_from()); ToleranceQuery looks at all. What the views point to must outlive the
  /// questions. There are no bodies afterwards. Result: kOk; kUnknownAsset where a view points to nothing,
  /// and where() is its place in the list; or kOutOfMemory. After an error there are no assets.
  Status set_assets(std::span<const AssetView> assets);

  /// Gives the vertices of an asset other positions, as often as the caller likes: all its bodies take the
  /// shape of the triangles between these. (A body that bends alone gets an entry of its own in the list of
  /// assets, where a view may stand several times.) Questions are then about these positions, posed as usual,
  /// and all that are offered decide as exactly as for rigid bodies: all but ToleranceQuery (kDeformed), and,
  /// where some coordinate is no float32 number, but those about manifolds, containment and impacts
  /// (kNotFloat32). The other levels that the view shows are not looked at.
  ///
  /// positions: x, y, z of each source vertex, in the file's coordinates: as many as
  /// FileHeader::source_vertices, in the order of the vertices that the asset was built from. They are
  /// copied. Takes time and, the first time, memory in proportion to the triangles, and checks the bodies'
  /// poses as place() does. Result: kOk; kUnknownAsset; kNoSourceVertices, where the file has none
  /// (FORMAT.md); kVertexCountMismatch; kOutOfRange, where where() is the first vertex with a coordinate that
  /// is NaN or beyond kMaxCoordinate, or the number of vertices where a body then reaches beyond
  /// kLargestWorldCoordinate; or kOutOfMemory. After an error nothing has changed.
  Status deform(std::uint32_t asset, std::span<const float> positions);
  Status deform(std::uint32_t asset, std::span<const double> positions);

  /// Says how much looser the tree of a deformed asset is than as it was built: the surface of its inner
  /// boxes by that of the box around all of them, divided by the same of the file's tree. Above 1.75 queries
  /// most likely look at 1.2 times as many block pairs as in a tree that is built for the positions
  /// (docs/deformables.md), so a new one (tandem::build()) may pay. 1 where the asset is not deformed.
  double looseness(std::uint32_t asset) const;

  /// Places all bodies anew; those that stand as before cost next to nothing. The scene copies the arrays of
  /// the filter, each of which has an entry for each body; the table of excluded pairs must stay until the
  /// scene is given another filter. Pairs of two fixed bodies are not looked at, and a tree of the fixed
  /// bodies is kept until one of them moves or others are fixed. Result: kOk; kUnknownAsset, kPoseNotRigid or
  /// kOutOfRange (beyond kLargestWorldCoordinate), where where() is the instance; kUnknownInstance, where
  /// where() is the filter's excluded pair that names a body that does not exist; kTooManyInstances,
  /// kOutOfMemory or kCannotStartThread. After an error there are no bodies.
  Status place(std::span<const Instance> instances, const PairFilter& filter = {});

  /// Makes this a scene of one body, the asset at the identity, for questions about the asset alone. Result:
  /// as of set_assets() and place().
  Status place_alone(const AssetView& asset) {
    const Status status = set_assets({&asset, 1});
    const Instance instance = {0, kIdentityPose};
    return status == Status::kOk ? place({&instance, 1}) : status;
  }

  /// Adds a body; `body` becomes its number, the lowest that is free. Result: as of place(). After an error
  /// nothing has changed.
  Status add(const Instance& instance, std::uint32_t& body, const BodyFilter& filter = {});

  /// Moves bodies. Result: as of place(), where where() is the place in these lists; kUnknownInstance where a
  /// body does not exist; kMotionMismatch where the lists differ in length. After an error nothing has
  /// changed.
  Status move(std::span<const std::uint32_t> bodies, std::span<const Pose> poses);
  Status move(std::uint32_t body, const Pose& pose);

  /// Changes what moves a body. Result: kOk, kUnknownInstance or kOutOfMemory.
  Status set_motion(std::uint32_t body, Motion motion);

  /// Removes a body: no question finds it any more. Result: kOk or kUnknownInstance.
  Status remove(std::uint32_t body);

  /// Finds the object pairs whose world boxes overlap, or are within reach of each other or a little beyond,
  /// so that the caller can leave some out before asking a question of them. self_pairs: also each body with
  /// itself. Result: kOk; kBadReach where reach is negative or NaN; kTooManyPairs, kOutOfMemory or
  /// kCannotStartThread. After an error there are no pairs.
  Status find_pairs(double reach = 0, bool self_pairs = false);

  /// The pairs of the last find_pairs(), a < b, or a = b for self pairs, sorted. Valid until the next call of
  /// the scene or question about it.
  std::span<const ObjectPair> pairs() const;

  /// Returns all bodies by number; a removed one has asset kNoIndex. Valid until bodies are placed or added.
  std::span<const Instance> instances() const;

  /// The asset, instance, pair or contact that is to blame for the last error of this scene or of a question
  /// asked of it; 0 where the status alone says what is wrong.
  std::uint64_t where() const;

  /// Has a device answer the questions, of a scene that has no assets yet. The scene owns the device; after
  /// an error it is destroyed. Result: kOk, kOutOfMemory, where it may be that there is no device, or
  /// kUnsupportedVersion, where it comes from a library of another version.
  Status answer_on(SceneDevice* device);

  /// Returns the state that questions look at, or null where there is no memory for it.
  SceneState* state();

 private:
  std::unique_ptr<SceneState> state_;
};

}  // namespace tandem
