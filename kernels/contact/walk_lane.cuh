#pragma once
#include <type_traits>

#include "kernels/common/block_pair.h"
#include "kernels/contact/candidate.h"
#include "kernels/contact/gpu_query_data.h"
#include "kernels/contact/leaf_planes.h"
#include "kernels/contact/recorded_pair.h"
#include "kernels/contact/walk_stack.cuh"
#include "kernels/geometry/oriented_test.h"
#include "kernels/geometry/oriented_world_box.h"

// One lane of a walk tests a block pair and a candidate by these functions, in the frame of the first of a
// pair or in world coordinates.
//
// Included by files that are compiled with and without fused operations: internal linkage.
namespace tandem::gpu {
namespace {

struct Four {
  float v[4];
};

__device__ inline Four four(const float4& x) {
  return {{x.x, x.y, x.z, x.w}};
}

/// size_of(), of half-extents.
__device__ inline float size_of(const Four (&h)[3]) {
  float size = 0;
#pragma unroll
  for (int i = 0; i < 4; ++i) size = fmaxf(size, (h[0].v[i] + h[1].v[i]) + h[2].v[i]);
  return size;
}

/// block_pair_mask(), and size_of() both, in whole float4.
__device__ inline std::uint32_t mask_of_block_pair(const Block& block_a, const Block& block_b,
                                                   const RelativePose& pose, float& size_a, float& size_b) {
  const auto* a = reinterpret_cast<const float4*>(&block_a);
  const auto* b = reinterpret_cast<const float4*>(&block_b);
  float posed_b[4][3], radius_b[4][3], half_b[4][3];
  {
    Four c[3], h[3];
#pragma unroll
    for (int k = 0; k < 3; ++k) c[k] = four(__ldg(b + k)), h[k] = four(__ldg(b + 3 + k));
    size_b = size_of(h);
#pragma unroll
    for (int j = 0; j < 4; ++j) {
      const float centre[3] = {c[0].v[j], c[1].v[j], c[2].v[j]};
#pragma unroll
      for (int k = 0; k < 3; ++k) half_b[j][k] = h[k].v[j] + pose.slack_b[k];
#pragma unroll
      for (int i = 0; i < 3; ++i) {
        posed_b[j][i] = box_terms::posed_centre(pose, i, centre);
        radius_b[j][i] = box_terms::b_on_face(pose, i, half_b[j]);
      }
    }
  }
  Four c[3], h[3];
#pragma unroll
  for (int k = 0; k < 3; ++k) c[k] = four(__ldg(a + k)), h[k] = four(__ldg(a + 3 + k));
  size_a = size_of(h);
  std::uint32_t mask = 0;
#pragma unroll
  for (int i = 0; i < 4; ++i) {
    float half_a[3], radius_a[3];
#pragma unroll
    for (int k = 0; k < 3; ++k) half_a[k] = h[k].v[i] + pose.slack_a[k];
#pragma unroll
    for (int k = 0; k < 3; ++k) radius_a[k] = box_terms::a_on_face(pose, k, half_a);
#pragma unroll
    for (int j = 0; j < 4; ++j) {
      bool overlap = true;
      float d[3];
#pragma unroll
      for (int k = 0; k < 3; ++k) {
        d[k] = posed_b[j][k] - c[k].v[i];
        overlap = overlap & (fabsf(d[k]) <= half_a[k] + radius_b[j][k]);
      }
#pragma unroll
      for (int k = 0; k < 3; ++k) {
        overlap = overlap & (fabsf(box_terms::distance_on_face(pose, k, d)) <= half_b[j][k] + radius_a[k]);
      }
      if (overlap) mask |= 1u << (4 * i + j);
    }
  }
  return mask;
}

/// The facts about a block that a test gives besides the hits.
struct Side {
  std::uint32_t below;  ///< kIsLeafBlock and the first triangle, or the family of its children
  float size;

  __device__ bool is_leaf_block() const { return (below & OrientedBlock::kIsLeafBlock) != 0; }
};

/// Oriented blocks. A family has the number of its first block.
struct OrientedBlocks {
  static constexpr std::uint32_t kRoots = 0;  ///< the root's own family
  static constexpr float kDescends = kOrientedDescendsAlone;

  __device__ static const OrientedBlock* of_a(const PairRecord& record) { return record.oriented_a; }
  __device__ static const OrientedBlock* of_b(const PairRecord& record) { return record.oriented_b; }
  __device__ static std::uint32_t child(const OrientedBlock*, std::uint32_t family, std::uint32_t node) {
    return family + node;
  }
};

/// Axis-aligned blocks. A family has the number of the block above it.
struct AxisAlignedBlocks {
  static constexpr std::uint32_t kRoots = kNumberMask;  ///< no block has this number
  static constexpr float kDescends = kDescendsAlone;

