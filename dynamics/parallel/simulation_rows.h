#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "dynamics/parallel/atomics.h"
#include "dynamics/parallel/step_arrays.h"
#include "dynamics/simulation.h"

/// What a parallel simulation tells of its last step, as Simulation does: sums over its contacts, and its
/// state.
namespace tandem::dynamics {

/// Sums over the contacts of a step. Depths are counted in parts of the slop, so that the sum does not depend
/// on its order.
struct ContactSums {
  static constexpr double kPartsOfSlop = 1 << 20, kMostParts = 1099511627776.0;  // 2^40, of one contact

  std::uint32_t contacts = 0;
  double deepest = 0;
  std::uint64_t depth = 0;  ///< of all contacts that are no gaps, in parts of the slop

  static TANDEM_HD double part_of(double slop) { return (slop > 0 ? slop : 1) / kPartsOfSlop; }
  double mean_depth(double slop) const {
    return contacts > 0 ? static_cast<double>(depth) * part_of(slop) / contacts : 0;
  }
};

/// Adds the contacts of the last step to the sums, which are in the executor's memory.
template <typename Executor>
void sum_contacts(Executor& to, const StepArrays& a, std::uint32_t pairs, ContactSums* sums) {
  const StepArrays of = a;
  to.for_each(nullptr, pairs, [of, sums] TANDEM_HD(std::uint32_t i) {
    const PairRecord& record = of.records_before[i];
    if (record.contacts == 0) return;
    std::uint64_t depth = 0;
    double deepest = 0;
    for (std::uint32_t k = record.first_contact; k < record.first_contact + record.contacts; ++k) {
      const double of_contact = std::max(of.contacts[k].depth, 0.0);
      const double parts = of_contact / ContactSums::part_of(of.options.slop);
      depth += static_cast<std::uint64_t>(parts < ContactSums::kMostParts ? parts : ContactSums::kMostParts);
      deepest = std::max(deepest, of_contact);
    }
    atomic_add(sums->contacts, record.contacts);
    atomic_add(sums->depth, depth);
    atomic_most(sums->deepest, deepest);
  });
}

/// Makes the pairs of a state, as the next step finds them, and their contacts in the order of these.
struct KeptPairs {
  std::vector<PairRecord> records;
  std::vector<CachedContact> remembered;

  explicit KeptPairs(const SimulationState& state) : remembered(state.contacts) {
    std::vector<ObjectPair> pairs;
    for (const CachedContact& contact : state.contacts) pairs.push_back(contact.pair);
    for (const PosedBodies& posed : state.posed) pairs.push_back(posed.pair);
    for (const PairApart& apart : state.ahead.apart) pairs.push_back(apart.pair);
    std::ranges::sort(pairs);
    pairs.erase(std::unique(pairs.begin(), pairs.end(), is_same), pairs.end());
    for (const ObjectPair& pair : pairs) records.emplace_back().pair = pair;
    std::uint32_t contact = 0;
    for (PairRecord& record : records) {
      record.first = contact;
      while (contact < remembered.size() && is_same(remembered[contact].pair, record.pair)) ++contact;
      record.count = contact - record.first;
    }
    for (const PosedBodies& posed : state.posed) {
      PairRecord& record = of(posed.pair);
      record.is_posed = true;
      record.posed[0] = posed.a.pose, record.posed[1] = posed.b.pose;
    }
    for (const PairApart& apart : state.ahead.apart)
      of(apart.pair).is_near = true, of(apart.pair).apart = apart.distance;
  }

 private:
  PairRecord& of(const ObjectPair& pair) {
    return *std::ranges::lower_bound(records, pair, {}, &PairRecord::pair);
  }
};

/// Adds to a state what pairs remember. shape: of each body.
inline void keep_pairs(std::span<const PairRecord> records, std::span<const CachedContact> remembered,
                       std::span<const BodyProperties> bodies, SimulationState& state) {
  for (const PairRecord& record : records) {
    const auto of_pair = remembered.subspan(record.first, record.count);
    state.contacts.insert(state.contacts.end(), of_pair.begin(), of_pair.end());
    const auto at = [&](int side) {
      const std::uint32_t body = side == 0 ? record.pair.a : record.pair.b;
      return Instance{bodies[body].shape, record.posed[side]};
    };
    if (record.is_posed) state.posed.push_back({record.pair, at(0), at(1)});
    if (record.is_near && record.apart > 0) state.ahead.apart.push_back({record.pair, record.apart});
  }
}

}  // namespace tandem::dynamics
