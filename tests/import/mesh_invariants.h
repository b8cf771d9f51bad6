#pragma once
#include <cstddef>
#include <string>

#include "bvhbuild/import/import.h"

namespace tandem::build {

/// Returns the first promise that `result` breaks, or nothing. Every answer of a reader keeps these, whatever
/// the file of `file_bytes` bytes held: the shape that meshing.h promises, a reason for each failure, text
/// that JSON can carry, and memory that is a small multiple of the file.
std::string broken_invariant(const ReadResult& result, std::size_t file_bytes);

}  // namespace tandem::build
