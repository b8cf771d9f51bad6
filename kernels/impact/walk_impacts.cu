#include "kernels/impact/impact_data.h"
#include "kernels/impact/triangle_impact.h"

// The walks of all moving pairs, round by round. Multiplies and adds may be fused: the proofs of box_times.h
// and pair_motion.h allow it. CUDA's sine and cosine in float64 err by 2 units in the last place at most
// (CUDA C++ Programming Guide, "Mathematical Functions", "Double-Precision Floating-Point Functions"), as
// rotation_by() asks for.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kThreads = 128;

/// Lanes for each block pair, one for each of its node pairs.
constexpr std::uint32_t kLanes = kNodesPerBlock * kNodesPerBlock;

__device__ void note_contact(const ImpactArgs& args, const Contact& contact) {
  const Counter both = static_cast<Counter>(contact.triangle_a) << 32 | contact.triangle_b;
  // Looked at before it is written: many contacts of few pairs would queue up at them.
  Counter* least = &args.triangles[contact.pair];
  if (both < *static_cast<volatile Counter*>(least)) atomicMin(least, both);
}

__global__ void __launch_bounds__(kThreads) note_contacts(const __grid_constant__ ImpactArgs args) {
  wait_for_kernel_before();
  if (!can_walk(args)) return;
  for (Counter i = first_of_thread(); i < args.query->contacts; i += threads_of_grid())
    note_contact(args, args.contacts[i]);
}

__device__ double diagonal_of(const GpuAsset& asset) {
  double squared = 0;
  for (int k = 0; k < 3; ++k) {
    const double side = static_cast<double>(asset.upper[k]) - static_cast<double>(asset.lower[k]);
    squared += side * side;
  }
  return sqrt(squared);
}

__device__ ImpactPair make_pair(const ImpactArgs& args, const ObjectPair& given) {
  const GpuAsset &a = args.assets[args.instances.asset[given.a]],
                 &b = args.assets[args.instances.asset[given.b]];
  ImpactPair pair;
  pair.motion = impact::pair_motion(args.bodies[given.a], args.bodies[given.b]);
  pair.tolerance = args.tolerance * manifold::lesser(diagonal_of(a), diagonal_of(b));
  pair.acceleration = impact::largest_acceleration(pair.motion);
  pair.blocks_a = a.tree.blocks;
  pair.blocks_b = b.tree.blocks;
  pair.triangles_a = a.tree.triangles;
  pair.triangles_b = b.tree.triangles;
  return pair;
}

/// Result: how many pieces are to be walked.
__device__ std::uint32_t begin_pair(const ImpactArgs& args, std::uint32_t index) {
  const ObjectPair given = args.given.pairs[index];
  const ImpactPair pair = make_pair(args, given);
  const bool in_contact = args.triangles[index] != kNoTriangles;
  args.pairs[index] = pair;
  args.sought[index] = in_contact ? 0 : 1;
  args.stops[index] = static_cast<Counter>(__double_as_longlong(1.0));
  args.is_sampled[index] = 0;
  if (in_contact || given.a == given.b || stay_apart(pair.motion, args.boxes[given.a], args.boxes[given.b]))
    return 0;
  return static_cast<std::uint32_t>(impact::pieces_of(pair.motion));
}

/// The sum of what this lane and those before it have.
__device__ std::uint32_t sum_up_to_lane(std::uint32_t mine) {
  for (std::uint32_t step = 1; step < 32; step *= 2) {
    const std::uint32_t before = __shfl_up_sync(kAllLanes, mine, step);
    if (lane_id() >= step) mine += before;
  }
  return mine;
}

__device__ void add_walks(const ImpactArgs& args, std::uint32_t pair, std::uint32_t pieces) {
  const std::uint32_t end = sum_up_to_lane(pieces), all = __shfl_sync(kAllLanes, end, 31);
  if (all == 0) return;
  Counter first = 0;
  if (lane_id() == 0) {
    first = atomicAdd(&args.state->parts, static_cast<Counter>(all));
    atomicAdd(args.frontier.counts, static_cast<Counter>(all));
    atomicAdd(&args.state->walks, all);
  }
  first = __shfl_sync(kAllLanes, first, 0) + end - pieces;
  // Parts and block pairs of the first round have the same places.
  for (std::uint32_t i = 0; i < pieces; ++i) {
    const Counter place = first + i;
    const bool fits = place < args.capacity.parts;
    const impact::Span time = impact::piece_of_step(i, pieces);
    const std::uint32_t named = fits ? static_cast<std::uint32_t>(place) : kNoIndex;
    if (fits) {
      ImpactPart& part = args.parts[place];
      part.pair = pair;
      part.piece = named;
      part.number = 1;
      part.time = time;
    }
    if (place < args.frontier.capacity)
      args.frontier.entries[place] = {named, 0, 0, kAllNodePairs, time.begin};
  }
}

__global__ void __launch_bounds__(kThreads) begin(const __grid_constant__ ImpactArgs args) {
  wait_for_kernel_before();
  if (!can_walk(args)) return;
  const std::uint32_t pairs = *args.given.count;
  for (std::uint32_t first = first_of_thread() - lane_id(); first < pairs; first += threads_of_grid()) {
    const std::uint32_t index = first + lane_id();
    add_walks(args, index, index < pairs ? begin_pair(args, index) : 0);
  }
}

