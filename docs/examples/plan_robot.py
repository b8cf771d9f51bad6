"""A robot of a URDF file plans its way among meshes: a tree of random configurations, every edge decided exactly, in one call each."""
import sys
from pathlib import Path

try:
    import coal
    import pinocchio
except ImportError:
    print("needs the packages pin and example-robot-data")
    sys.exit(77)

import numpy as np

import tandem
from shapes import box


class Robot:
    """Links of a URDF file among meshes that stand. Links may touch that are of one joint or of neighbouring ones, or that touch at rest; those that
    do not move may touch what stands.

    Args:
        urdf: the file; meshes of its visual geometry are looked for in its package folders.
        standing: (vertices, triangles) of each mesh that stands, in the world.
        prepare: what is made of each mesh of a link before it is built.
        base: None where the base stands; else the lowest and the highest place between which it moves, turned in any way.
        levels: as of tandem.build(). The coarsest level of each mesh then says first which configurations are free, as surely as the mesh itself: it knows how far
            its surface is from that of the mesh at most. The meshes decide all others.
    """

    def __init__(self, urdf, standing, prepare=lambda mesh: mesh, base=None, levels=None):
        packages = [str(folder) for folder in Path(urdf).parents]
        self.model = pinocchio.buildModelFromUrdf(str(urdf), *([] if base is None else [pinocchio.JointModelFreeFlyer()]))
        self.base = base
        links = pinocchio.buildGeomFromUrdf(self.model, str(urdf), pinocchio.GeometryType.VISUAL, package_dirs=packages).geometryObjects
        self.links = [link for link in links if isinstance(link.geometry, coal.BVHModelBase)]
        self.meshes = [prepare(self._mesh(link)) for link in self.links] + list(standing)
        self.data = self.model.createData()
        joints, parents = [link.parentJoint for link in self.links], self.model.parents
        self.excluded = [(j, i) for i in range(len(joints)) for j in range(i) if joints[i] == joints[j] or parents[joints[i]] == joints[j] or parents[joints[j]] == joints[i]]
        self.excluded += [(i, j) for i, joint in enumerate(joints) if joint == 0 for j in range(len(joints), len(self.meshes))]
        self.assets = [tandem.build(*mesh, levels=levels) for mesh in self.meshes]
        self.scene, self.coarse = tandem.Scene(self.assets), None
        self._place(self.scene)
        at_rest = self.scene.configurations(np.arange(len(joints)), pose=self.poses([pinocchio.neutral(self.model)]), pairs="all").pairs
        self.excluded += [(a, b) for _, a, b, *_ in at_rest.tolist() if b < len(joints)]
        self._place(self.scene)
        if levels is not None:
            coarse = [asset.levels_from(len(asset.levels) - 1, 1) for asset in self.assets]
            self.coarse = tandem.Scene(coarse)
            self._place(self.coarse)

    def _place(self, scene):
        count = len(self.meshes)
        scene.place(asset=np.arange(count), translation=np.zeros((count, 3)), filter=tandem.Filter(excluded=self.excluded or None))

    @staticmethod
    def _mesh(link):
        shape = link.geometry
        corners = [[shape.tri_indices(i)[k] for k in range(3)] for i in range(shape.num_tris)]
        return np.array(shape.vertices()) * link.meshScale, np.array(corners)

    def poses(self, configurations):
        """Of each link in each configuration, (k, links, 4, 3): the rows of the rotation, then the translation. A scene takes that array as it is."""
        made = np.empty((len(configurations), len(self.links), 4, 3))
        for poses, configuration in zip(made, configurations, strict=True):
            pinocchio.forwardKinematics(self.model, self.data, configuration)
            for pose, link in zip(poses, self.links, strict=True):
                placed = self.data.oMi[link.parentJoint] * link.placement
                pose[:3], pose[3] = placed.rotation, placed.translation
        return made

    def touching(self, configurations, within=0.0):
        """Whether anything touches, or comes within a distance, in each configuration, (k,) bool."""
        poses = self.poses(configurations)
        if self.coarse is None:
            return self.of_scene(self.scene, poses, within)
        touching = self.of_scene(self.coarse, poses, within + self.error())
        touching[touching] = self.of_scene(self.scene, poses[touching], within)
        return touching

    def error(self):
        """How far levels of two meshes that do not meet may be apart at most, in the world, within a kilometre of its origin."""
        errors = sorted(asset.levels[-1].error_bound for asset in self.assets)
        # Poses are rigid to 1e-6, so that they stretch an error by less than 3e-6; corners are rounded by less than 1e-10 each.
        return (errors[-1] + errors[-2]) * (1 + 1e-5) + 1e-9

    def of_scene(self, scene, poses, within=0.0):
        return scene.configurations(np.arange(len(self.links)), pose=poses, within=within).touching

    def random(self, rng, count, spread=1.0):
        """Random configurations, whose joints are within a part of their range about that at rest."""
        lowest, highest = self.model.lowerPositionLimit, self.model.upperPositionLimit
        lowest, highest = np.where(np.isfinite(lowest), lowest, -np.pi), np.where(np.isfinite(highest), highest, np.pi)
        rest = np.clip(pinocchio.neutral(self.model), lowest, highest)
        some = rng.uniform(rest + spread * (lowest - rest), rest + spread * (highest - rest), (count, self.model.nq))
        if self.base is not None:  # its place, and a quaternion, of which the direction alone counts
            some[:, :3] = rng.uniform(*self.base, (count, 3))
            some[:, 3:7] = rng.normal(size=(count, 4))
        return np.array([pinocchio.normalize(self.model, configuration) for configuration in some])

    def between(self, start, end, share):
        """Configurations on the way from one to another, at shares of it from 0 to 1."""
        return np.array([pinocchio.interpolate(self.model, start, end, part) for part in share])


