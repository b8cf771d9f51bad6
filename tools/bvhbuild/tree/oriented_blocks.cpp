#include <algorithm>
#include <cmath>

#include "parallel/parallel.h"
#include "tandem/formats/box.h"
#include "tree.h"

namespace tandem::build {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

constexpr std::size_t kBlocksAtOnce = 512;

// A search begins with the best frame of the block's children and turns the best one so far about some axes
// at once, one way or the other, by steps that become smaller from round to round.
struct SearchEffort {
  // A block has a frame of its own if at most this many triangles are below it. Above, none is worth it
  // (docs/decisions/gpu-blocks.md), and the checker would have to look at all triangles once more for each
  // level.
  std::uint32_t most_triangles;
  std::uint32_t leaf_triangles;  // whose edges a leaf block tries
  std::uint32_t most_points;     // corners of a node that frames are judged by
  int axes_at_once, rounds;
  float first_step, next_step;  // the next one: times the one before
};

constexpr SearchEffort search_effort(Effort effort) {
  if (effort == Effort::fast) return {256, 2, 8, 1, 1, 0.1f, 1};
  if (effort == Effort::standard) return {4096, 4, 48, 2, 4, 0.2f, 0.5f};
  return {4096, 4, 128, 3, 14, 0.276f, 0.75f};  // 3 first steps reach all frames of a cube
}

using Vector = std::array<float, 3>;

Vector difference(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
float dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vector times(float s, const Vector& a) {
  return {s * a[0], s * a[1], s * a[2]};
}

// Returns the rotation whose columns are the axes.
BlockRotation rotation_of(const Vector (&axis)[3]) {
  const float m00 = axis[0][0], m11 = axis[1][1], m22 = axis[2][2];
  const float m10 = axis[0][1], m20 = axis[0][2], m01 = axis[1][0], m21 = axis[1][2], m02 = axis[2][0],
              m12 = axis[2][1];
  // Four ways, each a multiple of the same quaternion; the longest is the safest.
  const float q[4][4] = {{1 + m00 + m11 + m22, m21 - m12, m02 - m20, m10 - m01},
                         {m21 - m12, 1 + m00 - m11 - m22, m10 + m01, m02 + m20},
                         {m02 - m20, m10 + m01, 1 - m00 + m11 - m22, m21 + m12},
                         {m10 - m01, m02 + m20, m21 + m12, 1 - m00 - m11 + m22}};
  int best = 0;
  for (int i = 1; i < 4; ++i) {
    if (q[i][i] > q[best][best]) best = i;
  }
  bool sound = false;
  for (const float part : q[best]) {
    if (!std::isfinite(part)) return kNoRotation;
    sound = sound || part != 0;
  }
  return sound ? rotation_near(q[best][0], q[best][1], q[best][2], q[best][3]) : kNoRotation;
}

// Times the quaternion 1 + ai + bj + ck.
BlockRotation turned(const BlockRotation& rotation, float a, float b, float c) {
  const float w = quaternion_part(rotation, 0), x = quaternion_part(rotation, 1),
              y = quaternion_part(rotation, 2), z = quaternion_part(rotation, 3);
  return rotation_near(w - x * a - y * b - z * c, x + w * a + y * c - z * b, y + w * b + z * a - x * c,
                       z + w * c + x * b - y * a);
}

// Lane l is of the l-th of four frames that are judged at once.
typedef float Lanes __attribute__((vector_size(16)));
constexpr int kLanes = 4;

Lanes lower_of(Lanes a, Lanes b) {
  return a < b ? a : b;
}
Lanes higher_of(Lanes a, Lanes b) {
  return a > b ? a : b;
}

struct Point {
  Lanes x, y, z;  // the same in all lanes
};

// Says which triangles of the file lie below each block: from first[b] to end[b].
struct Ranges {
  std::vector<std::uint32_t> first, end;

  explicit Ranges(const Tree& tree) : first(tree.blocks.size()), end(tree.blocks.size()) {
    for (std::size_t b = tree.blocks.size(); b-- > 0;) {  // children before parents
      const Block& block = tree.blocks[b];
      int last = kNodesPerBlock - 1;
      while (block.kind[last] == NodeKind::imaginary) --last;
      first[b] = block.is_leaf_block() ? block.index[0] : first[block.index[0]];
      end[b] = block.is_leaf_block() ? block.index[last] + 1 : end[block.index[last]];
    }
  }
};

// Makes the oriented block of one block. Keeps its memory from block to block.
class Fit {
 public:
  Fit(const Geometry& geometry, const Tree& tree, const Ranges& ranges, double farthest, Effort effort)
      : geometry_(geometry),
        tree_(tree),
        ranges_(ranges),
        farthest_(farthest),
        effort_(search_effort(effort)) {}

  // Makes all of a block but first_below. children: the oriented blocks of its children, as far as they are
  // known.
  OrientedBlock make(std::uint32_t at, std::span<const OrientedBlock> children) {
    const Block& block = tree_.blocks[at];
    begin(block);
    OrientedBlock out = along_mesh(block);
    if (ranges_.end[at] - ranges_.first[at] <= effort_.most_triangles) {
      copy_corners(ranges_.first[at], ranges_.end[at]);
      gather();
      OrientedBlock fitted = out;
      fitted.rotation = block.is_leaf_block() ? best_of_triangles() : search(children);
      if (!(fitted.rotation == kNoRotation)) {
        fill_boxes(fitted);
        if (cost_of(fitted) < cost_of(out) && reaches_no_farther(fitted)) out = fitted;
      }
    }
    out.size = oriented_size(out);
    return out;
  }

 private:
  void begin(const Block& block) {
    nodes_ = 0;
    for (; nodes_ < kNodesPerBlock && block.kind[nodes_] != NodeKind::imaginary; ++nodes_) {
      const std::uint32_t below = block.index[nodes_];
      first_[nodes_] = block.is_leaf_block() ? below : ranges_.first[below];
      first_[nodes_ + 1] = block.is_leaf_block() ? below + 1 : ranges_.end[below];
    }
    float largest = 0, sum = 0;
    for (int node = 0; node < nodes_; ++node) {
      for (int k = 0; k < 3; ++k) {
        largest = std::max(largest, block.half_extent[k][node]);
        sum += 0.5f / static_cast<float>(nodes_) * block.half_extent[k][node];
      }
    }
    scale_ = largest > 0x1p-120f ? 1 / largest : 1;
    rim_ = scale_ * sum;
  }

  OrientedBlock along_mesh(const Block& block) const {
    OrientedBlock out = {};
    std::copy_n(&block.centre[0][0], 3 * kNodesPerBlock, &out.centre[0][0]);
    std::copy_n(&block.half_extent[0][0], 3 * kNodesPerBlock, &out.half_extent[0][0]);
    out.rotation = kNoRotation;
    return out;
  }

  const Vector& corner(std::uint32_t triangle, std::uint32_t c) const {
    return corners_[3 * (triangle - corners_first_) + c];
  }

  // Copies the corners of triangles of the file side by side, if they are not yet among those copied last.
  void copy_corners(std::uint32_t first, std::uint32_t end) {
    if (corners_first_ <= first && end <= corners_first_ + corners_.size() / 3) return;
    corners_first_ = first;
    corners_.resize(3 * std::size_t{end - first});
    for (std::uint32_t t = first; t < end; ++t) {
      for (std::uint32_t c = 0; c < 3; ++c)
        corners_[3 * (t - first) + c] = geometry_.points[geometry_.triangles[tree_.order[t]][c]];
    }
  }

  // Gathers some of the corners of each node, each point once.
  void gather() {
    points_.clear();
    for (int node = 0; node < nodes_; ++node) {
      const std::uint32_t corners = 3 * (first_[node + 1] - first_[node]);
      std::uint32_t stride = (corners + 3 * effort_.most_points - 1) / (3 * effort_.most_points);
      if (stride % 3 == 0) ++stride;  // else of each triangle the same corner
      vertices_.clear();
      for (std::uint32_t at = 0; at < corners; at += stride)
        vertices_.push_back(geometry_.triangles[tree_.order[first_[node] + at / 3]][at % 3]);
      std::sort(vertices_.begin(), vertices_.end());
      vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
      for (const std::uint32_t vertex : vertices_) {
        const Vector p = times(scale_, geometry_.points[vertex]);
        points_.push_back({Lanes{} + p[0], Lanes{} + p[1], Lanes{} + p[2]});
      }
      points_end_[node] = points_.size();
    }
  }

  // Return what a frame is judged by: the volumes of its boxes, each with a rim, so that flat and thin ones
  // count too. half_extent: times scale_.
  float cost_of_box(const float (&half_extent)[3]) const {
    return (half_extent[0] + rim_) * (half_extent[1] + rim_) * (half_extent[2] + rim_);
  }
  float cost_of(const OrientedBlock& block) const {
    float cost = 0;
    for (int node = 0; node < nodes_; ++node) {
      float half_extent[3];
      for (int k = 0; k < 3; ++k) half_extent[k] = scale_ * block.half_extent[k][node];
      cost += cost_of_box(half_extent);
    }
    return cost;
  }

  // Returns the costs of rotations by the points gathered.
  Lanes costs_of(const BlockRotation (&rotations)[kLanes]) const {
    Lanes m[3][3];
    for (int l = 0; l < kLanes; ++l) {
      const ScaledRotation exact = scaled_rotation(rotations[l]);
      const float factor = 1 / exact.squared_length;
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) m[i][k][l] = exact.scaled[i][k] * factor;
      }
    }
    Lanes cost = {};
    const Point* first = points_.data();
    for (int node = 0; node < nodes_; ++node) {
      const Point* const end = points_.data() + points_end_[node];
      Lanes volume = Lanes{} + 1;
      for (int k = 0; k < 3; ++k) {
        Lanes lowest = Lanes{} + kInfinity, highest = Lanes{} - kInfinity;
        for (const Point* p = first; p != end; ++p) {
          const Lanes at = m[0][k] * p->x + m[1][k] * p->y + m[2][k] * p->z;
          lowest = lower_of(lowest, at);
          highest = higher_of(highest, at);
        }
        volume *= 0.5f * (highest - lowest) + rim_;
      }
      cost += volume;
      first = end;
    }
    return cost;
  }

