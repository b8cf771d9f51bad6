#pragma once
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "bvhbuild/import/import.h"
#include "mesh_invariants.h"

namespace tandem::build {

/// Reads the fuzzer's bytes and stops the process if the answer breaks what every answer of a reader keeps.
inline int fuzz_reader(ReadResult (*read)(std::string_view), const std::uint8_t* data, std::size_t size) {
  const ReadResult result = read({reinterpret_cast<const char*>(data), size});
  const std::string broken = broken_invariant(result, size);
  if (broken.empty()) return 0;
  std::fprintf(stderr, "%s\n", broken.c_str());
  std::abort();
}

}  // namespace tandem::build
