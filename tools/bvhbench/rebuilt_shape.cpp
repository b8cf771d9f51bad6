#include "rebuilt_shape.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "common/json.h"

namespace tandem::bench {
namespace {

// The effort of a file, and how many imaginary nodes it may have, as its provenance says; else what bvhbuild
// does without options. The tree is for the CPU, so it gets no oriented blocks.
build::BuildOptions options_of(const AssetView& shape) {
  build::BuildOptions options;
  options.gpu_blocks = false;
  const Json provenance = Json::parse(shape.provenance, nullptr, /*allow_exceptions=*/false);
  if (!provenance.is_object() || !provenance.contains("options")) return options;
  const auto text_of = [&](const char* key) {
    const auto found = provenance["options"].find(key);
    return found != provenance["options"].end() && found->is_string() ? found->get<std::string>() : "";
  };
  const std::string effort = text_of("effort"), imaginary = text_of("imaginary");
  if (effort == "fast") options.effort = build::Effort::fast;
  if (effort == "best") options.effort = build::Effort::best;
  if (imaginary == "free") options.imaginary = build::Imaginary::free;
  if (const double share = std::atof(imaginary.c_str()); share > 0) options.imaginary = {share};
  return options;
}

}  // namespace

// The triangles are in the order of the source file, which decides between splits that cost the same.
RebuiltShape::RebuiltShape(const AssetView& shape)
    : options_(options_of(shape)), points_(shape.header->source_vertices) {
  const LevelView level = shape.level();
  original_.resize(level.triangle_count);
  std::iota(original_.begin(), original_.end(), 0u);
  std::stable_sort(original_.begin(), original_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return level.triangles[a].source_face() < level.triangles[b].source_face();
  });
  for (const std::uint32_t t : original_) {
    const auto& vertex = level.topology[t].vertex;
    const auto source = [&](int corner) { return level.source_vertices[vertex[corner]]; };
    triangles_.push_back({source(0), source(1), source(2)});
  }
}

bool RebuiltShape::build(const Positions& positions, unsigned threads) {
  std::visit(
      [&](const auto& given) {
        for (std::size_t i = 0; i < given.size(); ++i) points_[i / 3][i % 3] = static_cast<double>(given[i]);
      },
      positions);
  options_.threads = threads;
  build::OptimisationWatch watch;
  const build::TriangleSource source = {points_, triangles_, original_, original_.size(), {}};
  built_ = std::move(build::build_asset(source, options_, {}, watch).file);
  return built_.has_value();
}

std::vector<bool> RebuiltShape::kept() const {
  std::vector<bool> kept(original_.size(), false);
  for (std::uint32_t t = 0; t < view().level().triangle_count; ++t) kept[original(t)] = true;
  return kept;
}

}  // namespace tandem::bench
