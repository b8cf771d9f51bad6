#include "query_command.h"

#include <cstdio>
#include <memory>
#include <new>
#include <optional>
#include <thread>

#include "backend.h"
#include "bvhbench/engines/registry.h"
#include "bvhbench/scenes/contacts_file.h"
#include "bvhbench/scenes/hdf5_file.h"
#include "bvhbench/scenes/scene_file.h"
#include "common/json.h"
#include "common/number_words.h"
#include "contained.h"
#include "query_tolerance.h"

namespace tandem::bench {
namespace {

struct QueryArguments {
  std::string scene, out, backend = "cpu", gpu_engine = "tandem-cuda";
  ContactOptions options;
  std::optional<double> tolerance;
  std::uint32_t repeats = 1;
  bool grouped = false, sorted = false, traversal = false, manifolds = false, contained = false;
  bool json = false, threads_given = false;

  bool on_gpu() const { return backend == "cuda"; }
  OrderOnGpu order() const {
    if (sorted) return OrderOnGpu::sorted;
    return grouped ? OrderOnGpu::grouped : OrderOnGpu::any;
  }
  std::string engine() const { return on_gpu() ? gpu_engine : "tandem"; }
};

struct Answer {
  QueryRecord record;
  ContactTable table;
  TimedAnswer timed;            // its contacts are in the table
  TimedContainments contained;  // where they were asked for
};

const std::map<std::string, QueryMode> kModes = {
    {"exact", QueryMode::exact}, {"fast", QueryMode::fast}, {"boxes", QueryMode::boxes}};

const std::map<std::string, std::string> kGpuEngines = {
    {"tandem", "tandem-cuda"}, {"paper", "paper"}, {"paper-bits", "paper-bits"}};

template <typename Value>
std::string name_of(Value wanted, const std::map<std::string, Value>& names) {
  for (const auto& [name, value] : names) {
    if (value == wanted) return name;
  }
  return {};
}

QueryRecord record_of(const QueryArguments& arguments, const LoadedScene& scene) {
  QueryRecord record;
  record.mode = name_of(arguments.options.mode, kModes);
  record.backend = arguments.backend;
  record.first_contact = arguments.options.first_contact_only;
  record.within = arguments.options.within;
  record.self_pairs = arguments.options.self_pairs;
  record.given_pairs = scene.description.pairs.has_value();
  record.threads = arguments.on_gpu() ? 0 : arguments.options.threads;
  return record;
}

// Takes the contacts.
ContactTable table_of(const LoadedScene& scene, TimedAnswer& timed) {
  const std::vector<AssetView> views = scene.views();
  const auto face = [&](std::uint32_t instance, std::uint32_t triangle) {
    const std::uint32_t shape = scene.description.instances[instance].asset;
    return views[shape].level().triangles[triangle].source_face();
  };
  std::vector<FaceContact> faces;
  faces.reserve(timed.contacts.size());
  for (const auto& [pair, a, b] : timed.contacts)
    faces.push_back({pair, face(timed.pairs[pair].a, a), face(timed.pairs[pair].b, b)});
  std::vector<TriangleContact>().swap(timed.contacts);
  return make_table(timed.pairs, std::move(faces));
}

// Runs the query as often as asked; the answer is the last run's, which is every run's.
Answer run_query(const QueryArguments& arguments, const LoadedScene& scene) {
  const SceneDescription& description = scene.description;
  const std::vector<AssetView> views = scene.views();
  const std::vector<ObjectPair> pairs = normalised(description.pairs.value_or(std::vector<ObjectPair>()));
  const auto engine = make_engine(arguments.engine(), arguments.options);
  Answer answer = {record_of(arguments, scene), {}, {}, {}};
  ExcludedPairTable excluded;
  engine->set_shapes(views);
  engine->set_filter(description.filter.view(excluded));
  engine->update(description.instances);
  answer.timed = engine->time_query({description.pairs ? &pairs : nullptr, arguments.repeats,
                                     arguments.order(), arguments.traversal, arguments.manifolds});
  answer.record.seconds = answer.timed.whole;
  answer.record.counters = engine->counters();
  if (arguments.contained) {
    answer.contained = find_contained(scene, answer.timed.pairs, answer.timed.contacts,
                                      arguments.options.threads, arguments.repeats);
  }
  answer.table = table_of(scene, answer.timed);
  return answer;
}

Answer answer_of(const QueryArguments& arguments, const LoadedScene& scene) {
  try {
    return run_query(arguments, scene);
  } catch (const EngineError& error) {
    if (error.status == Status::kNoTopology) {
      throw FileError(arguments.scene + ": " + scene.name_of(error.where) + ": " + explain(error.status));
    }
    refuse(arguments.scene, error.status, error.where);
  } catch (const GpuError& error) {
    refuse_gpu(arguments.scene, error);
  }
}

Json times(const Seconds& seconds) {
  if (seconds.empty()) return {};
  return {{"best", best_of(seconds)}, {"median", median_of(seconds)}, {"all", seconds}};
}

Json to_json(const QueryArguments& arguments, const LoadedScene& scene, const Answer& answer) {
  const QueryRecord& record = answer.record;
  const ContactCounters& counters = record.counters;
  Json json = {{"tool", "bvhbench query"},
               {"version", TANDEM_VERSION},
               {"scene", arguments.scene},
               {"output", arguments.out.empty() ? Json() : Json(arguments.out)},
               {"backend", record.backend},
               {"mode", record.mode},
               {"first_contact", record.first_contact},
               {"self_pairs", record.self_pairs},
               {"within", record.within},
               {"given_pairs", record.given_pairs},
               {"threads", record.threads},
               {"assets", scene.assets.size()},
               {"instances", scene.description.instances.size()},
               {"triangles", triangles_of(scene)},
               {"object_pairs", counters.object_pairs},
               {"block_pairs", counters.block_pairs},
               {"candidates", counters.candidates},
               {"decided_by_float32", counters.decided_by_float32},
               {"decided_by_float64", counters.decided_by_float64},
               {"decided_exactly", counters.decided_exactly},
               {"contacts", counters.contacts},
               {"hash", hexadecimal(hash_of(answer.table))},
               {"seconds", times(record.seconds)}};
  if (arguments.manifolds) {
    const ManifoldCounters& made = answer.timed.manifolds.counters;
    json["manifolds"] = made.manifolds;
    json["points"] = made.points;
    json["segments"] = made.segments;
    json["open_curves"] = made.open_curves;
    json["ambiguous_touches"] = made.ambiguous_touches;
    json["manifold_seconds"] = times(answer.timed.manifolds.seconds);
  }
  if (arguments.contained) {
    json["contained"] = count_inside(answer.contained.rows);
    json["contained_rows"] = answer.contained.rows.size();
    json["contained_seconds"] = times(answer.contained.seconds);
  }
  if (arguments.on_gpu()) {
    json["engine"] = name_of(arguments.gpu_engine, kGpuEngines);
    json["gpu"] = answer.timed.gpu.name;
    json["grouped"] = arguments.grouped;
    json["sorted"] = arguments.sorted;
    json["gpu_bytes"] = answer.timed.gpu.bytes;
    json["gpu_bytes_bound"] = answer.timed.gpu.bytes_bound == 0 ? Json() : Json(answer.timed.gpu.bytes_bound);
    json["gpu_bytes_taken"] = answer.timed.gpu.bytes_taken;
    json["upload_seconds"] = answer.timed.gpu.upload;
    json["broad_phase_seconds"] = times(answer.timed.broad_phase);
    json["contacts_seconds"] = times(answer.timed.narrow);
    json["traversal_seconds"] = times(answer.timed.traversal);
  }
  return json;
}

void print_row(const char* label, std::uint64_t value, const char* remark = "") {
  std::printf("  %-14s %15s%s\n", label, with_commas(value).c_str(), remark);
}

void print_times(const char* label, const Json& seconds, const char* remark = "") {
  if (seconds.is_null()) return;
  std::printf("  %-14s %15.3f  best of %zu, median %.3f%s\n", label, 1e3 * seconds["best"].get<double>(),
              seconds["all"].size(), 1e3 * seconds["median"].get<double>(), remark);
}

std::string place_of(const QueryArguments& arguments, const Answer& answer) {
  if (arguments.on_gpu()) return name_of(arguments.gpu_engine, kGpuEngines) + ", " + answer.timed.gpu.name;
  return with_commas(answer.record.threads) + (answer.record.threads == 1 ? " thread" : " threads");
}

void print_summary(const QueryArguments& arguments, const LoadedScene& scene, const Answer& answer) {
  const QueryRecord& record = answer.record;
  const ContactCounters& counters = record.counters;
  std::printf("%s: %s on %s, %s\n", arguments.scene.c_str(), record.mode.c_str(), record.backend.c_str(),
              place_of(arguments, answer).c_str());
  print_row("instances", scene.description.instances.size());
  print_row("triangles", triangles_of(scene));
  print_row("object pairs", counters.object_pairs, record.given_pairs ? "  given" : "  found");
  print_row("block pairs", counters.block_pairs);
  print_row("candidates", counters.candidates);
  if (arguments.options.mode == QueryMode::exact) {
    print_row("  by float32", counters.decided_by_float32);
    print_row("  by float64", counters.decided_by_float64);
    print_row("  exactly", counters.decided_exactly);
  }
  print_row("contacts", counters.contacts);
  print_times("milliseconds", times(record.seconds), record.given_pairs ? "; without the broad phase" : "");
  if (arguments.manifolds) {
    print_row("manifolds", answer.timed.manifolds.counters.manifolds);
    print_row("points", answer.timed.manifolds.counters.points);
    print_times("  manifolds", times(answer.timed.manifolds.seconds), " on top");
  }
  if (arguments.contained) {
    print_row("contained", count_inside(answer.contained.rows));
    print_times("  contained", times(answer.contained.seconds), " on top");
  }
  if (arguments.on_gpu()) {
    print_times("  broad phase", times(answer.timed.broad_phase));
    print_times("  contacts", times(answer.timed.narrow));
    print_times("  traversal", times(answer.timed.traversal), " alone");
    std::printf("  %-14s %15.3f  once\n", "upload", 1e3 * answer.timed.gpu.upload);
    print_row("GPU bytes", answer.timed.gpu.bytes);
  }
  std::printf("  %-14s %s\n", "hash", hexadecimal(hash_of(answer.table)).c_str());
}

// What a backend cannot do.
void check_arguments(const QueryArguments& arguments, const LoadedScene& scene) {
  if (arguments.options.self_pairs && scene.description.pairs) {
    throw UsageError(arguments.scene + ": gives its object pairs, so --self has nothing to add");
  }
  if (arguments.manifolds &&
      (arguments.options.mode == QueryMode::boxes || arguments.options.first_contact_only)) {
    throw UsageError(
        "--manifolds takes all contacts, so neither --mode boxes nor --first-contact goes with it");
  }
  if (arguments.contained &&
      (arguments.options.mode != QueryMode::exact || arguments.options.first_contact_only)) {
    throw UsageError(
        "--contained takes all exact contacts, so neither --mode nor --first-contact goes with it");
  }
  if (arguments.options.within > 0 && (arguments.manifolds || arguments.contained)) {
    throw UsageError("--manifolds and --contained take contacts, so --within does not go with them");
  }
  const bool tandem = arguments.gpu_engine == "tandem-cuda";
  if (!arguments.on_gpu()) {
    if (!tandem) throw UsageError("--engine is for the backend cuda");
    if (arguments.grouped) throw UsageError("--grouped is for the backend cuda");
    if (arguments.sorted) throw UsageError("--sorted is for the backend cuda");
    if (arguments.traversal) throw UsageError("--traversal is for the backend cuda");
    return;
  }
  if (!tandem && (arguments.options.first_contact_only || arguments.order() != OrderOnGpu::any ||
                  arguments.traversal || arguments.manifolds || arguments.options.within > 0)) {
    throw UsageError(
        "--first-contact, --grouped, --manifolds, --sorted, --traversal and --within are for the engine "
        "tandem");
  }
  if (arguments.options.self_pairs) {
    throw UsageError("--self is for the backend cpu; /pairs of a scene may name an instance twice");
  }
  if (arguments.threads_given) throw UsageError("--threads is for the backend cpu");
}

void write(const QueryArguments& arguments, const Answer& answer) {
  const TimedManifolds& made = answer.timed.manifolds;
  const ManifoldTable manifolds = {made.manifolds, made.points, made.counters, made.seconds};
  const ContainedTable contained = {answer.contained.rows, answer.contained.seconds};
  write_contacts(arguments.out, answer.table, answer.record, arguments.manifolds ? &manifolds : nullptr,
                 arguments.contained ? &contained : nullptr);
}

// What it prints and writes is all about pairs of bodies, so options of contacts do not go with it.
ExitCode run_by_tolerance(const QueryArguments& arguments) {
  const ContactOptions& options = arguments.options;
  if (options.mode != QueryMode::exact || options.first_contact_only || options.within > 0 ||
      options.self_pairs || arguments.manifolds || arguments.contained || arguments.traversal ||
      arguments.order() != OrderOnGpu::any || arguments.gpu_engine != "tandem-cuda") {
    throw UsageError("--tolerance finds no contacts, so options that are about them do not go with it");
  }
  if (arguments.on_gpu() && arguments.threads_given) throw UsageError("--threads is for the backend cpu");
  return run_tolerance({arguments.scene, arguments.out, arguments.backend, *arguments.tolerance,
                        options.threads, arguments.repeats, arguments.json});
}

ExitCode run(const QueryArguments& arguments) {
  if (arguments.tolerance) return run_by_tolerance(arguments);
  const LoadedScene scene = read_scene(arguments.scene);
  if (!arguments.out.empty()) keep_inputs(arguments.out, files_of(arguments.scene, scene));
  check_arguments(arguments, scene);
  if (!arguments.out.empty()) try_output(arguments.out);
  const Answer answer = answer_of(arguments, scene);
  if (!arguments.out.empty()) write(arguments, answer);
  if (arguments.json) {
    std::puts(pretty(to_json(arguments, scene, answer)).c_str());
  } else {
    print_summary(arguments, scene, answer);
  }
  return kDone;
}

}  // namespace

CLI::App* add_query(CLI::App& app, Run& run_later) {
  const auto arguments = std::make_shared<QueryArguments>();
  ContactOptions& options = arguments->options;
  options.threads = std::max(1u, std::thread::hardware_concurrency());
  CLI::App* command = app.add_subcommand("query", "find every pair of triangles that meet in a scene");
  command->add_option("SCENE", arguments->scene, "scene file (HDF5)")->required()->check(file_name());
  add_backend(*command, arguments->backend);
  if (has_cuda()) {
    add_choice(*command, "--engine", kGpuEngines, arguments->gpu_engine,
               "on a GPU: Tandem's, or the paper's scheme, the yardstick")
        ->option_text("tandem|paper|paper-bits [tandem]");
    CLI::Option* grouped = command->add_flag("--grouped", arguments->grouped,
                                             "on a GPU: group contacts by pair there, and time that too");
    command
        ->add_flag("--sorted", arguments->sorted,
                   "on a GPU: sort pairs and contacts there, and time that too")
        ->excludes(grouped);
    command->add_flag("--traversal", arguments->traversal,
                      "on a GPU: also time the trees' walk alone, without triangle tests");
  }
  add_choice(*command, "--mode", kModes, options.mode,
             "'exact' contacts, 'fast' ones by float32, or 'boxes': candidates")
      ->option_text("exact|fast|boxes [exact]");
  command->add_flag("--first-contact", options.first_contact_only,
                    "one contact for each object pair at most");
  command
      ->add_option("--within", options.within,
                   "clearance: also triangles at most so far apart, decided exactly")
      ->check(between(0, kLargestWorldCoordinate))
      ->option_text("D [0]");
  command
      ->add_option(
          "--tolerance", arguments->tolerance,
          "only which bodies surely meet, which surely do not, and which are within T, by their levels")
      ->check(between(0, kLargestWorldCoordinate))
      ->option_text("T");
  command->add_flag("--manifolds", arguments->manifolds,
                    "also contact manifolds: normals, depths and points");
  command->add_flag("--contained", arguments->contained,
                    "also bodies that lie within others without touching them, found on the CPU");
  command->add_flag("--self", options.self_pairs, "also each instance with itself");
  CLI::Option* threads =
      command->add_option("--threads", options.threads, "threads; the contacts do not depend on them")
          ->check(CLI::Range(1u, kMostSceneThreads))
          ->option_text("N [all]");
  command->add_option("--repeat", arguments->repeats, "times to run the query, for its timing")
      ->check(CLI::Range(1, 1000000))
      ->option_text("N [1]");
  command->add_option("--out", arguments->out, "the contacts file to write; appears whole or not at all")
      ->check(file_name());
  command->add_flag("--json", arguments->json, "print the summary as JSON");
  command->final_callback([arguments, threads, &run_later] {
    arguments->threads_given = threads->count() > 0;
    run_later = [arguments] { return run(*arguments); };
  });
  return command;
}

}  // namespace tandem::bench
