#include "bvhbench/scenes/columns.h"
#include "common/number_words.h"
#include "question.h"
#include "scene_motions.h"

namespace tandem::bench {
namespace {

struct ImpactArguments : CommonArguments {
  double duration = 0;
  double tolerance = ImpactOptions().tolerance;
};

constexpr CounterRow<ImpactCounters> kImpactCounters[] = {
    {"object_pairs", "object pairs", &ImpactCounters::object_pairs},
    {"at_start", "  touch already", &ImpactCounters::at_start},
    {"found", "  meet", &ImpactCounters::found},
    {"walks", nullptr, &ImpactCounters::walks},
    {"block_pairs", "block pairs", &ImpactCounters::block_pairs},
    {"triangle_pairs", "triangle pairs", &ImpactCounters::triangle_pairs},
    {"advanced", "  advanced", &ImpactCounters::advanced},
    {"steps", "  steps", &ImpactCounters::steps},
    {"most_steps", nullptr, &ImpactCounters::most_steps},
    {"unconverged", nullptr, &ImpactCounters::unconverged},
};

// The answer is every run's.
TimedImpacts find(const ImpactArguments& arguments, const LoadedScene& scene,
                  const std::vector<RigidMotion>& motion) {
  const std::vector<AssetView> shapes = scene.views();
  const ImpactOptions options = {.tolerance = arguments.tolerance};
  const auto time = [](Engine& engine, const TimedQuery& asked) { return engine.time_impacts(asked); };
  return ask_engine(arguments, scene, shapes, options, time, motion, arguments.duration);
}

// Calls use(name, column) for each column of the impacts, in the order of the file.
template <typename Use>
void for_each_column(const Use& use) {
  use("t_safe", &Impact::t_safe);
  use("status", &Impact::status);
  use("gap", &Impact::gap);
  use("point_a", &Impact::point_a);
  use("point_b", &Impact::point_b);
  use("face_a", &Impact::face_a);
  use("face_b", &Impact::face_b);
}

// XXH64 of the file's datasets of pairs and impacts, each hash the seed of the next one.
std::uint64_t hash_of(const TimedImpacts& found) {
  std::uint64_t hash = 0;
  const auto add = [&](const auto& values) {
    hash = xxh64(values.data(), values.size() * sizeof values[0], hash);
  };
  add(flat(found.pairs));
  for_each_column([&](const char*, auto member) { add(column(std::span(found.rows), member)); });
  return hash;
}

Report report_of(const ImpactArguments& arguments, const LoadedScene& scene, const TimedImpacts& found) {
  Report report =
      report_of(arguments, "impact", format("impacts within %g s", arguments.duration), found.gpu.name);
  report.add("dt", arguments.duration);
  report.add("tolerance", arguments.tolerance);
  report.add_json("given_pairs", scene.description.pairs.has_value());
  add_threads(report, arguments);
  report.add_json("instances", scene.description.instances.size()).row("instances");
  report.add(kImpactCounters, found.counters);
  add_outcome(report, hash_of(found), found.whole);
  if (arguments.on_gpu()) {
    report.add_json("rounds", found.rounds).row("rounds");
    add_gpu_name(report, found.gpu);
    add_gpu_use(report, found.gpu);
  }
  report["seconds"].row("milliseconds", Unit::milliseconds);
  return report;
}

void add_datasets(Hdf5Output& file, const TimedImpacts& found, std::span<const RigidMotion> motion) {
  const std::span<const Impact> impacts = found.rows;
  add_pairs(file, "/pairs", found.pairs);
  for_each_column([&](const char* name, auto member) {
    add_column(file, std::string("/impact/") + name, impacts, member);
  });
  add_column(file, "/motion/velocity", motion, &RigidMotion::velocity);
  add_column(file, "/motion/angular_velocity", motion, &RigidMotion::angular_velocity);
  add_column(file, "/motion/centre", motion, &RigidMotion::centre);
}

ExitCode run_impact(const ImpactArguments& arguments) {
  const LoadedScene scene = open_scene(arguments);
  const std::vector<RigidMotion> motion = motions_of(arguments.scene, scene);
  const TimedImpacts found = find(arguments, scene, motion);
  Report report = report_of(arguments, scene, found);
  return finish(arguments, report, [&](Hdf5Output& file) { add_datasets(file, found, motion); });
}

}  // namespace

void add_impact(Command tool, Run& run_later) {
  const auto [command, arguments] = add_command<ImpactArguments>(
      tool, run_later, "impact", "find when the moving instances of a scene meet", run_impact);
  command.add({scene_argument(arguments, "scene file (HDF5) with /simulation/velocity"),
               required({"--dt", arguments.duration, "T", "the step in which they move, in seconds",
                         between(0, 1e9)}),
               backend_option(arguments),
               {"--tolerance", arguments.tolerance, "R [1e-6]",
                "how near triangles stop, as a part of the smaller body's diagonal", between(0, 1)},
               threads_option(arguments, "the impacts do"),
               repeat_option(arguments),
               output_option(arguments, "the file to write; appears whole or not at all"),
               json_option(arguments)});
}

}  // namespace tandem::bench
