#pragma once
#include <cstdint>
#include <span>

#include "dynamics/pair_ahead.h"
#include "dynamics/parallel/contact_pair.h"
#include "dynamics/parallel/joint_arrays.h"
#include "dynamics/remembered_contacts.h"
#include "dynamics/rigid_body.h"
#include "dynamics/step_solver.h"
#include "kernels/geometry/pair_motion.h"
#include "tandem/dynamics/world.h"
#include "tandem/kernels/manifold.h"
#include "tandem/kernels/moved_query.h"

// What the visits of a parallel step read and write, in the memory of its executor.
namespace tandem::dynamics {

/// A pair of bodies that is remembered from step to step: it was near, it has contacts, or it began or ended
/// to touch in the last call.
struct PairRecord {
  ObjectPair pair;
  bool is_near;   ///< it was, in the last step
  bool is_posed;  ///< `posed` says where the bodies stood when their contacts were found
  double apart;   ///< by which the bodies are apart at least, where it is near
  Pose posed[2];
  std::uint32_t first, count;             ///< of the remembered contacts
  std::uint32_t first_contact, contacts;  ///< of the contacts of the step
  bool touches;                           ///< in the last step, as Touches says
  bool began, ended;                      ///< to touch, in a step of the last call
};

/// What becomes of a pair in a step.
struct PairPlan {
  std::uint32_t before;                ///< its record of the step before, or kNoIndex
  bool is_idle;                        ///< both bodies are: it stays as it was
  bool is_slow, is_in_reach, is_fast;  ///< see PairReach
  bool is_of_middle;                   ///< its contacts are those of the middle of the step
  bool keeps;                          ///< its contacts are those remembered
  bool is_asked;                       ///< for contacts where the bodies stand
  bool is_missed;                      ///< its contacts were missed when the step was solved last
  double reach, asked;                 ///< see PairReach
  std::uint32_t first_found, found;    ///< contacts
};

/// Counts of a step. Each is what there is, also where there is no room for so many.
struct StepCounts {
  std::uint32_t records_before, pairs;
  std::uint32_t middle, asked, apart, approaches, surprised, missed;  ///< pairs, but for approaches
  std::uint32_t found, remembered, touching;  ///< contacts found, room for those remembered, pairs that push
  std::uint32_t broken;                       ///< joints that break at the end of the step
  std::uint32_t bad_start, bad_body;          ///< the first whose state is not usable, or kNoIndex
  std::uint32_t has_fast;                     ///< 1: a body is_fast()
  std::uint32_t listed;                       ///< pairs, between steps
  LargestReach reach;
};

/// Says whether the step has to look at a body.
enum Idle : std::uint8_t {
  kNotIdle,
  kIdle,      ///< contacts do not move it, and it was not placed
  kUnusable,  ///< no step can begin with its state
};

/// All arrays of a step.
struct StepArrays {
  // These have an element for each body.
  std::uint32_t bodies;
  const BodyProperties* properties;  ///< as they were given
  BodyProperties* acting;            ///< what sleeps is fixed
  BodyState *before, *start, *end;   ///< at the start of the step before, of this one, and at its end
  Pull* pulls;
  const BodyForce* forces;  ///< null: there are none
  std::uint8_t* placed;     ///< fixed bodies that were placed since the last step
  std::uint8_t* idle;       ///< see Idle
  std::uint32_t* asset;
  Pose* pose;
  Motion* motion;              ///< of the filter of pairs
  BodyWay *ways, *ways_ahead;  ///< since the step before; in this one
  double* quiet;               ///< see Sleep
  std::uint32_t *group, *label;
  std::uint32_t* marks;
  std::uint32_t* has_missed;  ///< contacts, when the step was solved before

  // These have one for each shape.
  const double* inner_radius;
  const AssetBox* boxes;

  // These have one for each pair, of which there is room for most_pairs.
  std::uint32_t most_pairs;
  const ObjectPair* near;
  const std::uint32_t* near_count;
  std::uint32_t most_near;
  PairRecord *records_before, *records;
  WorldTouch *touches_before, *touches;  ///< of records that touch
  WorldTouch *begun_before, *begun;      ///< of records that began to touch, as World::began() says
  PairPlan* plans;
  std::uint32_t *flags, *sums;
  std::uint32_t* list;                 ///< pairs of a question, by place
  ObjectPair* asked;                   ///< bodies of these
  double* reach;                       ///< of distances
  std::uint32_t *row_first, *row_end;  ///< of each row of a question: what was found
  std::uint32_t most_moved;            ///< rows of questions about moved bodies
  const ObjectPair* moved_pairs;       ///< of row r bodies 2 r and 2 r + 1
  std::uint32_t* moved_asset;          ///< two for each such row
  Pose* moved_pose;
  Approach* approaches;
  ContactPair* touching;

  // These have one for each contact: most_found of those found, most_remembered of the others.
  std::uint32_t most_found, most_remembered;
  ContactPoint* found;
  CachedContact *remembered_before, *remembered;
  ContactPoint* contacts;
  std::uint32_t* place;  ///< of each contact among those that the pair remembers
  std::uint8_t* contact_marks;
  ContactImpulse *impulses_before, *impulses, *done;

  JointArrays joints;

  StepCounts* counts;
  double dt;
  double thinnest;  ///< see is_fast(); infinite: nobody asks
  Vector3 gravity;
  SolverOptions options;

  TANDEM_HD BodiesAhead ahead() const {
    return {{acting, bodies}, {start, bodies}, {idle, bodies}, dt, {pulls, bodies}, options.slop};
  }
  TANDEM_HD bool is_moved(std::uint32_t body) const { return acting[body].motion == Motion::moving; }
  TANDEM_HD std::span<const CachedContact> remembered_of(const PairRecord& record) const {
    return {remembered_before + record.first, record.count};
  }
};

// The default operator is none that nvcc defines for the host.
TANDEM_HD inline bool is_same(const ObjectPair& p, const ObjectPair& q) {
  return p.a == q.a && p.b == q.b;
}

/// Returns the place of the first of `count` pairs that is not before `pair`. Pair: of the i-th one.
template <typename Pair>
TANDEM_HD std::uint32_t first_not_before(const ObjectPair& pair, std::uint32_t count, const Pair& pair_at) {
  std::uint32_t begin = 0;
  while (count > 0) {
    const std::uint32_t half = count / 2;
    if (pair_at(begin + half) < pair)
      begin += half + 1, count -= half + 1;
    else
      count = half;
  }
  return begin;
}

}  // namespace tandem::dynamics