  // The best of the frames that were tried, the first of equals.
  class Best {
   public:
    explicit Best(const Fit& fit) : fit_(fit) {}

    void consider(const BlockRotation& rotation) {
      waiting_[count_++] = rotation;
      if (count_ == kLanes) judge();
    }
    // Returns the best of all rotations considered so far.
    const BlockRotation& rotation() {
      if (count_ > 0) judge();
      return rotation_;
    }

   private:
    void judge() {
      std::fill(waiting_ + count_, waiting_ + kLanes, waiting_[0]);
      const Lanes cost = fit_.costs_of(waiting_);
      for (int l = 0; l < count_; ++l) {
        if (cost[l] < cost_) cost_ = cost[l], rotation_ = waiting_[l];
      }
      count_ = 0;
    }

    const Fit& fit_;
    BlockRotation waiting_[kLanes];
    int count_ = 0;
    BlockRotation rotation_ = kNoRotation;
    float cost_ = kInfinity;
  };

  // Returns the best rotation of a leaf block: the mesh's axes, or along an edge of a triangle and its
  // normal.
  BlockRotation best_of_triangles() const {
    Best best(*this);
    best.consider(kNoRotation);
    const std::uint32_t end = std::min(first_[nodes_], first_[0] + effort_.leaf_triangles);
    for (std::uint32_t t = first_[0]; t < end; ++t) {
      for (std::uint32_t edge = 0; edge < 3; ++edge) best.consider(axes_of(t, edge));
    }
    return best.rotation();
  }

