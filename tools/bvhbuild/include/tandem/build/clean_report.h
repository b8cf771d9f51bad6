#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace tandem::build {

/// Counts what triangulate(), clean() and to_single_precision() met; 0 means that there was nothing of the
/// kind.
struct CleanReport {
  std::uint64_t faces = 0;     ///< of the file
  std::uint64_t vertices = 0;  ///< of the file

  std::uint64_t faces_index_out_of_range = 0;  ///< dropped: a corner names no vertex
  std::uint64_t faces_too_few_corners = 0;     ///< dropped: two corners or fewer
  std::uint64_t faces_not_finite = 0;          ///< dropped: a corner is NaN or infinite
  std::uint64_t faces_too_large = 0;           ///< dropped: a corner lies beyond +-kMaxCoordinate
  std::uint64_t faces_repeated_corner = 0;     ///< kept: larger faces with two corners in a row in one place
  std::uint64_t faces_not_simple = 0;          ///< kept: the outline crosses itself, so it was split as a fan
  std::uint64_t vertices_unreferenced = 0;     ///< dropped: no face of the file names them
  std::uint64_t vertices_welded = 0;           ///< merged with an earlier vertex at exactly the same place

  std::uint64_t triangles_degenerate = 0;          ///< dropped: the corners lie exactly on one line
  std::uint64_t triangles_duplicate = 0;           ///< kept: same three places as an earlier triangle
  std::uint64_t triangles_duplicate_reversed = 0;  ///< kept: those of the above that face the other way
  std::uint64_t triangles_flattened = 0;           ///< kept: on one line only once rounded to float32
};

/// A line of a report.
struct Finding {
  const char* key;      ///< stable; for JSON
  std::uint64_t count;  ///< may be 0
  std::string what;     ///< for people: "3 faces name a vertex that the file does not have"
  const char* fate;     ///< what became of them: "dropped"
  bool defect;          ///< something is wrong with the mesh; false for mere bookkeeping (welded vertices)
  bool loses_faces;     ///< faces, or triangles of theirs, were dropped for it

  std::string sentence() const { return what + "; " + fate; }
};

/// Returns all findings in a fixed order, those with count 0 included: the text report, --json and --strict
/// share this list.
std::vector<Finding> findings(const CleanReport& report);

}  // namespace tandem::build
