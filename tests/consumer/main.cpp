#include <tandem/runtime/map.h>
#include <cstdio>

int main(int, char** argv) {
  tandem::MappedAsset cow;
  if (const tandem::Status status = cow.open(argv[1]); status != tandem::Status::kOk) {
    return std::printf("%s: %s\n", argv[1], tandem::explain(status)), 1;
  }
  const tandem::LevelView tree = cow.view().level();
  std::printf("%u triangles in %u blocks\n", tree.triangle_count, tree.block_count);
}
