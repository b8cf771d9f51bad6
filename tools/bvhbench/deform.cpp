#include "deform.h"

#include <algorithm>
#include <array>

#include "bvhbench/engines/registry.h"
#include "rebuilt_shape.h"
#include "timed_work.h"

namespace tandem::bench {
namespace {

using TriangleContacts = std::vector<TriangleContact>;

// Bodies a and b, and a triangle of each.
using BodyContact = std::array<std::uint32_t, 4>;

template <typename Work>
double seconds_by(std::uint32_t threads, const Work& work) {
  if (threads == 1) return seconds_of(work);
  const SavedFloatingPoint saved;
  Stopwatch watch;
  work();
  return watch.lap();
}

void note_least(double& least, std::uint32_t repeat, double seconds) {
  least = repeat == 0 ? seconds : std::min(least, seconds);
}

FrameOfShapes read_frame(const BendingScene& scene, std::uint32_t number) {
  FrameOfShapes frame;
  for (const std::uint32_t shape : scene.bending) frame.push_back({shape, scene.positions(shape, number)});
  return frame;
}

/// An engine whose shapes follow the frames.
class Follower {
 public:
  Follower(const BendingScene& scene, const DeformOptions& options, std::string_view engine)
      : scene_(scene),
        options_(options),
        on_gpu_(engine == "tandem-cuda"),
        own_(on_gpu_ || engine == "tandem") {
    engine_ = make_engine(
        engine, ContactOptions{.self_pairs = options.self_pairs, .leave_out_rings = options.leave_out_rings});
    engine_->set_threads(options.threads);
    engine_->set_filter(scene.filter);
    place(scene.shapes);
  }

  Engine& engine() { return *engine_; }
  const TriangleContacts& contacts() const { return contacts_; }
  const std::vector<ObjectPair>& pairs() const { return pairs_; }

  // Starts anew with these shapes, as they are.
  void place(std::span<const AssetView> shapes) {
    const SavedFloatingPoint saved;
    engine_->set_shapes(shapes);
    engine_->update(scene_.instances);
  }

  // Result: the largest looseness of the shapes.
  std::optional<double> follow(const FrameOfShapes& frame, std::uint32_t number) {
    return deform(*engine_, frame, scene_.path, number);
  }

  // Asks about the given pairs; without any, Tandem finds them itself.
  void ask(std::span<const ObjectPair> pairs) {
    if (own_ && scene_.given_pairs == nullptr) pairs = engine_->find_pairs();
    engine_->query(pairs);
    if (own_) pairs_.assign(pairs.begin(), pairs.end());
  }

  // Times the second of two queries, for which the caches of all peers are in the same state.
  void time_query(FrameWork& work, std::uint32_t repeat, std::span<const ObjectPair> pairs) {
    const SavedFloatingPoint saved;
    ask(pairs);
    note_least(work.query_seconds, repeat, seconds_by(options_.threads, [&] { ask(pairs); }));
  }

  // Adds to the work what the last query found.
  void take_answer(FrameWork& work) {
    engine_->contacts(contacts_);
    std::sort(contacts_.begin(), contacts_.end());
    work.contacts = contacts_.size();
    if (own_) work.block_pairs = engine_->counters().block_pairs;
  }

  FrameWork work(const FrameOfShapes& frame, std::uint32_t number, std::span<const ObjectPair> pairs) {
    FrameWork work;
    for (std::uint32_t i = 0; i < options_.repeats; ++i) {
      const double seconds = seconds_by(options_.threads, [&] { work.looseness = follow(frame, number); });
      note_least(work.update_seconds, i, on_gpu_ ? engine_->times().update : seconds);
      if (!on_gpu_) time_query(work, i, pairs);
    }
    if (on_gpu_)
      ask_gpu(work);
    else
      take_answer(work);
    return work;
  }

 private:
  void ask_gpu(FrameWork& work) {
    TimedAnswer answer = engine_->time_query({scene_.given_pairs, options_.repeats});
    work.query_seconds = *std::min_element(answer.whole.begin(), answer.whole.end());
    work.contacts = answer.contacts.size();
    work.block_pairs = engine_->counters().block_pairs;
    contacts_ = std::move(answer.contacts);
    pairs_ = std::move(answer.pairs);
  }

  const BendingScene& scene_;
  const DeformOptions& options_;
  const bool on_gpu_, own_;
  std::unique_ptr<Engine> engine_;
  std::vector<ObjectPair> pairs_;
  TriangleContacts contacts_;
};

/// Trees that are built anew for each frame, and what is asked of them.
class Rebuilder {
 public:
  Rebuilder(const BendingScene& scene, const DeformOptions& options)
      : scene_(scene), options_(options), follower_(scene, options, "tandem"), views_(scene.shapes) {
    for (const std::uint32_t shape : scene.bending) rebuilt_.emplace_back(scene.shapes[shape]);
  }

  // A file holds float32 numbers: where positions are others, the new trees are refitted to these. Result:
  // nothing where a shape has no triangle left.
  std::optional<FrameWork> work(const FrameOfShapes& frame, std::uint32_t number,
                                std::span<const ObjectPair> pairs) {
    FrameWork work;
    bool has_trees = true;
    work.update_seconds = seconds_by(options_.threads, [&] { has_trees = build(frame); });
    if (!has_trees) return {};
    follower_.place(views_);
    FrameOfShapes in_float64;
    std::copy_if(frame.begin(), frame.end(), std::back_inserter(in_float64),
                 [](const auto& of) { return std::holds_alternative<std::vector<double>>(of.positions); });
    deform(follower_.engine(), in_float64, scene_.path, number);
    for (std::uint32_t i = 0; i < options_.repeats; ++i) follower_.time_query(work, i, pairs);
    follower_.take_answer(work);
    return work;
  }

