#include "mesh_message.h"

#include <algorithm>
#include <limits>

namespace tandem::build {
namespace {

constexpr std::uint64_t kBegin = 0x4873654d6d646e54u;
constexpr std::uint64_t kEnd = 0x646e456d646e5421u;

/// Writer and MessageReader have the same functions, so that what a message holds is listed once.
class Writer {
 public:
  explicit Writer(const MessageSink& sink) : sink_(sink) {}

  bool number(std::uint64_t value) {
    sink_(&value, sizeof value);
    return true;
  }
  bool flag(bool value) { return number(value); }

  template <class Sequence>
  bool sequence(const Sequence& items) {
    number(items.size());
    if (!items.empty()) sink_(items.data(), items.size() * sizeof(items[0]));
    return true;
  }

  template <class Item, class Write>
  bool list(const std::vector<Item>& items, const Write& write) {
    number(items.size());
    return std::all_of(items.begin(), items.end(), write);
  }

 private:
  const MessageSink& sink_;
};

class MessageReader {
 public:
  MessageReader(const MessageSource& source, std::uint64_t most_bytes)
      : source_(source), bytes_left_(most_bytes) {}

  bool number(std::uint64_t& value) { return source_(&value, sizeof value); }
  bool flag(bool& value) {
    std::uint64_t stored = 0;
    if (!number(stored)) return false;
    value = stored != 0;
    return true;
  }

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

/// Writes or reads a mesh. Stream: a Writer of a constant mesh, or a MessageReader.
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

}  // namespace

void write_message(const ReadResult& result, const MessageSink& sink) {
  Writer writer(sink);
  writer.number(kBegin);
  writer.flag(result.ok);
  writer.sequence(result.error);
  if (result.ok) pass_mesh(writer, result.mesh);
  writer.number(kEnd);
}

bool read_message(const MessageSource& source, std::uint64_t most_bytes, ReadResult& result) {
  result = {};
  MessageReader reader(source, most_bytes);
  bool ok = false;
  if (!reader.expect(kBegin) || !reader.flag(ok) || !reader.sequence(result.error)) return false;
  const PolygonMesh& mesh = result.mesh;
  if (ok && !(pass_mesh(reader, result.mesh) && mesh.points.size() <= kNoVertex && faces_are_sound(mesh) &&
              parts_are_sound(mesh)))
    return false;
  result.ok = ok;
  return reader.expect(kEnd);
}

}  // namespace tandem::build
