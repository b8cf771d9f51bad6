"""A software renderer for pictures of meshes: cameras, a z-buffer, and what the scripts that render share."""
import matplotlib.image
import numpy as np

FRAGMENTS_AT_ONCE = 1 << 21


def unit(vectors):
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1)


def axes_of_view(azimuth, elevation):
    """Rows: right, up, and towards the eye. Azimuth 0 looks at things from +x, 90 from +y."""
    a, e = np.radians([azimuth, elevation])
    eye = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.array([right, np.cross(eye, right), eye])


def plane_of_weights(corners):
    """Of triangles on the screen: coefficients [n,3,3] such that the barycentric weights at (x, y) are c · (x, y, 1)."""
    (ax, ay), (bx, by), (cx, cy) = (corners[:, k, :2].T for k in range(3))
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    with np.errstate(divide="ignore", invalid="ignore"):  # triangles without area: coefficients that are not finite
        v = np.stack([cy - ay, ax - cx, (cx - ax) * ay - (cy - ay) * ax], 1) / area[:, None]
        w = np.stack([ay - by, bx - ax, (by - ay) * ax - (bx - ax) * ay], 1) / area[:, None]
        return np.stack([np.array([0, 0, 1]) - v - w, v, w], 1)


def pixel_bounds(corners, size):
    """The first and one past the last pixel, [n,2] each, whose centres can lie in a triangle."""
    a, b, c = (corners[:, k, :2] for k in range(3))
    low = np.ceil(np.minimum(np.minimum(a, b), c) - 0.5)
    high = np.floor(np.maximum(np.maximum(a, b), c) - 0.5) + 1
    return (np.clip(edge, 0, size).astype(np.int64) for edge in (low, high))


def fragments(weights, z, low, high, block):
    """Of triangles whose bounds fit in a block of pixels: triangle, x, y and depth of each pixel that lies in one."""
    x = (low[:, 0, None] + np.arange(block[0]))[:, None, :]
    y = (low[:, 1, None] + np.arange(block[1]))[:, :, None]
    inside = (x < high[:, 0, None, None]) & (y < high[:, 1, None, None])
    for k in range(3):
        cx, cy, c = (weights[:, k, i, None, None] for i in range(3))
        inside &= cx * (x + 0.5) + (cy * (y + 0.5) + c) >= 0
    triangle, pixel = np.divmod(np.flatnonzero(inside), block[0] * block[1])
    row, column = np.divmod(pixel, block[0])
    x, y = low[triangle, 0] + column, low[triangle, 1] + row
    plane = np.einsum("nk,nki->ni", z, weights)[triangle]
    return triangle, x, y, plane[:, 0] * (x + 0.5) + (plane[:, 1] * (y + 0.5) + plane[:, 2])


def rasterise(corners, size):
    """The z-buffer. corners: [n,3,3], x and y in pixels and z that is linear on the screen and greater where nearer.

    Returns, [height, width] each, the greatest z (-inf: none) and the triangle that has it (-1: none).
    """
    width, height = size
    depth = np.full(width * height, -np.inf)
    nearest = np.full(width * height, -1)
    low, high = pixel_bounds(corners, size)
    weights = plane_of_weights(corners)
    seen = np.all(low < high, axis=1) & np.isfinite(weights).all(axis=(1, 2))
    extent = np.ceil(np.log2(np.maximum(high - low, 1))).astype(int)  # blocks are powers of two
    kind_of = extent[:, 0] * 64 + extent[:, 1]
    front_first = np.argsort(-corners[..., 2].max(axis=1), kind="stable")
    front_first = front_first[seen[front_first]]
    for kind in np.unique(kind_of[front_first]):
        block = (1 << kind // 64, 1 << kind % 64)
        chosen = front_first[kind_of[front_first] == kind]
        step = max(1, FRAGMENTS_AT_ONCE // (block[0] * block[1]))
        for some in (chosen[i:i + step] for i in range(0, len(chosen), step)):
            triangle, x, y, z = fragments(weights[some], corners[some, :, 2], low[some], high[some], block)
            pixel = y * width + x
            nearer = np.nonzero(z > depth[pixel])[0]
            nearer = nearer[np.argsort(z[nearer], kind="stable")]  # of several for one pixel the last is kept
            depth[pixel[nearer]] = z[nearer]
            nearest[pixel[nearer]] = some[triangle[nearer]]
    return depth.reshape(height, width), nearest.reshape(height, width)


def is_behind(depth, low, high, nearest):
    """Whether all of a picture within the bounds, first and last pixels [n,2] each, is nearer than `nearest`, [n]. Bounds that reach out of it are cut."""
    size = np.array(depth.shape[::-1])
    low, high = np.clip(low, 0, size - 1), np.clip(high, 0, size - 1)
    behind = np.zeros(len(low), bool)
    step = np.ceil(np.log2((high - low).max(axis=1) + 1)).astype(int)  # blocks of which two by two hold the bounds
    farthest = depth
    for k in range(step.max(initial=0) + 1):
        if k > 0:
            farthest = np.pad(farthest, [(0, n % 2) for n in farthest.shape], constant_values=np.inf)
            farthest = farthest.reshape(farthest.shape[0] // 2, 2, -1, 2).min(axis=(1, 3))
        of = np.nonzero(step == k)[0]
        (left, top), (right, bottom) = low[of].T >> k, high[of].T >> k
        around = [farthest[row, column] for row in (top, bottom) for column in (left, right)]
        behind[of] = np.min(around, axis=0) > nearest[of]
    return behind


def shrink(image, factor):
    height, width = (n // factor for n in image.shape[:2])
    blocks = image[:height * factor, :width * factor].reshape(height, factor, width, factor, 3)
    return blocks.mean(axis=(1, 3))


def to_bytes(image):
    return (image * 255 + 0.5).astype(np.uint8)


def save_png(path, image):
    # 8-bit values, and no "Software" field: the bytes depend on what is shown alone.
    matplotlib.image.imsave(path, to_bytes(image), metadata={"Software": None})
