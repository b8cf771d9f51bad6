#include "tree.h"

#include "free_tree.h"
#include "minimal_tree.h"

namespace tandem::build {

Tree build_tree(const Geometry& geometry, Imaginary imaginary) {
  return imaginary == Imaginary::minimal ? build_minimal_tree(geometry) : build_free_tree(geometry);
}

}  // namespace tandem::build
