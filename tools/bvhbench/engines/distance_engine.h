#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tandem/kernels/distance_query.h"

namespace tandem {

/// Finds how near bodies are, on one thread. Functions throw std::bad_alloc, or std::runtime_error where a
/// call fails.
class DistanceEngine {
 public:
  DistanceEngine() = default;
  DistanceEngine(const DistanceEngine&) = delete;
  DistanceEngine& operator=(const DistanceEngine&) = delete;
  virtual ~DistanceEngine() = default;

  /// For tables.
  virtual std::string label() const = 0;

  /// The data structure, the precision and whatever else the figures depend on, in a line.
  virtual std::string settings() const = 0;

  /// Names the shapes that bodies refer to, and makes what lasts as long as they, which must outlive the
  /// engine's use.
  virtual void set_shapes(std::span<const AssetView> shapes) = 0;

  /// Takes the places of the bodies, which must stay until the next call.
  virtual void update(std::span<const Instance> bodies) = 0;

  /// The distance of each pair; 0 or less where bodies meet.
  virtual void find(std::span<const ObjectPair> pairs, std::vector<double>& distances) = 0;

  /// Whether find() is exact, without Tandem's own code; asked once, not raced.
  virtual bool is_reference() const { return false; }

  /// How many pairs of the last find() have an exact distance that is not in [lower, upper], as exact
  /// arithmetic decides. Condition: is_reference().
  virtual std::uint64_t outside(std::span<const double> /*lower*/, std::span<const double> /*upper*/) const {
    return 0;
  }
};

/// Tandem's, those of the libraries that were found when this program was built, and the reference.
std::vector<std::unique_ptr<DistanceEngine>> distance_engines();

}  // namespace tandem
