#include "contacts.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <new>

#include "common/stopwatch.h"

namespace tandem::simulation {
namespace {

Eigen::Vector3d vector_of(const double (&x)[3]) {
  return {x[0], x[1], x[2]};
}

void throw_unless_ok(Status status, const Scene& scene) {
  if (status == Status::kOk) return;
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  const std::uint64_t where = scene.where();
  const std::string blamed =
      subject(status) != nullptr ? std::string(subject(status)) + " " + std::to_string(where) + ": " : "";
  throw EngineError("contact manifolds: " + blamed + explain(status), status, where);
}

class MeshContactFinder : public ContactFinder {
 public:
  MeshContactFinder(std::unique_ptr<Engine> engine, std::span<const AssetView> shapes, std::uint32_t threads,
                    bool asks_all)
      : engine_(std::move(engine)), threads_(threads), asks_all_(asks_all) {
    engine_->set_threads(threads);
    engine_->set_shapes(shapes);
    generator_.set_shapes(shapes);
  }

  const std::vector<ContactPoint>& find(std::span<const BodyPose> bodies, std::span<const std::uint8_t> idle,
                                        const Keeping& keeping) override {
    engine_->find(bodies, idle, found_, [&](std::span<const ObjectPair> near) {
      const std::span<const ObjectPair> moved = find_moved(near, bodies, keeping);
      return asks_all_ ? near : moved;
    });
    Stopwatch stopwatch;
    const std::vector<ContactPoint>& points = generator_.generate(found_, bodies, kept_, threads_);
    report_ = {engine_->times(), stopwatch.lap(), engine_->counters(), generator_.statistics(), kept_.size()};
    return points;
  }

  std::span<const PosedBodies> posed() const override { return generator_.posed(); }
  void resume(std::span<const PosedBodies> posed) override { generator_.resume(posed); }

 private:
  // Remembered pairs may keep a gap, with which their boxes no longer meet.
  std::span<const ObjectPair> find_moved(std::span<const ObjectPair> near, std::span<const BodyPose> bodies,
                                         const Keeping& keeping) {
    pairs_.clear();
    std::ranges::set_union(near, keeping.remembered, std::back_inserter(pairs_));
    const MovedQuery& moved = generator_.find_moved(pairs_, bodies, keeping.tolerance, threads_);
    kept_.clear();
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      if (moved.kept_rows()[i] != kNoIndex) kept_.push_back(pairs_[i]);
    }
    return moved.rows();
  }

  std::unique_ptr<Engine> engine_;
  ContactGenerator generator_;
  std::uint32_t threads_;
  bool asks_all_;
  ContactList found_;
  std::vector<ObjectPair> pairs_;
};

}  // namespace

ContactAnchor anchor_of(const ContactPoint& contact, std::span<const BodyState> states) {
  return {into_body(states[contact.body_a], contact.position),
          into_body(states[contact.body_b], contact.position), contact.depth};
}

void carry(ContactPoint& contact, const ContactAnchor& anchor, std::span<const BodyState> states) {
  const Eigen::Vector3d on_a = into_world(states[contact.body_a], anchor.in_a);
  const Eigen::Vector3d on_b = into_world(states[contact.body_b], anchor.in_b);
  contact.position = 0.5 * (on_a + on_b);
  contact.depth = anchor.depth - contact.normal.dot(on_b - on_a);
}

Eigen::Vector3d across(const Eigen::Vector3d& normal) {
  int smallest = 0;
  normal.cwiseAbs().minCoeff(&smallest);
  return normal.cross(Eigen::Vector3d::Unit(smallest)).normalized();
}

void ContactGenerator::set_shapes(std::span<const AssetView> shapes) {
  throw_unless_ok(scene_.set_assets(shapes), scene_);
}

void ContactGenerator::place(std::span<const BodyPose> bodies, std::uint32_t threads) {
  throw_unless_ok(scene_.set_threads(threads), scene_);
  throw_unless_ok(scene_.place(bodies), scene_);
}

const MovedQuery& ContactGenerator::find_moved(std::span<const ObjectPair> pairs,
                                               std::span<const BodyPose> bodies, double tolerance,
                                               std::uint32_t threads) {
  place(bodies, threads);
  throw_unless_ok(moved_.find(scene_, pairs, {.tolerance = tolerance}), scene_);
  return moved_;
}

void ContactGenerator::resume(std::span<const PosedBodies> posed) {
  throw_unless_ok(moved_.resume(scene_, posed), scene_);
}

const std::vector<ContactPoint>& ContactGenerator::generate(const ContactList& found,
                                                            std::span<const BodyPose> bodies,
                                                            std::span<const ObjectPair> left_out,
                                                            std::uint32_t threads) {
  contacts_.clear();
  std::vector<char> is_left_out;
  for (const ObjectPair& pair : found.pairs)
    is_left_out.push_back(std::binary_search(left_out.begin(), left_out.end(), pair));
  for (const TriangleContact& c : found.triangles) {
    if (!is_left_out[c.pair]) contacts_.push_back({c.pair, c.triangle_a, c.triangle_b, 0, 0});
  }
  // The solvers remember by themselves what a point did in the step before.
  const ManifoldOptions options = {.match_previous = false};
  place(bodies, threads);
  throw_unless_ok(manifolds_.find(scene_, found.pairs, contacts_, options), scene_);
  points_.clear();
  statistics_ = {manifolds_.counters(), 0, 0};
  for (const Manifold& manifold : manifolds_.rows()) {
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

std::unique_ptr<ContactFinder> make_mesh_contact_finder(std::unique_ptr<Engine> engine,
                                                        std::span<const AssetView> shapes,
                                                        std::uint32_t threads, bool asks_all) {
  return std::make_unique<MeshContactFinder>(std::move(engine), shapes, threads, asks_all);
}

}  // namespace tandem::simulation
