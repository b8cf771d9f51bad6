"""Draws triangles by OpenGL, without a window: Mesa's software renderer does it where there is no GPU. What the scripts that render share."""
import functools
import pathlib

import numpy as np

SUPERSAMPLING = 3  # samples along each side of a pixel
SHADERS = pathlib.Path(__file__).parent / "shaders"


def unit(vectors):
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1)


def axes_of_view(azimuth, elevation):
    """Rows: right, up, and towards the eye. Azimuth 0 looks at things from +x, 90 from +y."""
    a, e = np.radians([azimuth, elevation])
    eye = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.array([right, np.cross(eye, right), eye])


@functools.cache
def context():
    """The OpenGL of this process. Raises ValueError where there is none."""
    try:
        import moderngl
        made = moderngl.create_context(standalone=True, require=430, backend="egl")
    except Exception as error:  # moderngl's errors have no class of their own
        raise ValueError(f"pictures need OpenGL 4.3 (Debian: python3-moderngl libegl1 libgl1 libgl1-mesa-dri): {error}") from error
    made.gc_mode = "auto"  # what Python drops is freed
    return made


@functools.cache
def program(vertex, fragment):
    """The program of two files of shaders/."""
    return context().program(vertex_shader=(SHADERS / vertex).read_text(), fragment_shader=(SHADERS / fragment).read_text())


def set_uniforms(of, **values):
    """Sets those that the program uses; matrices have rows."""
    for name, value in values.items():
        if name in of:
            array = np.asarray(value, "f4" if np.asarray(value).dtype.kind == "f" else "i4")
            of[name].write(array.T.tobytes())


def orthographic(low, high):
    """The projection of a box to that from -1 to 1; what has the greatest z is nearest."""
    scale = 2 / np.maximum(high - low, 1e-9) * [1, 1, -1]
    matrix = np.diag([*scale, 1])
    matrix[:3, 3] = -scale * (high + low) / 2
    return matrix


def attributes(of, step, **columns):
    """Those of the columns that the program uses, as moderngl takes them: with a row for each vertex (step "v") or each instance ("i")."""
    kinds = {name: np.ascontiguousarray(array, "i4" if array.dtype.kind == "i" else "f4") for name, array in columns.items() if name in of}
    return [(context().buffer(array), f"{array.shape[1]}{array.dtype.kind}/{step}", name) for name, array in kinds.items()]


class Buffers:
    """What a picture is drawn to: textures of the same size, and the depth. colours: the number of components and the type of each, as moderngl names it."""

    def __init__(self, size, *colours):
        ctx = context()
        if max(size) > (limit := ctx.info["GL_MAX_TEXTURE_SIZE"]):
            raise ValueError(f"the picture is too large: {limit // SUPERSAMPLING} pixels at most on a side")
        self.colours = [ctx.texture(size, components, dtype=kind) for components, kind in colours]
        for texture in self.colours:
            texture.filter = ctx.NEAREST, ctx.NEAREST
        self.depth = ctx.depth_texture(size)
        self.depth.repeat_x = self.depth.repeat_y = False
        self.frame = ctx.framebuffer(self.colours, self.depth)

    def use(self, *colour):
        """What is drawn next is drawn here, where there is nothing but this colour yet (default: zeros); nearer samples hide others."""
        self.frame.use()
        self.frame.clear(*colour)
        context().enable(context().DEPTH_TEST)

    def read(self, which, kind):
        """A texture, [height, width, components], from the top row on."""
        texture = self.colours[which]
        return np.frombuffer(texture.read(alignment=1), kind).reshape(texture.height, texture.width, texture.components)[::-1]


def shrink(samples):
    """Pixels of samples: their means."""
    height, width = (n // SUPERSAMPLING for n in samples.shape[:2])
    return samples.reshape(height, SUPERSAMPLING, width, SUPERSAMPLING, -1).mean(axis=(1, 3)).round().astype(np.uint8)

