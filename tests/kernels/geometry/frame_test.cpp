// The float32 stage in a's frame: right whenever it decides, and its bound above every error.
#include "kernels/geometry/frame_test.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>
#include <string>

#include "kernels/geometry/box_test.h"
#include "kernels/query_scenes.h"
#include "kernels/triangle_families.h"

namespace tandem::test {
namespace {

// Volumes of float64 points with as good as no rounding: 113 bits against the 24 that are looked at.
#ifdef __SIZEOF_FLOAT128__
__extension__ using Wide = __float128;
#else
using Wide = long double;
#endif

/// Two stored triangles and where they stand.
struct Stored {
  float a[3][3], b[3][3];
  Pose pose_a, pose_b;
};

std::string text(const Stored& s) {
  std::string out;
  char line[300];
  const auto add = [&](double x, double y, double z) {
    std::snprintf(line, sizeof line, "  {%a, %a, %a},\n", x, y, z);
    out += line;
  };
  for (const auto* t : {&s.a, &s.b}) {
    for (const auto& p : *t) add(p[0], p[1], p[2]);
  }
  for (const auto* pose : {&s.pose_a, &s.pose_b}) {
    for (const auto& row : pose->rotation) add(row[0], row[1], row[2]);
    add(pose->translation[0], pose->translation[1], pose->translation[2]);
  }
  return out;
}

bool storable(const Stored& s) {
  bool good = true;
  for (int i = 0; i < 9; ++i) {
    good =
        good && std::fabs((&s.a[0][0])[i]) <= kMaxCoordinate && std::fabs((&s.b[0][0])[i]) <= kMaxCoordinate;
  }
  return good;
}

TreeExtent extent_around(const float (&t)[3][3]) {
  Position lo, hi;
  for (int k = 0; k < 3; ++k) {
    lo[k] = std::min({t[0][k], t[1][k], t[2][k]});
    hi[k] = std::max({t[0][k], t[1][k], t[2][k]});
  }
  return extent_of(enclose(lo, hi));
}

using Corners = frame::Point<float>[3];

/// Holds what the stage is given, made as a query makes it of trees that hold these triangles alone.
struct Framed {
  RelativePose b_in_a;
  float error;
  Corners a, b;
  TrianglePair posed;
  bool in_range;

  explicit Framed(const Stored& s) {
    const TreeExtent extent_a = extent_around(s.a), extent_b = extent_around(s.b);
    in_range = relative_pose(s.pose_a, extent_a, s.pose_b, extent_b, b_in_a) == RelativePoseStatus::kOk;
    error = in_range ? frame_error(b_in_a, extent_a, extent_b) : INFINITY;
    for (int i = 0; i < 3; ++i) {
      std::copy_n(s.a[i], 3, a[i].x);
      for (int k = 0; k < 3; ++k) b[i].x[k] = box_terms::posed_centre(b_in_a, k, s.b[i]);
      apply(s.pose_a, s.a[i][0], s.a[i][1], s.a[i][2], posed.a[i]);
      apply(s.pose_b, s.b[i][0], s.b[i][1], s.b[i][2], posed.b[i]);
    }
  }
};

/// Posed as any_rotation() has it, or as the identity.
Pose any_pose(RandomPoses& random, double far) {
  Pose pose = random.below(4) == 0 ? kIdentityPose : any_rotation(random);
  for (double& x : pose.translation) x = random.below(4) == 0 ? 0 : random.symmetric(far);
  return pose;
}

/// The stored corners whose image is near the points: the transpose is the inverse but for 1e-6.
bool store(const Pose& pose, const double (&points)[3][3], float (&out)[3][3]) {
  bool good = true;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      double x = 0;
      for (int j = 0; j < 3; ++j) x += pose.rotation[j][k] * (points[i][j] - pose.translation[j]);
      good = good && std::fabs(x) <= 3e38;
      out[i][k] = good ? static_cast<float>(x) : 0;
    }
  }
  return good;
}

