#pragma once
#include <algorithm>
#include <iterator>
#include <type_traits>

#include "kernels/manifold/patch_rim.h"
#include "kernels/manifold/point_tree.h"
#include "kernels/manifold/team.h"

/// Once all patches of a pair of bodies are known, their points get names that last.
namespace tandem::manifold {

/// A point is the one of the step before if it has moved, on either body, by less than this part of the
/// smaller body's diagonal.
inline constexpr double kSamePoint = 0.02;

/// Finds each point of a pair among those of the step before: of points that are each other's nearest, and
/// near enough, the new one takes over the old one's id. Ids of the others differ from all that were taken
/// over. Condition: `points` have the ids that their features give.
///
/// A team compares each point with each. A thread of a CPU that has many looks only at what is near, in
/// O(n log n), and comes to the same.
template <typename Team>
class PointMatcher {
 public:
  struct Step {
    const ManifoldPoint* points;
    std::uint32_t first, count;  ///< the pair's points
  };

  TANDEM_HD PointMatcher(const Team& team, double smaller_diagonal)
      : team_(team), reach_(kSamePoint * smaller_diagonal) {}

  TANDEM_HD void match(ManifoldPoint* points, std::uint32_t first, std::uint32_t count,
                       const Step& before) const {
    const Step now = {points, first, count};
    if constexpr (std::is_base_of_v<OneThread, Team>) {
      if (std::uint64_t{count} * before.count > kFewComparisons) return match_many(points, now, before);
    }
    for (std::uint32_t i = first + team_.rank(); i < first + count; i += team_.size()) {
      points[i].previous = kNoIndex;
      const std::uint32_t old = nearest(now, i, before);
      if (old != kNoIndex && nearest(before, old, now) == i) points[i].previous = old;
    }
    team_.sync();
    for (std::uint32_t i = first + team_.rank(); i < first + count; i += team_.size()) {
      take_over_id(points[i], before, [&](std::uint64_t id) {
        for (std::uint32_t j = first; j < first + count; ++j) {
          if (points[j].previous != kNoIndex && before.points[points[j].previous].id == id) return true;
        }
        return false;
      });
    }
    team_.sync();
  }

 private:
  /// Fewer comparisons take no longer than making trees.
  static constexpr std::uint64_t kFewComparisons = 160 * 160;

  struct Nearest {
    std::uint32_t point;  ///< or kNoIndex
    double distance;      ///< its square
  };

  TANDEM_HD static double distance_squared(const double (&p)[3], const double (&q)[3]) {
    const double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
    return x * x + y * y + z * z;
  }

  TANDEM_HD static double distance_squared(const ManifoldPoint& p, const ManifoldPoint& q) {
    const double of_a = distance_squared(p.in_a, q.in_a), of_b = distance_squared(p.in_b, q.in_b);
    return of_a < of_b ? of_a : of_b;
  }

  /// Compares the nearest so far of those that push in about the same direction with another point; of two as
  /// near, the first is nearer.
  TANDEM_HD static void compare(const Step& of, std::uint32_t point, const Step& others, std::uint32_t other,
                                Nearest& least) {
    const ManifoldPoint &p = of.points[point], &q = others.points[other];
    const double distance = distance_squared(p, q);
    const bool is_nearer = distance < least.distance ||
                           (distance == least.distance && least.point != kNoIndex && other < least.point);
    if (!is_nearer) return;
    const double(&n)[3] = p.normal, (&m)[3] = q.normal;
    if (n[0] * m[0] + n[1] * m[1] + n[2] * m[2] > 0.7) least = {other, distance};
  }

  /// Returns the nearest of another step's points, or kNoIndex where none is near enough.
  TANDEM_HD std::uint32_t nearest(const Step& of, std::uint32_t point, const Step& others) const {
    Nearest least = {kNoIndex, reach_ * reach_};
    for (std::uint32_t i = others.first; i < others.first + others.count; ++i)
      compare(of, point, others, i, least);
    return least.point;
  }

