#include "write_mesh.h"

#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <system_error>

namespace tandem::makeassets {
namespace {

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
