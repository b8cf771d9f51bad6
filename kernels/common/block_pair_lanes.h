#pragma once
#include "kernels/common/lanes.h"

#ifdef TANDEM_HAVE_LANES
#include "kernels/geometry/box_test.h"

// A block pair in vectors of 4, 8 or 16 lanes.
namespace tandem {
namespace {

#if defined(__AVX512F__)
// The forms with a mask: GCC 12 takes the others for uses of an uninitialised variable (GCC bug 105593).
constexpr __mmask16 kAll = 0xFFFF;
#endif

// The node pairs of a block pair lie in lanes 4 i + j, cut into parts of kCount lanes: part kPart of node i
// of four, for each j; and of node j, for each i. GCC 12 sends a shuffle that widens through memory, hence
// the instructions by name.
template <int kCount, int kPart>
TANDEM_INLINE Lanes<kCount> nodes_of_a(const Lanes4& four) {
#if defined(__AVX512F__)
  if constexpr (kCount == 16) {
    const __m512i lane = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
    return {_mm512_maskz_permutexvar_ps(kAll, lane, _mm512_castps128_ps512(four.v))};
  }
#endif
#if defined(__AVX2__)
  if constexpr (kCount == 8) {
    constexpr int k = 2 * kPart;
    const __m256i lane = _mm256_setr_epi32(k, k, k, k, k + 1, k + 1, k + 1, k + 1);
    return {_mm256_permutevar8x32_ps(_mm256_castps128_ps256(four.v), lane)};
  }
#endif
  if constexpr (kCount == 4) return {__builtin_shufflevector(four.v, four.v, kPart, kPart, kPart, kPart)};
}

template <int kCount>
TANDEM_INLINE Lanes<kCount> nodes_of_b(const Lanes4& four) {
#if defined(__AVX512F__)
  if constexpr (kCount == 16) return {_mm512_maskz_broadcast_f32x4(kAll, four.v)};
#endif
#if defined(__AVX2__)
  if constexpr (kCount == 8) return {_mm256_set_m128(four.v, four.v)};
#endif
  if constexpr (kCount == 4) return four;
}

/// The operands of the box tests of a block pair: what depends on one node alone, for four nodes at a time.
class PosedBlockPair {
 public:
  TANDEM_INLINE PosedBlockPair(const Block& a, const Block& b, const RelativePose& pose) : pose_(pose) {
    Lanes4 centre_b[3];
    for (int k = 0; k < 3; ++k) {
      centre_a_[k] = load(a.centre[k]);
      half_extent_a_[k] = load(a.half_extent[k]) + pose.slack_a[k];
      centre_b[k] = load(b.centre[k]);
      half_extent_b_[k] = load(b.half_extent[k]) + pose.slack_b[k];
    }
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) posed_b_[i] = box_terms::posed_centre(pose, i, centre_b);
  }

 protected:
  const RelativePose& pose_;
  Lanes4 centre_a_[3], half_extent_a_[3], posed_b_[3], half_extent_b_[3];
};

template <int kCount>
class BlockPairLanes : PosedBlockPair {
 public:
  using PosedBlockPair::PosedBlockPair;

  /// block_pair_mask().
  TANDEM_INLINE unsigned mask() const {
    if constexpr (kCount == 16)
      return part<0>();
    else if constexpr (kCount == 8)
      return part<0>() | part<1>();
    else
      return part<0>() | part<1>() | part<2>() | part<3>();
  }

 private:
  // What depends on one node alone is worked out for four nodes and spread over the lanes after that. No exit
  // after some axes: 70 to 90 % of block pairs in a traversal have a node pair that passes all of them, and
  // exits cost more than they save (docs/decisions/box-tests.md).
  template <int kPart>
  TANDEM_INLINE unsigned part() const {
    LaneMask<kCount> overlaps = LaneMask<kCount>::all();
    Lanes<kCount> d[3];
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) {
      d[i] = nodes_of_b<kCount>(posed_b_[i]) - nodes_of_a<kCount, kPart>(centre_a_[i]);
      overlaps.require(magnitude(d[i]),
                       nodes_of_a<kCount, kPart>(half_extent_a_[i]) +
                           nodes_of_b<kCount>(box_terms::b_on_face(pose_, i, half_extent_b_)));
    }
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j) {
      overlaps.require(magnitude(box_terms::distance_on_face(pose_, j, d)),
                       nodes_of_b<kCount>(half_extent_b_[j]) +
                           nodes_of_a<kCount, kPart>(box_terms::a_on_face(pose_, j, half_extent_a_)));
    }
    return overlaps.mask() << (kCount * kPart);
  }
};

}  // namespace
}  // namespace tandem
#endif