  // Returns the axes along an edge of a triangle and its normal.
  BlockRotation axes_of(std::uint32_t triangle, std::uint32_t edge) const {
    const Vector& from = corner(triangle, edge);
    const Vector along = times(scale_, difference(corner(triangle, (edge + 1) % 3), from));
    const Vector normal = cross(along, times(scale_, difference(corner(triangle, (edge + 2) % 3), from)));
    Vector axis[3] = {along, {}, normal};
    for (int k = 0; k < 3; k += 2) {
      const float length = std::sqrt(dot(axis[k], axis[k]));
      if (!(length > 0)) return kNoRotation;
      axis[k] = times(1 / length, axis[k]);
    }
    axis[1] = cross(axis[2], axis[0]);
    return rotation_of(axis);
  }

  BlockRotation search(std::span<const OrientedBlock> children) const {
    Best best(*this);
    best.consider(kNoRotation);
    for (const OrientedBlock& child : children) best.consider(child.rotation);
    float step = effort_.first_step;
    for (int round = 0; round < effort_.rounds; ++round, step *= effort_.next_step) {
      const BlockRotation from = best.rotation();
      for (int turn = 0; turn < 27; ++turn) {
        const int ways[3] = {turn % 3 - 1, turn / 3 % 3 - 1, turn / 9 - 1};
        const int axes = (ways[0] != 0) + (ways[1] != 0) + (ways[2] != 0);
        if (axes == 0 || axes > effort_.axes_at_once) continue;
        best.consider(turned(from, step * static_cast<float>(ways[0]), step * static_cast<float>(ways[1]),
                             step * static_cast<float>(ways[2])));
      }
    }
    return best.rotation();
  }

