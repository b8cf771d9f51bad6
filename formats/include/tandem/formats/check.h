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

/// Says how much check() proves.
enum class CheckDepth : std::uint8_t {
  full,
  quick,  ///< it believes what oriented boxes hold and what topology says; what this spares:
          ///< docs/decisions/gpu-blocks.md and 0052
};

/// Proves that the bytes are a sound .bvh file: hash, sizes, sections, tree, boxes, triangles. After kOk
/// nothing in the view needs checking: every index is in range, the blocks form one tree of at most
/// kMaxDepth and lie depth first, each triangle hangs below exactly one leaf and lies, as every box does,
/// within all boxes above it in real arithmetic, and imaginary nodes have the box that every test rejects.
/// Where there are oriented blocks, they are those of these blocks, and each triangle lies within the
/// oriented boxes of all nodes above it too. Where there is topology, it is that of these triangles: vertices
/// are their positions, edges and components are counted right, and windings agree where they can; which side
/// of several components is outside is nothing that a file can show (FORMAT.md). A quick check leaves out
/// what oriented boxes hold and what topology and source vertices say beyond the range of their indices: with
/// a file that lies there exact queries on a GPU could miss contacts, and manifolds be wrong, but nothing
/// reads out of bounds.
///
/// Error bounds of levels are the writer's word, as the rounding error of the header is: that they are finite
/// and ascend is checked, not that they hold, which takes as long as making levels. Of a file that lies
/// there, verdicts and contacts with error bounds may be wrong. bvhinfo --verify --levels proves the bounds.
///
/// Reads the bytes twice, and the triangles once for each block above them. Throws nothing. A full check of a
/// level with topology takes up to 48 bytes a triangle meanwhile, and kOutOfMemory says that they are not
/// there; else it allocates nothing. `data` must be aligned to 128 bytes (kMisaligned otherwise); it need not
/// stay after a failure.
CheckResult check(const void* data, std::size_t bytes, CheckDepth depth = CheckDepth::full);

/// Returns the view that check() returns of the same bytes, without checking them. Condition: check() found
/// them sound, and they have not changed.
AssetView view_of_checked(const void* data);

/// Writes the content hash into the header, the last step of writing a file.
/// Condition: `data` holds `bytes` bytes, at least a header.
void seal(void* data, std::size_t bytes);

}  // namespace tandem
