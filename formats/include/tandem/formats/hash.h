#pragma once
#include <cstddef>
#include <cstdint>

namespace tandem {

/// XXH64 of the bytes (Yann Collet's xxHash, 64-bit, specification 0.1.1), the content hash of a .bvh file.
/// Any tool that knows XXH64 can recompute it. Not cryptographic: it finds accidents, the checker finds
/// malice.
std::uint64_t xxh64(const void* data, std::size_t bytes, std::uint64_t seed = 0);

}  // namespace tandem