  __device__ static const Block* of_a(const PairRecord& record) { return record.blocks_a; }
  __device__ static const Block* of_b(const PairRecord& record) { return record.blocks_b; }
  __device__ static std::uint32_t child(const Block* blocks, std::uint32_t family, std::uint32_t node) {
    return family == kRoots ? 0 : blocks[family].index[node];
  }
  __device__ static Side side(const Block& block, std::uint32_t number, float size) {
    return {block.is_leaf_block() ? OrientedBlock::kIsLeafBlock | block.index[0] : number, size};
  }
};

template <QueryMode kMode>
using WalkedBlocks =
    std::conditional_t<walked_kind(kMode) == BlockKind::oriented, OrientedBlocks, AxisAlignedBlocks>;

/// Translation and rotation of a record. By plain loads, as all of a record: the kernel that makes records
/// may still be running when this one starts, and what __ldg() loads must not change while a kernel runs.
__device__ inline void load_pose(const PairRecord& record, float (&rotation)[3][3], float (&translation)[3]) {
#pragma unroll
  for (int i = 0; i < 3; ++i) {
    const float4 row = record.rotation[i];
    rotation[i][0] = row.x, rotation[i][1] = row.y, rotation[i][2] = row.z, translation[i] = row.w;
  }
}

/// overlap_oriented() of all node pairs.
__device__ inline std::uint32_t oriented_mask(const PairRecord& record, const OrientedBlock& block_a,
                                              const OrientedBlock& block_b, Side& side_a, Side& side_b) {
  const auto* a = reinterpret_cast<const float4*>(&block_a);
  const auto* b = reinterpret_cast<const float4*>(&block_b);
  const uint4 last_a = __ldg(reinterpret_cast<const uint4*>(a + 6)),
              last_b = __ldg(reinterpret_cast<const uint4*>(b + 6));
  side_a = {last_a.x, __uint_as_float(last_a.y)};
  side_b = {last_b.x, __uint_as_float(last_b.y)};
  float rotation[3][3], translation[3];
  load_pose(record, rotation, translation);
  const OrientedPose pose = oriented_pose(rotation, translation, record.oriented_slack,
                                          frame_of({last_a.z, last_a.w}), frame_of({last_b.z, last_b.w}));
  Four cb[3], hb[3], ca[3], ha[3];
#pragma unroll
  for (int k = 0; k < 3; ++k) cb[k] = four(__ldg(b + k)), hb[k] = four(__ldg(b + 3 + k));
#pragma unroll
  for (int k = 0; k < 3; ++k) ca[k] = four(__ldg(a + k)), ha[k] = four(__ldg(a + 3 + k));
  float posed[4][3], reach[4][3];
#pragma unroll
  for (int j = 0; j < 4; ++j) {
    const float centre[3] = {cb[0].v[j], cb[1].v[j], cb[2].v[j]};
    const float half[3] = {hb[0].v[j], hb[1].v[j], hb[2].v[j]};
#pragma unroll
    for (int k = 0; k < 3; ++k) {
      posed[j][k] = oriented_terms::b_in_a(pose, k, centre);
      reach[j][k] = oriented_terms::b_along_a(pose, k, half);
    }
  }
  std::uint32_t mask = 0;
#pragma unroll
  for (int i = 0; i < 4; ++i) {
    const float centre[3] = {ca[0].v[i], ca[1].v[i], ca[2].v[i]};
    const float half[3] = {ha[0].v[i], ha[1].v[i], ha[2].v[i]};
    float in_b[3], along_b[3];
#pragma unroll
    for (int k = 0; k < 3; ++k) {
      in_b[k] = oriented_terms::a_in_b(pose, k, centre);
      along_b[k] = oriented_terms::a_along_b(pose, k, half);
    }
#pragma unroll
    for (int j = 0; j < 4; ++j) {
      bool overlap = true;
#pragma unroll
      for (int k = 0; k < 3; ++k) {
        overlap = overlap & (fabsf(posed[j][k] - centre[k]) <= half[k] + reach[j][k]) &
                  (fabsf(in_b[k] - cb[k].v[j]) <= hb[k].v[j] + along_b[k]);
      }
      if (overlap) mask |= 1u << (4 * i + j);
    }
  }
  return mask;
}

/// A stored triangle, in whole float4.
__device__ inline Triangle load_triangle(const Triangle* triangles, std::uint32_t index) {
  const auto* from = reinterpret_cast<const float4*>(triangles + index);
  Triangle out;
#pragma unroll
  for (int c = 0; c < 3; ++c) {
    const float4 p = __ldg(from + c);
    out.corner[c] = {{p.x, p.y, p.z}, __float_as_uint(p.w)};
  }
  return out;
}

/// Drops the neighbours among the hits of two leaf blocks of an instance that meets itself. first_a, first_b:
/// their first triangles. Condition: args.neighbourhoods is not null.
__device__ __noinline__ std::uint32_t without_neighbours(const QueryArgs& args, const PairRecord& record,
                                                         std::uint32_t first_a, std::uint32_t first_b,
                                                         std::uint32_t hits) {
  const Neighbourhood& mesh = args.neighbourhoods[args.instances.asset[record.instance_a]];
  return drop_neighbours(mesh, first_a, first_b, hits);
}

/// The state of a candidate in a lane.
struct Judged {
  std::uint32_t face_a, face_b;
  bool contact, undecided;
};

/// Boxes and triangles in the frame of the first of a pair, float32.
template <QueryMode kMode, bool kWalksOnly = false>
struct InFrame {
  static constexpr bool kWorld = false;
  static constexpr bool kCountsOnly = kWalksOnly;  ///< candidates are counted, none decided
  static constexpr bool kMayLeaveOut = false;      ///< neighbours, where args.neighbourhoods has them
  static constexpr bool kBounded = kMode == QueryMode::exact;
  using Blocks = WalkedBlocks<kMode>;

