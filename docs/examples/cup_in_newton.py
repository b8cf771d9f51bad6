"""A ball that falls into a cup, both meshes, in Newton, on the CPU."""
import sys

try:
    import warp as wp

    wp.config.log_level = wp.LOG_ERROR
    import newton
except ImportError:
    print("needs the package newton")
    sys.exit(77)

import numpy as np

import tandem.newton
from shapes import turned

cup = turned([(0, 0), (0.18, 0), (0.18, 0.25), (0.15, 0.25), (0.15, 0.04), (0, 0.04)], 32, closed=False)
arc = np.linspace(-np.pi / 2, np.pi / 2, 17)
ball = turned(np.stack([0.1 * np.cos(arc), 0.1 * np.sin(arc)], 1), 32, closed=False)

wp.set_device("cpu")
builder = newton.ModelBuilder()
builder.add_ground_plane()
for (vertices, triangles), height in ((cup, 0.0), (ball, 0.3)):
    body = builder.add_body(xform=wp.transform((0, 0, height), wp.quat_identity()))
    builder.add_shape_mesh(body, mesh=newton.Mesh(vertices, triangles.ravel()))
model = builder.finalize()

pipeline = tandem.newton.CollisionPipeline(model)  # instead of newton.CollisionPipeline(model)
contacts, state, following, control = pipeline.contacts(), model.state(), model.state(), model.control()
solver = newton.solvers.SolverXPBD(model, iterations=10)
for step in range(500):
    state.clear_forces()
    pipeline.collide(state, contacts)
    solver.step(state, following, control, contacts, 1 / 500)
    state, following = following, state
print(f"the ball has come to rest {state.body_q.numpy()[1, 2]:.2f} m above the ground, in the cup")

if "--picture" in sys.argv:
    tandem.view(pipeline.assets, pipeline.instances, picture="cup_in_newton.png", size=(640, 400), azimuth=30, elevation=35, opacity=0.6)
