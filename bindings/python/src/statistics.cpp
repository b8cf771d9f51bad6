#include "statistics/statistics.h"

#include "core.h"
#include "handles.h"
#include "levels/level_bytes.h"

namespace tandem::python {
namespace {

nb::object null_unless(bool there, double value) {
  return there ? nb::object(nb::float_(value)) : nb::none();
}

template <typename Values>
nb::list to_list(const Values& values) {
  nb::list list;
  for (const auto& value : values) list.append(value);
  return list;
}

nb::tuple to_tuple(const TreeStatistics& s) {
  return nb::make_tuple(s.triangles, s.nodes, s.leaf_nodes, s.internal_nodes, s.imaginary_nodes,
                        s.imaginary_minimum, s.imaginary_fraction, s.leaf_blocks, s.internal_blocks,
                        s.partial_leaf_blocks, s.depth, s.leaf_fill, s.sah_cost,
                        to_list(s.leaf_blocks_at_depth), to_list(s.blocks_with_fill));
}

// Block pairs and candidates, then those of oriented blocks.
nb::tuple to_tuple(const ExpectedWork& work) {
  const auto oriented = work.oriented.value_or(ExpectedWork::Oriented{});
  return nb::make_tuple(null_unless(work.poses > 0, work.block_pairs),
                        null_unless(work.poses > 0, work.candidates),
                        null_unless(work.oriented.has_value(), oriented.block_pairs),
                        null_unless(work.oriented.has_value(), oriented.candidates));
}

nb::object surface_of(const LevelView& level) {
  const auto counts = count_surface(level);
  if (!counts) return nb::none();
  return nb::make_tuple(counts->vertices, counts->components, counts->closed_components,
                        counts->turned_triangles, counts->boundary_edges, counts->sides_at_edges_of_many);
}

}  // namespace

nb::tuple statistics(const Asset& asset) {
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
  nb::list levels;
  for (std::uint32_t i = 0; i < view.levels.size(); ++i)
    levels.append(nb::make_tuple(bytes_of_level(view, i), to_tuple(work[i])));
  return nb::make_tuple(nb::make_tuple(header.version_major, header.version_minor), to_tuple(tree), levels,
                        surface_of(view.level()));
}

}  // namespace tandem::python
