#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "collapses.h"
#include "tandem/build/build_options.h"

namespace tandem::build {

/// Says how far a level may be from the finest: a length in the unit of the file, or a share of the diagonal
/// of the finest's bounds.
struct LevelError {
  double value = 0;
  bool of_diagonal = false;  ///< `value` is a share, not a length

  double length(double diagonal) const { return of_diagonal ? value * diagonal : value; }
  bool operator==(const LevelError&) const = default;
};

/// Reads "0.1%,0.3%,2", or "auto", which stands for 0.1 %, 0.3 %, 1 % and 3 % of the diagonal. Result: what
/// is wrong with the text, for people, or nothing. Errors are positive and finite, at most kMaxLevels - 1 of
/// them; those of one kind ascend.
std::string parse_level_errors(const std::string& text, std::vector<LevelError>& errors);

/// Returns the error as parse_level_errors() reads it: "0.3%", "2".
std::string name(const LevelError& error);

/// A level beyond the finest, without the tree that it will get.
struct LadderLevel {
  LevelMesh mesh;
  std::vector<std::uint32_t> nearest;  ///< of each triangle's middle: the triangle of the finest geometry
  std::size_t wanted = 0;              ///< which of the errors that were asked for
  double error_bound = 0;              ///< what is proved, at most that error
};

/// The finest level: what is simplified, and what the errors are measured against.
struct FinestLevel {
  Geometry geometry;
  const Tree& tree;
  const SurfaceTopology& topology;
};

/// Says why there is no level for an error.
enum class NoLevel : std::uint8_t {
  no_coarser,   ///< it would have as many triangles as the one before, or more
  spared,       ///< a later level is coarser and nearer to the finest
  interrupted,  ///< its making was stopped
};

struct LeftOutError {
  std::size_t wanted;  ///< which of the errors that were asked for
  NoLevel why;
};

struct Ladder {
  std::vector<LadderLevel> levels;     ///< errors ascend, triangles descend
  std::vector<LeftOutError> left_out;  ///< in the order in which they were asked for
  std::uint64_t fixed_vertices = 0;    ///< where surfaces meet: they stay in place at every level
};

/// Makes a level for each wanted error: the one with the fewest triangles, or nearly, that is proved to be
/// at most so far from the finest, of those that collapses of edges lead to. Errors without a level are in
/// `left_out`. The result does not depend on the number of threads. wanted: lengths in the unit of the
/// coordinates, ascending. watch: its progress is told the share that is done; once its stop is set, no
/// further mesh is made, and what was found and proved until then stays. Condition: fewer than
/// kMostTopologyTriangles.
Ladder make_ladder(const FinestLevel& finest, std::span<const double> wanted, OptimisationWatch& watch);

}  // namespace tandem::build
