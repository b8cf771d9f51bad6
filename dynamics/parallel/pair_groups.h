#pragma once
#include <algorithm>
#include <cstdint>

#include "dynamics/parallel/pair_colouring.h"
#include "dynamics/soft_rows.h"

namespace tandem::dynamics {

/// Groups that one team visits at once. They are of one colour, or hold no pairs.
inline constexpr std::uint32_t kGroupsOfTeam = 2;

/// What a step needs room for, beside its bodies and pairs. Counts of a step that has too little room are
/// right, but for those that depend on another that is too large.
struct SoftStepNeeds {
  std::uint32_t pairs, groups, rows;
  std::uint32_t has_room;  ///< 0 where there was too little: nothing is solved then
};

/// Where the pairs of a colour are, by how many contacts they have.
struct ColourPlaces {
  static constexpr std::uint32_t kClasses = 64;
  std::uint32_t of_class[kClasses];  ///< first how many, then how many before; those with most come first
  std::uint32_t first_group;

  TANDEM_HD static std::uint32_t class_of(std::uint32_t contacts) {
    return kClasses - 1 - std::min(contacts, kClasses - 1);
  }
};

/// All that making groups reads and writes.
struct GroupsView {
  ColouringView colouring;
  SoftStepNeeds* needs;
  std::uint32_t room_of_groups, room_of_rows;
  ColourPlaces* colours;  // of each that pairs may share
  std::uint32_t* groups;  // how many there are; 0 where there is too little room
  std::uint32_t* lanes;   // of these
  std::uint32_t* shared;  // how many groups there are of colours that pairs may share
  std::uint32_t* place;   // of each pair among those of its colour and class
  std::uint32_t *pairs_of, *contacts_of, *first_row;  // of each group
  std::uint32_t* pair_of;                             // of each lane

  TANDEM_HD std::uint32_t contacts(std::uint32_t pair) const { return colouring.pairs.pairs[pair].count; }
};

namespace pair_groups_detail {

/// Returns how many groups a team takes for so many pairs.
TANDEM_HD inline std::uint32_t groups_for(std::uint32_t pairs) {
  constexpr std::uint32_t kPairsOfTeam = kGroupsOfTeam * kSoftWidth;
  return kGroupsOfTeam * ((pairs + kPairsOfTeam - 1) / kPairsOfTeam);
}

TANDEM_HD inline void count_pair(const GroupsView& view, std::uint32_t i) {
  const std::uint32_t colour = view.colouring.colour[i];
  if (colour >= kSharedColours) return;
  view.place[i] = atomic_add(view.colours[colour].of_class[ColourPlaces::class_of(view.contacts(i))], 1);
}

/// Turns the counts of a colour's classes into places. first_group becomes how many groups there are.
TANDEM_HD inline void place_classes(ColourPlaces& colour) {
  std::uint32_t before = 0;
  for (std::uint32_t& of_class : colour.of_class) {
    const std::uint32_t count = of_class;
    of_class = before;
    before += count;
  }
  colour.first_group = groups_for(before);
}

TANDEM_HD inline void place_colours(const GroupsView& view) {
  std::uint32_t groups = 0;
  for (std::uint32_t colour = 0; colour < kSharedColours; ++colour) {
    const std::uint32_t count = view.colours[colour].first_group;
    view.colours[colour].first_group = groups;
    groups += count;
  }
  *view.shared = groups;
  groups += kGroupsOfTeam * view.colouring.numbers->own;
  const std::uint32_t pairs = *view.colouring.pairs.count;
  const bool has_room = pairs <= view.colouring.pairs.most && groups <= view.room_of_groups;
  *view.needs = {pairs, groups, 0, has_room ? 1u : 0u};
  *view.groups = has_room ? groups : 0;
}

TANDEM_HD inline void place_pair(const GroupsView& view, std::uint32_t i) {
  if (view.needs->has_room == 0) return;
  const std::uint32_t colour = view.colouring.colour[i];
  std::uint32_t group = *view.shared + kGroupsOfTeam * (colour - kSharedColours), lane = 0;
  if (colour < kSharedColours) {
    const ColourPlaces& places = view.colours[colour];
    const std::uint32_t place = places.of_class[ColourPlaces::class_of(view.contacts(i))] + view.place[i];
    group = places.first_group + place / kSoftWidth, lane = place % kSoftWidth;
  }
  view.pair_of[kSoftWidth * group + lane] = i;
  atomic_most(view.pairs_of[group], lane + 1);
  atomic_most(view.contacts_of[group], view.contacts(i));
}

TANDEM_HD inline void count_rows(const GroupsView& view) {
  const std::uint32_t rows = view.first_row[*view.groups];
  view.needs->rows = rows;
  if (rows > view.room_of_rows) view.needs->has_room = 0, *view.groups = 0;
  *view.lanes = kSoftWidth * *view.groups;
}

}  // namespace pair_groups_detail

/// Gives each pair a lane of a group of its colour, those with many contacts first, so that few lanes of a
/// group have nothing to do; and each group its rows. A colour has whole teams of groups. Which lane a pair
/// has is chance, and changes nothing.
template <typename Executor>
class PairGroups {
 public:
  Status reserve(std::uint32_t pairs, std::uint32_t groups, std::uint32_t rows) {
    Status status = Status::kOk;
    const auto take = [&](Status of) {
      if (status == Status::kOk) status = of;
    };
    room_of_groups_ = std::max(groups, room_of_groups_), room_of_rows_ = std::max(rows, room_of_rows_);
    take(needs_.reserve(1)), take(colours_.reserve(kSharedColours)), take(numbers_.reserve(3));
    take(place_.reserve(pairs)), take(pair_of_.reserve(std::uint64_t{kSoftWidth} * room_of_groups_));
    take(of_groups_.reserve(3 * std::uint64_t{room_of_groups_} + 1));
    return status;
  }

