#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "make_scene.h"

namespace tandem::bench {
namespace {

Vector position_of(const AssetView& asset, const Triangle::Corner& corner) {
  Vector position;
  for (int k = 0; k < 3; ++k) position[k] = corner.position[k] + asset.header->origin[k];
  return position;
}

// Returns each vertex of the mesh once, seen from the centre.
std::vector<Vector> vertices_of(const AssetView& asset, const Vector& centre) {
  const LevelView level = asset.level();
  std::vector<Vector> vertices;
  for (std::uint32_t i = 0; i < level.triangle_count; ++i) {
    for (const auto& corner : level.triangles[i].corner) {
      const Vector at = position_of(asset, corner);
      vertices.push_back({at[0] - centre[0], at[1] - centre[1], at[2] - centre[2]});
    }
  }
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

// The heights of a sheet: z of its triangles over x and y, which lie in a grid of as many squares as there
// are triangles.
class HeightField {
 public:
  explicit HeightField(const AssetView& sheet) : bounds_(bounds_of(sheet)) {
    const LevelView level = sheet.level();
    side_ = root_above(level.triangle_count, 2);
    squares_.resize(std::size_t{side_} * side_);
    for (std::uint32_t i = 0; i < level.triangle_count; ++i) {
      const auto& corner = level.triangles[i].corner;
      insert({position_of(sheet, corner[0]), position_of(sheet, corner[1]), position_of(sheet, corner[2])});
    }
  }

  // Returns the height of the highest triangle above (x, y); -infinity where there is none.
  double at(double x, double y) const {
    double highest = -HUGE_VAL;
    if (x < bounds_.lower[0] || x > bounds_.upper[0] || y < bounds_.lower[1] || y > bounds_.upper[1]) {
      return highest;
    }
    for (const Corners& triangle : square(index(x, 0), index(y, 1))) {
      highest = std::max(highest, height(triangle, x, y));
    }
    return highest;
  }

  // No height within `radius` of (x, y), along each axis, is larger.
  double bound(double x, double y, double radius) const {
    double highest = -HUGE_VAL;
    for (std::uint32_t j = index(y - radius, 1); j <= index(y + radius, 1); ++j) {
      for (std::uint32_t i = index(x - radius, 0); i <= index(x + radius, 0); ++i) {
        for (const Corners& triangle : square(i, j)) {
          for (const Vector& corner : triangle) highest = std::max(highest, corner[2]);
        }
      }
    }
    return highest;
  }

  const Bounds& bounds() const { return bounds_; }

 private:
  using Corners = std::array<Vector, 3>;

  std::uint32_t index(double x, int axis) const {
    const double width = bounds_.upper[axis] - bounds_.lower[axis];
    const double at = width > 0 ? (x - bounds_.lower[axis]) / width * side_ : 0;
    return static_cast<std::uint32_t>(std::clamp(at, 0.0, side_ - 1.0));
  }

  const std::vector<Corners>& square(std::uint32_t i, std::uint32_t j) const {
    return squares_[std::size_t{j} * side_ + i];
  }

  void insert(const Corners& triangle) {
    const auto [x0, x1] = std::minmax({triangle[0][0], triangle[1][0], triangle[2][0]});
    const auto [y0, y1] = std::minmax({triangle[0][1], triangle[1][1], triangle[2][1]});
    for (std::uint32_t j = index(y0, 1); j <= index(y1, 1); ++j) {
      for (std::uint32_t i = index(x0, 0); i <= index(x1, 0); ++i) {
        squares_[std::size_t{j} * side_ + i].push_back(triangle);
      }
    }
    // A triangle of a sheet covers a few squares, or few triangles cover many.
    entries_ += std::uint64_t{index(x1, 0) - index(x0, 0) + 1} * (index(y1, 1) - index(y0, 1) + 1);
    if (entries_ > 30 * squares_.size())
      throw std::runtime_error("the ground is no sheet: it lies upon itself");
  }

  // z of the triangle's plane where (x, y) lies within, else -infinity.
  static double height(const Corners& triangle, double x, double y) {
    const auto& [a, b, c] = triangle;
    const auto area = [](const Vector& p, const Vector& q, double qx, double qy) {
      return (q[0] - p[0]) * (qy - p[1]) - (q[1] - p[1]) * (qx - p[0]);
    };
    const double whole = area(a, b, c[0], c[1]);
    if (whole == 0) return -HUGE_VAL;
    const double u = area(b, c, x, y) / whole, v = area(c, a, x, y) / whole, w = area(a, b, x, y) / whole;
    constexpr double kSlack = -1e-9;
    return std::min({u, v, w}) < kSlack ? -HUGE_VAL : u * a[2] + v * b[2] + w * c[2];
  }

  Bounds bounds_;
  std::uint32_t side_;
  std::uint64_t entries_ = 0;
  std::vector<std::vector<Corners>> squares_;
};

// Equal sheets in a square, a hundredth apart so that they don't touch.
class Ground {
 public:
  explicit Ground(const AssetView& sheet) : field_(sheet) {
    for (int k = 0; k < 2; ++k) pitch_[k] = 1.01 * (field_.bounds().upper[k] - field_.bounds().lower[k]);
  }

  double pitch(int axis) const { return pitch_[axis]; }
  double lower(int axis) const { return field_.bounds().lower[axis]; }
  double width(int axis) const { return field_.bounds().upper[axis] - lower(axis); }

  double height(double x, double y) const { return field_.at(in_sheet(x, 0), in_sheet(y, 1)); }

  // Returns the bound, as HeightField::bound() does, of a neighbourhood that may reach into other sheets.
  double bound(double x, double y, double radius) const {
    const double u = in_sheet(x, 0), v = in_sheet(y, 1);
    const Bounds& bounds = field_.bounds();
    const bool inside = u - radius >= bounds.lower[0] && u + radius <= bounds.upper[0] &&
                        v - radius >= bounds.lower[1] && v + radius <= bounds.upper[1];
    return inside ? field_.bound(u, v, radius) : bounds.upper[2];
  }

 private:
  double in_sheet(double x, int axis) const {
    return x - std::floor((x - lower(axis)) / pitch_[axis]) * pitch_[axis];
  }

  HeightField field_;
  double pitch_[2];
};

// Returns how far the ground lies below a body, turned and with its centre at height 0, vertically: the
// height that its centre must not sink below is minus that. radius: no vertex is further from the centre.
double clearance(const std::vector<Vector>& vertices, const Rotation& rotation, const Ground& ground,
                 const Vector& at, double radius) {
  const double bound = ground.bound(at[0], at[1], radius);
  double least = HUGE_VAL;
  for (const Vector& vertex : vertices) {
    const Vector turned = multiply(rotation, vertex);
    if (turned[2] - bound >= least) continue;
    least = std::min(least, turned[2] - ground.height(turned[0] + at[0], turned[1] + at[1]));
  }
  return least == HUGE_VAL ? 0 : least;
}

// Upright, but for a lean of a random direction, and turned about z by any angle.
Rotation random_stance(Random& random) {
  constexpr double kLean = 0.15;  // at most 2 asin(0.15 / sqrt(1 + 0.15^2)) = 17 degrees
  const auto in_disc = [&](double radius) {
    for (;;) {
      const double u = random.between(-1, 1), v = random.between(-1, 1), squared = u * u + v * v;
      if (squared <= 1 && squared > 1e-3) return std::array{radius * u, radius * v, std::sqrt(squared)};
    }
  };
  const auto [w, z, length] = in_disc(1);
  const auto [x, y, ignored] = in_disc(kLean);
  return rotation_of(w / length, x, y, z / length);
}

// A turn about the y axis. Sine and cosine by their series: those of the library differ between platforms.
Rotation tilt_by(double degrees) {
  const double angle = degrees * (3.14159265358979323846 / 180);
  double sine = 0, cosine = 0, term = 1;
  for (int n = 0; n < 40; n += 2) {
    cosine += term;
    sine += term * angle / (n + 1);
    term = -term * angle * angle / ((n + 1) * (n + 2));
  }
  return {{{cosine, 0, sine}, {0, 1, 0}, {-sine, 0, cosine}}};
}

// A body's footprint on the ground: the points within `radius` of a segment.
struct Footprint {
  std::array<double, 2> ends[2];
  double radius;
};

double distance(const std::array<double, 2>& point, const Footprint& to) {
  const auto& [a, b] = to.ends;
  const double dx = b[0] - a[0], dy = b[1] - a[1], squared = dx * dx + dy * dy;
  const double along = squared > 0 ? ((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / squared : 0;
  const double t = std::clamp(along, 0.0, 1.0);
  const double x = point[0] - a[0] - t * dx, y = point[1] - a[1] - t * dy;
  return std::sqrt(x * x + y * y);
}

// Returns whether the segments cross, within both.
bool cross(const Footprint& a, const Footprint& b) {
  const auto side = [](const Footprint& of, const std::array<double, 2>& point) {
    const auto& [p, q] = of.ends;
    return (q[0] - p[0]) * (point[1] - p[1]) - (q[1] - p[1]) * (point[0] - p[0]) > 0;
  };
  return side(a, b.ends[0]) != side(a, b.ends[1]) && side(b, a.ends[0]) != side(b, a.ends[1]);
}

// Returns how deep two footprints lie in each other, in their common radius; negative: how far apart they
// are.
double depth(const Footprint& a, const Footprint& b) {
  if (cross(a, b)) return 2;
  const double apart = std::min(
      {distance(a.ends[0], b), distance(a.ends[1], b), distance(b.ends[0], a), distance(b.ends[1], a)});
  return 2 - apart / a.radius;
}

Footprint footprint(const Bounds& body, const Rotation& stance, const Vector& centre) {
  const double size[2] = {body.upper[0] - body.lower[0], body.upper[1] - body.lower[1]};
  const int axis = size[0] >= size[1] ? 0 : 1;
  const double half = 0.5 * (size[axis] - size[1 - axis]);
  Footprint print{{}, 0.5 * size[1 - axis]};
  for (int k = 0; k < 2; ++k) {
    print.ends[0][k] = centre[k] - half * stance[k][axis];
    print.ends[1][k] = centre[k] + half * stance[k][axis];
  }
  return print;
}

// The layout of sheets and bodies before the tilt: each body near the middle of a square cell of its own.
class Layout {
 public:
  Layout(const Ground& ground, const Bounds& body, std::uint32_t count)
      : ground_(ground), margin_(0.5 * body.diagonal()), cells_(root_above(count, 2)), sheets_(1) {
    constexpr double kRoom = 0.8;  // of a body's length, for a cell
    const double length = std::max(body.upper[0] - body.lower[0], body.upper[1] - body.lower[1]);
    if (cell(0) <= 0 || cell(1) <= 0) throw std::runtime_error("the ground is too small for the bodies");
    while (std::min(cell(0), cell(1)) < kRoom * length) ++sheets_;
  }

  std::uint32_t sheets() const { return sheets_ * sheets_; }
  std::uint32_t cells() const { return cells_; }  // along each axis

  Vector sheet(std::uint32_t i) const {
    return {i % sheets_ * ground_.pitch(0), i / sheets_ * ground_.pitch(1), 0};
  }

  Vector body(std::uint32_t i, Random& random) const {
    constexpr double kJitter = 0.25;  // of a cell
    const std::uint32_t at[2] = {i % cells_, i / cells_};
    Vector position = {};
    for (int k = 0; k < 2; ++k) {
      const double cells = at[k] + 0.5 + random.between(-kJitter, kJitter);
      position[k] = ground_.lower(k) + margin_ + cell(k) * cells;
    }
    return position;
  }

 private:
  double cell(int axis) const {
    return ((sheets_ - 1) * ground_.pitch(axis) + ground_.width(axis) - 2 * margin_) / cells_;
  }

  const Ground& ground_;
  double margin_;
  std::uint32_t cells_, sheets_;  // along each axis
};

struct Standing {
  Rotation stance;
  Vector centre;
  Footprint print;
};

// Strews bodies one by one, row by row; each is tried a few times for a place where it lies in no other too
// deep, and else stands where it does least.
std::vector<Standing> strew(const Layout& layout, const Bounds& body, std::uint32_t count, Random& random) {
  constexpr int kTries = 20;
  constexpr double kDeepest = 0.5;    // radii of a footprint
  constexpr std::int64_t kReach = 2;  // cells; further off there is nothing to touch
  std::vector<Standing> all;
  const std::int64_t cells = layout.cells();
  const auto deepest = [&](const Standing& standing) {
    const auto i = static_cast<std::int64_t>(all.size());
    double most = -HUGE_VAL;
    for (std::int64_t j = std::max<std::int64_t>(0, i - kReach * (cells + 1)); j < i; ++j) {
      if (std::abs(j % cells - i % cells) > kReach) continue;
      most = std::max(most, depth(standing.print, all[static_cast<std::size_t>(j)].print));
    }
    return most;
  };
  while (all.size() < count) {
    Standing best;
    double least = HUGE_VAL;
    for (int i = 0; i < kTries && least > kDeepest; ++i) {
      Standing tried{random_stance(random), layout.body(static_cast<std::uint32_t>(all.size()), random), {}};
      tried.print = footprint(body, tried.stance, tried.centre);
      const double deep = deepest(tried);
      if (deep < least) least = deep, best = tried;
    }
    all.push_back(best);
  }
  return all;
}

}  // namespace

std::vector<Instance> make_slide(const AssetView& body, const AssetView& sheet, std::uint32_t count,
                                 double tilt, const SceneSeed& seed) {
  constexpr double kSink = 0.002;  // of the body's diagonal
  const Ground ground(sheet);
  const Bounds bounds = bounds_of(body);
  const std::vector<Vector> vertices = vertices_of(body, bounds.centre());
  const Layout layout(ground, bounds, count);
  const Rotation frame = tilt_by(tilt);
  std::vector<Instance> instances;
  for (std::uint32_t i = 0; i < layout.sheets(); ++i) {
    instances.push_back(place(1, frame, {}, multiply(frame, layout.sheet(i))));
  }
  Random random(seed.seed);
  for (const auto& [stance, centre, print] : strew(layout, bounds, count, random)) {
    const double down = clearance(vertices, stance, ground, centre, 0.5 * bounds.diagonal());
    const Vector at = {centre[0], centre[1], -down - kSink * bounds.diagonal()};
    instances.push_back(place(0, multiply(frame, stance), bounds.centre(), multiply(frame, at)));
  }
  move(instances, seed.offset);
  return instances;
}

}  // namespace tandem::bench
