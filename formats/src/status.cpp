#include "tandem/formats/status.h"

namespace tandem {
namespace {

struct Entry {
  Status status;
  const char* name;
  const char* sentence;
};

constexpr Entry kEntries[] = {
    {Status::kOk, "Ok", "sound"},
    {Status::kFileNotFound, "FileNotFound", "no such file"},
    {Status::kNotARegularFile, "NotARegularFile", "not a regular file"},
    {Status::kCannotOpen, "CannotOpen", "the file cannot be opened"},
    {Status::kCannotRead, "CannotRead", "the file cannot be read"},
    {Status::kOutOfMemory, "OutOfMemory", "not enough memory"},
    {Status::kMisaligned, "Misaligned", "the bytes do not start at a multiple of 128"},
    {Status::kBiovisionMotionCapture, "BiovisionMotionCapture",
     "this is Biovision motion capture, which shares the ending .bvh, not a Tandem tree"},
    {Status::kNotTandem, "NotTandem", "not a Tandem .bvh file"},
    {Status::kDamagedByTextTransfer, "DamagedByTextTransfer",
     "line ends were rewritten on the way: transfer the file in binary mode"},
    {Status::kWrongByteOrder, "WrongByteOrder", "written with another byte order"},
    {Status::kUnsupportedVersion, "UnsupportedVersion",
     "written in a version of the format that this program does not know"},
    {Status::kTruncated, "Truncated", "the file is shorter than its header says"},
    {Status::kTrailingBytes, "TrailingBytes", "the file is longer than its header says"},
    {Status::kContentChanged, "ContentChanged", "the content is not what was written: its hash differs"},
    {Status::kBadHeader, "BadHeader", "a field of the header is impossible"},
    {Status::kBadSectionTable, "BadSectionTable", "the section table does not fit"},
    {Status::kUnknownSection, "UnknownSection", "a section is of no kind that this version defines"},
    {Status::kSectionMisaligned, "SectionMisaligned", "a section does not start at a multiple of 256"},
    {Status::kSectionOutOfBounds, "SectionOutOfBounds", "a section reaches past the end of the file"},
    {Status::kSectionsOverlap, "SectionsOverlap", "sections overlap or are out of order"},
    {Status::kSectionSizeMismatch, "SectionSizeMismatch",
     "a section's bytes are not its count times its element's size"},
    {Status::kSectionMissing, "SectionMissing", "a section that every file needs is missing"},
    {Status::kSectionDuplicated, "SectionDuplicated", "a section exists twice"},
    {Status::kBadGap, "BadGap", "bytes between sections are not zero or too many"},
    {Status::kBadLevel, "BadLevel", "a level of detail contradicts itself or its sections"},
    {Status::kBadPart, "BadPart", "a source part refers to strings or faces that do not exist"},
    {Status::kBadNodeKind, "BadNodeKind", "a node is of no kind that exists"},
    {Status::kImaginaryBeforeReal, "ImaginaryBeforeReal",
     "an imaginary node comes before a real one in its block"},
    {Status::kEmptyBlock, "EmptyBlock", "a block holds imaginary nodes only"},
    {Status::kPartialLeafBlock, "PartialLeafBlock", "a block mixes leaves and internal nodes"},
    {Status::kBadImaginaryNode, "BadImaginaryNode", "an imaginary node's box is not the empty one"},
    {Status::kBadBox, "BadBox", "a box is not finite or has a negative half-extent"},
    {Status::kChildOutOfRange, "ChildOutOfRange", "a child index lies past the last block"},
    {Status::kChildNotAfterParent, "ChildNotAfterParent", "a child block does not come after its parent"},
    {Status::kChildShared, "ChildShared", "a block has two parents"},
    {Status::kBlockUnreachable, "BlockUnreachable", "a block has no parent"},
    {Status::kTooDeep, "TooDeep", "the tree is deeper than the format allows"},
    {Status::kDepthMismatch, "DepthMismatch", "the tree's depth is not what the level says"},
    {Status::kLeafCountMismatch, "LeafCountMismatch", "the tree's leaves are not as many as the level says"},
    {Status::kTriangleOrder, "TriangleOrder", "leaves do not name the triangles one after the other"},
    {Status::kTriangleNotFinite, "TriangleNotFinite", "a triangle's coordinate is not finite or too large"},
    {Status::kTriangleOutsideLeafBox, "TriangleOutsideLeafBox", "a leaf's box does not contain its triangle"},
    {Status::kChildOutsideParentBox, "ChildOutsideParentBox", "a box does not contain the boxes below it"},
    {Status::kBadFace, "BadFace", "a triangle names a source face or part that does not exist"},
    {Status::kBoundsMismatch, "BoundsMismatch", "the header's bounds are not those of the triangles"},
    {Status::kCudaFailed, "CudaFailed", "a CUDA call failed"},
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

const char* explain(Status status) {
  const Entry* entry = find(status);
  return entry != nullptr ? entry->sentence : "a status that this program does not know";
}

}  // namespace tandem
