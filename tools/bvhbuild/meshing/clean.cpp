#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "exact_predicates.h"
#include "index_table.h"
#include "meshing.h"
#include "parallel/parallel.h"
#include "tandem/formats/box.h"

namespace tandem::build {
namespace {

bool drop(std::uint64_t& count) {
  ++count;
  return false;
}

/// Returns the same place with one spelling of zero, so that equal places are equal bit by bit.
Point normalised(const Point& p) {
  return {p[0] + 0.0, p[1] + 0.0, p[2] + 0.0};
}

std::uint64_t hash_place(const Point& p) {
  return hash_words(std::bit_cast<std::uint64_t>(p[0]), std::bit_cast<std::uint64_t>(p[1]),
                    std::bit_cast<std::uint64_t>(p[2]));
}

/// Returns for each point 0 when a triangle uses it, else kNoVertex.
std::vector<std::uint32_t> mark_used(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> mark(mesh.points.size(), kNoVertex);
  for (const TriangleIndices& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) mark[corner] = 0;
  return mark;
}

void rename_corners(TriangleMesh& mesh, const std::vector<std::uint32_t>& new_index) {
  for (TriangleIndices& triangle : mesh.triangles)
    for (std::uint32_t& corner : triangle) corner = new_index[corner];
}

/// Returns the vertex of the file that a point is.
std::uint32_t source_of(const TriangleMesh& mesh, std::size_t point) {
  return mesh.source_vertex.empty() ? static_cast<std::uint32_t>(point) : mesh.source_vertex[point];
}

/// Returns whether two points lie at the same place in all poses.
bool stay_together(const TriangleMesh& mesh, std::size_t a, std::size_t b) {
  return std::all_of(mesh.poses.begin(), mesh.poses.end(),
                     [&](const std::vector<Point>& pose) { return pose[a] == pose[b]; });
}

/// Points move to the front as they are found to be new, which never overtakes the reading: a new index is at
/// most the old.
void weld(TriangleMesh& mesh, CleanReport& report) {
  std::vector<std::uint32_t> new_index = mark_used(mesh);
  IndexTable table(mesh.points.size());
  std::uint32_t kept = 0;
  std::uint64_t used = 0;
  std::vector<std::uint32_t> source_vertex;
  const auto hash = [&](std::size_t i) {
    std::uint64_t hash_i = hash_place(normalised(mesh.points[i]));
    for (const auto& pose : mesh.poses) hash_i = hash_words(hash_i, hash_place(normalised(pose[i])), 0);
    return hash_i;
  };
  for_each_prefetched(mesh.points.size(), table, hash, [&](std::uint32_t i, std::uint64_t hash_i) {
    if (new_index[i] == kNoVertex) return;
    ++used;
    const Point place = normalised(mesh.points[i]);
    new_index[i] = table.find_or_insert(
        hash_i, kept, [&](std::uint32_t k) { return mesh.points[k] == place && stay_together(mesh, k, i); });
    if (new_index[i] != kept) return;
    for (auto& pose : mesh.poses) pose[kept] = pose[i];
    mesh.points[kept++] = place;
    source_vertex.push_back(source_of(mesh, i));
  });
  mesh.points.resize(kept);
  mesh.points.shrink_to_fit();
  for (auto& pose : mesh.poses) pose.resize(kept);
  mesh.source_vertex = std::move(source_vertex);
  rename_corners(mesh, new_index);
  report.vertices_welded += used - kept;
}

bool degenerate(const TriangleMesh& mesh, const TriangleIndices& t) {
  if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return true;
  const auto flat_in = [&](const std::vector<Point>& p) { return collinear(p[t[0]], p[t[1]], p[t[2]]); };
  return flat_in(mesh.points) && std::all_of(mesh.poses.begin(), mesh.poses.end(), flat_in);
}

void drop_degenerate(TriangleMesh& mesh, CleanReport& report) {
  parallel::for_parts(mesh.triangles.size(), kTrianglesAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (degenerate(mesh, mesh.triangles[i])) mesh.triangles[i][0] = kNoVertex;
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (mesh.triangles[i][0] == kNoVertex) continue;
    mesh.triangles[kept] = mesh.triangles[i];
    mesh.face[kept++] = mesh.face[i];
  }
  report.triangles_degenerate += mesh.triangles.size() - kept;
  mesh.triangles.resize(kept);
  mesh.face.resize(kept);
}

void drop_unused_points(TriangleMesh& mesh) {
  std::vector<std::uint32_t> new_index = mark_used(mesh);
  std::uint32_t kept = 0;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (new_index[i] == kNoVertex) continue;
    mesh.points[kept] = mesh.points[i];
    mesh.source_vertex[kept] = mesh.source_vertex[i];
    for (auto& pose : mesh.poses) pose[kept] = pose[i];
    new_index[i] = kept++;
  }
  if (kept == mesh.points.size()) return;
  mesh.points.resize(kept);
  mesh.source_vertex.resize(kept);
  for (auto& pose : mesh.poses) pose.resize(kept);
  rename_corners(mesh, new_index);
}

/// The corners rotated so that the smallest comes first: the same for all spellings of one orientation.
TriangleIndices rotated(const TriangleIndices& t) {
  if (t[0] < t[1] && t[0] < t[2]) return t;
  if (t[1] < t[2]) return {t[1], t[2], t[0]};
  return {t[2], t[0], t[1]};
}

/// The orientation of the two in which the middle corner is smaller than the last.
TriangleIndices unoriented(const TriangleIndices& t) {
  const TriangleIndices r = rotated(t);
  return r[1] < r[2] ? r : TriangleIndices{r[0], r[2], r[1]};
}

void count_duplicates(const TriangleMesh& mesh, CleanReport& report) {
  IndexTable table(mesh.triangles.size());
  const auto hash = [&](std::size_t i) {
    const TriangleIndices t = unoriented(mesh.triangles[i]);
    return hash_words(t[0], t[1], t[2]);
  };
  for_each_prefetched(mesh.triangles.size(), table, hash, [&](std::uint32_t i, std::uint64_t hash_i) {
    const TriangleIndices mine = unoriented(mesh.triangles[i]);
    const auto same = [&](std::uint32_t k) { return unoriented(mesh.triangles[k]) == mine; };
    const std::uint32_t earlier = table.find_or_insert(hash_i, i, same);
    if (earlier == i) return;
    ++report.triangles_duplicate;
    if (rotated(mesh.triangles[earlier]) != rotated(mesh.triangles[i])) ++report.triangles_duplicate_reversed;
  });
}

struct Noun {
  const char *one, *many;
};
constexpr Noun kFaces = {"face", "faces"}, kVertices = {"vertex", "vertices"},
               kTriangles = {"triangle", "triangles"};

/// A row of findings(), whose sentence is put together as "3 faces name a vertex ...".
struct FindingKind {
  const char* key;
  std::uint64_t CleanReport::*count;
  Noun noun, verb;
  const char *rest, *fate;
  bool defect, loses_faces;

