"""Pictures of many bodies: a camera on all of them, a sun with soft shadows, a sky that less open places see less of."""
import dataclasses
import functools

import numpy as np

import render
from render import SUPERSAMPLING, unit

MARGIN = 0.03  # of the width, on either side
FIELD_OF_VIEW = np.radians(24)
COLOURS = ("bf826e", "d4ad7a", "9da985", "789997", "8294ac", "9f8aa3", "c69da1", "bcb693", "90a7b8", "a88673",
           "decaa5", "838da2")
GROUND = "cbc6b9"
SKY_ABOVE, SKY_BELOW = "e4eaef", "fbfaf7"
SUN, SUN_FROM = 0.88, (-0.62, 0.66, 0.52)  # its strength, and its direction: right, up and towards the eye
AMBIENT = 0.56
OUTLINE = 0.45  # the share of the light that is left along the outline of a body
CONTACT = "c00018"  # of triangles that meet others; bodies and ground are then pale, and the backdrop is white
GLOW = 0.85  # the light on these triangles that no shadow takes away
SHINE = 0.92  # the share of their colour that shines through a body that hides them closely
PALE_BODY, PALE_GROUND, PALENESS = "f4f5f6", "ffffff", 0.5
SHADOW_TEXELS = 4096
BLUR = 2.5  # the radius of a shadow's edge, in texels
ERROR_SEEN = 0.5  # pixels: a coarser level of detail is drawn where it differs by less


def of_colour(name):
    """Linear light of an sRGB colour in hexadecimal, approximately."""
    return (np.array([int(name[i:i + 2], 16) for i in (0, 2, 4)]) / 255) ** 2.2


def colours(bodies):
    """Linear light that each body reflects; it depends on the number of the body alone."""
    palette = np.array([of_colour(name) for name in COLOURS])
    random = np.random.default_rng(7)
    count = len(bodies.asset)
    chosen = palette[random.integers(len(palette), size=count)] * random.uniform(0.85, 1.1, size=(count, 1))
    ground = GROUND
    if bodies.contacts is not None:
        chosen, ground = PALENESS * of_colour(PALE_BODY) + (1 - PALENESS) * chosen, PALE_GROUND
    return np.where(bodies.fixed[:, None], of_colour(ground), np.minimum(chosen, 1))


def box_corners(bodies, chosen):
    """Corners of the boxes of the chosen bodies, eight of each."""
    boxes = np.array([shape.box for shape in bodies.shapes])[bodies.asset[chosen]]
    corners = np.einsum("nij,nkj->nki", bodies.rotation[chosen], boxes) + bodies.translation[chosen, None]
    return corners.reshape(-1, 3)


@dataclasses.dataclass
class Camera:
    axes: np.ndarray  # rows: right, up, towards the eye
    eye: np.ndarray
    focal: float  # the width in samples of something as wide as it is far away
    size: tuple  # in samples


def camera_on(points, axes, size):
    """The camera along these axes that is as near to the points as the margin allows."""
    focal = size[0] / 2 / np.tan(FIELD_OF_VIEW / 2)
    half = np.array(size) / 2 - MARGIN * size[0]
    seen = points @ axes.T
    middle = (seen.min(axis=0) + seen.max(axis=0))[:2] / 2
    for _ in range(20):  # a fixed point: the distance for a middle, the middle at a distance
        aside = seen[:, :2] - middle
        distance = (seen[:, 2] + focal * (np.abs(aside) / half).max(axis=1)).max()
        at = aside / (distance - seen[:, 2])[:, None]
        middle = middle + 0.5 * (at.min(axis=0) + at.max(axis=0)) * (distance - seen[:, 2].mean())
    return Camera(axes, np.append(middle, distance) @ axes, focal, size)


