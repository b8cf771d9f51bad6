#include <algorithm>

#include "engine_parts.h"
#include "peer.h"

namespace tandem::simulation {
namespace {

// A library of `bvhbench compare`, given the object pairs of Tandem's broad phase.
class PeerEngine final : public CollisionEngine {
 public:
  PeerEngine(std::string_view name, std::string_view library, std::size_t peer)
      : name_(name), library_(library), place_(peer) {}

  std::string_view name() const override { return name_; }

  void set_shapes(std::span<const AssetView> shapes) override {
    shapes_.assign(shapes.begin(), shapes.end());
    require(name(), broad_phase_.set_assets(shapes), broad_phase_);
    peer_.reset();
  }

  void find(std::span<const BodyPose> bodies, std::span<const std::uint8_t> idle,
            ContactList& found) override {
    times_ = {};
    Stopwatch watch;
    require(name(), broad_phase_.find_pairs(bodies), broad_phase_);
    keep_active(broad_phase_.pairs(), idle, found.pairs);
    times_.broad_phase = watch.lap();
    follow(bodies);
    times_.update = watch.lap();
    peer_->query(found.pairs);
    times_.traversal = watch.lap();
    found.triangles.clear();
    const auto contacts = peer_->contacts();
    for (const bench::TriangleContact& c : *contacts)
      found.triangles.push_back({c.pair, c.triangle_a, c.triangle_b});
    times_.transfer = watch.lap();
    counters_ = {};
    counters_.object_pairs = found.pairs.size();
    counters_.contacts = found.triangles.size();
  }

 private:
  // Peers keep something for each body: made anew where bodies are others than those of the last call.
  void follow(std::span<const BodyPose> bodies) {
    const auto same = [](const BodyPose& body, std::uint32_t shape) { return body.asset == shape; };
    if (peer_ != nullptr &&
        std::equal(bodies.begin(), bodies.end(), shape_of_.begin(), shape_of_.end(), same)) {
      return peer_->update(bodies);
    }
    shape_of_.clear();
    for (const BodyPose& body : bodies) shape_of_.push_back(body.asset);
    peer_ = std::move(bench::make_peers(library_)[place_]);
    peer_->build(shapes_, bodies);
  }

  std::string name_, library_;
  std::size_t place_;
  std::vector<AssetView> shapes_;
  ContactQuery broad_phase_;
  std::vector<std::uint32_t> shape_of_;  // of the bodies that the peer was made for
  std::unique_ptr<bench::Peer> peer_;
};

}  // namespace

std::unique_ptr<CollisionEngine> make_peer_engine(std::string_view name, std::string_view library,
                                                  std::size_t peer) {
  return std::make_unique<PeerEngine>(name, library, peer);
}

}  // namespace tandem::simulation
