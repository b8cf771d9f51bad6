#pragma once
#include <array>
#include <cstring>
#include <new>
#include <span>
#include <vector>

#include "bvhbuild/tree/assemble.h"
#include "bvhbuild/tree/tree.h"
#include "tandem/formats/box.h"
#include "tandem/formats/check.h"

namespace tandem::test {

/// Triangles to build trees over, with the arrays that Geometry looks at.
struct Mesh {
  std::vector<std::array<float, 3>> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  build::Geometry geometry() const { return {points, triangles}; }
  void add(std::array<float, 3> a, std::array<float, 3> b, std::array<float, 3> c);
};

/// Small triangles scattered in the unit cube.
Mesh random_mesh(std::uint32_t triangles, std::uint64_t seed);

/// The bytes of a whole file over this mesh: source face i is triangle i, in two parts.
build::Image make_file(const Mesh& mesh, build::Imaginary imaginary = build::Imaginary::minimal,
                       build::Effort effort = build::Effort::standard);
/// The same file, with what refitting needs: source vertex i is point i of the mesh.
build::Image make_refittable_file(const Mesh& mesh);
build::Image make_file(const Mesh& mesh, const build::Tree& tree,
                       build::Effort effort = build::Effort::standard);

/// The bytes of a file of these levels, whose source has so many faces and vertices.
build::Image assembled(std::span<const build::AssetLevel> levels, std::size_t faces,
                       std::span<const build::SourcePart> parts, std::size_t vertices = 0);

/// A file of several levels, each with all sections that a level can have; level i has the error bound i.
/// Conditions: the first mesh has at least as many triangles as each of the others, and its bounds hold them.
build::Image make_file_of_levels(std::span<const Mesh> meshes);

/// Triangles of random_mesh() and, as coarser levels, fewer and fewer of them.
std::vector<Mesh> random_levels(std::uint32_t triangles, std::uint32_t levels, std::uint64_t seed);

/// A tree as deep as the format allows: each block above the lowest has three leaf blocks below it and one
/// that goes on.
build::Tree deepest_tree(const Mesh& mesh);
inline constexpr std::uint32_t kTrianglesOfDeepestTree = 12 * (kMaxDepth - 1) + 4;  ///< that a mesh needs

/// Bytes in an allocation of exactly their size, aligned as the checker wants: an overrun by one is seen by
/// the sanitizer.
class Bytes {
 public:
  Bytes(const void* data, std::size_t size)
      : data_(static_cast<unsigned char*>(::operator new (size, std::align_val_t{128}))), size_(size) {
    if (size != 0) std::memcpy(data_, data, size);
  }
  explicit Bytes(const build::Image& image) : Bytes(image.data(), image.size()) {}
  Bytes(const Bytes& other) : Bytes(other.data_, other.size_) {}
  Bytes& operator=(const Bytes&) = delete;
  ~Bytes() { ::operator delete (data_, std::align_val_t{128}); }

  unsigned char* data() { return data_; }
  std::size_t size() const { return size_; }
  FileHeader& header() { return *reinterpret_cast<FileHeader*>(data_); }
  Section& section(std::size_t i) { return reinterpret_cast<Section*>(data_ + sizeof(FileHeader))[i]; }
  Section& section(SectionKind kind);

  template <typename Element>
  Element* elements(SectionKind kind) {
    return reinterpret_cast<Element*>(data_ + section(kind).offset);
  }
  Block* blocks() { return elements<Block>(SectionKind::blocks); }
  OrientedBlock* oriented_blocks() { return elements<OrientedBlock>(SectionKind::oriented_blocks); }
  TriangleTopology* topology() { return elements<TriangleTopology>(SectionKind::topology); }
  std::uint32_t* source_vertices() { return elements<std::uint32_t>(SectionKind::source_vertices); }
  SurfaceComponent* components() { return elements<SurfaceComponent>(SectionKind::components); }
  Triangle* triangles() { return elements<Triangle>(SectionKind::triangles); }
  Part* parts() { return elements<Part>(SectionKind::parts); }
  Level& level() { return *elements<Level>(SectionKind::levels); }

  CheckResult check(CheckDepth depth = CheckDepth::full) const { return tandem::check(data_, size_, depth); }
  Status check_sealed() {
    seal(data_, size_);
    return check().status;
  }

 private:
  unsigned char* data_;
  std::size_t size_;
};

}  // namespace tandem::test
