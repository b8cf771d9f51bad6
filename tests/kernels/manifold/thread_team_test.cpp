// Teams of threads make manifolds as warps and blocks of a GPU do. All must come to each barrier from the
// same line, and find the bytes of one thread.
#include <atomic>
#include <barrier>
#include <bit>
#include <cstring>
#include <functional>
#include <memory>
#include <source_location>
#include <thread>

#include "kernels/manifold/shape.h"
#include "kernels/manifold/triangle_meeting.h"
#include "made_patches.h"
#include "manifold_scene.h"

namespace tandem::test {
namespace {

/// Several threads wait here for each other, and tell each other something.
class Meeting {
 public:
  explicit Meeting(std::uint32_t threads) : barrier_(threads), told_(threads), line_(threads) {}

  /// Waits for all. Counts those that come from another line than the first thread.
  void wait(std::uint32_t rank, const std::source_location& from) {
    line_[rank] = from.line();
    barrier_.arrive_and_wait();
    if (line_[rank] != line_[0]) ++strays_;
    barrier_.arrive_and_wait();
  }
  /// Tells the others a value. Result: read(said), where said(i) is what thread i tells.
  template <typename T, typename Read>
  T exchange(std::uint32_t rank, T value, const std::source_location& from, const Read& read) {
    static_assert(sizeof(T) <= sizeof(std::uint64_t));
    std::memcpy(&told_[rank], &value, sizeof value);
    wait(rank, from);
    const T out = read([&](std::size_t i) {
      T said;
      std::memcpy(&said, &told_[i], sizeof said);
      return said;
    });
    wait(rank, from);
    return out;
  }
  /// Returns of(...) of what all tell.
  template <typename T, typename Of>
  T gather(std::uint32_t rank, T value, const std::source_location& from, const Of& of) {
    return exchange(rank, value, from, [&](const auto& said) {
      T out = said(0);
      for (std::size_t i = 1; i < told_.size(); ++i) out = of(out, said(i));
      return out;
    });
  }
  int strays() const { return strays_; }

 private:
  std::barrier<> barrier_;
  std::vector<std::uint64_t> told_;
  std::vector<std::uint32_t> line_;
  std::atomic<int> strays_ = 0;
};

using Here = std::source_location;

/// One of the threads of a team. See team.h.
class ThreadTeam {
 public:
  static constexpr bool kHasWarps = true;
  static constexpr std::uint32_t kLanes = 2;  // of a warp

  struct Shared {
    explicit Shared(std::uint32_t threads) : all(threads) {
      for (std::uint32_t i = 0; i < threads; i += kLanes) warps.push_back(std::make_unique<Meeting>(kLanes));
    }
    Meeting all;
    std::vector<std::unique_ptr<Meeting>> warps;
  };

  ThreadTeam(Shared& shared, std::uint32_t rank, std::uint32_t size)
      : shared_(shared), rank_(rank), size_(size) {}

  std::uint32_t rank() const { return rank_; }
  std::uint32_t size() const { return size_; }
  void sync(Here from = Here::current()) const { shared_.all.wait(rank_, from); }

  template <typename T>
  T sum(T value, Here from = Here::current()) const {
    return shared_.all.gather(rank_, value, from, std::plus<T>());
  }
  template <typename T>
  T least(T value, Here from = Here::current()) const {
    return shared_.all.gather(rank_, value, from, [](T x, T y) { return y < x ? y : x; });
  }
  template <typename T>
  T greatest(T value, Here from = Here::current()) const {
    return shared_.all.gather(rank_, value, from, [](T x, T y) { return x < y ? y : x; });
  }
  template <typename T, int kCount>
  void sums(T (&values)[kCount], Here from = Here::current()) const {
    for (T& value : values) value = sum(value, from);
  }
  template <typename T, int kCount>
  void least_ones(T (&values)[kCount], Here from = Here::current()) const {
    for (T& value : values) value = least(value, from);
  }
  template <typename T, int kCount>
  void greatest_ones(T (&values)[kCount], Here from = Here::current()) const {
    for (T& value : values) value = greatest(value, from);
  }
  bool any(bool value, Here from = Here::current()) const { return greatest<int>(value ? 1 : 0, from) != 0; }

