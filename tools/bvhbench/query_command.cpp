#include <array>
#include <optional>

#include "bvhbench/engines/registry.h"
#include "bvhbench/scenes/contacts_file.h"
#include "contained.h"
#include "deform.h"
#include "query_tolerance.h"
#include "tandem/kernels/bodies_at_query.h"

namespace tandem::bench {
namespace {

struct QueryArguments : CommonArguments {
  std::string gpu_engine = "tandem-cuda";
  QueryMode mode = QueryMode::exact;
  double within = 0;
  std::uint32_t leave_out_rings = 0;
  std::optional<double> tolerance;
  std::optional<std::array<double, 3>> at;
  std::optional<double> kept_within;
  std::optional<std::uint32_t> frame;
  bool first_contact = false, self_pairs = false;
  bool grouped = false, sorted = false, traversal = false, manifolds = false, contained = false;

  OrderOnGpu order() const {
    if (sorted) return OrderOnGpu::sorted;
    return grouped ? OrderOnGpu::grouped : OrderOnGpu::any;
  }
  bool takes_all_contacts() const { return manifolds || contained; }
  bool is_for_gpu() const { return order() != OrderOnGpu::any || traversal || gpu_engine != "tandem-cuda"; }
};

struct Answer {
  ContactCounters counters;
  ContactTable table;
  TimedAnswer timed;            // its contacts are in the table
  TimedContainments contained;  // where they were asked for
};

constexpr CounterRow<ContactCounters> kCandidates[] = {
    {"block_pairs", "block pairs", &ContactCounters::block_pairs},
    {"candidates", "candidates", &ContactCounters::candidates},
};
constexpr CounterRow<ContactCounters> kDecided[] = {
    {"decided_by_float32", "  by float32", &ContactCounters::decided_by_float32},
    {"decided_by_float64", "  by float64", &ContactCounters::decided_by_float64},
    {"decided_exactly", "  exactly", &ContactCounters::decided_exactly},
};
constexpr CounterRow<ManifoldCounters> kManifolds[] = {
    {"manifolds", "manifolds", &ManifoldCounters::manifolds},
    {"points", "points", &ManifoldCounters::points},
    {"segments", nullptr, &ManifoldCounters::segments},
    {"open_curves", nullptr, &ManifoldCounters::open_curves},
    {"ambiguous_touches", nullptr, &ManifoldCounters::ambiguous_touches},
};

const std::map<std::string, QueryMode> kModes = {
    {"exact", QueryMode::exact}, {"fast", QueryMode::fast}, {"boxes", QueryMode::boxes}};

const std::map<std::string, std::string> kGpuEngines = {
    {"tandem", "tandem-cuda"}, {"paper", "paper"}, {"paper-bits", "paper-bits"}};

// Takes the contacts.
ContactTable take_table(const LoadedScene& scene, TimedAnswer& timed) {
  const std::vector<TriangleContact> contacts = std::move(timed.contacts);
  return table_of(scene.views(), scene.description.instances, timed.pairs, contacts);
}

// Deforms the shapes as the frame says.
void bend(Engine& engine, const QueryArguments& arguments, const LoadedScene& scene) {
  const Deformations deformations(arguments.scene, scene);
  if (*arguments.frame >= deformations.frames()) {
    throw UsageError(arguments.scene + ": has " + std::to_string(deformations.frames()) +
                     " frames, so there is no frame " + std::to_string(*arguments.frame));
  }
  FrameOfShapes frame;
  for (const std::uint32_t shape : deformations.shapes())
    frame.push_back({shape, deformations.read(shape, *arguments.frame)});
  deform(engine, frame, arguments.scene, *arguments.frame);
}

// Runs the query as often as asked; the answer is the last run's, which is every run's.
Answer find(const QueryArguments& arguments, const LoadedScene& scene) {
  const std::vector<AssetView> views = scene.views();
  const ScenePairs pairs(scene.description);
  ContactOptions options;
  options.mode = arguments.mode;
  options.first_contact_only = arguments.first_contact;
  options.self_pairs = arguments.self_pairs;
  options.within = arguments.within;
  options.leave_out_rings = arguments.leave_out_rings;
  const auto engine = make_engine(arguments.on_gpu() ? arguments.gpu_engine : "tandem", options);
  Answer answer;
  engine->set_threads(arguments.threads());
  engine->set_shapes(views);
  engine->set_filter(pairs.filter());
  engine->update(scene.description.instances);
  if (arguments.frame) bend(*engine, arguments, scene);
  answer.timed = engine->time_query({pairs.given(), arguments.repeats, arguments.order(), arguments.traversal,
                                     arguments.manifolds, arguments.kept_within});
  answer.counters = engine->counters();
  if (arguments.contained) {
    answer.contained = find_contained(scene, answer.timed.pairs, answer.timed.contacts, arguments.threads(),
                                      arguments.repeats);
  }
  answer.table = take_table(scene, answer.timed);
  return answer;
}

void add_contacts(Report& report, const QueryArguments& arguments, const LoadedScene& scene,
                  const Answer& answer) {
  add_object_pairs(report, answer.counters.object_pairs, scene);
  report.add(kCandidates, answer.counters);
  report.add(kDecided, answer.counters, arguments.mode == QueryMode::exact);
  report.add("contacts", answer.counters.contacts).row("contacts");
  add_outcome(report, hash_of(answer.table), answer.timed.whole);
  report["seconds"].row("milliseconds", Unit::milliseconds,
                        scene.description.pairs ? "; without the broad phase" : "");
}

void add_gpu(Report& report, const QueryArguments& arguments, const TimedAnswer& timed) {
  report.add_json("engine", name_of(arguments.gpu_engine, kGpuEngines));
  add_gpu_name(report, timed.gpu);
  report.add_json("grouped", arguments.grouped);
  report.add_json("sorted", arguments.sorted);
  add_gpu_use(report, timed.gpu);
  report.add_json("broad_phase_seconds", times(timed.broad_phase)).row("  broad phase", Unit::milliseconds);
  report.add_json("contacts_seconds", times(timed.narrow)).row("  contacts", Unit::milliseconds);
  report.add_json("traversal_seconds", times(timed.traversal))
      .row("  traversal", Unit::milliseconds, " alone");
  report["upload_seconds"].row("upload", Unit::milliseconds, "  once");
  report["gpu_bytes"].row("GPU bytes");
}

Report report_of(const QueryArguments& arguments, const LoadedScene& scene, const Answer& answer) {
  const std::string& mode = name_of(arguments.mode, kModes);
  Report report = report_of(arguments, "query", mode,
                            name_of(arguments.gpu_engine, kGpuEngines) + ", " + answer.timed.gpu.name);
  report.add({{"mode", mode},
              {"first_contact", arguments.first_contact},
              {"self_pairs", arguments.self_pairs},
              {"within", arguments.within},
              {"leave_out_rings", arguments.leave_out_rings}});
  if (arguments.frame) report.add("frame", *arguments.frame);
  add_setting(report, arguments, scene);
  report["triangles"].row("triangles");
  add_contacts(report, arguments, scene, answer);
  if (arguments.manifolds) {
    report.add(kManifolds, answer.timed.manifolds.counters);
    report.add("manifold_seconds", times(answer.timed.manifolds.seconds))
        .row("  manifolds", Unit::milliseconds, " on top");
  }
  if (arguments.kept_within) {
    report.add_json("kept_pairs", answer.timed.manifolds.kept_pairs);
    report.add("kept_seconds", times(answer.timed.manifolds.kept))
        .row("  kept", Unit::milliseconds, " for all of it where pairs are kept");
  }
  if (arguments.contained) {
    report.add_json("contained", count_inside(answer.contained.rows)).row("contained");
    report.add_json("contained_rows", answer.contained.rows.size());
    report.add("contained_seconds", times(answer.contained.seconds))
        .row("  contained", Unit::milliseconds, " on top");
  }
  if (arguments.at) {
    PlacedBodies bodies(scene);
    BodiesAtQuery query;
    require(query.find(bodies.scene, {.points = std::span(&*arguments.at, 1)}));
    Json there = Json::array();
    for (const BodyAt& row : query.rows()) there.push_back(row.body);
    report.add_json("bodies_at", there);
    report.add_json("bodies_at_count", there.size()).row("bodies there");
  }
  if (arguments.on_gpu()) add_gpu(report, arguments, answer.timed);
  return report;
}

void add_datasets(Hdf5Output& file, const QueryArguments& arguments, const Answer& answer) {
  add_contacts(file, answer.table);
  if (arguments.manifolds)
    add_manifolds(file, answer.timed.manifolds.manifolds, answer.timed.manifolds.points);
  if (arguments.contained) add_contained(file, answer.contained.rows);
}

// Throws where the options do not go with each other, or with the backend.
void check_options(const QueryArguments& arguments) {
  if (arguments.manifolds && (arguments.mode == QueryMode::boxes || arguments.first_contact)) {
    throw UsageError(
        "--manifolds takes all contacts, so neither --mode boxes nor --first-contact goes with it");
  }
  if (arguments.kept_within && (!arguments.manifolds || arguments.self_pairs))
    throw UsageError("--keep goes with --manifolds, and without --self");
  if (arguments.contained && (arguments.mode != QueryMode::exact || arguments.first_contact)) {
    throw UsageError(
        "--contained takes all exact contacts, so neither --mode nor --first-contact goes with it");
  }
  if (arguments.within > 0 && arguments.takes_all_contacts())
    throw UsageError("--manifolds and --contained take contacts, so --within does not go with them");
  if (arguments.frame && (arguments.contained || arguments.at || arguments.on_gpu()))
    throw UsageError("--frame is for contacts and manifolds on the CPU");
  const bool tandem = arguments.gpu_engine == "tandem-cuda";
  if (!arguments.on_gpu()) {
    const std::pair<bool, const char*> told[] = {{!tandem, "--engine"},
                                                 {arguments.grouped, "--grouped"},
                                                 {arguments.sorted, "--sorted"},
                                                 {arguments.traversal, "--traversal"}};
    for (const auto& [given, option] : told) {
      if (given) throw UsageError(std::string(option) + " is for the backend cuda");
    }
    return;
  }
  if (!tandem && (arguments.first_contact || arguments.order() != OrderOnGpu::any || arguments.traversal ||
                  arguments.manifolds || arguments.within > 0 || arguments.leave_out_rings > 0)) {
    throw UsageError(
        "--first-contact, --grouped, --leave-out-rings, --manifolds, --sorted, --traversal and --within are "
        "for the engine tandem");
  }
  if (arguments.self_pairs)
    throw UsageError("--self is for the backend cpu; /pairs of a scene may name an instance twice");
}

// The command prints and writes rows about pairs of bodies here, so options of contacts do not go with it.
ExitCode run_by_tolerance(const QueryArguments& arguments) {
  if (arguments.mode != QueryMode::exact || arguments.first_contact || arguments.within > 0 ||
      arguments.self_pairs || arguments.frame || arguments.leave_out_rings > 0 ||
      arguments.takes_all_contacts() || arguments.is_for_gpu()) {
    throw UsageError("--tolerance finds no contacts, so options that are about them do not go with it");
  }
  return run_tolerance(arguments, *arguments.tolerance);
}

ExitCode run_query(const QueryArguments& arguments) {
  if (arguments.tolerance) return run_by_tolerance(arguments);
  check_options(arguments);
  const LoadedScene scene = open_scene(arguments);
  if (arguments.self_pairs && scene.description.pairs)
    throw UsageError(arguments.scene + ": gives its object pairs, so --self has nothing to add");
  const Answer answer = answer_of(arguments.scene, scene, [&] { return find(arguments, scene); });
  Report report = report_of(arguments, scene, answer);
  return finish(arguments, report, [&](Hdf5Output& file) { add_datasets(file, arguments, answer); });
}

void add_gpu_options(Command command, QueryArguments& arguments) {
  command.add({{"--engine", arguments.gpu_engine, kGpuEngines, "tandem|paper|paper-bits [tandem]",
                "on a GPU: Tandem's, or the paper's scheme, the yardstick"},
               {"--grouped", arguments.grouped, "on a GPU: group contacts by pair there, and time that too"},
               {"--sorted", arguments.sorted, "on a GPU: sort pairs and contacts there, and time that too"},
               {"--traversal", arguments.traversal,
                "on a GPU: also time the trees' walk alone, without triangle tests"}});
  command.exclude("--sorted", "--grouped");
}

}  // namespace

void add_query(Command tool, Run& run_later) {
  const auto [command, arguments] = add_command<QueryArguments>(
      tool, run_later, "query", "find every pair of triangles that meet in a scene", run_query);
  command.add({scene_argument(arguments), backend_option(arguments)});
  if (has_cuda()) add_gpu_options(command, arguments);
  command.add(
      {{"--mode", arguments.mode, kModes, "exact|fast|boxes [exact]",
        "'exact' contacts, 'fast' ones by float32, or 'boxes': candidates"},
       {"--first-contact", arguments.first_contact, "one contact for each object pair at most"},
       {"--within", arguments.within, "D [0]",
        "clearance: also triangles at most so far apart, decided exactly",
        between(0, kLargestWorldCoordinate)},
       {"--tolerance", arguments.tolerance, "T",
        "only which bodies surely meet, which surely do not, and which are within T, by their levels",
        between(0, kLargestWorldCoordinate)},
       {"--manifolds", arguments.manifolds, "also contact manifolds: normals, depths and points"},
       {"--keep", arguments.kept_within, "T",
        "with --manifolds: also the time for bodies that stand still, whose pairs are kept within T",
        between(0, kLargestWorldCoordinate)},
       {"--contained", arguments.contained,
        "also bodies that lie within others without touching them, found on the CPU"},
       {"--at", arguments.at, "X Y Z", "also which bodies' world boxes contain this point",
        between(-kLargestWorldCoordinate, kLargestWorldCoordinate)},
       {"--self", arguments.self_pairs, "also each instance with itself"},
       {"--leave-out-rings", arguments.leave_out_rings, "N [0]",
        "of an instance with itself: leave out triangles that share a vertex (1), or that N - 1 edges join",
        between(0, kMostRings)},
       {"--frame", arguments.frame, "N", "of the scene's deformations; without it nothing bends",
        between(0, 4e9)},
       threads_option(arguments, "the contacts do"),
       repeat_option(arguments),
       output_option(arguments, "the contacts file to write; appears whole or not at all"),
       json_option(arguments)});
}

}  // namespace tandem::bench
