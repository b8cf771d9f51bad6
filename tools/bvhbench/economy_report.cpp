#include "economy_report.h"

#include <algorithm>

#include "common/number_words.h"

namespace tandem::bench {
namespace {

using economy::Measures;

Json to_json(const economy::Spread& spread) {
  return {
      {"mean", spread.mean}, {"median", spread.median}, {"most", spread.most}, {"largest", spread.largest}};
}

Json to_json(const Measures& measures) {
  const economy::Difference& change = measures.change;
  Json json = {{"bytes", measures.bytes},
               {"gpu_bytes", measures.gpu_bytes == 0 ? Json() : Json(measures.gpu_bytes)},
               {"query_seconds", measures.query_seconds},
               {"manifold_seconds", measures.manifold_seconds},
               {"object_pairs", measures.object_pairs},
               {"touching_pairs", measures.touching_pairs},
               {"contacts", measures.contacts},
               {"manifolds", measures.manifolds},
               {"changeable_pairs", change.touching_pairs},
               {"lost_pairs", change.lost_pairs},
               {"new_pairs", change.new_pairs},
               {"matched_manifolds", change.matched},
               {"lost_manifolds", change.lost_patches},
               {"new_manifolds", change.new_patches},
               {"depth_error", to_json(change.depth)},
               {"normal_error_degrees", to_json(change.angle)}};
  if (measures.rest) {
    json["step_seconds"] = measures.rest->step_seconds;
    json["end_speed"] = measures.rest->speed;
    json["end_distance"] = to_json(measures.rest->end_distance);
  }
  return json;
}

Json to_json(const AssetEconomy& asset, std::uint32_t recommended) {
  Json levels = Json::array();
  for (std::size_t i = 0; i < asset.levels.size(); ++i) {
    const LevelView& level = asset.levels[i];
    Json row = {{"level", i},
                {"triangles", level.triangle_count},
                {"error_bound", level.error_bound},
                {"error_bound_relative", level.error_bound / asset.diagonal}};
    row.update(to_json(asset.measures[i]));
    levels.push_back(row);
  }
  return {{"asset", asset.name},
          {"diagonal", asset.diagonal},
          {"instances", asset.instances},
          {"tolerance", or_null(asset.tolerance)},
          {"recommended_level", recommended},
          {"levels", levels}};
}

Json tolerance_of(const EconomyArguments& arguments, bool relative) {
  return arguments.tolerance && arguments.relative == relative ? Json(*arguments.tolerance) : Json();
}

// "12.3 times faster", or how much slower.
std::string speed_words(double before, double after) {
  return after <= before ? format("%.1f times faster", before / after)
                         : format("%.1f times slower", after / before);
}

std::string percent(double part) {
  return part == 0 ? "0 %" : format("%.2g %%", 100 * part);
}

double largest_diagonal(const EconomyResult& result) {
  double largest = 0;
  for (const AssetEconomy& asset : result.assets) {
    if (asset.instances > 0) largest = std::max(largest, asset.diagonal);
  }
  return largest;
}

// "0.12 (1.5)": half of the numbers are at most so large, and 95 of 100.
std::string half_and_most(const economy::Spread& spread) {
  return format("%.2g (%.2g)", spread.median, spread.most);
}

// Returns the same words in per cent of a length.
std::string half_and_most(const economy::Spread& spread, double length) {
  return half_and_most({0, 100 * spread.median / length, 100 * spread.most / length, 0});
}

std::string line_of_level(const AssetEconomy& asset, std::size_t i, bool recommended) {
  const LevelView& level = asset.levels[i];
  const Measures& measures = asset.measures[i];
  const economy::Difference& change = measures.change;
  const std::string line =
      format(" %s %5zu %9s %10s %8s %10.3f %10.3f %9s %9s %10s %5s %16s %13s", recommended ? ">" : " ", i,
             with_commas(level.triangle_count).c_str(), human_bytes(memory_of(measures)).c_str(),
             percent(level.error_bound / asset.diagonal).c_str(), 1e3 * measures.query_seconds,
             1e3 * measures.manifold_seconds, with_commas(measures.contacts).c_str(),
             with_commas(measures.manifolds).c_str(), with_commas(change.lost_pairs).c_str(),
             with_commas(change.new_pairs).c_str(), half_and_most(change.depth, asset.diagonal).c_str(),
             half_and_most(change.angle).c_str());
  if (!measures.rest) return line;
  return line + format(" %9.3f %15s", 1e3 * measures.rest->step_seconds,
                       half_and_most(measures.rest->end_distance, asset.diagonal).c_str());
}

void add_levels(Report& report, const AssetEconomy& asset, std::uint32_t recommended) {
  std::string title = format("%s: diagonal %.4g, %s instance%s", asset.name.c_str(), asset.diagonal,
                             with_commas(asset.instances).c_str(), asset.instances == 1 ? "" : "s");
  if (asset.levels.size() > 1)
    title += ", in " + with_commas(asset.measures[1].change.touching_pairs) + " touching pairs";
  report.line(title);
  report.line(std::string("   level triangles     memory   proved   query, manifolds, ms  contacts manifolds"
                          "  pairs lost, new   depths off, %   normals off") +
              (asset.measures[0].rest ? "  step, ms   ends apart, %" : ""));
  for (std::size_t i = 0; i < asset.levels.size(); ++i)
    report.line(line_of_level(asset, i, i == recommended));
}

std::string limit_words(const EconomyArguments& arguments) {
  if (arguments.tolerance && arguments.relative) return percent(*arguments.tolerance) + " of the diagonals";
  if (arguments.tolerance) return format("%g units of length", *arguments.tolerance);
  return arguments.bytes ? human_bytes(*arguments.bytes) : format("%g ms", *arguments.milliseconds);
}

std::string place_of(const EconomyArguments& arguments, const EconomyResult& result) {
  if (!result.gpu.empty()) return result.gpu;
  const std::uint32_t threads = arguments.threads();
  return with_commas(threads) + (threads == 1 ? " CPU thread" : " CPU threads");
}

void add_losses(Report& report, const EconomyResult& result) {
  const Measures &finest = result.finest, &chosen = result.recommended;
  const economy::Difference& change = chosen.change;
  report.line("What is lost by it, in pairs with an asset at a coarser level:");
  report.line("  " + with_commas(change.touching_pairs) + " of " + with_commas(finest.touching_pairs) +
              " pairs that touch at the finest levels are such: " + with_commas(change.lost_pairs) +
              " of them are found apart, and " + with_commas(change.new_pairs) + " others touch");
  report.line(
      format("  half of the depths differ by %.3g at most, %s of the largest diagonal; 95 in 100 by %.3g",
             change.depth.median, percent(change.depth.median / largest_diagonal(result)).c_str(),
             change.depth.most));
  report.line(format("  half of the normals turn by %.2g degrees at most, 95 in 100 by %.2g",
                     change.angle.median, change.angle.most));
  report.line("  " + with_commas(change.lost_patches) + " of " +
              with_commas(change.matched + change.lost_patches) + " manifolds have no match, and " +
              with_commas(change.new_patches) + " are new");
  if (!chosen.rest) return;
  const economy::Spread& apart = chosen.rest->end_distance;
  report.line(
      format("  half of the bodies end within %.3g of where they do at the finest levels, 95 in 100 "
             "within %.3g",
             apart.median, apart.most));
  if (result.nudged) {
    report.line(
        format("    (within %.3g and %.3g at the finest levels again, nudged by a millionth at the "
               "start)",
               result.nudged->median, result.nudged->most));
  }
  report.line(format("  the fastest moves at %.2g at the end; at the finest levels at %.2g",
                     chosen.rest->speed, finest.rest->speed));
}

void add_recommendation(Report& report, const EconomyArguments& arguments, const EconomyResult& result) {
  const Measures &finest = result.finest, &chosen = result.recommended;
  report.line("Recommended for " + limit_words(arguments) +
              (result.within ? ":" : ", which even the cheapest levels exceed:"));
  for (std::size_t i = 0; i < result.assets.size(); ++i) {
    const AssetEconomy& asset = result.assets[i];
    if (asset.instances == 0) continue;
    const LevelView& level = asset.levels[chosen.levels[i]];
    report.line(format("  %s: level %u: %s of %s triangles, surface proved to be within %.3g (%s)",
                       asset.name.c_str(), chosen.levels[i], with_commas(level.triangle_count).c_str(),
                       with_commas(asset.levels[0].triangle_count).c_str(), level.error_bound,
                       percent(level.error_bound / asset.diagonal).c_str()));
  }
  report.line("  " + speed_words(seconds_of(finest), seconds_of(chosen)) +
              "; contacts: " + with_commas(chosen.contacts) + " of " + with_commas(finest.contacts) +
              "; memory: " + human_bytes(memory_of(chosen)) + " of " + human_bytes(memory_of(finest)));
}

void add_text(Report& report, const EconomyArguments& arguments, const EconomyResult& result) {
  report.line(arguments.scene + ": " + place_of(arguments, result) + ", " +
              with_commas(result.finest.object_pairs) + " object pairs");
  for (std::size_t i = 0; i < result.assets.size(); ++i) {
    if (result.assets[i].instances > 0) add_levels(report, result.assets[i], result.recommended.levels[i]);
  }
  report.line(
      format("Memory: of the levels%s. Depths%s in %% of the diagonal, normals in degrees: half of "
             "them, in pairs\nwith the asset, are off by no more, and in brackets 95 in 100, against "
             "level 0.",
             result.recommended.gpu_bytes == 0 ? " of all assets" : " and the query on the GPU",
             result.finest.rest ? " and ends" : ""));
  add_recommendation(report, arguments, result);
  add_losses(report, result);
}

}  // namespace

double seconds_of(const Measures& measures) {
  return measures.rest ? measures.rest->step_seconds : measures.query_seconds + measures.manifold_seconds;
}

std::uint64_t memory_of(const Measures& measures) {
  return measures.gpu_bytes == 0 ? measures.bytes : measures.gpu_bytes;
}

Report report_of(const EconomyArguments& arguments, const EconomyResult& result) {
  Json assets = Json::array();
  for (std::size_t i = 0; i < result.assets.size(); ++i)
    assets.push_back(to_json(result.assets[i], result.recommended.levels[i]));
  Json recommended = {{"levels", result.recommended.levels}, {"within_limit", result.within}};
  recommended.update(to_json(result.recommended));
  const double simulated = arguments.simulated_seconds;
  Report report;
  report.add({{"tool", "bvhbench economy"},
              {"version", TANDEM_VERSION},
              {"scene", arguments.scene},
              {"output", or_null(arguments.output)},
              {"backend", arguments.backend},
              {"gpu", or_null(result.gpu)},
              {"threads", arguments.threads()},
              {"repeats", arguments.repeats},
              {"tolerance", tolerance_of(arguments, false)},
              {"tolerance_relative", tolerance_of(arguments, true)},
              {"time_milliseconds", or_null(arguments.milliseconds)},
              {"memory_bytes", or_null(arguments.bytes)},
              {"simulated_seconds", simulated > 0 ? Json(simulated) : Json()},
              {"end_distance_of_a_nudge", result.nudged ? to_json(*result.nudged) : Json()},
              {"assets", std::move(assets)},
              {"finest", to_json(result.finest)},
              {"recommended", std::move(recommended)}});
  add_text(report, arguments, result);
  return report;
}

}  // namespace tandem::bench
