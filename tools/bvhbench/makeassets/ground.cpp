#include <cmath>
#include <map>

#include "shapes.h"

// Rocks and uneven ground, both made of noise.
namespace tandem::makeassets {
namespace {

// A number in [-1, 1], the same on every machine, that depends on every bit of `key`.
double hashed(std::uint64_t key) {
  std::uint64_t h = key;
  h = (h ^ h >> 30) * 0xBF58476D1CE4E5B9u;  // finaliser of SplitMix64
  h = (h ^ h >> 27) * 0x94D049BB133111EBu;
  h ^= h >> 31;
  return static_cast<double>(h >> 11) / static_cast<double>(1ull << 52) - 1;
}

// Perlin's quintic: first and second derivatives vanish at 0 and 1, so that cells join without a crease.
double fade(double t) {
  return t * t * t * (t * (t * 6 - 15) + 10);
}

using Cell = std::array<std::int64_t, 3>;

// Offsets of the seed, so that noises of different kinds have nothing in common.
constexpr std::uint64_t kScanner = 1000;

double lattice_value(const Cell& at, std::uint64_t seed) {
  return hashed(seed * 0x9E3779B97F4A7C15u + static_cast<std::uint64_t>(at[0]) * 0xC2B2AE3D27D4EB4Fu +
                static_cast<std::uint64_t>(at[1]) * 0x165667B19E3779F9u +
                static_cast<std::uint64_t>(at[2]) * 0xD6E8FEB86659FD93u);
}

// Values in [-1, 1] at the points of a unit lattice, joined smoothly.
double value_noise(const Point& p, std::uint64_t seed) {
  Cell first;
  Point weight;
  for (int k = 0; k < 3; ++k) {
    first[k] = static_cast<std::int64_t>(std::floor(p[k]));
    weight[k] = fade(p[k] - std::floor(p[k]));
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Cell at = first;
    double share = 1;
    for (int k = 0; k < 3; ++k) {
      const bool upper = (corner >> k & 1) != 0;
      at[k] += upper;
      share *= upper ? weight[k] : 1 - weight[k];
    }
    sum += share * lattice_value(at, seed);
  }
  return sum;
}

// Returns how far the surface lies from the centre in a direction, in radii: between 0.69 and 1.31.
double radius_along(const Point& direction, std::uint64_t seed) {
  constexpr int kOctaves = 6;
  double radius = 1, amplitude = 0.2, frequency = 1.5;
  for (int octave = 0; octave < kOctaves; ++octave) {
    radius += amplitude * value_noise(frequency * direction, seed * kOctaves + octave);
    amplitude *= 0.35;
    frequency *= 2;
  }
  return radius;
}

// The octahedron |x| + |y| + |z| = side, each of whose sides is a triangle of side^2 triangles.
class Octahedron {
 public:
  explicit Octahedron(std::uint32_t side) : side_(side) {
    for (int octant = 0; octant < 8; ++octant) add_side(octant);
  }

  std::vector<Cell> corners;
  std::vector<Triangle> triangles;

 private:
  void add_side(int octant) {
    for (std::int64_t i = 0; i < side_; ++i) {
      for (std::int64_t j = 0; i + j < side_; ++j) {
        add(octant, {i, j}, {i + 1, j}, {i, j + 1});
        if (i + j + 2 <= side_) add(octant, {i + 1, j}, {i + 1, j + 1}, {i, j + 1});
      }
    }
  }

  using Place = std::array<std::int64_t, 2>;

  void add(int octant, const Place& a, const Place& b, const Place& c) {
    // An odd number of mirrors turns a triangle around.
    const bool turned = ((octant & 1) + (octant >> 1 & 1) + (octant >> 2)) % 2 != 0;
    Triangle triangle = {corner(octant, a), corner(octant, b), corner(octant, c)};
    if (turned) std::swap(triangle[1], triangle[2]);
    triangles.push_back(triangle);
  }

  std::uint32_t corner(int octant, const Place& at) {
    Cell point = {at[0], at[1], side_ - at[0] - at[1]};
    for (int k = 0; k < 3; ++k) {
      if ((octant >> k & 1) != 0) point[k] = -point[k];
    }
    const auto [entry, is_new] = index_.try_emplace(point, static_cast<std::uint32_t>(corners.size()));
    if (is_new) corners.push_back(point);
    return entry->second;
  }