  // Throws where the contacts are others than those of the refitted trees.
  void compare(const Follower& refitted, std::uint32_t number) const {
    const std::vector<BodyContact> expected = normalised(refitted, false),
                                   found = normalised(follower_, true);
    if (expected == found) return;
    const auto count_missing = [](const auto& some, const auto& all) {
      std::vector<BodyContact> missing;
      std::set_difference(all.begin(), all.end(), some.begin(), some.end(), std::back_inserter(missing));
      return std::to_string(missing.size());
    };
    throw std::runtime_error(scene_.path + ": frame " + std::to_string(number) +
                             ": the refitted trees miss " + count_missing(expected, found) + " and invent " +
                             count_missing(found, expected) + " of " + std::to_string(found.size()) +
                             " contacts of the rebuilt ones");
  }

 private:
  bool build(const FrameOfShapes& frame) {
    for (std::size_t i = 0; i < frame.size(); ++i) {
      if (!rebuilt_[i].build(frame[i].positions, options_.threads)) return false;
      views_[frame[i].shape] = rebuilt_[i].view();
    }
    return true;
  }

  // Sorted, by the triangles of the scene's shapes; of an instance with itself a <= b. Without those that a
  // rebuilt tree has not got. of_rebuilt: the contacts are of rebuilt trees.
  std::vector<BodyContact> normalised(const Follower& follower, bool of_rebuilt) const {
    std::vector<const RebuiltShape*> of_shape(scene_.shapes.size(), nullptr);
    std::vector<std::vector<bool>> kept(scene_.shapes.size());
    for (std::size_t i = 0; i < rebuilt_.size(); ++i) {
      of_shape[scene_.bending[i]] = &rebuilt_[i];
      if (!of_rebuilt) kept[scene_.bending[i]] = rebuilt_[i].kept();
    }
    std::vector<BodyContact> normal;
    for (const auto& [pair, triangle_a, triangle_b] : follower.contacts()) {
      const auto& [a, b] = follower.pairs()[pair];
      BodyContact contact = {a, b, triangle_a, triangle_b};
      bool is_kept = true;
      for (std::size_t side = 0; side < 2; ++side) {
        const std::uint32_t shape = scene_.instances[contact[side]].asset;
        std::uint32_t& triangle = contact[side + 2];
        if (of_shape[shape] == nullptr) continue;
        if (of_rebuilt) triangle = of_shape[shape]->original(triangle);
        if (!of_rebuilt) is_kept = is_kept && kept[shape][triangle];
      }
      if (!is_kept) continue;
      if (a == b && contact[3] < contact[2]) std::swap(contact[2], contact[3]);
      normal.push_back(contact);
    }
    std::sort(normal.begin(), normal.end());
    return normal;
  }

  const BendingScene& scene_;
  const DeformOptions& options_;
  Follower follower_;
  std::vector<AssetView> views_;
  std::vector<RebuiltShape> rebuilt_;
};

}  // namespace

std::uint64_t BendingScene::bending_triangles() const {
  std::uint64_t triangles = 0;
  for (const std::uint32_t shape : bending) triangles += shapes[shape].level().triangle_count;
  return triangles;
}

std::optional<double> deform(Engine& engine, const FrameOfShapes& frame, const std::string& path,
                             std::uint32_t number) {
  std::vector<BentShape> bent;
  for (const auto& [shape, positions] : frame)
    std::visit([&, s = shape](const auto& given) { bent.push_back({s, std::span(given)}); }, positions);
  try {
    return engine.deform(bent);
  } catch (const EngineError& error) {
    if (!error.shape) throw;
    const std::string where =
        error.status == Status::kOutOfRange ? "vertex " + std::to_string(error.where) + ": " : "";
    throw FileError(path + ": shape " + std::to_string(*error.shape) + ", frame " + std::to_string(number) +
                    ": " + where + explain(error.status));
  }
}

std::vector<PeerFrames> measure_frames(const BendingScene& scene, const DeformOptions& options) {
  Follower tandem(scene, options, options.on_gpu ? "tandem-cuda" : "tandem");
  std::optional<Rebuilder> rebuilder;
  std::vector<std::unique_ptr<Follower>> others;
  std::vector<PeerFrames> results = {{tandem.engine().label(), tandem.engine().settings(), {}}};
  if (options.rebuild) {
    rebuilder.emplace(scene, options);
    results.push_back({"Tandem rebuilt", "trees built anew in every frame", {}});
  }
  for (const std::string& name : options.peers) {
    others.push_back(std::make_unique<Follower>(scene, options, name));
    results.push_back({others.back()->engine().label(), others.back()->engine().settings(), {}});
  }
  for (std::uint32_t number = 0; number < options.frames; ++number) {
    const FrameOfShapes frame = read_frame(scene, number);
    const std::span<const ObjectPair> given =
        scene.given_pairs != nullptr ? std::span(*scene.given_pairs) : std::span<const ObjectPair>();
    if (number == 0) tandem.follow(frame, number);  // makes the copies of the trees
    auto result = results.begin();
    (result++)->frames.push_back(tandem.work(frame, number, given));
    if (rebuilder) {
      result->frames.push_back(rebuilder->work(frame, number, given));
      if ((result++)->frames.back()) rebuilder->compare(tandem, number);
    }
    for (const auto& other : others) {
      if (number == 0) other->follow(frame, number);
      (result++)->frames.push_back(other->work(frame, number, tandem.pairs()));
    }
  }
  return results;
}

}  // namespace tandem::bench
