#pragma once
#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "kernels/common/stopwatch.h"
#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/distance_query.h"
#include "tandem/kernels/impact_query.h"
#include "tandem/kernels/manifold.h"
#include "tandem/kernels/tolerance_query.h"

namespace tandem {

/// Says how closest points and first hits of rays are asked for.
struct ProbeOptions {
  DistanceTolerance tolerance = {};  ///< of closest points, where the engine certifies them
};

/// The question that an engine is made to answer, with its options: contacts, distances, impacts, verdicts,
/// or points and rays.
using Question = std::variant<ContactOptions, DistanceOptions, ImpactOptions, ToleranceOptions, ProbeOptions>;

/// Points of the world.
using Points = std::span<const std::array<double, 3>>;

/// A body: its shape, by place in the list given to set_shapes(), and where it stands. The pose speaks of the
/// coordinates of the mesh file.
using BodyPose = Instance;

/// Two triangles that meet, of the bodies in row `pair` of the pairs that were asked about:
/// LevelView::triangles[triangle_a] of its a's shape, [triangle_b] of its b's.
struct TriangleContact {
  std::uint32_t pair, triangle_a, triangle_b;

  friend auto operator<=>(const TriangleContact&, const TriangleContact&) = default;
};

/// Positions of the source vertices of a shape, x y z of each, as Scene::deform() takes them.
using VertexPositions = std::variant<std::span<const float>, std::span<const double>>;

/// A shape whose source vertices get other positions.
struct BentShape {
  std::uint32_t shape;
  VertexPositions positions;
};

/// The contacts that a step of a simulation asks for. Every exact engine gives the same list, whatever its
/// threads.
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

/// Says how a question is asked when it is timed.
struct TimedQuery {
  const std::vector<ObjectPair>* given = nullptr;  ///< normalised; null: the engine finds the pairs
  std::uint32_t repeats = 1;

  /// These are for contacts.
  OrderOnGpu order = OrderOnGpu::any;  ///< on a GPU
  bool traversal = false;              ///< on a GPU: the walk of the trees is timed alone too
  bool manifolds = false;              ///< contact manifolds are made of what each repeat finds, and timed
  /// Manifolds of bodies that stand still are kept too, with this tolerance (MovedOptions), and timed.
  std::optional<double> kept_within = {};
};

/// The resources that an engine takes of a GPU.
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
  Seconds kept;     ///< of each repeat with pairs that are kept: broad phase, query and manifolds together
  std::uint64_t kept_pairs = 0;
};

/// Throws unless manifolds that were kept are, to the last byte, those that were found.
void check_kept(std::span<const Manifold> manifolds, std::span<const ManifoldPoint> points,
                const TimedManifolds& found);

/// The pairs that a timed question was about, and how long its repeats took.
struct TimedRun {
  std::vector<ObjectPair> pairs;  ///< sorted
  Seconds whole;                  ///< the broad phase, where pairs are found, and the question
  Seconds narrow;                 ///< on a GPU: the question without the broad phase
  GpuUse gpu;                     ///< of engines on a GPU
};

/// The contacts that a timed query found.
struct TimedAnswer : TimedRun {
  std::vector<TriangleContact> contacts;  ///< in no order
  Seconds broad_phase;                    ///< where it is timed apart, as on a GPU
  Seconds traversal;                      ///< the walk of the same pairs, without triangle tests
  TimedManifolds manifolds;               ///< where they were asked for
};

/// The answer to a question that has a row for each pair.
template <typename RowOfPair, typename CountersOfRows>
struct TimedRows : TimedRun {
  using Row = RowOfPair;
  std::vector<Row> rows;
  CountersOfRows counters;
  std::uint32_t rounds = 0;  ///< on a GPU: of block pairs, where the question counts them
};
using TimedDistances = TimedRows<ObjectDistance, DistanceCounters>;
using TimedImpacts = TimedRows<Impact, ImpactCounters>;
using TimedVerdicts = TimedRows<PairVerdict, ToleranceCounters>;

/// A number that an engine counts, and its name.
using Counter = std::pair<std::string, std::uint64_t>;

/// A call of an engine failed; what() says which engine, the body to blame where there is one, and why.
struct EngineError : std::runtime_error {
  EngineError(const std::string& what, Status why, std::uint64_t blamed)
      : std::runtime_error(what), status(why), where(blamed) {}

