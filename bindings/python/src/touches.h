#pragma once
/// Contact points for solvers: what the adapters for MuJoCo and Newton share.
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core.h"

namespace tandem::python {

/// A contact point of two bodies a < b.
struct Touch {
  std::uint32_t a, b;
  double normal[3] = {};    ///< unit, from a towards b
  double position[3] = {};  ///< in the world, half-way between the surfaces
  double gap;               ///< how far the surfaces are apart; less than 0: they overlap
};

/// Says up to which gap two bodies a < b have contact points.
using Reach = std::function<double(std::uint32_t a, std::uint32_t b)>;

/// Bodies, and the contact points of those pairs of them that may collide.
class Touches {
 public:
  /// asset: of each body its place among the assets. pairs: those that may collide, or None where the scene
  /// finds them with the filter.
  Touches(nb::list assets, nb::handle asset, nb::handle pairs, nb::object filter, std::uint32_t threads,
          std::uint32_t most_points);

  /// The bodies, whose poses the caller writes before find().
  std::vector<tandem_instance>& bodies() { return bodies_; }
  const std::vector<tandem_instance>& bodies() const { return bodies_; }

  /// Finds the points of all manifolds, and, where `largest` is more than 0, those of pairs that are apart by
  /// at most their reach, of which `largest` is the largest. Other Python threads run meanwhile.
  ///
  /// Of a pair that is apart, b is moved towards a by the reach, along the way between their nearest points.
  /// The points of the manifolds that it then has are those within reach along that way; they are moved back
  /// with it. A pair that has no manifold even so has its nearest points.
  void find(const Reach& reach, double largest);

  const std::vector<Touch>& rows() const { return rows_; }

 private:
  /// A scene of C that refuses by an exception which holds no Python.
  class Scene {
   public:
    Scene(const std::vector<tandem_asset*>& assets, std::uint32_t threads);
    void place(std::span<const tandem_instance> bodies, const tandem_pair_filter* filter);
    /// Finds the manifolds of the bodies as they stand; calls add(pair, touch) for each of their points.
    template <typename Add>
    void find_manifolds(const std::vector<tandem_object_pair>* pairs, std::uint32_t most_points,
                        const Add& add);
    std::span<const tandem_distance> find_distances(const std::vector<tandem_object_pair>* pairs,
                                                    double reach);
    std::span<const tandem_object_pair> pairs(std::uint32_t question) const;

   private:
    void expect(tandem_status status) const;
    std::unique_ptr<tandem_scene, decltype(&tandem_scene_destroy)> scene_{nullptr, tandem_scene_destroy};
  };
  /// A pair that is apart by no more than its reach.
  struct Near {
    tandem_object_pair pair;
    const tandem_distance* distance;
    double way[3] = {};  ///< unit, from a's nearest point to b's
    double gap = 0, reach = 0;
    bool has_manifold = false;
  };

  void find_near(const Reach& reach, double largest);
  void add_near();

  std::vector<tandem_instance> bodies_, moved_;
  std::vector<tandem_object_pair> pairs_, moved_pairs_;
  const bool pairs_are_given_;
  nb::object filter_;
  const std::uint32_t most_points_;
  Scene scene_, moved_scene_;
  std::vector<Near> near_;
  std::vector<Touch> rows_;
};

}  // namespace tandem::python
