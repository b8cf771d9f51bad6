#include "query_tolerance.h"

#include <cstdio>

#include "backend.h"
#include "bvhbench/engines/registry.h"
#include "bvhbench/scenes/contacts_file.h"
#include "bvhbench/scenes/hdf5_file.h"
#include "bvhbench/scenes/verdicts_file.h"
#include "common/json.h"
#include "common/number_words.h"

namespace tandem::bench {
namespace {

struct Answer {
  TimedVerdicts timed;
  VerdictRecord record;
};

TimedVerdicts ask(const ToleranceArguments& arguments, const LoadedScene& scene) {
  const SceneDescription& description = scene.description;
  const std::vector<AssetView> shapes = scene.finest_views();
  const std::vector<ObjectPair> pairs = normalised(description.pairs.value_or(std::vector<ObjectPair>()));
  ExcludedPairTable excluded;
  try {
    const auto engine = make_engine(arguments.backend == "cuda" ? "tandem-cuda" : "tandem",
                                    ToleranceOptions{arguments.tolerance, arguments.threads});
    engine->set_shapes(shapes);
    engine->set_filter(description.filter.view(excluded));
    engine->update(description.instances);
    return engine->time_verdicts({description.pairs ? &pairs : nullptr, arguments.repeats});
  } catch (const EngineError& error) {
    refuse(arguments.scene, error.status, error.where);
  } catch (const GpuError& error) {
    refuse_gpu(arguments.scene, error);
  }
}

Answer answer_of(const ToleranceArguments& arguments, const LoadedScene& scene) {
  Answer answer = {ask(arguments, scene), {}};
  answer.record = {arguments.backend,
                   arguments.tolerance,
                   scene.description.pairs.has_value(),
                   arguments.backend == "cuda" ? 0 : arguments.threads,
                   answer.timed.whole,
                   answer.timed.counters};
  return answer;
}

Json times(const Seconds& seconds) {
  return {{"best", best_of(seconds)}, {"median", median_of(seconds)}, {"all", seconds}};
}

// How many pairs the levels of their bodies decided, by those of a and of b.
Json levels_of(const Answer& answer) {
  std::map<std::pair<int, int>, std::uint64_t> counted;
  for (const PairVerdict& verdict : answer.timed.rows) ++counted[{verdict.level_a, verdict.level_b}];
  Json levels = Json::array();
  for (const auto& [level, pairs] : counted)
    levels.push_back({{"level_a", level.first}, {"level_b", level.second}, {"pairs", pairs}});
  return levels;
}

Json to_json(const ToleranceArguments& arguments, const LoadedScene& scene, const Answer& answer) {
  const VerdictRecord& record = answer.record;
  const ToleranceCounters& counters = record.counters;
  Json json = {{"tool", "bvhbench query"},
               {"version", TANDEM_VERSION},
               {"scene", arguments.scene},
               {"output", arguments.out.empty() ? Json() : Json(arguments.out)},
               {"backend", record.backend},
               {"tolerance", record.tolerance},
               {"given_pairs", record.given_pairs},
               {"threads", record.threads},
               {"assets", scene.assets.size()},
               {"instances", scene.description.instances.size()},
               {"triangles", triangles_of(scene)},
               {"object_pairs", answer.timed.pairs.size()},
               {"apart", counters.apart},
               {"touching", counters.touching},
               {"within_tolerance", counters.within_tolerance},
               {"decided_at", levels_of(answer)},
               {"block_pairs", counters.work.block_pairs},
               {"candidates", counters.work.candidates},
               {"hash", hexadecimal(hash_of(answer.timed.pairs, answer.timed.rows))},
               {"seconds", times(record.seconds)}};
  if (arguments.backend == "cuda") {
    json["gpu"] = answer.timed.gpu.name;
    json["gpu_bytes"] = answer.timed.gpu.bytes;
    json["gpu_bytes_bound"] = answer.timed.gpu.bytes_bound;
    json["gpu_bytes_taken"] = answer.timed.gpu.bytes_taken;
    json["upload_seconds"] = answer.timed.gpu.upload;
    json["deciding_seconds"] = times(answer.timed.narrow);
  }
  return json;
}

void print_row(const char* label, std::uint64_t value, const char* remark = "") {
  std::printf("  %-16s %15s%s\n", label, with_commas(value).c_str(), remark);
}

void print_times(const char* label, const Seconds& seconds) {
  std::printf("  %-16s %15.3f  best of %zu, median %.3f\n", label, 1e3 * best_of(seconds), seconds.size(),
              1e3 * median_of(seconds));
}

void print_summary(const ToleranceArguments& arguments, const LoadedScene& scene, const Answer& answer) {
  const VerdictRecord& record = answer.record;
  const ToleranceCounters& counters = record.counters;
  const std::string place =
      record.backend == "cuda" ? answer.timed.gpu.name
                               : with_commas(record.threads) + (record.threads == 1 ? " thread" : " threads");
  std::printf("%s: within %g on %s, %s\n", arguments.scene.c_str(), record.tolerance, record.backend.c_str(),
              place.c_str());
  print_row("instances", scene.description.instances.size());
  print_row("object pairs", answer.timed.pairs.size(), record.given_pairs ? "  given" : "  found");
  print_row("apart", counters.apart, "  surely");
  print_row("touching", counters.touching, "  surely");
  print_row("within tolerance", counters.within_tolerance);
  print_row("block pairs", counters.work.block_pairs);
  print_row("candidates", counters.work.candidates);
  print_times("milliseconds", record.seconds);
  if (record.backend == "cuda") print_times("  deciding", answer.timed.narrow);
  std::printf("  %-16s %s\n", "hash", hexadecimal(hash_of(answer.timed.pairs, answer.timed.rows)).c_str());
}

}  // namespace

ExitCode run_tolerance(const ToleranceArguments& arguments) {
  const LoadedScene scene = read_scene(arguments.scene);
  if (!arguments.out.empty()) {
    keep_inputs(arguments.out, files_of(arguments.scene, scene));
    try_output(arguments.out);
  }
  const Answer answer = answer_of(arguments, scene);
  if (!arguments.out.empty())
    write_verdicts(arguments.out, answer.timed.pairs, answer.timed.rows, answer.record);
  if (arguments.json) {
    std::puts(pretty(to_json(arguments, scene, answer)).c_str());
  } else {
    print_summary(arguments, scene, answer);
  }
  return kDone;
}

}  // namespace tandem::bench
