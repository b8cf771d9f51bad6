#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

#include "common/printable.h"
#include "mesh_assembly.h"
#include "readers.h"
#include "scanner.h"

namespace tandem::build {
namespace {

constexpr std::size_t kHeaderBytes = 84;  // 80 of free text, then the count
constexpr std::size_t kFacetBytes = 50;   // normal, three vertices, two bytes of attributes

std::string bytes_as_text(double bytes) {
  const char* const units[] = {"bytes", "KiB", "MiB", "GiB"};
  int unit = 0;
  for (; bytes >= 1024 && unit < 3; ++unit) bytes /= 1024;
  return std::to_string(std::llround(bytes)) + " " + units[unit];
}

std::size_t promised_facets(std::string_view bytes) {
  return load_number<std::uint32_t, std::endian::little>(bytes.data() + kHeaderBytes - 4);
}

void add_binary_facet(MeshAssembly& mesh, const char* facet) {
  const char* p = facet + 12;
  for (int corner = 0; corner < 3; ++corner) {
    Point point;
    for (double& coordinate : point) {
      coordinate = load_number<float, std::endian::little>(p);
      p += 4;
    }
    mesh.add_corner(static_cast<std::int64_t>(mesh.point_count()));
    mesh.add_point(point);
  }
  mesh.end_face();
}

ReadResult read_binary(std::string_view bytes) {
  const std::size_t promised = promised_facets(bytes);
  const std::size_t held = (bytes.size() - kHeaderBytes) / kFacetBytes;
  if (promised > held)
    return read_failure("the header promises " + std::to_string(promised) + " triangles (" +
                        bytes_as_text(static_cast<double>(promised) * kFacetBytes) + "), the file holds " +
                        std::to_string(held));
  MeshAssembly mesh("tandem STL", bytes.size());
  mesh.reserve_points(3 * promised);
  mesh.reserve_faces(promised, 3 * promised);
  const char* facet = bytes.data() + kHeaderBytes;
  for (std::size_t i = 0; i < promised; ++i, facet += kFacetBytes) add_binary_facet(mesh, facet);
  const std::size_t rest = bytes.size() - kHeaderBytes - promised * kFacetBytes;
  if (rest > 0) mesh.remark(std::to_string(rest) + " bytes after the last triangle are passed over");
  return mesh.finish();
}

class TextReader {
 public:
  explicit TextReader(std::string_view bytes) : text_(bytes), mesh_("tandem STL", bytes.size()) {}

  ReadResult read() {
    while (accept("solid"))
      if (!solid()) return read_failure(std::move(error_));
    if (!text_.at_end()) {
      fail_expecting("'solid'");
      return read_failure(std::move(error_));
    }
    return mesh_.finish();
  }

  /// Takes the next word if it is `keyword`, whatever its case.
  bool accept(std::string_view keyword) {
    skip_space_and_comments();
    if (!equals_ignoring_case(text_.word(), keyword)) return false;
    text_.skip_word();
    return true;
  }

 private:
  // STL has no comments, but programs write them in all these ways.
  void skip_space_and_comments() {
    for (text_.skip_space();; text_.skip_space()) {
      const char c = text_.peek();
      const bool comment = c == '#' || c == ';' || (c == '/' && text_.word().starts_with("//"));
      if (!comment) return;
      text_.skip_to_line_end();
    }
  }

  bool solid() {
    mesh_.begin_part(text_.take_line(), {});
    while (accept("facet"))
      if (!facet()) return false;
    if (!accept("endsolid")) return fail_expecting("'facet' or 'endsolid'");
    text_.skip_to_line_end();
    return true;
  }

  bool facet() {
    skip_normal();
    if (!loop() || !expect("endfacet")) return false;
    mesh_.end_face();
    return true;
  }

  // Normals are often wrong or no numbers at all, and nobody needs them: whatever stands before the loop
  // falls away.
  void skip_normal() {
    constexpr int kMostWords = 4;  // "normal" and three numbers
    for (int words = 0; words < kMostWords; ++words) {
      skip_space_and_comments();
      if (equals_ignoring_case(text_.word(), "outer")) return;
      text_.skip_word();
    }
  }

  bool loop() {
    if (!expect("outer") || !expect("loop")) return false;
    while (accept("vertex"))
      if (!vertex()) return false;
    return accept("endloop") || fail_expecting("'vertex' or 'endloop'");
  }

  bool vertex() {
    Point point;
    for (double& coordinate : point) {
      skip_space_and_comments();
      if (!text_.read_real(coordinate)) return fail_expecting("a coordinate");
    }
    mesh_.add_corner(static_cast<std::int64_t>(mesh_.point_count()));
    mesh_.add_point(point);
    return true;
  }

  bool expect(std::string_view keyword) {
    return accept(keyword) || fail_expecting("'" + std::string(keyword) + "'");
  }

  bool fail_expecting(std::string_view what) {
    const std::string found = text_.at_end() ? "the file ends" : in_quotes(text_.word());
    error_ = text_.line() + ": " + found + " where " + std::string(what) + " is expected";
    return false;
  }

  TextScanner text_;
  MeshAssembly mesh_;
  std::string error_;
};

// A binary file keeps zero bytes near its start: its count of triangles is below 2^24, or its coordinates are
// floats, or its header is padded. Text has none.
bool is_text(std::string_view bytes) {
  constexpr std::size_t kLooked = 512;
  return TextReader(bytes).accept("solid") && bytes.substr(0, kLooked).find('\0') == std::string_view::npos;
}

}  // namespace

ReadResult read_stl(std::string_view bytes) {
  if (bytes.empty()) return read_failure("the file is empty");
  const bool has_header = bytes.size() >= kHeaderBytes;
  if (has_header && bytes.size() == kHeaderBytes + kFacetBytes * promised_facets(bytes))
    return read_binary(bytes);
  if (is_text(bytes)) return TextReader(bytes).read();
  if (has_header) return read_binary(bytes);
  return read_failure(
      "neither a text STL, which begins with 'solid', nor a binary one, which has at least 84 bytes: this "
      "has " +
      std::to_string(bytes.size()));
}

}  // namespace tandem::build
