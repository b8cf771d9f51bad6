#pragma once
#include <cuda_runtime.h>

#include <cstdint>

#include "kernels/common/launch.h"
#include "kernels/geometry/pair_motion.h"
#include "tandem/kernels/gpu_moved_query.h"

// The kernels that find the pairs that have moved share this data, all of it in GPU memory.
namespace tandem::gpu {

/// An entry of the table of the pairs of the call before; of another step than `step` it is empty.
struct alignas(8) MovedEntry {
  std::uint32_t step;
  std::uint32_t row;
};

struct MovedState {
  // Cleared by each call.
  std::uint32_t tiles_taken, finished_blocks;

  // These are kept from call to call.
  std::uint32_t step;          ///< of the table
  std::uint32_t has_last;      ///< the last call is the one before the next
  std::uint32_t last_pairs;    ///< of the last call
  std::uint32_t pairs_before;  ///< in posed_before
  std::uint64_t call_before;   ///< that posed_before is of
  std::uint64_t next_call;
  GpuMovedCall call;
  std::uint32_t moved;  ///< the number of pairs that have moved
  GpuMovedReport report;
};

/// Pairs whose counts are added up at once, by a thread block.
inline constexpr std::uint32_t kMovedTile = 1024;

struct MovedArgs {
  const AssetBox* boxes;
  std::uint32_t asset_count;
  GpuInstances instances;
  GpuPairs pairs;
  double tolerance;
  const double* tolerance_of_pair;
  std::uint32_t capacity;

  MovedState* state;
  GpuMovedReport* host_report;  ///< in CPU memory
  PosedBodies *posed, *posed_before;
  std::uint32_t *kept_rows, *moved_rows, *row_of_moved;
  ObjectPair* moved;
  std::uint64_t* tile_sums;
  MovedEntry* table;
  std::uint32_t table_size;

  DeviceLimits limits;
};

/// Keeps the poses of the last call, and enters its pairs into the table.
cudaError_t remember_poses(const MovedArgs& args, cudaStream_t stream);

/// Decides which pairs are kept, lists the others, and writes the report.
cudaError_t find_moved(const MovedArgs& args, cudaStream_t stream);

/// The next call finds nothing before it.
cudaError_t forget_poses(MovedState* state, cudaStream_t stream);

}  // namespace tandem::gpu
