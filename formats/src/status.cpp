#include "tandem/formats/status.h"

namespace tandem {
namespace {

struct Entry {
  Status status;
  const char* name;
  const char* subject;
  const char* sentence;
};

constexpr Entry kEntries[] = {
    {Status::kOk, "Ok", nullptr, "sound"},
    {Status::kFileNotFound, "FileNotFound", nullptr, "no such file"},
    {Status::kNotARegularFile, "NotARegularFile", nullptr, "not a regular file"},
    {Status::kCannotOpen, "CannotOpen", nullptr, "the file cannot be opened"},
    {Status::kCannotRead, "CannotRead", nullptr, "the file cannot be read"},
    {Status::kOutOfMemory, "OutOfMemory", nullptr, "not enough memory"},
    {Status::kMisaligned, "Misaligned", nullptr, "the bytes do not start at a multiple of 128"},
    {Status::kBiovisionMotionCapture, "BiovisionMotionCapture", nullptr,
     "this is Biovision motion capture, which shares the ending .bvh, not a Tandem tree"},
    {Status::kNotTandem, "NotTandem", nullptr, "not a Tandem .bvh file"},
    {Status::kDamagedByTextTransfer, "DamagedByTextTransfer", nullptr,
     "line ends were rewritten on the way: transfer the file in binary mode"},
    {Status::kWrongByteOrder, "WrongByteOrder", nullptr, "written with another byte order"},
    {Status::kUnsupportedVersion, "UnsupportedVersion", nullptr,
     "written in a version of the format that this program does not know"},
    {Status::kTruncated, "Truncated", nullptr, "the file is shorter than its header says"},
    {Status::kTrailingBytes, "TrailingBytes", nullptr, "the file is longer than its header says"},
    {Status::kContentChanged, "ContentChanged", nullptr,
     "the content is not what was written: its hash differs"},
    {Status::kBadHeader, "BadHeader", nullptr, "a field of the header is impossible"},
    {Status::kBadSectionTable, "BadSectionTable", nullptr, "the section table does not fit"},
    {Status::kUnknownSection, "UnknownSection", "section",
     "a section is of a kind or level that does not exist"},
    {Status::kSectionMisaligned, "SectionMisaligned", "section",
     "a section does not start at a multiple of 256"},
    {Status::kSectionOutOfBounds, "SectionOutOfBounds", "section",
     "a section reaches past the end of the file"},
    {Status::kSectionsOverlap, "SectionsOverlap", "section", "sections overlap or are out of order"},
    {Status::kSectionSizeMismatch, "SectionSizeMismatch", "section",
     "a section's bytes are not its count times its element's size"},
    {Status::kSectionMissing, "SectionMissing", "level", "a section that every file needs is missing"},
    {Status::kSectionDuplicated, "SectionDuplicated", "section", "a section exists twice"},
    {Status::kBadGap, "BadGap", "byte", "bytes between sections are not zero or too many"},
    {Status::kBadLevel, "BadLevel", "level", "a level of detail contradicts itself or its sections"},
    {Status::kBadPart, "BadPart", "part", "a source part refers to strings or faces that do not exist"},
    {Status::kBadNodeKind, "BadNodeKind", "block", "a node is of no kind that exists"},
    {Status::kImaginaryBeforeReal, "ImaginaryBeforeReal", "block",
     "an imaginary node comes before a real one in its block"},
    {Status::kEmptyBlock, "EmptyBlock", "block", "a block holds imaginary nodes only"},
    {Status::kPartialLeafBlock, "PartialLeafBlock", "block", "a block mixes leaves and internal nodes"},
    {Status::kBadImaginaryNode, "BadImaginaryNode", "block", "an imaginary node's box is not the empty one"},
    {Status::kBadBox, "BadBox", "block", "a box is not finite or has a negative half-extent"},
    {Status::kChildOutOfRange, "ChildOutOfRange", "block", "a child index lies past the last block"},
    {Status::kChildNotAfterParent, "ChildNotAfterParent", "block",
     "a child block does not come after its parent"},
    {Status::kChildShared, "ChildShared", "block", "a block has two parents"},
    {Status::kBlockUnreachable, "BlockUnreachable", "block", "a block has no parent"},
    {Status::kBlockOrder, "BlockOrder", "block", "blocks are not in depth-first order"},
    {Status::kTooDeep, "TooDeep", "block", "the tree is deeper than the format allows"},
    {Status::kDepthMismatch, "DepthMismatch", nullptr, "the tree's depth is not what the level says"},
    {Status::kLeafCountMismatch, "LeafCountMismatch", nullptr,
     "the tree's leaves are not as many as the level says"},
    {Status::kTriangleOrder, "TriangleOrder", "block",
     "leaves do not name the triangles one after the other"},
    {Status::kTriangleNotFinite, "TriangleNotFinite", "block",
     "a triangle's coordinate is not finite or too large"},
    {Status::kTriangleOutsideLeafBox, "TriangleOutsideLeafBox", "block",
     "a leaf's box does not contain its triangle"},
    {Status::kChildOutsideParentBox, "ChildOutsideParentBox", "block",
     "a box does not contain the boxes below it"},
    {Status::kBadFace, "BadFace", "block", "a triangle names a source face or part that does not exist"},
    {Status::kBoundsMismatch, "BoundsMismatch", nullptr,
     "the header's bounds are not those of the triangles"},
    {Status::kLevelOutsideBounds, "LevelOutsideBounds", "level",
     "a coarser level reaches beyond the bounds of the finest"},
    {Status::kOrientedBlockMismatch, "OrientedBlockMismatch", "oriented block",
     "an oriented block names other children or triangles than the block that it belongs to"},
    {Status::kBadRotation, "BadRotation", "oriented block",
     "an oriented block's rotation is not a legal one"},
    {Status::kBadOrientedBox, "BadOrientedBox", "oriented block",
     "a box or the size of an oriented block is impossible"},
    {Status::kTriangleOutsideOrientedBox, "TriangleOutsideOrientedBox", "oriented block",
     "an oriented box does not contain a triangle below it"},
    {Status::kBadTopology, "BadTopology", "triangle or component",
     "a vertex is out of range, a flag unknown, or a component impossible"},
    {Status::kVertexOrder, "VertexOrder", "triangle", "vertices are not numbered by first appearance"},
    {Status::kVertexMismatch, "VertexMismatch", "triangle",
     "corners at one position have different vertices, or corners at different ones the same"},
    {Status::kEdgeMismatch, "EdgeMismatch", "triangle",
     "a triangle's flags miscount the triangles at an edge"},
    {Status::kBadWinding, "BadWinding", "triangle",
     "a triangle is said to be turned, or not to be, against the triangles around it"},
    {Status::kComponentMismatch, "ComponentMismatch", "component",
     "components are not those of the triangles, or closed ones open"},
    {Status::kOutOfRange, "OutOfRange", "instance", "a coordinate is not finite or too large for a query"},
    {Status::kUnknownAsset, "UnknownAsset", "instance", "an instance of an asset that does not exist"},
    {Status::kUnknownInstance, "UnknownInstance", "pair", "a pair names an instance that does not exist"},
    {Status::kUnknownContact, "UnknownContact", "contact",
     "a contact names a pair or a triangle that does not exist"},
    {Status::kPoseNotRigid, "PoseNotRigid", "instance", "a pose is not a rotation and a translation"},
    {Status::kTooManyInstances, "TooManyInstances", nullptr, "there are 2^32 - 1 instances or more"},
    {Status::kTooManyPairs, "TooManyPairs", nullptr, "there are 2^32 - 1 pairs of instances or more"},
    {Status::kKeptMismatch, "KeptMismatch", nullptr,
     "fixed instances are kept of another number of instances"},
    {Status::kMotionMismatch, "MotionMismatch", nullptr, "there are not as many motions as instances"},
    {Status::kCannotStartThread, "CannotStartThread", nullptr, "a thread could not be started"},
    {Status::kNoOrientedBlocks, "NoOrientedBlocks", nullptr,
     "an asset has no oriented blocks, which exact queries on a GPU walk: build it without --no-gpu-blocks"},
    {Status::kNoAxisAlignedBlocks, "NoAxisAlignedBlocks", nullptr,
     "an asset was uploaded for exact queries alone, and this mode walks its axis-aligned blocks"},
    {Status::kNoTopology, "NoTopology", nullptr,
     "an asset has no topology, which contact manifolds need: build it without --no-topology"},
    {Status::kNoFinestLevel, "NoFinestLevel", nullptr,
     "a query by tolerance needs the finest level, and the asset was given without"},
    {Status::kNoGpu, "NoGpu", nullptr, "there is no GPU that can be used"},
    {Status::kDriverTooOld, "DriverTooOld", nullptr, "the GPU's driver is too old for this program"},
    {Status::kGpuNotSupported, "GpuNotSupported", nullptr,
     "this program was not built for a GPU of this kind; the least is compute capability 8.0"},
    {Status::kOutOfGpuMemory, "OutOfGpuMemory", nullptr, "not enough GPU memory"},
    {Status::kCudaFailed, "CudaFailed", nullptr, "a CUDA call failed"},
};

const Entry* find(Status status) {
  for (const Entry& entry : kEntries) {
    if (entry.status == status) return &entry;
  }
  return nullptr;
}

}  // namespace

const char* name(Status status) {
  const Entry* entry = find(status);
  return entry != nullptr ? entry->name : "Unnamed";
}

const char* subject(Status status) {
  const Entry* entry = find(status);
  return entry != nullptr ? entry->subject : nullptr;
}

const char* explain(Status status) {
  const Entry* entry = find(status);
  return entry != nullptr ? entry->sentence : "a status that this program does not know";
}

}  // namespace tandem
