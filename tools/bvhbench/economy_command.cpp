#include <tbb/global_control.h>

#include <charconv>
#include <cmath>

#include "bvhbench/economy/choice.h"
#include "bvhbench/scenes/hdf5_file.h"
#include "bvhbench/scenes/scene_motion.h"
#include "common/number_words.h"
#include "common/random_pose.h"
#include "economy_report.h"

namespace tandem::bench {
namespace {

using economy::Candidates;
using economy::LevelMeasurer;
using economy::Levels;
using economy::Measures;

// The number of "0.01" or "1%".
std::optional<double> tolerance_in(const std::string& text) {
  const std::optional<double> number =
      number_in(text.ends_with('%') ? text.substr(0, text.size() - 1) : text);
  return number && std::isfinite(*number) && *number >= 0 ? number : std::nullopt;
}

std::string tolerance_defect(const std::string& text) {
  return tolerance_in(text) ? "" : text + " is neither a length nor per cent of the diagonal";
}

void take_tolerance(const std::string& text, EconomyArguments& arguments) {
  arguments.relative = text.ends_with('%');
  arguments.tolerance = *tolerance_in(text) / (arguments.relative ? 100 : 1);
}

Candidates candidates_of(LevelMeasurer& measurer) {
  Candidates candidates;
  candidates.asset_of = measurer.asset_of();
  candidates.measure = [&](const Levels& levels) -> const Measures& { return measurer.measure(levels); };
  const std::vector<std::uint32_t> counts = measurer.level_counts();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const AssetView asset = measurer.scene().assets[i].view();
    std::vector<double>& bounds = candidates.error_bounds.emplace_back();
    for (std::uint32_t level = 0; level < counts[i]; ++level)
      bounds.push_back(asset.level(level).error_bound);
  }
  return candidates;
}

std::vector<AssetEconomy> measure_each(LevelMeasurer& measurer, const Candidates& candidates) {
  const LoadedScene& scene = measurer.scene();
  std::vector<AssetEconomy> assets;
  for (std::size_t i = 0; i < candidates.assets(); ++i) {
    const AssetView view = scene.assets[i].view();
    AssetEconomy& asset = assets.emplace_back();
    asset.name = scene.description.assets[i];
    asset.diagonal = bounds_of(view).diagonal();
    for (std::uint32_t level = 0; level < candidates.error_bounds[i].size(); ++level) {
      asset.levels.push_back(view.level(level));
      asset.measures.push_back(measurer.measure(candidates.alone(i, level)));
    }
  }
  const std::vector<Motion>& motion = scene.description.filter.motion;
  for (std::size_t i = 0; i < candidates.asset_of.size(); ++i) {
    AssetEconomy& asset = assets[candidates.asset_of[i]];
    ++asset.instances;
    asset.moves = asset.moves || motion.empty() || motion[i] != Motion::fixed;
  }
  return assets;
}

double cost_of(const EconomyArguments& arguments, const Measures& measures) {
  return arguments.bytes ? static_cast<double>(memory_of(measures)) : 1e3 * seconds_of(measures);
}

double budget_of(const EconomyArguments& arguments) {
  return arguments.bytes ? static_cast<double>(*arguments.bytes) : *arguments.milliseconds;
}

std::vector<double> tolerances_of(const EconomyArguments& arguments,
                                  const std::vector<AssetEconomy>& assets) {
  if (!arguments.relative) return std::vector<double>(assets.size(), *arguments.tolerance);
  std::vector<double> diagonals;
  std::vector<bool> moves;
  for (const AssetEconomy& asset : assets) {
    diagonals.push_back(asset.diagonal);
    moves.push_back(asset.moves);
  }
  return economy::tolerances_of(*arguments.tolerance, diagonals, moves);
}

Levels choose(const EconomyArguments& arguments, const Candidates& candidates,
              std::vector<AssetEconomy>& assets) {
  if (!arguments.tolerance) {
    return within_budget(candidates, budget_of(arguments),
                         [&](const Measures& measures) { return cost_of(arguments, measures); });
  }
  const std::vector<double> tolerance = tolerances_of(arguments, assets);
  for (std::size_t i = 0; i < assets.size(); ++i) assets[i].tolerance = tolerance[i];
  return within_tolerance(candidates, tolerance);
}

EconomyResult measure(const EconomyArguments& arguments, LevelMeasurer& measurer) {
  const Candidates candidates = candidates_of(measurer);
  EconomyResult result;
  result.finest = measurer.measure(Levels(candidates.assets()));
  result.assets = measure_each(measurer, candidates);
  result.recommended = measurer.measure(choose(arguments, candidates, result.assets));
  result.within = arguments.tolerance || cost_of(arguments, result.recommended) <= budget_of(arguments);
  result.gpu = measurer.gpu();
  if (result.finest.rest) result.nudged = measurer.end_distance_of_a_nudge();
  return result;
}

// Writes the measured scene, with all that docs/scenes.md knows, at these levels.
void write_at_levels(const EconomyArguments& arguments, const LevelMeasurer& measurer,
                     const SceneMotion& motion, const Levels& levels) {
  SceneDescription scene = measurer.scene().description;
  for (std::string& asset : scene.assets) asset = seen_from(arguments.output, beside(arguments.scene, asset));
  scene.level.clear();
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    scene.instances[i].asset = measurer.asset_of()[i];
    scene.level.push_back(levels[scene.instances[i].asset]);
  }
  Hdf5Output file(arguments.output);
  add_scene(file, scene);
  add_motion(file, motion);
  file.write();
}

