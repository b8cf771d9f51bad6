"""tandem.view(): bodies, what queries found, levels of detail and trees, in a window or as a picture. Needs pyvista."""
from __future__ import annotations

import importlib
import os
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import tandem
from tandem import tree
from tandem.scene_files import Scene, at_levels, read, scene_of

# matplotlib and vtk have no types, and what pyvista's decorators make of its own says nothing to mypy.
matplotlib: Any = importlib.import_module("matplotlib")
importlib.import_module("matplotlib.colors")
pyvista: Any = importlib.import_module("pyvista")
vtk: Any = importlib.import_module("vtk")

Points = NDArray[np.float64]
Mesh = Any  # pyvista.PolyData

# None is near the red of contacts.
BODY_COLOURS = ("d9982b", "8f6b3d", "98933a", "7f5fb0", "cdb06c", "3a68b0", "2f8f86", "5b7d9c", "4aa3d4", "44548c",
                "6f9e3e", "a890cc")
FIXED_COLOUR = "cbc6b9"
CONTACT_COLOUR = "d1202f"
NORMAL_COLOUR = "1b1b1b"
TREE_COLOUR = "2a4d8f"
OUTLINE_COLOUR = "202020"
OUTLINED = 500_000  # triangles of translucent bodies up to which these have outlines, found anew for each picture
BACKGROUND = ("ffffff", "eef2f6")  # below, above
TRANSLUCENT = 0.35
POINT_PIXELS = 16
VIEW_ANGLE = 24  # degrees, from the lower edge to the upper
MARGIN = 0.03  # of the picture, on either side
SUPERSAMPLING = 5**0.5  # vtkSSAAPass draws a picture so many times as wide and as high
BAR = 0.12  # of the picture, for a bar of colours and its numbers
NORMAL_LENGTH = 0.15  # of the median diagonal of the bodies
COLORS = ("body", "asset", "level")


def view(what: Any, instances: NDArray[np.void] | None = None, *, picture: str | os.PathLike[str] | None = None,
         off_screen: bool = False, **options: Any) -> NDArray[np.uint8] | None:
    """Shows bodies and what was found of them.

    what: the path of a scene file, of a run with states or of a .bvh file, an asset, or assets, to which `instances`
        belong (tandem.instances()); or a tandem.World, which goes on in the window (tandem.live_view.LiveView), and
        stays as it is where no window opens. With pictures of an asset alone it stands at the origin.
    picture: path of a .png file to write; no window opens.
    off_screen: no window opens; needs neither a display nor a GPU.
    options: those of tandem.viewer.View: contacts, manifolds, distances, levels, motion, step, tree_depth, color,
        opacity, size, azimuth, elevation; of a world also those of LiveView.

    Returns the picture where no window opens, uint8 (height, width, 3); else None once the window is closed.
    """
    hidden = off_screen or picture is not None
    shown: View
    if isinstance(what, tandem.World):
        from tandem.live_view import LiveView

        shown = LiveView(what, off_screen=hidden, **options)
    else:
        shown = View(what, instances, off_screen=hidden, **options)
    try:
        if hidden:
            return shown.picture(picture)
        shown.show()
        return None
    finally:
        if hidden or not shown.plotter.notebook:
            shown.close()