  // Boxes of real nodes in the block's frame.
  void fill_boxes(OrientedBlock& out) const {
    const ScaledRotation rotation = scaled_rotation(out.rotation);
    for (int node = 0; node < nodes_; ++node) {
      double lowest[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, highest[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
      for (std::uint32_t t = first_[node]; t < first_[node + 1]; ++t) {
        for (std::uint32_t c = 0; c < 3; ++c) {
          float vertex[3];
          std::copy_n(corner(t, c).begin(), 3, vertex);
          for (int k = 0; k < 3; ++k) {
            const double at = scaled_along_axis(rotation, k, vertex);
            lowest[k] = std::min(lowest[k], at), highest[k] = std::max(highest[k], at);
          }
        }
      }
      const double scale = rotation.squared_length;  // quotients ascend as numbers do
      for (int k = 0; k < 3; ++k) {
        box_along(lowest[k] / scale, highest[k] / scale, farthest_, out.centre[k][node],
                  out.half_extent[k][node]);
      }
    }
  }

  // Returns whether the block reaches no farther than the checker allows. Boxes of meshes smaller than 1e-40
  // may reach farther, whose coordinates float32 rounds to a few bits.
  bool reaches_no_farther(const OrientedBlock& block) const {
    bool near = true;
    for (int node = 0; node < nodes_; ++node) {
      for (int k = 0; k < 3; ++k) {
        near = near && std::abs(double{block.centre[k][node]}) + double{block.half_extent[k][node]} <=
                           farthest_ * (1 + 0x1p-20);
      }
    }
    return near;
  }

  const Geometry& geometry_;
  const Tree& tree_;
  const Ranges& ranges_;
  const double farthest_;  // at least the distance of each vertex from the origin
  const SearchEffort effort_;
  int nodes_ = 0;
  std::uint32_t first_[kNodesPerBlock + 1] = {};  // triangle of each node, and their end
  float scale_ = 1;                               // makes the block's size 1
  float rim_ = 0;
  std::vector<Vector> corners_;  // of the triangles of the file from corners_first_ on
  std::uint32_t corners_first_ = 0;
  std::vector<std::uint32_t> vertices_;
  std::vector<Point> points_;
  std::size_t points_end_[kNodesPerBlock] = {};
};

}  // namespace

std::vector<OrientedBlock> orient_blocks(const Geometry& geometry, const Tree& tree, Effort effort) {
  std::vector<OrientedBlock> out(tree.blocks.size());
  // These are the number of each block, and that of its first child, or of its first triangle.
  std::vector<std::uint32_t> number(tree.blocks.size()), first_below(tree.blocks.size());
  std::uint32_t next = 1;
  for (std::size_t b = 0; b < tree.blocks.size(); ++b) {
    const Block& block = tree.blocks[b];
    first_below[b] = block.is_leaf_block() ? OrientedBlock::kIsLeafBlock | block.index[0] : next;
    for (int i = 0; i < kNodesPerBlock && block.kind[i] == NodeKind::internal; ++i)
      number[block.index[i]] = next++;
  }
  double squared = 0;
  for (const double reach : extent_of(tree.blocks[0]).reach) squared += reach * reach;
  const double farthest = std::sqrt(squared);
  const Ranges ranges(tree);
  parallel::for_parts(tree.blocks.size(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    Fit fit(geometry, tree, ranges, farthest, effort);
    for (std::size_t b = end; b-- > begin;) {
      const Block& from = tree.blocks[b];
      int known = 0;  // children that are in this part come later in it, and were made before
      while (known < kNodesPerBlock && from.kind[known] == NodeKind::internal && from.index[known] < end)
        ++known;
      const auto children = std::span(out).subspan(known > 0 ? first_below[b] : 0, known);
      OrientedBlock& block = out[number[b]];
      block = fit.make(static_cast<std::uint32_t>(b), children);
      block.first_below = first_below[b];
    }
  });
  return out;
}

}  // namespace tandem::build
