#pragma once
#include <algorithm>
#include <compare>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tandem/kernels/contact_query.h"

namespace tandem::bench {

/// A contact of the object pair in row `pair`: triangles of its a and b, in leaf order.
struct TriangleContact {
  std::uint32_t pair, triangle_a, triangle_b;

  friend auto operator<=>(const TriangleContact&, const TriangleContact&) = default;
};

using Counter = std::pair<std::string, std::uint64_t>;

/// A collision engine in one configuration, as `bvhbench compare` runs it: on one thread, all object pairs of
/// a scene at once. build(), then update() and query() as often as wanted. Each throws std::runtime_error.
class Peer {
 public:
  virtual ~Peer() = default;

  /// Such as "FCL" or "Tandem exact"; unique among the peers.
  virtual std::string name() const = 0;

  /// The data structure, the precision and whatever else the figures depend on, in a line.
  virtual std::string settings() const = 0;

  /// Makes what lasts from frame to frame. The assets outlive the peer.
  virtual void build(std::span<const AssetView> assets, std::span<const Instance> instances) = 0;

  /// A new frame: the same instances, in new places. What it costs belongs to every frame.
  virtual void update(std::span<const Instance> instances) = 0;

  /// Finds and keeps the contacts of these object pairs, none of an instance with itself. What compare times:
  /// the contacts end up in a vector, with their pair and triangles.
  virtual void query(std::span<const ObjectPair> pairs) = 0;

  /// What the last query found, sorted; nothing where the library does not tell the triangles.
  virtual std::optional<std::vector<TriangleContact>> contacts() const = 0;

  /// Of the last query.
  virtual std::vector<Counter> counters() const { return {}; }

  /// Memory held that malloc knows nothing of: mapped files, pages from the operating system.
  virtual std::uint64_t bytes_beside_heap() const { return 0; }

  /// Whether contacts() is the exact answer, found without Tandem's own code; asked once, not raced.
  virtual bool is_reference() const { return false; }
};

/// A peer that tells its contacts: query() clears and fills contacts_.
class TellingPeer : public Peer {
 public:
  std::optional<std::vector<TriangleContact>> contacts() const override {
    std::vector<TriangleContact> sorted = contacts_;
    std::sort(sorted.begin(), sorted.end());
    return sorted;
  }

 protected:
  std::vector<TriangleContact> contacts_;
};

/// The engines that this program was built with, by the names that --peers takes, in the order of the charts.
std::vector<std::string_view> engines();

/// The peers of an engine: one for each mode worth comparing. Condition: `engine` is one of engines().
std::vector<std::unique_ptr<Peer>> make_peers(std::string_view engine);

std::vector<std::unique_ptr<Peer>> make_tandem_peers();
std::vector<std::unique_ptr<Peer>> make_fcl_peers();
std::vector<std::unique_ptr<Peer>> make_embree_peers();
std::vector<std::unique_ptr<Peer>> make_bullet_peers();
std::vector<std::unique_ptr<Peer>> make_ode_peers();
std::vector<std::unique_ptr<Peer>> make_cgal_peers();

}  // namespace tandem::bench
