#include "terrain.h"

#include <cmath>

#include "noise.h"

namespace tandem::makeassets {
namespace {

// A height in [-1, 1] at a lattice point.
double lattice_height(std::int64_t x, std::int64_t y, std::uint64_t seed) {
  return hashed(seed * 0x9E3779B97F4A7C15u + static_cast<std::uint64_t>(x) * 0xC2B2AE3D27D4EB4Fu +
                static_cast<std::uint64_t>(y) * 0x165667B19E3779F9u);
}

double value_noise(double x, double y, std::uint64_t seed) {
  const double floor_x = std::floor(x), floor_y = std::floor(y);
  const auto i = static_cast<std::int64_t>(floor_x), j = static_cast<std::int64_t>(floor_y);
  const double u = fade(x - floor_x), v = fade(y - floor_y);
  const auto row = [&](std::int64_t at) {
    return (1 - u) * lattice_height(i, at, seed) + u * lattice_height(i + 1, at, seed);
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
