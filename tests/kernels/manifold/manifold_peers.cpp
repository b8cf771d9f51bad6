#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <btBulletCollisionCommon.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <ode/ode.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "manifold_scene.h"

/// Contact manifolds of Tandem and of other libraries beside closed forms: same bodies, same poses, one
/// thread. Prints CSV. Usage: manifold_peers [POSES], of overlaps and as many of gaps for each kind of
/// bodies. Exit code 1 where Tandem invents or misses a touch, or is off by 0.1 degree or 1 % of the depth.
/// manifold_peers POSES --json prints the bodies and their poses instead, for scripts/manifold_peers_newton.
namespace tandem::test {
namespace {

/// A contact point as every library has it.
struct PeerPoint {
  Vector3 normal;  ///< from a to b
  double depth;
};

/// What a library says of one pair of bodies.
struct Answer {
  std::vector<PeerPoint> points;
  double depth = 0;  ///< the largest

  void add(const Vector3& normal, double point_depth) {
    points.push_back({normal, point_depth});
    depth = std::max(depth, point_depth);
  }
  /// The mean of the points' normals, weighted by depth.
  Vector3 normal() const {
    Vector3 sum;
    for (const PeerPoint& p : points) sum = sum + p.depth * p.normal;
    return sum;
  }
};

/// A library, with two bodies.
class Peer {
 public:
  Peer() = default;
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  virtual ~Peer() = default;

  /// Places the bodies and collides them.
  virtual void collide(const Pose& a, const Pose& b) = 0;
  /// What the last call found.
  virtual Answer answer() const = 0;
};

class TandemPeer final : public Peer {
 public:
  TandemPeer(const Mesh& a, const Mesh& b) {
    assets_.add(a), assets_.add(b);
    check(scene_.set_assets(assets_.views()));
  }
  void collide(const Pose& a, const Pose& b) override {
    const Instance bodies[] = {{0, a}, {1, b}};
    const ObjectPair pair[] = {{0, 1}};
    check(scene_.place(bodies));
    check(query_.find(scene_, pair, {}));
    check(manifolds_.find(scene_, query_, {.match_previous = false}));
  }
  Answer answer() const override {
    Answer out;
    for (const ManifoldPoint& p : manifolds_.points())
      out.add(vector_of(manifolds_.rows()[p.manifold].normal), p.depth);
    for (const Manifold& m : manifolds_.rows()) out.depth = std::max(out.depth, m.depth);
    return out;
  }

 private:
  static void check(Status status) {
    if (status != Status::kOk) throw std::runtime_error("Tandem: a call failed");
  }

  SampleAssets assets_;
  Scene scene_;
  ContactQuery query_;
  ManifoldQuery manifolds_;
};

/// Coinciding corners shared, as Bullet and ODE take a mesh.
struct FlatMesh {
  explicit FlatMesh(const Mesh& mesh) {
    std::vector<std::array<float, 3>> points;
    for (const auto& triangle : mesh.triangles) {
      for (const auto corner : triangle) {
        const std::array<float, 3> p = {mesh.points[corner][0], mesh.points[corner][1],
                                        mesh.points[corner][2]};
        const auto at = std::find(points.begin(), points.end(), p);
        corners.push_back(static_cast<int>(at - points.begin()));
        if (at == points.end()) points.push_back(p);
      }
    }
    for (const auto& p : points) vertices.insert(vertices.end(), p.begin(), p.end());
  }
  int vertex_count() const { return static_cast<int>(vertices.size() / 3); }
  int triangle_count() const { return static_cast<int>(corners.size() / 3); }

  std::vector<float> vertices;
  std::vector<int> corners;
};

/// The way of a world: a dispatcher's algorithm, whose manifold keeps four points at most.
class BulletPeer final : public Peer {
 public:
  BulletPeer(const Mesh& a, const Mesh& b) : a_(a), b_(b), dispatcher_(&configuration_) {
    btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher_);
  }
  ~BulletPeer() override { release(); }

