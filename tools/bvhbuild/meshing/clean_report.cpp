#include "tandem/build/clean_report.h"

namespace tandem::build {
namespace {

/// "1 face is bad", "3 faces are bad", "1,234 ..." without separators: numbers stay easy to search for.
std::string sentence(std::uint64_t count, const char* noun_one, const char* noun_many, const char* verb_one,
                     const char* verb_many, const char* rest) {
  const bool one = count == 1;
  return std::to_string(count) + " " + (one ? noun_one : noun_many) + " " + (one ? verb_one : verb_many) +
         " " + rest;
}

std::string faces(std::uint64_t count, const char* one, const char* many, const char* rest) {
  return sentence(count, "face", "faces", one, many, rest);
}

std::string vertices(std::uint64_t count, const char* one, const char* many, const char* rest) {
  return sentence(count, "vertex", "vertices", one, many, rest);
}

std::string triangles(std::uint64_t count, const char* one, const char* many, const char* rest) {
  return sentence(count, "triangle", "triangles", one, many, rest);
}

}  // namespace

std::vector<Finding> findings(const CleanReport& r) {
  constexpr bool kDefect = true, kNoDefect = false, kLoses = true, kKeeps = false;
  return {
      {"faces_index_out_of_range", r.faces_index_out_of_range,
       faces(r.faces_index_out_of_range, "names", "name", "a vertex that the file does not have"), "dropped",
       kDefect, kLoses},
      {"faces_too_few_corners", r.faces_too_few_corners,
       faces(r.faces_too_few_corners, "has", "have", "fewer than three corners"), "dropped", kDefect, kLoses},
      {"faces_not_finite", r.faces_not_finite,
       faces(r.faces_not_finite, "has", "have", "a coordinate that is NaN or infinite"), "dropped", kDefect,
       kLoses},
      {"faces_too_large", r.faces_too_large,
       faces(r.faces_too_large, "has", "have", "a coordinate too large for float32"), "dropped", kDefect,
       kLoses},
      {"faces_repeated_corner", r.faces_repeated_corner,
       faces(r.faces_repeated_corner, "has", "have", "two corners in a row in the same place"),
       "taken for one corner", kDefect, kKeeps},
      {"faces_not_simple", r.faces_not_simple,
       faces(r.faces_not_simple, "has", "have", "an outline that crosses itself"), "split as a fan", kDefect,
       kKeeps},
      {"vertices_unreferenced", r.vertices_unreferenced,
       vertices(r.vertices_unreferenced, "belongs", "belong", "to no face"), "dropped", kDefect, kKeeps},
      {"vertices_welded", r.vertices_welded,
       vertices(r.vertices_welded, "lies", "lie", "exactly on an earlier one"), "welded", kNoDefect, kKeeps},
      {"triangles_degenerate", r.triangles_degenerate,
       triangles(r.triangles_degenerate, "has", "have", "all corners on one line"), "dropped", kDefect,
       kLoses},
      {"triangles_duplicate", r.triangles_duplicate,
       triangles(r.triangles_duplicate, "repeats", "repeat", "an earlier one, in either direction"), "kept",
       kDefect, kKeeps},
      {"triangles_duplicate_reversed", r.triangles_duplicate_reversed,
       triangles(r.triangles_duplicate_reversed, "repeats", "repeat",
                 "an earlier one with the opposite orientation"),
       "kept", kDefect, kKeeps},
      {"triangles_flattened", r.triangles_flattened,
       triangles(r.triangles_flattened, "becomes", "become", "flat when rounded to float32"), "kept", kDefect,
       kKeeps},
  };
}

}  // namespace tandem::build
