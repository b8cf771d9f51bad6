#pragma once
#include "kernels/manifold/patch_rim.h"
#include "kernels/manifold/team.h"

/// Once all patches of a pair of bodies are known, their points get names that last.
namespace tandem::manifold {

/// A point is the one of the step before if it has moved, on either body, by less than this part of the
/// smaller body's diagonal.
inline constexpr double kSamePoint = 0.02;

/// Finds each point of a pair among those of the step before: of points that are each other's nearest, and
/// near enough, the new one takes over the old one's id. Ids of the others differ from all that were taken
/// over. Condition: `points` have the ids that their features give.
template <typename Team>
class PointMatcher {
 public:
  struct Step {
    const Manifold* manifolds;
    const ManifoldPoint* points;
    std::uint32_t first, count;  ///< the pair's points
  };

  TANDEM_HD PointMatcher(const Team& team, double smaller_diagonal)
      : team_(team), reach_(kSamePoint * smaller_diagonal) {}

  TANDEM_HD void match(ManifoldPoint* points, const Manifold* manifolds, std::uint32_t first,
                       std::uint32_t count, const Step& before) const {
    for (std::uint32_t i = first + team_.rank(); i < first + count; i += team_.size()) {
      points[i].previous = kNoIndex;
      const std::uint32_t old = nearest(points[i], manifolds[points[i].manifold], before.points,
                                        before.manifolds, before.first, before.count);
      if (old == kNoIndex) continue;
      const std::uint32_t back = nearest(before.points[old], before.manifolds[before.points[old].manifold],
                                         points, manifolds, first, count);
      if (back == i) points[i].previous = old;
    }
    team_.sync();
    for (std::uint32_t i = first + team_.rank(); i < first + count; i += team_.size()) {
      ManifoldPoint& p = points[i];
      if (p.previous != kNoIndex) {
        p.id = before.points[p.previous].id;
        continue;
      }
      for (bool taken = true; taken;) {
        taken = false;
        for (std::uint32_t j = first; j < first + count && !taken; ++j) {
          taken = points[j].previous != kNoIndex && before.points[points[j].previous].id == p.id;
        }
        if (taken) p.id = feature_hash(p.id, 9);
      }
    }
    team_.sync();
  }

 private:
  TANDEM_HD static double distance_squared(const double (&p)[3], const double (&q)[3]) {
    const double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
    return x * x + y * y + z * z;
  }
  /// Returns the nearest of the points of another step that push in about the same direction; of two as near,
  /// the first.
  TANDEM_HD std::uint32_t nearest(const ManifoldPoint& point, const Manifold& manifold,
                                  const ManifoldPoint* others, const Manifold* of_others, std::uint32_t first,
                                  std::uint32_t count) const {
    std::uint32_t found = kNoIndex;
    double least = reach_ * reach_;
    for (std::uint32_t i = first; i < first + count; ++i) {
      const double of_a = distance_squared(point.in_a, others[i].in_a),
                   of_b = distance_squared(point.in_b, others[i].in_b);
      const double distance = of_a < of_b ? of_a : of_b;
      if (!(distance < least)) continue;
      const double(&n)[3] = manifold.normal, (&m)[3] = of_others[others[i].manifold].normal;
      if (!(n[0] * m[0] + n[1] * m[1] + n[2] * m[2] > 0.7)) continue;
      least = distance, found = i;
    }
    return found;
  }

  const Team& team_;
  double reach_;
};

}  // namespace tandem::manifold
