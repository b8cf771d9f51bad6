#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <system_error>
#include <utility>

/// InputFile does this, as each system does it: opened_file_posix.cpp, opened_file_windows.cpp.
namespace tandem::build {

enum class FileKind { regular, folder, other };

struct OpenedFile {
  static constexpr std::intptr_t kNone = -1;

  std::intptr_t handle = kNone;
  FileKind kind = FileKind::other;
  std::uint64_t size = 0;
  std::pair<std::uint64_t, std::uint64_t> identity{};  ///< the disk, and the file's number there
};

/// Opens for reading, without waiting for the writer of a pipe. The handle is to be closed also where there
/// is an error.
std::error_code open_to_read(const std::filesystem::path& path, OpenedFile& file);

/// Reads `count` bytes from `offset` on, fewer at the file's end. Result: their number.
std::size_t read_at(const OpenedFile& file, char* to, std::size_t count, std::uint64_t offset,
                    std::error_code& error);

void close_file(const OpenedFile& file);

}  // namespace tandem::build
