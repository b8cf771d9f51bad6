#include "output_file.h"

#include <system_error>

#include "file_writing.h"

namespace tandem {
namespace {

namespace fs = std::filesystem;

// Returns where a chain of symbolic links ends, whether or not anything is there.
fs::path follow_links(fs::path path) {
  constexpr int kLongestChain = 40;
  std::error_code error;
  for (int i = 0; i < kLongestChain && fs::is_symlink(fs::symlink_status(path, error)); ++i) {
    path = path.parent_path() / fs::read_symlink(path, error);
  }
  return path;
}

/// How a file is written: in its place where it is a device or a pipe.
enum class Kind { folder, device, file };

Kind kind_of(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) return Kind::folder;
  return fs::exists(status) && !fs::is_regular_file(status) ? Kind::device : Kind::file;
}

}  // namespace

std::string write_whole_file(const fs::path& path, std::span<const std::byte> bytes) {
  switch (kind_of(path)) {
    case Kind::folder:
      return "is a folder";
    case Kind::device:
      return write_in_place(path, bytes);
    case Kind::file:
      break;
  }
  return write_and_rename(follow_links(path), bytes, true);
}

std::string try_whole_file(const fs::path& path) {
  switch (kind_of(path)) {
    case Kind::folder:
      return "is a folder";
    case Kind::device:
      return why_not_writable(path);
    case Kind::file:
      break;
  }
  return write_and_rename(follow_links(path), {}, false);
}

}  // namespace tandem
