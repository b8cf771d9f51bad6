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

/// Returns what printf() would print.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

}  // namespace tandem
