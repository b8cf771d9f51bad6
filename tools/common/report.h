#pragma once
#include <cstdint>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "json.h"
#include "kernels/common/stopwatch.h"

namespace tandem {

/// Says how a value stands in a text.
enum class Unit : std::uint8_t {
  words,         ///< as it is, from the left
  count,         ///< "5,804"
  milliseconds,  ///< of seconds; of the seconds of repeats the best, how many there are, and the median
  decimals,      ///< "0.1234"
  length,        ///< "0.0123457"
  magnitude,     ///< "1.2e-05"
};

/// A counter of a query: its key, the label of its row in a text, null where it has none, and its member.
template <typename Counters>
struct CounterRow {
  const char *key, *label;
  std::uint64_t Counters::*member;
};

/// The findings of a command, entry by entry. Its text, its JSON object and the attributes of its HDF5 file
/// are written from it: JSON and attributes in the order of the entries, the text in the order in which they
/// were given rows.
class Report {
 public:
  struct Entry {
    std::string key;  ///< in JSON, where "last/contacts" is in the object "last"; the name of an attribute
    Json value;
    bool in_json, in_file;
  };

  /// An entry that was added, to give it a row in the text.
  class Added {
   public:
    /// label: what stands before the value; remark: what follows it at once. There is no row of null.
    void row(const char* label, Unit unit = Unit::count, const std::string& remark = {}) const;

   private:
    friend Report;
    Added(Report& report, std::size_t entry) : report_(report), entry_(entry) {}

    Report& report_;
    std::size_t entry_;
  };

  /// label_width, value_width: the columns of the text. Labels that are longer widen the column.
  explicit Report(std::size_t label_width = 14, std::size_t value_width = 15)
      : label_width_(label_width), value_width_(value_width) {}

  /// Adds an entry, or several, of JSON and of the file.
  Added add(std::string key, Json value) { return push({std::move(key), std::move(value), true, true}); }
  void add(std::initializer_list<std::pair<const char*, Json>> entries) {
    for (const auto& [key, value] : entries) add(key, value);
  }
  /// Adds an entry of JSON, which the file does not have.
  Added add_json(std::string key, Json value) {
    return push({std::move(key), std::move(value), true, false});
  }
  /// Adds an entry of the file, which JSON does not have.
  Added add_attribute(std::string key, Json value) {
    return push({std::move(key), std::move(value), false, true});
  }
  /// Adds counters to JSON and to the file. with_rows: whether those with labels have rows in the text.
  template <typename Counters, std::size_t count>
  void add(const CounterRow<Counters> (&table)[count], const Counters& counters, bool with_rows = true) {
    for (const CounterRow<Counters>& counter : table) {
      const Added added = add(counter.key, counters.*counter.member);
      if (with_rows && counter.label != nullptr) added.row(counter.label);
    }
  }

  /// Adds a line to the text, as it is: a title, a row of a table.
  void line(std::string text) { rows_.push_back({"", std::move(text), "", true}); }
  /// Adds a row to the text alone: of words, or of a value.
  void row(const char* label, const std::string& words) { row(label, words, Unit::words); }
  void row(const char* label, const Json& value, Unit unit, const std::string& remark = {});

  /// The entry of this key. Condition: there is one.
  Added operator[](const std::string& key);

  const std::vector<Entry>& entries() const { return entries_; }
  Json json() const;
  std::string text() const;
  /// Returns what a command prints: JSON where it is asked for, or else the text. It ends with a new line.
  std::string words(bool as_json) const { return as_json ? pretty(json()) + "\n" : text(); }

 private:
  struct Row {
    std::string label, value, remark;  // of a line: the value alone
    bool from_left;
  };

  Added push(Entry entry);

  std::size_t label_width_, value_width_;
  std::vector<Entry> entries_;
  std::vector<Row> rows_;
};

/// The seconds of repeats as a value of a report: `best`, `median` and `all`, or null where there are none.
/// The attributes of such an entry are called best_KEY and median_KEY.
Json times(const Seconds& seconds);

}  // namespace tandem
