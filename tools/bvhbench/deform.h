#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bvhbench/engines/engine.h"
#include "bvhbench/scenes/deformations.h"

namespace tandem::bench {

/// Bodies of which some bend, frame by frame.
struct BendingScene {
  std::string path;  ///< of the file that says how
  std::vector<AssetView> shapes;
  std::span<const Instance> instances;
  const std::vector<ObjectPair>* given_pairs = nullptr;  ///< normalised; null: the engine finds them
  PairFilter filter;
  std::vector<std::uint32_t> bending;  ///< shapes that bend, ascending
  std::uint32_t frames = 0;
  std::function<Positions(std::uint32_t shape, std::uint32_t frame)> positions;

  /// The number of triangles of the shapes that bend.
  std::uint64_t bending_triangles() const;
};

/// A shape that bends, and its positions in a frame.
struct ShapeInFrame {
  std::uint32_t shape;
  Positions positions;
};
using FrameOfShapes = std::vector<ShapeInFrame>;

/// Gives the shapes of an engine their positions in frame `number` of the file at `path`. Result: that of
/// Engine::deform(). Throws FileError where they cannot be taken.
std::optional<double> deform(Engine& engine, const FrameOfShapes& frame, const std::string& path,
                             std::uint32_t number);

/// Says what a peer did of a frame. Seconds are the least of the repeats; a query is asked once before it is
/// timed. On a GPU its own clock tells them, and the query is a graph of the broad phase and the contacts.
struct FrameWork {
  double update_seconds = 0;  ///< until its trees are those of the frame: refitted, or built anew
  double query_seconds = 0;
  std::uint64_t contacts = 0;
  std::optional<std::uint64_t> block_pairs;  ///< where the peer counts them
  std::optional<double> looseness;           ///< the largest of the shapes', where the peer tells
};

/// Says what a peer did of all frames.
struct PeerFrames {
  std::string name, settings;
  std::vector<std::optional<FrameWork>> frames;  ///< nothing: the peer has no tree for the frame
};

struct DeformOptions {
  std::uint32_t frames = 0;  ///< how many of the scene's: the first ones
  std::uint32_t threads = 1, repeats = 1;
  bool on_gpu = false;   ///< Tandem's shapes, the first result; else on the CPU
  bool rebuild = false;  ///< trees that are built anew for each frame are a peer too
  bool self_pairs = false;
  std::uint32_t leave_out_rings = 0;  ///< ContactOptions
  std::vector<std::string> peers;     ///< names of engines whose shapes can be deformed, beside Tandem's
};

/// Deforms the bodies frame by frame, and asks each peer for the contacts. The first result is Tandem's; with
/// `rebuild`, that of trees that are rebuilt and asked on the CPU follows. Times are those of this thread
/// where there is one alone, and else of a clock. Throws FileError of the scene, std::runtime_error of a
/// peer, and where a rebuilt tree has other contacts: different pairs of triangles, those aside that are
/// degenerate and that it has not got.
std::vector<PeerFrames> measure_frames(const BendingScene& scene, const DeformOptions& options);

}  // namespace tandem::bench