  void collide(const Pose& a, const Pose& b) override {
    release();
    a_.place(a), b_.place(b);
    const btCollisionObjectWrapper in_a(nullptr, &a_.shape, &a_.object, a_.object.getWorldTransform(), -1,
                                        -1),
        in_b(nullptr, &b_.shape, &b_.object, b_.object.getWorldTransform(), -1, -1);
    algorithm_ = dispatcher_.findAlgorithm(&in_a, &in_b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    btManifoldResult result(&in_a, &in_b);
    algorithm_->processCollision(&in_a, &in_b, {}, &result);
  }
  Answer answer() const override {
    Answer out;
    btManifoldArray manifolds;
    algorithm_->getAllContactManifolds(manifolds);
    for (int i = 0; i < manifolds.size(); ++i) {
      const double sign = manifolds[i]->getBody0() == &a_.object ? -1 : 1;
      for (int k = 0; k < manifolds[i]->getNumContacts(); ++k) {
        const btManifoldPoint& p = manifolds[i]->getContactPoint(k);
        const btVector3& n = p.m_normalWorldOnB;  // from the second body to the first
        out.add(sign * Vector3{n.x(), n.y(), n.z()}, -p.getDistance());
      }
    }
    return out;
  }

 private:
  struct Body {
    explicit Body(const Mesh& mesh)
        : flat(mesh),
          triangles(flat.triangle_count(), flat.corners.data(), 3 * sizeof(int), flat.vertex_count(),
                    flat.vertices.data(), 3 * sizeof(float)),
          shape(&triangles) {
      shape.setMargin(0);
      shape.updateBound();
      object.setCollisionShape(&shape);
    }
    void place(const Pose& pose) {
      btMatrix3x3 basis;
      btVector3 origin;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) basis[i][j] = static_cast<btScalar>(pose.rotation[i][j]);
        origin[i] = static_cast<btScalar>(pose.translation[i]);
      }
      object.setWorldTransform(btTransform(basis, origin));
    }
    FlatMesh flat;
    btTriangleIndexVertexArray triangles;
    btGImpactMeshShape shape;
    btCollisionObject object;
  };

  void release() {
    if (algorithm_ == nullptr) return;
    algorithm_->~btCollisionAlgorithm();
    dispatcher_.freeCollisionAlgorithm(algorithm_);
    algorithm_ = nullptr;
  }

  Body a_, b_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btCollisionAlgorithm* algorithm_ = nullptr;
};

class FclPeer final : public Peer {
 public:
  FclPeer(const Mesh& a, const Mesh& b) : a_(model(a)), b_(model(b)) {}

  void collide(const Pose& a, const Pose& b) override {
    result_.clear();
    fcl::collide(a_.get(), transform(a), b_.get(), transform(b), request_, result_);
  }
  Answer answer() const override {
    Answer out;
    for (std::size_t i = 0; i < result_.numContacts(); ++i) {
      const fcl::Contactd& c = result_.getContact(i);
      out.add({c.normal[0], c.normal[1], c.normal[2]}, c.penetration_depth);
    }
    return out;
  }

 private:
  using Model = fcl::BVHModel<fcl::OBBRSSd>;

  static std::shared_ptr<Model> model(const Mesh& mesh) {
    const FlatMesh flat(mesh);
    std::vector<fcl::Vector3d> vertices;
    std::vector<fcl::Triangle> triangles;
    for (std::size_t i = 0; i < flat.vertices.size(); i += 3)
      vertices.emplace_back(flat.vertices[i], flat.vertices[i + 1], flat.vertices[i + 2]);
    for (std::size_t i = 0; i < flat.corners.size(); i += 3)
      triangles.emplace_back(flat.corners[i], flat.corners[i + 1], flat.corners[i + 2]);
    auto out = std::make_shared<Model>();
    out->beginModel(flat.triangle_count(), flat.vertex_count());
    out->addSubModel(vertices, triangles);
    out->endModel();
    return out;
  }
  static fcl::Transform3d transform(const Pose& pose) {
    fcl::Transform3d out = fcl::Transform3d::Identity();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) out.linear()(i, j) = pose.rotation[i][j];
      out.translation()[i] = pose.translation[i];
    }
    return out;
  }

  const fcl::CollisionRequestd request_{std::numeric_limits<std::size_t>::max(), /*enable_contact=*/true};
  fcl::CollisionResultd result_;
  std::shared_ptr<Model> a_, b_;
};

class OdePeer final : public Peer {
 public:
  OdePeer(const Mesh& a, const Mesh& b) : a_(a), b_(b), contacts_(4096) {}

  void collide(const Pose& a, const Pose& b) override {
    a_.place(a), b_.place(b);
    found_ =
        dCollide(a_.geom, b_.geom, static_cast<int>(contacts_.size()), contacts_.data(), sizeof contacts_[0]);
  }
  Answer answer() const override {
    Answer out;
    for (int i = 0; i < found_; ++i) {
      const auto& [pos, normal, depth, g1, g2, side1, side2] = contacts_[static_cast<std::size_t>(i)];
      out.add({-normal[0], -normal[1], -normal[2]}, depth);  // ODE's points into a
    }
    return out;
  }