  void make(Executor& executor, const ColouringView& colouring) {
    using namespace pair_groups_detail;
    const GroupsView view = view_of(colouring);
    const ContactPairs& pairs = colouring.pairs;
    view_ = view;
    executor.for_each(nullptr, std::max(kSharedColours, view.room_of_groups), [=] TANDEM_HD(std::uint32_t i) {
      if (i < kSharedColours) view.colours[i] = {};
      if (i < view.room_of_groups) view.pairs_of[i] = 0, view.contacts_of[i] = 0;
    });
    executor.for_each(pairs.count, pairs.most, [=] TANDEM_HD(std::uint32_t i) { count_pair(view, i); });
    executor.for_each(nullptr, kSharedColours,
                      [=] TANDEM_HD(std::uint32_t colour) { place_classes(view.colours[colour]); });
    executor.once([=] TANDEM_HD() { place_colours(view); });
    executor.for_each(pairs.count, pairs.most, [=] TANDEM_HD(std::uint32_t i) { place_pair(view, i); });
    executor.sum_before(view.contacts_of, view.groups, view.room_of_groups, view.first_row);
    executor.once([=] TANDEM_HD() { count_rows(view); });
  }

  /// The result of the last make().
  const GroupsView& view() const { return view_; }
  const SoftStepNeeds* needs() const { return needs_.data(); }
  std::size_t bytes() const { return bytes_of(needs_, colours_, numbers_, place_, pair_of_, of_groups_); }

 private:
  GroupsView view_of(const ColouringView& colouring) const {
    const std::uint64_t groups = room_of_groups_;
    std::uint32_t* const of_groups = of_groups_.data();
    return {colouring,          needs_.data(),          room_of_groups_,     room_of_rows_, colours_.data(),
            numbers_.data(),    numbers_.data() + 1,    numbers_.data() + 2, place_.data(), of_groups,
            of_groups + groups, of_groups + 2 * groups, pair_of_.data()};
  }

  template <typename T>
  using Array = typename Executor::template Array<T>;

  std::uint32_t room_of_groups_ = 0, room_of_rows_ = 0;
  GroupsView view_ = {};
  Array<SoftStepNeeds> needs_;
  Array<ColourPlaces> colours_;
  Array<std::uint32_t> numbers_, place_, pair_of_, of_groups_;
};

}  // namespace tandem::dynamics
