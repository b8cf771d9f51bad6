#include "contacts_file.h"

#include <cmath>

#include "columns.h"

namespace tandem::bench {
namespace {

double area_of(const Manifold& manifold) {
  const double(&v)[3] = manifold.area_vector, (&n)[3] = manifold.normal;
  return std::fabs(v[0] * n[0] + v[1] * n[1] + v[2] * n[2]);
}

}  // namespace

void add_contacts(Hdf5Output& file, const ContactTable& table) {
  add_pairs(file, "/pairs", table.pairs);
  file.add("/contacts/pair", {table.pair.size()}, table.pair);
  file.add("/contacts/face_a", {table.face_a.size()}, table.face_a);
  file.add("/contacts/face_b", {table.face_b.size()}, table.face_b);
}

void add_manifolds(Hdf5Output& file, std::span<const Manifold> manifolds,
                   std::span<const ManifoldPoint> points) {
  std::vector<std::uint32_t> first = column(manifolds, &Manifold::first_point);
  first.push_back(static_cast<std::uint32_t>(points.size()));
  add_column(file, "/manifolds/pair", manifolds, &Manifold::pair);
  add_column(file, "/manifolds/normal", manifolds, &Manifold::normal);
  add_column(file, "/manifolds/area", manifolds, area_of);
  add_column(file, "/manifolds/depth", manifolds, &Manifold::depth);
  add_column(file, "/manifolds/centre", manifolds, &Manifold::centre);
  file.add("/manifolds/first", {first.size()}, first);
  add_column(file, "/points/position", points, &ManifoldPoint::position);
  add_column(file, "/points/normal", points, &ManifoldPoint::normal);
  add_column(file, "/points/depth", points, &ManifoldPoint::depth);
  add_column(file, "/points/id", points, &ManifoldPoint::id);
  add_column(file, "/points/face_a", points, &ManifoldPoint::face_a);
  add_column(file, "/points/face_b", points, &ManifoldPoint::face_b);
}

void add_contained(Hdf5Output& file, std::span<const Containment> rows) {
  const auto flag = [](std::uint32_t wanted) {
    return [=](const Containment& x) { return static_cast<std::uint8_t>((x.flags & wanted) != 0); };
  };
  const auto inner = [](const Containment& x) { return static_cast<std::uint8_t>(x.inner); };
  add_column(file, "/contained/pair", rows, &Containment::pair);
  add_column(file, "/contained/inner", rows, inner);
  add_column(file, "/contained/component", rows, &Containment::component);
  add_column(file, "/contained/inside", rows, flag(kInside));
  add_column(file, "/contained/open", rows, flag(kOuterOpen));
}

}  // namespace tandem::bench
