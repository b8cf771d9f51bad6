#pragma once
#include "tandem/tandem.h"

/// This is what tandem.mjs needs beside the C interface.
extern "C" {

/// A mesh file that was read, or the reason why it could not be.
typedef struct tandem_web_mesh tandem_web_mesh;

/// Reads the bytes of an OBJ, PLY, STL, OFF or glTF file of triangles and quads, whose kind the name and the
/// first bytes say. Buffers of glTF lie in the file itself. Null where there is no memory.
tandem_web_mesh* tandem_web_read_mesh(const char* name, const char* bytes, size_t count);
void tandem_web_mesh_destroy(tandem_web_mesh* mesh);

/// Returns why there is no mesh; null where there is one. All that follows lives as long as the mesh.
const char* tandem_web_mesh_error(const tandem_web_mesh* mesh);
/// Returns the triangles as tandem_asset_build() takes them.
const tandem_mesh* tandem_web_mesh_rows(const tandem_web_mesh* mesh);
/// Returns oddities of the file, a line each.
const char* tandem_web_mesh_remarks(const tandem_web_mesh* mesh);
}
