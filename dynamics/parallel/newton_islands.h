#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>
#include <optional>
#include <span>

#include "dynamics/newton_step.h"
#include "dynamics/parallel/contact_pair.h"
#include "dynamics/parallel/joint_arrays.h"
#include "dynamics/parallel/labels.h"
#include "dynamics/slender.h"

/// Which islands a parallel step solves by Newton's method, and in which order they have their bodies and
/// pairs: what find_islands(), find_layers() and make_island_problem() do.
namespace tandem::dynamics {

/// An island that may be solved by Newton's method has at most so many bodies and pairs. Larger ones are
/// solved as soft ones, and counted.
inline constexpr std::uint32_t kMostNewtonBodies = 2048, kMostNewtonPairs = 8192;

/// If an island has at most so many bodies, its matrix has the blocks that elimination needs; in a larger
/// island, a column has all bodies up to its last one.
inline constexpr std::uint32_t kMostSparseBodies = 64;

/// What a step by Newton's method needs and has done.
struct NewtonNeeds {
  std::uint32_t units;      ///< of memory, kUnit bytes each
  std::uint32_t has_room;   ///< 0 where there was too little: islands without room are not solved then
  std::uint32_t islands;    ///< that were looked at
  std::uint32_t solved;     ///< of these
  std::uint32_t failed;     ///< that were left to soft steps because they did not converge
  std::uint32_t too_large;  ///< islands that were not looked at because of their size

  static constexpr std::uint32_t kUnit = 64;
};

/// An island as a part of lists.
struct NewtonIsland {
  std::uint32_t root;  ///< its first body
  std::uint32_t first_body, bodies, first_pair, pairs, contacts;
};

/// All that finding islands reads and writes.
struct NewtonIslandsView {
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  ContactPairs pairs;
  NewtonNeeds* needs;
  std::uint32_t *listed_bodies, *listed_pairs;  // how many are listed
  // These have an element for each body.
  std::uint32_t* label;                               // see labels.h
  std::uint32_t *bodies_of, *pairs_of, *contacts_of;  // of the island whose first body it is
  std::uint32_t* island_of;                           // the same; kNone: it is not looked at
  std::uint32_t *layer, *place;                       // place: in its island, from 1
  std::uint8_t *is_solved, *was_solved;               // was: when the step was solved before
  std::uint32_t* changes;            // the island whose first body it is has changed since then
  const std::uint32_t* has_changed;  // the body has; null: the step was not solved before
  // Islands have parts of these, with an element for each body. found: in any order; order: in that of the
  // island; reach: the last body that each has something to do with, as its place less 1.
  std::uint32_t *found_bodies, *order, *reach;
  // And of these, with one for each pair.
  std::uint32_t *found_pairs, *pair_order;
  std::uint8_t* is_pair_solved;
  NewtonIsland* islands;

