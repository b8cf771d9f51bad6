#pragma once
#include <cstdint>
#include <string>

/// Numbers as people read them.
namespace tandem {

/// 16 hexadecimal digits.
std::string hexadecimal(std::uint64_t value);

/// "5,804".
std::string with_commas(std::uint64_t value);

/// "527 KiB", "1.2 GiB".
std::string human_bytes(std::uint64_t bytes);

/// "1 thread", "4 threads".
std::string threads_words(std::uint64_t threads);

// MinGW's attribute `printf` means the words of Microsoft's printf(), but its printf() of C++ knows those of
// C.
#if defined(__MINGW32__) && !defined(__clang__)
#define TANDEM_PRINTF gnu_printf
#else
#define TANDEM_PRINTF printf
#endif

/// Returns what printf() would print.
[[gnu::format(TANDEM_PRINTF, 1, 2)]] std::string format(const char* pattern, ...);

}  // namespace tandem
