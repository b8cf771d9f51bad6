#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>

#include "bvhbench/engines/registry.h"
#include "command.h"
#include "compare_distance.h"
#include "compare_impact.h"
#include "compare_results.h"

namespace tandem::bench {
namespace {

struct CompareArguments : CommonArguments {
  CompareArguments() { repeats = 5; }

  std::vector<std::string> scenes, engines;
  std::optional<double> distances_within;  ///< distances are compared, not contacts
  std::optional<double> impacts_within;    ///< times of impact are compared, not contacts
};

std::string join(const std::vector<std::string_view>& words) {
  std::string joined;
  for (const std::string_view word : words) joined += (joined.empty() ? "" : ",") + std::string(word);
  return joined;
}

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return line.substr(std::min(line.find(": ") + 2, line.size()));
  }
  return "unknown";
}

// Results are filed under the scenes' names.
void check_names(const std::vector<std::string>& scenes) {
  std::set<std::string> names;
  for (const std::string& scene : scenes) {
    if (names.insert(std::filesystem::path(scene).stem().string()).second) continue;
    throw UsageError(scene + ": another scene has the same name");
  }
}

// Calls compare(scene); ends the command where Tandem refuses the scene.
template <typename Compare>
auto compare_or_refuse(const std::string& scene, const Compare& compare) {
  try {
    return compare(scene);
  } catch (const EngineError& error) {
    refuse(scene, error.status, error.where);
  }
}

// Compares scene by scene, and prints the text of each at once. Result: what JSON says of them.
template <typename Compare>
Json compare_scenes(const CompareArguments& arguments, const char* between, const Compare& compare) {
  Json scenes = Json::array();
  for (const std::string& scene : arguments.scenes) {
    const Report report = compare_or_refuse(scene, compare);
    scenes.push_back(report.json());
    if (arguments.json) continue;
    std::printf("%s%s", scenes.size() > 1 ? between : "", report.text().c_str());
    std::fflush(stdout);
  }
  return scenes;
}

// A comparison without a file of results. option: what asked for it.
template <typename Compare>
ExitCode run_without_file(const CompareArguments& arguments, const std::string& option,
                          const Compare& compare) {
  if (!arguments.output.empty() || !arguments.engines.empty())
    throw UsageError("--out and --peers are for contacts, so " + option + " does not go with them");
  Report report;
  report.add({{"tool", "bvhbench compare " + option},
              {"version", TANDEM_VERSION},
              {"processor", processor()},
              {"repeats", arguments.repeats},
              {"scenes", compare_scenes(arguments, "", compare)}});
  print(arguments, report);
  return kDone;
}

ExitCode run_compare(const CompareArguments& arguments) {
  check_names(arguments.scenes);
  if (arguments.distances_within) {
    return run_without_file(arguments, "--distance", [&](const std::string& scene) {
      return report_of(compare_distances(scene, *arguments.distances_within, arguments.repeats));
    });
  }
  if (arguments.impacts_within) {
    return run_without_file(arguments, "--impact", [&](const std::string& scene) {
      return report_of(compare_impacts(scene, *arguments.impacts_within, arguments.repeats));
    });
  }
  check_output(arguments, arguments.scenes);
  if (!arguments.output.empty()) {
    for (const std::string& scene : arguments.scenes)
      for (const std::string& asset : read_description(scene).assets)
        keep_inputs(arguments.output, {beside(scene, asset)});
  }
  const char* commit = std::getenv("TANDEM_COMMIT");
  CompareResults results = {processor(), commit == nullptr ? "" : commit, arguments.repeats, {}};
  Json scenes = compare_scenes(arguments, "\n", [&](const std::string& scene) {
    results.scenes.push_back(
        compare(scene, make_peers(ContactOptions(), arguments.engines), arguments.repeats));
    return report_of(results.scenes.back());
  });
  if (!arguments.output.empty()) write_results(arguments.output, results);
  Report report;
  report.add({{"machine", results.machine},
              {"commit", or_null(results.commit)},
              {"repeats", results.repeats},
              {"scenes", std::move(scenes)}});
  print(arguments, report);
  return kDone;
}

std::string peer_defect(const std::string& name) {
  const auto names = peer_names();
  return one_of({names.begin(), names.end()})(name);
}

}  // namespace

void add_compare(Command tool, Run& run_later) {
  const auto [command, arguments] = add_command<CompareArguments>(
      tool, run_later, "compare", "run scenes through Tandem and other libraries, side by side", run_compare);
  command.add({required({"SCENE", arguments.scenes, "", "scene files, .h5", file_name()}),
               separated_by_commas({"--peers", arguments.engines, join(peer_names()),
                                    "engines, all unless given", peer_defect}),
               {"--repeat", arguments.repeats, "N [5]", "timed queries of each", between(1, 100000)},
               output_option(arguments, "write the results here, as HDF5"),
               {"--distance", arguments.distances_within, "D",
                "compare distances instead, of pairs that are apart and within D",
                between(0, std::numeric_limits<double>::infinity())},
               {"--impact", arguments.impacts_within, "T",
                "compare times of impact instead, of the scene's motions for T seconds", between(1e-9, 1e9)},
               {"--json", arguments.json, "print JSON"}});
  command.exclude("--impact", "--distance");
  command.end_help("Times are of one thread. docs/comparison.md says what is compared, and how.");
}

}  // namespace tandem::bench