  TANDEM_HD bool is_moved(std::uint32_t body) const { return pairs.is_moved(body); }
  TANDEM_HD std::uint32_t label_of(const ContactPair& pair) const {
    return label[is_moved(pair.a) ? pair.a : pair.b];
  }
  TANDEM_HD std::uint32_t layer_of(std::uint32_t body) const {
    return is_moved(body) ? look_at(layer[body]) : 0;
  }
};

namespace newton_islands_detail {

TANDEM_HD inline void begin_body(const NewtonIslandsView& view, std::uint32_t i) {
  view.label[i] = i;
  view.bodies_of[i] = view.pairs_of[i] = view.contacts_of[i] = 0;
  view.layer[i] = view.island_of[i] = NewtonIslandsView::kNone;
  view.was_solved[i] = view.has_changed != nullptr ? view.is_solved[i] : 0;
  view.is_solved[i] = 0, view.changes[i] = 0;
}

TANDEM_HD inline void join_pair(const NewtonIslandsView& view, std::uint32_t i) {
  const ContactPair& pair = view.pairs.pairs[i];
  view.is_pair_solved[i] = 0;
  if (view.is_moved(pair.a) && view.is_moved(pair.b)) join(view.label, pair.a, pair.b);
}

// Whoever counts too many needs not count on; so few wait for the count of a large island.
TANDEM_HD inline void count_body(const NewtonIslandsView& view, std::uint32_t i) {
  const std::uint32_t root = first_of(view.label, i);
  view.label[i] = root;
  if (view.has_changed != nullptr && view.has_changed[i] != 0) atomic_or(view.changes[root], 1);
  add_up_to(view.bodies_of[root], kMostNewtonBodies + 1);
}

TANDEM_HD inline void count_pair(const NewtonIslandsView& view, std::uint32_t i) {
  const ContactPair& pair = view.pairs.pairs[i];
  const std::uint32_t root = view.label_of(pair);
  if (view.bodies_of[root] > kMostNewtonBodies) return;
  add_up_to(view.pairs_of[root], kMostNewtonPairs + 1);
  atomic_add(view.contacts_of[root], pair.count);
}

// Islands with joints are left alone: they count as those without pairs.
TANDEM_HD inline void leave_joined(const NewtonIslandsView& view, const JointArrays& joints,
                                   std::uint32_t i) {
  if (view.is_moved(i) && joints.hold(i)) atomic_least(view.pairs_of[view.label[i]], 0u);
}

// An island that has not changed is as it was: solved, or left to soft steps.
TANDEM_HD inline void keep_body(const NewtonIslandsView& view, std::uint32_t i) {
  if (view.changes[view.label[i]] == 0) view.is_solved[i] = view.was_solved[i];
}
TANDEM_HD inline void keep_pair(const NewtonIslandsView& view, std::uint32_t i) {
  const std::uint32_t root = view.label_of(view.pairs.pairs[i]);
  if (view.changes[root] == 0) view.is_pair_solved[i] = view.was_solved[root];
}

// Gives an island its parts of the lists. Where they are is chance, and changes nothing.
TANDEM_HD inline void begin_island(const NewtonIslandsView& view, std::uint32_t i, bool takes_all) {
  const std::uint32_t bodies = view.bodies_of[i], pairs = view.pairs_of[i], contacts = view.contacts_of[i];
  if (view.label[i] != i || !view.is_moved(i)) return;
  if (view.has_changed != nullptr && view.changes[i] == 0) return;
  if (bodies > kMostNewtonBodies || pairs > kMostNewtonPairs) {
    atomic_add(view.needs->too_large, 1);
    return;
  }
  // Layers have at least a body each.
  if (pairs == 0 || !(takes_all || is_slender(bodies * elimination_work(1), contacts))) return;
  const std::uint32_t island = atomic_add(view.needs->islands, 1);
  view.islands[island] = {i,      atomic_add(*view.listed_bodies, bodies),
                          bodies, atomic_add(*view.listed_pairs, pairs),
                          pairs,  contacts};
  view.island_of[i] = island;
  view.bodies_of[i] = view.pairs_of[i] = 0;  // that are listed so far
}

TANDEM_HD inline void list_body(const NewtonIslandsView& view, std::uint32_t i) {
  const std::uint32_t root = view.label[i], island = view.island_of[root];
  if (island == NewtonIslandsView::kNone || !view.is_moved(i)) return;
  view.found_bodies[view.islands[island].first_body + atomic_add(view.bodies_of[root], 1)] = i;
}

TANDEM_HD inline void list_pair(const NewtonIslandsView& view, std::uint32_t i) {
  const std::uint32_t root = view.label_of(view.pairs.pairs[i]), island = view.island_of[root];
  if (island == NewtonIslandsView::kNone) return;
  view.found_pairs[view.islands[island].first_pair + atomic_add(view.pairs_of[root], 1)] = i;
}

}  // namespace newton_islands_detail

/// Finds the islands of the view that may be solved by Newton's method: those without joints. takes_all: all
/// of them, else those that may be slender.
template <typename Executor>
void find_newton_islands(Executor& executor, const NewtonIslandsView& all, const JointArrays& all_joints,
                         std::uint32_t bodies, bool takes_all) {
  using namespace newton_islands_detail;
  const NewtonIslandsView view = all;
  const JointArrays joints = all_joints;
  const ContactPairs& pairs = view.pairs;
  executor.once([=] TANDEM_HD() {
    *view.needs = {0, 1, 0, 0, 0, 0};
    *view.listed_bodies = *view.listed_pairs = 0;
  });
  executor.for_each(nullptr, bodies, [=] TANDEM_HD(std::uint32_t i) { begin_body(view, i); });
  executor.for_each(pairs.count, pairs.most, [=] TANDEM_HD(std::uint32_t i) { join_pair(view, i); });
  executor.for_each(nullptr, bodies, [=] TANDEM_HD(std::uint32_t i) { count_body(view, i); });
  executor.for_each(pairs.count, pairs.most, [=] TANDEM_HD(std::uint32_t i) { count_pair(view, i); });
  if (joints.count > 0)
    executor.for_each(nullptr, bodies, [=] TANDEM_HD(std::uint32_t i) { leave_joined(view, joints, i); });
  if (view.has_changed != nullptr) {
    executor.for_each(nullptr, bodies, [=] TANDEM_HD(std::uint32_t i) { keep_body(view, i); });
    executor.for_each(pairs.count, pairs.most, [=] TANDEM_HD(std::uint32_t i) { keep_pair(view, i); });
  }
  executor.for_each(nullptr, bodies, [=] TANDEM_HD(std::uint32_t i) { begin_island(view, i, takes_all); });
  executor.for_each(nullptr, bodies, [=] TANDEM_HD(std::uint32_t i) { list_body(view, i); });
  executor.for_each(pairs.count, pairs.most, [=] TANDEM_HD(std::uint32_t i) { list_pair(view, i); });
}

/// Puts things into ascending order of their keys, no two of which are equal. from, to: of `count` things.
/// set(thing, place): called for each.
template <typename Team, typename Key, typename Set>
TANDEM_HD void rank_sort(const Team& team, const std::uint32_t* from, std::uint32_t* to, std::uint32_t count,
                         const Key& key, const Set& set) {
  team.each(count, [&](std::uint32_t i) {
    const std::uint64_t own = key(from[i]);
    std::uint32_t before = 0;
    for (std::uint32_t k = 0; k < count; ++k) before += key(from[k]) < own ? 1 : 0;
    to[before] = from[i];
    set(from[i], before);
  });
  team.barrier();
}

/// The rows of the columns of a small island's matrix, which a team shares. A bit of a column is a row.
struct SparseColumns {
  std::uint64_t rows_of[kMostSparseBodies];
};

/// Condition: bits != 0
TANDEM_HD inline std::uint32_t lowest_bit(std::uint64_t bits) {
#ifdef __CUDA_ARCH__
  return static_cast<std::uint32_t>(__ffsll(static_cast<long long>(bits)) - 1);
#else
  return static_cast<std::uint32_t>(std::countr_zero(bits));
#endif
}

/// A team that prepares an island.
template <typename Team>
class NewtonIslandPlan {
 public:
  TANDEM_HD NewtonIslandPlan(const Team& team, const NewtonIslandsView& all, std::uint32_t island,
                             SparseColumns& columns)
      : team_(team),
        all_(all),
        columns_(columns),
        island_(all.islands[island]),
        bodies_(all.found_bodies + island_.first_body),
        pairs_(all.found_pairs + island_.first_pair) {}

