#include "ply_header.h"

#include <algorithm>
#include <utility>

#include "common/printable.h"
#include "scanner.h"

namespace tandem::build {
namespace {

struct TypeName {
  std::string_view name;
  PlyType type;
};

constexpr TypeName kTypeNames[] = {
    {"char", PlyType::int8},      {"int8", PlyType::int8},       {"uchar", PlyType::uint8},
    {"uint8", PlyType::uint8},    {"short", PlyType::int16},     {"int16", PlyType::int16},
    {"ushort", PlyType::uint16},  {"uint16", PlyType::uint16},   {"int", PlyType::int32},
    {"int32", PlyType::int32},    {"uint", PlyType::uint32},     {"uint32", PlyType::uint32},
    {"float", PlyType::float32},  {"float32", PlyType::float32}, {"double", PlyType::float64},
    {"float64", PlyType::float64}};

class HeaderReader {
 public:
  HeaderReader(std::string_view bytes, PlyHeader& header) : bytes_(bytes), header_(header) {
    if (bytes.starts_with("\xEF\xBB\xBF")) next_ = 3;
  }

  std::string read() {
    if (!magic()) return error_;
    while (next_line()) {
      if (line_ == "end_header") {
        header_.data_begin = next_;
        return has_format_ ? "" : "the header has no 'format' line";
      }
      if (!statement()) return error_;
    }
    return "the header has no 'end_header' line: the file was cut in its header";
  }

 private:
  // A line counts only with its end, because the one that a cut file stops in may be half of another word;
  // unless nothing can be missing from it.
  bool next_line() {
    std::size_t end = bytes_.find(line_end_, next_);
    if (end == std::string_view::npos) {
      if (trimmed(bytes_.substr(next_)) != "end_header") return false;
      end = bytes_.size();
    }
    ++line_number_;
    line_ = bytes_.substr(next_, end - next_);
    if (line_.ends_with('\r')) line_.remove_suffix(1);
    line_ = trimmed(line_);
    next_ = std::min(end + 1, bytes_.size());
    return true;
  }

  // The file's first line end is that of all header lines: LF (with or without a CR before it) or CR.
  bool magic() {
    const std::size_t first_end = bytes_.find_first_of("\r\n", next_);
    const bool only_cr = first_end != std::string_view::npos && bytes_[first_end] == '\r' &&
                         bytes_.substr(first_end + 1, 1) != "\n";
    if (only_cr) line_end_ = '\r';
    next_line();
    return line_ == "ply" || fail("the first line is not 'ply'");
  }

  bool statement() {
    const std::string_view keyword = take_word();
    if (keyword == "format") return format();
    if (keyword == "element") return element();
    if (keyword == "property") return property();
    if (keyword == "comment" || keyword == "obj_info" || keyword.empty()) return true;
    return fail(in_quotes(keyword) + " is no keyword of a PLY header");
  }

  bool format() {
    const std::string_view name = take_word();
    const std::string_view version = take_word();
    has_format_ = true;
    if (version != "1.0") return fail("PLY version " + in_quotes(version) + " is not 1.0");
    if (name == "ascii") {
      header_.format = PlyFormat::ascii;
    } else if (name == "binary_little_endian") {
      header_.format = PlyFormat::binary_little_endian;
    } else if (name == "binary_big_endian") {
      header_.format = PlyFormat::binary_big_endian;
    } else {
      return fail(in_quotes(name) + " is no format of a PLY file");
    }
    return true;
  }

  bool element() {
    PlyElement element;
    element.name = take_word();
    const std::string_view word = take_word();
    const char* const end = word.data() + word.size();
    std::int64_t count = 0;
    const bool is_count = !word.empty() && parse_integer(word.data(), end, count) == end && count >= 0;
    if (!is_count) return fail(in_quotes(word) + " is no count of " + in_quotes(element.name));
    element.count = static_cast<std::uint64_t>(count);
    header_.elements.push_back(std::move(element));
    return true;
  }

  bool property() {
    if (header_.elements.empty()) return fail("a property before the first element");
    PlyProperty property{};
    TextScanner ahead(line_);
    property.is_list = ahead.word() == "list";
    if (property.is_list) {
      take_word();
      if (!type(property.count_type)) return false;
      if (is_real(property.count_type)) return fail("the length of a list is no integer");
    }
    if (!type(property.type)) return false;
    property.name = take_word();
    if (property.name.empty()) return fail("a property without a name");
    header_.elements.back().properties.push_back(property);
    return true;
  }

  bool type(PlyType& type) {
    const std::string_view word = take_word();
    for (const TypeName& candidate : kTypeNames) {
      if (candidate.name != word) continue;
      type = candidate.type;
      return true;
    }
    return fail(in_quotes(word) + " is no type of a PLY property");
  }

  std::string_view take_word() {
    TextScanner scanner(line_);
    scanner.skip_blanks();
    const std::string_view word = scanner.word();
    line_ = trimmed(line_.substr(static_cast<std::size_t>(word.data() - line_.data()) + word.size()));
    return word;
  }

  bool fail(std::string reason) {
    error_ = "line " + std::to_string(line_number_) + ": " + std::move(reason);
    return false;
  }

  std::string_view bytes_;
  PlyHeader& header_;
  char line_end_ = '\n';
  std::size_t next_ = 0;  // offset of the line after the one at hand
  std::size_t line_number_ = 0;
  std::string_view line_;  // what is left of the line at hand
  bool has_format_ = false;
  std::string error_;
};

}  // namespace

std::size_t ply_type_bytes(PlyType type) {
  constexpr std::size_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<std::size_t>(type)];
}

std::string read_ply_header(std::string_view bytes, PlyHeader& header) {
  return HeaderReader(bytes, header).read();
}

}  // namespace tandem::build
