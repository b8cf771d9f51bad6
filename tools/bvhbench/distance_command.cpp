#include "distance_command.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <thread>

#include "backend.h"
#include "bvhbench/engines/registry.h"
#include "bvhbench/scenes/contacts_file.h"
#include "bvhbench/scenes/distance_file.h"
#include "bvhbench/scenes/hdf5_file.h"
#include "common/json.h"
#include "common/number_words.h"

namespace tandem::bench {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct DistanceArguments {
  std::string scene, out, backend = "cpu";
  DistanceOptions options;
  std::uint32_t repeats = 1;
  bool json = false, threads_given = false;

  bool on_gpu() const { return backend == "cuda"; }
};

struct Answer {
  std::vector<ObjectPair> pairs;
  std::vector<ObjectDistance> distances;
  DistanceRecord record;
  std::uint32_t rounds = 0;  // of the GPU's
  Seconds nearest;
  GpuUse gpu;
};

// Asks as often as wanted; the answer is the last one, which is every one.
TimedDistances ask(const DistanceArguments& arguments, const LoadedScene& scene) {
  const SceneDescription& description = scene.description;
  const std::vector<AssetView> shapes = scene.views();
  const std::vector<ObjectPair> pairs = normalised(description.pairs.value_or(std::vector<ObjectPair>()));
  ExcludedPairTable excluded;
  try {
    const auto engine = make_engine(arguments.on_gpu() ? "tandem-cuda" : "tandem", arguments.options);
    engine->set_shapes(shapes);
    engine->set_filter(description.filter.view(excluded));
    engine->update(description.instances);
    return engine->time_distances({description.pairs ? &pairs : nullptr, arguments.repeats});
  } catch (const EngineError& error) {
    refuse(arguments.scene, error.status, error.where);
  } catch (const GpuError& error) {
    refuse_gpu(arguments.scene, error);
  }
}

Answer run_query(const DistanceArguments& arguments, const LoadedScene& scene) {
  TimedDistances timed = ask(arguments, scene);
  Answer answer;
  DistanceRecord& record = answer.record;
  record.backend = arguments.backend;
  record.tolerance = arguments.options.tolerance;
  record.reach = arguments.options.reach;
  record.given_pairs = scene.description.pairs.has_value();
  record.threads = arguments.on_gpu() ? 0 : arguments.options.threads;
  record.seconds = timed.whole;
  record.counters = timed.counters;
  answer.pairs = std::move(timed.pairs);
  answer.distances = std::move(timed.rows);
  answer.rounds = timed.rounds;
  answer.nearest = timed.narrow;
  answer.gpu = timed.gpu;
  return answer;
}

// Infinite where there are no pairs.
double least_upper(const std::vector<ObjectDistance>& distances) {
  double least = kInfinity;
  for (const ObjectDistance& distance : distances) least = std::min(least, distance.upper);
  return least;
}

Json times(const Seconds& seconds) {
  return {{"best", best_of(seconds)}, {"median", median_of(seconds)}, {"all", seconds}};
}

Json finite_or_null(double x) {
  return std::isfinite(x) ? Json(x) : Json();
}

Json to_json(const DistanceArguments& arguments, const LoadedScene& scene, const Answer& answer) {
  const DistanceRecord& record = answer.record;
  Json json = {{"tool", "bvhbench distance"},
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
               {"least", finite_or_null(least_upper(answer.distances))},
               {"hash", hexadecimal(hash_of(answer.pairs, answer.distances))},
               {"seconds", times(record.seconds)}};
  if (arguments.on_gpu()) {
    json["rounds"] = answer.rounds;
    json["gpu"] = answer.gpu.name;
    json["gpu_bytes"] = answer.gpu.bytes;
    json["gpu_bytes_bound"] = answer.gpu.bytes_bound;
    json["gpu_bytes_taken"] = answer.gpu.bytes_taken;
    json["upload_seconds"] = answer.gpu.upload;
    json["distances_seconds"] = times(answer.nearest);
  }
  return json;
}

void print_row(const char* label, std::uint64_t value, const char* remark = "") {
  std::printf("  %-14s %15s%s\n", label, with_commas(value).c_str(), remark);
}

void print_times(const char* label, const Seconds& seconds) {
  std::printf("  %-14s %15.3f  best of %zu, median %.3f\n", label, 1e3 * best_of(seconds), seconds.size(),
              1e3 * median_of(seconds));
}

void print_summary(const DistanceArguments& arguments, const LoadedScene& scene, const Answer& answer) {
  const DistanceRecord& record = answer.record;
  const std::string place =
      arguments.on_gpu() ? answer.gpu.name
                         : with_commas(record.threads) + (record.threads == 1 ? " thread" : " threads");
  std::printf("%s: distances on %s, %s\n", arguments.scene.c_str(), record.backend.c_str(), place.c_str());
  print_row("instances", scene.description.instances.size());
  print_row("triangles", triangles_of(scene));
  print_row("object pairs", record.counters.object_pairs, record.given_pairs ? "  given" : "  found");
  print_row("  touching", record.counters.touching);
  print_row("block pairs", record.counters.block_pairs);
  print_row("triangle pairs", record.counters.by_float32);
  print_row("  by float64", record.counters.by_float64);
  if (arguments.on_gpu()) print_row("rounds", answer.rounds);
  std::printf("  %-14s %15.6g\n", "least", least_upper(answer.distances));
  print_times("milliseconds", record.seconds);
  if (arguments.on_gpu()) print_times("  distances", answer.nearest);
  std::printf("  %-14s %s\n", "hash", hexadecimal(hash_of(answer.pairs, answer.distances)).c_str());
}

ExitCode run(const DistanceArguments& arguments) {
  if (arguments.on_gpu() && arguments.threads_given) throw UsageError("--threads is for the backend cpu");
  const LoadedScene scene = read_scene(arguments.scene);
  if (!arguments.out.empty()) {
    keep_inputs(arguments.out, files_of(arguments.scene, scene));
    try_output(arguments.out);
  }
  const Answer answer = run_query(arguments, scene);
  if (!arguments.out.empty()) write_distances(arguments.out, answer.pairs, answer.distances, answer.record);
  if (arguments.json) {
    std::puts(pretty(to_json(arguments, scene, answer)).c_str());
  } else {
    print_summary(arguments, scene, answer);
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
  add_backend(*command, arguments->backend);
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
  CLI::Option* threads =
      command->add_option("--threads", options.threads, "threads; the distances do not depend on them")
          ->check(CLI::Range(1u, kMostSceneThreads))
          ->option_text("N [all]");
  command->add_option("--repeat", arguments->repeats, "times to run the query, for its timing")
      ->check(CLI::Range(1, 1000000))
      ->option_text("N [1]");
  command->add_option("--out", arguments->out, "the distances file to write; appears whole or not at all")
      ->check(file_name());
  command->add_flag("--json", arguments->json, "print the summary as JSON");
  command->final_callback([arguments, threads, &run_later] {
    arguments->threads_given = threads->count() > 0;
    run_later = [arguments] { return run(*arguments); };
  });
  return command;
}

}  // namespace tandem::bench