  TANDEM_HD const NewtonIsland& island() const { return island_; }
  TANDEM_HD const ContactPair& pair(std::uint32_t k) const {
    return all_.pairs.pairs[all_.pair_order[island_.first_pair + k]];
  }
  TANDEM_HD std::uint32_t number_of_pair(std::uint32_t k) const {
    return all_.pair_order[island_.first_pair + k];
  }
  TANDEM_HD std::uint32_t body(std::uint32_t k) const { return all_.order[island_.first_body + k]; }
  TANDEM_HD std::uint32_t place_of(std::uint32_t body) const {
    return all_.is_moved(body) ? all_.place[body] : 0;
  }

  /// Finds the layers of the bodies, from what does not move. Result: whether the island is slender; if not,
  /// layers are not whole, unless takes_all.
  TANDEM_HD bool find_layers(bool takes_all) const {
    double work = 0;
    std::uint32_t left = island_.bodies;
    for (std::uint32_t layer = 1; left > 0; ++layer) {
      const Sums<1> reached = team_.sum(Sums<1>{}, island_.pairs, [&](std::uint32_t k, Sums<1>& sums) {
        const ContactPair& pair = all_.pairs.pairs[pairs_[k]];
        for (int side = 0; side < 2; ++side) {
          const std::uint32_t from = pair.body(side), to = pair.body(1 - side);
          if (!all_.is_moved(to) || all_.layer_of(from) != layer - 1) continue;
          if (atomic_exchange_if(all_.layer[to], NewtonIslandsView::kNone, layer) == NewtonIslandsView::kNone)
            sums.of[0] += 1;
        }
      });
      const auto count = static_cast<std::uint32_t>(reached.of[0]);
      if (count == 0) break;
      left -= count;
      work += elimination_work(count);
      if (!takes_all && !is_slender(work, island_.contacts)) return false;
    }
    // What hangs on nothing is one layer.
    return takes_all || is_slender(work + elimination_work(left), island_.contacts);
  }

  /// Returns by how much bodies turn at a contact, at most; see turn_about().
  TANDEM_HD double most_turn(const ContactPoint* contacts, std::span<const BodyState> states,
                             double dt) const {
    return team_.most(0, island_.pairs, [&](std::uint32_t k) {
      const ContactPair& pair = all_.pairs.pairs[pairs_[k]];
      double most = 0;
      for (std::uint32_t i = pair.first; i < pair.first + pair.count; ++i)
        most = std::max(most, turn_about(contacts[i], states, dt));
      return most;
    });
  }

