#include "input_file.h"

#include <algorithm>
#include <new>

namespace tandem::build {
namespace {

std::string reason(const std::error_code& error) {
  if (error == std::errc::no_such_file_or_directory) return "no such file";
  if (error == std::errc::not_a_directory) return "no such file (a part of its path is not a folder)";
  if (error == std::errc::permission_denied) return "permission denied";
  if (error == std::errc::is_a_directory) return "is a folder";
  return error.message();
}

}  // namespace

std::string why_not_beside(const std::filesystem::path& folder, const std::filesystem::path& path) {
  std::error_code error;
  const auto top = std::filesystem::weakly_canonical(folder.empty() ? "." : folder, error);
  if (error) return reason(error);
  const auto place = std::filesystem::weakly_canonical(path, error);
  if (error) return reason(error);
  if (std::mismatch(top.begin(), top.end(), place.begin(), place.end()).first == top.end()) return {};
  return "lies outside the folder of the file that names it (--allow-outside-files)";
}

InputFile::~InputFile() {
  close_file(file_);
}

std::string InputFile::open(const std::filesystem::path& path) {
  if (const std::error_code error = open_to_read(path, file_)) return reason(error);
  if (file_.kind == FileKind::folder) return "is a folder";
  if (file_.kind == FileKind::other) return "is not a regular file";
  return file_.size == 0 ? "the file is empty" : "";
}

std::string InputFile::head() const {
  std::string bytes(64, '\0');
  std::error_code error;
  bytes.resize(read_at(file_, bytes.data(), bytes.size(), 0, error));
  return bytes;
}

std::string InputFile::read_all() {
  bytes_.reset(new (std::nothrow) char[size()]);
  if (!bytes_) return "not enough memory to read it";
  std::error_code error;
  bytes_read_ = read_at(file_, bytes_.get(), size(), 0, error);
  return error ? reason(error) : "";
}

}  // namespace tandem::build
