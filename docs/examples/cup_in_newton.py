"""A ball that falls into a cup, both meshes, in Newton, on the CPU."""
import sys

try:
    import warp as wp

    wp.config.log_level = wp.LOG_WARNING
    import newton
except ImportError:
    print("needs the package newton")
    sys.exit(77)

import tandem.newton
from shapes import turned

cup = turned([(0, 0), (0.18, 0), (0.18, 0.25), (0.15, 0.25), (0.15, 0.04), (0, 0.04)], 32, closed=False)
ball = turned([(0, -0.1), (0.06, -0.08), (0.08, -0.06), (0.1, 0), (0.08, 0.06), (0.06, 0.08), (0, 0.1)], 32, closed=False)

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
