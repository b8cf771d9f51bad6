#include "gpu_query_data.h"
#include "tandem/kernels/detail/traversal.h"

// Walk blocks: for each block of a tree a frame that fits the triangles below it, and in that frame the boxes
// of its nodes.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kNumbering = 1024;  // threads
constexpr std::uint32_t kMostTriangles =
    4096;  // below a block with a frame of its own: above, none is worth it
constexpr std::uint32_t kMostVertices = 256;             // of a node, that frames are judged by
constexpr int kRounds = 8;                               // of a search
constexpr float kFirstStep = 0.276f, kNextStep = 0.58f;  // 3 steps of the first reach all frames of a cube

/// Numbers the walk blocks of an asset a thread block: 1 + 4 times its place among the internal blocks for
/// the first child of each, after the root's.
__global__ void __launch_bounds__(kNumbering)
    number_blocks(Asset* assets, std::uint32_t* all_numbers, std::uint32_t* file_blocks) {
  __shared__ std::uint32_t count_of[kNumbering / 32], before[kNumbering / 32], in_all;
  Asset& asset = assets[blockIdx.x];
  const LevelView& tree = asset.tree;
  const std::uint32_t warp = threadIdx.x / 32, first = asset.root;
  std::uint32_t* const number_of = all_numbers + asset.first_block;
  if (threadIdx.x == 0) {
    asset.extent = extent_of(tree.blocks[0]);
    number_of[0] = first;
    file_blocks[first] = 0;
  }
  std::uint32_t place = 0;  // of the first block of these
  for (std::uint32_t chunk = 0; chunk < tree.block_count; chunk += kNumbering) {
    const std::uint32_t i = chunk + threadIdx.x;
    const bool internal = i < tree.block_count && !tree.blocks[i].is_leaf_block();
    const std::uint32_t lanes = __ballot_sync(kAllLanes, internal);
    if (lane_id() == 0) count_of[warp] = __popc(lanes);
    __syncthreads();
    if (threadIdx.x == 0) {
      in_all = 0;
      for (std::uint32_t w = 0; w < kNumbering / 32; ++w) before[w] = in_all, in_all += count_of[w];
    }
    __syncthreads();
    if (internal) {
      const std::uint32_t children =
          first + 1 + kNodesPerBlock * (place + before[warp] + __popc(lanes & lanes_below()));
      for (int node = 0; node < kNodesPerBlock; ++node) {
        if (tree.blocks[i].kind[node] == NodeKind::imaginary) break;
        number_of[tree.blocks[i].index[node]] = children + node;
        file_blocks[children + node] = tree.blocks[i].index[node];
      }
    }
    place += in_all;
    __syncthreads();
  }
}

struct Vector3 {
  float x[3];
};

__device__ Vector3 corner_of(const Triangle& triangle, int corner) {
  const float* p = triangle.corner[corner].position;
  return {{p[0], p[1], p[2]}};
}
__device__ Vector3 difference(const Vector3& a, const Vector3& b) {
  return {{a.x[0] - b.x[0], a.x[1] - b.x[1], a.x[2] - b.x[2]}};
}
__device__ Vector3 cross(const Vector3& a, const Vector3& b) {
  return {{a.x[1] * b.x[2] - a.x[2] * b.x[1], a.x[2] * b.x[0] - a.x[0] * b.x[2],
           a.x[0] * b.x[1] - a.x[1] * b.x[0]}};
}
__device__ float dot(const Vector3& a, const Vector3& b) {
  return a.x[0] * b.x[0] + a.x[1] * b.x[1] + a.x[2] * b.x[2];
}
__device__ Vector3 times(float s, const Vector3& a) {
  return {{s * a.x[0], s * a.x[1], s * a.x[2]}};
}

