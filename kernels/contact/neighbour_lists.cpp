#include "kernels/contact/neighbour_lists.h"

#include <algorithm>

#include "kernels/scene/scene_state.h"

namespace tandem {
namespace {

/// The edges of a mesh, from both ends.
class Edges {
 public:
  /// False: out of memory.
  bool find(std::span<const TriangleTopology> triangles, std::uint32_t vertices) {
    if (!first_.resize(std::size_t{vertices} + 2)) return false;
    std::fill_n(first_.data(), first_.size(), std::size_t{0});
    // Each end of a side is counted two places on, so that first_[v + 1] is where v's begin.
    for_sides(triangles, [this](std::uint32_t from, std::uint32_t) { ++first_[from + 2]; });
    for (std::size_t i = 2; i < first_.size(); ++i) first_[i] += first_[i - 1];
    if (!ends_.resize(first_[first_.size() - 1])) return false;
    for_sides(triangles, [this](std::uint32_t from, std::uint32_t to) { ends_[first_[from + 1]++] = to; });
    drop_repeated(vertices);
    return true;
  }

  std::span<const std::uint32_t> from(std::uint32_t vertex) const {
    return {ends_.data() + first_[vertex], first_[vertex + 1] - first_[vertex]};
  }

 private:
  /// Calls f(from, to) for each side in both directions.
  template <typename F>
  static void for_sides(std::span<const TriangleTopology> triangles, const F& f) {
    for (const TriangleTopology& triangle : triangles) {
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t u = triangle.vertex[k], v = triangle.vertex[(k + 1) % 3];
        if (u == v) continue;
        f(u, v);
        f(v, u);
      }
    }
  }

  /// An edge has a side in each of its triangles.
  void drop_repeated(std::uint32_t vertices) {
    std::size_t from = 0, kept = 0;
    for (std::uint32_t v = 0; v < vertices; ++v) {
      std::uint32_t* const begin = ends_.data() + from;
      from = first_[v + 1];
      std::uint32_t* const end = ends_.data() + from;
      std::sort(begin, end);
      first_[v] = kept;
      for (const std::uint32_t* i = begin; i != end; ++i) {
        if (i == begin || *i != i[-1]) ends_[kept++] = *i;
      }
    }
    first_[vertices] = kept;
  }

  Buffer<std::size_t> first_;
  Buffer<std::uint32_t> ends_;
};

/// Finds the vertices within a number of edges of a vertex, nearest first.
class Surroundings {
 public:
  /// False: out of memory.
  bool prepare(std::uint32_t vertices) {
    if (!reached_by_.resize(vertices)) return false;
    std::fill_n(reached_by_.data(), vertices, kNoIndex);
    return true;
  }

  /// The vertex itself is the first. False: out of memory.
  bool find(const Edges& edges, std::uint32_t vertex, std::uint32_t steps) {
    found_.clear();
    if (!reach(vertex, vertex)) return false;
    std::size_t next = 0;
    for (; steps > 0; --steps) {
      for (const std::size_t end = found_.size(); next < end; ++next) {
        for (const std::uint32_t to : edges.from(found_[next])) {
          if (!reach(to, vertex)) return false;
        }
      }
    }
    return true;
  }

  std::span<const std::uint32_t> found() const { return found_.view(); }

 private:
  bool reach(std::uint32_t vertex, std::uint32_t from) {
    if (reached_by_[vertex] == from) return true;
    reached_by_[vertex] = from;
    return found_.push(vertex);
  }

  Buffer<std::uint32_t> reached_by_;  // the vertex from which each was reached last
  Buffer<std::uint32_t> found_;
};

/// Adds the lists of one mesh. False: out of memory, or too many for 32 bits.
bool append_lists(std::span<const TriangleTopology> triangles, std::uint32_t vertices, std::uint32_t steps,
                  Buffer<std::uint32_t>& first, Buffer<std::uint32_t>& higher) {
  Edges edges;
  Surroundings near;
  if (!edges.find(triangles, vertices) || !near.prepare(vertices)) return false;
  const std::size_t before = higher.size();
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const std::size_t begin = higher.size();
    if (begin - before >= kNoIndex || !first.push(static_cast<std::uint32_t>(begin - before))) return false;
    if (!near.find(edges, v, steps)) return false;
    for (const std::uint32_t to : near.found()) {
      if (to > v && !higher.push(to)) return false;
    }
    std::sort(higher.data() + begin, higher.data() + higher.size());
  }
  const std::size_t all = higher.size() - before;
  return all < kNoIndex && first.push(static_cast<std::uint32_t>(all));
}

}  // namespace

void NeighbourLists::restart(std::uint32_t rings) {
  rings_ = rings;
  meshes_.clear();
  first_.clear();
  higher_.clear();
}

std::uint32_t NeighbourLists::find(const TriangleTopology* topology) const {
  for (std::uint32_t i = 0; i < meshes_.size(); ++i) {
    if (meshes_[i].topology == topology) return i;
  }
  return kNoIndex;
}

bool NeighbourLists::add(const LevelView& level, const TriangleTopology* readable) {
  const Mesh mesh = {level.topology, first_.size(), higher_.size()};
  const std::span<const TriangleTopology> triangles(readable, level.triangle_count);
  const bool done = rings_ == 1 || append_lists(triangles, level.vertex_count, rings_ - 1, first_, higher_);
  if (done && meshes_.push(mesh)) return true;
  (void)first_.resize(mesh.first);  // fewer than there are
  (void)higher_.resize(mesh.higher);
  return false;
}

Neighbourhood NeighbourLists::of(std::uint32_t mesh, const std::uint32_t* first,
                                 const std::uint32_t* higher) const {
  const Mesh& of = meshes_[mesh];
  if (rings_ == 1) return {of.topology, nullptr, nullptr};
  return {of.topology, first + of.first, higher + of.higher};
}

Status BodyNeighbours::add_asset(SceneState& scene, std::uint32_t asset) {
  const LevelView& level = scene.assets[asset].tree;
  of_asset_[asset] = lists_.find(level.topology);
  if (of_asset_[asset] == kNoIndex && lists_.add(level, level.topology))
    of_asset_[asset] = lists_.find(level.topology);
  return of_asset_[asset] != kNoIndex ? Status::kOk : scene.fail(Status::kOutOfMemory, asset);
}

Status BodyNeighbours::provide(SceneState& scene, std::span<const ObjectPair> pairs, std::uint32_t rings) {
  if (assets_id_ != scene.assets_id || lists_.rings() != rings) {
    assets_id_ = 0;
    lists_.restart(rings);
    if (!of_asset_.resize(scene.assets.size())) return scene.fail(Status::kOutOfMemory, 0);
    std::fill_n(of_asset_.data(), of_asset_.size(), kNoIndex);
    assets_id_ = scene.assets_id;
  }
  if (!of_body_.resize(scene.bodies.size())) return scene.fail(Status::kOutOfMemory, 0);
  for (const ObjectPair& pair : pairs) {
    if (pair.a != pair.b) continue;
    const std::uint32_t asset = scene.instances[pair.a].asset;
    if (of_asset_[asset] != kNoIndex) continue;
    if (const Status status = add_asset(scene, asset); status != Status::kOk) return status;
  }
  for (const ObjectPair& pair : pairs) {
    if (pair.a == pair.b) of_body_[pair.a] = lists_.of(of_asset_[scene.instances[pair.a].asset]);
  }
  return Status::kOk;
}

}  // namespace tandem
