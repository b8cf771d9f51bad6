#pragma once
#include <cmath>

#include "tandem/formats/platform.h"

namespace tandem::dynamics {

/// A truth value as OneLane has it.
struct OneTruth {
  bool is_true;

  TANDEM_HD friend bool any(OneTruth mask) { return mask.is_true; }
};

/// One float32 with the operations of Lanes, for host and device.
struct OneLane {
  static constexpr int kLanes = 1;
  float v;

  TANDEM_HD friend OneLane operator+(OneLane a, OneLane b) { return {a.v + b.v}; }
  TANDEM_HD friend OneLane operator+(OneLane a, float b) { return {a.v + b}; }
  TANDEM_HD friend OneLane operator-(OneLane a, OneLane b) { return {a.v - b.v}; }
  TANDEM_HD friend OneLane operator-(OneLane a) { return {-a.v}; }
  TANDEM_HD friend OneLane operator*(OneLane a, OneLane b) { return {a.v * b.v}; }
  TANDEM_HD friend OneLane operator*(float a, OneLane b) { return {a * b.v}; }
  TANDEM_HD friend OneLane operator/(OneLane a, OneLane b) { return {a.v / b.v}; }
  TANDEM_HD friend OneTruth less(OneLane a, OneLane b) { return {a.v < b.v}; }
  TANDEM_HD friend OneLane magnitude(OneLane a) { return {std::fabs(a.v)}; }
  TANDEM_HD friend OneLane square_root(OneLane a) { return {std::sqrt(a.v)}; }
  TANDEM_HD friend OneLane select(OneTruth mask, OneLane a, OneLane b) { return mask.is_true ? a : b; }
  TANDEM_HD friend OneLane larger(OneLane a, OneLane b) { return select(less(a, b), b, a); }
};

}  // namespace tandem::dynamics
