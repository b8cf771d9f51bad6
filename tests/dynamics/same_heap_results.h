#pragma once
#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "dynamics/random_heap.h"

namespace tandem::dynamics {

template <typename Thing>
void expect_same(const std::vector<Thing>& is, const std::vector<Thing>& wanted, const char* what) {
  ASSERT_EQ(is.size(), wanted.size());
  for (std::size_t i = 0; i < is.size(); ++i)
    ASSERT_EQ(std::memcmp(&is[i], &wanted[i], sizeof(Thing)), 0) << what << " " << i;
}

/// Expects the same bytes of both.
inline void expect_same(const HeapResult& is, const HeapResult& wanted) {
  expect_same(is.states, wanted.states, "states");
  expect_same(is.impulses, wanted.impulses, "impulses");
  expect_same(is.done, wanted.done, "done");
}

}  // namespace tandem::dynamics
