#include <limits>

#include "bvhbench/scenes/columns.h"
#include "question.h"

namespace tandem::bench {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct DistanceArguments : CommonArguments {
  DistanceTolerance tolerance;
  double reach = kInfinity;
};

constexpr CounterRow<DistanceCounters> kDistanceCounters[] = {
    {"touching", "  touching", &DistanceCounters::touching},
    {"block_pairs", "block pairs", &DistanceCounters::block_pairs},
    {"by_float32", "triangle pairs", &DistanceCounters::by_float32},
    {"by_float64", "  by float64", &DistanceCounters::by_float64},
};

// The answer is every run's.
TimedDistances find(const DistanceArguments& arguments, const LoadedScene& scene) {
  const std::vector<AssetView> shapes = scene.views();
  const DistanceOptions options = {.tolerance = arguments.tolerance, .reach = arguments.reach};
  return ask_engine(arguments, scene, shapes, options,
                    [](Engine& engine, const TimedQuery& asked) { return engine.time_distances(asked); });
}

// Infinite where there are no pairs.
double least_upper(const std::vector<ObjectDistance>& distances) {
  double least = kInfinity;
  for (const ObjectDistance& distance : distances) least = std::min(least, distance.upper);
  return least;
}

// XXH64 of pairs and of lower and upper bounds, one after the other, as a distances file has them.
std::uint64_t hash_of(const TimedDistances& found) {
  const std::span<const ObjectDistance> distances = found.rows;
  return hash_of_columns(flat(found.pairs), column(distances, &ObjectDistance::lower),
                         column(distances, &ObjectDistance::upper));
}

Report report_of(const DistanceArguments& arguments, const LoadedScene& scene, const TimedDistances& found) {
  Report report = report_of(arguments, "distance", "distances", found.gpu.name);
  report.add({{"reach", arguments.reach},
              {"absolute_tolerance", arguments.tolerance.absolute},
              {"relative_tolerance", arguments.tolerance.relative}});
  add_setting(report, arguments, scene);
  report["triangles"].row("triangles");
  add_object_pairs(report, found.counters.object_pairs, scene);
  report.add(kDistanceCounters, found.counters);
  report.add_json("least", least_upper(found.rows));
  add_outcome(report, hash_of(found), found.whole);
  if (arguments.on_gpu()) {
    report.add_json("rounds", found.rounds).row("rounds");
    add_gpu_name(report, found.gpu);
    add_gpu_use(report, found.gpu);
    report.add_json("distances_seconds", times(found.narrow));
  }
  report["least"].row("least", Unit::length);
  report["seconds"].row("milliseconds", Unit::milliseconds);
  if (arguments.on_gpu()) report["distances_seconds"].row("  distances", Unit::milliseconds);
  return report;
}

void add_datasets(Hdf5Output& file, const TimedDistances& found) {
  const std::span<const ObjectDistance> distances = found.rows;
  add_pairs(file, "/pairs", found.pairs);
  add_column(file, "/distance/lower", distances, &ObjectDistance::lower);
  add_column(file, "/distance/upper", distances, &ObjectDistance::upper);
  add_column(file, "/distance/point_a", distances, &ObjectDistance::point_a);
  add_column(file, "/distance/point_b", distances, &ObjectDistance::point_b);
  add_column(file, "/distance/face_a", distances, &ObjectDistance::face_a);
  add_column(file, "/distance/face_b", distances, &ObjectDistance::face_b);
}

ExitCode run_distance(const DistanceArguments& arguments) {
  const LoadedScene scene = open_scene(arguments);
  const TimedDistances found = find(arguments, scene);
  Report report = report_of(arguments, scene, found);
  return finish(arguments, report, [&](Hdf5Output& file) { add_datasets(file, found); });
}

}  // namespace

void add_distance(Command tool, Run& run_later) {
  const auto [command, arguments] = add_command<DistanceArguments>(
      tool, run_later, "distance", "find how near the bodies of a scene are", run_distance);
  command.add({scene_argument(arguments),
               backend_option(arguments),
               {"--reach", arguments.reach, "D [no limit]",
                "pairs farther apart than this are only told to be so", between(0, kInfinity)},
               {"--tolerance", arguments.tolerance.relative, "R [1e-6]",
                "how wide the interval of a distance may be, relative to it", between(0, 1)},
               {"--absolute", arguments.tolerance.absolute, "A [0]",
                "or how wide in units of length, if that is more", between(0, kInfinity)},
               threads_option(arguments, "the distances do"),
               repeat_option(arguments),
               output_option(arguments, "the distances file to write; appears whole or not at all"),
               json_option(arguments)});
}

}  // namespace tandem::bench