/// A pair of float64 triangles as stored triangles, whose distance changes by their rounding.
bool store(RandomPoses& random, TrianglePair pair, Stored& out) {
  constexpr double kScales[] = {1, 1, 1, 1e-12, 1e-9, 1e-5, 0x1p-40, 1e3, 1e6, 1e9};
  constexpr double kFar[] = {0, 0, 1, 10, 1e3, 1e7, 1e12};
  const double scale = kScales[random.below(std::size(kScales))],
               far = kFar[random.below(std::size(kFar))] * scale;
  out.pose_a = any_pose(random, far);
  out.pose_b = random.below(3) == 0 ? out.pose_a : any_pose(random, far);
  // Far from the origin together, where the distance stays what it is.
  const bool together = random.below(2) == 0;
  if (together) std::copy_n(out.pose_a.translation, 3, out.pose_b.translation);
  for (auto* t : {&pair.a, &pair.b}) {
    for (auto& point : *t) {
      for (int k = 0; k < 3; ++k) point[k] = point[k] * scale + (together ? out.pose_a.translation[k] : 0);
    }
  }
  return store(out.pose_a, pair.a, out.a) && store(out.pose_b, pair.b, out.b) && storable(out);
}

struct Tally {
  long pairs = 0, contacts = 0, decided = 0;
};

void expect_right(const Stored& stored, Tally& tally) {
  const Framed framed(stored);
  const auto verdicts = frame::decide<true>(framed.a, framed.b, framed.error);
  ++tally.pairs;
  ASSERT_FALSE(verdicts.contact && verdicts.undecided);
  if (verdicts.undecided) return;
  ASSERT_TRUE(std::isfinite(framed.error));
  ++tally.decided;
  tally.contacts += verdicts.contact;
  ASSERT_EQ(verdicts.contact, decide_exact(framed.posed) == Verdict::contact) << text(stored);
}

void print(const char* name, const Tally& tally) {
  const double pairs = static_cast<double>(tally.pairs), decided = static_cast<double>(tally.decided);
  std::printf("%-18s %ld pairs, decided %.3f %%, of which contacts %.1f %%\n", name, tally.pairs,
              100 * decided / pairs, 100.0 * static_cast<double>(tally.contacts) / std::max(decided, 1.0));
}

class FrameFamilies : public testing::TestWithParam<TriangleFamily> {};

INSTANTIATE_TEST_SUITE_P(All, FrameFamilies, testing::ValuesIn(triangle_families()),
                         [](const auto& test) { return test.param.identifier(); });

TEST_P(FrameFamilies, AreDecidedRightlyOrNotAtAll) {
  RandomPoses random(11);
  Tally tally;
  const int count = trials(10'000, 500);
  for (int i = 0; i < count && !HasFatalFailure(); ++i) {
    Stored stored;
    if (store(random, GetParam().make(random.engine()), stored)) expect_right(stored, tally);
  }
  print(GetParam().name, tally);
  EXPECT_GT(tally.pairs, count / 5);
}

// --- Pairs that nearly touch, at the scale of the bound.

using Vector = double[3];

/// Moves b so that its point q lies off p by `gap` along `direction`, then rounds it to stored corners.
void shift(double (&b)[3][3], const Vector& p, const Vector& q, const Vector& direction, double gap) {
  double length = 0;
  for (int k = 0; k < 3; ++k) length = std::hypot(length, direction[k]);
  for (auto& corner : b) {
    for (int k = 0; k < 3; ++k) corner[k] += p[k] - q[k] + (length > 0 ? gap / length * direction[k] : 0);
  }
}

void cross(const Vector& p, const Vector& q, const Vector& r, const Vector& s, Vector& out) {
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    out[k] = (q[i] - p[i]) * (s[j] - r[j]) - (q[j] - p[j]) * (s[i] - r[i]);
  }
}

void on_segment(const Vector& p, const Vector& q, double s, Vector& out) {
  for (int k = 0; k < 3; ++k) out[k] = p[k] + s * (q[k] - p[k]);
}

/// A corner of one over the face of the other, or an edge over an edge, with a gap or an overlap of some
/// ulps; now and then slivers, or triangles nearly in one plane.
bool nearly_touching(RandomPoses& random, Stored& out) {
  TrianglePair pair = generic_pair(random.engine());
  if (random.below(4) == 0) {  // thin
    const double width = std::exp2(random.uniform(-24, -4));
    for (int k = 0; k < 3; ++k) {
      pair.a[2][k] = pair.a[0][k] + 0.4 * (pair.a[1][k] - pair.a[0][k]) + width * random.symmetric(1);
    }
  }
  if (random.below(4) == 0) {  // nearly in one plane
    const double slope = std::exp2(random.uniform(-24, -2));
    for (auto* t : {&pair.a, &pair.b}) {
      for (auto& corner : *t) corner[2] = 0.5 + slope * corner[2];
    }
  }
  if (random.below(4) == 0) {  // of unequal size
    const double size = std::exp2(random.uniform(-20, 0));
    for (auto& corner : pair.b) {
      for (double& x : corner) x *= size;
    }
  }
  Vector p, q, direction;
  const double gap = (random.below(2) == 0 ? 1 : -1) * std::exp2(random.uniform(-26, -10));
  if (random.below(2) == 0) {
    on_segment(pair.a[1], pair.a[2], random.uniform(0, 1), p);
    on_segment(pair.a[0], p, random.uniform(0, 1), p);
    std::copy_n(pair.b[0], 3, q);
    cross(pair.a[0], pair.a[1], pair.a[0], pair.a[2], direction);
  } else {
    on_segment(pair.a[0], pair.a[1], random.uniform(0, 1), p);
    on_segment(pair.b[0], pair.b[1], random.uniform(0, 1), q);
    cross(pair.a[0], pair.a[1], pair.b[0], pair.b[1], direction);
  }
  shift(pair.b, p, q, direction, gap);
  return store(random, pair, out);
}