  static std::uint32_t load(const std::uint32_t& at) { return __atomic_load_n(&at, __ATOMIC_RELAXED); }
  static void store(std::uint32_t& at, std::uint32_t value) {
    __atomic_store_n(&at, value, __ATOMIC_RELAXED);
  }
  static std::uint32_t concurrent_load(std::uint32_t& at) { return load(at); }
  static void concurrent_store(std::uint32_t& at, std::uint32_t value) { store(at, value); }
  static void set_bits(std::uint32_t& at, std::uint32_t bits) {
    __atomic_fetch_or(&at, bits, __ATOMIC_RELAXED);
  }
  static std::uint32_t add(std::uint32_t& at, std::uint32_t value) {
    return __atomic_fetch_add(&at, value, __ATOMIC_RELAXED);
  }
  static std::uint32_t compare_and_swap(std::uint32_t& at, std::uint32_t expected, std::uint32_t value) {
    __atomic_compare_exchange_n(&at, &expected, value, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED);
    return expected;
  }

  std::uint32_t lane() const { return rank_ % kLanes; }
  std::uint32_t ballot(bool value, Here from = Here::current()) const {
    return warp().gather(lane(), value ? 1u << lane() : 0u, from, std::bit_or<std::uint32_t>());
  }
  static std::uint32_t first_bit(std::uint32_t bits) {
    return static_cast<std::uint32_t>(std::countr_zero(bits));
  }
  template <typename T>
  T from_lane(T value, std::uint32_t of, Here from = Here::current()) const {
    return warp().exchange(lane(), value, from, [&](const auto& said) { return said(of); });
  }
  void walk_lines(const manifold::LineQuestions& questions, std::uint32_t count,
                  Here from = Here::current()) const {
    sync(from);
    for (std::uint32_t i = rank_; i < count; i += size_) manifold::answer_line(questions, i);
    sync(from);
  }

 private:
  Meeting& warp() const { return *shared_.warps[rank_ / kLanes]; }

  Shared& shared_;
  std::uint32_t rank_, size_;
};

/// Makes the patches of a pair step by step, as a GPU does, by all threads of a team.
class TeamOfThreads {
 public:
  TeamOfThreads(const manifold::BodyPair& bodies, std::span<const Contact> contacts)
      : bodies_(bodies),
        pieces_(contacts.size()),
        normals_(6 * contacts.size() + 1),
        words_((3 + manifold::PieceMemory::kTableWords) * contacts.size() + 2),
        patches_(contacts.size()) {
    // The table comes first: it has float64 numbers for a while.
    std::uint32_t* const word = words_.data() + manifold::PieceMemory::kTableWords * contacts.size();
    const std::size_t count = contacts.size();
    memory_ = {pieces_.data(), normals_.data(), word, word + count, word + 2 * count, words_.data()};
    for (const Contact& contact : contacts) {
      const manifold::WorldTriangle a = bodies.a.triangle(contact.triangle_a),
                                    b = bodies.b.triangle(contact.triangle_b);
      manifold::Meeting meeting;
      manifold::meet(a, b, bodies.tolerance(), meeting);
      if (meeting.kind == manifold::MeetingKind::none) continue;
      manifold::write_piece(memory_, bounds_.pieces++, contact, a.normal, b.normal, meeting);
      bounds_.add(meeting);
    }
  }

  /// strays: how often a thread came to another barrier than the first one.
  PatchesOfPair make(std::uint32_t threads, int& strays) {
    ThreadTeam::Shared shared(threads);
    std::vector<std::thread> others;
    for (std::uint32_t rank = 1; rank < threads; ++rank)
      others.emplace_back([&, rank] { make(ThreadTeam(shared, rank, threads)); });
    make(ThreadTeam(shared, 0, threads));
    for (std::thread& other : others) other.join();
    strays = shared.all.strays();
    for (const auto& warp : shared.warps) strays += warp->strays();
    return sorted({{patches_.begin(), patches_.begin() + made_}, segments_, ambiguous_touches_});
  }

 private:
  void make(const ThreadTeam& team) {
    manifold::CurveFinder<ThreadTeam> finder(team, bodies_, memory_);
    manifold::PieceSummary summary = finder.find_among(bounds_, outline_.next);
    if (team.rank() == 0) segments_ = summary.segments;
    summary.curves = join_curves(team, summary);
    manifold::ManifoldMaker<ThreadTeam> maker(team, bodies_, memory_, summary, state_);
    for (std::uint32_t region = 0; region < summary.curves; ++region) {
      maker.begin(region, outline_, search_);
      maker.outline(region, outline_, search_);
      if (state_.kind == manifold::PatchKind::overlap || state_.kind == manifold::PatchKind::deep)
        measure(team, maker, region);
      if (team.rank() == 0) ambiguous_touches_ += state_.kind == manifold::PatchKind::ambiguous;
      maker.finish(region, kOptions, choice_, [&] { return &patches_[made_++]; });
      team.sync();
    }
  }

