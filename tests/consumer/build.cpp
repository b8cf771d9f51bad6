#include <tandem/build/build_asset.h>
#include <cstdio>

// Builds the tree of a tetrahedron that has one triangle too many.
int main() {
  const tandem::build::Point corners[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const tandem::build::TriangleIndices triangles[] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {2, 2, 3}};
  tandem::build::OptimisationWatch watch;
  const tandem::build::BuiltAsset built = build_asset({corners, triangles, {}, 0, {}}, {}, {}, watch);
  if (!built.file) return std::puts("no triangle can be used"), 1;
  const tandem::LevelView tree = built.file->asset.level();
  std::printf("%u triangles in %u block, %d left out\n", tree.triangle_count, tree.block_count,
              static_cast<int>(built.clean.triangles_degenerate));
}
