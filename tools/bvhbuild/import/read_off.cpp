#include <algorithm>
#include <utility>

#include "common/printable.h"
#include "mesh_assembly.h"
#include "readers.h"
#include "scanner.h"

namespace tandem::build {
namespace {

constexpr std::size_t kNumberBytes = 4;  // of a binary file: 32-bit integers and floats, big endian

// The letters before "OFF" say this of a vertex.
struct OffKind {
  bool colour = false, normal = false, texture = false;

  /// Numbers that a binary file stores after the three coordinates.
  std::size_t extra_numbers() const { return (normal ? 3u : 0u) + (colour ? 4u : 0u) + (texture ? 2u : 0u); }
};

struct OffCounts {
  std::int64_t vertices = 0, faces = 0;
};

class OffReader {
 public:
  explicit OffReader(std::string_view bytes) : text_(bytes), mesh_("tandem OFF", bytes.size()) {}

  ReadResult read() {
    const bool ok = header() && (is_binary_ ? read_binary() : read_text());
    return ok ? mesh_.finish() : read_failure(std::move(error_));
  }

 private:
  bool header() {
    text_.skip_space_and_comments();
    const std::string_view word = text_.word();
    if (!word.ends_with("OFF")) {
      const bool counts_come_first = !word.empty() && word[0] >= '0' && word[0] <= '9';
      return counts_come_first || fail_here("'OFF'");
    }
    if (!keyword(word.substr(0, word.size() - 3))) return false;
    text_.skip_word();
    text_.skip_blanks();
    is_binary_ = text_.word() == "BINARY";
    if (!is_binary_) return true;
    text_.skip_word();
    text_.skip_blanks();
    text_.skip_line_end();
    return true;
  }

  bool keyword(std::string_view letters) {
    while (!letters.empty()) {
      std::size_t used = 1;
      if (letters[0] == 'C') {
        kind_.colour = true;
      } else if (letters[0] == 'N') {
        kind_.normal = true;
      } else if (letters.starts_with("ST")) {
        kind_.texture = true;
        used = 2;
      } else if (letters[0] == '4' || letters[0] == 'n') {
        return fail(in_quotes(text_.word()) +
                    " holds points of other than three dimensions, which are not read");
      } else {
        return fail(in_quotes(text_.word()) + " is no kind of OFF file known here");
      }
      letters.remove_prefix(used);
    }
    return true;
  }

  // Before anything is reserved by a count, the file must be able to hold what it counts.
  bool has_room(std::size_t vertex_bytes, std::size_t face_bytes) {
    const std::size_t room = text_.bytes_left() + 1;  // the last line end may be missing
    const auto vertices = static_cast<std::size_t>(promised_.vertices);
    const auto faces = static_cast<std::size_t>(promised_.faces);
    if (vertices > room / vertex_bytes)
      return fail("the header promises " + std::to_string(vertices) +
                  " vertices, the file has room for at most " + std::to_string(room / vertex_bytes));
    if (faces > room / face_bytes)
      return fail("the header promises " + std::to_string(faces) + " faces, the file has room for at most " +
                  std::to_string(room / face_bytes));
    mesh_.reserve_points(vertices);
    mesh_.reserve_faces(faces, std::min(3 * faces, room / face_bytes));
    return true;
  }

  bool read_text() {
    // The shortest vertex is "0 0 0" and a line end, the shortest face "0" and a line end.
    if (!text_counts() || !has_room(6, 2)) return false;
    for (std::int64_t i = 0; i < promised_.vertices; ++i)
      if (!text_vertex()) return false;
    for (std::int64_t i = 0; i < promised_.faces; ++i)
      if (!text_face()) return false;
    text_.skip_space_and_comments();
    if (!text_.at_end())
      return fail("the file goes on after the vertices and faces that its header promises");
    return true;
  }

  bool text_counts() {
    if (!text_count(promised_.vertices) || !text_count(promised_.faces)) return false;
    skip_edge_count();
    return true;
  }

  bool text_count(std::int64_t& count) {
    text_.skip_space_and_comments();
    if (!text_.read_integer(count)) return fail_here("a count");
    return count >= 0 || fail("a count of " + std::to_string(count));
  }

  // Nobody needs the third count, and some programs leave it out: a word on the line of the second one, or
  // alone on the next.
  void skip_edge_count() {
    text_.skip_blanks();
    if (text_.at_line_end() || text_.peek() == '#') {
      TextScanner ahead = text_;
      ahead.skip_space_and_comments();
      ahead.skip_word();
      ahead.skip_blanks();
      if (ahead.at_line_end()) text_ = ahead;
    }
    text_.skip_to_line_end();
  }

