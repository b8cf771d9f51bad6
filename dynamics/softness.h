#pragma once
#include "dynamics/linear.h"

namespace tandem::dynamics {

/// The numbers of a soft row: a damped spring, taken implicitly.
struct Softness {
  double bias_rate, mass_scale, impulse_scale;
};

/// h: seconds of a substep.
TANDEM_HD inline Softness softness(double frequency, double damping_ratio, double h) {
  const double omega = 2 * kPi * frequency;
  const double a1 = 2 * damping_ratio + h * omega, a2 = h * omega * a1;
  return {omega / a1, a2 / (1 + a2), 1 / (1 + a2)};
}

}  // namespace tandem::dynamics