class View:
    """A scene in a window, or off screen. `plotter` is pyvista's, for whatever else is to be drawn or saved: about
    `origin`, a point of the world. `state` is the row of the run's states that is shown, `tree_depth` the depth of
    the boxes.

    what, instances: as for view().
    contacts: tandem.Contacts of these instances, whose triangles are drawn in red; or True: they are found, anew
        for each state of a run, of the pairs that the scene file or `motion` lets through.
    manifolds: tandem.Manifolds of these instances, drawn as points in the colour of their depths, with an arrow for the
        normal of each manifold, from a to b; or True as above.
    distances: tandem.Distances of these instances: a line between the nearest points of each pair, in the colour of
        the distance.
    levels: level of detail at which bodies are shown, one or (n,); those of the scene file, or 0. What True finds is
        found at these levels.
    motion: what moves each body, as of tandem.Filter; that of the scene file, or tandem.MOVING. The fixed ones are
        grey, and the others fill the picture.
    step: of a run, show the state after so many steps; else the last, from where all of them are in the picture. In a
        window a slider chooses.
    tree_depth: the boxes of the tree's nodes at this depth, from 0 (tandem.tree.boxes()). In a window a slider chooses.
    color: "body", "asset" or "level", with a legend: what has one of its own. Fixed bodies are grey but for "level".
    opacity: of the bodies, 0 to 1; 1, or 0.35 where there is something to see inside. Translucent bodies have dark outlines, but
        not where they have too many triangles together for that, half a million.
    size: width and height in pixels; of a picture at most what VTK can draw, such as 7,327 each.
    azimuth, elevation: degrees. From where one looks: 0 from +x, 90 from +y; above the horizon, z is up.

    Raises TypeError and ValueError for arguments that do not fit, or not together, RuntimeError where there is nothing
    to draw with, and what reading files and scenes raise.
    """

    def __init__(self, what: Any, instances: NDArray[np.void] | None = None, *,
                 contacts: tandem.Contacts | bool = False, manifolds: tandem.Manifolds | bool = False,
                 distances: tandem.Distances | None = None, levels: ArrayLike | None = None,
                 motion: ArrayLike | None = None, step: int | None = None, tree_depth: int | None = None,
                 color: str = "body", opacity: float | None = None,
                 off_screen: bool = False, size: tuple[int, int] = (900, 562),
                 azimuth: float = -60, elevation: float = 24) -> None:
        if color not in COLORS:
            raise ValueError(f"color {color!r}: is none of {', '.join(COLORS)}")
        if opacity is not None and not 0 <= opacity <= 1:
            raise ValueError(f"opacity {opacity}: is not from 0 to 1")
        if np.shape(size) != (2,) or np.asarray(size).dtype.kind not in "iu" or min(size) < 1:
            raise ValueError(f"size {size}: is not a width and a height in pixels")
        for name, given, kind in (("contacts", contacts, tandem.Contacts), ("manifolds", manifolds, tandem.Manifolds)):
            if not isinstance(given, (bool, kind)):
                raise TypeError(f"{name}: a {type(given).__name__} is neither tandem.{kind.__name__} nor a bool")
        if not isinstance(distances, (tandem.Distances, type(None))):
            raise TypeError(f"distances: a {type(distances).__name__} is neither tandem.Distances nor None")
        self.scene = _scene(what, instances)
        count = len(self.scene.asset)
        self._motion = self.scene.motion if motion is None else _of_each("motion", motion, count, tandem.SLEEPING)
        self._filter = self.scene.filter if motion is None else tandem.Filter(motion=self._motion)
        self._level = (self.scene.level if levels is None else
                       _of_each("levels", levels, count, np.iinfo(np.uint32).max).astype(np.uint32))
        self._assets, self._asset = at_levels(self.scene.assets, self.scene.asset, self._level)
        for name, found in (("contacts", contacts), ("manifolds", manifolds), ("distances", distances)):
            if not isinstance(found, (bool, type(None))) and (len(self.scene.steps) > 1 or levels is not None):
                raise ValueError(f"{name}: belong to one state, at its levels; let them be found by {name}=True")
        self._contacts, self._manifolds, self._distances = contacts, manifolds, distances
        self._asked = tandem.Scene(self._assets) if contacts is True or manifolds is True else None
        self.tree_depth, self._color = tree_depth, color
        inside = contacts is not False or manifolds is not False or distances is not None
        self.opacity = opacity if opacity is not None else TRANSLUCENT if inside else 1.0
        self._place()
        self._open(off_screen, size)
        self.state = self._state_after(step)
        if color == "level":
            used = np.unique(self._level)
            labels = [[f"level {level}", _level_colours(int(used[-1]) + 1)[level] / 255] for level in used]
            # VTK cuts the number off where the legend is but one row high.
            self.plotter.add_legend(labels, bcolor=None, border=False, size=(0.14, 0.05 * max(len(used), 2)),
                                    face="rectangle")
        self._draw()
        self._look(azimuth, elevation, range(len(self.scene.steps)) if step is None else [self.state])

    def show_step(self, step: int) -> None:
        """Shows the state of a run after so many steps. Raises ValueError where it keeps none."""
        self.state = self._state_after(step)
        self._draw()

    def _state_after(self, step: int | None) -> int:
        kept = self.scene.steps
        found = np.flatnonzero(kept == step) if step is not None else [len(kept) - 1]
        if not len(found):
            raise ValueError(f"step {step}: the run keeps the states after {kept.tolist()}")
        return int(found[0])

    def show_tree(self, depth: int | None) -> None:
        """Shows the boxes of the nodes at another depth; None: no boxes."""
        self.tree_depth = depth
        self._draw_tree()

    def picture(self, path: str | os.PathLike[str] | None = None) -> NDArray[np.uint8]:
        """Draws the scene: uint8 (height, width, 3); a .png file too where a path is given."""
        if path is not None and not os.fspath(path).endswith(".png"):
            raise ValueError(f"{path}: is not a .png file")
        self.plotter.render()
        image = self.plotter.screenshot(path, return_img=True)
        return np.asarray(image)[..., :3]

    def show(self) -> None:
        """Opens the window, with sliders, and waits until it is closed. In a notebook it shows pyvista's widget."""
        self.add_sliders()
        self.plotter.show()

    def add_sliders(self) -> None:
        """Adds a slider for the steps of a run, and one for the depth of the tree where its boxes are shown."""
        left, right = 0.03, 0.3
        if len(self.scene.steps) > 1:
            steps = self.scene.steps
            self._slider(lambda value: self.show_step(int(steps[np.abs(steps - value).argmin()])),
                         "step", (steps[0], steps[-1]), steps[self.state], left, right)
            left, right = 0.36, 0.63
        if self.tree_depth is not None:
            deepest = max(asset.levels[0].depth for asset in self._assets)
            self._slider(lambda value: self.show_tree(round(value)), "tree depth", (0, deepest), self.tree_depth, left,
                         right)

    def close(self) -> None:
        """Frees the window, and all that it refers to."""
        self.plotter.clear_slider_widgets()
        self.plotter.close()

    def _slider(self, changed: Callable[[float], None], title: str, bounds: tuple[int, int], value: int, left: float,
                right: float) -> None:
        self.plotter.add_slider_widget(changed, bounds, value=value, title=title, pointa=(left, 0.08),
                                       pointb=(right, 0.08), color="black", fmt="%.0f", interaction_event="always",
                                       style="modern")

    def _place(self) -> None:
        """Meshes are drawn about their middles and the scene about its own: graphics hardware computes in float32."""
        self._triangles = [asset.triangles() for asset in self._assets]
        bounds = np.array([[t.min(axis=(0, 1)), t.max(axis=(0, 1))] for t in self._triangles])
        self._bounds = _corners(bounds)
        self._middle = bounds.mean(axis=1)
        diagonal = np.linalg.norm(bounds[:, 1] - bounds[:, 0], axis=1)
        fixed = self._motion == tandem.FIXED
        self._subject = ~fixed if not fixed.all() else fixed
        self._length = float(np.median(diagonal[self._asset[self._subject]]))
        self.origin = self._centres(len(self.scene.steps) - 1)[self._subject].mean(axis=0)

    def _centres(self, state: int) -> Points:
        """Returns the middles of the bodies' meshes, (n, 3), in the world."""
        centres: Points = np.einsum("nij,nj->ni", self.scene.rotation[state], self._middle[self._asset])
        centres += self.scene.translation[state]
        return centres

    def _posed(self, body: NDArray[Any], points: Points, state: int | None = None) -> Points:
        """Points (n, k, 3) of bodies (n,), in the coordinates of their meshes, as they are drawn."""
        state = self.state if state is None else state
        about = points - self._middle[self._asset[body]][:, None]
        turned: Points = np.einsum("nij,nkj->nki", self.scene.rotation[state][body], about)
        turned += (self._centres(state)[body] - self.origin)[:, None]
        return turned

    def _open(self, off_screen: bool, size: tuple[int, int]) -> None:
        self.plotter = _plotter(off_screen, size)
        self.plotter.set_background(BACKGROUND[0], top=BACKGROUND[1])
        if off_screen:
            self.plotter.enable_anti_aliasing("ssaa")
        if self.opacity < 1:
            self.plotter.enable_depth_peeling(6)
        self._bodies = []
        for row, triangles in enumerate(self._triangles):
            mapper = vtk.vtkGlyph3DMapper()
            mapper.SetSourceData(_surface(triangles - self._middle[row]))
            mapper.SetOrientationArray("orientation")
            mapper.SetOrientationModeToQuaternion()
            mapper.ScalingOff()
            mapper.SetScalarModeToUsePointFieldData()
            mapper.SelectColorArray("colour")
            mapper.SetColorModeToDirectScalars()
            actor = vtk.vtkActor()
            actor.SetMapper(mapper)
            actor.SetForceTranslucent(self.opacity < 1)  # the glyphs' colours have the opacity
            actor.GetProperty().SetBackfaceCulling(self.opacity < 1 and bool(self._assets[row].levels[0].closed))
            actor.GetProperty().SetAmbient(0.1)
            self.plotter.add_actor(actor, name=f"bodies {row}", reset_camera=False)
            self._bodies.append(mapper)

    def _look(self, azimuth: float, elevation: float, states: Iterable[int]) -> None:
        """Puts the camera as near as all bodies, in all of these states, are in the picture, left of the bars."""
        a, e = np.radians([azimuth, elevation])
        back = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0])
        axes = np.array([right, np.cross(back, right), back])
        body = np.flatnonzero(self._subject)
        corners = self._bounds[self._asset[body]]
        seen = np.concatenate([self._posed(body, corners, state).reshape(-1, 3) for state in states]) @ axes.T
        self._frame(axes, seen)

    def _cone(self) -> tuple[Points, Points]:
        """Returns the least and greatest slopes, across and upwards, of rays from the eye that hit the picture, left of the bars."""
        width, height = self.plotter.window_size
        whole = np.tan(np.radians(VIEW_ANGLE / 2)) * np.array([width / height, 1])
        low, high = -whole * (1 - 2 * MARGIN), whole * (1 - 2 * MARGIN)
        # A run may have contact points at another of its states, and a bar then.
        bars = len(self.plotter.scalar_bars) if len(self.scene.steps) == 1 else int(self._manifolds is not False)
        high[0] -= 2 * whole[0] * BAR * bars
        return low, high

    def _frame(self, axes: Points, seen: Points) -> None:
        """Puts the camera as near as all points (n, 3), along its axes (right, up, back), are in the picture."""
        low, high = self._cone()
        # The eye is the nearest place behind everything from which all points lie in the cone of the view. Across, it
        # is where the cones that touch the points on either side meet.
        most, least = (seen[:, :2] + seen[:, 2:] * high).max(axis=0), (seen[:, :2] + seen[:, 2:] * low).min(axis=0)
        away = ((most - least) / (high - low)).max()
        middle = (most + least - (high + low) * away) / 2
        camera = self.plotter.camera
        camera.view_angle = VIEW_ANGLE
        camera.position = np.append(middle, away) @ axes
        camera.focal_point = np.append(middle, seen[:, 2].mean()) @ axes
        camera.up = axes[1]

    def _draw(self) -> None:
        self._draw_bodies()
        self._draw_outlines()
        self._draw_found()
        self._draw_tree()
        self.plotter.renderer.ResetCameraClippingRange()

    def _draw_bodies(self) -> None:
        opacity = np.full((len(self._asset), 1), round(255 * self.opacity), np.uint8)
        colour = np.concatenate([self.body_colours(), opacity], axis=1)
        centres = self._centres(self.state) - self.origin
        for row, mapper in enumerate(self._bodies):
            of_it = self._asset == row
            points = pyvista.PolyData(centres[of_it])
            points["orientation"] = _quaternions(self.scene.rotation[self.state][of_it]).astype(np.float32)
            points["colour"] = colour[of_it]
            mapper.SetInputData(points)

    def _draw_outlines(self) -> None:
        """Translucent bodies hide no edge of each other, and have a dark line where they turn away from the eye."""
        count = sum(len(self._triangles[row]) for row in self._asset)
        if not 0 < self.opacity < 1 or count > OUTLINED:
            return
        points, corners, first = [], [], 0
        for row, triangles in enumerate(self._triangles):
            joined = _surface(triangles).clean()  # edges have two sides where triangles share their vertices
            body = np.flatnonzero(self._asset == row)
            posed = self._posed(body, np.tile(joined.points, (len(body), 1, 1))).reshape(-1, 3)
            offset = first + len(joined.points) * np.arange(len(body))
            corners.append((joined.regular_faces + offset[:, None, None]).reshape(-1, 3))
            points.append(posed)
            first += len(posed)
        found = vtk.vtkPolyDataSilhouette()
        found.SetInputData(pyvista.PolyData.from_regular_faces(np.concatenate(points), np.concatenate(corners)))
        found.SetCamera(self.plotter.camera)
        found.SetEnableFeatureAngle(False)
        found.SetBorderEdges(True)
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputConnection(found.GetOutputPort())
        actor = vtk.vtkActor()
        actor.SetMapper(mapper)
        actor.GetProperty().SetColor([part / 255 for part in _rgb(OUTLINE_COLOUR)])
        actor.GetProperty().SetOpacity(0.7)
        actor.GetProperty().SetLineWidth(1.5)
        actor.GetProperty().SetLighting(False)
        self.plotter.add_actor(actor, name="outlines", reset_camera=False, render=False)

    def body_colours(self) -> NDArray[np.uint8]:
        """The colour of each body, sRGB, (n, 3)."""
        if self._color == "level":
            return _level_colours(int(self._level.max()) + 1)[self._level]
        number = self.scene.asset if self._color == "asset" else np.arange(len(self._asset))
        palette = np.array([_rgb(name) for name in BODY_COLOURS], np.uint8)
        colour: NDArray[np.uint8] = palette[number * 5 % len(palette)]
        colour[self._motion == tandem.FIXED] = _rgb(FIXED_COLOUR)
        return colour

    def _draw_found(self) -> None:
        contacts, manifolds = self._contacts, self._manifolds
        if self._asked is not None:
            self._asked.place(asset=self._asset, rotation=self.scene.rotation[self.state],
                              translation=self.scene.translation[self.state], filter=self._filter)
            found = self._asked.contacts(pairs=self.scene.pairs)
            contacts = found if contacts is True else contacts
            manifolds = self._asked.manifolds() if manifolds is True else manifolds
        if not isinstance(contacts, bool):
            self._draw_contacts(contacts)
        if not isinstance(manifolds, bool):
            self._draw_manifolds(manifolds)
        if self._distances is not None:
            self._draw_distances(self._distances)

    def _draw_contacts(self, found: tandem.Contacts) -> None:
        """The triangles that meet others, once each."""
        pair = found.pairs[found.contacts["pair"]]
        sides = [np.stack([pair[side], found.contacts[f"triangle_{side}"]], 1) for side in "ab"]
        body, triangle = np.unique(np.concatenate(sides), axis=0).T
        corners = np.empty((len(body), 3, 3))
        for row, triangles in enumerate(self._triangles):
            of_it = self._asset[body] == row
            corners[of_it] = triangles[triangle[of_it]]
        self._put("contacts", _surface(self._posed(body, corners)) if len(body) else None, color=CONTACT_COLOUR)

    def _draw_manifolds(self, found: tandem.Manifolds) -> None:
        points, normals = None, None
        if len(found.points):
            points = pyvista.PolyData(found.points["position"] - self.origin)
            points["depth"] = found.points["depth"]
            pushing = found.manifolds[found.manifolds["point_count"] > 0]  # others have no normal
            arrows = pyvista.PolyData(pushing["centre"] - self.origin)
            arrows["normal"] = pushing["normal"]
            normals = arrows.glyph(orient="normal", scale=False, factor=NORMAL_LENGTH * self._length,
                                   geom=pyvista.Arrow(tip_radius=0.07, tip_length=0.3, shaft_radius=0.022))
        self._put("points", points, scalars="depth", cmap="plasma", clim=_from_zero(found.points["depth"]),
                  style="points", point_size=POINT_PIXELS, render_points_as_spheres=True,
                  scalar_bar_args=_bar("depth", 0))
        self._put("normals", normals, color=NORMAL_COLOUR, lighting=False)

    def _draw_distances(self, found: tandem.Distances) -> None:
        near = found.distances[np.isfinite(found.distances["upper"])]
        lines = None
        if len(near):
            ends = np.stack([near["point_a"], near["point_b"]], 1) - self.origin
            lines = pyvista.line_segments_from_points(ends.reshape(-1, 3))
            lines.cell_data["distance"] = near["upper"]
        self._put("distances", lines, scalars="distance", cmap=_dark_viridis(), clim=_from_zero(near["upper"]), line_width=4,
                  scalar_bar_args=_bar("distance", 0 if self._manifolds is False else 1))

    def _draw_tree(self) -> None:
        edges = None
        if self.tree_depth is not None:
            corners = [self._boxes_of(row) for row in range(len(self._assets))]
            edges = _wireframe(np.concatenate(corners))
        self._put("tree", edges, color=TREE_COLOUR, line_width=1, opacity=0.6)

    def _boxes_of(self, row: int) -> Points:
        """The corners of the boxes of all bodies that show an asset, (n, 8, 3)."""
        corners = _corners(tree.boxes(self._assets[row], self.tree_depth or 0))
        body = np.flatnonzero((self._asset == row) & self._subject)
        return self._posed(np.repeat(body, len(corners)), np.tile(corners, (len(body), 1, 1)))

    def _put(self, name: str, mesh: Mesh | None, **options: Any) -> None:
        """Draws a mesh in the place of what had its name."""
        title = options.get("scalars")
        if title in self.plotter.scalar_bars:
            self.plotter.remove_scalar_bar(title)
        if mesh is None:
            self.plotter.remove_actor(name, reset_camera=False, render=False)
            return
        actor = self.plotter.add_mesh(mesh, name=name, reset_camera=False, render=False, **options)
        if title:
            self.plotter.scalar_bars[title].SetVerticalTitleSeparation(8)
        actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()  # what is on a body is seen on it
        actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(-2, -2)
        actor.mapper.SetRelativeCoincidentTopologyLineOffsetParameters(-2, -2)


