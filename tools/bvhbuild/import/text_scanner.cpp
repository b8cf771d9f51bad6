#include "text_scanner.h"

#include <algorithm>

namespace tandem::build {

TextScanner::TextScanner(std::string_view text)
    : begin_(text.data()), cursor_(text.data()), end_(text.data() + text.size()) {
  if (text.starts_with("\xEF\xBB\xBF")) cursor_ += 3;
}

std::string_view TextScanner::word() const {
  const char* const last = std::find_if(cursor_, end_, [](char c) { return is_blank(c) || is_line_end(c); });
  return {cursor_, static_cast<std::size_t>(last - cursor_)};
}

std::string_view TextScanner::take_line() {
  const char* const first = cursor_;
  skip_to_line_end();
  return trimmed({first, static_cast<std::size_t>(cursor_ - first)});
}

std::string TextScanner::line_at(const char* position) const {
  const auto is_space = [](char c) { return is_blank(c) || is_line_end(c); };
  if (position == end_)
    while (position != begin_ && is_space(position[-1])) --position;
  std::size_t line = 1;
  for (const char* p = begin_; p != position; ++p) {
    const bool ends_in_line_feed = *p == '\r' && p + 1 != end_ && p[1] == '\n';
    if (is_line_end(*p) && !ends_in_line_feed) ++line;
  }
  return "line " + std::to_string(line);
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

bool equals_ignoring_case(std::string_view word, std::string_view lower_case) {
  const auto same = [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b; };
  return std::equal(word.begin(), word.end(), lower_case.begin(), lower_case.end(), same);
}

}  // namespace tandem::build
