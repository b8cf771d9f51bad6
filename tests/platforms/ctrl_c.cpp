// Starts a program in a console of its own and presses Ctrl-C there: as soon as a folder holds a temporary
// file, or after some milliseconds. Ends with the program's exit code; 64 where it could not press.
//
//     ctrl_c FOLDER|MILLISECONDS PROGRAM ARGUMENT...
#include <windows.h>

#include <cstdio>
#include <cwchar>
#include <string>

namespace {

constexpr int kFailed = 64;

int fail(const char* step) {
  std::fprintf(stderr, "%s: error %lu\n", step, GetLastError());
  return kFailed;
}

bool runs(HANDLE program) {
  return WaitForSingleObject(program, 0) == WAIT_TIMEOUT;
}

bool has_temporary(const std::wstring& folder) {
  WIN32_FIND_DATAW found;
  const HANDLE search = FindFirstFileW((folder + L"\\*.tmp*").c_str(), &found);
  if (search == INVALID_HANDLE_VALUE) return false;
  FindClose(search);
  return true;
}

// Returns once it is time to press, or the program has ended.
void wait_until_due(const std::wstring& when, HANDLE program) {
  wchar_t* end = nullptr;
  const unsigned long milliseconds = std::wcstoul(when.c_str(), &end, 10);
  if (*end == L'\0') {
    WaitForSingleObject(program, milliseconds);
  } else {
    while (!has_temporary(when) && runs(program)) SwitchToThread();
  }
}

// All processes of a console get its Ctrl-C, so this one joins that of the program, and ignores it there. The
// program makes its console while it starts.
bool join_console(const PROCESS_INFORMATION& program) {
  FreeConsole();
  while (!AttachConsole(program.dwProcessId)) {
    if (!runs(program.hProcess)) return false;
    SwitchToThread();
  }
  return SetConsoleCtrlHandler(nullptr, TRUE);
}

}  // namespace

int wmain(int count, wchar_t** words) {
  if (count < 3) return kFailed;
  std::wstring command;
  for (int i = 2; i < count; ++i) command += L'"' + std::wstring(words[i]) + L"\" ";
  STARTUPINFOW start{};
  start.cb = sizeof start;
  start.dwFlags = STARTF_USESTDHANDLES;
  start.hStdOutput = GetStdHandle(STD_OUTPUT_HANDLE);
  start.hStdError = GetStdHandle(STD_ERROR_HANDLE);
  PROCESS_INFORMATION program{};
  if (!CreateProcessW(nullptr, command.data(), nullptr, nullptr, TRUE, CREATE_NO_WINDOW, nullptr, nullptr,
                      &start, &program))
    return fail("start");
  if (!join_console(program)) return fail("join the console");
  wait_until_due(words[1], program.hProcess);
  if (runs(program.hProcess) && !GenerateConsoleCtrlEvent(CTRL_C_EVENT, 0)) return fail("press");
  WaitForSingleObject(program.hProcess, INFINITE);
  DWORD code = kFailed;
  GetExitCodeProcess(program.hProcess, &code);
  std::printf("%lx\n", code);
  return 0;
}