TEST(FrameTest, DecidesPairsThatNearlyTouchRightlyOrNotAtAll) {
  RandomPoses random(12);
  Tally tally;
  const int count = trials(250'000, 160);
  for (int i = 0; i < count && !HasFatalFailure(); ++i) {
    Stored stored;
    if (nearly_touching(random, stored)) expect_right(stored, tally);
  }
  print("nearly touching", tally);
  EXPECT_GT(tally.decided, tally.pairs / 10);
  EXPECT_LT(tally.decided, tally.pairs - tally.pairs / 10);
  EXPECT_GT(tally.contacts, tally.decided / 100);
}

/// Values of the smallest and the largest magnitude; what is beyond 2^28 must stay undecided.
TEST(FrameTest, DecidesNothingBeyondItsRange) {
  RandomPoses random(13);
  Tally tally;
  for (int i = 0; i < trials(20'000, 100) && !HasFatalFailure(); ++i) {
    TrianglePair pair = generic_pair(random.engine());
    const double scale = std::exp2(random.uniform(-149, 127));
    Stored stored = {{}, {}, any_pose(random, scale), any_pose(random, scale)};
    for (auto* t : {&pair.a, &pair.b}) {
      for (auto& corner : *t) {
        for (double& x : corner) x *= scale;
      }
    }
    if (!store(stored.pose_a, pair.a, stored.a) || !store(stored.pose_b, pair.b, stored.b)) continue;
    if (storable(stored)) expect_right(stored, tally);
  }
  print("every magnitude", tally);
  EXPECT_GT(tally.decided, 0);
}

TEST(FrameTest, LeavesUndecidedWhereTheErrorIsInfinite) {
  const Corners a = {{{0, 0, 0}}, {{1, 0, 0}}, {{0, 1, 0}}}, b = {{{0, 0, 9}}, {{1, 0, 9}}, {{0, 1, 9}}};
  EXPECT_FALSE(frame::decide<true>(a, b, 1e-6f).undecided);
  EXPECT_TRUE(frame::decide<true>(a, b, INFINITY).undecided);
}

/// Ordinary candidates: what the speed of queries rests on.
TEST(FrameTest, DecidesNearlyAllGenericPairs) {
  RandomPoses random(14);
  Tally tally;
  for (int i = 0; i < 50'000 && !HasFatalFailure(); ++i) {
    const Pose pose_a = any_pose(random, 1), pose_b = any_pose(random, 1);
    Stored stored = {{}, {}, pose_a, pose_b};
    const TrianglePair pair = generic_pair(random.engine());
    ASSERT_TRUE(store(pose_a, pair.a, stored.a) && store(pose_b, pair.b, stored.b));
    expect_right(stored, tally);
  }
  print("generic", tally);
  EXPECT_GT(tally.decided, tally.pairs - tally.pairs / 1000);
}

// --- The bound, attacked.

/// det(q - p, r - p, s - p).
Wide volume(const double* p, const double* q, const double* r, const double* s) {
  Wide d[3][3];
  const double* point[] = {q, r, s};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) d[i][k] = static_cast<Wide>(point[i][k]) - static_cast<Wide>(p[k]);
  }
  return d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) -
         d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
         d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
}

/// Volumes: a plane of a against a corner of b, one of b against a corner of a, one of two edges, and those
/// with one bound for three corners.
enum class Kind { plane_of_a, plane_of_b, edges, corners_of_b, corners_of_a };

void PrintTo(Kind kind, std::ostream* out) {
  constexpr const char* kNames[] = {"plane_of_a", "plane_of_b", "edges", "corners_of_b", "corners_of_a"};
  *out << kNames[static_cast<int>(kind)];
}

