#include <algorithm>
#include <cmath>
#include <cstdio>

#include "manifold_scene.h"
#include "overlap_oracle.h"
#include "kernels/manifold/surface_line.h"

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

OracleSolid solid_of(const Mesh& mesh, const Pose& pose) {
  OracleSolid out;
  for (const auto& p : mesh.points) out.points.push_back(apply(pose, Vector3{p[0], p[1], p[2]}));
  out.triangles = mesh.triangles;
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
    for (std::size_t k = 0; k < heights.size(); k += 2) longest = std::max(longest, heights[k + 1] - heights[k]);
  }
  return longest;
}

/// What was found about the pieces of some overlaps.
struct Findings {
  int scenes = 0, pieces = 0, missed = 0, several = 0, strays = 0, manifolds = 0, other_area = 0, grows = 0,
      too_shallow = 0, undecided = 0;
  double least_part = 1;

  void print(const char* a, const char* b) const {
    std::printf("%s, %s: %d scenes, %d pieces of overlap, %d without a manifold, %d with several; %d manifolds, "
                "%d in no piece; %d pieces of another area, %d not shrunk (%d balanced); %d too shallow, least part %.3f\n",
                a, b, scenes, pieces, missed, several, manifolds, strays, other_area, grows, undecided, too_shallow,
                least_part);
  }
};

class Overlaps : public testing::TestWithParam<Body> {};

TEST_P(Overlaps, HaveAManifoldInEachPieceThatShrinksIt) {
  RandomPoses random(23);
  ASSERT_TRUE(bounds_a_solid(solid_of(GetParam().mesh, kIdentityPose)));
  for (const Body& other : bodies()) {
    ManifoldScene scene;
    scene.add_body(scene.add_shape(GetParam().mesh), kIdentityPose);
    scene.add_body(scene.add_shape(other.mesh), kIdentityPose);
    const double size = std::min(radius_of(scene.assets.views()[0]), radius_of(scene.assets.views()[1]));
    Findings found;
    for (int trial = 0; trial < trials(10, 100); ++trial) {
      SCOPED_TRACE(std::string(other.name) + " " + std::to_string(trial));
      scene.bodies[0].pose = any_motion(random, 0);
      scene.bodies[1].pose = any_motion(random, std::pow(10, random.uniform(-1, 0.1)));
      scene.find();
      if (scene.query.rows().empty()) continue;
      ++found.scenes;
      const auto pieces = overlap_of(solid_of(GetParam().mesh, scene.bodies[0].pose),
                                     solid_of(other.mesh, scene.bodies[1].pose));
      std::vector<std::vector<const Manifold*>> of_piece(pieces.size());
      for (const Manifold& m : scene.manifolds()) {
        ++found.manifolds;
        double least = INFINITY;
        std::size_t nearest = 0;
        for (std::size_t i = 0; i < pieces.size(); ++i) {
          for (const ManifoldPoint& p : scene.points_of(m)) {
            const double distance = distance_from(pieces[i], vector_of(p.position));
            if (distance < least) least = distance, nearest = i;
          }
        }
        if (least > 1e-6 * size) ++found.strays;
        if (least < INFINITY) of_piece[nearest].push_back(&m);
      }
      for (std::size_t i = 0; i < pieces.size(); ++i) {
        const OverlapPiece& piece = pieces[i];
        if (piece.whole_area_a == 0 || piece.whole_area_b == 0) continue;  // one within the other
        ++found.pieces;
        found.missed += of_piece[i].empty();
        found.several += of_piece[i].size() > 1;
        Vector3 area;
        bool shrinks = false;
        for (const Manifold* m : of_piece[i]) {
          area = area + vector_of(m->area_vector);
          shrinks = shrinks || dot(vector_of(m->normal), piece.area) > 0;
          const double stretch = longest_stretch(piece, vector_of(m->normal));
          found.too_shallow += m->depth < 0.99 * stretch;
          found.least_part = std::min(found.least_part, m->depth / stretch);
        }
        const bool balanced = norm(piece.area) < 0.1 * std::min(piece.whole_area_a, piece.whole_area_b);
        found.undecided += balanced;
        found.grows += !shrinks && !of_piece[i].empty();
        if (norm(area - piece.area) > 1e-6 * std::min(piece.whole_area_a, piece.whole_area_b)) ++found.other_area;
        if (std::getenv("VERBOSE") && of_piece[i].empty()) std::printf("  MISS trial %d volume %g areas %g %g manifolds %zu\n", trial, piece.volume, piece.whole_area_a, piece.whole_area_b, scene.manifolds().size());
      }
    }
    found.print(GetParam().name, other.name);
  }
}

INSTANTIATE_TEST_SUITE_P(Bodies, Overlaps, testing::ValuesIn(bodies()),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace tandem::test
