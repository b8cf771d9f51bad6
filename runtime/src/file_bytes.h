#pragma once
#include <cstddef>

#include "tandem/formats/status.h"

/// The bytes of files, as each system gives them: file_bytes_posix.cpp, file_bytes_windows.cpp. Paths are
/// UTF-8.
namespace tandem {

struct FileBytes {
  Status status = Status::kOk;
  void* data = nullptr;
  std::size_t size = 0;
};

/// Maps a regular file for reading; unmap() gives it back.
/// Errors: kFileNotFound, kNotARegularFile, kCannotOpen; kCannotRead where it cannot be mapped but perhaps
/// read.
FileBytes map_file(const char* path);

/// Reads a regular file into memory of allocate().
/// Errors: those of map_file(), and kOutOfMemory.
FileBytes read_file(const char* path);

void unmap(void* data, std::size_t size);

/// If the system takes this advice, pages of a mapped file come back from the file's cache as they are
/// touched.
void give_back_pages(void* data, std::size_t size);

}  // namespace tandem