double share_of_bound(float computed, Wide exact, float bound) {
  return std::fabs(static_cast<double>(static_cast<Wide>(computed) - exact)) / static_cast<double>(bound);
}

/// |computed - exact volume of the images| / bound, for one volume of the given kind, or the most of three; 0
/// where there is none.
double share_of_bound(const Stored& stored, Kind kind) {
  const Framed framed(stored);
  if (!std::isfinite(framed.error)) return 0;
  // The float64 inverse n by which the proof maps posed points: their volumes grow by det n.
  double n[3][3];
  relative_pose_detail::invert(stored.pose_a.rotation, n);
  const double zero[3] = {};
  const Wide growth = volume(zero, n[0], n[1], n[2]);
  using Plane = frame::Plane<float, true>;
  frame::Volume<float> computed;
  Wide exact;
  const auto &a = framed.a, &b = framed.b;
  const auto &pa = framed.posed.a, &pb = framed.posed.b;
  switch (kind) {
    case Kind::plane_of_a:
      computed = Plane(a[0], a[1], a[2], framed.error).volume(b[0], framed.error);
      exact = volume(pa[0], pa[1], pa[2], pb[0]);
      break;
    case Kind::plane_of_b:
      computed = Plane(b[0], b[1], b[2], framed.error).volume(a[0], framed.error);
      exact = volume(pb[0], pb[1], pb[2], pa[0]);
      break;
    case Kind::edges:
      computed = Plane(a[0], b[0], a[1], framed.error).volume(b[1], framed.error);
      exact = volume(pa[0], pb[0], pa[1], pb[1]);
      break;
    default: {
      const frame::Edges<float> edges_a(a), edges_b(b);
      const auto w = frame::difference(b[0], a[0]);
      const bool of_b = kind == Kind::corners_of_b;
      const auto volumes = of_b ? frame::corner_volumes(edges_a, edges_b, w, 1, framed.error)
                                : frame::corner_volumes(edges_b, edges_a, w, -1, framed.error);
      double most = 0;
      for (int i = 0; i < 3; ++i) {
        exact = of_b ? volume(pa[0], pa[1], pa[2], pb[i]) : volume(pb[0], pb[1], pb[2], pa[i]);
        most = std::max(most, share_of_bound(volumes.value[i], growth * exact, volumes.bound));
      }
      return most;
    }
  }
  return share_of_bound(computed.value, growth * exact, computed.bound);
}

/// One number changed by a little, or by a lot.
Stored changed(RandomPoses& random, const Stored& from) {
  Stored to = from;
  const std::uint64_t edits = 1 + random.below(3);
  for (std::uint64_t i = 0; i < edits; ++i) {
    const double step = std::ldexp(random.symmetric(1), -static_cast<int>(random.below(28)));
    switch (random.below(8)) {
      case 0:
        (&to.pose_a.translation[0])[random.below(3)] += step;
        break;
      case 1:
        (&to.pose_b.translation[0])[random.below(3)] += step;
        break;
      case 2:
      case 3: {
        // Turned about an axis.
        Pose& pose = random.below(2) == 0 ? to.pose_a : to.pose_b;
        const std::uint64_t i0 = random.below(3), i1 = (i0 + 1) % 3;
        const double c = std::cos(step), s = std::sin(step);
        for (int j = 0; j < 3; ++j) {
          const double x = pose.rotation[i0][j], y = pose.rotation[i1][j];
          pose.rotation[i0][j] = c * x - s * y;
          pose.rotation[i1][j] = s * x + c * y;
        }
        break;
      }
      default: {
        float& x = (random.below(2) == 0 ? &to.a[0][0] : &to.b[0][0])[random.below(9)];
        x = random.below(12) == 0 ? 0 : static_cast<float>(x + step);
      }
    }
  }
  return to;
}

/// Numbers a little above a power of two, where a rounding costs most, and zeros, which leave fewer terms for
/// the errors to cancel in.
Stored structured_start(RandomPoses& random) {
  Stored stored = {{}, {}, any_pose(random, 1), any_pose(random, 1)};
  for (auto* t : {&stored.a, &stored.b}) {
    for (auto& corner : *t) {
      for (float& x : corner) {
        x = random.below(3) == 0 ? 0 : static_cast<float>(1 + std::exp2(random.uniform(-24, -2)));
        if (random.below(2) == 0) x = -x;
      }
    }
  }
  return stored;
}