  bool text_vertex() {
    Point point;
    for (double& coordinate : point) {
      text_.skip_space_and_comments();
      if (text_.at_end()) return too_few_vertices();
      if (!text_.read_real(coordinate)) return fail_here("a coordinate");
    }
    mesh_.add_point(point);
    text_.skip_to_line_end();
    return true;
  }

  bool text_face() {
    std::int64_t corners = 0;
    text_.skip_space_and_comments();
    if (text_.at_end()) return too_few_faces();
    if (!text_.read_integer(corners)) return fail_here("a count of corners");
    if (corners < 0) return fail("a face of " + std::to_string(corners) + " corners");
    for (std::int64_t i = 0; i < corners; ++i)
      if (!text_index()) return false;
    mesh_.end_face();
    text_.skip_to_line_end();
    return true;
  }

  bool text_index() {
    text_.skip_space_and_comments();
    if (text_.at_end()) return too_few_faces();
    std::int64_t index = 0;
    if (!text_.read_integer(index)) return fail_here("a vertex index");
    corner(index);
    return true;
  }

  bool read_binary() {
    std::int64_t edges = 0;
    if (!take_int(promised_.vertices) || !take_int(promised_.faces) || !take_int(edges))
      return fail("the file ends inside the counts");
    if (promised_.vertices < 0 || promised_.faces < 0) return fail("a negative count");
    const std::size_t vertex_bytes = kNumberBytes * (3 + kind_.extra_numbers());
    if (!has_room(vertex_bytes, 2 * kNumberBytes)) return false;
    for (std::int64_t i = 0; i < promised_.vertices; ++i)
      if (!binary_vertex(vertex_bytes)) return false;
    for (std::int64_t i = 0; i < promised_.faces; ++i)
      if (!binary_face()) return false;
    if (text_.bytes_left() > 0)
      mesh_.remark(std::to_string(text_.bytes_left()) + " bytes after the last face are passed over");
    return true;
  }

  bool binary_vertex(std::size_t bytes) {
    if (text_.bytes_left() < bytes) return too_few_vertices();
    Point point;
    for (std::size_t i = 0; i < 3; ++i)
      point[i] = load_number<float, std::endian::big>(text_.cursor() + i * kNumberBytes);
    mesh_.add_point(point);
    text_.skip_bytes(bytes);
    return true;
  }

  bool binary_face() {
    std::int64_t corners = 0;
    if (!take_int(corners)) return too_few_faces();
    if (corners < 0)
      return fail("face " + std::to_string(mesh_.face_count()) + " has " + std::to_string(corners) +
                  " corners");
    for (std::int64_t i = 0; i < corners; ++i) {
      std::int64_t index = 0;
      if (!take_int(index)) return too_few_faces();
      corner(index);
    }
    mesh_.end_face();
    std::int64_t colour_numbers = 0;
    if (!take_int(colour_numbers)) return too_few_faces();
    const std::size_t left = text_.bytes_left() / kNumberBytes;
    if (colour_numbers < 0 || static_cast<std::size_t>(colour_numbers) > left) return too_few_faces();
    text_.skip_bytes(static_cast<std::size_t>(colour_numbers) * kNumberBytes);
    return true;
  }

  bool take_int(std::int64_t& value) {
    if (text_.bytes_left() < kNumberBytes) return false;
    value = load_number<std::int32_t, std::endian::big>(text_.cursor());
    text_.skip_bytes(kNumberBytes);
    return true;
  }

  void corner(std::int64_t index) {
    mesh_.add_corner(index);
    const bool names_a_vertex = index >= 0 && index < promised_.vertices;
    if (names_a_vertex || !mesh_.wants_index_remark()) return;
    const std::string place =
        is_binary_ ? "face " + std::to_string(mesh_.face_count()) + ": index" : text_.line() + ": face index";
    mesh_.remark_index(place, index, mesh_.point_count());
  }

  bool too_few_vertices() {
    return fail("the header promises " + std::to_string(promised_.vertices) +
                " vertices, the data ends after " + std::to_string(mesh_.point_count()));
  }

  bool too_few_faces() {
    return fail("the header promises " + std::to_string(promised_.faces) + " faces, the data ends after " +
                std::to_string(mesh_.face_count()));
  }

  bool fail_here(std::string_view expected) {
    const std::string found = text_.at_end() ? "the file ends" : in_quotes(text_.word());
    return fail(found + " where " + std::string(expected) + " is expected");
  }

  bool fail(std::string reason) {
    error_ = is_binary_ ? std::move(reason) : text_.line() + ": " + reason;
    return false;
  }

  TextScanner text_;
  MeshAssembly mesh_;
  OffKind kind_;
  OffCounts promised_;
  bool is_binary_ = false;
  std::string error_;
};

}  // namespace

ReadResult read_off(std::string_view bytes) {
  if (bytes.empty()) return read_failure("the file is empty");
  return OffReader(bytes).read();
}

}  // namespace tandem::build
