#include <optional>
#include <utility>

#include "common/printable.h"
#include "mesh_assembly.h"
#include "readers.h"
#include "scanner.h"

namespace tandem::build {
namespace {

class ObjReader {
 public:
  explicit ObjReader(std::string_view bytes) : text_(bytes), mesh_("tandem OBJ", bytes.size()) {}

  ReadResult read() {
    for (text_.skip_space(); !text_.at_end(); text_.skip_space())
      if (!statement()) return read_failure(std::move(error_));
    if (!any_statement_) return read_failure("no line begins with 'v' or 'f': this is not an OBJ file");
    judge_suspects();
    if (any_surface_) mesh_.remark("free-form surfaces are not read");
    return mesh_.finish();
  }

 private:
  // A face that names a vertex which the file has not defined yet. It may still come.
  struct Suspect {
    const char* place;
    std::int64_t written;  // as the file writes it: from 1, or negative to count back

    // An index that may still come is the less likely to come, the larger it is; the others never come.
    std::int64_t doubt() const { return written > 0 ? written : INT64_MAX; }
  };

  // Only v and f can be continued on the next line: what continues any other statement is a line that begins
  // with no keyword known here, and falls away by itself. So a comment or a name that ends in a backslash
  // hides no data.
  bool statement() {
    const std::string_view keyword = text_.word();
    text_.skip_word();
    if (keyword == "v") return vertex();
    if (keyword == "f") return face();
    if (keyword == "o") name(object_);
    if (keyword == "g") name(group_);
    if (keyword == "p") mesh_.leave_out_points();
    if (keyword == "l") mesh_.leave_out_lines();
    if (keyword == "surf") any_surface_ = true;
    text_.skip_to_line_end();
    return true;
  }

  bool vertex() {
    any_statement_ = true;
    Point point;
    for (double& coordinate : point) {
      if (!at_value()) return fail("a vertex needs three coordinates");
      if (!text_.read_real(coordinate)) return fail(in_quotes(text_.word()) + " is not a number");
    }
    mesh_.add_point(point);
    text_.skip_to_line_end();
    return true;
  }

  bool face() {
    any_statement_ = true;
    if (part_begins_) begin_part();
    suspect_in_face_.reset();
    while (at_value()) {
      const char* const place = text_.cursor();
      std::int64_t written = 0;
      if (!text_.read_integer(written, '/')) return fail(in_quotes(text_.word()) + " is not a vertex index");
      if (text_.peek() == '/') text_.skip_word();
      corner(written, place);
    }
    mesh_.end_face();
    if (suspect_in_face_) suspects_.push_back(*suspect_in_face_);
    text_.skip_to_line_end();
    return true;
  }

  void corner(std::int64_t written, const char* place) {
    const auto defined = static_cast<std::int64_t>(mesh_.point_count());
    std::int64_t index = written > 0 ? written - 1 : defined + written;
    if (written == 0) index = -1;
    mesh_.add_corner(index);
    const bool is_defined = index >= 0 && index < defined;
    if (is_defined) return;
    const Suspect suspect{place, written};
    if (!suspect_in_face_ || suspect.doubt() > suspect_in_face_->doubt()) suspect_in_face_ = suspect;
  }

  void name(std::string_view& target) {
    std::string_view text = text_.take_line();
    const std::size_t comment = text.find(" #");
    target = trimmed(text.substr(0, comment));
    part_begins_ = true;
  }

  void begin_part() {
    part_begins_ = false;
    if (object_.empty() || group_.empty()) return mesh_.begin_part(group_.empty() ? object_ : group_, {});
    mesh_.begin_part(group_, std::string(object_) + "/" + std::string(group_));
  }

  // Moves on to the next value of the statement, over the end of a line that a backslash continues.
  bool at_value() {
    for (text_.skip_blanks(); text_.peek() == '\\'; text_.skip_blanks()) {
      text_.skip_bytes(1);
      text_.skip_blanks();
      if (!text_.at_line_end()) return true;
      text_.skip_line_end();
    }
    return !text_.at_line_end() && text_.peek() != '#';
  }

  void judge_suspects() {
    const auto defined = static_cast<std::int64_t>(mesh_.point_count());
    for (const Suspect& suspect : suspects_) {
      if (!mesh_.wants_index_remark()) return;
      const bool came_later = suspect.written > 0 && suspect.written <= defined;
      if (came_later) continue;
      const std::string place = text_.line_at(suspect.place) + ": face index";
      if (suspect.written > 0) mesh_.remark_index(place, suspect.written, mesh_.point_count());
      if (suspect.written == 0) mesh_.remark_index(place + " 0, but OBJ counts vertices from 1");
      if (suspect.written < 0)
        mesh_.remark_index(place + " " + std::to_string(suspect.written) +
                           " counts back past the first vertex");
    }
  }

  bool fail(std::string reason) {
    error_ = text_.line() + ": " + std::move(reason);
    return false;
  }

  TextScanner text_;
  MeshAssembly mesh_;
  std::string_view object_, group_;
  bool part_begins_ = false;
  bool any_statement_ = false;
  bool any_surface_ = false;
  std::optional<Suspect> suspect_in_face_;  // the most doubtful one
  std::vector<Suspect> suspects_;
  std::string error_;
};

}  // namespace

ReadResult read_obj(std::string_view bytes) {
  if (bytes.empty()) return read_failure("the file is empty");
  const std::size_t zero = bytes.find('\0');
  if (zero != std::string_view::npos)
    return read_failure("byte " + std::to_string(zero) +
                        ": a zero byte, where an OBJ file holds only text (UTF-8)");
  return ObjReader(bytes).read();
}

}  // namespace tandem::build
