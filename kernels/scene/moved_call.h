#pragma once
#include <cstdint>

namespace tandem {

/// Takes numbers for calls of MovedQuery or of a GpuMovedQuery, which no others have. Result: the first, not
/// 0.
std::uint64_t take_moved_calls(std::uint64_t count);

}  // namespace tandem
