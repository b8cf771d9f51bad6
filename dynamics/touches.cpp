#include "dynamics/touches.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace tandem::dynamics {

void Touches::update(std::span<const ContactPoint> contacts, std::span<const ContactImpulse> impulses,
                     std::span<const std::uint8_t> idle) {
  before_.swap(touching_);
  touching_.clear(), began_.clear(), ended_.clear();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ObjectPair pair = {contacts[i].body_a, contacts[i].body_b};
    const bool touches = contacts[i].depth >= 0 || impulses[i].normal > 0;
    if (touches && (touching_.empty() || touching_.back() != pair)) touching_.push_back(pair);
  }
  const auto awake = static_cast<std::ptrdiff_t>(touching_.size());
  std::ranges::copy_if(before_, std::back_inserter(touching_),
                       [&](const ObjectPair& pair) { return !idle.empty() && idle[pair.a] && idle[pair.b]; });
  std::inplace_merge(touching_.begin(), touching_.begin() + awake, touching_.end());
  std::ranges::set_difference(touching_, before_, std::back_inserter(began_));
  std::ranges::set_difference(before_, touching_, std::back_inserter(ended_));
}

void Touches::restore(std::vector<ObjectPair> touching) {
  touching_ = std::move(touching);
  began_.clear(), ended_.clear();
}

}  // namespace tandem::dynamics