  std::int64_t side_;
  std::map<Cell, std::uint32_t> index_;
};

double value_noise(double x, double y, std::uint64_t seed) {
  const double floor_x = std::floor(x), floor_y = std::floor(y);
  const auto i = static_cast<std::int64_t>(floor_x), j = static_cast<std::int64_t>(floor_y);
  const double u = fade(x - floor_x), v = fade(y - floor_y);
  const auto row = [&](std::int64_t at) {
    return (1 - u) * lattice_value({i, at, 0}, seed) + u * lattice_value({i + 1, at, 0}, seed);
  };
  return (1 - v) * row(j) + v * row(j + 1);
}

// The amplitudes 0.6, 0.24, 0.096 ... add up to less than 1.
double ground_height(double x, double y, std::uint32_t seed) {
  constexpr int kOctaves = 5;
  double height = 0, amplitude = 0.6, wavelength = 15;
  for (int octave = 0; octave < kOctaves; ++octave) {
    height +=
        amplitude * value_noise(x / wavelength, y / wavelength, std::uint64_t{seed} * kOctaves + octave);
    amplitude *= 0.4;
    wavelength *= 0.5;
  }
  return height;
}

}  // namespace

std::uint32_t rock_side_for(std::uint64_t triangles) {
  return static_cast<std::uint32_t>(std::sqrt(static_cast<double>(triangles) / 8));
}

Mesh rock(std::uint32_t side, std::uint32_t seed) {
  constexpr Point kRadii = {0.5, 0.4, 0.32};  // metres
  constexpr double kScannerNoise = 3e-4;      // of the radius
  Octahedron octahedron(side);
  Mesh mesh;
  mesh.triangles = std::move(octahedron.triangles);
  for (std::size_t i = 0; i < octahedron.corners.size(); ++i) {
    const Cell& at = octahedron.corners[i];
    const Point from_centre = {static_cast<double>(at[0]), static_cast<double>(at[1]),
                               static_cast<double>(at[2])};
    const Point direction = 1 / length(from_centre) * from_centre;
    const double radius = radius_along(direction, seed) + kScannerNoise * lattice_value(at, seed + kScanner);
    mesh.points.push_back({radius * kRadii[0] * direction[0], radius * kRadii[1] * direction[1],
                           radius * kRadii[2] * direction[2]});
  }
  return mesh;
}

Cells cells_for(std::uint64_t triangles) {
  const std::uint64_t cells = triangles / 2;
  std::uint64_t y = 1;
  for (std::uint64_t divisor = 1; divisor * divisor <= cells; ++divisor)
    if (cells % divisor == 0) y = divisor;
  return {static_cast<std::uint32_t>(cells / y), static_cast<std::uint32_t>(y)};
}

Mesh terrain(Cells cells, double side, std::uint32_t seed) {
  Mesh sheet;
  sheet.points.reserve((std::size_t{cells.x} + 1) * (std::size_t{cells.y} + 1));
  sheet.triangles.reserve(std::size_t{cells.x} * cells.y * 2);
  for (std::uint32_t j = 0; j <= cells.y; ++j) {
    for (std::uint32_t i = 0; i <= cells.x; ++i) {
      const double x = side * i / cells.x - side / 2, y = side * j / cells.y - side / 2;
      sheet.points.push_back({x, y, ground_height(x, y, seed)});
    }
  }
  for (std::uint32_t j = 0; j < cells.y; ++j) {
    for (std::uint32_t i = 0; i < cells.x; ++i) {
      const std::uint32_t a = j * (cells.x + 1) + i, b = a + 1, d = a + cells.x + 1, c = d + 1;
      // The diagonal alternates: one direction throughout would lend the sheet a grain.
      if ((i + j) % 2 == 0)
        sheet.triangles.insert(sheet.triangles.end(), {{a, b, c}, {a, c, d}});
      else
        sheet.triangles.insert(sheet.triangles.end(), {{a, b, d}, {b, c, d}});
    }
  }
  return sheet;
}

}  // namespace tandem::makeassets
