#include <algorithm>
#include <bit>
#include <cstdint>
#include <memory>
#include <type_traits>

#include "check_level.h"
#include "tandem/formats/allocator.h"
#include "tandem/formats/enclosed_volume.h"

namespace tandem {
namespace {

struct Deallocate {
  void operator()(void* memory) const { deallocate(memory); }
};

template <typename Element>
using Array = std::unique_ptr<Element[], Deallocate>;

// Not initialised, or null where there is not enough memory.
template <typename Element>
Array<Element> uninitialised(std::size_t count) {
  static_assert(std::is_trivial_v<Element>);
  if (count > SIZE_MAX / sizeof(Element)) return nullptr;
  return Array<Element>(static_cast<Element*>(allocate(count * sizeof(Element))));
}

// Zeros, or null.
template <typename Element>
Array<Element> zeros(std::size_t count) {
  Array<Element> array = uninitialised<Element>(count);
  if (array != nullptr) std::fill_n(array.get(), count, Element{});
  return array;
}

bool same_position(const float* p, const float* q) {
  return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
}

std::uint64_t hash(std::uint32_t number, std::uint64_t seed) {
  seed = (seed ^ number) * 0x9e3779b97f4a7c15u;
  return seed ^ seed >> 32;
}

// Returns a number that is the same for the same positions; -0 counts as 0.
std::uint64_t hash(const float* position, std::uint64_t seed) {
  for (int k = 0; k < 3; ++k) seed = hash(std::bit_cast<std::uint32_t>(position[k] + 0.0f), seed);
  return seed;
}

// Trees of triangles that belong together, each triangle below a lower one or the lowest.
class Joined {
 public:
  bool make(std::uint32_t count) {
    below_ = zeros<std::uint32_t>(count);
    if (below_ == nullptr) return false;
    for (std::uint32_t t = 0; t < count; ++t) below_[t] = t;
    return true;
  }
  std::uint32_t lowest(std::uint32_t t) {
    while (below_[t] != t) t = below_[t] = below_[below_[t]];
    return t;
  }
  void join(std::uint32_t s, std::uint32_t t) {
    s = lowest(s), t = lowest(t);
    if (s < t) below_[t] = s;
    if (t < s) below_[s] = t;
  }

 private:
  Array<std::uint32_t> below_;
};

// Joins triangles too, and keeps for each whether it and the lowest one must change their windings, or
// neither.
class JoinedWindings {
 public:
  bool make(std::uint32_t count) {
    above_ = zeros<std::uint32_t>(count);
    differs_ = zeros<std::uint8_t>(count);
    if (above_ == nullptr || differs_ == nullptr) return false;
    for (std::uint32_t t = 0; t < count; ++t) above_[t] = t;
    return true;
  }
  struct Place {
    std::uint32_t lowest;
    std::uint8_t differs;
  };
  Place place(std::uint32_t t) {
    std::uint8_t differs = 0;
    while (above_[t] != t) {
      differs_[t] ^= differs_[above_[t]];  // 0 of the lowest
      above_[t] = above_[above_[t]];
      differs ^= differs_[t];
      t = above_[t];
    }
    return {t, differs};
  }
  /// Returns whether the relation contradicts those before.
  bool contradicts(std::uint32_t s, std::uint32_t t, std::uint8_t differ) {
    const Place a = place(s), b = place(t);
    const auto between = static_cast<std::uint8_t>(a.differs ^ b.differs ^ differ);
    if (a.lowest == b.lowest) return between != 0;
    above_[std::max(a.lowest, b.lowest)] = std::min(a.lowest, b.lowest);
    differs_[std::max(a.lowest, b.lowest)] = between;
    return false;
  }

 private:
  Array<std::uint32_t> above_;
  Array<std::uint8_t> differs_;
};

class TopologyCheck {
 public:
  explicit TopologyCheck(const LevelView& level) : level_(level) {}

  CheckResult run(CheckDepth depth, std::uint64_t source_vertices, std::uint64_t seed) {
    Status status = check_ranges();
    if (status == Status::kOk) status = check_sources(source_vertices);
    if (depth == CheckDepth::full) {
      if (status == Status::kOk) status = check_vertices();
      if (status == Status::kOk) status = check_different(seed);
      if (status == Status::kOk) status = check_edges();
      if (status == Status::kOk) status = check_components();
      if (status == Status::kOk && one_way_edges_) status = check_patches();
      if (status == Status::kOk) status = check_volume();
    }
    return {status, where_, {}};
  }

