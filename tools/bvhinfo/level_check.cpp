#include "level_check.h"

#include <algorithm>

#include "common/number_words.h"

namespace tandem {
namespace {

BoundVerdict verdict_of(double error_bound, const HausdorffBound& found) {
  if (found.upper <= error_bound) return BoundVerdict::holds;
  return found.lower > error_bound ? BoundVerdict::too_small : BoundVerdict::not_proved;
}

/// The distance as well as it is usually known, which tells most; if not, whether it is within the bound.
LevelCheck check_error_bound(const LevelView& finest, const LevelView& level, std::uint32_t number) {
  LevelCheck check = {number, level.triangle_count, level.error_bound, hausdorff_bound(finest, level), {}};
  check.verdict = verdict_of(level.error_bound, check.found);
  if (check.verdict != BoundVerdict::not_proved) return check;
  HausdorffOptions options;
  options.wanted = level.error_bound;
  options.relative = 1e-6;
  const HausdorffBound decided = hausdorff_bound(finest, level, options);
  check.verdict = verdict_of(level.error_bound, decided);
  check.found.upper = std::min(check.found.upper, decided.upper);
  check.found.lower = std::max(check.found.lower, decided.lower);
  return check;
}

/// Enough digits to tell two numbers apart that are.
std::string digits(double value) {
  return format("%.12g", value);
}

}  // namespace

std::vector<LevelCheck> check_error_bounds(const AssetView& asset) {
  std::vector<LevelCheck> checks;
  for (std::uint32_t i = 1; i < asset.levels.size(); ++i)
    checks.push_back(check_error_bound(asset.level(0), asset.level(i), i));
  return checks;
}

const char* name(BoundVerdict verdict) {
  switch (verdict) {
    case BoundVerdict::holds:
      return "Ok";
    case BoundVerdict::too_small:
      return "ErrorBoundTooSmall";
    case BoundVerdict::not_proved:
      return "ErrorBoundNotProved";
  }
  return "unknown";
}

std::string defect_of(const LevelCheck& check) {
  const std::string level = std::to_string(check.level);
  std::string text = "the error bound of level " + level + ", " + digits(check.error_bound);
  text += check.verdict == BoundVerdict::too_small
              ? ", is too small: a point is " + digits(check.found.lower) + " away from the other surface ("
              : ", is not proved: the distance from level 0 is at least " + digits(check.found.lower) +
                    " and at most " + digits(check.found.upper) + " (";
  return text + name(check.verdict) + ", level " + level + ")";
}

std::string line_of(const LevelCheck& check) {
  return "level " + std::to_string(check.level) + ": " + with_commas(check.triangles) +
         " triangles, error bound " + digits(check.error_bound) + ", distance " + digits(check.found.lower) +
         " to " + digits(check.found.upper);
}

Json to_json(const LevelCheck& check) {
  return {{"level", check.level},
          {"status", name(check.verdict)},
          {"triangles", check.triangles},
          {"error_bound", check.error_bound},
          {"distance_lower", check.found.lower},
          {"distance_upper", check.found.upper}};
}

}  // namespace tandem
