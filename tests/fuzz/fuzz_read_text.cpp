// A reader of one kind of mesh file, TANDEM_FUZZED: reads the fuzzer's bytes and stops the process if the
// answer breaks what every answer of a reader keeps.
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "bvhbuild/import/readers.h"
#include "mesh_invariants.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const std::string broken = tandem::build::broken_invariant(tandem::build::TANDEM_FUZZED(bytes), size);
  if (broken.empty()) return 0;
  std::fprintf(stderr, "%s\n", broken.c_str());
  std::abort();
}