def rigid(axes, origin):
    """From the world to the frame of these axes, whose rows are in the world, at the origin."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, -axes @ origin
    return matrix


def perspective(camera, near, far):
    x, y = 2 * camera.focal / np.array(camera.size)
    return np.array([[x, 0, 0, 0], [0, y, 0, 0], [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]])


def levels_drawn(bodies, distance, focal):
    """The level of each body that is drawn: the coarsest that differs too little to be seen. With contacts, which are of the finest, that one."""
    level = np.zeros(len(bodies.asset), int)
    if bodies.contacts is None:
        for asset, shape in enumerate(bodies.shapes):
            error = np.maximum.accumulate([mesh.error for mesh in shape.levels])[1:]
            here = bodies.asset == asset
            level[here] = np.searchsorted(error, ERROR_SEEN * SUPERSAMPLING * distance[here] / focal)
    return level


def flags_of_meeting(bodies):
    """Whether each triangle meets others, of all bodies that have such, and where the flags of each body begin (-1: it has none)."""
    flags, first, count = [np.zeros(1, "u4")], np.full(len(bodies.asset), -1, "i4"), 1
    if bodies.contacts is not None:
        for row in np.nonzero(bodies.subject & bodies.contacts.any(axis=1))[0]:
            flags.append(bodies.contacts[row][bodies.shapes[bodies.asset[row]].face].astype("u4"))
            first[row], count = count, count + len(flags[-1])
    return np.concatenate(flags), first


def in_picture(bodies, distance, radius, camera):
    """Whether the balls around the bodies reach into the picture, or nearly."""
    aside = np.abs((bodies.translation - camera.eye) @ camera.axes[:2].T) - radius[:, None]
    return (aside <= np.maximum(distance + radius, 0)[:, None] * np.array(camera.size) / 2 / camera.focal).all(axis=1)


def lit_box(bodies, shown, sun_axes):
    """The least and greatest coordinates, in the sun's frame, of what the map of shadows is of: across the sunlight all that is shown and can be in a
    body's shadow, along it everything."""
    corners = box_corners(bodies, np.ones(len(shown), bool)).reshape(-1, 8, 3) @ sun_axes.T
    lows, highs = corners.min(axis=1), corners.max(axis=1)
    low, high = lows.min(axis=0), highs.max(axis=0)
    for of in (bodies.subject, shown):
        if of.any():
            low[:2] = np.maximum(low[:2], lows[of, :2].min(axis=0))
            high[:2] = np.minimum(high[:2], highs[of, :2].max(axis=0))
    return low, high


class Drawing:
    """Bodies, and the levels of detail that are drawn of them."""

    def __init__(self, bodies, level):
        self.bodies, self.level = bodies, level
        self.colour = colours(bodies).astype("f4")
        flags, first = flags_of_meeting(bodies)
        self.flags = render.context().buffer(flags)
        self.numbers = np.stack([np.arange(len(first)), first], 1).astype("i4")

    def draw(self, program, axes, origin, chosen):
        """Draws the chosen bodies, those with the greatest z in the frame of these axes first."""
        of, ctx = self.bodies, render.context()
        self.flags.bind_to_storage_buffer(0)
        for asset, shape in enumerate(of.shapes):
            for level, mesh in enumerate(shape.levels):
                rows = np.nonzero(chosen & (of.asset == asset) & (self.level == level))[0]
                if not len(rows):
                    continue
                rows = rows[np.argsort(-(of.translation[rows] @ axes[2]), kind="stable")]
                columns = (axes @ of.rotation[rows]).transpose(0, 2, 1).reshape(-1, 9)
                pose = np.concatenate([columns, (of.translation[rows] - origin) @ axes.T], 1).astype("f4")
                (ctx.enable if mesh.closed else ctx.disable)(ctx.CULL_FACE)
                posed = render.attributes(program, "i", pose=pose, colour=self.colour[rows], body_and_flags=self.numbers[rows])
                corners = render.attributes(program, "v", corner=mesh.points)
                ctx.vertex_array(program, corners + posed, ctx.buffer(mesh.corners.astype("i4"))).render(instances=len(rows))


