#include "tree.h"

#include "emit.h"
#include "free_tree.h"
#include "minimal_tree.h"
#include "mixed_tree.h"
#include "normalize.h"
#include "optimise.h"

namespace tandem::build {

namespace {

Topology build_topology(std::span<const Bounds> bounds, Imaginary imaginary) {
  if (imaginary == Imaginary::minimal) return build_minimal_tree(bounds);
  if (imaginary == Imaginary::free) return build_free_tree(bounds);
  return build_mixed_tree(bounds, imaginary.share);
}

}  // namespace

Tree build_tree(const Geometry& geometry, Imaginary imaginary, Effort effort) {
  OptimisationWatch watch;
  return build_tree(geometry, imaginary, effort, watch);
}

Tree build_tree(const Geometry& geometry, Imaginary imaginary, Effort effort, OptimisationWatch& watch) {
  const std::vector<Bounds> bounds = normalized_bounds(geometry);
  watch.look();
  Topology topology = build_topology(bounds, imaginary);
  watch.look();
  optimise(topology, bounds, effort, watch);
  watch.look();
  return emit(geometry, topology);
}

}  // namespace tandem::build