  Finding of(const CleanReport& report) const {
    const std::uint64_t n = report.*count;
    const bool one = n == 1;
    const std::string what = std::to_string(n) + " " + (one ? noun.one : noun.many) + " " +
                             (one ? verb.one : verb.many) + " " + rest;
    return {key, n, what, fate, defect, loses_faces};
  }
};

constexpr bool kDefect = true, kNoDefect = false, kLoses = true, kKeeps = false;
constexpr Noun kHave = {"has", "have"};

constexpr FindingKind kFindingKinds[] = {
    {"faces_index_out_of_range",
     &CleanReport::faces_index_out_of_range,
     kFaces,
     {"names", "name"},
     "a vertex that the file does not have",
     "dropped",
     kDefect,
     kLoses},
    {"faces_too_few_corners", &CleanReport::faces_too_few_corners, kFaces, kHave, "fewer than three corners",
     "dropped", kDefect, kLoses},
    {"faces_not_finite", &CleanReport::faces_not_finite, kFaces, kHave,
     "a coordinate that is NaN or infinite", "dropped", kDefect, kLoses},
    {"faces_too_large", &CleanReport::faces_too_large, kFaces, kHave, "a coordinate too large for float32",
     "dropped", kDefect, kLoses},
    {"faces_repeated_corner", &CleanReport::faces_repeated_corner, kFaces, kHave,
     "two corners in a row in the same place", "taken for one corner", kDefect, kKeeps},
    {"faces_not_simple", &CleanReport::faces_not_simple, kFaces, kHave, "an outline that crosses itself",
     "split as a fan", kDefect, kKeeps},
    {"vertices_unreferenced",
     &CleanReport::vertices_unreferenced,
     kVertices,
     {"belongs", "belong"},
     "to no face",
     "dropped",
     kDefect,
     kKeeps},
    {"vertices_welded",
     &CleanReport::vertices_welded,
     kVertices,
     {"lies", "lie"},
     "exactly on an earlier one",
     "welded",
     kNoDefect,
     kKeeps},
    {"triangles_degenerate", &CleanReport::triangles_degenerate, kTriangles, kHave, "all corners on one line",
     "dropped", kDefect, kLoses},
    {"triangles_duplicate",
     &CleanReport::triangles_duplicate,
     kTriangles,
     {"repeats", "repeat"},
     "an earlier one, in either direction",
     "kept",
     kDefect,
     kKeeps},
    {"triangles_duplicate_reversed",
     &CleanReport::triangles_duplicate_reversed,
     kTriangles,
     {"repeats", "repeat"},
     "an earlier one with the opposite orientation",
     "kept",
     kDefect,
     kKeeps},
    {"triangles_flattened",
     &CleanReport::triangles_flattened,
     kTriangles,
     {"becomes", "become"},
     "flat when rounded to float32",
     "kept",
     kDefect,
     kKeeps},
};

}  // namespace

