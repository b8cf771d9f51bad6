#include <windows.h>

#include <algorithm>

#include "opened_file.h"

namespace tandem::build {
namespace {

std::error_code last_error() {
  return {static_cast<int>(GetLastError()), std::system_category()};
}

HANDLE handle(const OpenedFile& file) {
  return reinterpret_cast<HANDLE>(file.handle);
}

std::uint64_t joined(DWORD high, DWORD low) {
  return std::uint64_t{high} << 32 | low;
}

FileKind kind_of(const OpenedFile& file, DWORD attributes) {
  if ((attributes & FILE_ATTRIBUTE_DIRECTORY) != 0) return FileKind::folder;
  return GetFileType(handle(file)) == FILE_TYPE_DISK ? FileKind::regular : FileKind::other;
}

}  // namespace

std::error_code open_to_read(const std::filesystem::path& path, OpenedFile& file) {
  constexpr DWORD kShared = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;
  // With FILE_FLAG_BACKUP_SEMANTICS folders are opened too, so that they are told from files that are
  // refused.
  const HANDLE opened = CreateFileW(path.c_str(), GENERIC_READ, kShared, nullptr, OPEN_EXISTING,
                                    FILE_FLAG_BACKUP_SEMANTICS, nullptr);
  file.handle = reinterpret_cast<std::intptr_t>(opened);
  if (opened == INVALID_HANDLE_VALUE) return last_error();
  BY_HANDLE_FILE_INFORMATION info;
  if (!GetFileInformationByHandle(opened, &info)) return {};  // a device
  file.kind = kind_of(file, info.dwFileAttributes);
  file.size = joined(info.nFileSizeHigh, info.nFileSizeLow);
  file.identity = {info.dwVolumeSerialNumber, joined(info.nFileIndexHigh, info.nFileIndexLow)};
  return {};
}

std::size_t read_at(const OpenedFile& file, char* to, std::size_t count, std::uint64_t offset,
                    std::error_code& error) {
  std::size_t got = 0;
  while (got < count) {
    const auto wanted = static_cast<DWORD>(std::min(count - got, std::size_t{1} << 30));
    OVERLAPPED place{};
    place.Offset = static_cast<DWORD>(offset + got);
    place.OffsetHigh = static_cast<DWORD>((offset + got) >> 32);
    DWORD read = 0;
    if (!ReadFile(handle(file), to + got, wanted, &read, &place) && GetLastError() != ERROR_HANDLE_EOF)
      error = last_error();
    if (read == 0) break;
    got += read;
  }
  return got;
}

void close_file(const OpenedFile& file) {
  if (file.handle != OpenedFile::kNone) CloseHandle(handle(file));
}

}  // namespace tandem::build
