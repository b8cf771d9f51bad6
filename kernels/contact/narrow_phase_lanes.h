#pragma once
#include "kernels/common/block_pair_lanes.h"

#ifdef TANDEM_HAVE_LANES
#include "kernels/contact/narrow_phase_walk.h"
#include "kernels/geometry/grid_test.h"

// The narrow phase in vectors of 4, 8 or 16 lanes.
namespace tandem {
namespace {

#if defined(__AVX2__)
TANDEM_INLINE Lanes<8> join(const Lanes4& low, const Lanes4& high) {
  return {_mm256_set_m128(high.v, low.v)};
}
#endif

#if defined(__AVX512F__)
TANDEM_INLINE Lanes<16> join(const Lanes<8>& low, const Lanes<8>& high) {
  const __m512 both = _mm512_maskz_broadcast_f32x8(kAll, low.v);
  return {_mm512_mask_broadcast_f32x8(both, 0xFF00, high.v)};
}
#endif

/// A corner of kCount triangles, by their indices.
template <int kCount>
TANDEM_INLINE frame::Point<Lanes<kCount>> gather(const Triangle* triangles, const std::uint32_t* index,
                                                 int corner) {
  if constexpr (kCount == 4) {
    Lanes4 rows[4];
    for (int i = 0; i < 4; ++i) rows[i] = load(triangles[index[i]].corner[corner].position);
    transpose(rows);
    return {{rows[0], rows[1], rows[2]}};
  } else {
    const auto low = gather<kCount / 2>(triangles, index, corner);
    const auto high = gather<kCount / 2>(triangles, index + kCount / 2, corner);
    return {{join(low.x[0], high.x[0]), join(low.x[1], high.x[1]), join(low.x[2], high.x[2])}};
  }
}

/// Lane i, in every lane.
TANDEM_INLINE Lanes4 spread(const Lanes4& four, int i) {
  const float value = four.v[i];
  return {Lanes4::Floats{value, value, value, value}};
}

/// The plane of lane i, in every lane.
TANDEM_INLINE frame::Plane<Lanes4, true> spread(const frame::Plane<Lanes4, true>& planes, int i) {
  frame::Plane<Lanes4, true> out = planes;
  for (int k = 0; k < 3; ++k) {
    out.origin.x[k] = spread(planes.origin.x[k], i);
    out.normal[k] = spread(planes.normal[k], i);
  }
  out.normal_size = spread(planes.normal_size, i);
  out.normal_error = spread(planes.normal_error, i);
  return out;
}

/// The four boxes of a block, as stored.
TANDEM_INLINE frame::BoxInFrame<Lanes4> four_boxes(const Block& block) {
  frame::BoxInFrame<Lanes4> out;
  for (int k = 0; k < 3; ++k) {
    out.centre[k] = load(block.centre[k]);
    out.half_extent[k] = load(block.half_extent[k]);
  }
  return out;
}

/// The corners of the four triangles of a leaf block; where a node is imaginary, of any other.
TANDEM_INLINE void gather_leaves(const Triangle* triangles, const Block& block,
                                 frame::Point<Lanes4> (&corners)[3]) {
  std::uint32_t index[kNodesPerBlock];
  for (int i = 0; i < kNodesPerBlock; ++i)
    index[i] = block.kind[i] == NodeKind::leaf ? block.index[i] : block.index[0];
  for (int corner = 0; corner < 3; ++corner) corners[corner] = gather<4>(triangles, index, corner);
}

// This is not inlined, so as not to crowd the test of boxes out of registers.
[[gnu::noinline]] std::uint32_t without_beyond_planes(const PairTask& task, const Block& a, const Block& b,
                                                      std::uint32_t hits) {
  const bool leaves_a = a.is_leaf_block();
  frame::Point<Lanes4> corners[3];
  gather_leaves((leaves_a ? task.a : task.b)->tree.triangles, leaves_a ? a : b, corners);
  if (!leaves_a) {
    for (frame::Point<Lanes4>& corner : corners) corner = frame::posed(task.b_in_a, corner);
  }
  const frame::Plane<Lanes4, true> planes(corners[0], corners[1], corners[2], task.frame_error);
  const frame::BoxInFrame<Lanes4> boxes = leaves_a ? frame::posed(task.b_in_a, four_boxes(b)) : four_boxes(a);
  for (int i = 0; i < kNodesPerBlock; ++i) {
    if ((hits & (leaves_a ? row(0xF, i) : column(0xF, i))) == 0) continue;
    const std::uint32_t four = frame::beyond(spread(planes, i), boxes, task.frame_error).mask();
    hits &= ~(leaves_a ? row(four, i) : column(four, i));
  }
  return hits;
}

template <int kCount, FirstStage kStage>
TANDEM_INLINE BatchVerdicts decide_lanes(const PairTask& task, const std::uint32_t* index_a,
                                         const std::uint32_t* index_b) {
  frame::Point<Lanes<kCount>> a[3], b[3];
  for (int corner = 0; corner < 3; ++corner) {
    a[corner] = gather<kCount>(task.a->tree.triangles, index_a, corner);
    b[corner] = frame::posed(task.b_in_a, gather<kCount>(task.b->tree.triangles, index_b, corner));
  }
  const auto verdicts = decide_first<kStage>(a, b, task.frame_error);
  return {verdicts.contact.mask(), verdicts.undecided.mask()};
}

template <int kCount, FirstStage kStage>
TANDEM_INLINE BatchVerdicts decide_batch(const PairTask& task, const Candidates& candidates) {
  BatchVerdicts out = {0, 0};
  for (std::uint32_t first = 0; first < kBatch && first < candidates.count; first += kCount) {
    const auto part = decide_lanes<kCount, kStage>(task, candidates.a + first, candidates.b + first);
    out.contact |= part.contact << first;
    out.undecided |= part.undecided << first;
  }
  return out;
}

// This is not inlined, so as not to crowd the other stages out of registers.
template <int kCount>
[[gnu::noinline]] BatchVerdicts decide_on_grid(const PairTask& task, const Candidates& candidates) {
  return decide_batch<kCount, FirstStage::on_grid>(task, candidates);
}

#if defined(__AVX512F__)
TANDEM_INLINE __m512i indices_of_a(const Block& a) {
  const __m128i four = _mm_load_si128(reinterpret_cast<const __m128i*>(a.index));
  const __m512i lane = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
  return _mm512_maskz_permutexvar_epi32(kAll, lane, _mm512_castsi128_si512(four));
}

TANDEM_INLINE __m512i indices_of_b(const Block& b) {
  return _mm512_maskz_broadcast_i32x4(kAll, _mm_load_si128(reinterpret_cast<const __m128i*>(b.index)));
}

/// Writes the lanes of the bits one after the other, and up to 16 numbers in all.
TANDEM_INLINE void store_chosen(std::uint32_t* to, std::uint32_t bits, __m512i lanes) {
  _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(static_cast<__mmask16>(bits), lanes));
}

/// A BlockPairStack that pushes all children at once: compressed in registers, stored in whole vectors.
class CompressingStack {
 public:
  bool empty() const { return height_ == 0; }
  BlockPair pop() {
    --height_;
    return {a_[height_], b_[height_], mask_[height_]};
  }
  void push(const BlockPair& pair) {
    a_[height_] = pair.a;
    b_[height_] = pair.b;
    mask_[height_++] = pair.mask;
  }
  void push_children(const Block& a, const Block& b, std::uint32_t hits) {
    store_chosen(a_ + height_, hits, indices_of_a(a));
    store_chosen(b_ + height_, hits, indices_of_b(b));
    _mm512_storeu_si512(mask_ + height_, _mm512_set1_epi32(kAllNodePairs));
    height_ += static_cast<std::uint32_t>(__builtin_popcount(hits));
  }

