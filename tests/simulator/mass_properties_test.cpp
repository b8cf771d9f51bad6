#include "dynamics/mass_properties.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "analytic_contacts.h"
#include "kernels/query_scenes.h"
#include "kernels/solid_meshes.h"

namespace tandem::test {
namespace {

using namespace dynamics;

MassReport report_of(const Mesh& mesh, const std::array<double, 3>& origin = {}) {
  SampleAssets assets;
  assets.add(mesh, origin);
  return mass_properties(assets.views()[0]);
}

Matrix3 box_inertia(double x, double y, double z) {
  return simulation::box_body({x, y, z}, x * y * z).inertia;
}

double norm(const Matrix3& m) {
  return std::sqrt(square(m.row[0]) + square(m.row[1]) + square(m.row[2]));
}

void turn_triangle(Mesh& mesh, std::size_t t) {
  std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
}

void turn(Mesh& mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) turn_triangle(mesh, t);
}

TEST(MassProperties, OfABoxAreItsClosedForm) {
  const MassReport report = report_of(moved(box(2, 3, 0.5f), 1, -2, 4));
  EXPECT_NEAR(report.properties.volume, 3, 1e-14);
  EXPECT_LT(norm(report.properties.centre - Vector3{1, -2, 4}), 1e-14);
  EXPECT_LT(norm(report.properties.inertia_per_density - box_inertia(2, 3, 0.5)), 1e-13);
  EXPECT_EQ(report.model, MassModel::solid);
  EXPECT_TRUE(report.findings.empty());
  EXPECT_EQ(report.components, 1u);
}

TEST(MassProperties, OfATetrahedronAreItsClosedForm) {
  Mesh mesh;
  mesh.add({0, 0, 0}, {0, 1, 0}, {1, 0, 0});
  mesh.add({0, 0, 0}, {1, 0, 0}, {0, 0, 1});
  mesh.add({0, 0, 0}, {0, 0, 1}, {0, 1, 0});
  mesh.add({1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  const MassProperties properties = report_of(mesh).properties;
  EXPECT_NEAR(properties.volume, 1.0 / 6, 1e-16);
  EXPECT_LT(norm(properties.centre - Vector3{0.25, 0.25, 0.25}), 1e-15);
  // About the origin: the integral of x^2 is 1/60, of xy 1/120. Moved to the centre: 1/60 - 1/96 and 1/120 -
  // 1/96.
  const double square = 1.0 / 60 - 1.0 / 96, mixed = 1.0 / 120 - 1.0 / 96;
  const Matrix3 inertia = {
      {{2 * square, -mixed, -mixed}, {-mixed, 2 * square, -mixed}, {-mixed, -mixed, 2 * square}}};
  EXPECT_LT(norm(properties.inertia_per_density - inertia), 1e-16);
}

TEST(MassProperties, OfFinerSpheresComeCloserToTheBall) {
  const double volume = 4.0 / 3 * 3.14159265358979323846, inertia = 0.4 * volume;
  double last = 1;
  for (int splits = 1; splits <= 5; ++splits) {
    const MassProperties properties = report_of(sphere(1, splits)).properties;
    const double error = std::fabs(properties.volume / volume - 1);
    EXPECT_LT(error, last / 3) << splits;
    EXPECT_NEAR(properties.inertia_per_density.row[0].x / inertia, 1, 2 * error);
    EXPECT_LT(norm(properties.centre), 1e-7);
    last = error;
  }
}

TEST(MassProperties, KeepTheirAccuracyFarFromZero) {
  Mesh mesh = project_mesh("cow_1500.obj");
  const MassProperties here = report_of(mesh).properties;
  const MassProperties far = report_of(mesh, {5811430.0, 1e9, -3e8}).properties;
  EXPECT_DOUBLE_EQ(far.volume, here.volume);
  EXPECT_EQ(norm(far.inertia_per_density - here.inertia_per_density), 0);
  EXPECT_LT(norm(far.centre - here.centre - Vector3{5811430.0, 1e9, -3e8}), 2e-7);
  // Stored coordinates far from zero too: a box whose corners float32 holds exactly.
  const MassProperties box_far = report_of(moved(box(2, 2, 2), 4e6f, -4e6f, 4e6f)).properties;
  EXPECT_NEAR(box_far.volume, 8, 1e-14);
  EXPECT_LT(norm(box_far.inertia_per_density - box_inertia(2, 2, 2)), 1e-13);
}

// Volume, centre and inertia from lines along x through a fine grid of y and z.
MassProperties by_lines(const Mesh& mesh, double cell) {
  double volume = 0;
  Vector3 first;
  Matrix3 second{};
  for (double y = -0.6 + 0.37 * cell; y < 0.6; y += cell) {
    for (double z = -0.2 + 0.61 * cell; z < 1.5; z += cell) {
      std::vector<double> hits;
      for (const auto& t : mesh.triangles) {
        const auto &p = mesh.points[t[0]], &q = mesh.points[t[1]], &r = mesh.points[t[2]];
        const auto side = [&](const auto& s, const auto& e) {
          return (double{e[1]} - s[1]) * (z - s[2]) - (double{e[2]} - s[2]) * (y - s[1]);
        };
        const double a = side(q, r), b = side(r, p), c = side(p, q);
        if ((a > 0) == (b > 0) && (b > 0) == (c > 0))
          hits.push_back((a * p[0] + b * q[0] + c * r[0]) / (a + b + c));
      }
      std::sort(hits.begin(), hits.end());
      for (std::size_t i = 0; i + 1 < hits.size(); i += 2) {
        const double length = hits[i + 1] - hits[i], middle = (hits[i + 1] + hits[i]) / 2;
        const Vector3 x = {middle, y, z};
        volume += length;
        first += length * x;
        second = second + length * outer(x, x);
        second.row[0].x += length * length * length / 12;
      }
    }
  }
  const double part = cell * cell;
  const Vector3 centre = first / volume;
  const Matrix3 spread = part * (second - volume * outer(centre, centre));
  return {part * volume, centre, trace(spread) * Matrix3::identity() - spread};
}

TEST(MassProperties, OfTheCowAreWhatLinesThroughItFind) {
  const Mesh cow = project_mesh("cow_1500.obj");
  const MassReport report = report_of(cow);
  EXPECT_TRUE(report.findings.empty());
  const MassProperties reference = by_lines(cow, 0.01);
  EXPECT_NEAR(report.properties.volume / reference.volume, 1, 0.005);
  EXPECT_LT(norm(report.properties.centre - reference.centre), 0.002);
  EXPECT_LT(norm(report.properties.inertia_per_density - reference.inertia_per_density),
            0.01 * norm(reference.inertia_per_density));
  // The finer cow is the same surface.
  EXPECT_NEAR(report_of(project_mesh("cow.obj")).properties.volume, report.properties.volume, 1e-7);
}

TEST(MassProperties, AreThoseOfTheBodyWhereTheMeshIsInsideOut) {
  Mesh mesh = project_mesh("cow_1500.obj");
  const MassProperties right = report_of(mesh).properties;
  turn(mesh);
  const MassReport report = report_of(mesh);
  EXPECT_DOUBLE_EQ(report.properties.volume, right.volume);
  ASSERT_EQ(report.findings.size(), 1u);
  EXPECT_EQ(report.findings[0], "inside out: taken to be wound the other way");
}

TEST(MassProperties, AreThoseOfTheBodyWhereWindingsContradictEachOther) {
  Mesh mesh = project_mesh("cow_1500.obj");
  const MassProperties right = report_of(mesh).properties;
  for (const std::size_t t : {3, 4, 700}) turn_triangle(mesh, t);
  const MassReport report = report_of(mesh);
  EXPECT_EQ(report.model, MassModel::solid);
  EXPECT_NEAR(report.properties.volume, right.volume, 1e-12);
  ASSERT_EQ(report.findings.size(), 1u);
  EXPECT_NE(report.findings[0].find("3 triangles are taken to be wound the other way"), std::string::npos)
      << report.findings[0];
}

TEST(MassProperties, CountCavitiesAndTurnComponentsThatAreNone) {
  Mesh cavity = box(1, 1, 1);
  turn(cavity);
  const MassReport hollow = report_of(joined(box(2, 2, 2), cavity));
  EXPECT_NEAR(hollow.properties.volume, 7, 1e-13);
  EXPECT_LT(norm(hollow.properties.inertia_per_density - box_inertia(2, 2, 2) + box_inertia(1, 1, 1)), 1e-13);
  EXPECT_EQ(hollow.components, 2u);
  const MassReport apart = report_of(joined(box(2, 2, 2), moved(cavity, 5, 0, 0)));
  EXPECT_NEAR(apart.properties.volume, 9, 1e-13);
  EXPECT_EQ(apart.findings.size(), 2u);
}

TEST(MassProperties, OfAnOpenMeshAreThoseOfAShell) {
  const MassReport report = report_of(sheet(2, 4));
  EXPECT_EQ(report.model, MassModel::shell);
  const double thickness = kShellThickness * std::sqrt(8.0);
  EXPECT_NEAR(report.properties.volume, 4 * thickness, 1e-13);
  EXPECT_NEAR(report.properties.inertia_per_density.row[2].z, 4 * thickness * (4 + 4) / 12, 1e-13);
  ASSERT_EQ(report.findings.size(), 2u);
  EXPECT_EQ(report.findings[0], "open: 16 boundary edges");
}

TEST(MassProperties, OfAMeshThatEnclosesNothingAreThoseOfAShell) {
  Mesh mesh = sheet(1, 1), back = mesh;
  turn(back);
  const MassReport report = report_of(joined(mesh, back));
  EXPECT_EQ(report.model, MassModel::shell);
  EXPECT_EQ(report.findings[0], "encloses no volume");
}

}  // namespace
}  // namespace tandem::test
