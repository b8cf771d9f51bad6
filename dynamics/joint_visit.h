#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "dynamics/island_problem.h"
#include "dynamics/softness.h"

namespace tandem::dynamics {

/// The rows of one joint, as a sweep visits them: those that are held come first and are solved at once,
/// because they act on each other about as much as on themselves.
struct JointBlock {
  static constexpr std::uint32_t kMostHeld = 6;

  std::uint32_t begin, held_end, end;  ///< in IslandProblem::joint_rows
  double lower[kMostHeld][kMostHeld];  ///< L L^T: how impulses of those held change their w
};

/// Sets `lower`, for rows as they are now.
inline void factorise(JointBlock& block, std::span<const JointRow> rows) {
  for (std::uint32_t i = 0; i < block.held_end - block.begin; ++i) {
    const ContactRow& row = rows[block.begin + i].gradient;
    for (std::uint32_t j = 0; j <= i; ++j) {
      const ContactRow& other = rows[block.begin + j].gradient;
      double value = dot(row.a, other.a) + dot(row.b, other.b);
      for (std::uint32_t k = 0; k < j; ++k) value -= block.lower[i][k] * block.lower[j][k];
      block.lower[i][j] = i > j ? value / block.lower[j][j] : std::sqrt(value);
    }
  }
}

/// Returns the rows' blocks. Each joint's held rows come first.
inline std::vector<JointBlock> joint_blocks(std::span<const JointRow> rows) {
  std::vector<JointBlock> blocks;
  for (std::uint32_t begin = 0, end = 0; begin < rows.size(); begin = end) {
    std::uint32_t held = begin;
    for (; end < rows.size() && rows[end].joint == rows[begin].joint; ++end) {
      if (rows[end].kind == JointRowKind::hold) ++held;
    }
    blocks.push_back({begin, held, end, {}});
    factorise(blocks.back(), rows);
  }
  return blocks;
}

/// Adds an impulse of a row to the velocities of its bodies.
inline void push(JointRow& row, std::span<Vector6> velocity, double impulse) {
  velocity[row.a] += impulse * row.gradient.a;
  velocity[row.b] += impulse * row.gradient.b;
  row.impulse += impulse;
}

/// Visits a row that is a motor or a limit, see visit_joint().
inline void visit_free_row(JointRow& row, std::span<Vector6> velocity, double h, const Softness* soft) {
  const double mobility = row.gradient.mobility(), w = row.along(velocity) + row.drive;
  const auto wanted = [&](double speed) { return row.impulse + (speed - w) / mobility; };
  // A bound that is not reached yet may be reached in the substep, but not passed.
  const auto at_bound = [&](double way, bool passed) {
    if (!passed) return wanted(way / h);
    if (soft == nullptr) return wanted(0);
    return row.impulse + soft->mass_scale * (soft->bias_rate * way - w) / mobility -
           soft->impulse_scale * row.impulse;
  };
  double next = 0;
  if (row.kind == JointRowKind::motor) {
    next = wanted(row.speed);
  } else {
    const double least = at_bound(row.least_way, row.least_way > 0);
    const double most = at_bound(row.most_way, row.most_way < 0);
    next = least > 0 ? least : std::min(most, 0.0);
  }
  push(row, velocity, std::clamp(next, row.least_push, row.most_push) - row.impulse);
}

/// Changes the impulses of a joint's rows, and the velocities of its bodies, by one visit of a sweep. The
/// rows' impulses and bounds are those of a substep of length h, their ways those that are left now. soft:
/// how what is out of place comes back; null: it does not, and only velocities are mended.
inline void visit_joint(const JointBlock& block, std::span<JointRow> rows, std::span<Vector6> velocity,
                        double h, const Softness* soft) {
  for (std::uint32_t i = block.held_end; i < block.end; ++i) visit_free_row(rows[i], velocity, h, soft);
  const std::uint32_t held = block.held_end - block.begin;
  double x[JointBlock::kMostHeld];
  for (std::uint32_t i = 0; i < held; ++i) {
    const JointRow& row = rows[block.begin + i];
    x[i] = (soft != nullptr ? soft->bias_rate * row.least_way : 0) - row.along(velocity) - row.drive;
    for (std::uint32_t k = 0; k < i; ++k) x[i] -= block.lower[i][k] * x[k];
    x[i] /= block.lower[i][i];
  }
  for (std::uint32_t i = held; i-- > 0;) {
    for (std::uint32_t k = i + 1; k < held; ++k) x[i] -= block.lower[k][i] * x[k];
    x[i] /= block.lower[i][i];
  }
  for (std::uint32_t i = 0; i < held; ++i) {
    JointRow& row = rows[block.begin + i];
    push(row, velocity, soft != nullptr ? soft->mass_scale * x[i] - soft->impulse_scale * row.impulse : x[i]);
  }
}

}  // namespace tandem::dynamics
