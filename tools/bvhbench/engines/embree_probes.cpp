#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "library_engine.h"

namespace tandem {
namespace {

constexpr float kNone = std::numeric_limits<float>::infinity();

struct Vector {
  float x, y, z;

  friend Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vector operator*(float s, Vector a) { return {s * a.x, s * a.y, s * a.z}; }
  friend float dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
};

/// The point of a triangle that is closest to p, in float32: Ericson, Real-Time Collision Detection, 5.1.5,
/// as Embree's tutorial closest_point has it.
Vector closest_of(Vector p, Vector a, Vector b, Vector c) {
  const Vector ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const float d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
              d6 = dot(ac, cp);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const float vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  const float sum = 1 / (va + vb + vc);
  return a + vb * sum * ab + vc * sum * ac;
}

/// A body's triangles in the world. Embree holds its address.
struct ProbedBody {
  const IndexedMesh* mesh = nullptr;
  std::vector<Vector> vertices;

  void place(const Pose& pose) {
    vertices.resize(mesh->vertex_count());
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const float* v = &mesh->vertices[3 * i];
      double out[3];
      apply(pose, v[0], v[1], v[2], out);
      vertices[i] = {static_cast<float>(out[0]), static_cast<float>(out[1]), static_cast<float>(out[2])};
    }
  }
  Vector corner(unsigned triangle, int i) const { return vertices[mesh->corners[3 * triangle + i]]; }
};

bool take_triangle(RTCPointQueryFunctionArguments* asked) {
  const auto& body = (*static_cast<const std::vector<ProbedBody>*>(asked->userPtr))[asked->geomID];
  RTCPointQuery& query = *asked->query;
  const Vector p = {query.x, query.y, query.z};
  const unsigned triangle = asked->primID;
  const Vector off =
      closest_of(p, body.corner(triangle, 0), body.corner(triangle, 1), body.corner(triangle, 2)) - p;
  const float distance = std::sqrt(dot(off, off));
  if (!(distance < query.radius)) return false;
  query.radius = distance;
  return true;
}

/// Closest points and rays of Embree: all bodies in one scene, in the world, in float32.
class EmbreeProbes final : public EngineWith<IndexedMesh> {
 public:
  explicit EmbreeProbes(std::string_view name)
      : EngineWith(name), device_(rtcNewDevice("threads=1,set_affinity=0")) {
    if (device_ == nullptr) throw std::runtime_error("Embree: no device");
  }
  ~EmbreeProbes() override {
    clear_scene();
    rtcReleaseDevice(device_);
  }

  std::string label() const override { return "Embree"; }
  std::string settings() const override {
    return "rtcIntersect1 and rtcPointQuery, robust, float32, triangles of all bodies in the world";
  }

  void find_closest(Points points, std::vector<double>& distances) override {
    distances.clear();
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    for (const auto& p : points) {
      RTCPointQuery query = {};
      query.x = static_cast<float>(p[0]);
      query.y = static_cast<float>(p[1]);
      query.z = static_cast<float>(p[2]);
      query.radius = kNone;
      rtcPointQuery(scene_, &query, &context, take_triangle, &bodies_);
      distances.push_back(static_cast<double>(query.radius));
    }
    throw_on_error();
  }

  void find_hits(Points origins, Points directions, std::vector<double>& times) override {
    times.clear();
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (std::size_t i = 0; i < origins.size(); ++i) {
      RTCRayHit ray = {};
      ray.ray.org_x = static_cast<float>(origins[i][0]);
      ray.ray.org_y = static_cast<float>(origins[i][1]);
      ray.ray.org_z = static_cast<float>(origins[i][2]);
      ray.ray.dir_x = static_cast<float>(directions[i][0]);
      ray.ray.dir_y = static_cast<float>(directions[i][1]);
      ray.ray.dir_z = static_cast<float>(directions[i][2]);
      ray.ray.tfar = kNone;
      ray.ray.mask = ~0u;
      ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(scene_, &context, &ray);
      const bool hits = ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
      times.push_back(static_cast<double>(hits ? ray.ray.tfar : kNone));
    }
    throw_on_error();
  }

 private:
  void clear_shapes() override {
    clear_scene();
    EngineWith::clear_shapes();
  }

  void clear_scene() {
    if (scene_ != nullptr) rtcReleaseScene(scene_);
    scene_ = nullptr;
    bodies_.clear();
  }

  void make_bodies(std::span<const Pose> poses) override { place(poses); }

  void place(std::span<const Pose> poses) override {
    clear_scene();
    bodies_.resize(poses.size());
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
      ProbedBody& body = bodies_[i];
      body.mesh = &shape(i);
      body.place(poses[i]);
      const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
      rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, body.vertices.data(),
                                 0, sizeof(Vector), body.vertices.size());
      rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                 body.mesh->corners.data(), 0, 3 * sizeof(int), body.mesh->triangle_count());
      rtcCommitGeometry(geometry);
      rtcAttachGeometryByID(scene_, geometry, i);
      rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(scene_);
    throw_on_error();
  }

  void throw_on_error() const {
    if (const RTCError error = rtcGetDeviceError(device_); error != RTC_ERROR_NONE)
      throw std::runtime_error("Embree: error " + std::to_string(error));
  }

  RTCDevice device_;
  RTCScene scene_ = nullptr;
  std::vector<ProbedBody> bodies_;
};

}  // namespace

std::unique_ptr<Engine> make_embree_probes(std::string_view name);

std::unique_ptr<Engine> make_embree_probes(std::string_view name) {
  return std::make_unique<EmbreeProbes>(name);
}

}  // namespace tandem
