#include "contact_generation.h"

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

#include "contact_curves.h"
#include "contact_patch.h"

namespace tandem::simulation {
namespace {

// Pairs of bodies that a thread takes at a time. The sums of a chunk are its own, so that they do not depend
// on threads.
constexpr std::size_t kPairsInChunk = 16;

struct Worker {
  BodySide a, b;
  ContactCurves curves;
  ContactPatches patches;
};

struct Chunk {
  std::vector<ContactPoint> points;
  ContactStatistics statistics;
};

Shape make_shape(const AssetView& asset) {
  Shape shape;
  shape.level = asset.level();
  shape.surface = make_surface(shape.level);
  Eigen::Vector3d lower, upper;
  for (int k = 0; k < 3; ++k) {
    shape.origin[k] = asset.header->origin[k];
    lower[k] = asset.header->lower[k], upper[k] = asset.header->upper[k];
  }
  shape.center = (lower + upper) / 2;
  shape.diagonal = (upper - lower).norm();
  return shape;
}

void add_to(ContactStatistics& sum, const ContactStatistics& part) {
  sum.segments += part.segments;
  sum.patches += part.patches;
  sum.open_curves += part.open_curves;
  sum.ambiguous_touches += part.ambiguous_touches;
  sum.candidate_points += part.candidate_points;
  sum.points += part.points;
  sum.area += part.area;
  sum.depth = std::max(sum.depth, part.depth);
}

}  // namespace

struct ContactGenerator::State {
  std::vector<Shape> shapes;
  std::vector<std::size_t> begin;  // of each pair's triangle contacts
  std::vector<Chunk> chunks;
  oneapi::tbb::enumerable_thread_specific<Worker> workers;
  std::vector<ContactPoint> points;
  ContactStatistics statistics;

  void index(const ContactList& found);
  void run_chunk(std::size_t chunk, const ContactList& found, std::span<const BodyPose> bodies,
                 const ContactOptions& options);
};

void ContactGenerator::State::index(const ContactList& found) {
  begin.assign(found.pairs.size() + 1, 0);
  for (const TriangleContact& contact : found.triangles) ++begin[contact.pair + 1];
  for (std::size_t i = 0; i < found.pairs.size(); ++i) begin[i + 1] += begin[i];
}

void ContactGenerator::State::run_chunk(std::size_t chunk, const ContactList& found,
                                        std::span<const BodyPose> bodies, const ContactOptions& options) {
  Worker& worker = workers.local();
  Chunk& out = chunks[chunk];
  out.points.clear();
  out.statistics = {};
  const std::size_t end = std::min((chunk + 1) * kPairsInChunk, found.pairs.size());
  for (std::size_t i = chunk * kPairsInChunk; i < end; ++i) {
    if (begin[i] == begin[i + 1]) continue;
    const ObjectPair& pair = found.pairs[i];
    worker.a.start(shapes[bodies[pair.a].asset], bodies[pair.a].pose);
    worker.b.start(shapes[bodies[pair.b].asset], bodies[pair.b].pose);
    worker.curves.find(std::span(found.triangles).subspan(begin[i], begin[i + 1] - begin[i]), worker.a,
                       worker.b);
    worker.patches.add(worker.curves, worker.a, worker.b, pair, options, out.points, out.statistics);
  }
}

ContactGenerator::ContactGenerator() : state_(std::make_unique<State>()) {}
ContactGenerator::ContactGenerator(ContactGenerator&&) noexcept = default;
ContactGenerator& ContactGenerator::operator=(ContactGenerator&&) noexcept = default;
ContactGenerator::~ContactGenerator() = default;

void ContactGenerator::set_shapes(std::span<const AssetView> shapes) {
  state_->shapes.clear();
  for (const AssetView& asset : shapes) state_->shapes.push_back(make_shape(asset));
}

const std::vector<ContactPoint>& ContactGenerator::generate(const ContactList& found,
                                                            std::span<const BodyPose> bodies,
                                                            const ContactOptions& options) {
  State& state = *state_;
  state.index(found);
  const std::size_t chunks = (found.pairs.size() + kPairsInChunk - 1) / kPairsInChunk;
  state.chunks.resize(chunks);
  oneapi::tbb::parallel_for(std::size_t{0}, chunks,
                            [&](std::size_t i) { state.run_chunk(i, found, bodies, options); });
  state.points.clear();
  state.statistics = {};
  state.statistics.triangle_pairs = found.triangles.size();
  for (const Chunk& chunk : state.chunks) {
    state.points.insert(state.points.end(), chunk.points.begin(), chunk.points.end());
    add_to(state.statistics, chunk.statistics);
  }
  return state.points;
}

const ContactStatistics& ContactGenerator::statistics() const {
  return state_->statistics;
}

}  // namespace tandem::simulation
