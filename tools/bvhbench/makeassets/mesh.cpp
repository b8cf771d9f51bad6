#include "mesh.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <system_error>
#include <unordered_map>

namespace tandem::makeassets {
namespace {

class Midpoints {
 public:
  explicit Midpoints(std::vector<Point>& points) : points_(points) {}

  std::uint32_t between(std::uint32_t a, std::uint32_t b) {
    const std::uint64_t edge = std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
    const auto [entry, is_new] = index_.try_emplace(edge, static_cast<std::uint32_t>(points_.size()));
    if (is_new) {
      const Point p = points_[a], q = points_[b];
      points_.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
    }
    return entry->second;
  }

 private:
  std::vector<Point>& points_;
  std::unordered_map<std::uint64_t, std::uint32_t> index_;
};

constexpr std::size_t kBufferBytes = 1 << 20;
constexpr int kDecimals = 6;

class Output {
 public:
  explicit Output(const std::filesystem::path& path) : file_(path, std::ios::binary) {
    buffer_.reserve(kBufferBytes);
  }

  void text(const std::string& s) { append(s.data(), s.size()); }

  template <class Value>
  void binary(Value value) {
    static_assert(std::endian::native == std::endian::little, "the PLY header promises little endian");
    append(reinterpret_cast<const char*>(&value), sizeof value);
  }

  void integer(std::uint64_t value) {
    char digits[24];
    append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr - digits);
  }

  // Shortest of the fixed notation: trailing zeros and a negative zero are left out.
  void decimal(double value) {
    char digits[336];
    char* end = std::to_chars(digits, digits + sizeof digits, value, std::chars_format::fixed, kDecimals).ptr;
    while (end[-1] == '0') --end;
    if (end[-1] == '.') --end;
    const bool is_negative_zero = end - digits == 2 && digits[0] == '-' && digits[1] == '0';
    const char* begin = is_negative_zero ? digits + 1 : digits;
    append(begin, end - begin);
  }

  bool finish() {
    flush();
    file_.close();
    return file_.good();
  }

 private:
  void append(const char* bytes, std::size_t count) {
    if (buffer_.size() + count > kBufferBytes) flush();
    buffer_.append(bytes, count);
  }
  void flush() {
    file_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    buffer_.clear();
  }

  std::ofstream file_;
  std::string buffer_;
};

void write_obj(const Mesh& mesh, const std::string& comment, Output& out) {
  out.text("# " + comment + "\n");
  for (const Point& p : mesh.points) {
    out.text("v");
    for (const double x : p) {
      out.text(" ");
      out.decimal(x);
    }
    out.text("\n");
  }
  for (const Triangle& t : mesh.triangles) {
    out.text("f");
    for (const std::uint32_t corner : t) {
      out.text(" ");
      out.integer(std::uint64_t{corner} + 1);
    }
    out.text("\n");
  }
}

void write_ply(const Mesh& mesh, const std::string& comment, Output& out) {
  out.text("ply\nformat binary_little_endian 1.0\ncomment " + comment + "\nelement vertex " +
           std::to_string(mesh.points.size()) +
           "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
           std::to_string(mesh.triangles.size()) + "\nproperty list uchar uint vertex_indices\nend_header\n");
  for (const Point& p : mesh.points)
    for (const double x : p) out.binary(static_cast<float>(x));
  for (const Triangle& t : mesh.triangles) {
    out.binary(std::uint8_t{3});
    for (const std::uint32_t corner : t) out.binary(corner);
  }
}

}  // namespace

Mesh midpoint_subdivision(const Mesh& mesh) {
  Mesh fine{mesh.points, {}};
  fine.triangles.reserve(4 * mesh.triangles.size());
  Midpoints midpoints(fine.points);
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = midpoints.between(a, b);
    const std::uint32_t bc = midpoints.between(b, c);
    const std::uint32_t ca = midpoints.between(c, a);
    fine.triangles.insert(fine.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return fine;
}

void snap_to_grid(Mesh& mesh, double per_metre) {
  for (Point& p : mesh.points)
    for (double& x : p) x = std::nearbyint(x * per_metre) / per_metre;
}

Mesh unit_cube() {
  Mesh cube;
  // Corner i lies on the upper side of axis k when bit k of i is set.
  for (unsigned i = 0; i < 8; ++i)
    cube.points.push_back({(i & 1) ? 0.5 : -0.5, (i & 2) ? 0.5 : -0.5, (i & 4) ? 0.5 : -0.5});
  constexpr std::array<std::array<std::uint32_t, 4>, 6> kSides = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& [a, b, c, d] : kSides) cube.triangles.insert(cube.triangles.end(), {{a, b, c}, {a, c, d}});
  return cube;
}

std::string write_mesh(const Mesh& mesh, const std::string& comment, const std::filesystem::path& path) {
  const std::filesystem::path aside = path.string() + ".tmp";
  errno = 0;
  Output out(aside);
  if (path.extension() == ".ply")
    write_ply(mesh, comment, out);
  else
    write_obj(mesh, comment, out);
  std::error_code error;
  if (!out.finish()) {
    std::string reason = errno != 0 ? std::strerror(errno) : "could not be written";
    std::filesystem::remove(aside, error);
    return reason;
  }
  std::filesystem::rename(aside, path, error);
  if (!error) return {};
  std::string reason = error.message();
  std::filesystem::remove(aside, error);
  return reason;
}

}  // namespace tandem::makeassets
