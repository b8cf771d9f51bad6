#pragma once
#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <new>
#include <span>

#include "kernels/common/worker_threads.h"
#include "kernels/geometry/relative_pose.h"
#include "kernels/refit/deformed_tree.h"
#include "kernels/scene/dynamic_box_tree.h"
#include "kernels/scene/filter_columns.h"
#include "kernels/scene/near_pairs.h"
#include "kernels/scene/scene_device.h"
#include "tandem/kernels/broad_phase.h"
#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/scene.h"

// The state of a scene, as questions see it.
namespace tandem {

/// Bodies that a worker takes at a time: some microseconds of work.
inline constexpr std::size_t kBodiesAtOnce = 64;

/// An asset as questions look at it: the first level that its view shows.
struct SceneAsset {
  AssetView view;
  LevelView tree;
  TreeExtent extent;
  double grid;  ///< grid_of() the tree
  double origin[3];
  float lower[3], upper[3];
  double diagonal;                   ///< of the bounds
  DeformedTree* deformed = nullptr;  ///< whose level `tree` is; null: as in the file
  std::uint64_t shape = 0;           ///< another number after each deformation; 0: as in the file

  bool has_float32_corners() const { return tree.precise == nullptr; }
};

/// A body as the walks of trees see it.
struct PosedTree {
  LevelView tree;
  TreeExtent extent;
  double grid;       ///< grid_of() the tree
  Pose pose;         ///< of stored coordinates
  double error = 0;  ///< posed_level_error()
};

/// Owns what each worker of a question has for itself, and keeps it from call to call.
template <typename Worker>
class PerWorker {
 public:
  /// Makes room for so many where there are fewer, and forgets what was in those before then. False: out of
  /// memory, and there are none.
  [[nodiscard]] bool provide(std::size_t count) {
    if (count <= count_) return true;
    workers_.reset(new (std::nothrow) Slot[count]);
    count_ = workers_ != nullptr ? count : 0;
    return workers_ != nullptr;
  }
  std::size_t size() const { return count_; }
  Worker& operator[](std::size_t i) { return workers_[i].worker; }

 private:
  struct alignas(64) Slot : Allocated {
    Worker worker;
  };
  std::unique_ptr<Slot[]> workers_;
  std::size_t count_ = 0;
};

/// Adds what a worker counted.
template <typename Counters>
void add_to(Counters& sum, const Counters& part, std::initializer_list<std::uint64_t Counters::*> members) {
  for (const auto member : members) sum.*member += part.*member;
}

struct SceneState : Allocated {
  Buffer<SceneAsset> assets;
  std::uint64_t assets_id = 0;  // a number that no other list of assets of this process has
  std::uint64_t shapes_id = 0;  // the largest `shape` of these

  // By the bodies' numbers.
  Buffer<Instance> instances;
  Buffer<PosedTree> bodies;
  Buffer<WorldBox> boxes;
  FilterColumns columns;
  ExcludedPairs excluded;

  WorkerThreads own_threads;
  WorkerThreads* threads = &own_threads;  // those that work: its own, or threads that others use too
  std::uint32_t most_workers = 1;
  std::uint64_t where = 0;
  Buffer<ObjectPair> pairs;  // of Scene::find_pairs()

  std::unique_ptr<SceneDevice> device;  // that answers; null: the CPU does
  std::uint64_t version = 0;            // of the bodies and their filter: another after each change

  Status fail(Status status, std::uint64_t at) {
    where = at;
    return status;
  }

  PairFilter filter() const;

  /// Asks the device. Condition: there is one.
  template <typename... About>
  Status ask_device(About&&... about) {
    device->allocator = current_allocator();
    return device->find(*this, about...);
  }

  bool is_body(std::uint32_t i) const { return i < instances.size() && instances[i].asset != kNoIndex; }
  bool is_fixed(std::uint32_t i) const {
    return i < columns.motion.size() && columns.motion[i] == Motion::fixed;
  }
  /// An instance as the walks of trees see it, and its world box. Result: kOk, kUnknownAsset, kPoseNotRigid
  /// or kOutOfRange.
  Status posed(const Instance& instance, PosedTree& tree, WorldBox& box) const;

  const SceneAsset& asset_of(std::uint32_t body) const { return assets[instances[body].asset]; }

  ~SceneState() { forget_assets(); }

