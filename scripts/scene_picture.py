"""Pictures of many bodies: a camera on all of them, a sun with soft shadows, a sky that less open places see less of."""
import dataclasses

import numpy as np

import render
from render import unit

SUPERSAMPLING = 3
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
SHADOW_PIXELS = 2048
BODIES_AT_ONCE = 4096


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


def posed(bodies, chosen):
    """All triangles of the chosen bodies in the world, the body of each, whether it is of a closed shape, and whether it meets others; of the ground none does."""
    found, body, closed, meets = [np.zeros((0, 3, 3))], [np.zeros(0, int)], [np.zeros(0, bool)], [np.zeros(0, bool)]
    for asset, shape in enumerate(bodies.shapes):
        rows = np.nonzero((bodies.asset == asset) & chosen)[0]
        triangles = np.einsum("nij,tkj->ntki", bodies.rotation[rows], shape.triangles, optimize=True)
        triangles += bodies.translation[rows, None, None]
        found.append(triangles.reshape(-1, 3, 3))
        body.append(np.repeat(rows, len(shape.triangles)))
        closed.append(np.full(len(body[-1]), shape.closed))
        meets.append(np.zeros(len(body[-1]), bool) if bodies.contacts is None else bodies.contacts[rows][:, shape.face].ravel())
    body, meets = np.concatenate(body), np.concatenate(meets)
    return np.concatenate(found), body, np.concatenate(closed), meets & bodies.subject[body]


def box_corners(bodies, chosen):
    """Corners of the boxes of the chosen bodies, eight of each."""
    boxes = np.array([shape.box for shape in bodies.shapes])[bodies.asset[chosen]]
    corners = np.einsum("nij,nkj->nki", bodies.rotation[chosen], boxes) + bodies.translation[chosen, None]
    return corners.reshape(-1, 3)


def not_hidden(bodies, chosen, project, size):
    """Which of the chosen bodies are not surely hidden by nearer ones. Few are all asked for; many come front first, some at a time."""
    rows = np.nonzero(chosen)[0]
    if len(rows) <= BODIES_AT_ONCE or bodies.contacts is not None:
        return chosen
    corners = project(box_corners(bodies, chosen)).reshape(-1, 8, 3)
    low, high = (np.floor(edge).astype(int) for edge in (corners[..., :2].min(axis=1), corners[..., :2].max(axis=1)))
    nearest = corners[..., 2].max(axis=1)
    depth, shown = np.full((size[1], size[0]), -np.inf), np.zeros(len(chosen), bool)
    order = np.argsort(-nearest, kind="stable")
    for some in (order[i:i + BODIES_AT_ONCE] for i in range(0, len(order), BODIES_AT_ONCE)):
        some = some[~render.is_behind(depth, low[some], high[some], nearest[some])]
        here = np.zeros(len(chosen), bool)
        here[rows[some]] = True
        shown |= here
        depth = np.maximum(depth, render.rasterise(project(posed(bodies, here)[0]), size)[0])
    return shown


@dataclasses.dataclass
class Camera:
    axes: np.ndarray  # rows: right, up, towards the eye
    eye: np.ndarray
    focal: float  # the width in pixels of something as wide as it is far away
    size: tuple

    def seen(self, points):
        """In the camera's frame; the third is the distance."""
        return (points - self.eye) @ (self.axes * [[1], [1], [-1]]).T

    def project(self, points):
        """x and y in pixels, and the inverse of the distance, which is linear on the screen."""
        seen = self.seen(points)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / seen[..., 2]
            x = self.size[0] / 2 + self.focal * seen[..., 0] * inverse
            y = self.size[1] / 2 - self.focal * seen[..., 1] * inverse
        return np.stack([x, y, inverse], -1)


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


def visible(triangles, closed, camera):
    """Triangles in front of the eye that can be seen: those of closed shapes only from outside."""
    faces_eye = np.einsum("ni,ni->n", area_vectors(triangles), camera.eye - triangles[:, 0]) > 0
    nearest = 1e-3 * np.linalg.norm(camera.eye - triangles.mean(axis=(0, 1)))
    in_front = camera.seen(triangles)[..., 2].min(axis=1) > nearest
    return np.nonzero((faces_eye | ~closed) & in_front)[0]


