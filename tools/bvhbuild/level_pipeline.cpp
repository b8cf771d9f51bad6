#include "level_pipeline.h"

#include <array>

#include "bvhbuild/levels/ladder.h"
#include "bvhbuild/levels/self_contacts.h"
#include "kernels/common/stopwatch.h"

namespace tandem::build {
namespace {

double diagonal(const StoredMesh& mesh) {
  return corner_bounds({mesh.points, mesh.triangles}).diagonal();
}

std::vector<double> wanted_lengths(const Options& options, const StoredMesh& mesh) {
  const double whole = diagonal(mesh);
  std::vector<double> lengths;
  for (const LevelError& error : options.levels) lengths.push_back(error.length(whole));
  return lengths;
}

}  // namespace

AssetLevel BuiltLevel::row(const Options& options) const {
  return {geometry,        face,        &tree,
          oriented_blocks, error_bound, options.topology && topology ? &*topology : nullptr,
          source_vertex};
}

BuiltLevel build_level(const Geometry& geometry, const Options& options, OptimisationWatch& watch) {
  BuildOptions parts = options;
  parts.topology = options.topology || !options.levels.empty();
  return {build_parts(geometry, parts, watch), {}, geometry, {}, 0};
}

std::string level_errors_defect(const Options& options, const StoredMesh& mesh) {
  if (options.levels.empty()) return {};
  if (mesh.triangles.size() >= kMostTopologyTriangles) return "too many triangles for --levels";
  const std::vector<double> lengths = wanted_lengths(options, mesh);
  for (std::size_t i = 1; i < lengths.size(); ++i) {
    if (!(lengths[i] > lengths[i - 1]))
      return "--levels: " + name(options.levels[i]) + " is not larger than " + name(options.levels[i - 1]) +
             " for a diagonal of " + name({diagonal(mesh), false});
  }
  return {};
}

void add_levels(const Options& options, const StoredMesh& mesh, OptimisationWatch& watch,
                std::vector<BuiltLevel>& levels, Outcome& outcome) {
  Stopwatch stopwatch;
  const FinestLevel finest = {levels[0].geometry, levels[0].tree, *levels[0].topology};
  watch.begin_part(0.3, 0.9);
  Ladder ladder = make_ladder(finest, wanted_lengths(options, mesh), watch);
  outcome.fixed_vertices = ladder.fixed_vertices;
  outcome.levels.emplace_back();
  for (const LeftOutError& error : ladder.left_out)
    outcome.levels_left_out.push_back({options.levels[error.wanted], error.why});
  levels.reserve(1 + ladder.levels.size());
  watch.begin_part(0.9, 0.95);
  for (LadderLevel& coarse : ladder.levels) {
    outcome.levels.emplace_back().wanted = options.levels[coarse.wanted];
    BuiltLevel& level =
        levels.emplace_back(build_level({coarse.mesh.points, coarse.mesh.triangles}, options, watch));
    level.mesh = std::move(coarse.mesh);  // which leaves its arrays where they are
    level.error_bound = coarse.error_bound;
    for (const std::uint32_t triangle : coarse.nearest) level.face.push_back(mesh.face[triangle]);
  }
  outcome.seconds.levels = stopwatch.lap();
}

CheckedImage build_file(const Options& options, const StoredMesh& mesh, AssetSource source,
                        const std::function<std::string()>& provenance, OptimisationWatch& watch,
                        Outcome& outcome, const std::vector<std::string>& sample_names) {
  std::vector<BuiltLevel> levels;
  if (!options.levels.empty()) watch.begin_part(0, 0.3);
  levels.push_back(build_level({mesh.points, mesh.triangles, mesh.poses}, options, watch));
  levels[0].face = mesh.face;
  if (options.refit) levels[0].source_vertex = mesh.source_vertex;
  if (!options.levels.empty()) add_levels(options, mesh, watch, levels, outcome);
  outcome.interrupted = watch.stop;
  if (!mesh.poses.empty()) {
    Stopwatch stopwatch;
    outcome.samples = measure_samples(levels[0].geometry, levels[0].tree, options, sample_names);
    outcome.seconds.samples = stopwatch.lap();
  }
  source.origin = mesh.origin;
  source.rounding_error = mesh.largest_rounding_error;
  source.provenance = provenance();
  std::vector<AssetLevel> rows;
  for (const BuiltLevel& level : levels) rows.push_back(level.row(options));
  CheckedImage file = assemble_checked(source, rows);
  watch.begin_part(0, 1);
  watch.reach(1);
  return file;
}

void describe_levels(const AssetView& asset, Outcome& outcome) {
  const FileHeader& header = *asset.header;
  const CornerBounds bounds = {std::to_array(header.lower), std::to_array(header.upper)};
  const double whole = bounds.diagonal();
  for (std::uint32_t i = 0; i < asset.levels.size(); ++i) {
    const LevelView view = asset.level(i);
    LevelOutcome& level = outcome.levels[i];
    level.tree = measure_tree(view, header.lower, header.upper);
    level.error_bound = view.error_bound;
    level.error_bound_relative = whole > 0 ? view.error_bound / whole : 0;
    if (view.topology != nullptr) level.closed = view.closed;
    level.self_contacts = count_self_contacts(view);
  }
}

}  // namespace tandem::build