 private:
  struct Body {
    explicit Body(const Mesh& mesh) : flat(mesh), data(dGeomTriMeshDataCreate()) {
      dGeomTriMeshDataBuildSingle(data, flat.vertices.data(), 3 * sizeof(float), flat.vertex_count(),
                                  flat.corners.data(), static_cast<int>(flat.corners.size()),
                                  3 * sizeof(dTriIndex));
      geom = dCreateTriMesh(nullptr, data, nullptr, nullptr, nullptr);
    }
    Body(const Body&) = delete;
    Body& operator=(const Body&) = delete;
    ~Body() {
      dGeomDestroy(geom);
      dGeomTriMeshDataDestroy(data);
    }
    void place(const Pose& pose) {
      dMatrix3 rotation = {};  // rows of four
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) rotation[4 * i + j] = static_cast<dReal>(pose.rotation[i][j]);
      }
      const double* t = pose.translation;
      dGeomSetRotation(geom, rotation);
      dGeomSetPosition(geom, static_cast<dReal>(t[0]), static_cast<dReal>(t[1]), static_cast<dReal>(t[2]));
    }
    FlatMesh flat;
    dTriMeshDataID data;
    dGeomID geom;
  };

  Body a_, b_;
  std::vector<dContactGeom> contacts_;
  int found_ = 0;
};

/// Two bodies, b above a: they overlap, or are apart, along z, by as much as b reaches below the top of a.
struct Kind {
  const char* name;
  Mesh a, b;
  std::function<Pose(RandomPoses&)> turned;  ///< b, before it is placed
};

std::vector<Kind> kinds() {
  constexpr double kPi = 3.14159265358979323846;
  const auto about_z = [](RandomPoses& random) { return turn(2, random.symmetric(kPi)); };
  const auto any = [](RandomPoses& random) { return any_motion(random, 0); };
  const auto edge_down = [=](RandomPoses& random) {
    // The edge lies level at the bottom; the wedge leans to a side of it by half a radian at most.
    const Pose leaning = after(turn(0, random.symmetric(0.5)), turn(1, kPi / 2));
    return after(about_z(random), leaning);
  };
  const Mesh block = box(4, 4, 2);
  return {{"box on box", cube(0.5f), cube(0.5f), about_z},
          {"fine box on fine box", cube(0.5f, 4), cube(0.5f, 4), about_z},
          {"sphere in block", block, sphere(0.5, 3), any},
          {"tetrahedron in block", block, tetrahedron(), any},
          {"edge of wedge in block", block, wedge(), edge_down},
          {"pipe upright in block", block, pipe(24, 0.25, 0.5, 0.5f), about_z}};
}

/// Two bodies in the world.
struct PosedPair {
  Pose a, b;
  double depth;  ///< along a's z; negative: a gap
};

/// Overlaps and gaps by turns, of 0.001 to 0.05.
std::vector<PosedPair> posed_pairs(const Kind& kind, int poses) {
  RandomPoses random(1);
  const double top = reach_along(triangles_of(kind.a, kIdentityPose), {0, 0, 1});
  std::vector<PosedPair> out;
  for (int i = 0; i < 2 * poses; ++i) {
    const double size = 1e-3 * std::pow(50, random.uniform(0, 1));
    const double depth = i % 2 == 0 ? size : -size;
    const Pose turned = kind.turned(random);
    const double z = top + reach_along(triangles_of(kind.b, turned), {0, 0, -1}) - depth;
    const Pose motion = any_motion(random, 3);
    const double y = random.symmetric(0.25), x = random.symmetric(0.25);
    out.push_back({motion, after(motion, after(shift(x, y, z), turned)), depth});
  }
  return out;
}

