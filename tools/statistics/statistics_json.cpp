#include "statistics_json.h"

namespace tandem {

Json to_json(const TreeStatistics& s) {
  return {{"triangles", s.triangles},
          {"nodes", s.nodes},
          {"leaf_nodes", s.leaf_nodes},
          {"internal_nodes", s.internal_nodes},
          {"imaginary_nodes", s.imaginary_nodes},
          {"imaginary_minimum", s.imaginary_minimum},
          {"imaginary_fraction", s.imaginary_fraction},
          {"leaf_blocks", s.leaf_blocks},
          {"internal_blocks", s.internal_blocks},
          {"partial_leaf_blocks", s.partial_leaf_blocks},
          {"depth", s.depth},
          {"leaf_fill", s.leaf_fill},
          {"sah_cost", s.sah_cost}};
}

}  // namespace tandem