 private:
  // Checks what a reader needs in order not to leave its arrays.
  Status check_ranges() {
    for (where_ = 0; where_ < level_.triangle_count; ++where_) {
      const TriangleTopology& triangle = level_.topology[where_];
      for (const std::uint32_t vertex : triangle.vertex) {
        if (vertex >= level_.vertex_count) return Status::kBadTopology;
      }
      if ((triangle.flags & ~kTopologyFlags) != 0) return Status::kBadTopology;
    }
    std::uint32_t next = 0;
    for (where_ = 0; where_ < level_.component_count; ++where_) {
      const SurfaceComponent& component = level_.components[where_];
      if (component.first_triangle < next || component.first_triangle >= level_.triangle_count ||
          component.triangle_count > level_.triangle_count || component.flags > kClosedComponent ||
          component.reserved != 0)
        return Status::kBadTopology;
      next = component.first_triangle + 1;
    }
    return Status::kOk;
  }

  Status check_sources(std::uint64_t source_vertices) {
    if (level_.source_vertices == nullptr) return Status::kOk;
    for (where_ = 0; where_ < level_.vertex_count; ++where_) {
      if (level_.source_vertices[where_] >= source_vertices) return Status::kSourceVertexMismatch;
    }
    return Status::kOk;
  }

  const float* position(std::uint32_t side) const {
    return level_.triangles[side / 3].corner[side % 3].position;
  }

  // That vertices appear in order, and that all corners of one are where its first is.
  Status check_vertices() {
    first_ = zeros<std::uint32_t>(level_.vertex_count);
    if (first_ == nullptr) return Status::kOutOfMemory;
    std::uint32_t next = 0;
    for (std::uint32_t t = 0; t < level_.triangle_count; ++t) {
      where_ = t;
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t vertex = level_.topology[t].vertex[k];
        if (vertex > next) return Status::kVertexOrder;
        if (vertex == next) first_[next++] = 3 * t + k;
        if (!same_position(position(first_[vertex]), position(3 * t + k))) return Status::kVertexMismatch;
      }
    }
    return next == level_.vertex_count ? Status::kOk : Status::kVertexOrder;
  }

  // That no two vertices have the same source vertex, or, where there are none, the same position.
  Status check_different(std::uint64_t seed) {
    const std::uint32_t* source = level_.source_vertices;
    if (source == nullptr) {
      const auto at = [&](std::uint32_t v) { return position(first_[v]); };
      return check_different(
          Status::kVertexMismatch, [&](std::uint32_t v) { return hash(at(v), seed); },
          [&](std::uint32_t v, std::uint32_t w) { return same_position(at(v), at(w)); });
    }
    return check_different(
        Status::kSourceVertexMismatch, [&](std::uint32_t v) { return hash(source[v], seed); },
        [&](std::uint32_t v, std::uint32_t w) { return source[v] == source[w]; });
  }

  // Looks for each vertex in a table of those before it.
  template <typename Hash, typename Same>
  Status check_different(Status defect, const Hash& hash_of, const Same& same) {
    const std::size_t slots = std::bit_ceil(std::size_t{level_.vertex_count} + level_.vertex_count / 2);
    const Array<std::uint32_t> vertex_at = zeros<std::uint32_t>(slots);  // plus one
    if (vertex_at == nullptr) return Status::kOutOfMemory;
    for (std::uint32_t v = 0; v < level_.vertex_count; ++v) {
      std::size_t slot = hash_of(v) & (slots - 1);
      for (; vertex_at[slot] != 0; slot = (slot + 1) & (slots - 1)) {
        where_ = defect == Status::kVertexMismatch ? first_[v] / 3 : v;
        if (same(vertex_at[slot] - 1, v)) return defect;
      }
      vertex_at[slot] = v + 1;
    }
    first_.reset();
    return Status::kOk;
  }

  // A side of an edge, and its upper vertex. Those of one lower vertex lie together.
  struct Side {
    std::uint32_t upper, side;
    bool operator<(const Side& other) const {
      return upper != other.upper ? upper < other.upper : side < other.side;
    }
  };

  // Calls use(sides, count) with the sides of each edge. Goes on while that returns kOk.
  template <typename Use>
  Status for_each_edge(const Use& use) {
    const Side* begin = sides_.get();
    for (std::uint32_t v = 0; v < level_.vertex_count; ++v) {
      for (const Side *end = sides_.get() + end_[v], *last = begin; begin != end; begin = last) {
        while (last != end && last->upper == begin->upper) ++last;
        const Status status = use(begin, static_cast<std::uint32_t>(last - begin));
        if (status != Status::kOk) return status;
      }
    }
    return Status::kOk;
  }

