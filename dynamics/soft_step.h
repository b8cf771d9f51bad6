#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "dynamics/contact_rows.h"
#include "dynamics/contact_work.h"
#include "dynamics/pair_colours.h"
#include "dynamics/soft_joints.h"
#include "dynamics/soft_rows.h"

namespace tandem::dynamics {

/// Solves a step in substeps of length h = dt / substeps. Each: velocities by gravity, lasting forces and the
/// impulses of the substep before; one sweep over soft normal rows; positions by the new velocities; two
/// relaxing sweeps over the normal rows without their push; one over friction, within the cone of the impulse
/// that the normal row has then, and rolling resistance. Restitution comes after all substeps.
///
/// A soft row is a damped spring of frequency f = 1 / (8 h) and damping ratio 10 (2 f and 5 against what does
/// not move), taken implicitly: it gives way to what one sweep cannot solve, and its push never becomes
/// speed, because the relaxing sweeps take it back.
///
/// Pairs of bodies have colours, and no two of one colour move the same body: a sweep goes colour by colour,
/// and solves the pairs of a colour side by side. Impulses and velocities are float32, these less those at
/// the start of the step.
class SoftSolver {
 public:
  /// Solves the contacts and joints of islands together. states: those at the start of the step, and then at
  /// its end. impulses: those of all contacts, to start with and then the solution. Result: what the last
  /// substep leaves undone.
  Residual solve(const StepInput& input, std::span<const std::uint32_t> islands, const SolverOptions& options,
                 std::span<BodyState> states, std::span<ContactImpulse> impulses);

 private:
  /// The contacts of two bodies, these by place in bodies_, and where their rows are.
  struct Pair {
    ContactRange contacts;
    std::uint32_t a, b;
    std::uint32_t group;
    int lane;
  };
  enum class Work : std::uint8_t {
    pass,
    begin,
    accelerate,
    move,
    push_joints,
    visit_soft_joints,
    follow_joints,
    visit_joints,
  };
  /// The groups of a colour, region by region, or those of several that one thread visits.
  struct SweepPart {
    std::uint32_t begin, end;
    const std::uint32_t* region_begin;  ///< null: of several colours
  };
  struct Step;

  void gather(const Step& step, std::span<const std::uint32_t> islands);
  void find_unit(const Step& step);
  std::vector<std::uint32_t> find_colours();
  std::vector<std::uint32_t> find_regions(const Step& step, std::uint32_t regions) const;
  void make_groups(const Step& step);
  void find_parts();
  void fill(const Step& step);
  SoftRows rows_of(const Step& step);
  void run(const Step& step);
  void work_on_joints(Work work, double time);
  void limit_work(const Step& step, std::span<const std::uint32_t> islands);
  void write(const Step& step, std::span<BodyState> states, std::span<ContactImpulse> impulses);
  Residual residual() const;

  // Kept from step to step for their memory alone. The first of bodies stands for all that contacts do not
  // move.
  std::vector<std::uint32_t> body_, place_;  // of each place, and of each body of the step
  double unit_root_ = 1;                     // of the unit of masses
  std::vector<SteppedBody> bodies_;
  std::vector<Pair> pairs_;
  std::vector<ColouredPair> coloured_;
  std::vector<std::uint32_t> order_;         // of pairs, group by group
  std::vector<std::uint32_t> group_begin_;   // in order_
  std::vector<std::uint32_t> region_begin_;  // of its groups, for each colour
  std::uint32_t regions_ = 1;                // as many as threads
  std::vector<SweepPart> parts_;
  SoftJoints joints_;
  std::vector<SoftPairs> groups_;
  std::vector<SoftTurning> turnings_;
  std::vector<SoftNormal> normals_;
  std::vector<SoftGap> gaps_;
  std::vector<SoftFriction> frictions_;
  std::vector<SoftMotion> velocities_, moved_;  // what the step adds to the motion of its start
  std::vector<WorkOnBody> work_;
  std::vector<double> part_;               // of their impulses, of each body
  std::vector<SoftMotion> gains_, start_;  // what a substep adds to each; the velocities without its contacts
};

}  // namespace tandem::dynamics
