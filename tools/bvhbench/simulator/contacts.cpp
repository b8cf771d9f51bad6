#include <algorithm>
#include <string>
#include <vector>

#include "kernels/common/stopwatch.h"
#include "simulator.h"

namespace tandem::simulation {
namespace {

class MeshContactFinder : public ContactFinder {
 public:
  MeshContactFinder(std::unique_ptr<Engine> engine, std::span<const AssetView> shapes, std::uint32_t threads,
                    bool asks_all)
      : engine_(std::move(engine)), asks_all_(asks_all) {
    engine_->set_threads(threads);
    engine_->set_shapes(shapes);
    ask([&] {
      require(scene_.set_assets(shapes), scene_);
      require(scene_.set_threads(threads), scene_);
    });
  }

  const std::vector<ContactPoint>& find(std::span<const BodyPose> bodies, std::span<const std::uint8_t> idle,
                                        const Keeping& keeping) override {
    ask([&] { require(scene_.place(bodies), scene_); });
    engine_->find(bodies, idle, found_, [&](std::span<const ObjectPair> near) {
      std::span<const ObjectPair> moved;
      ask([&] { moved = find_moved(scene_, moved_, near, keeping); });
      return asks_all_ ? near : moved;
    });
    Stopwatch stopwatch;
    ask([&] { make_points(); });
    const EngineTimes& times = engine_->times();
    report_.times = {times.update,         times.broad_phase, times.traversal,
                     times.triangle_tests, times.transfer,    stopwatch.lap()};
    report_.counters = engine_->counters();
    report_.kept_pairs = kept_.size();
    return points_;
  }

  std::span<const PosedBodies> posed() const override { return moved_.posed(); }
  void resume(std::span<const PosedBodies> posed) override {
    ask([&] { require(moved_.resume(scene_, posed), scene_); });
  }

 private:
  template <typename Question>
  static void ask(const Question& question) {
    try {
      question();
    } catch (const QueryFailed& failed) {
      throw error_of(failed, "contact manifolds");
    }
  }

  void make_points() {
    is_kept_.clear(), contacts_.clear();
    for (const ObjectPair& pair : found_.pairs)
      is_kept_.push_back(std::binary_search(kept_.begin(), kept_.end(), pair));
    for (const TriangleContact& c : found_.triangles) {
      if (!is_kept_[c.pair]) contacts_.push_back({c.pair, c.triangle_a, c.triangle_b, 0, 0});
    }
    require(manifolds_.find(scene_, found_.pairs, contacts_, kManifoldsOfStep), scene_);
    take_points(manifolds_, found_.pairs, points_, report_.contacts);
  }

  std::unique_ptr<Engine> engine_;
  bool asks_all_;
  Scene scene_;
  MovedQuery moved_;
  ManifoldQuery manifolds_;
  ContactList found_;
  std::vector<char> is_kept_;
  std::vector<Contact> contacts_;
  std::vector<ContactPoint> points_;
};

}  // namespace

EngineError error_of(const QueryFailed& failed, const char* question) {
  const char* blamed = subject(failed.status);
  const std::string who =
      blamed != nullptr ? std::string(blamed) + " " + std::to_string(failed.where) + ": " : "";
  return {std::string(question) + ": " + who + explain(failed.status), failed.status, failed.where};
}

std::unique_ptr<ContactFinder> make_mesh_contact_finder(std::unique_ptr<Engine> engine,
                                                        std::span<const AssetView> shapes,
                                                        std::uint32_t threads, bool asks_all) {
  return std::make_unique<MeshContactFinder>(std::move(engine), shapes, threads, asks_all);
}

}  // namespace tandem::simulation
