// The glTF reader, from the bytes of a file, JSON text or GLB, to the polygons.
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "bvhbuild/import/readers.h"
#include "mesh_invariants.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::uint64_t kMostBytes = 1 << 20, kExpansion = 1 << 16;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const std::string broken = tandem::build::broken_invariant(
      tandem::build::read_gltf(bytes, "/there-is-no-such-folder", {kMostBytes, kExpansion}), kMostBytes);
  if (broken.empty()) return 0;
  std::fprintf(stderr, "%s\n", broken.c_str());
  std::abort();
}
