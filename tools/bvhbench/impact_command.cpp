#include "impact_command.h"

#include <cstdio>
#include <memory>
#include <thread>

#include "backend.h"
#include "bvhbench/engines/registry.h"
#include "bvhbench/scenes/contacts_file.h"
#include "bvhbench/scenes/hdf5_file.h"
#include "common/json.h"
#include "common/number_words.h"
#include "common/stopwatch.h"
#include "scene_motions.h"
#include "tandem/formats/hash.h"
#include "tandem/kernels/impact_query.h"

namespace tandem::bench {
namespace {

struct ImpactArguments {
  std::string scene, out, backend = "cpu";
  double duration = 0;
  ImpactOptions options;
  std::uint32_t repeats = 1;
  bool json = false, threads_given = false;

  bool on_gpu() const { return backend == "cuda"; }
};

// The answer, column by column as the file has it.
struct ImpactTable {
  std::vector<std::uint32_t> pairs;  // two for each row
  std::vector<double> t_safe, gap, point_a, point_b;
  std::vector<std::uint8_t> status;
  std::vector<std::uint32_t> face_a, face_b;
  std::vector<RigidMotion> motion;  // of the instances
  ImpactCounters counters;
  Seconds seconds;
  std::uint32_t rounds = 0;  // of the GPU's
  GpuUse gpu;
};

ImpactTable table_of(std::span<const ObjectPair> pairs, std::span<const Impact> impacts) {
  ImpactTable table;
  for (const ObjectPair& pair : pairs) table.pairs.insert(table.pairs.end(), {pair.a, pair.b});
  for (const Impact& impact : impacts) {
    table.t_safe.push_back(impact.t_safe);
    table.status.push_back(static_cast<std::uint8_t>(impact.status));
    table.gap.push_back(impact.gap);
    table.point_a.insert(table.point_a.end(), impact.point_a, impact.point_a + 3);
    table.point_b.insert(table.point_b.end(), impact.point_b, impact.point_b + 3);
    table.face_a.push_back(impact.face_a);
    table.face_b.push_back(impact.face_b);
  }
  return table;
}

// Asks as often as wanted; the answer is every one's.
TimedImpacts ask(const ImpactArguments& arguments, const LoadedScene& scene,
                 const std::vector<RigidMotion>& motion) {
  const SceneDescription& description = scene.description;
  const std::vector<AssetView> shapes = scene.views();
  const std::vector<ObjectPair> pairs = normalised(description.pairs.value_or(std::vector<ObjectPair>()));
  ExcludedPairTable excluded;
  try {
    const auto engine = make_engine(arguments.on_gpu() ? "tandem-cuda" : "tandem", arguments.options);
    engine->set_shapes(shapes);
    engine->set_filter(description.filter.view(excluded));
    engine->set_motion(motion, arguments.duration);
    engine->update(description.instances);
    return engine->time_impacts({description.pairs ? &pairs : nullptr, arguments.repeats});
  } catch (const EngineError& error) {
    refuse(arguments.scene, error.status, error.where);
  } catch (const GpuError& error) {
    refuse_gpu(arguments.scene, error);
  }
}

ImpactTable run_query(const ImpactArguments& arguments, const LoadedScene& scene) {
  const std::vector<RigidMotion> motion = motions_of(arguments.scene, scene);
  const TimedImpacts timed = ask(arguments, scene, motion);
  ImpactTable table = table_of(timed.pairs, timed.rows);
  table.motion = motion;
  table.counters = timed.counters;
  table.seconds = timed.whole;
  table.rounds = timed.rounds;
  table.gpu = timed.gpu;
  return table;
}

// XXH64 of the file's datasets of pairs and impacts, each hash the seed of the next one.
std::uint64_t hash_of(const ImpactTable& table) {
  std::uint64_t hash = 0;
  const auto add = [&](const auto& column) {
    hash = xxh64(column.data(), column.size() * sizeof column[0], hash);
  };
  add(table.pairs);
  add(table.t_safe);
  add(table.status);
  add(table.gap);
  add(table.point_a);
  add(table.point_b);
  add(table.face_a);
  add(table.face_b);
  return hash;
}

std::vector<double> vectors(const std::vector<RigidMotion>& motion, double (RigidMotion::*member)[3]) {
  std::vector<double> all;
  for (const RigidMotion& of_each : motion) {
    all.insert(all.end(), of_each.*member, of_each.*member + 3);
  }
  return all;
}

std::uint32_t threads_of(const ImpactArguments& arguments) {
  return arguments.on_gpu() ? 0 : arguments.options.threads;
}

void write(const ImpactArguments& arguments, const ImpactTable& table) {
  const std::size_t m = table.t_safe.size(), n = table.motion.size();
  Hdf5Output file(arguments.out);
  file.add("/pairs", {m, 2}, table.pairs);
  file.add("/impact/t_safe", {m}, table.t_safe);
  file.add("/impact/status", {m}, table.status);
  file.add("/impact/gap", {m}, table.gap);
  file.add("/impact/point_a", {m, 3}, table.point_a);
  file.add("/impact/point_b", {m, 3}, table.point_b);
  file.add("/impact/face_a", {m}, table.face_a);
  file.add("/impact/face_b", {m}, table.face_b);
  file.add("/motion/velocity", {n, 3}, vectors(table.motion, &RigidMotion::velocity));
  file.add("/motion/angular_velocity", {n, 3}, vectors(table.motion, &RigidMotion::angular_velocity));
  file.add("/motion/centre", {n, 3}, vectors(table.motion, &RigidMotion::center));
  file.attribute("tandem_version", std::string(TANDEM_VERSION));
  file.attribute("backend", arguments.backend);
  file.attribute("dt", arguments.duration);
  file.attribute("tolerance", arguments.options.tolerance);
  file.attribute("threads", std::uint64_t{threads_of(arguments)});
  file.attribute("repeats", std::uint64_t{table.seconds.size()});
  file.attribute("best_seconds", best_of(table.seconds));
  file.attribute("median_seconds", median_of(table.seconds));
  const ImpactCounters& counters = table.counters;
  file.attribute("object_pairs", counters.object_pairs);
  file.attribute("at_start", counters.at_start);
  file.attribute("found", counters.found);
  file.attribute("walks", counters.walks);
  file.attribute("block_pairs", counters.block_pairs);
  file.attribute("triangle_pairs", counters.triangle_pairs);
  file.attribute("advanced", counters.advanced);
  file.attribute("steps", counters.steps);
  file.attribute("most_steps", counters.most_steps);
  file.attribute("unconverged", counters.unconverged);
  file.attribute("hash", hexadecimal(hash_of(table)));
  file.write();
}

Json to_json(const ImpactArguments& arguments, const LoadedScene& scene, const ImpactTable& table) {
  const ImpactCounters& counters = table.counters;
  Json json = {
      {"tool", "bvhbench impact"},
      {"version", TANDEM_VERSION},
      {"scene", arguments.scene},
      {"output", arguments.out.empty() ? Json() : Json(arguments.out)},
      {"backend", arguments.backend},
      {"dt", arguments.duration},
      {"tolerance", arguments.options.tolerance},
      {"given_pairs", scene.description.pairs.has_value()},
      {"threads", threads_of(arguments)},
      {"instances", scene.description.instances.size()},
      {"object_pairs", counters.object_pairs},
      {"at_start", counters.at_start},
      {"found", counters.found},
      {"walks", counters.walks},
      {"block_pairs", counters.block_pairs},
      {"triangle_pairs", counters.triangle_pairs},
      {"advanced", counters.advanced},
      {"steps", counters.steps},
      {"most_steps", counters.most_steps},
      {"unconverged", counters.unconverged},
      {"hash", hexadecimal(hash_of(table))},
      {"seconds",
       {{"best", best_of(table.seconds)}, {"median", median_of(table.seconds)}, {"all", table.seconds}}}};
  if (arguments.on_gpu()) {
    json["rounds"] = table.rounds;
    json["gpu"] = table.gpu.name;
    json["gpu_bytes"] = table.gpu.bytes;
    json["gpu_bytes_bound"] = table.gpu.bytes_bound;
    json["gpu_bytes_taken"] = table.gpu.bytes_taken;
    json["upload_seconds"] = table.gpu.upload;
  }
  return json;
}

void print_row(const char* label, std::uint64_t value) {
  std::printf("  %-14s %15s\n", label, with_commas(value).c_str());
}

void print_summary(const ImpactArguments& arguments, const LoadedScene& scene, const ImpactTable& table) {
  const ImpactCounters& counters = table.counters;
  const std::uint32_t threads = threads_of(arguments);
  const std::string place =
      arguments.on_gpu() ? table.gpu.name : with_commas(threads) + (threads == 1 ? " thread" : " threads");
  std::printf("%s: impacts within %g s on %s, %s\n", arguments.scene.c_str(), arguments.duration,
              arguments.backend.c_str(), place.c_str());
  print_row("instances", scene.description.instances.size());
  print_row("object pairs", counters.object_pairs);
  print_row("  touch already", counters.at_start);
  print_row("  meet", counters.found);
  print_row("block pairs", counters.block_pairs);
  print_row("triangle pairs", counters.triangle_pairs);
  print_row("  advanced", counters.advanced);
  print_row("  steps", counters.steps);
  if (arguments.on_gpu()) print_row("rounds", table.rounds);
  std::printf("  %-14s %15.3f  best of %zu, median %.3f\n", "milliseconds", 1e3 * best_of(table.seconds),
              table.seconds.size(), 1e3 * median_of(table.seconds));
  std::printf("  %-14s %s\n", "hash", hexadecimal(hash_of(table)).c_str());
}

ExitCode run(const ImpactArguments& arguments) {
  if (arguments.on_gpu() && arguments.threads_given) throw UsageError("--threads is for the backend cpu");
  const LoadedScene scene = read_scene(arguments.scene);
  if (!arguments.out.empty()) keep_inputs(arguments.out, files_of(arguments.scene, scene));
  if (!arguments.out.empty()) try_output(arguments.out);
  const ImpactTable table = run_query(arguments, scene);
  if (!arguments.out.empty()) write(arguments, table);
  if (arguments.json) {
    std::puts(pretty(to_json(arguments, scene, table)).c_str());
  } else {
    print_summary(arguments, scene, table);
  }
  return kDone;
}

}  // namespace

CLI::App* add_impact(CLI::App& app, Run& run_later) {
  const auto arguments = std::make_shared<ImpactArguments>();
  ImpactOptions& options = arguments->options;
  options.threads = std::max(1u, std::thread::hardware_concurrency());
  CLI::App* command = app.add_subcommand("impact", "find when the moving instances of a scene meet");
  command->add_option("SCENE", arguments->scene, "scene file (HDF5) with /simulation/velocity")
      ->required()
      ->check(file_name());
  command->add_option("--dt", arguments->duration, "the step in which they move, in seconds")
      ->required()
      ->check(between(0, 1e9))
      ->option_text("T");
  add_backend(*command, arguments->backend);
  command
      ->add_option("--tolerance", options.tolerance,
                   "how near triangles stop, as a part of the smaller body's diagonal")
      ->check(between(0, 1))
      ->option_text("R [1e-6]");
  CLI::Option* threads =
      command->add_option("--threads", options.threads, "threads; the impacts do not depend on them")
          ->check(CLI::Range(1u, kMostSceneThreads))
          ->option_text("N [all]");
  command->add_option("--repeat", arguments->repeats, "times to run the query, for its timing")
      ->check(CLI::Range(1, 1000000))
      ->option_text("N [1]");
  command->add_option("--out", arguments->out, "the file to write; appears whole or not at all")
      ->check(file_name());
  command->add_flag("--json", arguments->json, "print the summary as JSON");
  command->final_callback([arguments, threads, &run_later] {
    arguments->threads_given = threads->count() > 0;
    run_later = [arguments] { return run(*arguments); };
  });
  return command;
}

}  // namespace tandem::bench
