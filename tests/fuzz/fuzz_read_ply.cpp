#include "fuzz_reader.h"
#include "import/read_ply.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return tandem::build::fuzz_reader(tandem::build::read_ply, data, size);
}
