#pragma once
#include <functional>
#include <memory>
#include <ostream>
#include <vector>

#include "contract/door.h"

namespace tandem::test {

struct NamedDoor {
  const char *name, *interface;  // `interface`: as "except" of the table spells it
  std::function<std::unique_ptr<Door>()> open;
};

inline void PrintTo(const NamedDoor& door, std::ostream* out) {
  *out << door.name;
}

/// Returns the doors that this program tests: those of the CPU or those of a GPU.
std::vector<NamedDoor> doors();

/// Returns whether there is what the doors need: a GPU, for those of a GPU.
bool doors_are_usable();

}  // namespace tandem::test
