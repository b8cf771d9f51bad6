#pragma once
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "binary_number.h"
#include "common/printable.h"
#include "ply_header.h"
#include "text_scanner.h"

namespace tandem::build {

/// How reading the values of a PLY file stands. Once it is not `good` it stays so, and all further values are
/// zero.
enum class PlyState { good, ended, bad };

/// An index that is no integer, or too large for one: it names no vertex.
inline constexpr std::int64_t kNoIndex = std::numeric_limits<std::int64_t>::min();

inline std::int64_t index_from_real(double value) {
  constexpr double kMost = 4'294'967'296.0;
  return std::abs(value) <= kMost && value == std::floor(value) ? static_cast<std::int64_t>(value) : kNoIndex;
}

/// The values in the data of a binary PLY file, one after the other.
template <std::endian Order>
class PlyBinaryValues {
 public:
  PlyBinaryValues(std::string_view bytes, std::size_t data_begin)
      : cursor_(bytes.data() + data_begin), end_(bytes.data() + bytes.size()) {}

  static std::size_t least_bytes(const PlyProperty& property) {
    return ply_type_bytes(property.is_list ? property.count_type : property.type);
  }
  static std::size_t least_item_bytes(PlyType type) { return ply_type_bytes(type); }
  std::size_t room() const { return bytes_left(); }
  std::size_t bytes_left() const { return static_cast<std::size_t>(end_ - cursor_); }

  PlyState state() const { return state_; }
  std::string reason() const { return {}; }

  void begin_record() {}
  bool end_record() { return true; }

  double real(PlyType type) {
    switch (type) {
      case PlyType::float32:
        return take<float>();
      case PlyType::float64:
        return take<double>();
      default:
        return static_cast<double>(integer(type));
    }
  }
  std::int64_t integer(PlyType type) {
    switch (type) {
      case PlyType::int8:
        return take<std::int8_t>();
      case PlyType::uint8:
        return take<std::uint8_t>();
      case PlyType::int16:
        return take<std::int16_t>();
      case PlyType::uint16:
        return take<std::uint16_t>();
      case PlyType::int32:
        return take<std::int32_t>();
      case PlyType::uint32:
        return take<std::uint32_t>();
      case PlyType::float32:
        return index_from_real(take<float>());
      case PlyType::float64:
        return index_from_real(take<double>());
    }
    return kNoIndex;
  }
  void skip(PlyType type, std::uint64_t count) {
    if (count > bytes_left() / ply_type_bytes(type)) return end();
    cursor_ += count * ply_type_bytes(type);
  }

 private:
  template <class T>
  T take() {
    if (bytes_left() < sizeof(T)) {
      end();
      return T{};
    }
    const T value = load_number<T, Order>(cursor_);
    cursor_ += sizeof(T);
    return value;
  }
  void end() {
    state_ = PlyState::ended;
    cursor_ = end_;
  }

  const char* cursor_;
  const char* end_;
  PlyState state_ = PlyState::good;
};

/// The same for a PLY file in text, where every record of an element has a line of its own.
class PlyTextValues {
 public:
  PlyTextValues(std::string_view bytes, std::size_t data_begin) : text_(bytes) {
    text_.skip_bytes(data_begin - static_cast<std::size_t>(text_.cursor() - bytes.data()));
  }

  // A digit, and the blank or line end behind it.
  static std::size_t least_bytes(const PlyProperty&) { return 2; }
  static std::size_t least_item_bytes(PlyType) { return 2; }
  std::size_t room() const { return text_.bytes_left() + 1; }  // the last line end may be missing
  std::size_t bytes_left() {
    text_.skip_space();
    return text_.bytes_left();
  }

  PlyState state() const { return state_; }
  std::string reason() const { return reason_; }
  std::string line() const { return text_.line(); }

  void begin_record() {
    text_.skip_space();
    if (text_.at_end()) state_ = PlyState::ended;
  }
  /// False when the line holds more than the record.
  bool end_record() {
    text_.skip_blanks();
    const bool is_whole = text_.at_line_end();
    text_.skip_to_line_end();
    return is_whole;
  }

  double real(PlyType) {
    double value = 0;
    if (at_value() && !text_.read_real(value)) fail(in_quotes(text_.word()) + " is not a number");
    return value;
  }
  std::int64_t integer(PlyType type) {
    if (is_real(type)) return index_from_real(real(type));
    std::int64_t value = 0;
    if (at_value() && !text_.read_integer(value)) fail(in_quotes(text_.word()) + " is not an integer");
    return value;
  }
  void skip(PlyType, std::uint64_t count) {
    for (; count > 0 && at_value(); --count) text_.skip_word();
  }

 private:
  bool at_value() {
    if (state_ != PlyState::good) return false;
    text_.skip_blanks();
    if (!text_.at_line_end()) return true;
    if (text_.at_end()) {
      state_ = PlyState::ended;
    } else {
      fail("the line ends before its values do");
    }
    return false;
  }
  void fail(std::string_view reason) {
    state_ = PlyState::bad;
    reason_ = text_.line() + ": " + std::string(reason);
  }

  TextScanner text_;
  PlyState state_ = PlyState::good;
  std::string reason_;
};

}  // namespace tandem::build
