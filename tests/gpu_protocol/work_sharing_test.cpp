// How warps of the GPU walk share their work: in all orders of three warps with a little work, in many orders
// of more, and with every step of the protocol left out once, which must not go unnoticed.
#include <gtest/gtest.h>

#include <ostream>
#include <random>

#include "walk_model.h"

namespace tandem::test {
namespace {

std::vector<int> units(int count, int from = 0) {
  std::vector<int> out;
  for (int i = 0; i < count; ++i) out.push_back(from + i);
  return out;
}

// Four mailboxes are enough for three warps and for four, with a gift at a time; two for two.
Scenario two_warps() {
  return {.units = {units(16), {}}, .mailbox_bits = 1};
}
Scenario three_warps() {
  return {.units = {units(8), units(4, 8), {}}};
}
/// A warp without work may find that it is the only one, leave, and still be sending itself home while others
/// begin and go on.
Scenario late_warps() {
  return {.units = {{}, units(8), {}}};
}
/// Two gifts that grow: their receivers give in turn while they keep a mailbox each.
Scenario growing_gifts() {
  return {.units = {units(5), {}, {}}, .left_by = {units(4, 5), units(4, 9)}};
}
Scenario four_warps() {
  return {.units = {units(3), units(1, 3), {}, {}}};
}
Scenario eight_warps() {
  Scenario scenario = {.units = {units(6), units(6, 6), units(1, 12), {}, {}, {}, units(3, 13), {}}};
  for (int unit = 0; unit < 16; ++unit) scenario.left_by.push_back(units(3, 16 + 3 * unit));
  scenario.mailbox_bits = 4;
  scenario.most_gifts = 2;
  scenario.lanes = 2;
  return scenario;
}

constexpr std::size_t kMostStates = 1'000'000;

template <int kWordsOfEntry, std::size_t kWords, std::size_t kWarps>
Finding explored(const Scenario& scenario) {
  return WalkModel<kWordsOfEntry, kWords, kWarps>(scenario).explore(kMostStates);
}
Finding explored_two(const Scenario& scenario) {
  return explored<1, 5, 2>(scenario);
}
Finding explored_three(const Scenario& scenario) {
  return explored<1, 9, 3>(scenario);
}

/// Orders drawn by chance, up to the first with a fault.
template <int kWordsOfEntry, std::size_t kWords, std::size_t kWarps>
Finding drawn(const Scenario& scenario, int runs) {
  WalkModel<kWordsOfEntry, kWords, kWarps> model(scenario);
  std::mt19937 random(1);
  Finding all;
  for (int run = 0; run < runs && all.fault.empty(); ++run) {
    const Finding finding = model.run_once(random);
    all.fault = finding.fault;
    all.most_tickets = std::max(all.most_tickets, finding.most_tickets);
  }
  return all;
}

void expect_sound(const Finding& finding, std::size_t tickets) {
  EXPECT_EQ(finding.fault, "");
  EXPECT_TRUE(finding.all_seen) << finding.states << " states";
  EXPECT_GE(finding.most_tickets, tickets) << "mailboxes were not used again";
}

TEST(WorkSharing, OfTwoWarpsIsSoundInAllOrders) {
  expect_sound(explored_two(two_warps()), 9);
}

TEST(WorkSharing, OfThreeWarpsIsSoundInAllOrders) {
  expect_sound(explored_three(three_warps()), 7);
}

TEST(WorkSharing, WithWarpsThatBeginLateIsSoundInAllOrders) {
  expect_sound(explored_three(late_warps()), 6);
}

TEST(WorkSharing, OfGiftsThatGrowIsSoundInAllOrders) {
  expect_sound(explored_three(growing_gifts()), 9);
}

TEST(WorkSharing, OfFourWarpsIsSoundInAllOrders) {
  expect_sound(explored<1, 9, 4>(four_warps()), 5);
}

/// Entries of two lanes with two words each, which are seen one by one.
TEST(WorkSharing, OfEntriesOfTwoWordsIsSoundInAllOrders) {
  Scenario scenario = {.units = {units(9), {}}, .mailbox_bits = 1};
  scenario.lanes = 2;
  expect_sound(explored<2, 11, 2>(scenario), 4);
}

TEST(WorkSharing, OfEightWarpsIsSoundInManyOrders) {
  expect_sound(drawn<2, 81, 8>(eight_warps(), 150), 17);
  Scenario scenario = eight_warps();
  scenario.mailbox_bits = 3;
  scenario.most_gifts = scenario.lanes = 1;
  expect_sound(drawn<1, 17, 8>(scenario, 1500), 17);
}

/// A walk that has given out its tickets goes on without gifts, and numbers no more than so many more.
TEST(WorkSharing, EndsWhereTicketsEnd) {
  for (const std::uint32_t end : {0u, 1u, 3u}) {
    Scenario scenario = three_warps();
    scenario.tickets_end = end;
    scenario.most_tickets = end + 3 + 3;  // a gift and a ticket of each warp
    expect_sound(explored_three(scenario), 3);
  }
  Scenario unbounded = three_warps();
  unbounded.most_tickets = 4;
  EXPECT_NE(explored_three(unbounded).fault, "");
}

struct Mutation {
  LeftOut left_out;
  const char* name;
};

void PrintTo(const Mutation& mutation, std::ostream* out) {
  *out << mutation.name;
}

class WorkSharingWithout : public testing::TestWithParam<Mutation> {};

TEST_P(WorkSharingWithout, AStepIsFaulty) {
  std::string fault;
  const auto look = [&](auto explore, Scenario scenario) {
    if (!fault.empty()) return;
    scenario.left_out = GetParam().left_out;
    fault = explore(scenario).fault;
  };
  look(explored_two, two_warps());
  look(explored_three, late_warps());
  look(explored_three, growing_gifts());
  EXPECT_NE(fault, "");
  RecordProperty("fault", fault);
}

INSTANTIATE_TEST_SUITE_P(
    , WorkSharingWithout,
    testing::Values(
        Mutation{LeftOut::exchange, "Exchange"}, Mutation{LeftOut::clearing, "Clearing"},
        Mutation{LeftOut::giving_back, "GivingBack"}, Mutation{LeftOut::giving_back_first, "GivingBackFirst"},
        Mutation{LeftOut::release_of_giving_back, "ReleaseOfGivingBack"},
        Mutation{LeftOut::waiting_for_mailbox, "WaitingForTheMailbox"},
        Mutation{LeftOut::acquire_of_mailbox, "AcquireOfTheMailbox"}, Mutation{LeftOut::turns, "Turns"},
        Mutation{LeftOut::later_turns, "LaterTurns"}, Mutation{LeftOut::counting_gifts, "CountingGifts"},
        Mutation{LeftOut::ticket_with_idle, "TicketWithIdle"},
        Mutation{LeftOut::release_of_idle, "ReleaseOfIdle"}, Mutation{LeftOut::sending_home, "SendingHome"},
        Mutation{LeftOut::acquire_of_home, "AcquireOfHome"},
        Mutation{LeftOut::comparing_at_home, "ComparingAtHome"},
        Mutation{LeftOut::counting_home, "CountingHome"}, Mutation{LeftOut::maximum_of_home, "MaximumOfHome"},
        Mutation{LeftOut::own_change_in_look, "OwnChangeInLook"}),
    [](const auto& mutation) { return std::string(mutation.param.name); });

}  // namespace
}  // namespace tandem::test