def _scene(what: Any, instances: NDArray[np.void] | None) -> Scene:
    if isinstance(what, Scene):
        return what
    if isinstance(what, tandem.World):
        scene = scene_of(what)
    elif isinstance(what, (str, os.PathLike)):
        scene = _scene(tandem.Asset.load(what), instances) if os.fspath(what).endswith(".bvh") else read(what)
    else:
        assets = [what] if isinstance(what, tandem.Asset) else list(what)
        given = tandem.instances(np.arange(len(assets))) if instances is None else instances
        count = len(given)
        scene = Scene(assets, given["asset"], np.zeros(count, np.uint32), np.zeros(count, np.uint8),
                                  np.zeros(1, np.int64), given["rotation"][None], given["translation"][None])
    if not len(scene.asset):
        raise ValueError("there is no body to show")
    if not (np.isfinite(scene.rotation).all() and np.isfinite(scene.translation).all()):
        raise ValueError("a body is not in a finite place")
    return scene


def _of_each(name: str, given: ArrayLike, count: int, most: int) -> NDArray[Any]:
    """An argument that is one number of each body, (n,), or one for all."""
    numbers = np.asarray(given)
    if numbers.dtype.kind not in "iu":
        raise TypeError(f"{name}: {given!r} is not of integers")
    if numbers.shape not in ((), (count,)):
        raise ValueError(f"{name}: has shape {numbers.shape}; one number or ({count},) is needed")
    if numbers.min() < 0 or numbers.max() > most:
        raise ValueError(f"{name}: {given!r} is not from 0 to {most}")
    return np.broadcast_to(numbers, (count,))