  /// Result: kOk, or kNoTopology where an asset has none.
  Status require_topology();

  /// Has the device take the fixed bodies anew, since it was asked about others meanwhile.
  void forget_fixed_on_device() { fixed_kept_ = false; }

  /// Result: kOk; or kDeformed where an asset is, or kNotFloat32 where the corners of one are no float32
  /// numbers.
  Status require_undeformed();
  Status require_float32_corners();

  /// Counts the workers to use: as many as are allowed, but no more than find something to do.
  std::uint32_t workers_for(std::size_t things, std::size_t at_once) const {
    const std::size_t parts = (things + at_once - 1) / at_once;
    return static_cast<std::uint32_t>(std::clamp<std::size_t>(parts, 1, most_workers));
  }

  /// The pairs of a question: the given ones, checked, or where `given` is null those that the scene finds.
  /// Result: as of Scene::find_pairs(); kUnknownInstance or kTooManyPairs.
  Status take_or_find_pairs(const std::span<const ObjectPair>* given, double reach, bool self_pairs,
                            Buffer<ObjectPair>& pairs);
  Status take_pairs(std::span<const ObjectPair> given, Buffer<ObjectPair>& pairs);

  // These functions are those of Scene.
  Status set_assets(std::span<const AssetView> views);
  template <typename Real>
  Status deform(std::uint32_t asset, std::span<const Real> positions);
  void forget_assets();
  Status place(std::span<const Instance> placed, const PairFilter& filter);
  Status add(const Instance& instance, const BodyFilter& filter, std::uint32_t& body);
  Status move(std::span<const std::uint32_t> numbers, std::span<const Pose> poses);
  Status set_motion(std::uint32_t body, Motion what);
  Status remove(std::uint32_t body);

 private:
  // The question that the list of found pairs answers.
  struct FoundPairs {
    bool valid = false;  // but for the bodies that changed since
    double reach = 0;
    bool self_pairs = false;
  };

  void forget_bodies();
  bool reserve_bodies(std::size_t count);
  void take_shape(std::uint32_t number, const float (&lower)[3], const float (&upper)[3]);
  bool stays_in_range(std::uint32_t asset, const float (&lower)[3], const float (&upper)[3]) const;
  Status pose(std::uint32_t body, const Instance& instance);
  Status pose_all(std::span<const Instance> placed, bool some_stand);
  void note_change(std::uint32_t body);
  Status set_filter(const PairFilter& filter);
  Status find_pairs(double reach, bool self_pairs);
  Status keep_fixed_bodies();
  /// Calls visit(body) for each that changed since pairs were found, ascending.
  template <typename Visit>
  void each_changed(const Visit& visit) const;
  bool few_changed() const;
  Status search_all();
  std::span<const WorldBox> asked_boxes() const {
    return (found_of_.reach > 0 ? reach_boxes_ : boxes).view();
  }
  bool near_pairs_hold(std::uint32_t workers);
  Status take_near_pairs();
  Status search_by_device();
  Status search_changed();
  Status follow_changed();
  template <typename Visit>
  void each_near(std::uint32_t body, const Visit& visit) const;
  WorldBox box_within_reach(std::uint32_t body) const;
  bool widen_boxes();

  BroadPhase broad_phase_;
  NearPairs near_;                 // of the motions, groups and masks that there are now
  Buffer<std::uint32_t> meeting_;  // how many of each part of the near pairs meet
  Buffer<WorldBox> reach_boxes_;   // larger, so that those within reach meet
  Buffer<ObjectPair> found_, fresh_;
  FoundPairs found_of_;
  Buffer<std::uint8_t> changed_;  // of each body: since pairs were found
  std::size_t changed_count_ = 0;
  DynamicBoxTree tree_;             // of asked_boxes(), where few change again and again
  std::size_t searched_alone_ = 0;  // bodies that were tested against all since there was a tree
  bool any_fixed_ = false;
  bool fixed_kept_ = false;  // the broad phase has a tree of the fixed bodies as they stand
  std::uint32_t removed_ = 0;
};

template <typename Row, typename Counters>
const DeviceMemory* Answer<Row, Counters>::on_device_of(const SceneState& scene) const {
  const bool is_there = scene.device != nullptr && memory_on_device_ != nullptr &&
                        memory_on_device_->assets_id == scene.assets_id;
  return is_there ? memory_on_device_.get() : nullptr;
}

}  // namespace tandem