def area_vectors(triangles):
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


@dataclasses.dataclass
class Samples:
    """What the samples of a picture show that show anything: rows are samples, in the order of the picture."""
    covered: np.ndarray  # bool [height, width]
    row: np.ndarray
    column: np.ndarray
    distance: np.ndarray  # along the camera's axis
    point: np.ndarray
    normal: np.ndarray  # towards the eye
    triangle: np.ndarray
    body: np.ndarray


def take_samples(triangles, body, closed, camera):
    kept = visible(triangles, closed, camera)
    depth, nearest = render.rasterise(camera.project(triangles[kept]), camera.size)
    covered = nearest >= 0
    row, column = np.nonzero(covered)
    distance = 1 / depth[covered]
    on_plane = np.stack([(column + 0.5 - camera.size[0] / 2) / camera.focal,
                         (row + 0.5 - camera.size[1] / 2) / camera.focal, np.ones(len(row))], 1)
    point = ((on_plane * distance[:, None]) @ (camera.axes * [[1], [-1], [-1]]) + camera.eye).astype(np.float32)
    normals = unit(area_vectors(triangles[kept]))
    normals *= np.where(np.einsum("ni,ni->n", normals, camera.eye - triangles[kept, 0]) < 0, -1, 1)[:, None]
    chosen = nearest[covered]
    return Samples(covered, row, column, distance, point, normals.astype(np.float32)[chosen], kept[chosen], body[kept][chosen])


def lit(samples, bodies, light):
    """Which samples see the light; shadows are soft once the samples of a pixel are averaged."""
    right = unit(np.cross([0.0, 0.0, 1.0], light))
    axes = np.array([right, np.cross(light, right), light])
    seen = box_corners(bodies, bodies.subject) @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    scale, size = SHADOW_PIXELS / (high - low)[:2].max(), (SHADOW_PIXELS, SHADOW_PIXELS)
    project = lambda points: (points @ axes.T - low) * [scale, scale, 1]
    casters = posed(bodies, not_hidden(bodies, bodies.subject, project, size))[0]
    depth, _ = render.rasterise(project(casters[area_vectors(casters) @ light > 0]), size)
    # Samples are lifted off their surface, which would shade itself otherwise: a place r pixels away on a plane at an angle t
    # to the light is nearer to it by at most r tan t, and a lift of h clears h / cos t; r <= 2.5, plus 0.7 within a pixel.
    lifted = samples.point + samples.normal * np.float32(3.2 / scale)
    at = lifted @ axes.T.astype(np.float32) - low.astype(np.float32)
    # Each sample looks at a place of its own on a small disc; the places are a low-discrepancy sequence.
    index = np.arange(len(at))
    radius, angle = 2.5 * np.sqrt(index * 0.754877 % 1), 2 * np.pi * (index * 0.569840 % 1)
    column = np.floor(at[:, 0] * scale + radius * np.cos(angle)).astype(int)
    row = np.floor(at[:, 1] * scale + radius * np.sin(angle)).astype(int)
    inside = (np.minimum(column, row) >= 0) & (np.maximum(column, row) < SHADOW_PIXELS)
    return ~(inside & (depth[np.where(inside, row, 0), np.where(inside, column, 0)] > at[:, 2]))


