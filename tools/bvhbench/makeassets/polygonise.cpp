#include "polygonise.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "vector3.h"

namespace tandem::makeassets {
namespace {

using Corner = std::array<std::uint32_t, 3>;
using Tetrahedron = std::array<Corner, 4>;

// Freudenthal's division: one tetrahedron for each order in which a walk from corner 000 to corner 111 can
// take the three axes. The division is the same on both sides of every face, hence no cracks and a manifold.
constexpr std::array<std::array<int, 3>, 6> kAxisOrders = {
    {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};

class Marcher {
 public:
  Marcher(const std::function<double(const Point&)>& distance, const Bounds& bounds, double cell)
      : lower_(bounds.lower), cell_(cell) {
    for (int k = 0; k < 3; ++k)
      size_[k] = static_cast<std::uint32_t>(std::ceil((bounds.upper[k] - bounds.lower[k]) / cell)) + 1;
    value_.resize(std::size_t{size_[0]} * size_[1] * size_[2]);
    for_each_corner(size_, [&](const Corner& c) { value_[index(c)] = distance(position(c)); });
  }

  Mesh march() {
    for_each_corner({size_[0] - 1, size_[1] - 1, size_[2] - 1}, [&](const Corner& c) {
      if (is_crossed(c)) march_cube(c);
    });
    return std::move(mesh_);
  }

 private:
  template <class Visit>
  static void for_each_corner(const Corner& end, Visit visit) {
    for (std::uint32_t z = 0; z < end[2]; ++z)
      for (std::uint32_t y = 0; y < end[1]; ++y)
        for (std::uint32_t x = 0; x < end[0]; ++x) visit(Corner{x, y, z});
  }

  std::size_t index(const Corner& c) const { return (std::size_t{c[2]} * size_[1] + c[1]) * size_[0] + c[0]; }
  double value(const Corner& c) const { return value_[index(c)]; }
  Point position(const Corner& c) const {
    return {lower_[0] + cell_ * c[0], lower_[1] + cell_ * c[1], lower_[2] + cell_ * c[2]};
  }

  bool is_crossed(const Corner& c) const {
    const bool inside = value(c) < 0;
    for (std::uint32_t i = 1; i < 8; ++i)
      if ((value({c[0] + (i & 1), c[1] + (i >> 1 & 1), c[2] + (i >> 2)}) < 0) != inside) return true;
    return false;
  }

  void march_cube(const Corner& first) {
    for (const auto& order : kAxisOrders) {
      Tetrahedron tetrahedron{first, first, first, first};
      for (int step = 1; step <= 3; ++step) {
        tetrahedron[step] = tetrahedron[step - 1];
        ++tetrahedron[step][order[step - 1]];
      }
      march_tetrahedron(tetrahedron);
    }
  }

  void march_tetrahedron(Tetrahedron& t) {
    const auto outside =
        std::stable_partition(t.begin(), t.end(), [&](const Corner& c) { return value(c) < 0; });
    const Point outwards = position(t[3]) - position(t[0]);
    switch (outside - t.begin()) {
      case 1:
        emit(crossing(t[0], t[1]), crossing(t[0], t[2]), crossing(t[0], t[3]), outwards);
        break;
      case 2: {
        const auto v02 = crossing(t[0], t[2]), v13 = crossing(t[1], t[3]);
        emit(v02, crossing(t[0], t[3]), v13, outwards);
        emit(v02, v13, crossing(t[1], t[2]), outwards);
        break;
      }
      case 3:
        emit(crossing(t[0], t[3]), crossing(t[1], t[3]), crossing(t[2], t[3]), outwards);
        break;
    }
  }

  std::uint32_t crossing(const Corner& inside, const Corner& outside) {
    const Corner& from = std::min(inside, outside);
    const Corner& to = std::max(inside, outside);
    const std::uint64_t direction = (to[0] != from[0]) | (to[1] != from[1]) << 1 | (to[2] != from[2]) << 2;
    const auto next = static_cast<std::uint32_t>(mesh_.points.size());
    const auto [entry, is_new] = vertex_.try_emplace(index(from) * 8 + direction, next);
    if (is_new) {
      // Kept away from the corners, where neighbouring crossings would coincide and make flat triangles.
      const double at = std::clamp(value(from) / (value(from) - value(to)), 0.05, 0.95);
      mesh_.points.push_back(position(from) + at * (position(to) - position(from)));
    }
    return entry->second;
  }

  // Any edge from an inside to an outside corner crosses the plane of the triangle outwards.
  void emit(std::uint32_t a, std::uint32_t b, std::uint32_t c, const Point& outwards) {
    const auto& p = mesh_.points;
    if (dot(cross(p[b] - p[a], p[c] - p[a]), outwards) < 0) std::swap(b, c);
    mesh_.triangles.push_back({a, b, c});
  }

  Point lower_;
  double cell_;
  Corner size_{};
  std::vector<double> value_;
  std::unordered_map<std::uint64_t, std::uint32_t> vertex_;
  Mesh mesh_;
};

}  // namespace

Mesh polygonise(const std::function<double(const Point&)>& distance, const Bounds& bounds, double cell) {
  return Marcher(distance, bounds, cell).march();
}

}  // namespace tandem::makeassets
