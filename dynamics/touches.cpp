#include "dynamics/touches.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "dynamics/lists_of_steps.h"

namespace tandem::dynamics {
namespace {

constexpr auto kBodies = bodies_of<WorldTouch>;

// This sums up what the contacts of one pair do together.
class PairTouch {
 public:
  explicit PairTouch(const ContactPoint& first) : touch_{first.body_a, first.body_b, 0, 0, {}} {}

  bool is_of(const ContactPoint& contact) const {
    return touch_.a == contact.body_a && touch_.b == contact.body_b;
  }
  void add(const ContactPoint& contact, double impulse, double approach) {
    touches_ = touches_ || contact.depth >= 0 || impulse > 0;
    touch_.impulse += impulse;
    touch_.speed = std::max(touch_.speed, approach);
    if (std::pair(impulse, contact.depth) <= hardest_) return;
    hardest_ = {impulse, contact.depth};
    for (int k = 0; k < 3; ++k) touch_.position[k] = at(contact.position, k);
  }
  void write(std::vector<WorldTouch>& to) const {
    if (touches_) to.push_back(touch_);
  }

 private:
  WorldTouch touch_;
  bool touches_ = false;
  std::pair<double, double> hardest_ = {-INFINITY, 0};  // an impulse, and a depth
};

}  // namespace

void Touches::update(std::span<const ContactPoint> contacts, std::span<const ContactImpulse> impulses,
                     std::span<const double> approach, std::span<const std::uint8_t> idle) {
  before_.swap(touching_);
  touching_.clear(), began_.clear(), ended_.clear();
  for (std::size_t i = 0; i < contacts.size();) {
    PairTouch pair(contacts[i]);
    for (; i < contacts.size() && pair.is_of(contacts[i]); ++i)
      pair.add(contacts[i], impulses[i].normal, approach[i]);
    pair.write(touching_);
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
