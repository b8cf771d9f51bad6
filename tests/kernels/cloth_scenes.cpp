#include "kernels/cloth_scenes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace tandem::test {
namespace {

constexpr std::uint32_t kNotJoined = 1u << 30;

/// A grid of points and two triangles in each of its squares.
template <typename PointAt>
Mesh grid(std::uint32_t columns, std::uint32_t rows, const PointAt& point_at) {
  Mesh mesh;
  for (std::uint32_t r = 0; r < rows; ++r) {
    for (std::uint32_t c = 0; c < columns; ++c) {
      const auto a = point_at(c, r), b = point_at(c + 1, r), d = point_at(c, r + 1),
                 e = point_at(c + 1, r + 1);
      mesh.add(a, b, e);
      mesh.add(a, e, d);
    }
  }
  return mesh;
}

void append(Mesh& mesh, const Mesh& more, std::array<float, 3> moved) {
  for (const auto& triangle : more.triangles) {
    std::array<float, 3> corner[3];
    for (std::size_t i = 0; i < 3; ++i) {
      corner[i] = more.points[triangle[i]];
      for (std::size_t k = 0; k < 3; ++k) corner[i][k] += moved[k];
    }
    mesh.add(corner[0], corner[1], corner[2]);
  }
}

/// A sheet that is pushed through itself.
Mesh crossing_sheet() {
  return grid(12, 5, [](std::uint32_t c, std::uint32_t r) {
    const float angle = 0.55f * static_cast<float>(c);
    const float radius = 1 + (c % 2 == 0 ? 0.3f : 0.0f);
    return std::array<float, 3>{radius * std::cos(angle), radius * std::sin(angle),
                                0.5f * static_cast<float>(r)};
  });
}

/// Triangles about one vertex, of which some turn back over others.
Mesh fan(std::uint32_t count, float turns) {
  Mesh mesh;
  const auto rim = [&](std::uint32_t i) {
    const float angle =
        turns * 2 * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(count);
    return std::array<float, 3>{std::cos(angle), std::sin(angle), 0};
  };
  for (std::uint32_t i = 0; i < count; ++i) mesh.add({0, 0, 0}, rim(i), rim(i + 1));
  return mesh;
}

/// Three and more sheets that share one row of edges.
Mesh book(std::uint32_t pages) {
  Mesh mesh;
  for (std::uint32_t page = 0; page < pages; ++page) {
    const float angle = 0.4f * static_cast<float>(page);
    append(mesh,
           grid(3, 4,
                [&](std::uint32_t c, std::uint32_t r) {
                  const auto out = static_cast<float>(c);
                  return std::array<float, 3>{out * std::cos(angle), out * std::sin(angle),
                                              static_cast<float>(r)};
                }),
           {0, 0, 0});
  }
  return mesh;
}

/// Two cubes: the corner of one lies in the middle of a face of the other, where that has no vertex.
Mesh touching_cubes() {
  Mesh mesh = cube(1, 3);
  append(mesh, cube(0.5f, 2), {1.5f, 0.17f, 0.11f});
  return mesh;
}

/// A sheet with segments and points for triangles.
Mesh sheet_with_flat_triangles() {
  Mesh mesh = folded_sheet(6, 3, 1, 0);
  for (std::uint32_t i = 0; i < 8; ++i) {
    const auto triangle = mesh.triangles[3 * i];
    const auto a = mesh.points[triangle[0]], b = mesh.points[triangle[1]];
    mesh.add(a, b, i % 3 == 0 ? a : b);
    if (i % 4 == 0) mesh.add(a, a, a);
  }
  return mesh;
}

}  // namespace

Mesh folded_sheet(std::uint32_t columns, std::uint32_t rows, std::uint32_t folds, float gap) {
  const std::uint32_t width = columns / (folds + 1);  // of a layer
  return grid(columns, rows, [&](std::uint32_t c, std::uint32_t r) {
    const std::uint32_t layer = width == 0 ? 0 : std::min(c / width, folds), along = c - layer * width;
    const bool back = layer % 2 == 1;
    const auto x = static_cast<float>(back ? width - along : along);
    // Layers that turn back lie a little askew, so that few of their edges run along each other.
    const float askew = back ? 0.125f * static_cast<float>(along) : 0.0f;
    return std::array<float, 3>{x, static_cast<float>(r) + askew, gap * static_cast<float>(layer)};
  });
}

std::vector<Surface> surfaces_that_meet_themselves() {
  RandomPoses random(34);
  std::vector<Surface> out;
  out.push_back({"flat_sheet", folded_sheet(9, 6, 0, 0)});
  out.push_back({"folded_flat", folded_sheet(18, 4, 2, 0)});
  out.push_back({"folds", folded_sheet(20, 4, 3, 0.25f)});
  out.push_back({"crossing_sheet", crossing_sheet()});
  out.push_back({"cube", cube(1, 4)});
  out.push_back({"touching_cubes", touching_cubes()});
  out.push_back({"book", book(5)});
  out.push_back({"fan", fan(24, 1)});
  out.push_back({"fan_that_overlaps", fan(24, 1.9f)});
  out.push_back({"flat_triangles", sheet_with_flat_triangles()});
  out.push_back({"soup", soup(random, 120, 0.5)});
  out.push_back({"grid_soup", grid_soup(random, 60, 2)});
  Mesh one;
  one.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  out.push_back({"one_triangle", one});
  return out;
}

NeighbourReference::NeighbourReference(const Mesh& mesh) {
  std::map<std::array<float, 3>, std::uint32_t> number;
  for (const auto& triangle : mesh.triangles) {
    auto& own = vertices_.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      std::array<float, 3> position = mesh.points[triangle[i]];
      for (float& x : position) x += 0.0f;  // -0 is 0
      own[i] = number.try_emplace(position, static_cast<std::uint32_t>(number.size())).first->second;
    }
  }
  std::vector<std::vector<std::uint32_t>> joined(number.size());
  for (const auto& triangle : vertices_) {
    for (const std::uint32_t u : triangle) {
      for (const std::uint32_t v : triangle) joined[u].push_back(v);
    }
  }
  for (std::uint32_t from = 0; from < number.size(); ++from) {
    std::vector<std::uint32_t> edges(number.size(), kNotJoined), queue = {from};
    edges[from] = 0;
    for (std::size_t i = 0; i < queue.size(); ++i) {
      for (const std::uint32_t to : joined[queue[i]]) {
        if (edges[to] != kNotJoined) continue;
        edges[to] = edges[queue[i]] + 1;
        queue.push_back(to);
      }
    }
    edges_.push_back(edges);
  }
}

std::uint32_t NeighbourReference::rings_between(std::uint32_t x, std::uint32_t y) const {
  std::uint32_t least = kNotJoined;
  for (const std::uint32_t u : vertices_[x]) {
    for (const std::uint32_t v : vertices_[y]) least = std::min(least, edges_[u][v]);
  }
  return least + 1;
}

FaceContacts without_neighbours(const FaceContacts& contacts, const NeighbourReference& reference,
                                std::uint32_t rings) {
  FaceContacts out;
  for (const FaceContact& contact : contacts) {
    if (contact.a != contact.b || reference.rings_between(contact.face_a, contact.face_b) > rings)
      out.push_back(contact);
  }
  return out;
}

}  // namespace tandem::test