  /// Gives a point the id of the one that it is, or else an id that none has taken over.
  template <typename IsTaken>
  TANDEM_HD static void take_over_id(ManifoldPoint& point, const Step& before, const IsTaken& is_taken) {
    if (point.previous != kNoIndex) {
      point.id = before.points[point.previous].id;
    } else {
      while (is_taken(point.id)) point.id = feature_hash(point.id, 9);
    }
  }

  /// Calls of(tree, first) for trees that together hold a step's points, by their places in either body; the
  /// points of a tree are numbered from `first` on. A point that is nearer than a distance is so in one of
  /// the two.
  template <typename Of>
  static void for_each_tree(const Step& step, const Of& of) {
    for (const PointTree::Place place : {&ManifoldPoint::in_a, &ManifoldPoint::in_b}) {
      for (std::uint32_t done = 0; done < step.count; done += PointTree::kMost) {
        const std::uint32_t first = step.first + done;
        const std::uint32_t count =
            step.count - done < PointTree::kMost ? step.count - done : PointTree::kMost;
        of(PointTree(step.points + first, count, place), place, first);
      }
    }
  }

  /// Lets the points of a tree be compared with a point.
  static void compare_near(const PointTree& tree, PointTree::Place place, std::uint32_t first, const Step& of,
                           std::uint32_t point, const Step& others, Nearest& least) {
    tree.visit_near(of.points[point].*place, least.distance,
                    [&](std::uint32_t i) { compare(of, point, others, first + i, least); });
  }

  /// Finds the same as match(). `previous` holds what was found so far: the nearest of the old points, until
  /// another new point turns out to be nearer to that one.
  void match_many(ManifoldPoint* points, const Step& now, const Step& before) const {
    const std::uint32_t end = now.first + now.count;
    for (std::uint32_t i = now.first; i < end; ++i) points[i].previous = kNoIndex;
    for_each_tree(before, [&](const PointTree& tree, PointTree::Place place, std::uint32_t first) {
      for (std::uint32_t i = now.first; i < end; ++i) {
        const std::uint32_t old = points[i].previous;
        Nearest least = {old,
                         old != kNoIndex ? distance_squared(points[i], before.points[old]) : reach_ * reach_};
        compare_near(tree, place, first, now, i, before, least);
        points[i].previous = least.point;
      }
    });
    for_each_tree(now, [&](const PointTree& tree, PointTree::Place place, std::uint32_t first) {
      for (std::uint32_t i = now.first; i < end; ++i) {
        const std::uint32_t old = points[i].previous;
        if (old == kNoIndex) continue;
        Nearest least = {i, distance_squared(points[i], before.points[old])};
        compare_near(tree, place, first, before, old, now, least);
        if (least.point != i) points[i].previous = kNoIndex;
      }
    });
    take_over_many_ids(points, now, before);
  }

  /// Ids that were taken over are sorted, some at a time; ids that were changed are looked for again.
  static void take_over_many_ids(ManifoldPoint* points, const Step& now, const Step& before) {
    std::uint64_t taken[2048];
    const std::uint32_t end = now.first + now.count;
    for (bool changed = true; changed;) {
      changed = false;
      for (std::uint32_t i = now.first; i < end;) {
        std::uint64_t* last = taken;
        for (; i < end && last < std::end(taken); ++i) {
          if (points[i].previous != kNoIndex) *last++ = before.points[points[i].previous].id;
        }
        std::sort(taken, last);
        for (std::uint32_t j = now.first; j < end; ++j) {
          take_over_id(points[j], before, [&](std::uint64_t id) {
            const bool is_taken = std::binary_search(taken, last, id);
            changed = changed || is_taken;
            return is_taken;
          });
        }
      }
    }
  }

  const Team& team_;
  double reach_;
};

}  // namespace tandem::manifold