/// Of the rotation whose columns are the axes.
__device__ BlockRotation rotation_of(const Vector3 (&axis)[3]) {
  const float m00 = axis[0].x[0], m11 = axis[1].x[1], m22 = axis[2].x[2];
  const float m10 = axis[0].x[1], m20 = axis[0].x[2], m01 = axis[1].x[0], m21 = axis[1].x[2],
              m02 = axis[2].x[0], m12 = axis[2].x[1];
  // Four ways, each a multiple of the same quaternion; the longest is the safest.
  const float q[4][4] = {{1 + m00 + m11 + m22, m21 - m12, m02 - m20, m10 - m01},
                         {m21 - m12, 1 + m00 - m11 - m22, m10 + m01, m02 + m20},
                         {m02 - m20, m10 + m01, 1 - m00 + m11 - m22, m21 + m12},
                         {m10 - m01, m02 + m20, m21 + m12, 1 - m00 - m11 + m22}};
  int best = 0;
  for (int i = 1; i < 4; ++i) {
    if (q[i][i] > q[best][best]) best = i;
  }
  float part[4];
  bool sound = false;
  for (int i = 0; i < 4; ++i) {
    part[i] = best == 0 ? q[0][i] : best == 1 ? q[1][i] : best == 2 ? q[2][i] : q[3][i];
    if (!isfinite(part[i])) return no_rotation();
    sound = sound || part[i] != 0;
  }
  return sound ? rotation_near(part[0], part[1], part[2], part[3]) : no_rotation();
}

/// Along an edge of a triangle and its normal.
__device__ BlockRotation axes_of(const Triangle& triangle, int edge, float scale) {
  const Vector3 from = corner_of(triangle, edge);
  const Vector3 along = times(scale, difference(corner_of(triangle, (edge + 1) % 3), from));
  Vector3 axis[3] = {
      along, {}, cross(along, times(scale, difference(corner_of(triangle, (edge + 2) % 3), from)))};
  for (int k = 0; k < 3; k += 2) {
    const float length = sqrtf(dot(axis[k], axis[k]));
    if (!(length > 0)) return no_rotation();
    axis[k] = times(1 / length, axis[k]);
  }
  axis[1] = cross(axis[2], axis[0]);
  return rotation_of(axis);
}

__device__ bool is_turned(const BlockRotation& rotation) {
  const BlockRotation none = no_rotation();
  return rotation.wx != none.wx || rotation.yz != none.yz;
}

__device__ float largest_of_lanes(float value) {
#pragma unroll
  for (int step = 16; step > 0; step /= 2) value = fmaxf(value, __shfl_xor_sync(kAllLanes, value, step));
  return value;
}
__device__ double largest_of_lanes(double value) {
#pragma unroll
  for (int step = 16; step > 0; step /= 2) value = fmax(value, __shfl_xor_sync(kAllLanes, value, step));
  return value;
}

/// A warp makes a walk block. Each lane judges another frame, over the same vertices.
class Fit {
 public:
  __device__ Fit(const LevelView& tree, std::uint32_t at) : tree_(tree), block_(tree.blocks[at]) {
    for (; nodes_ < kNodesPerBlock && block_.kind[nodes_] != NodeKind::imaginary; ++nodes_) {
      first_[nodes_] = block_.is_leaf_block() ? block_.index[nodes_] : first_below(block_.index[nodes_]);
    }
    first_[nodes_] = block_.is_leaf_block() ? first_[nodes_ - 1] + 1 : end_below(block_.index[nodes_ - 1]);
    float largest = 0, sum = 0;
    for (int node = 0; node < nodes_; ++node) {
      for (int k = 0; k < 3; ++k) {
        largest = fmaxf(largest, block_.half_extent[k][node]);
        sum += 0.5f / static_cast<float>(nodes_) * block_.half_extent[k][node];
      }
    }
    scale_ = largest > 0x1p-120f ? 1 / largest : 1;
    rim_ = scale_ * sum;
  }

  __device__ WalkBlock make(double farthest) const {
    WalkBlock out;
    out.rotation = no_rotation();
    for (int node = 0; node < kNodesPerBlock; ++node) {
      for (int k = 0; k < 3; ++k) {
        out.center[k][node] = node < nodes_ ? block_.center[k][node] : kImaginaryCenter;
        out.half_extent[k][node] = node < nodes_ ? block_.half_extent[k][node] : kImaginaryHalfExtent;
      }
    }
    if (first_[nodes_] - first_[0] <= kMostTriangles) {
      WalkBlock fitted = out;
      fitted.rotation = block_.is_leaf_block() ? best_of_triangles() : search();
      if (is_turned(fitted.rotation)) {
        fill_boxes(fitted, farthest);
        if (cost_of(fitted) < cost_of(out)) out = fitted;
      }
    }
    out.size = size_of(out);
    return out;
  }

