#pragma once
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/stopwatch.h"
#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/manifold.h"

namespace tandem {

/// A body: its shape, by place in the list given to set_shapes(), and where it stands. The pose speaks of the
/// coordinates of the mesh file.
using BodyPose = Instance;

/// Two triangles that meet, of the bodies in row `pair` of the pairs that were asked about:
/// LevelView::triangles[triangle_a] of its a's shape, [triangle_b] of its b's.
struct TriangleContact {
  std::uint32_t pair, triangle_a, triangle_b;

  friend auto operator<=>(const TriangleContact&, const TriangleContact&) = default;
};

/// What a step of a simulation asks for. Every exact engine gives the same list, whatever its threads.
struct ContactList {
  std::vector<ObjectPair> pairs;           ///< bodies whose world boxes meet, a < b, sorted
  std::vector<TriangleContact> triangles;  ///< sorted, each once
};

/// Seconds that the phases of Engine::find() took.
struct EngineTimes {
  double update = 0;          ///< following the bodies: poses uploaded, world-space trees made or fitted
  double broad_phase = 0;     ///< pairs of bodies
  double traversal = 0;       ///< with the triangle tests where the engine does not tell them apart
  double triangle_tests = 0;  ///< 0 where they are part of traversal
  double transfer = 0;        ///< bringing the answer to the CPU, and sorting it

  double sum() const { return update + broad_phase + traversal + triangle_tests + transfer; }
};

/// The order of contacts in GPU memory: any, pair by pair, or, of pairs too, as a contacts file has it.
enum class OrderOnGpu : std::uint8_t { any, grouped, sorted };

/// What `bvhbench query` asks for.
struct TimedQuery {
  const std::vector<ObjectPair>* given = nullptr;  ///< normalised; null: the engine finds the pairs
  std::uint32_t repeats = 1;
  OrderOnGpu order = OrderOnGpu::any;  ///< on a GPU
  bool traversal = false;              ///< on a GPU: the walk of the trees is timed alone too
  bool manifolds = false;              ///< contact manifolds are made of what each repeat finds, and timed
};

/// What an engine takes of a GPU.
struct GpuUse {
  std::string name;  ///< of the device
  double upload =
      0;  ///< seconds from mapped files to what a query takes: shapes and bodies, allocation included
  std::size_t bytes = 0;        ///< shapes, bodies, and the room of both steps
  std::size_t bytes_bound = 0;  ///< what the rule of docs/gpu.md says they are at most; 0: there is no rule
  std::size_t bytes_taken = 0;  ///< by the driver's count; what CUDA keeps for kernels included
};

/// Contact manifolds of what a timed query found, in the order of ManifoldQuery. Their ids are those of
/// the features.
struct TimedManifolds {
  std::vector<Manifold> manifolds;
  std::vector<ManifoldPoint> points;
  ManifoldCounters counters;
  Seconds seconds;  ///< of each repeat, beside the query's
};

/// What a timed query found, and how long that took.
struct TimedAnswer {
  std::vector<ObjectPair> pairs;          ///< sorted
  std::vector<TriangleContact> contacts;  ///< in no order
  Seconds whole;                          ///< both steps, and what it takes to start them
  Seconds broad_phase, narrow;            ///< the two steps where they are timed apart, as on a GPU
  Seconds traversal;                      ///< the walk of the same pairs, without triangle tests
  TimedManifolds manifolds;               ///< where they were asked for
  GpuUse gpu;                             ///< of engines on a GPU
};

/// A number that an engine counts, and its name.
using Counter = std::pair<std::string, std::uint64_t>;

/// A call of an engine failed; what() says which engine, the body to blame where there is one, and why.
struct EngineError : std::runtime_error {
  EngineError(const std::string& what, Status why, std::uint64_t blamed)
      : std::runtime_error(what), status(why), where(blamed) {}

  Status status;
  std::uint64_t where;  ///< the body or pair to blame, where subject(status) names one of these
};

/// No GPU can be used, it has too little memory, or CUDA failed.
struct GpuError : std::runtime_error {
  explicit GpuError(const std::string& what, Status why = Status::kCudaFailed, std::string when = {},
                    std::string because = {})
      : std::runtime_error(what), status(why), step(std::move(when)), reason(std::move(because)) {}

