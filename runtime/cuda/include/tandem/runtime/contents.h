#pragma once
#include <cstdint>

namespace tandem {

/// Says which parts of an asset's levels go into GPU memory.
enum class Contents : std::uint8_t {
  all,            ///< all of them; of a whole file also what lies beside them
  exact_queries,  ///< triangles and oriented blocks: what queries of mode exact take, a third less
  manifolds,      ///< these, topology, and what refitting needs: what contact manifolds take besides
};

}  // namespace tandem
