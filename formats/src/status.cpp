#include "tandem/formats/status.h"

namespace tandem {
namespace {

struct Entry {
  Status status;
  const char* name;
  const char* subject;
  const char* sentence;
};

using enum Status;

constexpr Entry kEntries[] = {
    {kOk, "Ok", nullptr, "sound"},
    {kFileNotFound, "FileNotFound", nullptr, "no such file"},
    {kNotARegularFile, "NotARegularFile", nullptr, "not a regular file"},
    {kCannotOpen, "CannotOpen", nullptr, "the file cannot be opened"},
    {kCannotRead, "CannotRead", nullptr, "the file cannot be read"},
    {kOutOfMemory, "OutOfMemory", nullptr, "not enough memory"},
    {kMisaligned, "Misaligned", nullptr, "the bytes do not start at a multiple of 128"},
    {kBiovisionMotionCapture, "BiovisionMotionCapture", nullptr,
     "this is Biovision motion capture, which shares the ending .bvh, not a Tandem tree"},
    {kNotTandem, "NotTandem", nullptr, "not a Tandem .bvh file"},
    {kDamagedByTextTransfer, "DamagedByTextTransfer", nullptr,
     "line ends were rewritten on the way: transfer the file in binary mode"},
    {kWrongByteOrder, "WrongByteOrder", nullptr, "written with another byte order"},
    {kUnsupportedVersion, "UnsupportedVersion", nullptr,
     "written in a version of the format that this program does not know"},
    {kTruncated, "Truncated", nullptr, "the file is shorter than its header says"},
    {kTrailingBytes, "TrailingBytes", nullptr, "the file is longer than its header says"},
    {kContentChanged, "ContentChanged", nullptr, "the content is not what was written: its hash differs"},
    {kBadHeader, "BadHeader", nullptr, "a field of the header is impossible"},
    {kBadSectionTable, "BadSectionTable", nullptr, "the section table does not fit"},
    {kUnknownSection, "UnknownSection", "section", "a section is of a kind or level that does not exist"},
    {kSectionMisaligned, "SectionMisaligned", "section", "a section does not start at a multiple of 256"},
    {kSectionOutOfBounds, "SectionOutOfBounds", "section", "a section reaches past the end of the file"},
    {kSectionsOverlap, "SectionsOverlap", "section", "sections overlap or are out of order"},
    {kSectionSizeMismatch, "SectionSizeMismatch", "section",
     "a section's bytes are not its count times its element's size"},
    {kSectionMissing, "SectionMissing", "level", "a section that every file needs is missing"},
    {kSectionDuplicated, "SectionDuplicated", "section", "a section exists twice"},
    {kBadGap, "BadGap", "byte", "bytes between sections are not zero or too many"},
    {kBadLevel, "BadLevel", "level", "a level of detail contradicts itself or its sections"},
    {kBadPart, "BadPart", "part",
     "a source part refers to strings or faces that do not exist, or to more strings than there are"},
    {kBadNodeKind, "BadNodeKind", "block", "a node is of no kind that exists"},
    {kImaginaryBeforeReal, "ImaginaryBeforeReal", "block",
     "an imaginary node comes before a real one in its block"},
    {kEmptyBlock, "EmptyBlock", "block", "a block holds imaginary nodes only"},
    {kPartialLeafBlock, "PartialLeafBlock", "block", "a block mixes leaves and internal nodes"},
    {kBadImaginaryNode, "BadImaginaryNode", "block", "an imaginary node's box is not the empty one"},
    {kBadBox, "BadBox", "block", "a box is not finite or has a negative half-extent"},
    {kChildOutOfRange, "ChildOutOfRange", "block", "a child index lies past the last block"},
    {kChildNotAfterParent, "ChildNotAfterParent", "block", "a child block does not come after its parent"},
    {kChildShared, "ChildShared", "block", "a block has two parents"},
    {kBlockUnreachable, "BlockUnreachable", "block", "a block has no parent"},
    {kBlockOrder, "BlockOrder", "block", "blocks are not in depth-first order"},
    {kTooDeep, "TooDeep", "block", "the tree is deeper than the format allows"},
    {kDepthMismatch, "DepthMismatch", nullptr, "the tree's depth is not what the level says"},
    {kLeafCountMismatch, "LeafCountMismatch", nullptr, "the tree's leaves are not as many as the level says"},
    {kTriangleOrder, "TriangleOrder", "block", "leaves do not name the triangles one after the other"},
    {kTriangleNotFinite, "TriangleNotFinite", "block", "a triangle's coordinate is not finite or too large"},
    {kTriangleOutsideLeafBox, "TriangleOutsideLeafBox", "block",
     "a leaf's box does not contain its triangle"},
    {kChildOutsideParentBox, "ChildOutsideParentBox", "block", "a box does not contain the boxes below it"},
    {kBadFace, "BadFace", "block", "a triangle names a source face or part that does not exist"},
    {kBoundsMismatch, "BoundsMismatch", nullptr, "the header's bounds are not those of the triangles"},
    {kLevelOutsideBounds, "LevelOutsideBounds", "level",
     "a coarser level reaches beyond the bounds of the finest"},
    {kOrientedBlockMismatch, "OrientedBlockMismatch", "oriented block",
     "an oriented block names other children or triangles than the block that it belongs to"},
    {kBadRotation, "BadRotation", "oriented block", "an oriented block's rotation is not a legal one"},
    {kBadOrientedBox, "BadOrientedBox", "oriented block",
     "a box or the size of an oriented block is impossible"},
    {kTriangleOutsideOrientedBox, "TriangleOutsideOrientedBox", "oriented block",
     "an oriented box does not contain a triangle below it"},
    {kBadTopology, "BadTopology", "triangle or component",
     "a vertex is out of range, a flag unknown, or a component impossible"},
    {kVertexOrder, "VertexOrder", "triangle", "vertices are not numbered by first appearance"},
    {kVertexMismatch, "VertexMismatch", "triangle",
     "corners at one position have different vertices, or corners at different ones the same"},
    {kEdgeMismatch, "EdgeMismatch", "triangle", "a triangle's flags miscount the triangles at an edge"},
    {kBadWinding, "BadWinding", "triangle",
     "a triangle is said to be turned, or not to be, against the triangles around it"},
    {kComponentMismatch, "ComponentMismatch", "component",
     "components are not those of the triangles, or closed ones open"},
    {kSourceVertexMismatch, "SourceVertexMismatch", "vertex",
     "a source vertex is out of range, or two vertices have the same one"},
    {kOutOfRange, "OutOfRange", "instance", "a coordinate is not finite or too large for a query"},
    {kUnknownAsset, "UnknownAsset", "instance", "an instance of an asset that does not exist"},
    {kUnknownInstance, "UnknownInstance", "pair", "a pair names an instance that does not exist"},
    {kUnknownContact, "UnknownContact", "contact",
     "a contact names a pair or a triangle that does not exist"},
    {kPoseNotRigid, "PoseNotRigid", "instance", "a pose is not a rotation and a translation"},
    {kTooManyInstances, "TooManyInstances", nullptr, "there are 2^32 - 1 instances or more"},
    {kTooManyPairs, "TooManyPairs", nullptr, "there are 2^32 - 1 pairs of instances or more"},
    {kKeptMismatch, "KeptMismatch", nullptr, "what is kept is of other instances or pairs"},
    {kMotionMismatch, "MotionMismatch", nullptr, "there are not as many motions as instances"},
    {kCannotStartThread, "CannotStartThread", nullptr, "a thread could not be started"},
    {kNoOrientedBlocks, "NoOrientedBlocks", nullptr,
     "an asset has no oriented blocks, which exact queries on a GPU walk: build it without --no-gpu-blocks"},
    {kNoAxisAlignedBlocks, "NoAxisAlignedBlocks", nullptr,
     "an asset was uploaded for exact queries alone, and this mode walks its axis-aligned blocks"},
    {kNoTopology, "NoTopology", nullptr,
     "an asset has no topology, which contact manifolds need: build it without --no-topology"},
    {kBadOption, "BadOption", nullptr, "an option cannot have this number, or a reserved field is not zero"},
    {kBadReach, "BadReach", nullptr, "`reach` or `within` is negative, not a number or too large"},
    {kBadTolerance, "BadTolerance", nullptr, "a tolerance is negative, not a number or too large"},
    {kBadDuration, "BadDuration", nullptr, "the duration of a step is negative or not finite"},
    {kNoMass, "NoMass", "instance",
     "the mesh of a moving body has no extent, or its density is not positive"},
    {kBadJoint, "BadJoint", "joint",
     "there is no such joint, or its anchors, limits or motor are not such as its kind can have"},
    {kNoAxis, "NoAxis", "joint", "the axis of a hinge or slider has no direction"},
    {kJoinsNothing, "JoinsNothing", "joint", "a joint joins a body to itself, or two that nothing moves"},
    {kNoSourceVertices, "NoSourceVertices", "asset",
     "a file does not say where its vertices come from, which deforming needs: build it without --no-refit"},
    {kVertexCountMismatch, "VertexCountMismatch", "position",
     "there are not as many positions as the asset has source vertices"},
    {kDeformed, "Deformed", "asset", "the question is not offered for deformed assets"},
    {kNotFloat32, "NotFloat32", "asset",
     "the question is not offered where positions are no float32 numbers"},
    {kNoDirection, "NoDirection", "ray", "the direction of a ray is 0"},
    {kNoFinestLevel, "NoFinestLevel", nullptr,
     "a query by tolerance needs the finest level, and the asset was given without"},
    {kNoGpu, "NoGpu", nullptr, "there is no GPU that can be used"},
    {kDriverTooOld, "DriverTooOld", nullptr, "the GPU's driver is too old for this program"},
    {kGpuNotSupported, "GpuNotSupported", nullptr,
     "this program was not built for a GPU of this kind; the least is compute capability 8.0"},
    {kOutOfGpuMemory, "OutOfGpuMemory", nullptr, "not enough GPU memory"},
    {kCudaFailed, "CudaFailed", nullptr, "a CUDA call failed"},
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