  Status status;
  std::string step;    ///< what was being done
  std::string reason;  ///< what CUDA says of it, or the free memory where there is too little
};

/// Finds which triangles of which bodies meet. An engine is given shapes and then, as often as wanted, bodies
/// and pairs of bodies. Functions throw EngineError, GpuError or std::bad_alloc where a call fails, and
/// std::runtime_error where a library does not say more.
class Engine {
 public:
  Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;
  virtual ~Engine() = default;

  /// Such as "embree-refit", as make_engine() knows it.
  virtual std::string_view name() const = 0;

  /// The same for tables, with the mode: "Embree refit", "Tandem exact".
  virtual std::string label() const { return std::string(name()); }

  /// The data structure, the precision and whatever else the figures depend on, in a line.
  virtual std::string settings() const { return {}; }

  /// Names the shapes that bodies refer to, and makes what lasts as long as they. What the views look at must
  /// outlive the engine's use.
  virtual void set_shapes(std::span<const AssetView> shapes) = 0;

  /// Takes the places of the bodies. Their number and shapes may change from call to call; engines that keep
  /// something for each body then start anew. `bodies` must stay until the next call.
  virtual void update(std::span<const BodyPose> bodies) = 0;

  /// Which pairs find_pairs() finds from now on; at first all. Its arrays lie in CPU memory, have an entry
  /// for each body, and must stay as long as pairs are asked for.
  void set_filter(const PairFilter& filter) { filter_ = filter; }

  /// Lets find_pairs() take the bodies that the filter calls fixed as they stand, until the next update(),
  /// where the engine can. Condition: update().
  virtual void keep_fixed() {}

  /// Finds the pairs of bodies whose world boxes meet, and that the filter looks at: a < b, sorted. Valid
  /// until the next call of a function that is not const.
  virtual std::span<const ObjectPair> find_pairs() = 0;

  /// Finds and keeps the contacts of these pairs, which may be those of find_pairs().
  virtual void query(std::span<const ObjectPair> pairs) = 0;

  /// Puts what the last query found into `found`, in no order, each once. Result: false where the library
  /// does not tell the triangles.
  virtual bool contacts(std::vector<TriangleContact>& found) = 0;

  /// Finds pairs, where none are given, and contacts, `repeats` times, and tells what each took; fixed bodies
  /// are kept before. Condition: update(); order, traversal and manifolds are for engines that have them.
  virtual TimedAnswer time_query(const TimedQuery& asked);

  /// What a simulator asks for: update(), find_pairs(), query() and contacts(), in the order of a
  /// ContactList. `idle`: empty, or for each body whether it does not move (1; else 0): pairs of two idle
  /// bodies are left out of both lists. The filter that there was is forgotten.
  void find(std::span<const BodyPose> bodies, std::span<const std::uint8_t> idle, ContactList& found);

  /// Of the last find().
  const EngineTimes& times() const { return times_; }

  /// Of the last query. Counts that an engine does not keep as Tandem does are 0; after find(), object_pairs
  /// and contacts are always there.
  const ContactCounters& counters() const { return counters_; }

  /// What the engine counted in the last query, by names of its own.
  virtual std::vector<Counter> named_counters() const { return {}; }

  /// Memory held that malloc knows nothing of: mapped files, pages from the operating system.
  virtual std::uint64_t bytes_beside_heap() const { return 0; }

  /// Whether contacts() is the exact answer, found without Tandem's own code; asked once, not raced.
  virtual bool is_reference() const { return false; }

 protected:
  /// find_pairs() and query() of these. Result: the pairs.
  virtual std::span<const ObjectPair> find_pairs_and_query();

  /// Makes contact manifolds of what the last query found between these pairs, which were its pairs. Adds the
  /// seconds that it took. Throws std::logic_error of an engine that has none.
  virtual void make_manifolds(std::span<const ObjectPair> pairs, TimedManifolds& made);

  /// Throws what a status other than kOk calls for. `where`: the body to blame, where there is one.
  void require(Status status, std::uint64_t where) const;

  EngineTimes times_;
  ContactCounters counters_;
  PairFilter filter_;

 private:
  std::vector<Motion> motion_;  // what find() makes of idle bodies
};

}  // namespace tandem
