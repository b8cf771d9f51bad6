#include "statistics/statistics.h"

#include <cmath>
#include <cstdio>
#include <string>

#include "core.h"
#include "handles.h"
#include "levels/level_bytes.h"

namespace tandem::python {
namespace {

constexpr const char* kSections[] = {"levels",     "blocks",          "triangles", "parts",     "strings",
                                     "provenance", "oriented_blocks", "topology",  "components"};

nb::object null_unless(bool there, double value) {
  return there ? nb::object(nb::float_(value)) : nb::none();
}

template <typename Values>
nb::list to_list(const Values& values) {
  nb::list list;
  for (const auto& value : values) list.append(value);
  return list;
}

template <typename Value, std::size_t n>
nb::list doubles(const Value (&values)[n]) {
  nb::list list;
  for (const Value value : values) list.append(double{value});
  return list;
}

void add_tree(nb::dict& to, const TreeStatistics& s) {
  to["triangles"] = s.triangles;
  to["nodes"] = s.nodes;
  to["leaf_nodes"] = s.leaf_nodes;
  to["internal_nodes"] = s.internal_nodes;
  to["imaginary_nodes"] = s.imaginary_nodes;
  to["imaginary_minimum"] = s.imaginary_minimum;
  to["imaginary_fraction"] = s.imaginary_fraction;
  to["leaf_blocks"] = s.leaf_blocks;
  to["internal_blocks"] = s.internal_blocks;
  to["partial_leaf_blocks"] = s.partial_leaf_blocks;
  to["depth"] = s.depth;
  to["leaf_fill"] = s.leaf_fill;
  to["sah_cost"] = s.sah_cost;
  to["leaf_blocks_at_depth"] = to_list(s.leaf_blocks_at_depth);
  to["blocks_with_fill"] = to_list(s.blocks_with_fill);
}

void add_work(nb::dict& to, const ExpectedWork& work) {
  const auto oriented = work.oriented.value_or(ExpectedWork::Oriented{});
  to["expected_block_pairs"] = null_unless(work.poses > 0, work.block_pairs);
  to["expected_candidates"] = null_unless(work.poses > 0, work.candidates);
  to["expected_oriented_block_pairs"] = null_unless(work.oriented.has_value(), oriented.block_pairs);
  to["expected_oriented_candidates"] = null_unless(work.oriented.has_value(), oriented.candidates);
}

nb::object surface_of(const LevelView& level) {
  const auto counts = count_surface(level);
  if (!counts) return nb::none();
  nb::dict surface;
  surface["vertices"] = counts->vertices;
  surface["components"] = counts->components;
  surface["closed_components"] = counts->closed_components;
  surface["turned_triangles"] = counts->turned_triangles;
  surface["boundary_edges"] = counts->boundary_edges;
  surface["sides_at_edges_of_many"] = counts->sides_at_edges_of_many;
  return surface;
}

nb::dict level_of(const AssetView& view, std::uint32_t number, const ExpectedWork& work) {
  const LevelView level = view.level(number);
  double square = 0;
  for (int k = 0; k < 3; ++k) {
    const double side = double{view.header->upper[k]} - double{view.header->lower[k]};
    square += side * side;
  }
  const double relative = level.error_bound / std::sqrt(square);
  nb::dict of;
  of["triangles"] = level.triangle_count;
  of["blocks"] = level.block_count;
  of["depth"] = level.depth;
  of["bytes"] = bytes_of_level(view, number);
  of["error_bound"] = level.error_bound;
  of["error_bound_relative"] = null_unless(std::isfinite(relative), relative);
  of["closed"] = level.topology != nullptr ? nb::object(nb::bool_(level.closed)) : nb::none();
  add_work(of, work);
  return of;
}

nb::list sections_of(const AssetView& view) {
  nb::list sections;
  for (const Section& section : view.sections) {
    const auto kind = static_cast<std::size_t>(section.kind) - static_cast<std::size_t>(SectionKind::levels);
    nb::dict of;
    of["kind"] = kind < std::size(kSections) ? kSections[kind] : "unknown";
    of["level"] = section.level;
    of["offset"] = section.offset;
    of["bytes"] = section.bytes;
    of["count"] = section.count;
    sections.append(of);
  }
  return sections;
}

}  // namespace

nb::dict statistics(const Asset& asset) {
  const AssetView& view = asset.get()->view;
  const FileHeader& header = *view.header;
  TreeStatistics tree;
  std::vector<ExpectedWork> work;
  {
    const WithoutLock other_threads_run;
    tree = measure_tree(view.level(), header.lower, header.upper);
    for (std::uint32_t i = 0; i < view.levels.size(); ++i)
      work.push_back(sample_expected_work(view.levels_from(i, 1)));
  }
  nb::dict result;
  result["version"] =
      (std::to_string(header.version_major) + "." + std::to_string(header.version_minor)).c_str();
  result["bytes"] = header.file_bytes;
  add_tree(result, tree);
  add_work(result, work[0]);
  result["surface"] = surface_of(view.level());
  nb::dict bounds;
  bounds["lower"] = doubles(header.lower);
  bounds["upper"] = doubles(header.upper);
  result["bounds"] = bounds;
  result["origin"] = doubles(header.origin);
  result["rounding_error"] = header.rounding_error;
  result["source_faces"] = header.source_faces;
  nb::list levels;
  for (std::uint32_t i = 0; i < view.levels.size(); ++i) levels.append(level_of(view, i, work[i]));
  result["levels"] = levels;
  result["sections"] = sections_of(view);
  return result;
}

}  // namespace tandem::python
