#include "compare_command.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <set>

#include "bvhbench/engines/registry.h"
#include "bvhbench/scenes/hdf5_file.h"
#include "compare_distance.h"
#include "compare_impact.h"
#include "compare_results.h"

namespace tandem::bench {
namespace {

struct CompareArguments {
  std::vector<std::string> scenes, engines;
  unsigned repeats = 5;
  std::string out;
  bool json = false;
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

// Compares scene by scene, without a file of results. option: what asked for it.
template <typename Compare>
ExitCode run_scenes(const CompareArguments& arguments, const std::string& option, const Compare& compare) {
  if (!arguments.out.empty() || !arguments.engines.empty())
    throw UsageError("--out and --peers are for contacts, so " + option + " does not go with them");
  Json results = Json::array();
  for (const std::string& scene : arguments.scenes) {
    const auto compared = compare_or_refuse(scene, compare);
    if (arguments.json) {
      results.push_back(to_json(compared));
      continue;
    }
    std::fputs(to_text(compared).c_str(), stdout);
    std::fflush(stdout);
  }
  if (arguments.json) {
    const Json json = {{"tool", "bvhbench compare " + option},
                       {"version", TANDEM_VERSION},
                       {"processor", processor()},
                       {"repeats", arguments.repeats},
                       {"scenes", results}};
    std::puts(pretty(json).c_str());
  }
  return kDone;
}

ExitCode run_compare(const CompareArguments& arguments) {
  check_names(arguments.scenes);
  if (arguments.distances_within) {
    return run_scenes(arguments, "--distance", [&](const std::string& scene) {
      return compare_distances(scene, *arguments.distances_within, arguments.repeats);
    });
  }
  if (arguments.impacts_within) {
    return run_scenes(arguments, "--impact", [&](const std::string& scene) {
      return compare_impacts(scene, *arguments.impacts_within, arguments.repeats);
    });
  }
  if (!arguments.out.empty()) {
    keep_inputs(arguments.out, arguments.scenes);
    try_output(arguments.out);
  }
  const char* commit = std::getenv("TANDEM_COMMIT");
  CompareResults results = {processor(), commit == nullptr ? "" : commit, arguments.repeats, {}};
  for (const std::string& scene : arguments.scenes) {
    results.scenes.push_back(
        compare(scene, make_peers(ContactOptions(), arguments.engines), arguments.repeats));
    if (arguments.json) continue;
    std::printf("%s%s", results.scenes.size() > 1 ? "\n" : "", to_text(results.scenes.back()).c_str());
    std::fflush(stdout);
  }
  if (!arguments.out.empty()) write_results(arguments.out, results);
  if (arguments.json) std::puts(pretty(to_json(results)).c_str());
  return kDone;
}

}  // namespace

CLI::App* add_compare(CLI::App& app, Run& run) {
  CLI::App* command =
      app.add_subcommand("compare", "run scenes through Tandem and other libraries, side by side");
  const auto arguments = std::make_shared<CompareArguments>();
  command->add_option("SCENE", arguments->scenes, "scene files, .h5")->required()->check(file_name());
  command->add_option("--peers", arguments->engines, "engines, all unless given")
      ->delimiter(',')
      ->check(CLI::IsMember(peer_names()))
      ->option_text(join(peer_names()));
  command->add_option("--repeat", arguments->repeats, "timed queries of each")
      ->check(CLI::Range(1u, 100000u))
      ->option_text("N [5]");
  command->add_option("--out", arguments->out, "write the results here, as HDF5")->check(file_name());
  CLI::Option* distances = command
                               ->add_option("--distance", arguments->distances_within,
                                            "compare distances instead, of pairs that are apart and within D")
                               ->check(between(0, std::numeric_limits<double>::infinity()))
                               ->option_text("D");
  command
      ->add_option("--impact", arguments->impacts_within,
                   "compare times of impact instead, of the scene's motions for T seconds")
      ->check(between(1e-9, 1e9))
      ->option_text("T")
      ->excludes(distances);
  command->add_flag("--json", arguments->json, "print JSON");
  command->footer("Times are of one thread. docs/comparison.md says what is compared, and how.");
  command->final_callback([arguments, &run] { run = [arguments] { return run_compare(*arguments); }; });
  return command;
}

}  // namespace tandem::bench
