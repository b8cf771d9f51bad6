#include "mesh_message.h"

#include <algorithm>
#include <limits>

namespace tandem::build {
namespace {

constexpr std::uint64_t kBegin = 0x4873654d6d646e54u;
constexpr std::uint64_t kEnd = 0x646e456d646e5421u;

class Writer {
 public:
  explicit Writer(const MessageSink& sink) : sink_(sink) {}

  void number(std::uint64_t value) { sink_(&value, sizeof value); }

  template <class Sequence>
  void sequence(const Sequence& items) {
    number(items.size());
    if (!items.empty()) sink_(items.data(), items.size() * sizeof(items[0]));
  }

 private:
  const MessageSink& sink_;
};

class MessageReader {
 public:
  MessageReader(const MessageSource& source, std::uint64_t most_bytes)
      : source_(source), bytes_left_(most_bytes) {}

  bool number(std::uint64_t& value) { return source_(&value, sizeof value); }

  bool expect(std::uint64_t wanted) {
    std::uint64_t value = 0;
    return number(value) && value == wanted;
  }

  /// Reserved memory is not yet used memory, so an announcement that nothing follows costs address space
  /// alone.
  template <class Sequence>
  bool sequence(Sequence& items) {
    using Item = typename Sequence::value_type;
    std::uint64_t count = 0;
    if (!number(count) || count > bytes_left_ / sizeof(Item)) return false;
    bytes_left_ -= count * sizeof(Item);
    items.clear();
    items.reserve(count);
    constexpr std::uint64_t kAtOnce = std::max<std::uint64_t>(1, (1u << 20) / sizeof(Item));
    while (items.size() < count) {
      const std::size_t before = items.size();
      const std::size_t some = std::min(count - before, kAtOnce);
      items.resize(before + some);
      if (!source_(items.data() + before, some * sizeof(Item))) return false;
    }
    return true;
  }

  template <class Item, class Read>
  bool list(std::vector<Item>& items, const Read& read) {
    std::uint64_t count = 0;
    if (!number(count)) return false;
    for (std::uint64_t i = 0; i < count; ++i) {
      if (bytes_left_ < sizeof(Item)) return false;
      bytes_left_ -= sizeof(Item);
      if (!read(items.emplace_back())) return false;
    }
    return true;
  }

 private:
  const MessageSource& source_;
  std::uint64_t bytes_left_;
};

bool read_part(MessageReader& reader, SourcePart& part) {
  return reader.sequence(part.name) && reader.sequence(part.node_path) && reader.number(part.first_face) &&
         reader.number(part.face_count);
}

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

bool read_mesh(MessageReader& reader, PolygonMesh& mesh) {
  const auto read_text = [&](std::string& text) { return reader.sequence(text); };
  const auto read_one_part = [&](SourcePart& part) { return read_part(reader, part); };
  std::uint64_t single = 0, points = 0, lines = 0, turns = 0;
  if (!reader.sequence(mesh.points) || !reader.sequence(mesh.corners) || !reader.sequence(mesh.face_begin))
    return false;
  if (!reader.list(mesh.parts, read_one_part) || !reader.list(mesh.remarks, read_text)) return false;
  if (!reader.number(points) || !reader.number(lines) || !reader.number(turns)) return false;
  if (!reader.sequence(mesh.reader) || !reader.number(single)) return false;
  mesh.left_out = {points != 0, lines != 0, turns != 0};
  mesh.single_precision = single != 0;
  return mesh.points.size() <= kNoVertex && faces_are_sound(mesh) && parts_are_sound(mesh);
}

void write_mesh(Writer& writer, const PolygonMesh& mesh) {
  writer.sequence(mesh.points);
  writer.sequence(mesh.corners);
  writer.sequence(mesh.face_begin);
  writer.number(mesh.parts.size());
  for (const SourcePart& part : mesh.parts) {
    writer.sequence(part.name);
    writer.sequence(part.node_path);
    writer.number(part.first_face);
    writer.number(part.face_count);
  }
  writer.number(mesh.remarks.size());
  for (const std::string& remark : mesh.remarks) writer.sequence(remark);
  writer.number(mesh.left_out.points);
  writer.number(mesh.left_out.lines);
  writer.number(mesh.left_out.strip_turns);
  writer.sequence(mesh.reader);
  writer.number(mesh.single_precision);
}

}  // namespace

void write_message(const ReadResult& result, const MessageSink& sink) {
  Writer writer(sink);
  writer.number(kBegin);
  writer.number(result.ok);
  writer.sequence(result.error);
  if (result.ok) write_mesh(writer, result.mesh);
  writer.number(kEnd);
}

bool read_message(const MessageSource& source, std::uint64_t most_bytes, ReadResult& result) {
  result = {};
  MessageReader reader(source, most_bytes);
  std::uint64_t ok = 0;
  if (!reader.expect(kBegin) || !reader.number(ok) || !reader.sequence(result.error)) return false;
  if (ok != 0 && !read_mesh(reader, result.mesh)) return false;
  result.ok = ok != 0;
  return reader.expect(kEnd);
}

}  // namespace tandem::build
