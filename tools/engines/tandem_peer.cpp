#include <algorithm>
#include <stdexcept>

#include "peer.h"
#include "tandem/formats/status.h"

namespace tandem::bench {
namespace {

class TandemPeer final : public Peer {
 public:
  TandemPeer(QueryMode mode, std::string name, std::string settings)
      : mode_(mode), name_(std::move(name)), settings_(std::move(settings)) {}

  std::string name() const override { return name_; }
  std::string settings() const override { return settings_; }

  void build(std::span<const AssetView> assets, std::span<const Instance> instances) override {
    throw_unless_ok(query_.set_assets(assets));
    for (const AssetView& asset : assets) file_bytes_ += asset.header->file_bytes;
    update(instances);
  }

  void update(std::span<const Instance> instances) override {
    instances_.assign(instances.begin(), instances.end());
  }

  void query(std::span<const ObjectPair> pairs) override {
    throw_unless_ok(query_.find_contacts(instances_, pairs, {.mode = mode_}));
  }

  std::optional<std::vector<TriangleContact>> contacts() const override {
    std::vector<TriangleContact> out;
    out.reserve(query_.contacts().size());
    for (const Contact& c : query_.contacts()) out.push_back({c.pair, c.triangle_a, c.triangle_b});
    std::sort(out.begin(), out.end());
    return out;
  }

  std::vector<Counter> counters() const override {
    const QueryCounters& c = query_.counters();
    return {{"block_pairs", c.block_pairs},
            {"candidates", c.candidates},
            {"decided_by_float32", c.decided_by_float32},
            {"decided_by_float64", c.decided_by_float64},
            {"decided_exactly", c.decided_exactly}};
  }

  std::uint64_t bytes_beside_heap() const override { return file_bytes_; }

 private:
  static void throw_unless_ok(Status status) {
    if (status != Status::kOk) throw std::runtime_error(std::string("Tandem: ") + explain(status));
  }

  QueryMode mode_;
  std::string name_, settings_;
  ContactQuery query_;
  std::vector<Instance> instances_;
  std::uint64_t file_bytes_ = 0;
};

}  // namespace

std::vector<std::unique_ptr<Peer>> make_tandem_peers() {
  std::vector<std::unique_ptr<Peer>> peers;
  const auto add = [&](QueryMode mode, const char* name, const char* settings) {
    peers.push_back(std::make_unique<TandemPeer>(mode, name, settings));
  };
  add(QueryMode::exact, "Tandem exact",
      "4-ary AABB trees in one file each, exact on the posed float64 vertices");
  add(QueryMode::fast, "Tandem fast", "the same trees, triangles decided in float32");
  add(QueryMode::boxes, "Tandem boxes", "the same trees, triangles whose boxes overlap");
  return peers;
}

}  // namespace tandem::bench
