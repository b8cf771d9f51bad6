#include "status.h"

namespace tandem::c {
namespace {

// Numbers of the interface and of the libraries, once. What the compiler misses here is a number to be added
// to tandem.h.
tandem_status number_of(Status status) {
#define TANDEM_PAIRS(PAIR)                                         \
  PAIR(kOk, OK)                                                    \
  PAIR(kFileNotFound, FILE_NOT_FOUND)                              \
  PAIR(kNotARegularFile, NOT_A_REGULAR_FILE)                       \
  PAIR(kCannotOpen, CANNOT_OPEN)                                   \
  PAIR(kCannotRead, CANNOT_READ)                                   \
  PAIR(kOutOfMemory, OUT_OF_MEMORY)                                \
  PAIR(kMisaligned, MISALIGNED)                                    \
  PAIR(kBiovisionMotionCapture, BIOVISION_MOTION_CAPTURE)          \
  PAIR(kNotTandem, NOT_TANDEM)                                     \
  PAIR(kDamagedByTextTransfer, DAMAGED_BY_TEXT_TRANSFER)           \
  PAIR(kWrongByteOrder, WRONG_BYTE_ORDER)                          \
  PAIR(kUnsupportedVersion, UNSUPPORTED_VERSION)                   \
  PAIR(kTruncated, TRUNCATED)                                      \
  PAIR(kTrailingBytes, TRAILING_BYTES)                             \
  PAIR(kContentChanged, CONTENT_CHANGED)                           \
  PAIR(kBadHeader, BAD_HEADER)                                     \
  PAIR(kBadSectionTable, BAD_SECTION_TABLE)                        \
  PAIR(kUnknownSection, UNKNOWN_SECTION)                           \
  PAIR(kSectionMisaligned, SECTION_MISALIGNED)                     \
  PAIR(kSectionOutOfBounds, SECTION_OUT_OF_BOUNDS)                 \
  PAIR(kSectionsOverlap, SECTIONS_OVERLAP)                         \
  PAIR(kSectionSizeMismatch, SECTION_SIZE_MISMATCH)                \
  PAIR(kSectionMissing, SECTION_MISSING)                           \
  PAIR(kSectionDuplicated, SECTION_DUPLICATED)                     \
  PAIR(kBadGap, BAD_GAP)                                           \
  PAIR(kBadLevel, BAD_LEVEL)                                       \
  PAIR(kBadPart, BAD_PART)                                         \
  PAIR(kBadNodeKind, BAD_NODE_KIND)                                \
  PAIR(kImaginaryBeforeReal, IMAGINARY_BEFORE_REAL)                \
  PAIR(kEmptyBlock, EMPTY_BLOCK)                                   \
  PAIR(kPartialLeafBlock, PARTIAL_LEAF_BLOCK)                      \
  PAIR(kBadImaginaryNode, BAD_IMAGINARY_NODE)                      \
  PAIR(kBadBox, BAD_BOX)                                           \
  PAIR(kChildOutOfRange, CHILD_OUT_OF_RANGE)                       \
  PAIR(kChildNotAfterParent, CHILD_NOT_AFTER_PARENT)               \
  PAIR(kChildShared, CHILD_SHARED)                                 \
  PAIR(kBlockUnreachable, BLOCK_UNREACHABLE)                       \
  PAIR(kBlockOrder, BLOCK_ORDER)                                   \
  PAIR(kTooDeep, TOO_DEEP)                                         \
  PAIR(kDepthMismatch, DEPTH_MISMATCH)                             \
  PAIR(kLeafCountMismatch, LEAF_COUNT_MISMATCH)                    \
  PAIR(kTriangleOrder, TRIANGLE_ORDER)                             \
  PAIR(kTriangleNotFinite, TRIANGLE_NOT_FINITE)                    \
  PAIR(kTriangleOutsideLeafBox, TRIANGLE_OUTSIDE_LEAF_BOX)         \
  PAIR(kChildOutsideParentBox, CHILD_OUTSIDE_PARENT_BOX)           \
  PAIR(kBadFace, BAD_FACE)                                         \
  PAIR(kBoundsMismatch, BOUNDS_MISMATCH)                           \
  PAIR(kLevelOutsideBounds, LEVEL_OUTSIDE_BOUNDS)                  \
  PAIR(kOrientedBlockMismatch, ORIENTED_BLOCK_MISMATCH)            \
  PAIR(kBadRotation, BAD_ROTATION)                                 \
  PAIR(kBadOrientedBox, BAD_ORIENTED_BOX)                          \
  PAIR(kTriangleOutsideOrientedBox, TRIANGLE_OUTSIDE_ORIENTED_BOX) \
  PAIR(kBadTopology, BAD_TOPOLOGY)                                 \
  PAIR(kVertexOrder, VERTEX_ORDER)                                 \
  PAIR(kVertexMismatch, VERTEX_MISMATCH)                           \
  PAIR(kEdgeMismatch, EDGE_MISMATCH)                               \
  PAIR(kBadWinding, BAD_WINDING)                                   \
  PAIR(kComponentMismatch, COMPONENT_MISMATCH)                     \
  PAIR(kOutOfRange, OUT_OF_RANGE)                                  \
  PAIR(kUnknownAsset, UNKNOWN_ASSET)                               \
  PAIR(kUnknownInstance, UNKNOWN_INSTANCE)                         \
  PAIR(kUnknownContact, UNKNOWN_CONTACT)                           \
  PAIR(kPoseNotRigid, POSE_NOT_RIGID)                              \
  PAIR(kTooManyInstances, TOO_MANY_INSTANCES)                      \
  PAIR(kTooManyPairs, TOO_MANY_PAIRS)                              \
  PAIR(kKeptMismatch, KEPT_MISMATCH)                               \
  PAIR(kMotionMismatch, MOTION_MISMATCH)                           \
  PAIR(kCannotStartThread, CANNOT_START_THREAD)                    \
  PAIR(kNoOrientedBlocks, NO_ORIENTED_BLOCKS)                      \
  PAIR(kNoAxisAlignedBlocks, NO_AXIS_ALIGNED_BLOCKS)               \
  PAIR(kNoTopology, NO_TOPOLOGY)                                   \
  PAIR(kNoFinestLevel, NO_FINEST_LEVEL)                            \
  PAIR(kNoGpu, NO_GPU)                                             \
  PAIR(kDriverTooOld, DRIVER_TOO_OLD)                              \
  PAIR(kGpuNotSupported, GPU_NOT_SUPPORTED)                        \
  PAIR(kOutOfGpuMemory, OUT_OF_GPU_MEMORY)                         \
  PAIR(kCudaFailed, CUDA_FAILED)
  switch (status) {
#define TANDEM_CASE(ours, theirs) \
  case Status::ours:              \
    return TANDEM_##theirs;
    TANDEM_PAIRS(TANDEM_CASE)
#undef TANDEM_CASE
  }
  return TANDEM_INTERNAL_ERROR;
}

}  // namespace

tandem_status to_c(Status status) {
  return number_of(status);
}

bool from_c(tandem_status number, Status& status) {
  switch (number) {
#define TANDEM_CASE(ours, theirs) \
  case TANDEM_##theirs:           \
    status = Status::ours;        \
    return true;
    TANDEM_PAIRS(TANDEM_CASE)
#undef TANDEM_CASE
#undef TANDEM_PAIRS
    default:
      return false;
  }
}

}  // namespace tandem::c