def _plotter(off_screen: bool, size: tuple[int, int]) -> Any:
    """Makes a plotter with its window. VTK looks for a display first, then for what draws without, and says on stderr what it
    misses."""
    told = vtk.vtkLogger.GetCurrentVerbosityCutoff()
    vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_ERROR)
    try:
        plotter = pyvista.Plotter(off_screen=off_screen, window_size=list(size), lighting="three lights")
        window = plotter.render_window
        if off_screen:
            window.Initialize()
            if not window.GetInitialized():
                raise RuntimeError("VTK finds nothing to draw with: neither EGL (Debian: libegl1 libgl1-mesa-dri) nor "
                                   "OSMesa")
            most = int(vtk.vtkTextureObject.GetMaximumTextureSize(window) / SUPERSAMPLING)
            if max(size) > most:
                plotter.close()
                raise ValueError(f"size {tuple(size)}: is more than {most} pixels wide or high, the most that can be "
                                 "drawn here")
        elif not plotter.notebook and window.GetClassName() in ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow"):
            raise RuntimeError("there is no display for a window; picture= and off_screen=True draw without one")
    finally:
        vtk.vtkLogger.SetStderrVerbosity(told)
    return plotter


def _surface(triangles: Points) -> Mesh:
    """Makes a surface of corners (n, 3, 3), without joined vertices, so that faces look flat."""
    return pyvista.PolyData.from_regular_faces(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))


