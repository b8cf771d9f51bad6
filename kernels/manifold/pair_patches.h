#pragma once
#include <algorithm>

#include "kernels/manifold/manifold_lanes.h"
#include "kernels/manifold/manifold_maker.h"
#include "kernels/manifold/region_finder.h"
#include "tandem/kernels/detail/buffer.h"

namespace tandem {

/// A thread that has SIMD lanes to be faster.
struct MeansThread : manifold::OneThread {
  const ManifoldLanes& best;
  const ManifoldLanes& lanes() const { return best; }
};

/// The patches of pairs of bodies that one thread makes, and the memory that it takes.
struct alignas(64) PairPatches {
  Buffer<manifold::Patch> patches;
  std::uint64_t segments = 0, ambiguous_touches = 0;

  void clear() {
    patches.clear();
    segments = ambiguous_touches = 0;
  }

  /// Adds the patches of a pair. False: out of memory.
  template <typename Team>
  bool add(const Team& team, const manifold::BodyPair& bodies, const Contact* contacts, std::uint32_t count,
           const manifold::PatchOptions& options) {
    manifold::PieceMemory memory;
    if (!make_room(count, memory)) return false;
    manifold::CurveFinder<Team> finder(team, bodies, memory);
    manifold::PieceSummary summary = finder.find(contacts, count, outline_.next);
    summary.curves = manifold::RegionFinder<Team>(team, bodies, memory, summary, &regions_).find();
    segments += summary.segments;
    manifold::ManifoldMaker<Team> maker(team, bodies, memory, summary, state_);
    bool enough_memory = true;
    const auto new_patch = [&]() -> manifold::Patch* {
      enough_memory = enough_memory && patches.push({});
      return enough_memory ? &patches[patches.size() - 1] : nullptr;
    };
    for (std::uint32_t region = 0; region < summary.curves; ++region) {
      maker.begin(region, outline_, search_);
      maker.measure(region, options, search_, outline_, depths_);
      ambiguous_touches += state_.kind == manifold::PatchKind::ambiguous;
      maker.finish(region, options, choice_, new_patch);
    }
    return enough_memory;
  }

 private:
  static constexpr std::uint32_t kTableWords =
      std::max(manifold::PieceMemory::kTableWords, ManifoldLanes::kTableWords);

  bool make_room(std::size_t contacts, manifold::PieceMemory& memory) {
    if (!pieces_.resize(contacts) || !normals_.resize(6 * contacts + 1) ||
        !words_.resize((3 + kTableWords) * contacts + 1 + ManifoldLanes::kMoreTableWords))
      return false;
    // The table comes first: it has float64 numbers for a while.
    std::uint32_t *const table = words_.data(), *const word = table + kTableWords * contacts +
                                                              ManifoldLanes::kMoreTableWords;
    memory = {pieces_.data(), normals_.data(), word, word + contacts, word + 2 * contacts, table};
    return true;
  }

  Buffer<manifold::Piece> pieces_;
  Buffer<float> normals_;
  Buffer<std::uint32_t> words_;
  manifold::PatchState state_;
  manifold::RegionMemory regions_;
  manifold::OutlineMemory outline_;
  manifold::SearchMemory depths_;
  manifold::DepthSearch search_;
  manifold::ChoiceMemory choice_;
};

}  // namespace tandem