@functools.cache
def buffers(size, picture_size):
    """Two for what the samples show, of all triangles and of those that meet others, the sun's, and that of the picture."""
    of_samples = ((4, "f4"), (2, "i4"), (4, "f2"))
    return [render.Buffers(*of) for of in ((size, *of_samples), (size, *of_samples), ((SHADOW_TEXELS,) * 2,), (picture_size, (3, "f1")))]


def picture(bodies, camera):
    """sRGB bytes, [height, width, 3], of the camera's size divided by SUPERSAMPLING."""
    ctx = render.context()
    seen, meeting, shadow, image = buffers(camera.size, tuple(n // SUPERSAMPLING for n in camera.size))
    everything, subject = np.ones(len(bodies.asset), bool), bodies.subject
    diagonal = np.median(bodies.diagonals[subject])
    distance = (camera.eye - bodies.translation) @ camera.axes[2]
    drawing = Drawing(bodies, levels_drawn(bodies, distance, camera.focal))

    radius = np.array([np.linalg.norm(shape.points, axis=1).max() for shape in bodies.shapes])[bodies.asset]
    far = (distance + radius).max()
    surfaces = render.program("body.vert", "body.frag")
    render.set_uniforms(surfaces, projection=perspective(camera, max((distance - radius).min(), 1e-3 * far), far))
    for buffer, meeting_alone in ((seen, False), (meeting, True))[:1 if bodies.contacts is None else 2]:
        buffer.use()
        render.set_uniforms(surfaces, meeting_alone=meeting_alone)
        drawing.draw(surfaces, camera.axes, camera.eye, everything)

    sun = unit(np.array(SUN_FROM) @ camera.axes)
    right = unit(np.cross([0.0, 0.0, 1.0], sun))
    sun_axes = np.array([right, np.cross(sun, right), sun])
    low, high = lit_box(bodies, in_picture(bodies, distance, radius, camera), sun_axes)
    from_sun = render.orthographic(low, high)
    depths = render.program("body.vert", "depth.frag")
    render.set_uniforms(depths, projection=from_sun)
    shadow.use()
    drawing.draw(depths, sun_axes, np.zeros(3), everything)

    to_texture = np.diag([0.5, 0.5, 0.5, 1]) + np.outer([0.5, 0.5, 0.5, 0], [0, 0, 0, 1])
    lights = render.program("whole.vert", "light.frag")
    render.set_uniforms(
        lights, focal=camera.focal, sun=camera.axes @ sun, up=camera.axes[:, 2], reach=0.4 * diagonal, glow_reach=diagonal,
        to_shadow=to_texture @ from_sun @ rigid(sun_axes, np.zeros(3)) @ np.linalg.inv(rigid(camera.axes, camera.eye)),
        # A place r texels away on a plane at an angle t to the light is nearer to it by at most r tan t, and a lift of h clears h / cos t;
        # r <= BLUR, plus 0.7 within a texel.
        lift=(BLUR + 0.7) * (high - low)[:2].max() / SHADOW_TEXELS, shadow_blur=BLUR / SHADOW_TEXELS,
        contacts=bodies.contacts is not None, sun_strength=SUN, ambient=AMBIENT, outline=OUTLINE, glow=GLOW, shine=SHINE,
        **{name: of_colour(colour if bodies.contacts is None else "ffffff") for name, colour in (("sky_above", SKY_ABOVE), ("sky_below", SKY_BELOW))},
        contact_colour=of_colour(CONTACT))
    textures = dict(zip(("surface", "shown", "colour", "meeting_surface", "meeting_shown"), [*seen.colours, *meeting.colours]), shadow=shadow.depth)
    for unit_of_texture, (name, texture) in enumerate(textures.items()):
        texture.use(unit_of_texture)
        lights[name] = unit_of_texture
    image.use()
    ctx.disable(ctx.DEPTH_TEST | ctx.CULL_FACE)
    ctx.vertex_array(lights, []).render(vertices=3)
    return image.read(0, np.uint8)
