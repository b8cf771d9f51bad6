#pragma once
#include <cstddef>
#include <cstdint>

#include "tandem/formats/status.h"
#include "tandem/formats/view.h"

namespace tandem {

struct CheckResult {
  Status status = Status::kOk;
  std::uint64_t where =
      0;  ///< the section, level, block, triangle or part that the status speaks of; a byte offset for gaps
  AssetView asset;  ///< valid only when the status is kOk
};

/// Proves that the bytes are a sound .bvh file: hash, sizes, sections, tree, boxes, triangles. After kOk
/// nothing in the view needs checking: every index is in range, the blocks form one tree of at most
/// kMaxDepth and lie depth first, each triangle hangs below exactly one leaf and lies, as every box does,
/// within all boxes above it in real arithmetic, and imaginary nodes have the box that every test rejects.
///
/// Reads the bytes twice; allocates and throws nothing.
/// `data` must be aligned to 128 bytes (kMisaligned otherwise); it need not stay after a failure.
CheckResult check(const void* data, std::size_t bytes);

/// Writes the content hash into the header, the last step of writing a file.
/// Condition: `data` holds `bytes` bytes, at least a header.
void seal(void* data, std::size_t bytes);

}  // namespace tandem