  // On a GPU, each step is a kernel.
  std::uint32_t join_curves(const ThreadTeam& team, const manifold::PieceSummary& summary) {
    using Finder = manifold::RegionFinder<ThreadTeam>;
    if (!Finder::may_join(summary)) return summary.curves;
    Finder finder(team, bodies_, memory_, summary, &regions_);
    for (std::uint32_t c = 0; c < summary.curves; ++c) finder.begin(c);
    for (std::uint32_t c = 0; c < summary.curves; ++c) {
      for (int k = 0; k < Finder::kNeighbours; ++k) finder.try_to_join(c, k);
    }
    team.sync();
    return finder.join();
  }

  void measure(const ThreadTeam& team, manifold::ManifoldMaker<ThreadTeam>& maker, std::uint32_t region) {
    const bool is_deep = state_.kind == manifold::PatchKind::deep;
    team.sync();  // all have read it
    maker.sound(search_, depths_);
    if (!is_deep) {
      const manifold::OverlapLine line = maker.line_along(search_, 0, kOptions, depths_);
      return maker.end_overlap(line, depths_.lines);
    }
    for (int i = 0; i < search_.directions; ++i) {
      const manifold::OverlapLine line = maker.line_along(search_, i, kOptions, depths_);
      team.sync();
      if (team.rank() == 0) {
        found_.along[i] = line;
        search_.enough = std::min(search_.enough, manifold::enough_for_others(line));
      }
      team.sync();
    }
    maker.end_deep(region, search_, found_, outline_, depths_.lines);
  }

  static constexpr manifold::PatchOptions kOptions = {static_cast<int>(kMostManifoldPoints), false};

  const manifold::BodyPair bodies_;
  std::vector<manifold::Piece> pieces_;
  std::vector<float> normals_;
  std::vector<std::uint32_t> words_;
  manifold::PieceMemory memory_;
  manifold::PieceBounds bounds_;

  // What the threads share.
  manifold::PatchState state_;
  manifold::RegionMemory regions_;
  manifold::OutlineMemory outline_;
  manifold::SearchMemory depths_;
  manifold::DepthSearch search_;
  manifold::DeepLines found_;
  manifold::ChoiceMemory choice_;
  std::vector<Patch> patches_;
  std::ptrdiff_t made_ = 0;
  std::uint64_t segments_ = 0, ambiguous_touches_ = 0;
};

// Compares a team of four threads with one thread. Result: how many patches there are.
std::size_t compare_teams(ManifoldScene& scene) {
  scene.find();
  std::size_t patches = 0;
  for_each_pair(scene.assets.views(), scene.posed, scene.query,
                [&](const manifold::BodyPair& bodies, std::span<const Contact> contacts) {
                  const PatchesOfPair plain = patches_of(manifold::OneThread(), bodies, contacts);
                  patches += plain.patches.size();
                  int strays = 0;
                  expect_same(plain, TeamOfThreads(bodies, contacts).make(4, strays));
                  EXPECT_EQ(strays, 0);
                });
  return patches;
}

TEST(ThreadTeams, OfCowsDeepInEachOther) {
  RandomPoses random(3);
  ManifoldScene scene;
  scene.add_shape(project_mesh("cow_1500.obj"));
  scene.add_body(0, kIdentityPose);
  scene.add_body(0, any_motion(random, 0.3));
  scene.add_body(0, any_motion(random, 0.6));
  EXPECT_GT(compare_teams(scene), 2u);
}

TEST(ThreadTeams, OfBodiesOfManyKinds) {
  RandomPoses random(4);
  ManifoldScene scene;
  for (const Mesh& mesh :
       {cube(0.3f, 2), tetrahedron(), sphere(0.4, 2), pipe(12, 0.2, 0.4, 0.4f), sheet(1, 3)})
    scene.add_shape(mesh);
  for (std::uint32_t i = 0; i < 5; ++i) scene.add_body(i, any_motion(random, 0.3));
  EXPECT_GT(compare_teams(scene), 5u);
}

// Ends are ambiguous there, so curves are connected by corners.
TEST(ThreadTeams, OfTies) {
  ManifoldScene scene;
  scene.add_shape(cube(0.5f, 2));
  scene.add_body(0, kIdentityPose);
  scene.add_body(0, kIdentityPose);
  scene.add_body(0, shift(0.5, 0.25, 1));
  EXPECT_GE(compare_teams(scene), 3u);
}

}  // namespace
}  // namespace tandem::test
