#include "scene_child.h"

#include <filesystem>
#include <utility>

#include "common/limited_child.h"
#include "common/message.h"

namespace tandem::bench {
namespace {

/// Writes or reads a scene. Stream: a MessageWriter of a constant scene, or a MessageReader.
template <class Stream, class Scene>
bool pass_scene(Stream& stream, Scene& scene) {
  const auto pass_array = [&](auto& array) { return stream.sequence(array); };
  const auto pass_texts = [&](auto& texts) { return stream.list(texts, pass_array); };
  const auto pass_notes = [&](auto& notes) {
    return pass_texts(notes.geometry) && pass_texts(notes.stream) && pass_array(notes.depth);
  };
  return pass_texts(scene.assets) && pass_array(scene.instances) && pass_array(scene.level) &&
         pass_array(scene.filter.motion) && pass_array(scene.filter.group) && pass_array(scene.filter.mask) &&
         pass_array(scene.filter.world) && pass_array(scene.filter.excluded) &&
         stream.optional(scene.pairs, pass_array) && stream.optional(scene.poses, pass_notes);
}

// The error that there was, or nothing, and then the scene.
void send_outcome(const MessageSink& sink, const std::string& path,
                  const std::function<SceneDescription(const std::string&)>& read) {
  SceneDescription scene;
  std::string error;
  try {
    scene = read(path);
  } catch (const FileError& defect) {
    error = defect.what();
  }
  MessageWriter writer(sink);
  writer.sequence(error);
  if (error.empty()) pass_scene(writer, std::as_const(scene));
}

std::string explanation(ChildEnd end) {
  switch (end) {
    case ChildEnd::out_of_time:
      return "reading it takes too long";
    case ChildEnd::out_of_memory:
      return "reading it takes more memory than a file of its size should";
    case ChildEnd::crashed:
      return "damaged: the HDF5 library crashed on it";
    case ChildEnd::finished:
    case ChildEnd::lost:
      break;
  }
  return "damaged: the HDF5 library gave up on it";
}

// A gigabyte serves any scene; more is for files that are large themselves.
std::uint64_t memory_for(const std::string& path) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  return (std::uint64_t{1} << 30) + (error ? 0 : 16 * bytes);
}

}  // namespace

SceneDescription read_in_child(const std::string& path,
                               const std::function<SceneDescription(const std::string&)>& read) {
  constexpr double kSeconds = 300;
  const std::uint64_t memory = memory_for(path);
  LimitedChild child;
  const auto work = [&](const MessageSink& sink) { send_outcome(sink, path, read); };
  const std::string no_child = child.start({kSeconds, memory}, work);
  if (!no_child.empty()) throw std::runtime_error(no_child);
  const MessageSource source = [&](void* to, std::size_t count) { return child.read(to, count); };
  MessageReader reader(source, memory);
  std::string error;
  SceneDescription scene;
  if (!reader.sequence(error)) throw FileError(path + ": " + explanation(child.finish()));
  if (!error.empty()) throw FileError(error);
  if (!pass_scene(reader, scene)) throw FileError(path + ": " + explanation(child.finish()));
  return scene;
}

}  // namespace tandem::bench
