#include "gpu_query_data.h"
#include "tandem/kernels/traversal.h"

// Walk blocks: for each block of a tree a frame that fits the triangles below it, and in that frame the boxes
// of its nodes.
namespace tandem::gpu {
namespace {

constexpr std::uint32_t kNumbering = 1024;            // threads
constexpr std::uint32_t kFewThreads = 32, kManyThreads = 512;
constexpr std::uint32_t kManyTriangles = 4096;        // a block with more below it takes many threads
constexpr int kFrames = 2 + kNodesPerBlock;           // the mesh's axes, principal axes of all and of each node

/// Numbers the walk blocks: 1 + 4 times its place among the internal blocks for the first child of each.
__global__ void __launch_bounds__(kNumbering)
    number_blocks(Asset* asset, LevelView tree, std::uint32_t first, std::uint32_t* number_of,
                  std::uint32_t* file_blocks) {
  __shared__ std::uint32_t count_of[kNumbering / 32], before[kNumbering / 32], in_all;
  const std::uint32_t warp = threadIdx.x / 32;
  if (threadIdx.x == 0) {
    asset->extent = extent_of(tree.blocks[0]);
    asset->root = first;
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
      const std::uint32_t children = first + 1 + kNodesPerBlock * (place + before[warp] + __popc(lanes & lanes_below()));
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

/// Triangles of a surface, weighted by their areas: area, first and second moments.
struct Moments {
  float area, first[3], second[6];  ///< xx, xy, xz, yy, yz, zz

  __device__ void add(const Moments& other) {
    area += other.area;
    for (int k = 0; k < 3; ++k) first[k] += other.first[k];
    for (int k = 0; k < 6; ++k) second[k] += other.second[k];
  }
  __device__ void add(const Triangle& triangle, const Vector3& origin, float scale) {
    Vector3 p[3], sum = {};
    for (int c = 0; c < 3; ++c) {
      p[c] = times(scale, difference(corner_of(triangle, c), origin));
      for (int k = 0; k < 3; ++k) sum.x[k] += p[c].x[k];
    }
    const Vector3 normal = cross(difference(p[1], p[0]), difference(p[2], p[0]));
    const float weight = sqrtf(dot(normal, normal)) + 1e-12f;
    area += weight;
    for (int k = 0, at = 0; k < 3; ++k) {
      first[k] += weight * sum.x[k] / 3;
      for (int l = k; l < 3; ++l, ++at) {
        second[at] += weight / 12 *
                      (sum.x[k] * sum.x[l] + p[0].x[k] * p[0].x[l] + p[1].x[k] * p[1].x[l] + p[2].x[k] * p[2].x[l]);
      }
    }
  }
};

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

/// Principal axes, by Jacobi's rotations.
__device__ BlockRotation principal_axes(const Moments& moments) {
  float a[3][3];
  for (int k = 0, at = 0; k < 3; ++k) {
    for (int l = k; l < 3; ++l, ++at) {
      a[k][l] = a[l][k] = moments.second[at] / moments.area -
                          moments.first[k] / moments.area * (moments.first[l] / moments.area);
    }
  }
  Vector3 axis[3] = {{{1, 0, 0}}, {{0, 1, 0}}, {{0, 0, 1}}};
  for (int sweep = 0; sweep < 6; ++sweep) {
#pragma unroll
    for (int pair = 0; pair < 3; ++pair) {
      const int p = pair == 2 ? 1 : 0, q = pair == 0 ? 1 : 2, r = 3 - p - q;
      if (a[p][q] == 0) continue;
      const float theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
      const float t = (theta >= 0 ? 1 : -1) / (fabsf(theta) + sqrtf(theta * theta + 1));
      const float c = 1 / sqrtf(t * t + 1), s = t * c;
      a[p][p] -= t * a[p][q];
      a[q][q] += t * a[p][q];
      a[p][q] = a[q][p] = 0;
      const float rp = a[r][p], rq = a[r][q];
      a[r][p] = a[p][r] = c * rp - s * rq;
      a[r][q] = a[q][r] = s * rp + c * rq;
      const Vector3 x = axis[p], y = axis[q];
      for (int k = 0; k < 3; ++k) {
        axis[p].x[k] = c * x.x[k] - s * y.x[k];
        axis[q].x[k] = s * x.x[k] + c * y.x[k];
      }
    }
  }
  return rotation_of(axis);
}

/// Along an edge of a triangle and its normal.
__device__ BlockRotation axes_of(const Triangle& triangle, int edge, float scale) {
  const Vector3 from = corner_of(triangle, edge);
  const Vector3 along = times(scale, difference(corner_of(triangle, (edge + 1) % 3), from));
  Vector3 axis[3] = {along, {}, cross(along, times(scale, difference(corner_of(triangle, (edge + 2) % 3), from)))};
  for (int k = 0; k < 3; k += 2) {
    const float length = sqrtf(dot(axis[k], axis[k]));
    if (!(length > 0)) return no_rotation();
    axis[k] = times(1 / length, axis[k]);
  }
  axis[1] = cross(axis[2], axis[0]);
  return rotation_of(axis);
}

/// What a frame is judged by: less where boxes are smaller.
__device__ float cost_of(const float (&extent)[3]) {
  return extent[0] * extent[1] + extent[1] * extent[2] + extent[2] * extent[0];
}

/// Over the threads of a block, all of them taking part; all get the result.
template <std::uint32_t kThreads, typename Value, typename Combine>
__device__ Value over_threads(Value value, const Combine& combine) {
#pragma unroll
  for (int step = 16; step > 0; step /= 2) {
    const Value other = __shfl_xor_sync(kAllLanes, value, step);
    value = combine(value, other);
  }
  if constexpr (kThreads > 32) {
    __shared__ Value of_warp[kThreads / 32];
    __syncthreads();
    if (lane_id() == 0) of_warp[threadIdx.x / 32] = value;
    __syncthreads();
    value = of_warp[0];
    for (std::uint32_t w = 1; w < kThreads / 32; ++w) value = combine(value, of_warp[w]);
  }
  return value;
}

template <std::uint32_t kThreads, typename Value>
__device__ Value largest(Value value) {
  return over_threads<kThreads>(value, [](Value a, Value b) { return a > b ? a : b; });
}
template <std::uint32_t kThreads>
__device__ float sum(float value) {
  return over_threads<kThreads>(value, [](float a, float b) { return a + b; });
}

/// One thread block makes a walk block.
template <std::uint32_t kThreads>
class Fit {
 public:
  __device__ Fit(const LevelView& tree, std::uint32_t at) : tree_(tree), block_(tree.blocks[at]) {
    for (; nodes_ < kNodesPerBlock && block_.kind[nodes_] != NodeKind::imaginary; ++nodes_) {
      first_[nodes_] = block_.is_leaf_block() ? block_.index[nodes_] : first_below(block_.index[nodes_]);
    }
    first_[nodes_] = block_.is_leaf_block() ? first_[nodes_ - 1] + 1 : end_below(block_.index[nodes_ - 1]);
    float largest = 0;
    for (int k = 0; k < 3; ++k) {
      for (int node = 0; node < nodes_; ++node) largest = fmaxf(largest, block_.half_extent[k][node]);
      origin_.x[k] = block_.center[k][0];
    }
    scale_ = largest > 0x1p-120f ? 1 / largest : 1;
  }

  __device__ std::uint32_t triangles() const { return first_[nodes_] - first_[0]; }

  __device__ BlockRotation best_rotation() const {
    const Moments moments = moments_of_lane();
    BlockRotation mine = no_rotation();
    if (lane_id() > 0 && moments.area > 0) mine = principal_axes(moments);
    if (!block_.is_leaf_block()) return best_of_frames(mine);
    const int which = static_cast<int>(lane_id()) - kFrames;
    if (which >= 0 && which < 3 * nodes_)
      mine = axes_of(tree_.triangles[first_[0] + which / 3], which % 3, scale_);
    float cost = 0;
    for (int node = 0; node < nodes_; ++node) cost += cost_of_triangle(frame_of(mine), tree_.triangles[first_[node]]);
    const float least = -largest<32>(-cost);
    const std::uint32_t lanes = __ballot_sync(kAllLanes, cost == least);
    const int best = lanes == 0 ? 0 : __ffs(static_cast<int>(lanes)) - 1;
    return {__shfl_sync(kAllLanes, mine.wx, best), __shfl_sync(kAllLanes, mine.yz, best)};
  }

  /// All threads get the boxes.
  __device__ WalkBlock boxes(const BlockRotation& rotation, double farthest) const {
    WalkBlock out;
    out.rotation = rotation;
    out.size = 0;
    const BlockFrame frame = frame_of(rotation);
    for (int node = 0; node < kNodesPerBlock; ++node) {
      for (int k = 0; k < 3; ++k) {
        out.center[k][node] = kImaginaryCenter;
        out.half_extent[k][node] = kImaginaryHalfExtent;
        if (node >= nodes_) continue;
        double lowest = HUGE_VAL, highest = -HUGE_VAL;
        for (std::uint32_t t = first_[node] + threadIdx.x; t < first_[node + 1]; t += kThreads) {
          for (int c = 0; c < 3; ++c) {
            const double at = along_axis(frame, k, corner_of(tree_.triangles[t], c).x);
            lowest = at < lowest ? at : lowest;
            highest = at > highest ? at : highest;
          }
        }
        lowest = -largest<kThreads>(-lowest);
        highest = largest<kThreads>(highest);
        box_along(lowest, highest, farthest, out.center[k][node], out.half_extent[k][node]);
      }
      const float size = (out.half_extent[0][node] + out.half_extent[1][node]) + out.half_extent[2][node];
      if (size > out.size) out.size = size;
    }
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

  /// Lane 1 gets the moments of all, lanes 2 to 5 those of the nodes.
  __device__ Moments moments_of_lane() const {
    Moments mine = {}, all = {};
    for (int node = 0; node < nodes_; ++node) {
      Moments own = {};
      for (std::uint32_t t = first_[node] + threadIdx.x; t < first_[node + 1]; t += kThreads) {
        own.add(tree_.triangles[t], origin_, scale_);
      }
      own.area = sum<kThreads>(own.area);
      for (float& m : own.first) m = sum<kThreads>(m);
      for (float& m : own.second) m = sum<kThreads>(m);
      all.add(own);
      if (lane_id() == node + 2u) mine = own;
    }
    return lane_id() == 1 ? all : mine;
  }

  __device__ static float cost_of_triangle(const BlockFrame& frame, const Triangle& triangle) {
    float extent[3];
    for (int k = 0; k < 3; ++k) {
      float lowest = INFINITY, highest = -INFINITY;
      for (int c = 0; c < 3; ++c) {
        const float at = along(frame, k, corner_of(triangle, c));
        lowest = fminf(lowest, at), highest = fmaxf(highest, at);
      }
      extent[k] = highest - lowest;
    }
    return cost_of(extent);
  }

  __device__ static float along(const BlockFrame& frame, int k, const Vector3& p) {
    return (frame.scaled[0][k] * p.x[0] + frame.scaled[1][k] * p.x[1] + frame.scaled[2][k] * p.x[2]) *
           frame.inverse_length;
  }

  /// Of the frames of the first lanes.
  __device__ BlockRotation best_of_frames(const BlockRotation& mine) const {
    BlockRotation best = no_rotation();
    float least = INFINITY;
    for (int i = 0; i < 2 + nodes_; ++i) {
      const BlockRotation rotation = {__shfl_sync(kAllLanes, mine.wx, i), __shfl_sync(kAllLanes, mine.yz, i)};
      const BlockFrame frame = frame_of(rotation);
      float cost = 0;
      for (int node = 0; node < nodes_; ++node) {
        float lowest[3] = {INFINITY, INFINITY, INFINITY}, highest[3] = {-INFINITY, -INFINITY, -INFINITY}, extent[3];
        for (std::uint32_t t = first_[node] + threadIdx.x; t < first_[node + 1]; t += kThreads) {
          for (int c = 0; c < 3; ++c) {
            const Vector3 p = corner_of(tree_.triangles[t], c);
            for (int k = 0; k < 3; ++k) {
              const float at = along(frame, k, p);
              lowest[k] = fminf(lowest[k], at), highest[k] = fmaxf(highest[k], at);
            }
          }
        }
        for (int k = 0; k < 3; ++k) extent[k] = largest<kThreads>(highest[k]) + largest<kThreads>(-lowest[k]);
        cost += cost_of(extent);
      }
      if (cost < least) least = cost, best = rotation;
    }
    return best;
  }

  const LevelView& tree_;
  const Block& block_;
  int nodes_ = 0;
  std::uint32_t first_[kNodesPerBlock + 1];  // triangle of each node, and their end
  Vector3 origin_;                           // of moments
  float scale_;
};

template <std::uint32_t kThreads>
__global__ void __launch_bounds__(kThreads)
    fit_blocks(const Asset* asset, LevelView tree, const std::uint32_t* number_of, WalkBlock* out) {
  double squared = 0;
  for (const double reach : asset->extent.reach) squared += reach * reach;
  const double farthest = sqrt(squared);
  for (std::uint32_t at = blockIdx.x; at < tree.block_count; at += gridDim.x) {
    const Fit<kThreads> fit(tree, at);
    if ((fit.triangles() > kManyTriangles) != (kThreads == kManyThreads)) continue;
    WalkBlock block = fit.boxes(fit.best_rotation(), farthest);
    const std::uint32_t below = tree.blocks[at].index[0];
    block.first_below = tree.blocks[at].is_leaf_block() ? below | kIsLeafBlock : number_of[below];
    if (threadIdx.x == 0) out[number_of[at]] = block;
  }
}

}  // namespace

cudaError_t make_walk_blocks(Asset* asset, const LevelView& tree, std::uint32_t first, WalkBlock* out,
                             std::uint32_t* file_blocks, std::uint32_t* number_of, cudaStream_t stream) {
  number_blocks<<<1, kNumbering, 0, stream>>>(asset, tree, first, number_of, file_blocks);
  const std::uint32_t blocks = tree.block_count;
  fit_blocks<kFewThreads><<<blocks, kFewThreads, 0, stream>>>(asset, tree, number_of, out);
  if (tree.triangle_count > kManyTriangles) {
    const std::uint32_t few = blocks < 1024 ? blocks : 1024;
    fit_blocks<kManyThreads><<<few, kManyThreads, 0, stream>>>(asset, tree, number_of, out);
  }
  return cudaGetLastError();
}

}  // namespace tandem::gpu