/// Returns what the other lane of two has.
__device__ impact::TreePlace of_other_lane(const impact::TreePlace& mine) {
  constexpr int kNumbers = sizeof(impact::TreePlace) / sizeof(double);
  static_assert(sizeof(impact::TreePlace) == kNumbers * sizeof(double));
  impact::TreePlace other;
  const auto* from = reinterpret_cast<const double*>(&mine);
  auto* to = reinterpret_cast<double*>(&other);
#pragma unroll
  for (int i = 0; i < kNumbers; ++i) to[i] = __shfl_xor_sync(kAllLanes, from[i], 1);
  return other;
}

/// pair_frames(), by two lanes, each the frame of one of the bodies.
__device__ void make_frame(const ImpactPair& pair, ImpactPart& part, bool mine, bool of_b) {
  const impact::PairMotion& motion = pair.motion;
  const impact::MovingBody& body = of_b ? *motion.b : *motion.a;
  const double time = part.time.begin, sign = of_b ? -1 : 1;
  impact::Matrix3 turned;
  rotation_by(time * body.turn, turned.row);
  const impact::TreePlace own = tree_place(body, turned), other = of_other_lane(own);
  const manifold::Vector3 offset = motion.offset + time * motion.displacement;
  if (!mine) return;
  (of_b ? part.frames.of_b : part.frames.of_a) =
      frame_motion(motion, own, other, sign * offset, sign * motion.displacement);
  if (of_b) return;
  part.frames.slack = motion.slack;
  part.frames.margin = impact::kAim * pair.tolerance;
}

/// Makes the frames of parts that came in the round before.
__global__ void __launch_bounds__(kThreads)
    make_frames(const __grid_constant__ ImpactArgs args, std::uint32_t round) {
  wait_for_kernel_before();
  const Counter all = args.state->parts, stored = all < args.capacity.parts ? all : args.capacity.parts;
  if (first_of_thread() == 0) args.state->made[round + 1] = stored;
  const Counter made = args.state->made[round], left = 2 * (stored - made);
  for (Counter first = first_of_thread() - lane_id(); first < left; first += threads_of_grid()) {
    const Counter task = first + lane_id();
    const bool mine = task < left;
    ImpactPart& part = args.parts[made + (mine ? task / 2 : 0)];
    make_frame(args.pairs[part.pair], part, mine, lane_id() % 2 != 0);
  }
}

/// A half of a part, which a block pair of the next round may name. Made once: whoever needs it first puts it
/// into the table.
__device__ std::uint32_t half_of(const ImpactArgs& args, const ImpactPart& part, std::uint32_t which) {
  const std::uint32_t number = 2 * part.number + which, key = part.piece * impact::kPartNumbers + number;
  std::uint32_t slot = key * 0x9E3779B1u >> 7;
  for (std::uint32_t tries = 0; tries < args.most_keys; ++tries, ++slot) {
    slot &= args.most_keys - 1;
    const std::uint32_t before = atomicCAS(&args.part_keys[slot], kNoIndex, key);
    if (before == key) return kInTable | slot;
    if (before != kNoIndex) continue;
    const Counter place = atomicAdd(&args.state->parts, Counter{1});
    args.part_of_key[slot] = place < args.capacity.parts ? static_cast<std::uint32_t>(place) : kNoIndex;
    if (place < args.capacity.parts) {
      ImpactPart& half = args.parts[place];
      half.pair = part.pair;
      half.piece = part.piece;
      half.number = number;
      half.time = impact::part_of_piece(args.parts[part.piece].time, number);
    }
    return kInTable | slot;
  }
  // The table has twice the room that parts have.
  atomicAdd(&args.state->parts, Counter{1});
  return kNoIndex;
}

/// The least over the lanes whose numbers differ in these two bits.
__device__ double least_over(double mine, int bit0, int bit1) {
  mine = manifold::lesser(mine, __shfl_xor_sync(kAllLanes, mine, bit0));
  return manifold::lesser(mine, __shfl_xor_sync(kAllLanes, mine, bit1));
}

struct Following {
  AppendBatch<ImpactBlockPair, 1> block_pairs;
  AppendBatch<ImpactTrianglePair, 1> triangle_pairs;
};

