// makeassets: writes the project's own meshes. The same arguments give the same bytes.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "shapes.h"

namespace {

using namespace tandem::makeassets;

enum ExitCode { kDone = 0, kUsage = 1, kNotWritten = 4, kInternal = 5 };

constexpr const char* kCowComment =
    "Tandem's cow, MIT licence. Units: metres. Axes: x forward, y left, z up.";
constexpr const char* kBoxComment = "Unit cube centred at the origin, MIT licence. Units: metres.";
constexpr const char* kRockComment = "A rough rock, MIT licence. Units: metres.";
constexpr const char* kTerrainComment = "Uneven ground, MIT licence. Units: metres. Axes: z up.";

// A multiple of 4e-6: the midpoints of two subdivisions are then multiples of 1e-6, which six decimals hold
// exactly, so that all three cows are one and the same surface.
constexpr double kCowGridPerMetre = 250'000;

int report(const std::filesystem::path& path, const std::string& reason, ExitCode code) {
  std::fprintf(stderr, "makeassets: %s: %s\n", path.c_str(), reason.c_str());
  return code;
}

int write(const Mesh& mesh, const char* comment, const std::filesystem::path& path) {
  if (const std::string reason = write_mesh(mesh, comment, path); !reason.empty())
    return report(path, reason, kNotWritten);
  std::printf("%s: %zu vertices, %zu triangles\n", path.c_str(), mesh.points.size(), mesh.triangles.size());
  return kDone;
}

// Writes `mesh` and its two subdivisions under the three names, each only after it has passed the check.
int write_levels(Mesh mesh, std::size_t triangles, const char* comment, const std::filesystem::path& folder,
                 const std::array<const char*, 3>& names) {
  for (const char* name : names) {
    if (const std::string defect = closed_mesh_defect(mesh, triangles); !defect.empty())
      return report(folder / name, "not written: " + defect, kInternal);
    if (const int code = write(mesh, comment, folder / name); code != kDone) return code;
    mesh = midpoint_subdivision(mesh);
    triangles *= 4;
  }
  return kDone;
}

int write_all(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return report(folder, error.message(), kNotWritten);

  Mesh cow = cow_mesh(1500);
  snap_to_grid(cow, kCowGridPerMetre);
  int code =
      write_levels(std::move(cow), 1500, kCowComment, folder, {"cow_1500.obj", "cow.obj", "cow_24000.obj"});
  if (code != kDone) return code;
  code = write_levels(unit_cube(), 12, kBoxComment, folder, {"box_12.obj", "box_48.obj", "box_192.obj"});
  if (code != kDone) return code;
  return write(terrain({100, 100}, 60, 1), kTerrainComment, folder / "ground.obj");
}

// Whatever its shape, a sheet of so many triangles has fewer than 2^32 vertices: (x + 1) * (y + 1) <=
// triangles + 2.
constexpr std::uint64_t kMaxTriangles = 2'000'000'000;

struct TerrainOptions {
  std::uint64_t triangles = 20'000;
  double side = 60;
  std::uint32_t seed = 1;
  std::filesystem::path path;
};

int write_terrain(const TerrainOptions& options) {
  if (options.triangles % 2 != 0)
    throw CLI::ValidationError("--triangles", "must be even: a cell has two triangles");
  return write(terrain(cells_for(options.triangles), options.side, options.seed), kTerrainComment,
               options.path);
}

struct RockOptions {
  std::uint64_t triangles = 80'000;
  std::uint32_t seed = 1;
  std::filesystem::path path;
};

int write_rock(const RockOptions& options) {
  const std::uint32_t side = rock_side_for(options.triangles);
  if (std::uint64_t{8} * side * side != options.triangles)
    throw CLI::ValidationError("--triangles", "must be 8 times a square, as 80000 is");
  const Mesh mesh = rock(side, options.seed);
  if (const std::string defect = closed_mesh_defect(mesh, options.triangles); !defect.empty())
    return report(options.path, "not written: " + defect, kInternal);
  return write(mesh, kRockComment, options.path);
}

std::string ending_defect(const std::string& path) {
  const std::filesystem::path ending = std::filesystem::path(path).extension();
  return ending == ".obj" || ending == ".ply" ? "" : "must end in .obj or .ply";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Writes the meshes of the project's tests and benchmarks.", "makeassets");
  app.require_subcommand(1);

  std::filesystem::path folder;
  CLI::App* all = app.add_subcommand("all", "Write every mesh of the folder assets/");
  all->add_option("-o,--output", folder, "Folder; made when it is not there")->required();

  TerrainOptions options;
  CLI::App* sheet = app.add_subcommand("terrain", "Write one sheet of uneven ground");
  sheet->add_option("--triangles", options.triangles, "Twice a number of cells")
      ->check(CLI::Range(std::uint64_t{2}, kMaxTriangles))
      ->capture_default_str();
  sheet->add_option("--size", options.side, "Side in metres")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  sheet->add_option("--seed", options.seed, "Number of the landscape")->capture_default_str();
  sheet->add_option("-o,--output", options.path, "File: .obj, or .ply for binary PLY")
      ->check(ending_defect)
      ->required();

  RockOptions rough;
  CLI::App* stone = app.add_subcommand("rock", "Write one rough rock, as a scanner would see it");
  stone->add_option("--triangles", rough.triangles, "8 times a square")
      ->check(CLI::Range(std::uint64_t{8}, kMaxTriangles))
      ->capture_default_str();
  stone->add_option("--seed", rough.seed, "Number of the rock")->capture_default_str();
  stone->add_option("-o,--output", rough.path, "File: .obj, or .ply for binary PLY")
      ->check(ending_defect)
      ->required();

  try {
    app.parse(argc, argv);
    if (*all) return write_all(folder);
    return *stone ? write_rock(rough) : write_terrain(options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "makeassets: %s\n", error.what());
    return kInternal;
  }
}