def openness(samples, reach, camera):
    """Part of the sky that nothing within reach hides, judged by what the picture shows. Each sample of a pixel looks
    along directions of its own."""
    height, width = samples.covered.shape
    position = np.full((height * width, 3), np.float32(1e9))
    position[samples.covered.ravel()] = samples.point
    pixels = camera.focal * reach / samples.distance
    place = (samples.column % SUPERSAMPLING) * SUPERSAMPLING + samples.row % SUPERSAMPLING
    hidden = np.zeros(len(pixels), np.float32)
    directions, steps = 3, 3
    for k in range(directions):
        angle = 2 * np.pi * (place / SUPERSAMPLING ** 2 + k) / directions
        right, down = pixels * np.cos(angle), pixels * np.sin(angle)
        highest = np.zeros(len(pixels), np.float32)
        for step in range(1, steps + 1):
            away = (step / steps) ** 1.5
            x = np.clip((samples.column + away * right).astype(np.int32), 0, width - 1)
            y = np.clip((samples.row + away * down).astype(np.int32), 0, height - 1)
            ray = position[y * width + x] - samples.point
            length = np.sqrt(np.einsum("ni,ni->n", ray, ray)) + np.float32(1e-9)
            rise = np.einsum("ni,ni->n", ray, samples.normal) / length - np.float32(0.08)
            highest = np.maximum(highest, rise * np.clip(2 - length / np.float32(reach), 0, 1))
        hidden += np.maximum(highest, 0)
    return 1 - hidden / directions


def outlines(samples, contact):
    """Samples whose right or lower neighbour shows another body, or another triangle that meets others."""
    shown = np.full(samples.covered.shape, -1)
    shown[samples.covered] = np.where(contact >= 0, samples.body.max(initial=0) + 1 + contact, samples.body)
    ends = np.zeros(shown.shape, bool)
    ends[:, :-1] |= shown[:, :-1] != shown[:, 1:]
    ends[:-1] |= shown[:-1] != shown[1:]
    return ends[samples.covered]


def shown_contacts(samples, triangles, meets, reach, camera):
    """How strongly the samples show a triangle that meets others, and which (-1: none): in full one that is seen, less one that is hidden, the farther
    behind it lies."""
    found = np.nonzero(meets)[0]
    depth, nearest = render.rasterise(camera.project(triangles[found]), camera.size)
    depth, nearest = depth[samples.covered], nearest[samples.covered]
    with np.errstate(divide="ignore"):
        strength = np.where(nearest >= 0, SHINE * np.clip(2 - 2 * (1 / depth - samples.distance) / reach, 0, 1), 0)
    hidden = np.where(strength > 0, np.append(found, -1)[nearest], -1)
    seen = meets[samples.triangle]
    return np.where(seen, 1, strength), np.where(seen, samples.triangle, hidden)


def backdrop(size, white):
    if white:
        return np.ones((size[1], size[0], 3))
    down = np.linspace(0, 1, size[1])[:, None]
    rows = (1 - down) * of_colour(SKY_ABOVE) + down * of_colour(SKY_BELOW)
    return np.repeat(rows[:, None], size[0], axis=1)


def picture(bodies, camera):
    """sRGB in 0 to 1, [height, width, 3], of the camera's size divided by SUPERSAMPLING."""
    everything = np.ones(len(bodies.asset), bool)
    triangles, body, closed, meets = posed(bodies, not_hidden(bodies, everything, camera.project, camera.size))
    samples = take_samples(triangles, body, closed, camera)
    light = unit(np.array(SUN_FROM) @ camera.axes)
    subject = bodies.subject
    diagonal = np.median(bodies.diagonals[subject])
    sun = SUN * np.clip(samples.normal @ light, 0, 1) * lit(samples, bodies, light)
    sky = AMBIENT * (0.75 + 0.25 * samples.normal[:, 2])
    sky *= openness(samples, 0.4 * diagonal, camera)
    light_here = sun[:, None] * [1.05, 1.0, 0.93] + sky[:, None] * [0.95, 1.0, 1.07]
    strength, contact = shown_contacts(samples, triangles, meets, diagonal, camera)
    strength = strength[:, None]
    reflected = (1 - strength) * colours(bodies)[samples.body] + strength * of_colour(CONTACT)
    image = backdrop(camera.size, bodies.contacts is not None)
    image[samples.covered] = reflected * (light_here + GLOW * strength * (1 - light_here))
    image[samples.covered] *= np.where(outlines(samples, contact), OUTLINE, 1)[:, None]
    return render.shrink(np.clip(image, 0, 1), SUPERSAMPLING) ** (1 / 2.2)
