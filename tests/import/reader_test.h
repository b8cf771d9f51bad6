#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bvhbuild/import/import.h"
#include "mesh_invariants.h"

namespace tandem::build {

using Read = ReadResult (*)(std::string_view);
using Face = std::vector<std::uint32_t>;

/// Reads `bytes` from an allocation of exactly their size, so that a sanitizer sees a reader look one byte
/// too far, and checks what every answer of a reader keeps.
inline ReadResult read_from(Read read, std::string_view bytes) {
  const auto copy = std::make_unique<char[]>(bytes.size());
  std::memcpy(copy.get(), bytes.data(), bytes.size());
  ReadResult result = read({copy.get(), bytes.size()});
  EXPECT_EQ(broken_invariant(result, bytes.size()), "");
  return result;
}

inline std::vector<Face> faces_of(const PolygonMesh& mesh) {
  std::vector<Face> faces;
  for (std::size_t f = 0; f < mesh.face_count(); ++f)
    faces.emplace_back(mesh.corners.begin() + mesh.face_begin[f],
                       mesh.corners.begin() + mesh.face_begin[f + 1]);
  return faces;
}

/// A file that a reader takes, and what is in it.
struct FaceRow {
  const char* what;
  std::string file;
  std::vector<Face> faces;
  std::vector<std::string> remarks = {};
  bool has_any_remarks = false;  ///< remarks are not looked at
};

inline void expect_faces(Read read, const std::vector<FaceRow>& rows) {
  for (const FaceRow& row : rows) {
    SCOPED_TRACE(row.what);
    const ReadResult result = read_from(read, row.file);
    EXPECT_TRUE(result.ok) << result.error;
    EXPECT_EQ(faces_of(result.mesh), row.faces) << row.file;
    if (!row.has_any_remarks) {
      EXPECT_EQ(result.mesh.remarks, row.remarks) << row.file;
    }
  }
}

/// A file that a reader refuses, and what it says.
struct ErrorRow {
  std::string file, error;
};

inline void expect_errors(Read read, const std::vector<ErrorRow>& rows) {
  for (const ErrorRow& row : rows) EXPECT_EQ(read_from(read, row.file).error, row.error) << row.file;
}

/// A whole file reads as `faces` faces; cut anywhere, it never gives more, and never a point that is not a
/// point of the whole one or a number cut short.
inline void expect_cuts_are_harmless(Read read, std::string_view file, std::size_t faces) {
  const ReadResult whole = read_from(read, file);
  ASSERT_TRUE(whole.ok) << whole.error;
  ASSERT_EQ(whole.mesh.face_count(), faces);
  for (std::size_t size = 0; size < file.size(); ++size) {
    const ReadResult cut = read_from(read, file.substr(0, size));
    EXPECT_LE(cut.mesh.face_count(), faces) << "cut at byte " << size;
    EXPECT_LE(cut.mesh.points.size(), whole.mesh.points.size()) << "cut at byte " << size;
  }
}

/// Every byte of a file changed to each of a few others: no crash, no broken promise.
inline void expect_changed_bytes_are_harmless(Read read, std::string file) {
  for (std::size_t i = 0; i < file.size(); ++i) {
    const char kept = file[i];
    for (const char changed : {'\0', '\xFF', '\x80', '\n', '\r', '-', '9', ' ', '\\', '#'}) {
      file[i] = changed;
      read_from(read, file);
    }
    file[i] = kept;
  }
}

}  // namespace tandem::build
