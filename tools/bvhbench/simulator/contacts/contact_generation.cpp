#include "contact_generation.h"

#include <algorithm>
#include <cmath>

namespace tandem::simulation {
namespace {

Eigen::Vector3d vector_of(const double (&x)[3]) {
  return {x[0], x[1], x[2]};
}

void throw_unless_ok(Status status, std::uint64_t where) {
  if (status == Status::kOk) return;
  const std::string blamed =
      subject(status) != nullptr ? std::string(subject(status)) + " " + std::to_string(where) + ": " : "";
  throw EngineError("contact manifolds: " + blamed + explain(status), status, where);
}

}  // namespace

void ContactGenerator::set_shapes(std::span<const AssetView> shapes) {
  throw_unless_ok(manifolds_.set_assets(shapes), manifolds_.where());
}

const std::vector<ContactPoint>& ContactGenerator::generate(const ContactList& found,
                                                            std::span<const BodyPose> bodies,
                                                            std::span<const BodyPair> left_out,
                                                            const ContactPointOptions& options) {
  contacts_.clear();
  std::vector<char> is_left_out;
  for (const ObjectPair& pair : found.pairs)
    is_left_out.push_back(std::binary_search(left_out.begin(), left_out.end(), BodyPair{pair.a, pair.b}));
  for (const TriangleContact& c : found.triangles) {
    if (!is_left_out[c.pair]) contacts_.push_back({c.pair, c.triangle_a, c.triangle_b, 0, 0});
  }
  // The solvers remember by themselves what a point did in the step before.
  const ManifoldOptions manifold_options = {
      .match_previous = false, .most_points = options.points_per_patch, .threads = options.threads};
  throw_unless_ok(manifolds_.make(bodies, found.pairs, contacts_, manifold_options), manifolds_.where());
  points_.clear();
  statistics_ = {manifolds_.counters(), 0, 0};
  for (const Manifold& manifold : manifolds_.manifolds()) {
    const ObjectPair& pair = found.pairs[manifold.pair];
    const Eigen::Vector3d normal = vector_of(manifold.normal);
    statistics_.area += std::fabs(vector_of(manifold.area_vector).dot(normal));
    statistics_.depth = std::max(statistics_.depth, manifold.depth);
    for (const ManifoldPoint& p : manifolds_.points().subspan(manifold.first_point, manifold.point_count)) {
      points_.push_back({pair.a, pair.b, vector_of(p.position), normal, p.depth, p.id});
    }
  }
  return points_;
}

}  // namespace tandem::simulation
