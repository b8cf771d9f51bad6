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


def colours(bodies, stripes=None):
    """Linear light that each body reflects; it depends on the number of the body alone. stripes: so many ranges of numbers have a colour each."""
    palette = np.array([of_colour(name) for name in COLOURS])
    random = np.random.default_rng(7)
    count = len(bodies.asset)
    which = random.integers(len(palette), size=count)
    if stripes is not None:
        which = 5 * (np.arange(count) * stripes // count) % len(palette)  # 5: neighbours differ
    chosen = palette[which] * random.uniform(0.85, 1.1, size=(count, 1))
    ground = GROUND
    if bodies.contacts is not None:
        chosen, ground = PALENESS * of_colour(PALE_BODY) + (1 - PALENESS) * chosen, PALE_GROUND
    return np.where(bodies.fixed[:, None], of_colour(ground), np.minimum(chosen, 1))


def box_corners(bodies, chosen):
    """Corners of the boxes of the chosen bodies, eight of each."""
    boxes = np.array([shape.box for shape in bodies.shapes])[bodies.asset[chosen]]
    corners = np.einsum("nij,nkj->nki", bodies.rotation[chosen], boxes) + bodies.translation[chosen, None]
    return corners.reshape(-1, 3)


def fixed_points(bodies):
    """Corners of the triangles of the fixed bodies, [n,3]."""
    rows = np.nonzero(bodies.fixed)[0]
    return np.concatenate([np.zeros((0, 3))] + [bodies.shapes[bodies.asset[i]].points @ bodies.rotation[i].T + bodies.translation[i] for i in rows])


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


class Picture:
    """What OpenGL draws of bodies, seen by a camera: what the samples show, then the shadows, then the light."""

    def __init__(self, bodies, camera, stripes=None):
        self.bodies, self.camera = bodies, camera
        self.distance = (camera.eye - bodies.translation) @ camera.axes[2]
        self.radius = np.array([np.linalg.norm(shape.points, axis=1).max() for shape in bodies.shapes])[bodies.asset]
        self.level = levels_drawn(bodies, self.distance, camera.focal)
        self.colour = colours(bodies, stripes)
        flags, first = flags_of_meeting(bodies)
        self.flags = render.context().buffer(flags)
        self.body_and_flags = np.stack([np.arange(len(first)), first], 1)
        self.seen, self.shadow, self.image = buffers(camera.size)
        self.meeting = self.seen if bodies.contacts is None else buffer_of_meeting(camera.size)

    def draw_bodies(self, program, axes, origin):
        """Draws all bodies in the frame of these axes, those with the greatest z first."""
        of, ctx = self.bodies, render.context()
        self.flags.bind_to_storage_buffer(0)
        for asset, shape in enumerate(of.shapes):
            for level, mesh in enumerate(shape.levels):
                rows = np.nonzero((of.asset == asset) & (self.level == level))[0]
                if not len(rows):
                    continue
                rows = rows[np.argsort(-(of.translation[rows] @ axes[2]), kind="stable")]
                columns = (axes @ of.rotation[rows]).transpose(0, 2, 1).reshape(-1, 9)
                pose = np.concatenate([columns, (of.translation[rows] - origin) @ axes.T], 1)
                (ctx.enable if mesh.closed else ctx.disable)(ctx.CULL_FACE)
                posed = render.attributes(program, "i", pose=pose, colour=self.colour[rows], body_and_flags=self.body_and_flags[rows])
                corners = render.attributes(program, "v", corner=mesh.points)
                ctx.vertex_array(program, corners + posed, ctx.buffer(mesh.corners.astype("i4"))).render(instances=len(rows))

    def draw_surfaces(self):
        """Draws what the samples show, and what they would if there were only triangles that meet others."""
        near, far = (self.distance - self.radius).min(), (self.distance + self.radius).max()
        program = render.program("body.vert", "body.frag")
        render.set_uniforms(program, projection=perspective(self.camera, max(near, 1e-3 * far), far))
        for buffer, meeting_alone in {self.meeting: True, self.seen: False}.items():
            buffer.use()
            render.set_uniforms(program, meeting_alone=meeting_alone)
            self.draw_bodies(program, self.camera.axes, self.camera.eye)

    def draw_shadows(self, sun_axes):
        """Draws how far the sunlight reaches. Returns what leads from the world to the map of it, whose coordinates are 0 to 1, and the size of a texel."""
        low, high = lit_box(self.bodies, in_picture(self.bodies, self.distance, self.radius, self.camera), sun_axes)
        projection = render.orthographic(low, high)
        program = render.program("body.vert", "depth.frag")
        render.set_uniforms(program, projection=projection)
        self.shadow.use()
        self.draw_bodies(program, sun_axes, np.zeros(3))
        to_texture = np.diag([0.5, 0.5, 0.5, 1]) + np.outer([0.5, 0.5, 0.5, 0], [0, 0, 0, 1])
        return to_texture @ projection @ rigid(sun_axes, np.zeros(3)), (high - low)[:2].max() / SHADOW_TEXELS

    def draw(self):
        """sRGB bytes, [height, width, 3], of the camera's size divided by SUPERSAMPLING."""
        ctx, axes = render.context(), self.camera.axes
        sun = unit(np.array(SUN_FROM) @ axes)
        right = unit(np.cross([0.0, 0.0, 1.0], sun))
        self.draw_surfaces()
        to_shadow, texel = self.draw_shadows(np.array([right, np.cross(sun, right), sun]))
        diagonal = np.median(self.bodies.diagonals[self.bodies.subject])
        contacts = self.bodies.contacts is not None
        program = render.program("whole.vert", "light.frag")
        textures = [*self.seen.colours, *self.meeting.colours[:2], self.shadow.depth]
        for place, texture in enumerate(textures):
            texture.use(place)
        render.set_uniforms(
            program, **{name: place for place, name in enumerate(("surface", "shown", "colour", "meeting_surface", "meeting_shown", "shadow"))},
            focal=self.camera.focal, to_shadow=to_shadow @ np.linalg.inv(rigid(axes, self.camera.eye)), sun=axes @ sun, up=axes[:, 2],
            # A place r texels away on a plane at an angle t to the light is nearer to it by at most r tan t, and a lift of h clears h / cos t;
            # r <= BLUR, plus 0.7 within a texel.
            lift=(BLUR + 0.7) * texel, shadow_blur=BLUR / SHADOW_TEXELS, reach=0.4 * diagonal, glow_reach=diagonal, body_size=diagonal, contacts=contacts,
            sky_above=of_colour("ffffff" if contacts else SKY_ABOVE), sky_below=of_colour("ffffff" if contacts else SKY_BELOW),
            contact_colour=of_colour(CONTACT), sun_strength=SUN, ambient=AMBIENT, outline=OUTLINE, glow=GLOW, shine=SHINE)
        self.image.use()
        ctx.disable(ctx.DEPTH_TEST | ctx.CULL_FACE)
        ctx.vertex_array(program, []).render(vertices=3)
        return self.image.read(0, np.uint8)


OF_SAMPLES = (4, "f4"), (2, "i4"), (4, "f2")


@functools.cache
def buffers(size):
    """What the samples show, the shadows, and the picture."""
    return render.Buffers(size, *OF_SAMPLES), render.Buffers((SHADOW_TEXELS, SHADOW_TEXELS)), render.Buffers(tuple(n // SUPERSAMPLING for n in size), (3, "f1"))


@functools.cache
def buffer_of_meeting(size):
    return render.Buffers(size, *OF_SAMPLES)
