#include "dynamics/touches.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "dynamics/lists_of_steps.h"
#include "dynamics/pair_touch.h"

namespace tandem::dynamics {
namespace {

constexpr auto kBodies = bodies_of<WorldTouch>;

}  // namespace

void Touches::update(std::span<const ContactPoint> contacts, std::span<const ContactImpulse> impulses,
                     std::span<const double> approach, std::span<const std::uint8_t> idle) {
  before_.swap(touching_);
  touching_.clear(), began_.clear(), ended_.clear();
  for (std::size_t i = 0; i < contacts.size();) {
    const ObjectPair bodies = pair_of(contacts[i]);
    PairTouch pair(bodies);
    for (; i < contacts.size() && pair_of(contacts[i]) == bodies; ++i)
      pair.add(contacts[i], impulses[i].normal, approach[i]);
    if (pair.touches()) touching_.push_back(pair.touch());
  }
  const auto awake = static_cast<std::ptrdiff_t>(touching_.size());
  std::ranges::copy_if(before_, std::back_inserter(touching_),
                       [&](const WorldTouch& pair) { return !idle.empty() && idle[pair.a] && idle[pair.b]; });
  std::ranges::inplace_merge(touching_, touching_.begin() + awake, {}, kBodies);
  std::ranges::set_difference(touching_, before_, std::back_inserter(began_), {}, kBodies, kBodies);
  std::vector<WorldTouch> ended;
  std::ranges::set_difference(before_, touching_, std::back_inserter(ended), {}, kBodies, kBodies);
  for (const WorldTouch& pair : ended) ended_.push_back({pair.a, pair.b});
}

void Touches::restore(std::vector<WorldTouch> touching) {
  touching_ = std::move(touching);
  began_.clear(), ended_.clear();
}

}  // namespace tandem::dynamics