 private:
  __device__ std::uint32_t first_below(std::uint32_t at) const {
    while (!tree_.blocks[at].is_leaf_block()) at = tree_.blocks[at].index[0];
    return tree_.blocks[at].index[0];
  }
  __device__ std::uint32_t end_below(std::uint32_t at) const {
    for (;;) {
      int last = kNodesPerBlock - 1;
      while (tree_.blocks[at].kind[last] == NodeKind::imaginary) --last;
      if (tree_.blocks[at].is_leaf_block()) return tree_.blocks[at].index[last] + 1;
      at = tree_.blocks[at].index[last];
    }
  }

  /// What a frame is judged by: the volumes of its boxes, each with a rim, so that flat and thin ones count
  /// too. half_extent: times scale_.
  __device__ float cost_of_box(const float (&half_extent)[3]) const {
    return (half_extent[0] + rim_) * (half_extent[1] + rim_) * (half_extent[2] + rim_);
  }
  __device__ float cost_of(const WalkBlock& block) const {
    float cost = 0;
    for (int node = 0; node < nodes_; ++node) {
      float half_extent[3];
      for (int k = 0; k < 3; ++k) half_extent[k] = scale_ * block.half_extent[k][node];
      cost += cost_of_box(half_extent);
    }
    return cost;
  }

  /// Of a lane's frame, by some of the vertices.
  __device__ float cost_of(const BlockRotation& rotation) const {
    const BlockFrame frame = frame_of(rotation);
    const float factor = scale_ * frame.inverse_length;
    float cost = 0;
    for (int node = 0; node < nodes_; ++node) {
      const std::uint32_t corners = 3 * (first_[node + 1] - first_[node]);
      std::uint32_t stride = (corners + kMostVertices - 1) / kMostVertices;
      if (stride % 3 == 0) ++stride;  // else of each triangle the same corner
      float lowest[3] = {INFINITY, INFINITY, INFINITY}, highest[3] = {-INFINITY, -INFINITY, -INFINITY};
      for (std::uint32_t at = 0; at < corners; at += stride) {
        const Vector3 p = corner_of(tree_.triangles[first_[node] + at / 3], static_cast<int>(at % 3));
        for (int k = 0; k < 3; ++k) {
          const float x = frame.scaled[0][k] * (factor * p.x[0]) + frame.scaled[1][k] * (factor * p.x[1]) +
                          frame.scaled[2][k] * (factor * p.x[2]);
          lowest[k] = fminf(lowest[k], x), highest[k] = fmaxf(highest[k], x);
        }
      }
      float half_extent[3];
      for (int k = 0; k < 3; ++k) half_extent[k] = 0.5f * (highest[k] - lowest[k]);
      cost += cost_of_box(half_extent);
    }
    return cost;
  }

  /// The lanes' best, the first of equals.
  __device__ BlockRotation best_of_lanes(const BlockRotation& mine, float cost) const {
    const float least = -largest_of_lanes(-cost);
    const std::uint32_t lanes = __ballot_sync(kAllLanes, cost == least);
    const int best = lanes == 0 ? 0 : __ffs(static_cast<int>(lanes)) - 1;
    return {__shfl_sync(kAllLanes, mine.wx, best), __shfl_sync(kAllLanes, mine.yz, best)};
  }

  /// Of a leaf block: the mesh's axes, or along an edge of a triangle and its normal.
  __device__ BlockRotation best_of_triangles() const {
    BlockRotation mine = no_rotation();
    const int which = static_cast<int>(lane_id()) - 1;
    if (which >= 0 && which < 3 * nodes_)
      mine = axes_of(tree_.triangles[first_[0] + which / 3], which % 3, scale_);
    return best_of_lanes(mine, cost_of(mine));
  }

  /// Turns a frame about three axes at once, one way or the other or not at all, ever less.
  __device__ BlockRotation search() const {
    BlockRotation best = no_rotation();
    float step = kFirstStep;
    for (int round = 0; round < kRounds; ++round, step *= kNextStep) {
      const int turn = lane_id() < 27 ? (static_cast<int>(lane_id()) + 13) % 27 : 13;  // 13: not at all
      const BlockRotation mine =
          turned(best, step * static_cast<float>(turn % 3 - 1), step * static_cast<float>(turn / 3 % 3 - 1),
                 step * static_cast<float>(turn / 9 - 1));
      best = best_of_lanes(mine, cost_of(mine));
    }
    return best;
  }

