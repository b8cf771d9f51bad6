#include "process.h"

#include <windows.h>
// Its declarations need those of windows.h.
#include <fcntl.h>
#include <io.h>
#include <psapi.h>

#include <cstdio>
#include <cstring>

#include "exit_code.h"

namespace tandem {
namespace {

char g_file_is_gone[128] = "";

// A page of a mapped file cannot be read, as when its disk or its network fails. The message does not go by
// stderr, which may keep it in a buffer.
LONG WINAPI tell_that_a_file_is_gone(EXCEPTION_POINTERS* exception) {
  if (exception->ExceptionRecord->ExceptionCode != EXCEPTION_IN_PAGE_ERROR) return EXCEPTION_CONTINUE_SEARCH;
  DWORD written = 0;
  WriteFile(GetStdHandle(STD_ERROR_HANDLE), g_file_is_gone, static_cast<DWORD>(std::strlen(g_file_is_gone)),
            &written, nullptr);
  TerminateProcess(GetCurrentProcess(), kUnreadableInput);
  return EXCEPTION_CONTINUE_SEARCH;
}

}  // namespace

void prepare_process(const char* tool) {
  std::snprintf(g_file_is_gone, sizeof g_file_is_gone,
                "%s: a file was cut short, or its disk failed, while it was read\n", tool);
  SetUnhandledExceptionFilter(tell_that_a_file_is_gone);
  SetConsoleOutputCP(CP_UTF8);
  _setmode(_fileno(stdout), _O_BINARY);
  _setmode(_fileno(stderr), _O_BINARY);
}

std::uint64_t peak_memory_bytes() {
  PROCESS_MEMORY_COUNTERS memory{};
  return GetProcessMemoryInfo(GetCurrentProcess(), &memory, sizeof memory) ? memory.PeakWorkingSetSize : 0;
}

bool has_terminal() {
  const HANDLE terminal = GetStdHandle(STD_ERROR_HANDLE);
  DWORD mode = 0;
  return GetConsoleMode(terminal, &mode) &&
         SetConsoleMode(terminal, mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING);
}

}  // namespace tandem
