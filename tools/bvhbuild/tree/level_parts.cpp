#include "level_parts.h"

#include <stdexcept>
#include <string>
#include <utility>

#include "oriented_blocks.h"
#include "tandem/formats/check.h"

namespace tandem::build {

LevelParts build_parts(const Geometry& geometry, const BuildOptions& options, OptimisationWatch& watch) {
  LevelParts parts;
  parts.tree = build_tree(geometry, options.imaginary, options.effort, watch);
  watch.look();
  if (options.gpu_blocks && geometry.triangles.size() < kMostOrientedTriangles)
    parts.oriented_blocks = orient_blocks(geometry, parts.tree, options.effort);
  watch.look();
  if (options.topology && geometry.triangles.size() < kMostTopologyTriangles)
    parts.topology = make_topology(geometry, parts.tree);
  return parts;
}

CheckedImage assemble_checked(const AssetSource& source, std::span<const AssetLevel> levels) {
  Image image = assemble(source, levels);
  const CheckResult checked = check(image.data(), image.size());
  if (checked.status != Status::kOk)
    throw std::logic_error(std::string("the tree that was built is not sound: ") + explain(checked.status));
  return {std::move(image), checked.asset};
}

}  // namespace tandem::build
