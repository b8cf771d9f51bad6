#pragma once
#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

#include "kernels/common/pair_record.h"
#include "kernels/contact/candidate.h"
#include "paper_engine.h"

// The kernels of the paper's engine share this data, all of it in GPU memory.
namespace tandem::bench::paper {

using gpu::Counter;
using gpu::PairRecord;

/// The paper's collision pair: an object pair and a block of each tree. Also its triangle pair: a and b are
/// triangles then.
struct Entry {
  std::uint32_t pair, a, b;
};

inline constexpr std::uint32_t kThreadsOfPair = 16;

/// Flags are numbered by 32 bits.
inline constexpr std::uint64_t kMostBlockPairs = (1u << 28) - 1;

enum FlagArray { kCollision, kLeaf };

/// A level of the traversal. Prefix sums have one place for each flag, or for each word of bits, and one more
/// for the total.
struct Level {
  const Entry* pairs;
  std::uint32_t count;
  const PairRecord* records;
  std::uint32_t* flags[2];  ///< by FlagArray
  std::uint32_t* sums[2];   ///< by FlagArray: exclusive prefix sums over the flags
};

inline std::size_t sum_count(PaperFlags kind, std::size_t block_pairs) {
  return 1 + (kind == PaperFlags::bits ? (block_pairs + 1) / 2 : block_pairs * kThreadsOfPair);
}

/// Zero when a query begins.
struct Outcome {
  Counter error;  ///< complement of (what, where, status), 0 where there is none: the first wins
  Counter contacts, undecided, unresolved, decided_by_float64;
};

struct QueryArgs {
  const GpuAsset* assets;
  std::uint32_t asset_count;
  GpuInstances instances;
  GpuPairs given;
  PairRecord* records;
  std::uint32_t record_room;
  Outcome* outcome;
};

/// The candidates and what becomes of them.
struct TriangleArgs {
  const Entry* candidates;
  std::uint64_t count;
  Contact* contacts;
  std::uint64_t contact_room;
  Entry *undecided, *unresolved;
  std::uint64_t undecided_room;
};

/// Checks instances and pairs, makes the records and the first level.
cudaError_t prepare(const QueryArgs& args, Entry* first_level, cudaStream_t stream);

/// The collision kernel: tests the boxes of all block pairs and writes both flag arrays.
cudaError_t collide(const Level& level, PaperFlags kind, cudaStream_t stream);

/// Prefix sums over both flag arrays. Without scratch memory: writes how many bytes of it are needed.
cudaError_t scan(const Level& level, PaperFlags kind, void* scratch, std::size_t& scratch_bytes,
                 cudaStream_t stream);

/// The collection kernel: writes the next level and adds to the candidates.
cudaError_t collect(const Level& level, PaperFlags kind, Entry* next, Entry* candidates, cudaStream_t stream);

/// Decides what float32 can, and lists the rest; in boxes mode takes all.
cudaError_t decide_by_float32(const QueryArgs& args, const TriangleArgs& triangles, QueryMode mode,
                              cudaStream_t stream);

/// Decides the rest.
cudaError_t decide_rest(const QueryArgs& args, const TriangleArgs& triangles, QueryMode mode,
                        cudaStream_t stream);

#ifdef __CUDACC__

inline constexpr std::uint32_t kThreads = 128;
using gpu::kAllLanes;
using gpu::lanes_below;
using gpu::place_for;

/// All lanes of the warp take part.
__device__ inline void add_contact(const QueryArgs& args, const TriangleArgs& triangles,
                                   const Entry& candidate, bool contact) {
  const Counter place = place_for(contact, &args.outcome->contacts);
  if (!contact || place >= triangles.contact_room) return;
  const PairRecord& record = args.records[candidate.pair];
  const std::uint32_t a = candidate.a, b = candidate.b;
  const std::uint32_t face_a = record.triangles_a[a].source_face(),
                      face_b = record.triangles_b[b].source_face();
  triangles.contacts[place] =
      make_contact(candidate.pair, record.instance_a == record.instance_b, a, b, face_a, face_b);
}

#endif

}  // namespace tandem::bench::paper