 private:
  std::uint32_t a_[kTraversalStackSize + 16], b_[kTraversalStackSize + 16], mask_[kTraversalStackSize + 16];
  std::uint32_t height_ = 0;
};
#endif

template <int kCount>
TANDEM_INLINE void gather_candidates(const PairTask& task, const Candidates& candidates, std::uint32_t first,
                                     frame::Point<Lanes<kCount>> (&a)[3],
                                     frame::Point<Lanes<kCount>> (&b)[3]) {
  for (int corner = 0; corner < 3; ++corner) {
    a[corner] = gather<kCount>(task.a->tree.triangles, candidates.a + first, corner);
    b[corner] =
        frame::posed(task.b_in_a, gather<kCount>(task.b->tree.triangles, candidates.b + first, corner));
  }
}

template <int kCount>
[[gnu::noinline]] BatchSifted sift_batch(const PairTask& task, const Candidates& candidates) {
  BatchSifted out = {0, 0};
  for (std::uint32_t first = 0; first < kBatch && first < candidates.count; first += kCount) {
    frame::Point<Lanes<kCount>> a[3], b[3];
    gather_candidates<kCount>(task, candidates, first, a, b);
    const auto sifted = distance::sift(a, b, task.clearance, task.first_contact_only);
    out.beyond |= sifted.beyond.mask() << first;
    out.within |= sifted.within.mask() << first;
  }
  return out;
}

template <int kCount>
[[gnu::noinline]] BatchVerdicts decide_batch_within(const PairTask& task, const Candidates& candidates) {
  BatchVerdicts out = {0, 0};
  for (std::uint32_t first = 0; first < kBatch && first < candidates.count; first += kCount) {
    frame::Point<Lanes<kCount>> a[3], b[3];
    gather_candidates<kCount>(task, candidates, first, a, b);
    const auto verdicts = distance::decide_within(a, b, task.clearance);
    out.contact |= verdicts.contact.mask() << first;
    out.undecided |= verdicts.undecided.mask() << first;
  }
  return out;
}

/// A stack of this machine's own, so that what is made of it is too.
class LocalStack : public BlockPairStack {};

template <int kCount>
class LaneMeans {
 public:
#if defined(__AVX512F__)
  using Stack = CompressingStack;
#else
  using Stack = LocalStack;
#endif

