#pragma once
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace tandem {

/// Makes the file at `path` hold exactly these bytes, or leaves it as it was.
///
/// Effect: writes a temporary file in the same folder, flushes it to the disk and renames it over `path`. A
/// symbolic link keeps pointing where it points; a target that is no regular file (/dev/null, a pipe) is
/// written to directly. If anything fails, or SIGINT, SIGTERM or SIGHUP ends the process, the temporary file
/// is removed. Result: empty, or the reason of the failure.
std::string write_whole_file(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// Returns whether write_whole_file() may do so, for those who work long before they write: empty, or the
/// reason why not. Leaves the file, or its absence, as it is.
std::string try_whole_file(const std::filesystem::path& path);

}  // namespace tandem
