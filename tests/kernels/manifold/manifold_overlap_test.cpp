#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "kernels/manifold/surface_line.h"
#include "manifold_scene.h"
#include "overlap_oracle.h"

/// Manifolds of bodies of any shape, beside the overlap as CGAL cuts it out.
namespace tandem::test {
namespace {

struct Body {
  const char* name;
  Mesh mesh;
};

void PrintTo(const Body& body, std::ostream* out) {
  *out << body.name;
}

Mesh small_cow() {
  Mesh cow = project_mesh("cow_1500.obj");
  scale(cow, 0.2);
  return cow;
}

const std::vector<Body>& bodies() {
  static const std::vector<Body> all = {{"box", box(1, 0.75f, 0.5f)},
                                        {"thin_box", box(1, 1, 0.02f)},
                                        {"ring", ring(24, 0.5, 10, 0.15)},
                                        {"thin_ring", ring(24, 0.5, 8, 0.04)},
                                        {"pipe", pipe(24, 0.3, 0.5, 0.5f)},
                                        {"cup", cup(24, 0.5f, 0.6f, 0.08f)},
                                        {"cow", small_cow()}};
  return all;
}

/// Equal points become one.
OracleSolid solid_of(const Mesh& mesh, const Pose& pose) {
  OracleSolid out;
  std::map<std::array<float, 3>, std::uint32_t> known;
  for (const auto& triangle : mesh.triangles) {
    auto& corners = out.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& p = mesh.points[triangle[k]];
      const auto [at, is_new] = known.emplace(p, static_cast<std::uint32_t>(out.points.size()));
      if (is_new) out.points.push_back(apply(pose, Vector3{p[0], p[1], p[2]}));
      corners[k] = at->second;
    }
  }
  return out;
}

/// Returns how often a closed surface winds around a point.
double winding(const Triangles& surface, const Vector3& x) {
  double angle = 0;
  for (const auto& t : surface) {
    const Vector3 p = t[0] - x, q = t[1] - x, r = t[2] - x;
    const double a = norm(p), b = norm(q), c = norm(r);
    angle += 2 * std::atan2(dot(p, cross(q, r)), a * b * c + dot(p, q) * c + dot(q, r) * a + dot(r, p) * b);
  }
  return angle / (4 * 3.14159265358979323846);
}

double distance_from(const OverlapPiece& piece, const Vector3& x) {
  return std::fabs(winding(piece.triangles, x)) > 0.5 ? 0 : off_surface(piece.triangles, x);
}

bool same_area(const Vector3& area, const OverlapPiece& piece) {
  return norm(area - piece.area) <= 1e-6 * std::min(piece.whole_area_a, piece.whole_area_b);
}

/// Returns the piece that a manifold is about: that of its area, else the nearest to any of its points. Those
/// of a body that goes through another one need not lie in the piece.
std::size_t piece_of(const Manifold& m, std::span<const ManifoldPoint> points,
                     const std::vector<OverlapPiece>& pieces) {
  const auto same = [&](const OverlapPiece& piece) { return same_area(vector_of(m.area_vector), piece); };
  const bool any_same = std::any_of(pieces.begin(), pieces.end(), same);
  double least = INFINITY;
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (any_same && !same(pieces[i])) continue;
    for (const ManifoldPoint& p : points) {
      const double distance = distance_from(pieces[i], vector_of(p.position));
      if (distance < least) least = distance, nearest = i;
    }
  }
  return nearest;
}

/// Returns the longest stretch along n that lies within a piece, of those through the middles of triangles.
double longest_stretch(const OverlapPiece& piece, const Vector3& n) {
  const manifold::PatchFrame frame({}, n);
  std::vector<std::array<Vector3, 3>> flat;
  double longest = 0;
  const std::size_t step = 1 + piece.triangles.size() / 100;
  for (std::size_t i = 0; i < piece.triangles.size(); i += step) {
    const auto& [p, q, r] = piece.triangles[i];
    const auto at = frame.flat((1.0 / 3) * (p + q + r));
    std::vector<double> heights;
    for (const auto& t : piece.triangles) {
      const auto u = frame.flat(t[0]) - at, v = frame.flat(t[1]) - at, w = frame.flat(t[2]) - at;
      const double of_u = cross(v, w), of_v = cross(w, u), of_w = cross(u, v);
      if (!((of_u > 0 && of_v > 0 && of_w > 0) || (of_u < 0 && of_v < 0 && of_w < 0))) continue;
      heights.push_back((of_u * frame.height(t[0]) + of_v * frame.height(t[1]) + of_w * frame.height(t[2])) /
                        (of_u + of_v + of_w));
    }
    std::sort(heights.begin(), heights.end());
    if (heights.size() % 2 != 0) continue;  // the line goes through an edge
    for (std::size_t k = 0; k < heights.size(); k += 2)
      longest = std::max(longest, heights[k + 1] - heights[k]);
  }
  return longest;
}

/// What was found about the pieces of overlaps.
struct Findings {
  int pieces = 0, missed = 0, several = 0, other_area = 0;
  int manifolds = 0, beside = 0;       ///< no point of one lies in a piece
  int one = 0, shrinks = 0, ends = 0;  ///< of pieces with one manifold, those that its normal shrinks at
                                       ///< once, or once b has moved by the depth
  int shallow = 0, half = 0;           ///< depths below 0.99 and 0.5 of the longest stretch along the normal
};