bool is_usable(std::span<const Point> points, std::span<const std::uint32_t> corners, CleanReport& report) {
  for (const std::uint32_t corner : corners)
    if (corner >= points.size()) return drop(report.faces_index_out_of_range);
  if (corners.size() < 3) return drop(report.faces_too_few_corners);
  bool finite = true;
  bool small = true;
  for (const std::uint32_t corner : corners)
    for (const double x : points[corner]) {
      finite &= std::isfinite(x);
      small &= std::abs(x) <= double{kMaxCoordinate};
    }
  if (!finite) return drop(report.faces_not_finite);
  return small || drop(report.faces_too_large);
}

std::uint64_t count_unreferenced(std::size_t points, std::span<const std::uint32_t> corners) {
  std::vector<bool> referenced(points, false);
  for (const std::uint32_t corner : corners)
    if (corner < points) referenced[corner] = true;
  return static_cast<std::uint64_t>(std::count(referenced.begin(), referenced.end(), false));
}

TriangleMesh take_triangles(std::span<const Point> points, std::span<const TriangleIndices> triangles,
                            std::span<const std::uint32_t> face, CleanReport& report) {
  report.faces = triangles.size();
  report.vertices = points.size();
  report.vertices_unreferenced = count_unreferenced(
      points.size(), {triangles.empty() ? nullptr : triangles[0].data(), 3 * triangles.size()});
  TriangleMesh out;
  out.triangles.reserve(triangles.size());
  out.face.reserve(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (!is_usable(points, triangles[i], report)) continue;
    out.triangles.push_back(triangles[i]);
    out.face.push_back(face.empty() ? static_cast<std::uint32_t>(i) : face[i]);
  }
  out.points.assign(points.begin(), points.end());
  return out;
}

std::vector<Finding> findings(const CleanReport& report) {
  std::vector<Finding> all;
  for (const FindingKind& kind : kFindingKinds) all.push_back(kind.of(report));
  return all;
}

void clean(TriangleMesh& mesh, CleanReport& report) {
  weld(mesh, report);
  drop_degenerate(mesh, report);
  drop_unused_points(mesh);
  count_duplicates(mesh, report);
}

}  // namespace tandem::build