/// A block pair whose nodes may meet: what follows it, by the kLanes lanes that have it. hits: of its node
/// pairs; hit: this lane's. apart: until when that is. soonest_*: of the hits in the lane's row and column.
__device__ void follow(const ImpactArgs& args, const ImpactBlockPair& entry, const ImpactPair& pair,
                       std::uint32_t hits, double apart, double soonest_in_row, double soonest_in_column,
                       Following& following) {
  const ImpactPart& part = args.parts[entry.part];
  const Block &a = pair.blocks_a[entry.a], &b = pair.blocks_b[entry.b];
  const std::uint32_t node_pair = lane_id() % kLanes, i = node_pair / kNodesPerBlock,
                      j = node_pair % kNodesPerBlock;
  const float size_a = size_of(a), size_b = size_of(b);
  if (impact::worth_halving(pair.acceleration, part.number, part.time.end - part.time.begin, size_a,
                            size_b)) {
    if (node_pair < 2)
      following.block_pairs.put(0, {half_of(args, part, node_pair), entry.a, entry.b, hits, entry.apart});
    return;
  }
  const bool hit = (hits >> node_pair & 1) != 0, leaves_a = a.is_leaf_block(), leaves_b = b.is_leaf_block();
  if (leaves_a && leaves_b) {
    if (hit) following.triangle_pairs.put(0, {entry.part, a.index[i], b.index[j], apart});
    return;
  }
  const Descent descent = leaves_a != leaves_b ? descent_beside_leaves(leaves_a)
                                               : descent_by_size(size_a, size_b, kDescendsAlone);
  const std::uint32_t row = hits >> 4 * i & 0xFu, column = hits >> j & 0x1111u;
  if (descent == Descent::both && hit)
    following.block_pairs.put(0, {entry.part, a.index[i], b.index[j], kAllNodePairs, apart});
  if (descent == Descent::a_alone && j == 0 && row != 0)
    following.block_pairs.put(0, {entry.part, a.index[i], entry.b, row * 0x1111u, soonest_in_row});
  if (descent == Descent::b_alone && i == 0 && column != 0)
    following.block_pairs.put(0, {entry.part, entry.a, b.index[j], column * 0xFu, soonest_in_column});
}

/// Tests block pairs; a warp calls it, with kLanes lanes for each block pair. Result: whether the lane's was
/// tested.
__device__ bool visit(const ImpactArgs& args, bool mine, ImpactBlockPair entry, Following& following) {
  entry.part = part_named(args, entry.part);
  mine = mine && entry.part != kNoIndex;
  const ImpactPart& part = args.parts[mine ? entry.part : 0];
  const double sought = args.sought[part.pair];
  mine = mine && entry.apart < sought;
  const ImpactPair& pair = args.pairs[part.pair];
  const std::uint32_t node_pair = lane_id() % kLanes;
  const int i = static_cast<int>(node_pair / kNodesPerBlock),
            j = static_cast<int>(node_pair % kNodesPerBlock);
  double apart = INFINITY;
  if (mine && (entry.mask >> node_pair & 1) != 0) {
    const Block &a = pair.blocks_a[entry.a], &b = pair.blocks_b[entry.b];
    const double most = manifold::lesser(part.time.end, sought) - part.time.begin;
    if (a.half_extent[0][i] >= 0 && b.half_extent[0][j] >= 0) {
      const double time = node_pair_time(part.frames, a, i, b, j, most);
      // The boxes below a node are apart for as long as the node is.
      if (time < most) apart = manifold::greater(part.time.begin + time, entry.apart);
    }
  }
  const std::uint32_t hits = __ballot_sync(kAllLanes, apart < INFINITY) >> (lane_id() & kLanes) & 0xFFFFu;
  const double in_row = least_over(apart, 1, 2), in_column = least_over(apart, 4, 8);
  if (hits != 0) follow(args, entry, pair, hits, apart, in_row, in_column, following);
  return mine;
}

__global__ void __launch_bounds__(kThreads, 4)
    visit_round(const __grid_constant__ ImpactArgs args, std::uint32_t round) {
  wait_for_kernel_before();
  const AppendList<ImpactBlockPair> from = args.frontier.round(round), to = args.frontier.round(round + 1);
  const std::uint32_t count = stored_in(from);
  std::uint32_t visited = 0;
  share_out<kLanes>(count, 1, [&](std::uint32_t index, std::uint32_t) {
    Following following;
    const bool mine = index < count;
    const bool tested = visit(args, mine, from.entries[mine ? index : 0], following);
    visited += __popc(__ballot_sync(kAllLanes, tested)) / kLanes;
    following.block_pairs.append_to(to);
    following.triangle_pairs.append_to(args.triangle_pairs);
  });
  if (lane_id() == 0 && visited != 0) atomicAdd(&args.state->visited, static_cast<Counter>(visited));
}

Grid grid_of(const ImpactArgs& args, std::uint32_t blocks_each, cudaStream_t stream) {
  return {args.limits.processors * blocks_each, kThreads, 0, stream, args.limits.early_launch};
}

}  // namespace

cudaError_t begin_impacts(const ImpactArgs& args, cudaStream_t stream) {
  const cudaError_t error = launch_after(grid_of(args, 4, stream), note_contacts, args);
  return error == cudaSuccess ? launch_after(grid_of(args, 4, stream), begin, args) : error;
}

cudaError_t walk_impacts(const ImpactArgs& args, std::uint32_t first, std::uint32_t end,
                         cudaStream_t stream) {
  cudaError_t error = cudaSuccess;
  for (std::uint32_t round = first; round < end && error == cudaSuccess; ++round) {
    error = launch_after(grid_of(args, 4, stream), make_frames, args, round);
    if (error == cudaSuccess) error = launch_after(grid_of(args, 4, stream), visit_round, args, round);
  }
  return error;
}

}  // namespace tandem::gpu
