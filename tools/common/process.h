#pragma once
#include <cstdint>

/// This process, as each system sees it: process_posix.cpp, process_windows.cpp.
namespace tandem {

/// Prepares the process of a tool. Call once, before it opens a file.
///
/// Effect: no file gets the number of a standard stream that is closed; a mapped file whose pages cannot be
/// read, as when it is cut short, ends the process with a message and kUnreadableInput; on Windows, what is
/// printed is UTF-8, and lines end as they do elsewhere.
void prepare_process(const char* tool);

/// The most memory that this process had, in bytes; 0 where it is unknown.
std::uint64_t peak_memory_bytes();

/// Returns whether standard error is a terminal that knows how to erase a line.
bool has_terminal();

}  // namespace tandem