double median(std::vector<double> values) {
  if (values.empty()) return NAN;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double largest(const std::vector<double>& values) {
  return values.empty() ? NAN : *std::max_element(values.begin(), values.end());
}

double degrees_between(const Vector3& p, const Vector3& q) {
  const double angle = std::atan2(norm(cross(p, q)), dot(p, q)) * 180 / 3.14159265358979323846;
  return norm(p) > 0 && std::isfinite(angle) ? angle : 180;  // no direction is as wrong as the opposite one
}

/// What a library made of the pairs of one kind. Errors are those of overlaps that it saw.
struct Record {
  int missed = 0;    ///< overlaps without a contact
  int invented = 0;  ///< gaps with one
  double all_points = 0, upright_points = 0;
  std::vector<double> points, degrees, depth_errors, microseconds;

  void take_overlap(const Answer& answer, const Vector3& up, double depth) {
    if (answer.points.empty()) {
      ++missed;
      return;
    }
    points.push_back(static_cast<double>(answer.points.size()));
    for (const PeerPoint& p : answer.points) {
      ++all_points;
      upright_points += degrees_between(p.normal, up) < 1;
    }
    degrees.push_back(degrees_between(answer.normal(), up));
    depth_errors.push_back(std::fabs(answer.depth - depth) / depth);
  }
};

double microseconds_of(Peer& peer, const Pose& a, const Pose& b) {
  const auto start = std::chrono::steady_clock::now();
  peer.collide(a, b);
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
}

/// Prints a row for each library. Whether Tandem has the closed form.
bool compare(const Kind& kind, int poses) {
  constexpr int kRounds = 7;
  std::vector<std::pair<const char*, std::unique_ptr<Peer>>> peers;
  peers.emplace_back("Tandem", std::make_unique<TandemPeer>(kind.a, kind.b));
  peers.emplace_back("Bullet", std::make_unique<BulletPeer>(kind.a, kind.b));
  peers.emplace_back("FCL", std::make_unique<FclPeer>(kind.a, kind.b));
  peers.emplace_back("ODE", std::make_unique<OdePeer>(kind.a, kind.b));
  std::vector<Record> records(peers.size());
  for (const PosedPair& pair : posed_pairs(kind, poses)) {
    std::vector<std::vector<double>> times(peers.size());
    for (int round = 0; round < kRounds; ++round) {
      for (std::size_t k = 0; k < peers.size(); ++k)
        times[k].push_back(microseconds_of(*peers[k].second, pair.a, pair.b));
    }
    for (std::size_t k = 0; k < peers.size(); ++k) {
      const Answer answer = peers[k].second->answer();
      if (pair.depth < 0) {
        records[k].invented += !answer.points.empty();
      } else {
        records[k].take_overlap(answer, rotate(pair.a, {0, 0, 1}), pair.depth);
        records[k].microseconds.push_back(median(times[k]));
      }
    }
  }
  for (std::size_t k = 0; k < peers.size(); ++k) {
    const Record& r = records[k];
    std::printf("%s,%s,%d,%d,%d,%g,%.3g,%.2g,%.2g,%.2g,%.2g,%.3g,%.2g\n", kind.name, peers[k].first, poses,
                r.missed, r.invented, median(r.points), 100 * r.upright_points / r.all_points,
                median(r.degrees), largest(r.degrees), 100 * median(r.depth_errors),
                100 * largest(r.depth_errors), median(r.microseconds),
                median(r.microseconds) / median(records[0].microseconds));
  }
  return records[0].missed == 0 && records[0].invented == 0 && largest(records[0].degrees) < 0.1 &&
         largest(records[0].depth_errors) < 0.01;
}

void print_array(const char* name, const auto& values) {
  std::printf("\"%s\": [", name);
  const char* comma = "";
  for (const auto value : values)
    std::printf("%s%.17g", std::exchange(comma, ", "), static_cast<double>(value));
  std::printf("]");
}

void print_body(const char* name, const Mesh& mesh) {
  const FlatMesh flat(mesh);
  std::printf("\"%s\": {", name);
  print_array("vertices", flat.vertices);
  std::printf(", ");
  print_array("corners", flat.corners);
  std::printf("},\n ");
}

/// The nine numbers of the rotation by rows, then the translation.
std::array<double, 12> numbers_of(const Pose& pose) {
  std::array<double, 12> out{};
  for (std::size_t i = 0; i < 9; ++i) out[i] = pose.rotation[i / 3][i % 3];
  std::copy_n(pose.translation, 3, out.begin() + 9);
  return out;
}

/// A JSON object: the bodies "a" and "b" as flat arrays, and "pairs" with the depth and the pose of each.
void print_json(const Kind& kind, int poses) {
  std::printf("{\"name\": \"%s\",\n ", kind.name);
  print_body("a", kind.a), print_body("b", kind.b);
  std::printf("\"pairs\": [");
  const char* comma = "";
  for (const PosedPair& pair : posed_pairs(kind, poses)) {
    std::printf("%s\n  {\"depth\": %.17g, ", std::exchange(comma, ","), pair.depth);
    print_array("a", numbers_of(pair.a));
    std::printf(", ");
    print_array("b", numbers_of(pair.b));
    std::printf("}");
  }
  std::printf("]}");
}

void print_json(int poses) {
  const char* before = "[";
  for (const Kind& kind : kinds()) {
    std::fputs(std::exchange(before, ",\n"), stdout);
    print_json(kind, poses);
  }
  std::puts("]");
}

}  // namespace
}  // namespace tandem::test

int main(int argc, char** argv) {
  const int poses = argc > 1 ? std::atoi(argv[1]) : 300;
  if (argc > 2 && std::string_view(argv[2]) == "--json") {
    tandem::test::print_json(poses);
    return 0;
  }
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  std::puts(
      "bodies,peer,poses,missed,invented,points,points_upright_percent,normal_degrees,normal_degrees_largest,"
      "depth_percent,"
      "depth_percent_largest,microseconds,time_ratio");
  bool right = true;
  for (const tandem::test::Kind& kind : tandem::test::kinds()) right &= tandem::test::compare(kind, poses);
  dCloseODE();
  return right ? 0 : 1;
}