  // Checks that a side that belongs to no edge has no bit: for_each_edge() does not come by it.
  Status check_sides_without_edge() {
    for (std::uint32_t t = 0; t < level_.triangle_count; ++t) {
      const TriangleTopology& triangle = level_.topology[t];
      where_ = t;
      for (int k = 0; k < 3; ++k) {
        if (triangle.vertex[k] != triangle.vertex[(k + 1) % 3]) continue;
        if (is_boundary(triangle.flags, k) || has_many_triangles(triangle.flags, k))
          return Status::kEdgeMismatch;
      }
    }
    return Status::kOk;
  }

  // Calls use(lower vertex, upper vertex, side) with all sides of edges.
  template <typename Use>
  void for_each_side(const Use& use) const {
    for (std::uint32_t t = 0; t < level_.triangle_count; ++t) {
      const std::uint32_t* v = level_.topology[t].vertex;
      for (std::uint32_t k = 0, l = 1; k < 3; ++k, l = l < 2 ? l + 1 : 0) {
        if (v[k] != v[l]) use(std::min(v[k], v[l]), std::max(v[k], v[l]), 3 * t + k);
      }
    }
  }

  // Returns whether a side runs from its lower to its upper vertex once its triangle is turned as it should.
  bool runs_up(std::uint32_t side) const {
    const TriangleTopology& triangle = level_.topology[side / 3];
    return (triangle.vertex[side % 3] < triangle.vertex[(side + 1) % 3]) != is_turned(triangle.flags);
  }

  // Most vertices have few sides.
  static void sort(Side* begin, Side* end) {
    if (end - begin > 24) return std::sort(begin, end);
    for (Side* next = begin; next != end; ++next) {
      const Side side = *next;
      Side* place = next;
      for (; place != begin && side < place[-1]; --place) *place = place[-1];
      *place = side;
    }
  }

  // Puts the sides of edges in the order of their lower and upper vertices: one counting sort, and a small
  // one for each lower vertex.
  Status sort_sides() {
    end_ = zeros<std::uint32_t>(std::size_t{level_.vertex_count} + 1);
    if (end_ == nullptr) return Status::kOutOfMemory;
    for_each_side([&](std::uint32_t lower, std::uint32_t, std::uint32_t) { ++end_[lower + 1]; });
    for (std::uint32_t v = 0; v < level_.vertex_count; ++v) end_[v + 1] += end_[v];
    sides_ = uninitialised<Side>(end_[level_.vertex_count]);
    if (sides_ == nullptr) return Status::kOutOfMemory;
    for_each_side([&](std::uint32_t lower, std::uint32_t upper, std::uint32_t side) {
      sides_[end_[lower]++] = {upper, side};
    });
    std::uint32_t begin = 0;
    for (std::uint32_t v = 0; v < level_.vertex_count; begin = end_[v++])
      sort(sides_.get() + begin, sides_.get() + end_[v]);
    return Status::kOk;
  }

  Status check_edges() {
    open_ = zeros<std::uint8_t>(level_.triangle_count);
    if (open_ == nullptr || !joined_.make(level_.triangle_count)) return Status::kOutOfMemory;
    if (const Status status = check_sides_without_edge(); status != Status::kOk) return status;
    if (const Status status = sort_sides(); status != Status::kOk) return status;
    return for_each_edge([&](const Side* sides, std::uint32_t count) {
      std::uint32_t up = 0;
      const std::uint32_t first = sides[0].side / 3;
      for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t side = sides[i].side, t = side / 3, flags = level_.topology[t].flags;
        const auto k = static_cast<int>(side - 3 * t);
        where_ = t;
        if (is_boundary(flags, k) != (count == 1) || has_many_triangles(flags, k) != (count > 2))
          return Status::kEdgeMismatch;
        up += runs_up(side);
        if (i > 0) joined_.join(first, t);
      }
      const bool balanced = 2 * std::uint64_t{up} == count;
      if (!balanced) open_[first] = 1;
      one_way_edges_ = one_way_edges_ || (count == 2 && !balanced);
      return Status::kOk;
    });
  }

  struct Tally {
    std::uint32_t triangles, turned, open;
  };

