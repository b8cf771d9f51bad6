#include <windows.h>

#include <algorithm>
#include <array>
#include <system_error>

#include "file_writing.h"

namespace tandem {
namespace {

namespace fs = std::filesystem;

// The temporary file that Ctrl-C must remove; empty when there is none. Plain memory, because Windows calls
// the handler on a thread of its own.
std::array<wchar_t, 32768> g_temporary{};

BOOL WINAPI remove_temporary(DWORD) {
  if (g_temporary[0] != L'\0') DeleteFileW(g_temporary.data());
  return FALSE;  // the next handler ends the process
}

// While it lives, Ctrl-C, Ctrl-Break, and the end of the console or the session remove the temporary file
// first.
class EndGuard {
 public:
  explicit EndGuard(const std::wstring& temporary) {
    std::copy(temporary.begin(), temporary.end(), g_temporary.begin());
    SetConsoleCtrlHandler(remove_temporary, TRUE);
  }
  ~EndGuard() {
    SetConsoleCtrlHandler(remove_temporary, FALSE);
    g_temporary.fill(L'\0');
  }
  EndGuard(const EndGuard&) = delete;
  EndGuard& operator=(const EndGuard&) = delete;
};

// Writes everything and closes the file.
DWORD write_and_close(HANDLE file, std::span<const std::byte> bytes, bool flush) {
  if (file == INVALID_HANDLE_VALUE) return GetLastError();
  DWORD error = NO_ERROR;
  while (error == NO_ERROR && !bytes.empty()) {
    const auto wanted = static_cast<DWORD>(std::min(bytes.size(), std::size_t{1} << 26));
    DWORD written = 0;
    if (!WriteFile(file, bytes.data(), wanted, &written, nullptr)) error = GetLastError();
    bytes = bytes.subspan(written);
  }
  if (error == NO_ERROR && flush && !FlushFileBuffers(file)) error = GetLastError();
  CloseHandle(file);
  return error;
}

HANDLE open_to_write(const fs::path& path, DWORD how) {
  // Shared for removal, so that the handler may remove what is still being written.
  return CreateFileW(path.c_str(), GENERIC_WRITE, FILE_SHARE_DELETE, nullptr, how, FILE_ATTRIBUTE_NORMAL,
                     nullptr);
}

std::string words_of(DWORD error) {
  return error == NO_ERROR ? std::string() : std::system_category().message(static_cast<int>(error));
}

// A file beside the target that no other process writes to. File systems take names of 255 characters.
fs::path temporary_beside(const fs::path& target) {
  constexpr std::size_t kLongestStem = 230;
  const std::wstring stem = target.filename().wstring().substr(0, kLongestStem);
  return target.parent_path() / (stem + L".tmp" + std::to_wstring(GetCurrentProcessId()));
}

}  // namespace

std::string write_in_place(const fs::path& path, std::span<const std::byte> bytes) {
  return words_of(write_and_close(open_to_write(path, OPEN_EXISTING), bytes, false));
}

std::string why_not_writable(const fs::path& path) {
  return write_in_place(path, {});
}

std::string write_and_rename(const fs::path& target, std::span<const std::byte> bytes, bool replace) {
  const fs::path temporary = temporary_beside(target);
  if (temporary.native().size() >= g_temporary.size()) return words_of(ERROR_FILENAME_EXCED_RANGE);
  DeleteFileW(temporary.c_str());  // left behind by a killed process that had our number
  const EndGuard guard(temporary.native());
  DWORD error = write_and_close(open_to_write(temporary, CREATE_NEW), bytes, replace);
  constexpr DWORD kHow = MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH;
  if (error == NO_ERROR && replace && !MoveFileExW(temporary.c_str(), target.c_str(), kHow))
    error = GetLastError();
  if (error != NO_ERROR || !replace) DeleteFileW(temporary.c_str());
  return words_of(error);
}

}  // namespace tandem
