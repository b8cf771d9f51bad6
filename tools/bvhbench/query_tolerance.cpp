#include "query_tolerance.h"

#include "bvhbench/scenes/columns.h"
#include "common/number_words.h"

namespace tandem::bench {
namespace {

constexpr CounterRow<ToleranceCounters> kVerdicts[] = {
    {"apart", nullptr, &ToleranceCounters::apart},
    {"touching", nullptr, &ToleranceCounters::touching},
    {"within_tolerance", nullptr, &ToleranceCounters::within_tolerance},
};
constexpr CounterRow<ContactCounters> kWork[] = {
    {"block_pairs", "block pairs", &ContactCounters::block_pairs},
    {"candidates", "candidates", &ContactCounters::candidates},
};

TimedVerdicts decide(const CommonArguments& arguments, double tolerance, const LoadedScene& scene) {
  const std::vector<AssetView> shapes = scene.finest_views();
  return ask_engine(arguments, scene, shapes, ToleranceOptions{.tolerance = tolerance},
                    [](Engine& engine, const TimedQuery& asked) { return engine.time_verdicts(asked); });
}

// Returns how many pairs the levels of their bodies decided, by those of a and of b.
Json levels_of(const TimedVerdicts& decided) {
  std::map<std::pair<int, int>, std::uint64_t> counted;
  for (const PairVerdict& verdict : decided.rows) ++counted[{verdict.level_a, verdict.level_b}];
  Json levels = Json::array();
  for (const auto& [level, pairs] : counted)
    levels.push_back({{"level_a", level.first}, {"level_b", level.second}, {"pairs", pairs}});
  return levels;
}

// XXH64 of pairs and verdicts, one after the other, as a verdicts file has them.
std::uint64_t hash_of(const TimedVerdicts& decided) {
  return hash_of_columns(flat(decided.pairs), column(std::span(decided.rows), &PairVerdict::verdict));
}

Report report_of(const CommonArguments& arguments, double tolerance, const LoadedScene& scene,
                 const TimedVerdicts& decided) {
  Report report = report_of(arguments, "query", format("within %g", tolerance), decided.gpu.name);
  report.add("tolerance", tolerance);
  add_setting(report, arguments, scene);
  add_object_pairs(report, decided.pairs.size(), scene);
  report.add(kVerdicts, decided.counters);
  report["apart"].row("apart", Unit::count, "  surely");
  report["touching"].row("touching", Unit::count, "  surely");
  report["within_tolerance"].row("within tolerance");
  report.add_json("decided_at", levels_of(decided));
  report.add(kWork, decided.counters.work);
  add_outcome(report, hash_of(decided), decided.whole);
  report["seconds"].row("milliseconds", Unit::milliseconds);
  if (arguments.on_gpu()) {
    add_gpu_name(report, decided.gpu);
    add_gpu_use(report, decided.gpu);
    report.add_json("deciding_seconds", times(decided.narrow)).row("  deciding", Unit::milliseconds);
  }
  return report;
}

void add_datasets(Hdf5Output& file, const TimedVerdicts& decided) {
  const std::span<const PairVerdict> verdicts = decided.rows;
  add_pairs(file, "/pairs", decided.pairs);
  add_column(file, "/verdict/verdict", verdicts, &PairVerdict::verdict);
  add_column(file, "/verdict/level_a", verdicts, &PairVerdict::level_a);
  add_column(file, "/verdict/level_b", verdicts, &PairVerdict::level_b);
}

}  // namespace

ExitCode run_tolerance(const CommonArguments& arguments, double tolerance) {
  const LoadedScene scene = open_scene(arguments);
  const TimedVerdicts decided = decide(arguments, tolerance, scene);
  Report report = report_of(arguments, tolerance, scene, decided);
  return finish(arguments, report, [&](Hdf5Output& file) { add_datasets(file, decided); });
}

}  // namespace tandem::bench