  // That the components are those that edges make, that they are closed where said to be, and that of an open
  // one no more than half the triangles are turned; of one half, not the first.
  Status check_components() {
    const Array<Tally> tally = zeros<Tally>(level_.component_count);
    const Array<std::uint32_t> number = zeros<std::uint32_t>(level_.triangle_count);
    if (tally == nullptr || number == nullptr) return Status::kOutOfMemory;
    std::uint32_t next = 0;
    for (std::uint32_t t = 0; t < level_.triangle_count; ++t) {
      const std::uint32_t lowest = joined_.lowest(t);
      where_ = next;
      if (lowest == t) {
        if (next == level_.component_count || level_.components[next].first_triangle != t)
          return Status::kComponentMismatch;
        number[t] = next++;
      }
      Tally& of = tally[number[lowest]];
      ++of.triangles;
      of.turned += is_turned(level_.topology[t].flags);
      of.open += open_[t];
    }
    where_ = next;
    if (next != level_.component_count) return Status::kComponentMismatch;
    std::uint32_t closed = 0;
    for (std::uint32_t c = 0; c < level_.component_count; ++c) {
      const SurfaceComponent& component = level_.components[c];
      where_ = c;
      if (component.triangle_count != tally[c].triangles || is_closed(component) != (tally[c].open == 0))
        return Status::kComponentMismatch;
      closed += is_closed(component);
      if (is_closed(component)) only_closed_ = component.first_triangle;
      where_ = component.first_triangle;
      const std::uint64_t turned = 2 * std::uint64_t{tally[c].turned};
      const bool most = turned > tally[c].triangles ||
                        (turned == tally[c].triangles && is_turned(level_.topology[where_].flags));
      if (most && !is_closed(component)) return Status::kBadWinding;
    }
    has_one_closed_ = closed == 1;
    where_ = level_.component_count;
    return level_.closed == (closed == level_.component_count) ? Status::kOk : Status::kComponentMismatch;
  }

  // That windings disagree across an edge of two sides only where no choice of windings makes them agree: in
  // a patch, which edges of two sides join, that cannot be oriented.
  Status check_patches() {
    JoinedWindings windings;
    const Array<std::uint8_t> unorientable = zeros<std::uint8_t>(level_.triangle_count);
    if (unorientable == nullptr || !windings.make(level_.triangle_count)) return Status::kOutOfMemory;
    const auto for_each_pair = [&](const auto& use) {
      return for_each_edge([&](const Side* sides, std::uint32_t count) {
        if (count != 2) return Status::kOk;
        const std::uint32_t one = sides[0].side, other = sides[1].side;
        return use(one / 3, other / 3, runs_up(one) == runs_up(other));
      });
    };
    // What contradicts is marked at a triangle, since the lowest of its patch is not known before the end.
    Status status = for_each_pair([&](std::uint32_t s, std::uint32_t t, bool disagree) {
      unorientable[s] = unorientable[s] | windings.contradicts(s, t, disagree);
      return Status::kOk;
    });
    for (std::uint32_t t = 0; t < level_.triangle_count; ++t) {
      if (unorientable[t] != 0) unorientable[windings.place(t).lowest] = 1;
    }
    if (status == Status::kOk) {
      status = for_each_pair([&](std::uint32_t s, std::uint32_t, bool disagree) {
        where_ = s;
        return disagree && unorientable[windings.place(s).lowest] == 0 ? Status::kBadWinding : Status::kOk;
      });
    }
    return status;
  }

  // That the only closed component, which can be no cavity, is not inside out.
  Status check_volume() {
    if (!has_one_closed_) return Status::kOk;
    where_ = only_closed_;
    EnclosedVolume volume(position(3 * only_closed_));
    for (std::uint32_t t = only_closed_; t < level_.triangle_count; ++t) {
      if (joined_.lowest(t) != only_closed_) continue;
      const std::uint32_t turned = is_turned(level_.topology[t].flags);
      volume.add(position(3 * t), position(3 * t + 1 + turned), position(3 * t + 2 - turned));
    }
    return volume.is_inside_out() ? Status::kBadWinding : Status::kOk;
  }

  LevelView level_;
  Array<std::uint32_t> first_;  // side that begins at the first corner of each vertex
  Array<Side> sides_;           // that have an edge, by lower vertex
  Array<std::uint32_t> end_;    // of the sides of each lower vertex
  Joined joined_;
  Array<std::uint8_t> open_;    // of a triangle: not 0 where an edge of it is not closed
  bool one_way_edges_ = false;  // there are edges of two sides that run the same way
  bool has_one_closed_ = false;
  std::uint32_t only_closed_ = 0;  // its first triangle
  std::uint32_t where_ = 0;        // the triangle or component that a defect speaks of
};

}  // namespace

CheckResult check_topology(const LevelView& level, CheckDepth depth, std::uint64_t source_vertices,
                           std::uint64_t seed) {
  return TopologyCheck(level).run(depth, source_vertices, seed);
}

}  // namespace tandem
