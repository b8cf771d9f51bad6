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
    """

    def __init__(self, urdf, standing, prepare=lambda mesh: mesh):
        packages = [str(folder) for folder in Path(urdf).parents]
        self.model = pinocchio.buildModelFromUrdf(str(urdf))
        links = pinocchio.buildGeomFromUrdf(self.model, str(urdf), pinocchio.GeometryType.VISUAL, package_dirs=packages).geometryObjects
        self.links = [link for link in links if isinstance(link.geometry, coal.BVHModelBase)]
        self.meshes = [prepare(self._mesh(link)) for link in self.links] + list(standing)
        self.data = self.model.createData()
        joints, parents = [link.parentJoint for link in self.links], self.model.parents
        self.excluded = [(j, i) for i in range(len(joints)) for j in range(i) if joints[i] == joints[j] or parents[joints[i]] == joints[j] or parents[joints[j]] == joints[i]]
        self.excluded += [(i, j) for i, joint in enumerate(joints) if joint == 0 for j in range(len(joints), len(self.meshes))]
        self.assets = [tandem.build(*mesh) for mesh in self.meshes]
        self.scene = tandem.Scene(self.assets)
        self._place()
        at_rest = self.scene.configurations(np.arange(len(joints)), transform=self.poses([pinocchio.neutral(self.model)]), pairs="all").pairs
        self.excluded += [(a, b) for _, a, b in at_rest.tolist() if b < len(joints)]
        self._place()

    def _place(self):
        count = len(self.meshes)
        self.scene.place(asset=np.arange(count), translation=np.zeros((count, 3)), filter=tandem.Filter(excluded=self.excluded or None))

    @staticmethod
    def _mesh(link):
        shape = link.geometry
        corners = [[shape.tri_indices(i)[k] for k in range(3)] for i in range(shape.num_tris)]
        return np.array(shape.vertices()) * link.meshScale, np.array(corners)

    def poses(self, configurations):
        """Of each link in each configuration, (k, links, 4, 4)."""
        made = np.empty((len(configurations), len(self.links), 4, 4))
        for poses, configuration in zip(made, configurations, strict=True):
            pinocchio.forwardKinematics(self.model, self.data, configuration)
            for i, link in enumerate(self.links):
                poses[i] = (self.data.oMi[link.parentJoint] * link.placement).homogeneous
        return made

    def touching(self, configurations, within=0.0):
        """Whether anything touches, or comes within a distance, in each configuration, (k,) bool."""
        return self.scene.configurations(np.arange(len(self.links)), transform=self.poses(configurations), within=within).touching

    def random(self, rng, count):
        lowest, highest = self.model.lowerPositionLimit, self.model.upperPositionLimit
        some = rng.uniform(np.where(np.isfinite(lowest), lowest, -np.pi), np.where(np.isfinite(highest), highest, np.pi), (count, self.model.nq))
        return np.array([pinocchio.normalize(self.model, configuration) for configuration in some])


def way(robot, start, goal, rng, reach=0.6, step=0.02):
    """A way from start to goal along which nothing touches at any `step`, (n, joints), or None."""
    tree, parent = [start], [-1]
    for _ in range(2000):
        aim = goal if rng.random() < 0.2 else robot.random(rng, 1)[0]
        nearest = int(np.argmin(np.linalg.norm(np.array(tree) - aim, axis=1)))
        length = np.linalg.norm(aim - tree[nearest])
        end = tree[nearest] + (aim - tree[nearest]) * min(1, reach / length)
        edge = np.linspace(tree[nearest], end, int(np.ceil(min(length, reach) / step)) + 1)
        if robot.touching(edge).any():
            continue
        tree.append(end)
        parent.append(nearest)
        if np.array_equal(end, goal):
            found = [len(tree) - 1]
            while parent[found[-1]] >= 0:
                found.append(parent[found[-1]])
            return np.array(tree)[found[::-1]]
    return None


def main():
    named = [argument for argument in sys.argv[1:] if argument != "--picture"]
    urdf = named[0] if named else Path(pinocchio.__file__).parents[4] / "share/example-robot-data/robots/panda_description/urdf/panda.urdf"
    table = box([1.2, 1.6, 0.05], centre=[0.2, 0, -0.03])
    robot = Robot(urdf, [table] + [box([0.2, 0.2, 0.2], centre) for centre in ([0.45, 0, 0.45], [0.3, 0.35, 0.6], [0.35, -0.4, 0.3])])
    rng = np.random.default_rng(3)
    some = robot.random(rng, 4000)
    touching = robot.touching(some)
    print(f"{touching.sum()} of {len(some)} configurations of {len(robot.links)} links touch something")
    start, goal = some[~touching][:2]
    found = way(robot, start, goal, rng)
    print("no way was found" if found is None else f"a way by {len(found)} configurations touches nothing")
    if "--picture" in sys.argv and found is not None:
        shown = robot.poses(found[:: max(1, len(found) // 4)])
        links = np.arange(len(robot.links))
        bodies = [tandem.instances(asset=links, transform=transforms) for transforms in shown] + [robot.scene.instances()[len(links):]]
        tandem.view(robot.assets, np.concatenate(bodies), picture="plan_robot.png", size=(640, 400), azimuth=-40, elevation=25)


if __name__ == "__main__":
    main()
