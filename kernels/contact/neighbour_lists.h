#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "kernels/contact/neighbours.h"
#include "tandem/formats/status.h"
#include "tandem/formats/view.h"
#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/detail/buffer.h"
#include "tandem/kernels/object_pair.h"

// Neighbourhoods of meshes, made once and kept.
namespace tandem {

struct SceneState;

/// The rings that contacts leave out. Result: kOk or kBadOption.
inline Status check_rings(std::uint32_t leave_out_rings) {
  return leave_out_rings <= kMostRings ? Status::kOk : Status::kBadOption;
}

/// Owns the neighbourhoods of meshes for one number of rings. Levels with one topology are one mesh.
class NeighbourLists {
 public:
  /// Forgets all meshes. Those that are added from now on are for so many rings. Condition: rings > 0.
  void restart(std::uint32_t rings);
  std::uint32_t rings() const { return rings_; }  ///< 0 at first

  /// Finds the number of the mesh with this topology; kNoIndex where it was not added.
  std::uint32_t find(const TriangleTopology* topology) const;

  /// Adds the mesh of a level. readable: its topology in CPU memory. Result: false where memory is out, or
  /// the mesh has 2^32 pairs of vertices or more within the rings; then nothing was added.
  [[nodiscard]] bool add(const LevelView& level, const TriangleTopology* readable);

  std::span<const std::uint32_t> first() const { return first_.view(); }    ///< of all meshes
  std::span<const std::uint32_t> higher() const { return higher_.view(); }  ///< of all meshes

  /// The neighbourhood of a mesh, if first() and higher() lie there. The pointers are valid until the next
  /// add().
  Neighbourhood of(std::uint32_t mesh, const std::uint32_t* first, const std::uint32_t* higher) const;
  Neighbourhood of(std::uint32_t mesh) const { return of(mesh, first_.data(), higher_.data()); }

 private:
  struct Mesh {
    const TriangleTopology* topology;
    std::size_t first, higher;  // where its entries begin
  };

  std::uint32_t rings_ = 0;
  Buffer<Mesh> meshes_;
  Buffer<std::uint32_t> first_, higher_;
};

/// Keeps the neighbourhoods of a scene's bodies that meet themselves.
class BodyNeighbours {
 public:
  /// Provides those of the bodies that `pairs` pairs with themselves; they have topology. Result: kOk, or
  /// kOutOfMemory, where where() of the scene is the asset.
  Status provide(SceneState& scene, std::span<const ObjectPair> pairs, std::uint32_t rings);

  /// They are listed by the bodies' numbers; a body that is not paired with itself may have any.
  std::span<const Neighbourhood> view() const { return of_body_.view(); }

 private:
  Status add_asset(SceneState& scene, std::uint32_t asset);

  std::uint64_t assets_id_ = 0;  // of the scene's assets that of_asset_ is about
  NeighbourLists lists_;
  Buffer<std::uint32_t> of_asset_;  // the number of its mesh, or kNoIndex
  Buffer<Neighbourhood> of_body_;
};

}  // namespace tandem
