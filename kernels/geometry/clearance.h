#pragma once
#include "kernels/geometry/frame_distance.h"
#include "kernels/geometry/triangle_distance.h"

/// Clearance asks for triangles at most a distance apart, instead of contacts, on CPU and GPU. The float32
/// stages stand in frame_distance.h.
namespace tandem::distance {

/// Widens the tests of a pair by a length in a's frame. What is within it could be moved by no more than
/// that, along each axis, to meet; so to the box tests and the planes of leaves it is one more error of
/// positions, the s of docs/box_test.md and the E of frame_test.h, whose factor of 1.001 it gets too. False:
/// float32 cannot take it.
TANDEM_HD inline bool widen(float length, RelativePose& b_in_a, float& frame_error) {
  const float slack = 1.002f * length;
  for (float& of_a : b_in_a.slack_a) of_a += slack;
  frame_error += slack;
  return frame_error <= static_cast<float>(kLargestInFrame / 4);
}

/// Widens the tests of a pair, made for contacts, by `within`, and tells what the sieve of candidates needs.
/// frame_error: of that name, then with what is within reach too. False: float32 cannot take the pair.
/// pose_a: of stored coordinates.
TANDEM_HD inline bool ask_for_clearance(const Pose& pose_a, double within, RelativePose& b_in_a,
                                        float& frame_error, FrameClearance& clearance) {
  DistanceFrame frame;
  frame.b_in_a = b_in_a;
  frame.error = frame_error;
  if (!bound_lengths(pose_a, frame)) return false;
  clearance = frame_clearance(frame, within);
  return widen(clearance.apart_from, b_in_a, frame_error);
}

/// Returns what float64 knows of two triangles: contact where they are at most so far apart, or meet, apart
/// where they are farther, surely.
TANDEM_HD inline Verdict decide_within_float64(const TrianglePair& pair, double within) {
  const LocalPair local = local_pair(pair);
  if (local.in_range()) {
    // The clearance that is asked for decides, however wide the interval is.
    TriangleWeights weights;
    const DistanceInterval interval = bounded_distance(local, {}, weights);
    if (interval.upper <= within) return Verdict::contact;
    if (interval.lower > within) return Verdict::apart;
  }
  return decide_float64(pair) == Verdict::contact ? Verdict::contact : Verdict::undecided;
}

}  // namespace tandem::distance
