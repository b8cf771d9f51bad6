#include <limits>

#include "bvhbench/engines/registry.h"
#include "bvhbench/scenes/columns.h"
#include "question.h"

namespace tandem::bench {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct DistanceArguments : CommonArguments {
  DistanceTolerance tolerance;
  double reach = kInfinity;
};

constexpr CounterRow<DistanceCounters> kCounters[] = {
    {"touching", "  touching", &DistanceCounters::touching},
    {"block_pairs", "block pairs", &DistanceCounters::block_pairs},
    {"by_float32", "triangle pairs", &DistanceCounters::by_float32},
    {"by_float64", "  by float64", &DistanceCounters::by_float64},
};

TimedDistances find_on_cpu(const DistanceArguments& arguments, const BodiesApart& bodies) {
  DistanceOptions options;
  options.tolerance = bodies.tolerance;
  options.reach = bodies.reach;
  options.threads = arguments.threads();
  options.filter = &bodies.filter;
  DistanceQuery query;
  auto found = time_on_cpu<TimedDistances>(arguments, bodies, query, [&](const auto&... given) {
    return query.find_distances(bodies.bodies, given..., options);
  });
  found.distances.assign(query.distances().begin(), query.distances().end());
  return found;
}

// The answer is every run's.
TimedDistances find(const DistanceArguments& arguments, const LoadedScene& scene) {
  const std::vector<AssetView> shapes = scene.views();
  const ScenePairs pairs(scene.description);
  const BodiesApart bodies = {
      shapes,        scene.description.instances, arguments.tolerance, arguments.reach, pairs.given(),
      pairs.filter()};
  return answer_of(arguments.scene, scene, [&] {
    return arguments.on_gpu() ? distances_on_gpu()(bodies, arguments.repeats)
                              : find_on_cpu(arguments, bodies);
  });
}

// Infinite where there are no pairs.
double least_upper(const std::vector<ObjectDistance>& distances) {
  double least = kInfinity;
  for (const ObjectDistance& distance : distances) least = std::min(least, distance.upper);
  return least;
}

// XXH64 of pairs and of lower and upper bounds, one after the other, as a distances file has them.
std::uint64_t hash_of(const TimedDistances& found) {
  const std::span<const ObjectDistance> distances = found.distances;
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
  report.add(kCounters, found.counters);
  report.add_json("least", least_upper(found.distances));
  add_outcome(report, hash_of(found), found.seconds);
  if (arguments.on_gpu()) {
    report.add_json("rounds", found.rounds).row("rounds");
    add_gpu_name(report, found.gpu);
    add_gpu_use(report, found.gpu);
    report.add_json("distances_seconds", times(found.nearest));
  }
  report["least"].row("least", Unit::length);
  report["seconds"].row("milliseconds", Unit::milliseconds);
  if (arguments.on_gpu()) report["distances_seconds"].row("  distances", Unit::milliseconds);
  return report;
}

void add_datasets(Hdf5Output& file, const TimedDistances& found) {
  const std::span<const ObjectDistance> distances = found.distances;
  add_pairs(file, "/pairs", found.pairs);
  add_column(file, "/distance/lower", distances, &ObjectDistance::lower);
  add_column(file, "/distance/upper", distances, &ObjectDistance::upper);
  add_column(file, "/distance/point_a", distances, &ObjectDistance::point_a);
  add_column(file, "/distance/point_b", distances, &ObjectDistance::point_b);
  add_column(file, "/distance/face_a", distances, &ObjectDistance::face_a);
  add_column(file, "/distance/face_b", distances, &ObjectDistance::face_b);
}

ExitCode run(const DistanceArguments& arguments) {
  const LoadedScene scene = open_scene(arguments);
  const TimedDistances found = find(arguments, scene);
  Report report = report_of(arguments, scene, found);
  return finish(arguments, report, [&](Hdf5Output& file) { add_datasets(file, found); });
}

}  // namespace

void add_distance(CLI::App& app, Run& run_later) {
  const auto [command, arguments] = add_command<DistanceArguments>(
      app, run_later, "distance", "find how near the bodies of a scene are", run);
  add_options(command, {scene_argument(arguments),
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
