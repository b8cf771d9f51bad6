#pragma once
#include <filesystem>
#include <string_view>

#include "import.h"

/// A reader for each format, in a file of its own. Readers of text and binary formats take a file that is
/// already in memory.
namespace tandem::build {

/// Reads the polygons of a Wavefront OBJ file.
///
/// Result: the v and f statements in the file's order; texture coordinates, normals, materials, points, lines
/// and curves are passed over. Objects and groups become parts: named after the group, or the object where
/// there is no group, with the path "object/group" where there are both.
/// An index that names no vertex of the file is no error: it stays in the mesh, with a remark.
/// Errors: a coordinate or an index that is no number; a file without any v or f; a zero byte.
ReadResult read_obj(std::string_view bytes);

/// Reads the polygons of a PLY file: text, or binary in either byte order.
///
/// Result: the elements "vertex" (x, y, z of any type), "face" and "tristrips" (a list vertex_indices or
/// vertex_index of any types) in the file's order; all other elements and properties are passed over.
/// A file of points alone is ok with no faces. In a strip, the index -1 begins the next one.
/// An index that names no vertex is no error: it stays in the mesh, with a remark.
/// Errors: a header that is cut or breaks the grammar; counts that the data does not meet; lists of negative
/// length; words that are no numbers.
ReadResult read_ply(std::string_view bytes);

/// Reads the facets of an STL file, binary or text.
///
/// Result: three points of their own for each facet (STL shares none), in the file's order; the normals are
/// passed over. The solids of a text file become parts; a facet with more than three vertices is a polygon.
/// The size of a file says first which kind it is, because many binary files begin with "solid".
/// Errors: fewer bytes than a binary file's count of triangles promises; text that is cut or breaks the
/// grammar.
ReadResult read_stl(std::string_view bytes);

/// Reads the polygons of an OFF file: OFF, COFF, NOFF, STOFF and their mixtures,
/// text or binary; in text the keyword may be missing.
///
/// Result: points and faces in the file's order; colours, normals and texture coordinates are passed over. A
/// face may be spread over several lines; what follows its last index on that line counts as its colour.
/// An index that names no vertex is no error: it stays in the mesh, with a remark.
/// Errors: 4OFF and nOFF, which hold no points in space; counts that are not those of the data; words that
/// are no numbers.
ReadResult read_off(std::string_view bytes);

/// Reads a glTF 2 file, text or binary. Buffers in files of their own are looked for in `folder`; unless
/// `limits.outside_files` says otherwise, they must lie there or below.
///
/// Result: the default scene, the first one when none is named, or all nodes when there is no scene: the
/// meshes of all nodes, depth first in the file's order, each instance by itself, with the node transforms
/// accumulated and applied in float64; a node that mirrors its mesh leaves the order of the corners as it is.
/// Positions keep their float32, transforms their float64 value. A part is one mesh at one node. Triangles,
/// strips and fans become faces; points and lines none. A strip's triangle that names a vertex twice only
/// leads the strip elsewhere and is no face. An index that names no vertex of its primitive becomes
/// kNoVertex. Skins and morph targets are not applied, which a remark says unless `is_posed_later`. Images
/// are never looked at. Memory and time are small multiples of what the file and its buffers hold, and of
/// `limits.expansion`. Errors: what is no glTF; buffers that are missing or too short, by name; accessors
/// that reach outside their buffers; nodes that are no tree; extensions that hide the triangles from us, by
/// name; and, before any memory is taken, more vertices and corners, counting each instance, than `limits` or
/// 2^32 - 2 allow.
ReadResult read_gltf(std::string_view bytes, const std::filesystem::path& folder, const ReadLimits& limits,
                     bool is_posed_later = false);

/// Reads a mesh file with assimp in a child process under the limits of `options`, so that its crashes,
/// endless loops and appetite become errors: "assimp crashed (signal 11)". Must be called while the process
/// has a single thread.
///
/// Result: the meshes of all nodes, depth first, each instance by itself, with the node transforms applied in
/// float64; polygons as the file has them; points and lines left out. A part is one mesh at one node. An
/// index that names no vertex of its mesh becomes kNoVertex. Instances that repeat more than
/// `limits.expansion` vertices and faces are refused before they are made.
ReadResult read_in_assimp_child(const std::filesystem::path& path, const ImportOptions& options);

}  // namespace tandem::build
