"""python -m tandem: looks at files.

    python -m tandem view scene.h5 --manifolds
    python -m tandem view run.h5 --step 120 -o step.png
    python -m tandem view cow.bvh --tree-depth 3
    python -m tandem view scene.h5 --simulate
    python -m tandem info cow.bvh
"""
from __future__ import annotations

import argparse
import json
import pathlib
import sys

import tandem


def main(arguments: list[str] | None = None) -> int:
    """Runs a command. Returns the exit code: 0 done, 1 usage, 2 input cannot be read, or nothing to draw on, 130 Ctrl-C."""
    options = _parser().parse_args(arguments)
    try:
        options.run(options)
    except ImportError as error:
        print(f"tandem: {error}", file=sys.stderr)
        return 1
    except (OSError, RuntimeError, ValueError, tandem.Error) as error:
        print(f"tandem: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> None:  # type: ignore[override]
        self.exit(1, f"{self.prog}: {message}\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="tandem", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True, metavar="view|info")
    view = commands.add_parser("view", help="shows a scene, a run, or an asset")
    view.add_argument("file", type=pathlib.Path, help="scene file, run file, or .bvh file")
    view.add_argument("-o", "--output", type=pathlib.Path, metavar="PICTURE.png",
                      help="write a picture; no window opens")
    view.add_argument("--contacts", action="store_true", help="find the triangles that meet, and draw them in red")
    view.add_argument("--manifolds", action="store_true", help="draw contact points with depths, and normals")
    view.add_argument("--level", type=int, help="of detail, of all bodies (default: those of the scene)")
    view.add_argument("--tree-depth", type=int, metavar="D", help="draw the boxes of the tree's nodes at this depth")
    view.add_argument("--color", choices=("body", "asset", "level"), default="body",
                      help="what has a colour of its own (default: body)")
    view.add_argument("--opacity", type=float, help="of the bodies, 0 to 1")
    view.add_argument("--step", type=int, help="of a run: steps made before the state (default: the last); with --simulate: to be made before")
    view.add_argument("--simulate", action="store_true", help="the bodies of a scene file move: space stops them, right makes one step, "
                      "Home goes back")
    view.add_argument("--dt", type=seconds, help="with --simulate: length of a step, such as 1/120 (default: 1/60)")
    view.add_argument("--azimuth", type=float, default=-60, help="degrees; 0 from +x, 90 from +y (default: -60)")
    view.add_argument("--elevation", type=float, default=24, help="degrees above the horizon (default: 24)")
    view.add_argument("--width", type=int, default=900, help="in pixels (default: 900)")
    view.add_argument("--height", type=int, default=562, help="in pixels (default: 562)")
    view.set_defaults(run=_view)
    info = commands.add_parser("info", help="prints what bvhinfo --json does of a .bvh file")
    info.add_argument("file", type=pathlib.Path)
    info.set_defaults(run=_info)
    return parser


def seconds(word: str) -> float:
    """A number or a quotient of two."""
    parts = [float(part) for part in word.split("/")]
    if len(parts) > 2 or 0 in parts[1:]:
        raise ValueError(word)
    return parts[0] / (parts[1] if len(parts) == 2 else 1)


def _view(options: argparse.Namespace) -> None:
    what, live, step = options.file, {}, options.step
    if options.simulate:
        what, live, step = _world(options.file), {"dt": 1 / 60 if options.dt is None else options.dt}, None
        what.step(live["dt"], options.step or 0)
    elif options.dt is not None:
        raise ValueError("--dt belongs to --simulate")
    tandem.view(what, picture=options.output, contacts=options.contacts, manifolds=options.manifolds,
                levels=options.level, tree_depth=options.tree_depth, color=options.color, opacity=options.opacity,
                step=step, azimuth=options.azimuth, elevation=options.elevation, size=(options.width, options.height), **live)


def _world(path: pathlib.Path) -> tandem.World:
    try:
        from tandem import scene_files

        return scene_files.world(path)
    except ModuleNotFoundError as error:
        raise ImportError("--simulate needs h5py: pip install '.[view]' in the folder of the sources") from error


def _info(options: argparse.Namespace) -> None:
    print(json.dumps(tandem.Asset.load(options.file).statistics(), indent=2))


if __name__ == "__main__":
    sys.exit(main())
