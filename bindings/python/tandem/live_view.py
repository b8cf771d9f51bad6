"""A world that goes on in a window: tandem.view(world). Needs pyvista."""
from __future__ import annotations

import dataclasses
import time
from typing import Any

import numpy as np

import tandem
from tandem._world import duration
from tandem.scene_files import scene_of
from tandem.viewer import Points, View, _corners

PICTURES = 60  # a second, of steps that are shorter
WAIT = 0.005  # seconds, at most, between two looks at mouse and keys


class LiveView(View):
    """A world in a window, in which it goes on: at the pace of the clock, or slower where its steps take longer. Space stops
    it and lets it go on, the right arrow key makes one step, and Home goes back to where it was when the view was made.
    The camera backs away where bodies leave the picture, until somebody moves it.

    world: others may move and push its bodies and step it beside; refresh() shows what became of it. Bodies that are placed
        anew need another view.
    dt: length of a step, seconds.
    options: those of View, but nothing that was found. What True finds is found among the pairs that the world's filter lets through, joined ones too.
    """

    def __init__(self, world: tandem.World, *, dt: float = 1 / 60, **options: Any) -> None:
        found = [name for name in ("contacts", "manifolds", "distances") if not isinstance(options.get(name), (bool, type(None)))]
        if found:
            raise ValueError(f"{found[0]}: what was found belongs to one state, and the world goes on; contacts=True and manifolds=True find anew")
        self.world, self.dt, self.runs = world, duration(dt), True
        self._start = world.save()
        self._steps = max(1, round(1 / (PICTURES * self.dt)))  # for a picture
        super().__init__(world, **options)
        self._write_time()

    def step(self, steps: int = 1) -> None:
        """Makes steps, and shows where the bodies are then."""
        self.world.step(self.dt, steps)
        self.refresh()

    def restart(self) -> None:
        """Goes back to where the world was when the view was made."""
        self.world.restore(self._start)
        self.refresh()

    def refresh(self) -> None:
        """Shows the world as it is now."""
        self.scene = dataclasses.replace(scene_of(self.world), level=self.scene.level)
        self._follow()
        self._draw()
        self._write_time()

    def show(self) -> None:
        """Opens the window, and lets the world go on until it is closed. In a notebook it shows the world as it is. Raises
        what World.step() raises; Ctrl-C raises KeyboardInterrupt."""
        if self.plotter.notebook:
            super().show()
            return
        self.add_sliders()
        for key, act in (("space", self._stop_or_go), ("Right", self._one_step), ("Home", self.restart)):
            self.plotter.add_key_event(key, act)
        self.plotter.show(interactive_update=True, auto_close=False)
        due = time.monotonic()
        while not self._is_shut():
            if self.runs:
                self.step(self._steps)
            self.plotter.render()
            due = max(due + self._steps * self.dt, time.monotonic())
            self._look_after(due)

    def _look_after(self, due: float) -> None:
        """Heeds mouse and keys until the next picture is due."""
        while not self._is_shut():
            self.plotter.iren.process_events()
            left = due - time.monotonic()
            if left <= 0:
                return
            time.sleep(min(left, WAIT))

    def _is_shut(self) -> bool:
        interactor = self.plotter.iren.interactor if self.plotter.iren is not None else None
        return interactor is None or bool(interactor.GetDone())

    def _stop_or_go(self) -> None:
        self.runs = not self.runs

    def _one_step(self) -> None:
        self.runs = False
        self.step()

    def _write_time(self) -> None:
        self.plotter.add_text(f"{self.world.time:.2f} s", position="upper_left", font_size=10, color="black", name="time", render=False)

    def _frame(self, axes: Points, seen: Points) -> None:
        super()._frame(axes, seen)
        self._axes, self._framed = axes, np.stack([seen.min(axis=0), seen.max(axis=0)])
        self._eye = tuple(self.plotter.camera.position)

    def _follow(self) -> None:
        """Takes all bodies into the picture that left it, unless somebody has moved the camera."""
        if tuple(self.plotter.camera.position) != self._eye:
            return
        body = np.flatnonzero(self._subject)
        seen = self._posed(body, self._bounds[self._asset[body]]).reshape(-1, 3) @ self._axes.T
        eye = self._axes @ self._eye
        away = eye[2] - seen[:, 2:]
        low, high = self._cone()
        across = seen[:, :2] - eye[:2]
        if not ((across >= low * away) & (across <= high * away)).all():
            self._frame(self._axes, np.concatenate([_corners(self._framed[None])[0], seen]))
