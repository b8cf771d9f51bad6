#pragma once
#include <cstdint>

#include "common/message.h"
#include "import.h"

namespace tandem::build {

/// Writes what a child process tells its parent: a mesh and the other files that were read for it, or the
/// reason why there is none, in the byte order of both processes.
void write_message(const ReadResult& result, const MessageSink& sink);

/// Reads what write_message() wrote, believing nothing: a mesh that comes back has the shape that PolygonMesh
/// promises (face_begin ascends, faces have three corners or more, the parts cover the faces), and memory is
/// taken as bytes come in.
///
/// Result: false when the message ends early, contradicts itself or announces more than `most_bytes`.
bool read_message(const MessageSource& source, std::uint64_t most_bytes, ReadResult& result);

}  // namespace tandem::build