def way(robot, start, goal, rng, spread=1.0, reach=0.6, step=0.02):
    """A way from start to goal along which nothing touches at any `step`, (n, joints), or None."""
    tree, parent = [start], [-1]
    for _ in range(2000):
        aim = goal if rng.random() < 0.2 else robot.random(rng, 1, spread)[0]
        nearest = int(np.argmin([pinocchio.distance(robot.model, known, aim) for known in tree]))
        length = pinocchio.distance(robot.model, tree[nearest], aim)
        share = min(1.0, reach / length)
        edge = robot.between(tree[nearest], aim, np.linspace(0, share, int(np.ceil(share * length / step)) + 1))
        if robot.touching(edge).any():
            continue
        tree.append(goal if share == 1 and aim is goal else edge[-1])
        parent.append(nearest)
        if tree[-1] is goal:
            found = [len(tree) - 1]
            while parent[found[-1]] >= 0:
                found.append(parent[found[-1]])
            return np.array(tree)[found[::-1]]
    return None


def panda(robots, named):
    """An arm on a table among three boxes, and how far its joints go."""
    table = box([1.2, 1.6, 0.05], centre=[0.2, 0, -0.03])
    boxes = [box([0.2, 0.2, 0.2], centre) for centre in ([0.45, 0, 0.45], [0.3, 0.35, 0.6], [0.35, -0.4, 0.3])]
    return Robot(named[0] if named else robots / "panda_description/urdf/panda.urdf", [table] + boxes), 1.0


def talos(robots, named):
    """A humanoid that flies between pillars, with its joints near to rest."""
    pillars = [box([0.3, 0.3, 3], [x, y, 0]) for x in (-1, 1) for y in (-1, 1)]
    base = np.array([[-1.5, -1.5, -0.5], [1.5, 1.5, 0.5]])
    return Robot(named[0] if named else robots / "talos_data/robots/talos_reduced.urdf", pillars, base=base, levels=["0.3%"]), 0.1


def main():
    named = [argument for argument in sys.argv[1:] if not argument.startswith("--")]
    robots = Path(pinocchio.__file__).parents[4] / "share/example-robot-data/robots"
    robot, spread = (talos if "--base-moves" in sys.argv else panda)(robots, named)
    rng = np.random.default_rng(3)
    some = robot.random(rng, 4000, spread)
    touching = robot.touching(some)
    print(f"{touching.sum()} of {len(some)} configurations of {len(robot.links)} links touch something")
    start, goal = some[~touching][:2]
    found = way(robot, start, goal, rng, spread)
    print("no way was found" if found is None else f"a way by {len(found)} configurations touches nothing")
    if "--picture" in sys.argv and found is not None:
        shown = robot.poses(found[:: max(1, len(found) // 4)])
        links = np.arange(len(robot.links))
        bodies = [tandem.instances(asset=links, rotation=poses[:, :3], translation=poses[:, 3]) for poses in shown] + [robot.scene.instances()[len(links):]]
        tandem.view(robot.assets, np.concatenate(bodies), picture="plan_robot.png", size=(640, 400), azimuth=-40, elevation=25)


if __name__ == "__main__":
    main()