def _corners(boxes: Points) -> Points:
    """Returns the corners of boxes (n, 2, 3), as (n, 8, 3): corner i is upper along axis k where bit k of i is set."""
    high = np.array([[i >> k & 1 for k in range(3)] for i in range(8)], bool)
    return np.where(high, boxes[:, 1, None], boxes[:, 0, None])


def _wireframe(corners: Points) -> Mesh:
    """The edges of boxes whose _corners() these are."""
    ends = np.array([[i, i | 1 << k] for k in range(3) for i in range(8) if not i >> k & 1])
    lines = (np.arange(len(corners))[:, None, None] * 8 + ends).reshape(-1, 2)
    cells = np.insert(lines, 0, 2, axis=1)
    return pyvista.PolyData(corners.reshape(-1, 3), lines=cells.ravel())


def _quaternions(rotation: Points) -> Points:
    """w, x, y, z of rotations (n, 3, 3): of the four columns of 4 q q^T the longest, normalised."""
    r = np.moveaxis(rotation, 0, -1)
    s = np.array([[1 + r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
                  [r[2, 1] - r[1, 2], 1 + r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
                  [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], 1 - r[0, 0] + r[1, 1] - r[2, 2], r[1, 2] + r[2, 1]],
                  [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], 1 - r[0, 0] - r[1, 1] + r[2, 2]]])
    longest = np.argmax(np.einsum("iin->in", s), axis=0)
    found: Points = s[longest, :, np.arange(len(rotation))].copy()
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    return found


def _dark_viridis() -> Any:
    """The colour map without its yellow, which is faint on white."""
    return matplotlib.colors.ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0, 0.8, 256)))


def _level_colours(count: int) -> NDArray[np.uint8]:
    """Returns the colours of the levels, that of the finest first, (count, 3)."""
    colours: NDArray[np.uint8] = _dark_viridis()(np.linspace(0, 1, count), bytes=True)[:, :3]
    return colours


def _rgb(name: str) -> tuple[int, ...]:
    return tuple(bytes.fromhex(name))


def _from_zero(values: Points) -> tuple[float, float]:
    return 0.0, float(values.max(initial=0)) or 1.0


def _bar(title: str, column: int) -> dict[str, Any]:
    """Returns the arguments of a bar of colours, in a column from the right."""
    return {"title": title, "vertical": True, "position_x": 0.89 - BAR * column, "position_y": 0.15, "height": 0.7,
            "width": 0.05, "color": "black", "fmt": "%.2g"}
