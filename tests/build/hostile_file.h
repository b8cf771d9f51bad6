#pragma once
#include <gtest/gtest.h>

#include <functional>
#include <span>

#include "sample_asset.h"

namespace tandem::test {

/// What a hostile writer may do to a file, and the defect that must be named. Its hash is right.
struct Attack {
  const char* what;
  Status expected;
  std::function<void(Bytes&)> apply;
};

/// 30 triangles: 8 leaf blocks, 3 internal blocks, 3 levels of blocks at most, 2 + 2 imaginary nodes.
inline Bytes sample() {
  return Bytes(make_file(random_mesh(30, 1)));
}

inline void expect_all_named(std::span<const Attack> attacks) {
  for (const Attack& attack : attacks) {
    Bytes file = sample();
    attack.apply(file);
    const Status status = file.check_sealed();
    EXPECT_EQ(status, attack.expected) << attack.what << ": " << name(status);
  }
}

}  // namespace tandem::test
