#pragma once

// Emscripten 3.1.6 has libc++ 13, which lacks these parts of C++20. CMake puts this header in front of every
// source; with a newer libc++ it adds nothing.
#include <version>

#if defined(_LIBCPP_VERSION) && !defined(__cpp_lib_bit_cast)
namespace std {

template <class To, class From>
constexpr To bit_cast(const From& from) noexcept {
  return __builtin_bit_cast(To, from);
}

}  // namespace std
#endif

#if defined(_LIBCPP_VERSION) && !defined(__cpp_lib_atomic_ref)
#include <atomic>

namespace std {

template <class Value>
struct atomic_ref {
  Value& value;

  explicit atomic_ref(Value& shared) : value(shared) {}
  Value fetch_add(Value more, memory_order) const {
    return __atomic_fetch_add(&value, more, __ATOMIC_SEQ_CST);
  }
};

}  // namespace std
#endif

#if defined(_LIBCPP_VERSION) && !defined(__cpp_lib_ranges)
#include <algorithm>

namespace std::ranges {

template <class Some, class Others>
bool equal(const Some& some, const Others& others) {
  return std::equal(some.begin(), some.end(), others.begin(), others.end());
}

}  // namespace std::ranges
#endif

// libc++ writes float64 numbers from version 14 on.
#if defined(_LIBCPP_VERSION) && _LIBCPP_VERSION < 14000
#define TANDEM_WRITES_REALS 1
#include <charconv>

namespace std {

to_chars_result to_chars(char* first, char* last, double value);

}  // namespace std
#endif
