#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "opened_file.h"

namespace tandem::build {

/// Why a file that a scene names may not be read: empty where it lies in the scene's folder or below it once
/// symbolic links are resolved, or where there is none but it would. The file is not opened.
std::string why_not_beside(const std::filesystem::path& folder, const std::filesystem::path& path);

/// A regular file that is open for reading. Its destructor closes it.
class InputFile {
 public:
  InputFile() = default;
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// Result: empty when the file is open, else the reason: "no such file", "is a folder", "permission
  /// denied", "the file is empty", ...
  std::string open(const std::filesystem::path& path);

  std::uint64_t size() const { return file_.size; }

  /// Equal for two open files exactly where they are the same file, whatever their names.
  using Identity = decltype(OpenedFile::identity);
  Identity identity() const { return file_.identity; }

  /// The first bytes, at most 64. Empty when they cannot be read.
  std::string head() const;

  /// Effect: reads the whole file, or what is left of it when it shrinks meanwhile. (It is not mapped,
  /// because a file that shrinks under a mapping kills the process.)
  ///
  /// Result: empty when bytes() holds it, else the reason.
  std::string read_all();

  std::string_view bytes() const { return {bytes_.get(), bytes_read_}; }

 private:
  OpenedFile file_;
  std::unique_ptr<char[]> bytes_;
  std::size_t bytes_read_ = 0;
};

}  // namespace tandem::build
