#include <windows.h>

#include <algorithm>
#include <cstdint>

#include "file_bytes.h"
#include "tandem/formats/allocator.h"

namespace tandem {
namespace {

Status status_of_open_error() {
  const DWORD error = GetLastError();
  const bool is_missing = error == ERROR_FILE_NOT_FOUND || error == ERROR_PATH_NOT_FOUND ||
                          error == ERROR_INVALID_NAME || error == ERROR_BAD_NETPATH;
  return is_missing ? Status::kFileNotFound : Status::kCannotOpen;
}

/// A regular file that is open for reading.
class OpenFile {
 public:
  explicit OpenFile(const char* path) { status_ = open(path); }
  ~OpenFile() {
    if (file_ != INVALID_HANDLE_VALUE) CloseHandle(file_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  Status status() const { return status_; }
  HANDLE handle() const { return file_; }
  std::size_t size() const { return size_; }

 private:
  Status open(const char* path) {
    const int units = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, nullptr, 0);
    if (units == 0) return Status::kFileNotFound;  // no file has a name that is not UTF-8
    auto* const wide = static_cast<wchar_t*>(allocate(sizeof(wchar_t) * static_cast<std::size_t>(units)));
    if (wide == nullptr) return Status::kOutOfMemory;
    MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, units);
    const Status status = open(wide);
    deallocate(wide);
    return status;
  }

  // Others may read, replace and remove the file meanwhile. Folders are opened too, so that they are told
  // from files that are refused.
  Status open(const wchar_t* path) {
    constexpr DWORD kShared = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;
    file_ =
        CreateFileW(path, GENERIC_READ, kShared, nullptr, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, nullptr);
    if (file_ == INVALID_HANDLE_VALUE) return status_of_open_error();
    BY_HANDLE_FILE_INFORMATION info;
    LARGE_INTEGER size;
    const bool is_file = GetFileType(file_) == FILE_TYPE_DISK && GetFileInformationByHandle(file_, &info) &&
                         (info.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) == 0 &&
                         GetFileSizeEx(file_, &size);
    if (!is_file) return Status::kNotARegularFile;
    size_ = static_cast<std::size_t>(size.QuadPart);
    return Status::kOk;
  }

  HANDLE file_ = INVALID_HANDLE_VALUE;
  std::size_t size_ = 0;
  Status status_;
};

bool read_exactly(HANDLE file, std::byte* to, std::size_t count) {
  while (count > 0) {
    const auto wanted = static_cast<DWORD>(std::min(count, std::size_t{1} << 30));
    DWORD got = 0;
    if (!ReadFile(file, to, wanted, &got, nullptr) || got == 0) return false;
    to += got;
    count -= got;
  }
  return true;
}

}  // namespace

FileBytes read_file(const char* path) {
  const OpenFile file(path);
  if (file.status() != Status::kOk) return {file.status()};
  void* data = allocate(file.size() + 1);  // + 1: an empty file has an address too
  if (data == nullptr) return {Status::kOutOfMemory};
  if (read_exactly(file.handle(), static_cast<std::byte*>(data), file.size()))
    return {Status::kOk, data, file.size()};
  deallocate(data);
  return {Status::kCannotRead};
}

FileBytes map_file(const char* path) {
  const OpenFile file(path);
  if (file.status() != Status::kOk) return {file.status()};
  // The view keeps the mapping, and the mapping keeps the file.
  const HANDLE mapping = CreateFileMappingW(file.handle(), nullptr, PAGE_READONLY, 0, 0, nullptr);
  if (mapping == nullptr) return {Status::kCannotRead};
  void* const data = MapViewOfFile(mapping, FILE_MAP_READ, 0, 0, 0);
  CloseHandle(mapping);
  if (data == nullptr) return {Status::kCannotRead};
  return {Status::kOk, data, file.size()};
}

void unmap(void* data, std::size_t) {
  UnmapViewOfFile(data);
}

void give_back_pages(void* data, std::size_t size) {
  (void)VirtualUnlock(data, size);  // takes pages that are not locked out of the working set
}

}  // namespace tandem
