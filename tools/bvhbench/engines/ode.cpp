#include <ode/ode.h>

#include <stdexcept>

#include "library_engine.h"

namespace tandem {
namespace {

/// Keeps ODE initialised for as long as an engine lives.
struct OdeLibrary {
  OdeLibrary() {
    if (dInitODE2(0) == 0) throw std::runtime_error("ODE: cannot be initialised");
    dAllocateODEDataForThread(dAllocateMaskAll);
  }
  OdeLibrary(const OdeLibrary&) = delete;
  OdeLibrary& operator=(const OdeLibrary&) = delete;
  ~OdeLibrary() { dCloseODE(); }
};

/// A mesh, and OPCODE's tree over it.
class OdeMesh {
 public:
  explicit OdeMesh(const LevelView& level) : mesh_(level), data_(dGeomTriMeshDataCreate()) {
    dGeomTriMeshDataBuildSingle(data_, mesh_.vertices.data(), 3 * sizeof(float),
                                static_cast<int>(mesh_.vertex_count()), mesh_.corners.data(),
                                static_cast<int>(mesh_.corners.size()), 3 * sizeof(dTriIndex));
  }
  OdeMesh(const OdeMesh&) = delete;
  OdeMesh& operator=(const OdeMesh&) = delete;
  ~OdeMesh() { dGeomTriMeshDataDestroy(data_); }

  dTriMeshDataID data() const { return data_; }

 private:
  IndexedMesh mesh_;
  dTriMeshDataID data_;
};

void set_pose(dGeomID geom, const Pose& pose) {
  dMatrix3 rotation = {};  // rows of four
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) rotation[4 * i + j] = static_cast<dReal>(pose.rotation[i][j]);
  }
  const double* t = pose.translation;
  dGeomSetRotation(geom, rotation);
  dGeomSetPosition(geom, static_cast<dReal>(t[0]), static_cast<dReal>(t[1]), static_cast<dReal>(t[2]));
}

/// OPCODE inside ODE finds all pairs of triangles and keeps them to itself: dCollide hands out contact
/// points, of which those of several pairs are merged. With one contact asked for, the search is the whole
/// search, and next to nothing is spent on points.
class OdeEngine final : public EngineWith<OdeMesh> {
 public:
  using EngineWith::EngineWith;
  ~OdeEngine() override { clear_bodies(); }

  std::string label() const override { return "ODE"; }
  std::string settings() const override {
    return "OPCODE through dCollide: finds all pairs of triangles, hands out one contact point; trees "
           "float32, poses float64";
  }
  bool contacts(std::vector<TriangleContact>&) override { return false; }
  std::vector<Counter> named_counters() const override {
    return {{"touching_object_pairs", touching_pairs_}};
  }

  void query(std::span<const ObjectPair> pairs) override {
    touching_pairs_ = 0;
    LibraryEngine::query(pairs);
  }

 private:
  void clear_shapes() override {
    clear_bodies();
    EngineWith::clear_shapes();
  }

  void clear_bodies() {
    for (dGeomID geom : geoms_) dGeomDestroy(geom);
    geoms_.clear();
  }
  void make_bodies(std::span<const Pose> poses) override {
    clear_bodies();
    for (std::uint32_t i = 0; i < poses.size(); ++i)
      geoms_.push_back(dCreateTriMesh(nullptr, shape(i).data(), nullptr, nullptr, nullptr));
    place(poses);
  }

  void place(std::span<const Pose> poses) override {
    for (std::size_t i = 0; i < poses.size(); ++i) set_pose(geoms_[i], poses[i]);
  }

  void collide(std::uint32_t, std::uint32_t a, std::uint32_t b) override {
    dContactGeom contact;
    touching_pairs_ += dCollide(geoms_[a], geoms_[b], CONTACTS_UNIMPORTANT | 1, &contact, sizeof contact) > 0;
  }

  OdeLibrary library_;
  std::vector<dGeomID> geoms_;
  std::uint64_t touching_pairs_ = 0;
};

}  // namespace

std::unique_ptr<Engine> make_ode(std::string_view name, const Question&) {
  return std::make_unique<OdeEngine>(name);
}

}  // namespace tandem