  Status status;
  std::uint64_t where;  ///< the body or pair to blame, where subject(status) names one of these
  std::optional<std::uint32_t> shape = {};  ///< the shape to blame that was given other positions
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

/// A way to answer one question about bodies, Tandem's or another library's. An engine is given shapes and
/// then, as often as wanted, bodies and pairs of bodies. Condition of each function of a question: the engine
/// was made for that question, else it throws std::logic_error. Functions throw EngineError, GpuError or
/// std::bad_alloc where a call fails, and std::runtime_error where a library does not say more.
class Engine {
 public:
  /// name: as the registry has it, whose text it refers to.
  explicit Engine(std::string_view name) : name_(name) {}
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;
  virtual ~Engine() = default;

  /// Returns the name by which make_engine() knows the engine, such as "embree-refit".
  std::string_view name() const { return name_; }

  /// The name for tables, with the mode: "Embree refit", "Tandem exact".
  virtual std::string label() const { return std::string(name_); }

  /// The data structure, the precision and whatever else the figures depend on, in a line.
  virtual std::string settings() const { return {}; }

  /// Returns whether the answer is exact, found without Tandem's own code.
  virtual bool is_reference() const { return false; }

  /// Returns whether the engine is so slow that it is asked once and not raced.
  virtual bool runs_once() const { return is_reference(); }

  /// Sets how many threads questions may use, where the engine can use more than one; at first 1. No answer
  /// depends on it.
  void set_threads(std::uint32_t threads) { threads_ = threads; }

  /// Names the shapes that bodies refer to, and makes what lasts as long as they. What the views look at must
  /// outlive the engine's use.
  virtual void set_shapes(std::span<const AssetView> shapes) = 0;

  /// Takes the places of the bodies. Their number and shapes may change from call to call; engines that keep
  /// something for each body then start anew. `bodies` must stay until the next call.
  virtual void update(std::span<const BodyPose> bodies) = 0;

  /// Gives the source vertices of shapes other positions, in the file's coordinates. Their bodies take the
  /// shape of the triangles between these, where they stand. Result: how loose the loosest tree has become,
  /// as Scene::looseness() says; nothing where the library does not tell. An engine on a GPU takes float32
  /// numbers alone, and puts the seconds of the one call that refits all, by the GPU's clock and without the
  /// copy of the positions, into times().update. Condition: update(). Throws EngineError as Scene::deform()
  /// fails, with the shape.
  virtual std::optional<double> deform(std::span<const BentShape> bent);

  /// Says how the bodies of the next update() move in a step of `duration` seconds, for impacts. `motion`
  /// must stay as long as they. Conditions: there is one for each of them; duration > 0; for engines that are
  /// not Tandem's, no body turns by half a turn or more.
  void set_motion(std::span<const RigidMotion> motion, double duration) {
    motion_ = motion;
    duration_ = duration;
  }

  /// Names the pairs that are found from now on; at first all. The arrays of the filter lie in CPU memory,
  /// have an entry for each body, and must stay as long as pairs are asked for.
  void set_filter(const PairFilter& filter) { filter_ = filter; }

  /// Lets find_pairs() take the bodies that the filter calls fixed as they stand, until the next update(),
  /// where the engine can. Condition: update().
  virtual void keep_fixed() {}

  /// Finds the pairs of bodies whose world boxes meet, and that the filter looks at: a < b, sorted. Valid
  /// until the next call of a function that is not const.
  virtual std::span<const ObjectPair> find_pairs() { cannot("find pairs"); }

  /// Finds and keeps the contacts of these pairs, which may be those of find_pairs().
  virtual void query(std::span<const ObjectPair> /*pairs*/) { cannot("find contacts"); }

  /// Puts what the last query found into `found`, in no order, each once. Result: false where the library
  /// does not tell the triangles.
  virtual bool contacts(std::vector<TriangleContact>& /*found*/) { cannot("find contacts"); }

  /// Finds pairs, where none are given, and contacts, as often as asked, and tells what each took; fixed
  /// bodies are kept before. Condition: update(); order, traversal and manifolds are for engines that have
  /// them.
  virtual TimedAnswer time_query(const TimedQuery& asked);

  /// Chooses the pairs that are asked about, given those that were found; valid until the query is over.
  using PairChoice = std::function<std::span<const ObjectPair>(std::span<const ObjectPair>)>;

  /// Finds what a simulator asks for: update(), find_pairs(), query() and contacts(), in the order of a
  /// ContactList. `idle`: empty, or for each body whether it does not move (1; else 0): pairs of two idle
  /// bodies are not found. They take the place of the filter's motions. `choose`: null for all pairs; the
  /// time that it takes counts as the broad phase's.
  void find(std::span<const BodyPose> bodies, std::span<const std::uint8_t> idle, ContactList& found,
            const PairChoice& choose = nullptr);

