#include <ode/ode.h>

#include <stdexcept>

#include "peer.h"
#include "peer_mesh.h"

namespace tandem::bench {
namespace {

/// One initialisation of ODE for as long as a peer lives.
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
  explicit OdeMesh(const LevelView& level) : mesh_(index_mesh(level)), data_(dGeomTriMeshDataCreate()) {
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

void place(dGeomID geom, const Pose& pose) {
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
class OdePeer final : public Peer {
 public:
  OdePeer() = default;
  OdePeer(const OdePeer&) = delete;
  OdePeer& operator=(const OdePeer&) = delete;
  ~OdePeer() override {
    for (dGeomID geom : geoms_) dGeomDestroy(geom);
  }

  std::string name() const override { return "ODE"; }
  std::string settings() const override {
    return "OPCODE through dCollide: finds all pairs of triangles, hands out one contact point; trees "
           "float32, "
           "poses float64";
  }

  void build(std::span<const AssetView> assets, std::span<const Instance> instances) override {
    assets_ = assets;
    for (const AssetView& asset : assets) meshes_.push_back(std::make_unique<OdeMesh>(asset.level()));
    for (const Instance& instance : instances) {
      geoms_.push_back(dCreateTriMesh(nullptr, meshes_[instance.asset]->data(), nullptr, nullptr, nullptr));
    }
    update(instances);
  }

  void update(std::span<const Instance> instances) override {
    const std::vector<Pose> poses = stored_poses(assets_, instances);
    for (std::size_t i = 0; i < poses.size(); ++i) place(geoms_[i], poses[i]);
  }

  void query(std::span<const ObjectPair> pairs) override {
    touching_pairs_ = 0;
    dContactGeom contact;
    for (const auto [a, b] : pairs) {
      touching_pairs_ +=
          dCollide(geoms_[a], geoms_[b], CONTACTS_UNIMPORTANT | 1, &contact, sizeof contact) > 0;
    }
  }

  std::optional<std::vector<TriangleContact>> contacts() const override { return std::nullopt; }

  std::vector<Counter> counters() const override { return {{"touching_object_pairs", touching_pairs_}}; }

 private:
  OdeLibrary library_;
  std::span<const AssetView> assets_;
  std::vector<std::unique_ptr<OdeMesh>> meshes_;
  std::vector<dGeomID> geoms_;
  std::uint64_t touching_pairs_ = 0;
};

}  // namespace

std::vector<std::unique_ptr<Peer>> make_ode_peers() {
  std::vector<std::unique_ptr<Peer>> peers;
  peers.push_back(std::make_unique<OdePeer>());
  return peers;
}

}  // namespace tandem::bench
