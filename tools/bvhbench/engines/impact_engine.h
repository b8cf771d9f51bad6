#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tandem/kernels/impact_query.h"

namespace tandem {

/// Finds when moving bodies meet, on one thread. Functions throw std::bad_alloc, or std::runtime_error where
/// a call fails.
class ImpactEngine {
 public:
  ImpactEngine() = default;
  ImpactEngine(const ImpactEngine&) = delete;
  ImpactEngine& operator=(const ImpactEngine&) = delete;
  virtual ~ImpactEngine() = default;

  /// For tables.
  virtual std::string label() const = 0;

  /// The data structure, the precision and whatever else the figures depend on, in a line.
  virtual std::string settings() const = 0;

  /// Names the shapes that bodies refer to, and makes what lasts as long as they, which must outlive the
  /// engine's use.
  virtual void set_shapes(std::span<const AssetView> shapes) = 0;

  /// Takes the places of the bodies and their motions in a step of `duration` seconds, which must stay until
  /// the next call. Condition: duration > 0, and no body turns by half a turn or more.
  virtual void update(std::span<const Instance> bodies, std::span<const RigidMotion> motions,
                      double duration) = 0;

  /// When the bodies of each pair meet, in seconds; infinite where they do not in this step.
  virtual void find(std::span<const ObjectPair> pairs, std::vector<double>& times) = 0;

  /// Whether it is so slow that it is asked once and not raced.
  virtual bool runs_once() const { return false; }
};

/// Tandem's, and those of the libraries that were found when this program was built.
std::vector<std::unique_ptr<ImpactEngine>> impact_engines();

}  // namespace tandem
