#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <vector>

namespace tandem::simulation {

/// A point in the plane of a patch, and which candidate it is.
struct PlanePoint {
  Eigen::Vector2d x;
  std::uint32_t index;
};

inline double twice_area(const Eigen::Vector2d& p, const Eigen::Vector2d& q, const Eigen::Vector2d& r) {
  return (q.x() - p.x()) * (r.y() - p.y()) - (q.y() - p.y()) * (r.x() - p.x());
}

/// The convex hull, counter-clockwise from its leftmost point (Andrew 1979); `points` is sorted. Points on
/// its sides are left out.
inline void convex_hull(std::vector<PlanePoint>& points, std::vector<PlanePoint>& hull) {
  hull.clear();
  std::sort(points.begin(), points.end(), [](const PlanePoint& p, const PlanePoint& q) {
    if (p.x.x() != q.x.x()) return p.x.x() < q.x.x();
    if (p.x.y() != q.x.y()) return p.x.y() < q.x.y();
    return p.index < q.index;
  });
  const auto add_chain = [&](auto begin, auto end) {
    const std::size_t base = hull.size();
    for (auto p = begin; p != end; ++p) {
      while (hull.size() >= base + 2 && twice_area(hull.end()[-2].x, hull.back().x, p->x) <= 0)
        hull.pop_back();
      hull.push_back(*p);
    }
    hull.pop_back();  // begins the other chain
  };
  if (points.size() < 2) {
    hull = points;
    return;
  }
  add_chain(points.begin(), points.end());
  add_chain(points.rbegin(), points.rend());
}

/// Takes corners off that matter least to the area, until there are at most `most`, and all that make less
/// than `part` of it.
inline void simplify_hull(std::vector<PlanePoint>& hull, std::size_t most, double part) {
  double area = 0;
  for (std::size_t i = 1; i + 1 < hull.size(); ++i) area += twice_area(hull[0].x, hull[i].x, hull[i + 1].x);
  while (hull.size() > 2) {
    const std::size_t n = hull.size();
    std::size_t least = 0;
    double loss = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double of_i = twice_area(hull[(i + n - 1) % n].x, hull[i].x, hull[(i + 1) % n].x);
      if (i == 0 || of_i < loss) loss = of_i, least = i;
    }
    if (n <= most && loss >= part * area) return;
    hull.erase(hull.begin() + static_cast<std::ptrdiff_t>(least));
  }
}

}  // namespace tandem::simulation
