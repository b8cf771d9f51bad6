#include "distance_command.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <new>
#include <thread>

#include "common/json.h"
#include "common/number_words.h"
#include "scenes/contacts_file.h"
#include "scenes/distance_file.h"
#include "scenes/hdf5_file.h"

namespace tandem::bench {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct DistanceArguments {
  std::string scene, out;
  DistanceOptions options;
  std::uint32_t repeats = 1;
  bool json = false;
};

void require(const std::string& scene, const DistanceQuery& query, Status status) {
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status != Status::kOk) refuse(scene, status, query.where());
}

// Runs the query as often as asked; the answer is the last run's, which is every run's.
DistanceRecord run_query(const DistanceArguments& arguments, const Scene& scene, DistanceQuery& query) {
  const SceneDescription& description = scene.description;
  const std::vector<ObjectPair> pairs = normalised(description.pairs.value_or(std::vector<ObjectPair>()));
  ExcludedPairTable excluded;
  const PairFilter filter = description.filter.view(excluded);
  DistanceOptions options = arguments.options;
  options.filter = &filter;
  DistanceRecord record;
  record.backend = "cpu";
  record.tolerance = options.tolerance;
  record.reach = options.reach;
  record.given_pairs = description.pairs.has_value();
  record.threads = options.threads;
  require(arguments.scene, query, query.set_assets(scene.views()));
  for (std::uint32_t i = 0; i < arguments.repeats; ++i) {
    Stopwatch watch;
    const Status status = description.pairs ? query.find_distances(description.instances, pairs, options)
                                            : query.find_distances(description.instances, options);
    record.seconds.push_back(watch.lap());
    require(arguments.scene, query, status);
  }
  record.counters = query.counters();
  return record;
}

// Infinite where there are no pairs.
double least_upper(const DistanceQuery& query) {
  double least = kInfinity;
  for (const ObjectDistance& distance : query.distances()) least = std::min(least, distance.upper);
  return least;
}

Json finite_or_null(double x) {
  return std::isfinite(x) ? Json(x) : Json();
}

Json to_json(const DistanceArguments& arguments, const Scene& scene, const DistanceRecord& record,
             const DistanceQuery& query) {
  return {
      {"tool", "bvhbench distance"},
      {"version", TANDEM_VERSION},
      {"scene", arguments.scene},
      {"output", arguments.out.empty() ? Json() : Json(arguments.out)},
      {"backend", record.backend},
      {"reach", finite_or_null(record.reach)},
      {"absolute_tolerance", record.tolerance.absolute},
      {"relative_tolerance", record.tolerance.relative},
      {"given_pairs", record.given_pairs},
      {"threads", record.threads},
      {"assets", scene.assets.size()},
      {"instances", scene.description.instances.size()},
      {"triangles", triangles_of(scene)},
      {"object_pairs", record.counters.object_pairs},
      {"touching", record.counters.touching},
      {"block_pairs", record.counters.block_pairs},
      {"by_float32", record.counters.by_float32},
      {"by_float64", record.counters.by_float64},
      {"least", finite_or_null(least_upper(query))},
      {"hash", hexadecimal(hash_of(query.pairs(), query.distances()))},
      {"seconds",
       {{"best", best_of(record.seconds)}, {"median", median_of(record.seconds)}, {"all", record.seconds}}}};
}

void print_row(const char* label, std::uint64_t value, const char* remark = "") {
  std::printf("  %-14s %15s%s\n", label, with_commas(value).c_str(), remark);
}

void print_summary(const DistanceArguments& arguments, const Scene& scene, const DistanceRecord& record,
                   const DistanceQuery& query) {
  std::printf("%s: distances on %s, %s %s\n", arguments.scene.c_str(), record.backend.c_str(),
              with_commas(record.threads).c_str(), record.threads == 1 ? "thread" : "threads");
  print_row("instances", scene.description.instances.size());
  print_row("triangles", triangles_of(scene));
  print_row("object pairs", record.counters.object_pairs, record.given_pairs ? "  given" : "  found");
  print_row("  touching", record.counters.touching);
  print_row("block pairs", record.counters.block_pairs);
  print_row("triangle pairs", record.counters.by_float32);
  print_row("  by float64", record.counters.by_float64);
  std::printf("  %-14s %15.6g\n", "least", least_upper(query));
  std::printf("  %-14s %15.3f  best of %zu, median %.3f\n", "milliseconds", 1e3 * best_of(record.seconds),
              record.seconds.size(), 1e3 * median_of(record.seconds));
  std::printf("  %-14s %s\n", "hash", hexadecimal(hash_of(query.pairs(), query.distances())).c_str());
}

ExitCode run(const DistanceArguments& arguments) {
  const Scene scene = read_scene(arguments.scene);
  if (!arguments.out.empty()) {
    keep_inputs(arguments.out, files_of(arguments.scene, scene));
    try_output(arguments.out);
  }
  DistanceQuery query;
  const DistanceRecord record = run_query(arguments, scene, query);
  if (!arguments.out.empty()) write_distances(arguments.out, query.pairs(), query.distances(), record);
  if (arguments.json) {
    std::puts(pretty(to_json(arguments, scene, record, query)).c_str());
  } else {
    print_summary(arguments, scene, record, query);
  }
  return kDone;
}

}  // namespace

CLI::App* add_distance(CLI::App& app, Run& run_later) {
  const auto arguments = std::make_shared<DistanceArguments>();
  DistanceOptions& options = arguments->options;
  options.threads = std::max(1u, std::thread::hardware_concurrency());
  CLI::App* command = app.add_subcommand("distance", "find how near the bodies of a scene are");
  command->add_option("SCENE", arguments->scene, "scene file (HDF5)")->required()->check(file_name());
  command->add_option("--reach", options.reach, "pairs farther apart than this are only told to be so")
      ->check(between(0, kInfinity))
      ->option_text("D [no limit]");
  command
      ->add_option("--tolerance", options.tolerance.relative,
                   "how wide the interval of a distance may be, relative to it")
      ->check(between(0, 1))
      ->option_text("R [1e-6]");
  command
      ->add_option("--absolute", options.tolerance.absolute,
                   "or how wide in units of length, if that is more")
      ->check(between(0, kInfinity))
      ->option_text("A [0]");
  command->add_option("--threads", options.threads, "threads; the distances do not depend on them")
      ->check(CLI::Range(1u, kMostQueryThreads))
      ->option_text("N [all]");
  command->add_option("--repeat", arguments->repeats, "times to run the query, for its timing")
      ->check(CLI::Range(1, 1000000))
      ->option_text("N [1]");
  command->add_option("--out", arguments->out, "the distances file to write; appears whole or not at all")
      ->check(file_name());
  command->add_flag("--json", arguments->json, "print the summary as JSON");
  command->final_callback([arguments, &run_later] { run_later = [arguments] { return run(*arguments); }; });
  return command;
}

}  // namespace tandem::bench