  /// a, b: numbers of blocks.
  __device__ static std::uint32_t test(const QueryArgs&, const PairRecord& record, std::uint32_t a,
                                       std::uint32_t b, Side& side_a, Side& side_b) {
    if constexpr (kBounded) {
      return oriented_mask(record, record.oriented_a[a], record.oriented_b[b], side_a, side_b);
    } else {
      const Block &block_a = record.blocks_a[a], &block_b = record.blocks_b[b];
      float size_a, size_b;
      const std::uint32_t mask = mask_of_block_pair(block_a, block_b, pose_of(record), size_a, size_b);
      side_a = Blocks::side(block_a, a, size_a);
      side_b = Blocks::side(block_b, b, size_b);
      return mask;
    }
  }

  /// Planes are tried in mode fast, whose candidates are the CPU's. Oriented boxes of leaves are nearly as
  /// thin as their planes: exact queries are faster without (docs/decisions/gpu-blocks.md).
  static constexpr bool kTriesPlanes = kMode == QueryMode::fast;
  __device__ __noinline__ static std::uint32_t drop_beyond_planes(const PairRecord& record, std::uint32_t a,
                                                                  std::uint32_t b, std::uint32_t hits) {
    return tandem::drop_beyond_planes(record.blocks_a[a], record.blocks_b[b], hits, record.triangles_a,
                                      record.triangles_b, pose_of(record), record.frame_error);
  }

