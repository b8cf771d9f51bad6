#include <algorithm>
#include <filesystem>
#include <numeric>
#include <sstream>

#include "animated_scene.h"
#include "bvhbench/engines/registry.h"
#include "common/number_words.h"
#include "common/output_file.h"
#include "deform.h"
#include "question.h"

namespace tandem::bench {
namespace {

struct DeformArguments : CommonArguments {
  std::optional<std::uint32_t> frames;
  bool rebuild = false, self_pairs = false;
  std::uint32_t leave_out_rings = 0;
  std::vector<std::string> peers;
  std::string asset;

  /// One, unless told: of the CPU, where trees are rebuilt, too.
  std::uint32_t threads() const { return told_threads.value_or(1); }
};

/// The peers' frames, and what they are about.
struct Measured {
  std::uint32_t frames = 0;
  std::uint64_t triangles = 0;  ///< that bend
  std::vector<PeerFrames> peers;
  std::vector<std::uint32_t> common = {};  ///< frames for which all peers have trees

  double update_nanoseconds(const FrameWork& work) const {
    return 1e9 * work.update_seconds / static_cast<double>(triangles);
  }
};

/// Means over the frames for which all peers have trees.
struct PeerMeans {
  double update_nanoseconds = 0, query_seconds = 0, contacts = 0;
  std::optional<double> block_pairs;  ///< where the peer counts them
  std::optional<double> looseness;    ///< the largest, where the peer tells
};

PeerMeans means_of(const Measured& measured, const PeerFrames& peer) {
  PeerMeans means;
  for (const std::uint32_t frame : measured.common) {
    const std::optional<FrameWork>& work = peer.frames[frame];
    means.update_nanoseconds += measured.update_nanoseconds(*work);
    means.query_seconds += work->query_seconds;
    means.contacts += static_cast<double>(work->contacts);
    if (work->block_pairs)
      means.block_pairs = means.block_pairs.value_or(0) + static_cast<double>(*work->block_pairs);
    means.looseness = std::max(means.looseness, work->looseness);
  }
  const double count = std::max(1.0, static_cast<double>(measured.common.size()));
  for (double* sum : {&means.update_nanoseconds, &means.query_seconds, &means.contacts}) *sum /= count;
  if (means.block_pairs) *means.block_pairs /= count;
  return means;
}

// The largest ratio of block pairs of the refitted trees and of those that are rebuilt, of a frame where the
// latter have some.
std::optional<double> worst_ratio(const std::vector<PeerFrames>& peers) {
  std::optional<double> worst;
  for (std::size_t i = 0; i < peers[0].frames.size(); ++i) {
    const std::optional<FrameWork>& rebuilt = peers[1].frames[i];
    if (!rebuilt || *rebuilt->block_pairs == 0) continue;
    const auto refitted = static_cast<double>(*peers[0].frames[i]->block_pairs);
    worst = std::max(worst, std::optional(refitted / static_cast<double>(*rebuilt->block_pairs)));
  }
  return worst;
}

Json frames_of(const Measured& measured, const PeerFrames& peer) {
  Json rows = Json::array();
  for (const std::optional<FrameWork>& work : peer.frames) {
    if (!work) {
      rows.push_back(nullptr);
      continue;
    }
    rows.push_back({{"update_nanoseconds", measured.update_nanoseconds(*work)},
                    {"query_seconds", work->query_seconds},
                    {"contacts", work->contacts},
                    {"block_pairs", or_null(work->block_pairs)},
                    {"looseness", or_null(work->looseness)}});
  }
  return rows;
}

std::string or_dash(const std::optional<double>& value, const char* pattern) {
  char text[32] = "-";
  if (value) std::snprintf(text, sizeof text, pattern, *value);
  return text;
}

// Adds a row for a peer to the text, and what JSON says of it to `peers`.
void add_peer(Report& report, Json& peers, const Measured& measured, const PeerFrames& peer) {
  const PeerMeans means = means_of(measured, peer);
  report.line(format("%-16s%16.2f%12.4f%14.1f%14s%12s", peer.name.c_str(), means.update_nanoseconds,
                     1e3 * means.query_seconds, means.contacts, or_dash(means.block_pairs, "%.1f").c_str(),
                     or_dash(means.looseness, "%.3f").c_str()));
  peers.push_back({{"name", peer.name},
                   {"settings", peer.settings},
                   {"update_nanoseconds", means.update_nanoseconds},
                   {"query_seconds", means.query_seconds},
                   {"contacts", means.contacts},
                   {"block_pairs", or_null(means.block_pairs)},
                   {"looseness", or_null(means.looseness)},
                   {"each_frame", frames_of(measured, peer)}});
}

Report report_of(const DeformArguments& arguments, const Measured& measured) {
  Report report;
  report.line(arguments.scene + ": " + with_commas(measured.frames) + " frames, " +
              with_commas(measured.triangles) + " triangles bend, " +
              (arguments.on_gpu() ? "on a GPU" : threads_words(arguments.threads())));
  report.add({{"tool", "bvhbench deform"},
              {"version", TANDEM_VERSION},
              {"scene", arguments.scene},
              {"output", or_null(arguments.output)},
              {"backend", arguments.backend},
              {"threads", arguments.on_gpu() ? 0 : arguments.threads()},
              {"repeats", arguments.repeats},
              {"self_pairs", arguments.self_pairs},
              {"leave_out_rings", arguments.leave_out_rings},
              {"frames", measured.frames},
              {"common_frames", measured.common.size()},
              {"triangles", measured.triangles}});
  report.line(format("%-16s%16s%12s%14s%14s%12s", "mean of a frame", "update, ns/tri.", "query, ms",
                     "contacts", "block pairs", "looseness"));
  Json peers = Json::array();
  for (const PeerFrames& peer : measured.peers) add_peer(report, peers, measured, peer);
  report.add("peers", std::move(peers));
  if (!arguments.rebuild) return report;
  // A GPU walks other blocks.
  const std::optional<double> worst = arguments.on_gpu() ? std::nullopt : worst_ratio(measured.peers);
  report.add("worst_block_pairs", or_null(worst));
  report.line("refitted and rebuilt trees: the same contacts in every frame" +
              (arguments.on_gpu() ? "" : ", up to " + or_dash(worst, "%.3f") + " times the block pairs"));
  return report;
}

// A row for each peer and frame: docs/scenes.md.
void write_csv(const DeformArguments& arguments, const Measured& measured) {
  std::ostringstream rows;
  rows << "scene,peer,frame,triangles,update_ns,query_ms,contacts,block_pairs,looseness\n";
  const std::string scene = std::filesystem::path(arguments.scene).stem().string();
  for (const PeerFrames& peer : measured.peers) {
    for (std::size_t i = 0; i < peer.frames.size(); ++i) {
      const std::optional<FrameWork>& work = peer.frames[i];
      if (!work) continue;
      rows << scene << ',' << peer.name << ',' << i << ',' << measured.triangles
           << format(",%.5g,%.5g,", measured.update_nanoseconds(*work), 1e3 * work->query_seconds)
           << work->contacts << ',';
      if (work->block_pairs) rows << *work->block_pairs;
      rows << ',' << (work->looseness ? format("%.5g", *work->looseness) : "") << '\n';
    }
  }
  const std::string text = rows.str();
  const std::string reason = write_whole_file(arguments.output, std::as_bytes(std::span(text)));
  if (!reason.empty()) throw OutputError(arguments.output + ": " + reason);
}

Measured measure(const DeformArguments& arguments, const BendingScene& scene, const LoadedScene& names) {
  const DeformOptions options = {arguments.frames.value_or(scene.frames),
                                 arguments.threads(),
                                 arguments.repeats,
                                 arguments.on_gpu(),
                                 arguments.rebuild,
                                 arguments.self_pairs,
                                 arguments.leave_out_rings,
                                 arguments.peers};
  if (options.frames > scene.frames) {
    throw UsageError(arguments.scene + ": has " + std::to_string(scene.frames) + " frames, not " +
                     std::to_string(options.frames));
  }
  Measured measured = {options.frames, scene.bending_triangles(),
                       answer_of(arguments.scene, names, [&] { return measure_frames(scene, options); })};
  for (std::uint32_t frame = 0; frame < options.frames; ++frame) {
    const auto has_frame = [&](const PeerFrames& peer) { return peer.frames[frame].has_value(); };
    if (std::all_of(measured.peers.begin(), measured.peers.end(), has_frame))
      measured.common.push_back(frame);
  }
  return measured;
}

Measured measure_scene(const DeformArguments& arguments) {
  if (!arguments.asset.empty()) throw UsageError("--asset is for animations of glTF files");
  const LoadedScene scene = open_scene(arguments);
  const Deformations deformations(arguments.scene, scene);
  const ScenePairs pairs(scene.description);
  BendingScene bending;
  bending.path = arguments.scene;
  bending.shapes = scene.views();
  bending.instances = scene.description.instances;
  bending.given_pairs = pairs.given();
  bending.filter = pairs.filter();
  bending.bending.assign(deformations.shapes().begin(), deformations.shapes().end());
  bending.frames = deformations.frames();
  bending.positions = [&](std::uint32_t shape, std::uint32_t frame) {
    return deformations.read(shape, frame);
  };
  return measure(arguments, bending, scene);
}

Measured measure_animation(const DeformArguments& arguments) {
  check_output(arguments, {arguments.scene, arguments.asset});
  const AnimatedScene animated(arguments.scene, arguments.asset, arguments.frames.value_or(100),
                               arguments.threads());
  return measure(arguments, animated.scene(), animated.names());
}

ExitCode run_deform(const DeformArguments& arguments) {
  if (arguments.self_pairs && !arguments.peers.empty())
    throw UsageError("--self is for Tandem alone, so --peers does not go with it");
  if (arguments.self_pairs && arguments.on_gpu())
    throw UsageError("--self is for the backend cpu; /pairs of a scene may name an instance twice");
  if (arguments.told_threads && arguments.on_gpu()) throw UsageError("--threads is for the backend cpu");
  const std::string ending = std::filesystem::path(arguments.scene).extension().string();
  const bool is_gltf = ending == ".glb" || ending == ".gltf";
  const Measured measured = is_gltf ? measure_animation(arguments) : measure_scene(arguments);
  if (!arguments.output.empty()) write_csv(arguments, measured);
  print(arguments, report_of(arguments, measured));
  return kDone;
}

std::vector<std::string> peers_of_tandem() {
  std::vector<std::string> names;
  for (const std::string_view name : deforming_engine_names()) {
    if (!name.starts_with("tandem")) names.emplace_back(name);
  }
  return names;
}

std::string joined(const std::vector<std::string>& words) {
  const auto join = [](const std::string& a, const std::string& b) { return a.empty() ? b : a + "," + b; };
  return std::accumulate(words.begin(), words.end(), std::string(), join);
}

}  // namespace

void add_deform(Command tool, Run& run_later) {
  const auto [command, arguments] = add_command<DeformArguments>(
      tool, run_later, "deform",
      "refit the trees of bodies that bend, frame by frame, and find their contacts", run_deform);
  command.add(
      {scene_argument(arguments, "scene file (HDF5) with deformations, or animation (.glb, .gltf)"),
       {"--asset", arguments.asset, "",
        "for an animation: the .bvh file of its mesh; else one is built for it", file_name()},
       backend_option(arguments),
       {"--frames", arguments.frames, "N",
        "the first N frames of a scene, else all; or so many of an animation, else 100", between(1, 4e9)},
       {"--rebuild", arguments.rebuild,
        "also trees that are built anew for every frame, whose contacts must be the same"},
       separated_by_commas({"--peers", arguments.peers, joined(peers_of_tandem()),
                            "other engines, on one thread", one_of(peers_of_tandem())}),
       {"--self", arguments.self_pairs, "also each instance with itself"},
       {"--leave-out-rings", arguments.leave_out_rings, "N [0]",
        "of an instance with itself: leave out triangles that share a vertex (1), or that N - 1 edges join",
        between(0, kMostRings)},
       {"--threads", arguments.told_threads, "N [1]", "threads; the contacts do not depend on them",
        between(1, kMostSceneThreads)},
       repeat_option(arguments, "each frame"),
       output_option(arguments, "the CSV file to write, a row for each peer and frame"),
       json_option(arguments, "all of it")});
}

}  // namespace tandem::bench
