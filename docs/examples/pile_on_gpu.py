"""A pile in PyTorch on a GPU: 216 rings of mass 1 fall on a floor. Poses, contacts and forces never leave the GPU."""
import sys

import numpy as np

import tandem
from shapes import box, torus

try:
    import torch
    import tandem.cuda
    torch.zeros(1, device="cuda")
except (ImportError, RuntimeError, AssertionError) as missing:
    print("skipped, for want of PyTorch, of tandem.cuda or of a GPU:", missing)
    sys.exit(77)

SIDE, SECONDS, STEP, GRAVITY, STIFFNESS, DAMPING, FRICTION, INERTIA = 6, 4.0, 1 / 240, 10.0, 3000.0, 10.0, 0.5, 0.125
rings = SIDE ** 3  # the floor is the body after them
torch.set_default_device("cuda")
torch.set_default_dtype(torch.float64)
pose = torch.zeros(rings + 1, 4, 3)  # rows: the rotation's three, then the translation
orthogonal = np.linalg.qr(np.random.default_rng(0).normal(size=(rings, 3, 3)))[0]
pose[:rings, :3] = torch.from_numpy(orthogonal * np.linalg.det(orthogonal)[:, None, None])
pose[:rings, 3] = 1.35 * torch.cartesian_prod(*[torch.arange(SIDE) - 0.5 * (SIDE - 1)] * 3) + torch.tensor([0, 0, 4.2])
pose[rings, :3] = torch.eye(3)
asset = (torch.arange(rings + 1) == rings).to(torch.int32)
moved = torch.where(asset == 1, tandem.FIXED, tandem.MOVING).to(torch.uint8)
velocity, spin, down = torch.zeros(rings + 1, 3), torch.zeros(rings + 1, 3), torch.tensor([0, 0, -GRAVITY])

stream = torch.cuda.current_stream()
assets = [tandem.build(*torus(0.5, 0.15, 24, 12)), tandem.build(*box((100, 100, 1), (0, 0, -0.5)))]
query = tandem.cuda.Query(assets, contents="manifolds", stream=stream)
bodies = query.instances(asset, pose, stream=stream)  # no copy: the steps write poses where the query reads them
asked = tandem.cuda.Filter(motion=moved, stream=stream)
for _ in range(round(SECONDS / STEP)):
    query.contacts(bodies, grouped=True, filter=asked, stream=stream)
    pairs, manifolds, points = query.manifolds()
    depth, position = (torch.from_dlpack(points[name]) for name in ("depth", "position"))
    region = torch.from_dlpack(points["manifold"]).long()
    normal, pair = torch.from_dlpack(manifolds["normal"])[region], torch.from_dlpack(manifolds["pair"]).long()[region]
    a, b = (torch.from_dlpack(pairs[side]).long()[pair] for side in "ab")
    arm_a, arm_b = position - pose[a, 3], position - pose[b, 3]
    slip = velocity[b] + torch.linalg.cross(spin[b], arm_b) - velocity[a] - torch.linalg.cross(spin[a], arm_a)
    parting = (slip * normal).sum(1, keepdim=True)
    push = (STIFFNESS * depth[:, None] - DAMPING * parting).clamp(min=0)
    aside = slip - parting * normal
    force = push * normal - aside * (FRICTION * push / (aside.norm(dim=1, keepdim=True) + 1e-9)).clamp(max=DAMPING)
    load = torch.zeros_like(velocity).index_add_(0, b, force).index_add_(0, a, -force) + down
    torque = torch.zeros_like(spin).index_add_(0, b, torch.linalg.cross(arm_b, force)).index_add_(0, a, -torch.linalg.cross(arm_a, force))
    velocity[:rings] += STEP * load[:rings]
    spin[:rings] += STEP / INERTIA * torque[:rings]
    pose[:, 3] += STEP * velocity
    pose[:, :3] = torch.linalg.matrix_exp(STEP * torch.linalg.cross(spin[:, None], torch.eye(3)[None]).mT) @ pose[:, :3]
height, speed = pose[:rings, 3, 2], velocity[:rings].norm(dim=1)
print(f"{rings} rings:", "none fell through the floor," if height.min() > 0.1 else "some fell through the floor,",
      "they lie in a heap" if height.max() < 3 and speed.median() < 0.3 else "they have not come to rest")
if "--picture" in sys.argv:
    at = pose.cpu().numpy()
    instances = tandem.instances(asset.cpu().numpy(), rotation=at[:, :3], translation=at[:, 3])
    tandem.view(assets, instances, motion=moved.cpu().numpy(), picture="pile_on_gpu.png", size=(640, 400))