  __device__ static Judged judge(const QueryArgs& args, std::uint32_t pair, std::uint32_t a,
                                 std::uint32_t b) {
    const PairRecord& record = args.pairs[pair];
    Judged out = {record.triangles_a[a].corner[0].w, record.triangles_b[b].corner[0].w, true, false};
    if constexpr (kMode == QueryMode::boxes) return out;
    const TriangleInFrame in_a = stored_triangle(load_triangle(record.triangles_a, a)),
                          of_b = posed_triangle(pose_of(record), load_triangle(record.triangles_b, b));
    const auto verdicts =
        frame::decide<kBounded>(in_a.corner, of_b.corner, kBounded ? record.frame_error : 0.0f);
    out.contact = verdicts.contact;
    out.undecided = verdicts.undecided;
    return out;
  }
};

/// Judges candidates of clearance: they pass a sieve, and what it leaves is for another kernel, whose threads
/// all have one then.
template <QueryMode kMode>
struct NearInFrame : InFrame<kMode> {
  __device__ static Judged judge(const QueryArgs& args, std::uint32_t pair, std::uint32_t a,
                                 std::uint32_t b) {
    const PairRecord& record = args.pairs[pair];
    const TriangleInFrame in_a = stored_triangle(load_triangle(record.triangles_a, a)),
                          of_b = posed_triangle(pose_of(record), load_triangle(record.triangles_b, b));
    const auto sifted =
        distance::sift(in_a.corner, of_b.corner, args.clearances[pair], args.first_contact_only);
    return {record.triangles_a[a].corner[0].w, record.triangles_b[b].corner[0].w, sifted.within,
            !(sifted.within | sifted.beyond)};
  }
};

/// Leaves out neighbours. Walks without it are compiled without this question.
template <class Means>
struct LeavingOut : Means {
  static constexpr bool kMayLeaveOut = true;
};

/// Takes 3 KB of stack, so its code stands once.
__device__ __noinline__ inline bool decide_exactly(const TrianglePair& pair) {
  return decide_exact(pair) == Verdict::contact;
}

/// Coordinates whose last bits are at most 104 binary digits apart: room that is no larger than that of
/// decide_exactly().
inline constexpr int kFewWords = 5;

__device__ __noinline__ inline bool are_within_in_few_words(const TrianglePair& pair, double within,
                                                            const detail::ExponentRange& range) {
  exact::ClearanceDecision<kFewWords> decision;
  return decision.are_within(pair, within, range);
}

/// The threads that share a room take turns.
__device__ __noinline__ inline bool are_within_in_wide_room(const TrianglePair& pair, double within,
                                                            const detail::ExponentRange& range,
                                                            WideRoom& room) {
  bool done = false, result = false;
  while (!done) {
    if (atomicCAS(&room.lock, 0u, 1u) != 0) continue;
    __threadfence();
    result = room.decision.are_within(pair, within, range);
    __threadfence();
    atomicExch(&room.lock, 0u);
    done = true;
  }
  return result;
}

/// Decides clearance exactly.
__device__ __noinline__ inline bool are_within_exactly(const QueryArgs& args, const PairRecord& record,
                                                       const TrianglePair& pair) {
  if (decide_exactly(pair)) return true;
  const double within = clearance_of(args, record.instance_a, record.instance_b);
  const detail::ExponentRange range = exact::exponents_of(pair, within);
  return range.words() <= kFewWords
             ? are_within_in_few_words(pair, within, range)
             : are_within_in_wide_room(pair, within, range, args.wide_rooms[blockIdx.x % kWideRooms]);
}

/// Boxes in world coordinates, float64, as the triangles. kNear: of clearance.
template <QueryMode kMode, bool kWalksOnly, bool kNear>
struct InWorld {
  static constexpr bool kWorld = true;
  static constexpr bool kCountsOnly = kWalksOnly;
  static constexpr bool kMayLeaveOut = true;
  using Blocks = WalkedBlocks<kMode>;

  __device__ static std::uint32_t test(const QueryArgs& args, const PairRecord& record, std::uint32_t a,
                                       std::uint32_t b, Side& side_a, Side& side_b) {
    const Pose pose_a = stored_pose(args, record.instance_a), pose_b = stored_pose(args, record.instance_b);
    const double within = kNear ? clearance_of(args, record.instance_a, record.instance_b) : 0;
    if constexpr (kMode == QueryMode::exact) {
      const OrientedBlock &block_a = record.oriented_a[a], &block_b = record.oriented_b[b];
      side_a = {block_a.first_below, block_a.size};
      side_b = {block_b.first_below, block_b.size};
      return world_block_pair_mask(pose_a, block_a, farthest(args, record.instance_a), pose_b, block_b,
                                   farthest(args, record.instance_b), within);
    } else {
      const Block &block_a = record.blocks_a[a], &block_b = record.blocks_b[b];
      side_a = Blocks::side(block_a, a, tandem::size_of(block_a));
      side_b = Blocks::side(block_b, b, tandem::size_of(block_b));
      return world_block_pair_mask(pose_a, block_a, pose_b, block_b, within);
    }
  }

  __device__ static double farthest(const QueryArgs& args, std::uint32_t instance) {
    return farthest_of(args.assets[args.instances.asset[instance]].extent);
  }

  static constexpr bool kTriesPlanes = false;

  /// Such pairs are rare: each candidate is decided at once.
  __device__ static Judged judge(const QueryArgs& args, std::uint32_t index, std::uint32_t a,
                                 std::uint32_t b) {
    const PairRecord& record = args.pairs[index];
    Judged out = {record.triangles_a[a].corner[0].w, record.triangles_b[b].corner[0].w,
                  kMode == QueryMode::boxes, false};
    if constexpr (kMode == QueryMode::boxes) return out;
    const TrianglePair pair = posed_pair(args, record, a, b);
    const Verdict verdict = kNear ? distance::decide_within_float64(
                                        pair, clearance_of(args, record.instance_a, record.instance_b))
                                  : decide_float64(pair);
    const bool exactly = verdict == Verdict::undecided;
    atomicAdd(exactly ? &args.state->decided_exactly : &args.state->decided_by_float64, Counter{1});
    if (!exactly)
      out.contact = verdict == Verdict::contact;
    else
      out.contact = kNear ? are_within_exactly(args, record, pair) : decide_exactly(pair);
    return out;
  }
};

}  // namespace
}  // namespace tandem::gpu