  /// Puts the distance of each pair into `distances`; it is 0 or less where bodies meet.
  virtual void find_distances(std::span<const ObjectPair> /*pairs*/, std::vector<double>& /*distances*/) {
    cannot("find distances");
  }

  /// Returns how many pairs of the last find_distances() have an exact distance that is not in [lower,
  /// upper], as exact arithmetic decides. Condition: is_reference().
  virtual std::uint64_t outside(std::span<const double> /*lower*/, std::span<const double> /*upper*/) const {
    cannot("judge distances");
  }

  /// Puts the time when the bodies of each pair meet into `times`, in seconds; it is infinite where they do
  /// not meet in the step. Condition: set_motion() before update().
  virtual void find_impacts(std::span<const ObjectPair> /*pairs*/, std::vector<double>& /*times*/) {
    cannot("find impacts");
  }

  /// Puts the distance of the bodies' surfaces from each point into `distances`. Condition: update().
  virtual void find_closest(Points /*points*/, std::vector<double>& /*distances*/) {
    cannot("find closest points");
  }

  /// Puts the parameter of the first hit of each ray origin + t direction into `times`; it is infinite where
  /// nothing is hit. Condition: update().
  virtual void find_hits(Points /*origins*/, Points /*directions*/, std::vector<double>& /*times*/) {
    cannot("find hits of rays");
  }

  /// Find pairs, where none are given, and answer the question for each of them, as often as asked. On a GPU
  /// the question is run until everything has room, and each repeat is a graph that is replayed and timed by
  /// events. Condition: update(), for impacts after set_motion().
  virtual TimedDistances time_distances(const TimedQuery& /*asked*/) { cannot("time distances"); }
  virtual TimedImpacts time_impacts(const TimedQuery& /*asked*/) { cannot("time impacts"); }
  virtual TimedVerdicts time_verdicts(const TimedQuery& /*asked*/) { cannot("time verdicts"); }

  /// Returns the times that the phases of the last find() took, and on a GPU the last deform().
  const EngineTimes& times() const { return times_; }

  /// Returns what the last query for contacts counted. Counts that an engine does not keep as Tandem does are
  /// 0; after find(), object_pairs, those that were asked about, and contacts are always there.
  const ContactCounters& counters() const { return counters_; }

  /// Returns what the engine counted in the last query, by names of its own.
  virtual std::vector<Counter> named_counters() const { return {}; }

  /// Memory held that malloc knows nothing of: mapped files, pages from the operating system.
  virtual std::uint64_t bytes_beside_heap() const { return 0; }

 protected:
  /// Calls find_pairs() and query() of these. Result: the pairs.
  virtual std::span<const ObjectPair> find_pairs_and_query();

  /// Makes contact manifolds of what the last query found between these pairs, which were its pairs. Adds the
  /// seconds that it took.
  virtual void make_manifolds(std::span<const ObjectPair> /*pairs*/, TimedManifolds& /*made*/) {
    cannot("make manifolds");
  }

  /// Throws std::logic_error. what: was asked of an engine that was not made for it.
  [[noreturn]] void cannot(const char* what) const;

  /// Deforms a shape, as deform() does.
  virtual std::optional<double> deform_one(std::uint32_t /*shape*/, const VertexPositions& /*positions*/) {
    cannot("deform shapes");
  }

  /// Throws what a status other than kOk calls for. `where`: the body to blame, where there is one.
  void require(Status status, std::uint64_t where) const;
  /// Does the same for a shape that was given other positions.
  void require_bent(std::uint32_t shape, Status status, std::uint64_t where) const;

  EngineTimes times_;
  ContactCounters counters_;
  std::uint32_t threads_ = 1;
  PairFilter filter_;
  std::span<const RigidMotion> motion_;
  double duration_ = 0;

 private:
  std::string_view name_;
  std::vector<Motion> idle_motion_;  // what find() makes of idle bodies
};

/// Makes the engine for the question out of those of one way to answer all of them.
template <typename Contacts, typename Distances, typename Impacts, typename Verdicts>
std::unique_ptr<Engine> make_for(const Question& question, std::string_view name) {
  if (const auto* distances = std::get_if<DistanceOptions>(&question))
    return std::make_unique<Distances>(name, *distances);
  if (const auto* impacts = std::get_if<ImpactOptions>(&question))
    return std::make_unique<Impacts>(name, *impacts);
  if (const auto* verdicts = std::get_if<ToleranceOptions>(&question))
    return std::make_unique<Verdicts>(name, *verdicts);
  return std::make_unique<Contacts>(name, std::get<ContactOptions>(question));
}

}  // namespace tandem
