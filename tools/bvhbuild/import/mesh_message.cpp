#include "mesh_message.h"

namespace tandem::build {
namespace {

constexpr std::uint64_t kBegin = 0x4873654d6d646e54u;
constexpr std::uint64_t kEnd = 0x646e456d646e5421u;

bool faces_are_sound(const PolygonMesh& mesh) {
  const auto& begin = mesh.face_begin;
  if (begin.empty() || begin.front() != 0 || begin.back() != mesh.corners.size()) return false;
  for (std::size_t f = 1; f < begin.size(); ++f)
    if (begin[f] < begin[f - 1] || begin[f] - begin[f - 1] < 3) return false;
  return true;
}

bool parts_are_sound(const PolygonMesh& mesh) {
  std::uint64_t next = 0;
  for (const SourcePart& part : mesh.parts) {
    if (part.first_face != next || part.face_count > mesh.face_count() - next) return false;
    next += part.face_count;
  }
  return next == mesh.face_count();
}

/// Writes or reads a mesh. Stream: a MessageWriter of a constant mesh, or a MessageReader.
template <class Stream, class Mesh>
bool pass_mesh(Stream& stream, Mesh& mesh) {
  const auto pass_text = [&](auto& text) { return stream.sequence(text); };
  const auto pass_part = [&](auto& part) {
    return pass_text(part.name) && pass_text(part.node_path) && stream.number(part.first_face) &&
           stream.number(part.face_count);
  };
  return stream.sequence(mesh.points) && stream.sequence(mesh.corners) && stream.sequence(mesh.face_begin) &&
         stream.list(mesh.parts, pass_part) && stream.list(mesh.remarks, pass_text) &&
         stream.flag(mesh.left_out.points) && stream.flag(mesh.left_out.lines) &&
         stream.flag(mesh.left_out.strip_turns) && pass_text(mesh.reader) &&
         stream.flag(mesh.single_precision);
}

template <class Stream, class Files>
bool pass_files(Stream& stream, Files& files) {
  return stream.list(files, [&](auto& file) { return stream.sequence(file); });
}

}  // namespace

void write_message(const ReadResult& result, const MessageSink& sink) {
  MessageWriter writer(sink);
  writer.number(kBegin);
  writer.flag(result.ok);
  writer.sequence(result.error);
  if (result.ok) pass_mesh(writer, result.mesh), pass_files(writer, result.files);
  writer.number(kEnd);
}

bool read_message(const MessageSource& source, std::uint64_t most_bytes, ReadResult& result) {
  result = {};
  MessageReader reader(source, most_bytes);
  bool ok = false;
  if (!reader.expect(kBegin) || !reader.flag(ok) || !reader.sequence(result.error)) return false;
  const PolygonMesh& mesh = result.mesh;
  if (ok && !(pass_mesh(reader, result.mesh) && pass_files(reader, result.files) &&
              mesh.points.size() <= kNoVertex && faces_are_sound(mesh) && parts_are_sound(mesh)))
    return false;
  result.ok = ok;
  return reader.expect(kEnd);
}

}  // namespace tandem::build