  explicit LaneMeans(const PairTask& task) : task_(task) {}

  TANDEM_INLINE std::uint32_t test(const Block& a, const Block& b) const {
    return BlockPairLanes<kCount>(a, b, task_.b_in_a).mask();
  }

  std::uint32_t drop_beyond_planes(const Block& a, const Block& b, std::uint32_t hits) const {
    return without_beyond_planes(task_, a, b, hits);
  }

  TANDEM_INLINE void append(Candidates& candidates, const Block& a, const Block& b,
                            std::uint32_t hits) const {
#if defined(__AVX512F__)
    store_chosen(candidates.a + candidates.count, hits, indices_of_a(a));
    store_chosen(candidates.b + candidates.count, hits, indices_of_b(b));
    candidates.count += static_cast<std::uint32_t>(__builtin_popcount(hits));
#else
    for (; hits != 0; hits &= hits - 1) {
      const int bit = __builtin_ctz(hits);
      candidates.a[candidates.count] = a.index[bit / 4];
      candidates.b[candidates.count++] = b.index[bit % 4];
    }
#endif
  }

  BatchSifted sift(Candidates& candidates) const {
    fill_up(candidates);
    return sift_batch<kCount>(task_, candidates);
  }

  BatchVerdicts decide_within(Candidates& candidates) const {
    fill_up(candidates);
    return decide_batch_within<kCount>(task_, candidates);
  }

  // All stages are inlined, though clearance calls one of them too.
  [[gnu::flatten]] BatchVerdicts decide(Candidates& candidates) const {
    fill_up(candidates);
    if (task_.on_grid) return decide_on_grid<kCount>(task_, candidates);
    return task_.mode == QueryMode::fast ? decide_batch<kCount, FirstStage::as_computed>(task_, candidates)
                                         : decide_batch<kCount, FirstStage::bounded>(task_, candidates);
  }

 private:
  // Lanes beyond the count look at any triangle: the first.
  static void fill_up(Candidates& candidates) {
    for (std::uint32_t i = candidates.count; i < kBatch; ++i) candidates.a[i] = candidates.b[i] = 0;
  }

  const PairTask& task_;
};

}  // namespace
}  // namespace tandem
#endif