  /// Times the quaternion 1 + ai + bj + ck.
  __device__ static BlockRotation turned(const BlockRotation& rotation, float a, float b, float c) {
    if (a == 0 && b == 0 && c == 0) return rotation;
    const float w = oriented_detail::quaternion_part(rotation.wx, false),
                x = oriented_detail::quaternion_part(rotation.wx, true),
                y = oriented_detail::quaternion_part(rotation.yz, false),
                z = oriented_detail::quaternion_part(rotation.yz, true);
    return rotation_near(w - x * a - y * b - z * c, x + w * a + y * c - z * b, y + w * b + z * a - x * c,
                         z + w * c + x * b - y * a);
  }

  /// Boxes of real nodes in the block's frame. All lanes get them.
  __device__ void fill_boxes(WalkBlock& out, double farthest) const {
    const BlockFrame frame = frame_of(out.rotation);
    for (int node = 0; node < nodes_; ++node) {
      for (int k = 0; k < 3; ++k) {
        double lowest = HUGE_VAL, highest = -HUGE_VAL;
        for (std::uint32_t t = first_[node] + lane_id(); t < first_[node + 1]; t += 32) {
          for (int c = 0; c < 3; ++c) {
            const double at = along_axis(frame, k, corner_of(tree_.triangles[t], c).x);
            lowest = fmin(lowest, at), highest = fmax(highest, at);
          }
        }
        box_along(-largest_of_lanes(-lowest), largest_of_lanes(highest), farthest, out.center[k][node],
                  out.half_extent[k][node]);
      }
    }
  }

  /// The square root of the surface of the largest box.
  __device__ float size_of(const WalkBlock& block) const {
    float largest = 0;
    for (int node = 0; node < nodes_; ++node) {
      float h[3];
      for (int k = 0; k < 3; ++k) h[k] = scale_ * block.half_extent[k][node];
      largest = fmaxf(largest, h[0] * h[1] + h[1] * h[2] + h[2] * h[0]);
    }
    return sqrtf(largest) / scale_;
  }

  const LevelView& tree_;
  const Block& block_;
  int nodes_ = 0;
  std::uint32_t first_[kNodesPerBlock + 1];  // triangle of each node, and their end
  float scale_;                              // makes the block's size 1
  float rim_;
};

/// The last asset whose blocks begin at `block` or before.
__device__ const Asset& asset_of(const Asset* assets, std::uint32_t count, std::uint32_t block) {
  std::uint32_t at = 0;
  while (count > 1) {
    const std::uint32_t half = count / 2;
    if (assets[at + half].first_block <= block) at += half;
    count -= half;
  }
  return assets[at];
}

/// A warp a block of the files.
__global__ void __launch_bounds__(32) fit_blocks(const Asset* assets, std::uint32_t asset_count,
                                                 const std::uint32_t* number_of, WalkBlock* out) {
  const Asset& asset = asset_of(assets, asset_count, blockIdx.x);
  const LevelView& tree = asset.tree;
  double squared = 0;
  for (const double reach : asset.extent.reach) squared += reach * reach;
  const std::uint32_t at = blockIdx.x - asset.first_block, below = tree.blocks[at].index[0];
  WalkBlock block = Fit(tree, at).make(sqrt(squared));
  block.first_below =
      tree.blocks[at].is_leaf_block() ? below | kIsLeafBlock : number_of[asset.first_block + below];
  if (threadIdx.x == 0) out[number_of[blockIdx.x]] = block;
}

}  // namespace

cudaError_t make_walk_blocks(Asset* assets, std::uint32_t asset_count, std::uint32_t blocks, WalkBlock* out,
                             std::uint32_t* file_blocks, std::uint32_t* number_of, cudaStream_t stream) {
  number_blocks<<<asset_count, kNumbering, 0, stream>>>(assets, number_of, file_blocks);
  fit_blocks<<<blocks, 32, 0, stream>>>(assets, asset_count, number_of, out);
  return cudaGetLastError();
}

}  // namespace tandem::gpu
