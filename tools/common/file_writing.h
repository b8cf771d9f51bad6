#pragma once
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

/// write_whole_file() does this to files, as each system does it: file_writing_posix.cpp,
/// file_writing_windows.cpp. Results are empty, or the reason of the failure.
namespace tandem {

/// Writes to a device or a pipe.
std::string write_in_place(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// Returns why a device or a pipe cannot be written to.
std::string why_not_writable(const std::filesystem::path& path);

/// Writes a temporary file beside `target`, flushes it to the disk and renames it over the target. `replace`:
/// else the temporary file is only tried and removed. It is removed too where a signal ends the process.
std::string write_and_rename(const std::filesystem::path& target, std::span<const std::byte> bytes,
                             bool replace);

}  // namespace tandem
