#pragma once
#include <compare>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tandem/kernels/contact_query.h"

namespace tandem::simulation {

/// A body: its shape, by place in the list given to set_shapes(), and where it stands. The pose speaks of the
/// coordinates of the mesh file.
using BodyPose = Instance;

/// Two triangles that meet, of the bodies in row `pair`: LevelView::triangles[triangle_a] of its a's shape,
/// [triangle_b] of its b's.
struct TriangleContact {
  std::uint32_t pair, triangle_a, triangle_b;

  friend auto operator<=>(const TriangleContact&, const TriangleContact&) = default;
};

/// What an engine found. The same list from every exact engine, whatever its threads.
struct ContactList {
  std::vector<ObjectPair> pairs;           ///< bodies whose world boxes meet, a < b, sorted
  std::vector<TriangleContact> triangles;  ///< sorted, each once
};

/// Seconds that the phases of a call took.
struct EngineTimes {
  double update = 0;          ///< following the bodies: poses uploaded, world-space trees made or fitted
  double broad_phase = 0;     ///< pairs of bodies
  double traversal = 0;       ///< with the triangle tests where the engine does not tell them apart
  double triangle_tests = 0;  ///< 0 where they are part of traversal
  double transfer = 0;        ///< bringing the answer to the CPU, and sorting it

  double sum() const { return update + broad_phase + traversal + triangle_tests + transfer; }
};

/// Finds which triangles of which bodies meet, one step after the other. Throws std::runtime_error, with the
/// engine's name and the reason, where a call fails.
class CollisionEngine {
 public:
  virtual ~CollisionEngine() = default;

  /// Such as "tandem", as make_engine() knows it.
  virtual std::string_view name() const = 0;

  /// Names the shapes that bodies refer to. What the views look at must outlive the engine's use.
  virtual void set_shapes(std::span<const AssetView> shapes) = 0;

  /// Finds all pairs of triangles that meet. The number of bodies and their shapes may change from call to
  /// call; engines that keep something for each body then start anew. `idle`: empty, or for each body whether
  /// it does not move (1; else 0): pairs of two idle bodies are left out of both lists.
  virtual void find(std::span<const BodyPose> bodies, std::span<const std::uint8_t> idle,
                    ContactList& found) = 0;

  /// Of the last call. Counts that an engine does not keep are 0; object_pairs and contacts are always there.
  const EngineTimes& times() const { return times_; }
  const QueryCounters& counters() const { return counters_; }

 protected:
  EngineTimes times_;
  QueryCounters counters_;
};

struct EngineOptions {
  bool fast = false;          ///< triangles decided in float32, which may err where rounding does
  std::uint32_t threads = 1;  ///< of engines that have threads
};

/// Every engine there is a name for, built in or not: tandem, tandem-cuda, paper, paper-bits, fcl, embree,
/// embree-refit.
std::vector<std::string_view> engine_names();

/// Whether this program has it. Condition: one of engine_names().
bool is_built_in(std::string_view name);

/// Throws std::runtime_error: no engine of this name, one that is not built in, without a usable GPU, or one
/// that cannot do what the options ask for.
std::unique_ptr<CollisionEngine> make_engine(std::string_view name, const EngineOptions& options = {});

}  // namespace tandem::simulation