class Overlaps : public testing::TestWithParam<Body> {
 protected:
  static void look_at(const ManifoldScene& scene, double size, Findings& found);

 private:
  static OracleSolid solid(const ManifoldScene& scene, std::uint32_t body, const Vector3& way = {}) {
    Pose pose = scene.posed[body].pose;
    pose.translation[0] += way.x, pose.translation[1] += way.y, pose.translation[2] += way.z;
    return solid_of(scene.assets.mesh(body), pose);
  }
  static void look_at_one(const ManifoldScene& scene, const OverlapPiece& piece, const Manifold& m,
                          bool is_only_piece, Findings& found);
};

/// The manifold is the only one of the piece.
void Overlaps::look_at_one(const ManifoldScene& scene, const OverlapPiece& piece, const Manifold& m,
                           bool is_only_piece, Findings& found) {
  const Vector3 n = vector_of(m.normal);
  const double stretch = longest_stretch(piece, n);
  found.shallow += m.depth < 0.99 * stretch;
  found.half += m.depth < 0.5 * stretch;
  const bool shrinks = dot(n, piece.area) > 0;
  if (!shrinks && !is_only_piece) return;
  ++found.one;
  found.shrinks += shrinks;
  if (shrinks) return;
  double left = 0;
  for (const OverlapPiece& part : overlap_of(solid(scene, 0), solid(scene, 1, (1.001 * m.depth) * n)))
    left += part.volume;
  found.ends += left < piece.volume;
}

void Overlaps::look_at(const ManifoldScene& scene, double size, Findings& found) {
  const auto pieces = overlap_of(solid(scene, 0), solid(scene, 1));
  std::vector<std::vector<const Manifold*>> of_piece(pieces.size());
  for (const Manifold& m : scene.manifolds()) {
    ++found.manifolds;
    const std::size_t own = piece_of(m, scene.points_of(m), pieces);
    const auto in_it = [&](const ManifoldPoint& p) {
      return distance_from(pieces[own], vector_of(p.position)) < 1e-6 * size;
    };
    found.beside += std::none_of(scene.points_of(m).begin(), scene.points_of(m).end(), in_it);
    of_piece[own].push_back(&m);
  }
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const double whole = std::min(pieces[i].whole_area_a, pieces[i].whole_area_b);
    if (whole == 0) continue;  // one body lies in the other
    ++found.pieces;
    found.missed += of_piece[i].empty();
    found.several += of_piece[i].size() > 1;
    Vector3 area;
    for (const Manifold* m : of_piece[i]) area = area + vector_of(m->area_vector);
    found.other_area += !same_area(area, pieces[i]);
    if (of_piece[i].size() == 1) look_at_one(scene, pieces[i], *of_piece[i][0], pieces.size() == 1, found);
  }
}

TEST_P(Overlaps, HaveAManifoldInEachPieceThatShrinksIt) {
  RandomPoses random(23);
  ASSERT_TRUE(bounds_a_solid(solid_of(GetParam().mesh, kIdentityPose)));
  Findings found;
  for (const Body& other : bodies()) {
    ManifoldScene scene;
    scene.add_body(scene.add_shape(GetParam().mesh), kIdentityPose);
    scene.add_body(scene.add_shape(other.mesh), kIdentityPose);
    const AssetView a = scene.assets.views()[0], b = scene.assets.views()[1];
    const double both = radius_of(a) + radius_of(b), size = std::min(radius_of(a), radius_of(b));
    for (int trial = 0; trial < trials(10, 30); ++trial) {
      SCOPED_TRACE(std::string(other.name) + " " + std::to_string(trial));
      const Vector3 way =
          rotate(any_motion(random, 0), {0, 0, both * std::pow(10, random.uniform(-1, -0.15))});
      scene.bodies[0].pose = centred_at(a, any_motion(random, 0), {0, 0, 0});
      scene.bodies[1].pose = centred_at(b, any_motion(random, 0), {way.x, way.y, way.z});
      scene.find();
      if (!scene.query.rows().empty()) look_at(scene, size, found);
    }
  }
  std::printf(
      "%s: %d pieces, %d without a manifold, %d with several, %d of another area; %d of %d manifolds lie "
      "beside; of %d pieces with one, its normal shrinks %d at once and %d in the end; %d of the depths are "
      "below 0.99 of the longest stretch, %d below half\n",
      GetParam().name, found.pieces, found.missed, found.several, found.other_area, found.beside,
      found.manifolds, found.one, found.shrinks, found.ends, found.shallow, found.half);
  EXPECT_GT(found.pieces, 50);
  EXPECT_LE(found.missed, found.pieces / 1000);
  EXPECT_LE(found.several, found.pieces / 6);
  EXPECT_LE(found.other_area, found.pieces / 100);
  EXPECT_LE(found.beside, found.manifolds / 40);
  EXPECT_GE(found.shrinks + found.ends, found.one - 1 - found.one / 25);
  EXPECT_LE(found.shallow, found.one / 10);
  EXPECT_LE(found.half, 1 + found.one / 30);
}

INSTANTIATE_TEST_SUITE_P(Bodies, Overlaps, testing::ValuesIn(bodies()),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace tandem::test