// Says what is wrong with a budget that even the cheapest levels exceed.
std::string excess_of(const EconomyArguments& arguments, const Measures& cheapest) {
  const std::string text = arguments.bytes
                               ? "--memory " + with_commas(*arguments.bytes) + ": the cheapest levels take " +
                                     with_commas(memory_of(cheapest)) + " bytes"
                               : format("--time %g: the cheapest levels take %g ms", *arguments.milliseconds,
                                        1e3 * seconds_of(cheapest));
  return text + (arguments.output.empty() ? "" : "; " + arguments.output + " is not written");
}

ExitCode run_economy(const EconomyArguments& arguments) {
  const economy::MeasureSettings settings = {arguments.on_gpu() ? "tandem-cuda" : "tandem",
                                             arguments.threads(), arguments.repeats,
                                             arguments.simulated_seconds};
  LevelMeasurer measurer(arguments.scene, settings);
  const LoadedScene& scene = measurer.scene();
  if (scene.description.instances.empty()) throw FileError(arguments.scene + ": /instances: there is none");
  SceneMotion motion;  // read now: the file may be another when all is measured
  if (!arguments.output.empty()) motion = read_motion(arguments.scene, measurer.asset_of().size());
  check_output(arguments, files_of(arguments.scene, scene));
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, settings.threads);
  const EconomyResult result =
      answer_of(arguments.scene, scene, [&] { return measure(arguments, measurer); });
  if (!arguments.output.empty() && result.within)
    write_at_levels(arguments, measurer, motion, result.recommended.levels);
  print(arguments, report_of(arguments, result));
  if (!result.within) throw UsageError(arguments.scene + ": " + excess_of(arguments, result.recommended));
  return kDone;
}

}  // namespace

void add_economy(Command tool, Run& run_later) {
  const auto [command, arguments] = add_command<EconomyArguments>(
      tool, run_later, "economy", "find out which levels of detail are enough for a scene", run_economy);
  command.add({scene_argument(arguments)});
  const Command limit = command.add_choice("limit");
  limit.add(
      {{"--tolerance", [&told = arguments](const std::string& text) { take_tolerance(text, told); },
        "LENGTH|PERCENT%", "by how much surfaces may be off, proved, and depths, measured", tolerance_defect},
       {"--time", arguments.milliseconds, "MS", "for query and manifolds, or with --simulate a step",
        between(0, 1e9)},
       in_bytes({"--memory", arguments.bytes, "BYTES",
                 "for the levels of all assets, or all that a GPU query takes"})});
  command.add({{"--simulate", arguments.simulated_seconds, "SECONDS [0]",
                "also let bodies move, so long, and compare where they end", between(0, 1e6)},
               backend_option(arguments),
               threads_option(arguments, "what is found does"),
               repeat_option(arguments, "each query"),
               output_option(arguments, "the scene file to write, with the recommended levels", "--apply"),
               json_option(arguments, "the results")});
}

}  // namespace tandem::bench