  /// Puts bodies into the order of their layers, and pairs into that of their lower bodies. Result: how many
  /// blocks beside the diagonal the island's matrix has.
  TANDEM_HD std::uint32_t put_in_order() const {
    const auto key = [](std::uint32_t layer, std::uint32_t number) {
      return std::uint64_t{layer} << 32 | number;
    };
    rank_sort(
        team_, bodies_, all_.order + island_.first_body, island_.bodies,
        [&](std::uint32_t body) { return key(all_.layer[body], body); },
        [&](std::uint32_t body, std::uint32_t at) { all_.place[body] = at + 1, begin_column(at); });
    rank_sort(
        team_, pairs_, all_.pair_order + island_.first_pair, island_.pairs,
        [&](std::uint32_t i) {
          const ContactPair& pair = all_.pairs.pairs[i];
          return key(std::min(all_.layer_of(pair.a), all_.layer_of(pair.b)), i);
        },
        [&](std::uint32_t i, std::uint32_t) {
          const std::uint32_t a = place_of(all_.pairs.pairs[i].a), b = place_of(all_.pairs.pairs[i].b);
          if (a > 0 && b > 0) add_to_column(std::min(a, b) - 1, std::max(a, b) - 1);
        });
    if (team_.rank() == 0) eliminate();
    team_.barrier();
    const Sums<1> blocks = team_.sum(Sums<1>{}, island_.bodies, [&](std::uint32_t j, Sums<1>& sums) {
      for_column(j, [&](std::uint32_t, std::uint32_t) { sums.of[0] += 1; });
    });
    return static_cast<std::uint32_t>(blocks.of[0]);
  }

  /// Writes the columns of the island's matrix. Condition: put_in_order().
  TANDEM_HD void write_columns(const BlockMatrix& matrix) const {
    if (team_.rank() == 0) {
      matrix.begin[0] = 0;
      for (std::uint32_t j = 0; j < island_.bodies; ++j) {
        std::uint32_t count = 0;
        for_column(j, [&](std::uint32_t, std::uint32_t) { ++count; });
        matrix.begin[j + 1] = matrix.begin[j] + count;
      }
    }
    team_.barrier();
    team_.each(island_.bodies, [&](std::uint32_t j) {
      for_column(j, [&](std::uint32_t k, std::uint32_t row) { matrix.rows[matrix.begin[j] + k] = row; });
    });
    team_.barrier();
  }

 private:
  TANDEM_HD bool is_sparse() const { return island_.bodies <= kMostSparseBodies; }
  TANDEM_HD std::uint32_t& reach(std::uint32_t j) const { return all_.reach[island_.first_body + j]; }

  TANDEM_HD void begin_column(std::uint32_t j) const {
    if (is_sparse())
      columns_.rows_of[j] = 0;
    else
      reach(j) = j;
  }
  TANDEM_HD void add_to_column(std::uint32_t j, std::uint32_t row) const {
    if (is_sparse())
      atomic_or(columns_.rows_of[j], std::uint64_t{1} << row);
    else
      atomic_most(reach(j), row);
  }
  // Eliminating a body joins all that its column has.
  TANDEM_HD void eliminate() const {
    for (std::uint32_t j = 0; j < island_.bodies; ++j) {
      if (!is_sparse()) {
        reach(j) = std::max(reach(j), reach(j > 0 ? j - 1 : 0));
      } else if (const std::uint64_t rows = columns_.rows_of[j]; rows != 0) {
        columns_.rows_of[lowest_bit(rows)] |= rows & (rows - 1);
      }
    }
  }
  // Calls visit(k, row) for each row of a column, the k-th, ascending.
  template <typename Visit>
  TANDEM_HD void for_column(std::uint32_t j, const Visit& visit) const {
    if (!is_sparse()) {
      for (std::uint32_t k = 0; k < reach(j) - j; ++k) visit(k, j + 1 + k);
      return;
    }
    std::uint32_t k = 0;
    for (std::uint64_t rows = columns_.rows_of[j]; rows != 0; rows &= rows - 1) visit(k++, lowest_bit(rows));
  }

  const Team& team_;
  const NewtonIslandsView& all_;
  SparseColumns& columns_;
  NewtonIsland island_;
  const std::uint32_t *bodies_, *pairs_;
};

}  // namespace tandem::dynamics