/// Far away, where posed vertices are rounded by as much as the bound allows for, a corner of b close to one
/// of a.
Stored far_start(RandomPoses& random) {
  Stored stored = structured_start(random);
  for (Pose* pose : {&stored.pose_a, &stored.pose_b}) {
    *pose = quarter_turn(random);
    for (double& x : pose->translation) x = random.below(2) == 0 ? 0x1p20 * (1 + 0x1p-20) : 0;
  }
  const float close[3] = {0, 0, static_cast<float>(random.symmetric(0x1p-24))};
  Vector on_a;
  apply(stored.pose_a, stored.a[0][0] + close[0], stored.a[0][1], stored.a[0][2] + close[2], on_a);
  double corners[3][3];
  for (auto& corner : corners) std::copy_n(on_a, 3, corner);
  (void)store(stored.pose_b, corners, stored.b);
  return stored;
}

Stored any_start(RandomPoses& random) {
  for (;;) {
    Stored stored;
    const bool got = random.below(2) == 0
                         ? nearly_touching(random, stored)
                         : store(random, triangle_families()[random.below(8)].make(random.engine()), stored);
    if (got && std::isfinite(Framed(stored).error)) return stored;
  }
}

/// A random walk uphill from many starts.
double largest_share(Kind kind, int starts, int steps) {
  RandomPoses random(15);
  double largest = 0;
  Stored worst{};
  for (int start = 0; start < starts; ++start) {
    Stored best = start % 3 == 0   ? structured_start(random)
                  : start % 3 == 1 ? far_start(random)
                                   : any_start(random);
    double value = share_of_bound(best, kind);
    for (int step = 0; step < steps; ++step) {
      const Stored next = changed(random, best);
      if (!is_rigid(next.pose_a) || !is_rigid(next.pose_b)) continue;
      const double reached = share_of_bound(next, kind);
      if (reached >= value) {
        best = next;
        value = reached;
      }
    }
    if (value > largest) {
      largest = value;
      worst = best;
    }
  }
  std::printf("%s: errors reach %.4f of the bound\n%s", testing::PrintToString(kind).c_str(), largest,
              text(worst).c_str());
  return largest;
}

/// Half of the bound would not hold, or the search would be too weak to show it.
class FrameBound : public testing::TestWithParam<Kind> {};

TEST_P(FrameBound, HoldsUnderAttack) {
  const double share = largest_share(GetParam(), trials(60, 5), trials(3000, 10));
  EXPECT_LT(share, 1);
  EXPECT_GT(share, GetParam() >= Kind::corners_of_b ? 0.4 : 0.5);
}

INSTANTIATE_TEST_SUITE_P(All, FrameBound,
                         testing::Values(Kind::plane_of_a, Kind::plane_of_b, Kind::edges, Kind::corners_of_b,
                                         Kind::corners_of_a),
                         testing::PrintToStringParamName());

/// Posing rounds by as much as it can: corners of a go up by half a last bit, one of b goes down by as much,
/// and what is apart as stored touches as posed. The bound has next to nothing to spare there.
TEST(FrameTest, BoundIsReachedWherePosingRoundsMost) {
  const float half = 0x1p-17f * (1 - 0x1p-10f);
  const Pose pose = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0x1p36 + 0x1p-16}};
  const Stored stored = {{{0, 0, -half}, {1, 0, -half}, {0, 1, -half}},
                         {{0, 0, half}, {0.25f, 0, 0x1p-10f}, {0, 0.25f, 0x1p-10f}},
                         pose,
                         pose};
  const double share = share_of_bound(stored, Kind::plane_of_a);
  std::printf("the error reaches %.4f of the bound\n", share);
  EXPECT_GT(share, 0.99);
  EXPECT_LT(share, 1);
  const Framed framed(stored);
  EXPECT_EQ(decide_exact(framed.posed), Verdict::contact);
  EXPECT_TRUE(frame::decide<true>(framed.a, framed.b, framed.error).undecided);
}

/// This does without an uphill walk, so it has time for many more inputs.
TEST(FrameTest, BoundHoldsForPairsThatNearlyTouchAndForAllFamilies) {
  RandomPoses random(16);
  double largest = 0;
  for (int i = 0; i < trials(20'000, 500) && !HasFatalFailure(); ++i) {
    const Stored stored = any_start(random);
    for (const Kind kind : {Kind::plane_of_a, Kind::plane_of_b, Kind::edges}) {
      const double share = share_of_bound(stored, kind);
      largest = std::max(largest, share);
      ASSERT_LT(share, 1) << text(stored);
    }
  }
  std::printf("errors reach %.4f of the bound\n", largest);
}

}  // namespace
}  // namespace tandem::test
