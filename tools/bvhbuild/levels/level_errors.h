#pragma once
#include <string>
#include <vector>

namespace tandem::build {

/// How far a level may be from the finest: a length in the unit of the file, or a share of the diagonal of
/// the finest's bounds.
struct LevelError {
  double value = 0;
  bool of_diagonal = false;  ///< `value` is a share, not a length

  double length(double diagonal) const { return of_diagonal ? value * diagonal : value; }
  bool operator==(const LevelError&) const = default;
};

/// What --levels auto stands for: 0.1 %, 0.3 %, 1 % and 3 % of the diagonal.
std::vector<LevelError> usual_level_errors();

/// Reads "0.1%,0.3%,2" or "auto". Result: what is wrong with the text, for people, or nothing. Errors are
/// positive and finite, at most kMaxLevels - 1 of them; those of one kind ascend.
std::string parse_level_errors(const std::string& text, std::vector<LevelError>& errors);

/// As parse_level_errors() reads it: "0.3%", "2".
std::string name(const LevelError& error);

}  // namespace tandem::build
