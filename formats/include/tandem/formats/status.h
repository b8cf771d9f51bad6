#pragma once
#include <cstdint>

namespace tandem {

/// Says what is wrong with a .bvh file, with loading it, or with a query: one name per defect. Of a
/// file with several defects the checker returns one. Numbers are those of tandem.h,
/// which never change; those that a GPU finds are below 256.
enum class [[nodiscard]] Status : std::uint32_t{
    kOk = 0,
    // Getting at the bytes.
    kFileNotFound = 100, kNotARegularFile, kCannotOpen, kCannotRead, kOutOfMemory = 4,
    kMisaligned = 104,  ///< bytes in memory must start at a multiple of 128
    // These say what kind of file it is.
    kBiovisionMotionCapture,  ///< the other .bvh: starts with HIERARCHY
    kNotTandem,
    kDamagedByTextTransfer,  ///< ours, but line ends were rewritten on the way
    kWrongByteOrder, kUnsupportedVersion,
    kTruncated,       ///< fewer bytes than the header says
    kTrailingBytes,   ///< more bytes than the header says
    kContentChanged,  ///< the hash differs: some byte is not what was written
    // Header and sections. From here on the hash is right, so the writer is wrong or hostile.
    kBadHeader = 120,  ///< a reserved byte is set, a count is zero or past its limit
    kBadSectionTable,  ///< the table itself does not fit
    kUnknownSection,   ///< of a kind that this version does not define, or of a level that is not in the file
    kSectionMisaligned,    ///< offset no multiple of 256
    kSectionOutOfBounds,   ///< reaches past the end of the file, or its size overflows
    kSectionsOverlap,      ///< or are not in ascending order
    kSectionSizeMismatch,  ///< bytes differ from count times element size
    kSectionMissing, kSectionDuplicated,
    kBadGap,    ///< bytes between sections are not zero or more than alignment asks for
    kBadLevel,  ///< counts of a level that contradict each other or its sections
    kBadPart,   ///< a part whose strings or faces lie outside
    // The tree.
    kBadNodeKind = 140,
    kImaginaryBeforeReal,  ///< imaginary nodes come last in a block
    kEmptyBlock,           ///< a block of imaginary nodes only
    kPartialLeafBlock,     ///< leaves and internal nodes in one block
    kBadImaginaryNode,     ///< box or index of an imaginary node are not the prescribed ones
    kBadBox,               ///< a real node's box is not finite or has a negative half-extent
    kChildOutOfRange,      ///< index past the last block
    kChildNotAfterParent,  ///< would allow a cycle
    kChildShared,          ///< a block with two parents
    kBlockUnreachable,
    kBlockOrder,         ///< a block whose parent comes before it, but not in depth-first order
    kTooDeep,            ///< deeper than kMaxDepth
    kDepthMismatch,      ///< depth differs from what the level says
    kLeafCountMismatch,  ///< leaves, or leaf blocks, differ in number from what the level says
    kTriangleOrder,      ///< leaves, in the order of blocks, must name the triangles 0, 1, 2, ...
    kTriangleNotFinite, kTriangleOutsideLeafBox, kChildOutsideParentBox,
    kBadFace,             ///< source face or part out of range, or a reserved lane set
    kBoundsMismatch,      ///< the header's bounds are not those of level 0's triangles
    kLevelOutsideBounds,  ///< a coarser level reaches beyond the header's bounds
    // The oriented blocks.
    kOrientedBlockMismatch = 170,  ///< an oriented block names other children or triangles than its block
    kBadRotation,                  ///< a rotation that is no quaternion of whole numbers in their range
    kBadOrientedBox,  ///< a box that is none, that reaches too far, or a size that is not the boxes'
    kTriangleOutsideOrientedBox,  ///< of a node above it
    // The topology.
    kBadTopology = 180,  ///< a vertex out of range, an unknown flag set, or a component that is none
    kVertexOrder,        ///< vertices are not numbered by first appearance
    kVertexMismatch,     ///< corners of one vertex at different positions, or the other way round
    kEdgeMismatch,  ///< a boundary or an edge of many triangles where there is none, or the other way round
    kBadWinding,    ///< windings, once turned, disagree or are inside out where that can be known
    kComponentMismatch,  ///< the components are not those of the triangles, or open where said to be closed
    kSourceVertexMismatch,  ///< a source vertex out of range, or two vertices with the same one
    // Querying.
    kOutOfRange = 200,  ///< a coordinate that is NaN or larger than the query can take
    kUnknownAsset,      ///< an instance of an asset that the query was not given
    kUnknownInstance,   ///< an object pair that names an instance that does not exist
    kUnknownContact,    ///< a contact that names an object pair or a triangle that does not exist
    kPoseNotRigid,      ///< not a rotation and a translation, to kRigidTolerance
    kTooManyInstances,  ///< 2^32 - 1 or more
    kTooManyPairs,      ///< 2^32 - 1 object pairs or more
    kKeptMismatch,      ///< what is kept is of other instances or pairs than the question
    kMotionMismatch,    ///< not as many motions as instances
    kCannotStartThread = 5,
    kNoOrientedBlocks = 209,  ///< exact queries on a GPU need them, and the asset was given without
    kNoAxisAlignedBlocks,  ///< the other modes of queries on a GPU need them, and the asset was given without
    kNoTopology,           ///< contact manifolds need it, and the file has none
    kNoFinestLevel,        ///< queries by tolerance need it, and the view leaves it out
    // These say that an option has a value which it cannot have.
    kBadOption = 3,   ///< a number that names no choice, or a count beyond its limits
    kBadReach = 213,  ///< `reach` or `within` is negative, NaN or larger than the query can take
    kBadTolerance,    ///< a tolerance is negative, NaN or larger than the query can take
    kBadDuration,     ///< a step's length is negative or not finite
    kNoMass,          ///< a moving body's mesh has no extent, or its density is not a positive number
    kBadJoint,        ///< a joint that there is not, or with numbers that its kind cannot have
    kNoAxis,          ///< the axis of a hinge or slider has no direction
    kJoinsNothing,    ///< a joint of a body with itself, or of two that nothing moves
    // These are of assets that deform.
    kNoSourceVertices,     ///< the file does not say which vertices its triangles have, so they cannot follow
                           ///< them
    kVertexCountMismatch,  ///< not as many positions as the asset has source vertices
    kDeformed,             ///< the question is not offered for deformed assets
    kNotFloat32,           ///< the question is not offered where positions are no float32 numbers
    kNoDirection,          ///< a ray whose direction is 0
    // These are of a GPU; status_of() of gpu_status.h names CUDA's errors.
    kNoGpu = 300,      ///< none here, none that this process may use, or no driver
    kDriverTooOld,     ///< for the CUDA version that the program was built with
    kGpuNotSupported,  ///< the program holds no code for a GPU of this kind
    kOutOfGpuMemory,
    kCudaFailed,  ///< a call of CUDA failed for another reason
};

/// The name of a defect as written above without the k, for logs and JSON: "ChildShared".
const char* name(Status status);

/// Returns one sentence for people, without a full stop: "a block has two parents".
const char* explain(Status status);

/// Returns what the number counts that comes with a defect: "section", "level", "part", "block", "byte"; null
/// where there is no number.
const char* subject(Status status);

}  // namespace tandem
