#pragma once
#include <algorithm>
#include <vector>

#include "contact_curves.h"

namespace tandem::simulation {

/// The curves that make a patch, of all curves of a pair of bodies.
struct PatchRegion {
  ContactCurves* curves = nullptr;
  const BodySide* side[2] = {nullptr, nullptr};  ///< a, b
  std::vector<std::uint32_t> group;              ///< of each curve, the one that stands for its region
  std::vector<std::uint8_t> kept;                ///< of each curve, whether it counts for the patch
  std::uint32_t current = 0;                     ///< the patch's group

  bool in_patch(std::uint32_t curve) const { return kept[curve] != 0; }
  bool in_group(std::uint32_t curve) const { return group[curve] == current; }
  double reach() const { return std::max(side[0]->reach(), side[1]->reach()); }

  /// From the middle of a's bounds to that of b's.
  Eigen::Vector3d apart() const { return side[1]->center() - side[0]->center(); }

  /// visit(0 or 1, triangle) for the triangles of a and b that pieces of accepted curves lie in; some come
  /// more than once.
  template <typename Accept, typename Visit>
  void for_each_cut_triangle(const Accept& accept, const Visit& visit) const {
    if (curves->curves().size() == 1) {  // as mostly: then all that are posed, each once
      for (int s = 0; s < 2 && accept(0); ++s) {
        for (const WorldTriangle& triangle : side[s]->triangles()) visit(s, triangle);
      }
      return;
    }
    std::uint32_t last[2] = {kNoIndex, kNoIndex};
    for (const CurvePiece& piece : curves->pieces()) {
      if (!accept(piece.curve)) continue;
      for (int s = 0; s < 2; ++s) {
        if (last[s] == piece.slot[s]) continue;
        last[s] = piece.slot[s];
        visit(s, side[s]->at(piece.slot[s]));
      }
    }
  }
};

}  // namespace tandem::simulation
