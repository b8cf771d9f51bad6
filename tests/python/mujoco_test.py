"""tandem.mujoco: MuJoCo's filters, parameters and steps stay as they are, and meshes are no longer their hulls."""
import pathlib

import numpy as np
import pytest

import solids
import tandem

mujoco = pytest.importorskip("mujoco", reason="needs the package mujoco")
import tandem.mujoco  # noqa: E402

PARAMETERS = ("includemargin", "friction", "solref", "solreffriction", "solimp", "adhesion", "dim")  # those that all points of a pair share


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo keeps a log where it runs


def mesh_xml(name, mesh):
    vertices, faces = (" ".join(map(repr, values.ravel().tolist())) for values in mesh)
    return f"<mesh name='{name}' vertex='{vertices}' face='{faces}'/>"


def model_of(bodies, option="timestep='0.002'", extra="", memory="64M", **shapes):
    assets = "".join(mesh_xml(name, mesh) for name, mesh in shapes.items())
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><option {option}/><size memory='{memory}'/><asset>{assets}</asset><default><geom type='mesh' density='500'/></default>"
        f"<worldbody>{bodies}</worldbody>{extra}</mujoco>")


def free(name, position, attributes="", geom=""):
    return f"<body name='{name}' pos='{position}' {attributes}><freejoint/><geom mesh='{name}' {geom}/></body>"


def run(model, seconds, step):
    data = mujoco.MjData(model)
    while data.time < seconds:
        step(data)
    return data


def shown(model):
    """The data of the model as it stands, with the contacts that Tandem finds, and how many these are."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return data, tandem.mujoco.MeshContacts(model).collide(data)


def both(model, seconds):
    """The state after some seconds, by MuJoCo alone and with Tandem's contacts."""
    return run(model, seconds, lambda data: mujoco.mj_step(model, data)), run(model, seconds, tandem.mujoco.MeshContacts(model).step)


# ---- Hulls touch, meshes do not


def test_ball_falls_into_cup():
    model = model_of("<geom type='plane' size='2 2 0.1'/>" + free("cup", "0 0 0") + free("ball", "0.01 0 0.4"),
                     cup=solids.cup(0.15, 0.18, 0.04, 0.25), ball=solids.ball(0.1))
    alone, with_tandem = both(model, 2)
    assert alone.body("ball").xpos[2] > 0.3  # lies on the lid that the cup does not have
    assert with_tandem.body("ball").xpos[2] == pytest.approx(0.14, abs=0.003)
    assert np.abs(with_tandem.qvel[:6]).max() < 0.01
    assert np.abs(with_tandem.qvel[6:9]).max() < 0.05  # it still rolls from facet to facet


def test_ring_slides_down_a_peg():
    model = model_of(f"<geom mesh='peg'/>{free('ring', '0.002 0.001 0.3')}", peg=solids.peg(0.05, 0.4), ring=solids.ring(0.06, 0.1, 0.03))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon > 0 and data.contact.dist.min() < -0.1  # hull in hull
    assert tandem.mujoco.MeshContacts(model).collide(data) == 0 and data.ncon == 0
    with_tandem = run(model, 0.2, tandem.mujoco.MeshContacts(model).step)
    assert with_tandem.body("ring").xpos[2] == pytest.approx(0.3 - 0.5 * 9.81 * 0.2**2, abs=0.005)  # falls freely


def test_chain_hangs():
    """Links at right angles through each other hang under the first, which is fixed: MuJoCo throws them apart."""
    count, step = 4, 0.15
    bodies = "<body pos='0 0 2' euler='90 0 0'><geom mesh='link'/></body>"
    for i in range(1, count):
        angles = "90 90 0" if i % 2 else "90 0 0"
        bodies += f"<body name='link{i}' pos='0 0 {2 - i * step}' euler='{angles}'><freejoint/><geom mesh='link'/></body>"
    model = model_of(bodies, link=solids.chain_link(0.1, 0.02))
    alone, with_tandem = both(model, 2)
    heights = [2 - with_tandem.body(f"link{i}").xpos[2] for i in range(1, count)]
    assert heights == pytest.approx([0.16 * i for i in range(1, count)], abs=0.01)  # 2 (radius - wire)
    assert max(abs(2 - alone.body(f"link{i}").xpos[2] - 0.16 * i) for i in range(1, count)) > 0.1


# ---- Meshes meet primitives


def test_mug_hangs_on_a_hook():
    """By its handle; MuJoCo's hulls fill the handle, so that it is thrown off."""
    handle = "<geom mesh='handle' pos='0.15 0 0.125' euler='90 0 0'/>"
    model = model_of("<geom type='capsule' size='0.01 0.15' pos='0.2 0 1' euler='75 0 0'/>"
                     f"<body name='cup' pos='0 0 0.83'><freejoint/><geom mesh='cup'/>{handle}</body>",
                     cup=solids.cup(0.08, 0.09, 0.01, 0.25), handle=solids.chain_link(0.08, 0.015))
    alone, with_tandem = both(model, 3)
    assert alone.body("cup").xpos[2] < -1
    contacts = with_tandem.contact
    assert {tuple(geom) for geom in contacts.geom.tolist()} == {(0, 2)}  # hook and handle
    assert with_tandem.body("cup").xpos[2] > 0.6  # it swings


def test_sphere_falls_into_cup():
    model = model_of("<geom type='plane' size='2 2 0.1'/>" + free("cup", "0 0 0") + "<body name='ball' pos='0.01 0 0.4'><freejoint/><geom type='sphere' size='0.1'/></body>",
                     cup=solids.cup(0.15, 0.18, 0.04, 0.25))
    alone, with_tandem = both(model, 2)
    assert alone.body("ball").xpos[2] > 0.3
    assert with_tandem.body("ball").xpos[2] == pytest.approx(0.14, abs=0.001)


def test_box_stands_on_a_plane():
    """A tilted one, with its name and number; however far away, and beside another body that is far away."""
    plane = "<geom type='plane' size='1 1 0.1' pos='0 0 1' euler='0 30 0'/>"
    half = np.sqrt(3) / 2
    model = model_of(plane + "".join(f"<body pos='{0.099 * 0.5 + x * half} {y} {1 + 0.099 * half - 0.5 * x}' euler='0 30 0'><freejoint/><geom mesh='box'/></body>"
                                     for x, y in ((0, 0), (70, -3), (-4000, 900))), box=solids.box(0.1, 0.05, 0.1))
    data, count = shown(model)
    assert count == 12 == data.ncon
    assert data.contact.geom.tolist() == [[0, body] for body in (1, 2, 3) for _ in range(4)]
    np.testing.assert_allclose(data.contact.dist, -0.001, atol=1e-8)
    np.testing.assert_allclose(data.contact.frame[:, :3], np.tile([0.5, 0, half], (12, 1)), atol=1e-9)
    model = model_of("<geom type='plane' size='1 1 0.1'/>" + free("box", "0 0 0.11"), box=solids.box(0.1, 0.05, 0.1))
    data = run(model, 1, tandem.mujoco.MeshContacts(model).step)
    assert data.qpos[2] == pytest.approx(0.1, abs=2e-4) and np.abs(data.qvel).max() < 1e-9


def test_what_is_wholly_below_a_plane_comes_up():
    model = model_of("<geom type='plane' size='1 1 0.1'/>" + free("box", "0 0 -0.3"), box=solids.box(0.1, 0.05, 0.1))
    data, count = shown(model)
    assert count == 0 and data.ncon > 0 and data.contact.dist.min() == pytest.approx(-0.4, abs=1e-6)
    assert run(model, 2, tandem.mujoco.MeshContacts(model).step).qpos[2] > 0


def test_contacts_do_not_depend_on_the_steps_before():
    model = model_of("<geom type='plane' size='1 1 0.1'/>" + free("box", "0 0 0.11") + free("ball", "0.5 0 0.11"), box=solids.box(0.1, 0.05, 0.1), ball=solids.ball(0.1))
    contacts = tandem.mujoco.MeshContacts(model)
    data = mujoco.MjData(model)
    for place in (0, 30, 3000, 0.4):
        data.qpos[:3] = place, 2 * place, 0.0999
        mujoco.mj_kinematics(model, data)
        rows = []
        for either in (contacts, tandem.mujoco.MeshContacts(model)):
            assert either.collide(data) > 0
            rows.append([getattr(data.contact, name).tolist() for name in ("geom", "dist", "pos", "frame")])
        assert rows[0] == rows[1]


SHAPES = {"sphere": "0.1", "capsule": "0.1 0.2", "ellipsoid": "0.1 0.2 0.3", "cylinder": "0.1 0.2", "box": "0.1 0.2 0.3"}


@pytest.mark.parametrize("kind", SHAPES)
def test_overlap_with_a_primitive_is_right_to_the_tolerance(kind):
    """It lies in the plane of a floor, at many angles: how deep its lowest point is, is known."""
    random = np.random.default_rng(3)
    floor = solids.box(2, 2, 0.5)
    for _ in range(20):
        turn = random.normal(size=4)
        model = model_of(f"<geom mesh='floor' pos='0 0 -0.5'/><body pos='0 0 1' quat='{' '.join(map(str, turn / np.linalg.norm(turn)))}'><freejoint/>"
                         f"<geom type='{kind}' size='{SHAPES[kind]}'/></body>", floor=floor)
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        up = data.geom_xmat[1].reshape(3, 3)[2]
        size = model.geom_size[1]
        low = {"sphere": lambda: size[0], "capsule": lambda: size[0] + size[1] * abs(up[2]), "ellipsoid": lambda: np.linalg.norm(size * up),
               "cylinder": lambda: size[0] * np.hypot(*up[:2]) + size[1] * abs(up[2]), "box": lambda: np.abs(size * up).sum()}[kind]()
        data.qpos[2] = low - 0.01
        mujoco.mj_kinematics(model, data)
        contacts = tandem.mujoco.MeshContacts(model, tolerance=0.003)
        assert contacts.collide(data) > 0
        assert data.contact.dist.min() == pytest.approx(-0.01, abs=1e-7 if kind == "box" else 0.0031 * np.linalg.norm(size))
        assert data.contact.frame[data.contact.dist.argmin(), 2] == pytest.approx(-1, abs=1e-9)  # from the primitive to the mesh, as MuJoCo has it


def test_height_field_is_that_of_mujoco():
    """Its surface is where MuJoCo's rays meet it, cell by cell, and a box lies on it."""
    random = np.random.default_rng(5)
    heights = " ".join(map(str, random.uniform(size=30)))
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><asset><hfield name='hills' nrow='5' ncol='6' size='1 0.8 0.3 0.1' elevation='{heights}'/>{mesh_xml('box', solids.box(.1, .1, .1))}</asset>"
        "<worldbody><geom type='hfield' hfield='hills'/><body pos='0 0 0.6'><freejoint/><geom type='mesh' mesh='box' density='500'/></body></worldbody></mujoco>")
    data, contacts = mujoco.MjData(model), tandem.mujoco.MeshContacts(model)
    mujoco.mj_forward(model, data)
    a, b, c = contacts.assets[0].triangles().astype(float).transpose(1, 0, 2)
    assert contacts.assets[0].triangles()[..., 2].min() == pytest.approx(-0.1)
    geom = np.zeros(1, np.int32)
    for x, y in random.uniform((-1, -0.8), (1, 0.8), (200, 2)):
        distance = mujoco.mj_ray(model, data, np.array([x, y, 2.0]), np.array([0, 0, -1.0]), None, 1, 1, geom)
        normal = np.cross(b - a, c - a)
        inside = np.ones(len(a), bool)
        for start, end in ((a, b), (b, c), (c, a)):
            inside &= (end - start)[:, 0] * (y - start[:, 1]) - (end - start)[:, 1] * (x - start[:, 0]) >= 0
        top = inside & (normal[:, 2] > 0)
        height = (a[:, 2] + ((a[:, 0] - x) * normal[:, 0] + (a[:, 1] - y) * normal[:, 1]) / np.where(top, normal[:, 2], 1))[top].max()
        assert height == pytest.approx(2 - distance, abs=1e-6)
    data = run(model, 5, contacts.step)
    assert 0.1 < data.qpos[2] < 0.5 and np.abs(data.qvel).max() < 0.01


# ---- What holds


@pytest.mark.parametrize("kind", ["sphere", "mesh"])
def test_ball_does_not_fall_through_a_thin_floor(kind):
    """With MuJoCo's own stiffness, from 0.6 m on 2 mm: a slab, and the bottom of a cup."""
    ball = {"sphere": "type='sphere' size='0.04'", "mesh": "mesh='ball'"}[kind]
    thin = solids.cup(0.09, 0.1, 0.002, 0.2)
    for floor in ("<geom mesh='cup'/>", "<geom mesh='slab' pos='0 0 0.001'/>"):
        model = model_of(f"{floor}<body name='ball' pos='0.02 0.001 0.642'><freejoint/><geom {ball}/></body>", cup=thin, slab=solids.box(0.3, 0.3, 0.001),
                         ball=solids.ball(0.04))
        data = run(model, 1, tandem.mujoco.MeshContacts(model).step)
        assert data.body("ball").xpos[2] > 0.03


@pytest.mark.parametrize("kind, size", [("cylinder", "0.01 0.04"), ("capsule", "0.01 0.04"), ("ellipsoid", "0.04 0.03 0.01")])
def test_what_lies_on_its_round_side_lies_still(kind, size):
    """Its weight rests on the middle of the overlap, not on whichever end is deeper."""
    model = model_of(f"<geom mesh='floor'/><body pos='0 0 0.111' euler='{0 if kind == 'ellipsoid' else 90} 0 0'><freejoint/><geom type='{kind}' size='{size}'/></body>",
                     floor=solids.box(1, 1, 0.1))
    data = run(model, 2, tandem.mujoco.MeshContacts(model).step)
    assert data.qpos[2] == pytest.approx(0.11, abs=0.0005) and np.abs(data.qvel[:3]).max() < 1e-3
    assert np.hypot(*data.qpos[:2]) < 0.001


# ---- What stays MuJoCo's


def random_model(random):
    """Overlapping cubes, boxes and balls of random trees of bodies, with random filters and parameters: no hulls are apart, so that contacts tell which pairs
    may collide."""
    names = {"body": 0, "geom": 0}

    def words(values):
        return " ".join(map(str, values))

    def take(kind):
        names[kind] += 1
        return f"{kind[0]}{names[kind]}"

    def geom():
        uniform = random.uniform
        solref = f"{uniform(0.01, 0.03)} {uniform(0.5, 2)}" if random.random() < 0.7 else f"{-uniform(100, 900)} {-uniform(1, 9)}"
        solimp = f"{uniform(.5, .9)} {uniform(.9, .99)} {uniform(.001, .1)} {uniform(.2, .8)} {uniform(1, 4)}"
        shape = random.choice(["mesh='cube'", "mesh='cube'", "type='box' size='.5 .4 .5'", "type='sphere' size='.5'"])
        return (f"<geom name='{take('geom')}' {shape} pos='{words(uniform(-.3, .3, 3))}' euler='{words(uniform(0, 90, 3))}' margin='{uniform(0, .01)}' "
                f"friction='{words(uniform(0, (1, .1, .1)))}' solref='{solref}' solimp='{solimp}' condim='{random.choice([1, 3, 4, 6])}' "
                f"gap='{random.choice([0, .002])}' solmix='{random.choice([0, 1, uniform()])}' priority='{random.choice([0, 0, 1])}' adhesion='{uniform()}' "
                f"contype='{random.integers(4)}' conaffinity='{random.integers(4)}' surfacevel='{words(uniform(size=6))}'/>")

    def body(depth):
        joint = random.choice(["", "<joint axis='0 1 0'/>"] if depth else ["", "<freejoint/>", "<joint type='slide'/>"])
        inside = "".join(body(depth + 1) for _ in range(random.integers(0, 3))) if depth < 2 else ""
        return (f"<body name='{take('body')}'>{joint}<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>"
                f"{''.join(geom() for _ in range(random.integers(1, 3)))}{inside}</body>")

    world = geom() + geom() + "".join(body(0) for _ in range(3))
    excluded = "".join(f"<exclude body1='b{a}' body2='b{b}'/>" for a, b in random.integers(1, names["body"] + 1, (3, 2)) if a != b)
    chosen = {tuple(random.choice(np.arange(3, names["geom"] + 1), 2, replace=False)) for _ in range(3)}
    pairs = "".join(f"<pair geom1='g{a}' geom2='g{b}' condim='{random.choice([1, 3, 4, 6])}' friction='{words(random.uniform(size=5))}' "
                    f"margin='{random.uniform(0, .01)}' gap='0.001' solref='0.015 1.1' solimp='.8 .9 .01 .5 2' adhesion='{random.uniform()}' "
                    f"solreffriction='{random.choice([0, 0.02])} 1'/>" for a, b in {tuple(sorted(pair)) for pair in chosen})
    flags = "".join(f" {name}='{random.choice(['enable', 'disable'])}'" for name in ("override", "filterparent"))
    return (f"<mujoco><option o_margin='.003' o_friction='.4 .4 .1 .1 .1' o_solref='.03 1.1' o_solimp='.7 .9 .01 .4 2'><flag{flags}/></option>"
            f"<size memory='64M'/><asset>{mesh_xml('cube', solids.box(0.5, 0.5, 0.5))}</asset><default><geom type='mesh'/></default><worldbody>{world}</worldbody>"
            f"<contact>{excluded}{pairs}</contact></mujoco>")


def by_pair(data):
    return {tuple(pair): {name: getattr(data.contact, name)[i].copy() for name in PARAMETERS} for i, pair in enumerate(data.contact.geom.tolist())}


def test_filters_and_parameters_are_those_of_mujoco():
    compared = 0
    for seed in range(60):
        model = mujoco.MjModel.from_xml_string(random_model(np.random.default_rng(seed)))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        theirs = by_pair(data)
        if not theirs:
            with pytest.raises(ValueError, match="no mesh geom"):
                tandem.mujoco.MeshContacts(model)
            continue
        tandem.mujoco.MeshContacts(model, tolerance=0.02).collide(data)
        ours = by_pair(data)
        assert ours.keys() <= theirs.keys()  # of bodies inside each other none touches
        for pair, values in ours.items():
            compared += 1
            for name, value in values.items():
                np.testing.assert_allclose(value, theirs[pair][name], rtol=1e-12, atol=1e-15, err_msg=f"{name} of {pair}, seed {seed}")
    assert compared > 1000


@pytest.mark.skipif(not hasattr(mujoco.MjContact, "surfacevel"), reason="MuJoCo before 4")
def test_surface_velocity_is_that_of_mujoco():
    """A box on a moving belt: the same points of both, and so the same velocities."""
    model = model_of("<geom mesh='belt' surfacevel='0.3 0.1 0 0.2 0.1 0.5'/>" + free("box", "0.3 0.2 0.199", geom="surfacevel='0 0.5 0 0 0 1'"),
                     belt=solids.box(1, 1, 0.1), box=solids.box(0.1, 0.15, 0.1))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    theirs = {tuple(np.round(p, 6)): v for p, v in zip(data.contact.pos.copy(), data.contact.surfacevel.copy())}
    assert tandem.mujoco.MeshContacts(model).collide(data) == 4
    ours = {tuple(np.round(p, 6)): v for p, v in zip(data.contact.pos, data.contact.surfacevel)}
    assert ours.keys() == theirs.keys()
    for position, velocity in ours.items():
        np.testing.assert_allclose(velocity, theirs[position], atol=1e-12)


WITHOUT_TOUCHING_MESHES = """
<geom type='plane' size='5 5 0.1'/><geom mesh='box' pos='9 0 9'/>
<body name='cart' pos='0 0 1'><joint name='slide' type='slide' axis='1 0 0' damping='0.1' range='-1 1' limited='true'/><geom type='box' size='0.1 0.1 0.1'/>
  <body pos='0 0 -0.2'><joint name='swing' axis='0 1 0' frictionloss='0.01'/><geom type='capsule' size='0.03 0.2' pos='0 0 -0.2'/>
    <site name='tip' pos='0 0 -0.4'/></body></body>
<body pos='1 0 3'><freejoint/><geom mesh='box' priority='1'/><site name='site'/></body>
<body pos='1.1 0.1 0.4'><freejoint/><geom type='sphere' size='0.1'/></body>"""
WITH_ALL_ELSE = """
<tendon><spatial name='rope' stiffness='3' springlength='0.5'><site site='tip'/><site site='site'/></spatial></tendon>
<equality><joint joint1='swing' polycoef='0.1 0 0 0 0' active='true'/></equality>
<actuator><motor joint='slide' gear='2'/><position joint='swing' kp='3'/></actuator>
<sensor><e_potential/><e_kinetic/><framepos objtype='site' objname='tip'/><touch site='site'/><accelerometer site='site'/><tendonpos tendon='rope'/></sensor>"""


OPTIONS = ["integrator='Euler'", "integrator='implicit' cone='elliptic'", "integrator='implicitfast' solver='CG' noslip_iterations='3'"]


@pytest.mark.parametrize("option", OPTIONS)
def test_a_step_without_contacts_of_meshes_is_a_step_of_mujoco(option):
    model = model_of(WITHOUT_TOUCHING_MESHES, option, WITH_ALL_ELSE, box=solids.box(0.1, 0.2, 0.15))
    contacts = tandem.mujoco.MeshContacts(model)
    alone, with_tandem = mujoco.MjData(model), mujoco.MjData(model)
    for step in range(300):
        alone.ctrl[:] = with_tandem.ctrl[:] = np.sin(0.1 * step), np.cos(0.07 * step)
        mujoco.mj_step(model, alone)
        contacts.step(with_tandem)
        for name in ("qpos", "qvel", "qacc", "sensordata", "qfrc_constraint", "actuator_force"):
            assert np.array_equal(getattr(alone, name), getattr(with_tandem, name)), f"{name}, step {step}"


def test_contacts_with_other_geoms_stay():
    sphere = "<body pos='0.5 0 0.0999'><freejoint/><geom type='sphere' size='0.1'/></body>"
    model = model_of("<geom type='plane' size='2 2 0.1'/>" + free("cup", "0 0 -0.001") + free("ball", "0 0 0.1385") + sphere,
                     cup=solids.cup(0.15, 0.18, 0.04, 0.25), ball=solids.ball(0.1))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    def others(): return [(geom, dist) for geom, dist in zip(data.contact.geom.tolist(), data.contact.dist.tolist()) if geom == [0, 3]]
    theirs = others()
    added = tandem.mujoco.MeshContacts(model).collide(data)
    assert len(theirs) == 1 and others() == theirs and added == data.ncon - 1 > 0


# ---- Margins


def test_points_within_margin_and_gap():
    model = model_of("<geom mesh='floor' margin='0.01' gap='0.02'/>" + free("ball", "0.2 0.1 0.215"), floor=solids.box(1, 1, 0.1), ball=solids.ball(0.1))
    data = mujoco.MjData(model)
    contacts = tandem.mujoco.MeshContacts(model)
    for height, is_in_gap in ((0.215, True), (0.205, False), (0.235, None)):
        data.qpos[2] = height
        mujoco.mj_kinematics(model, data)
        count = contacts.collide(data)
        if is_in_gap is None:
            assert count == 0
            continue
        deepest = data.contact.dist.argmin()
        assert count > 3 and data.contact.dist[deepest] == pytest.approx(height - 0.2, abs=1e-6) and data.contact.dist.max() <= 0.03
        np.testing.assert_array_equal(data.contact.exclude, data.contact.dist >= 0.01)
        assert data.contact.exclude[deepest] == is_in_gap
        np.testing.assert_allclose(data.contact.pos[deepest], [0.2, 0.1, 0.1 + 0.5 * (height - 0.2)], atol=1e-6)
        np.testing.assert_allclose(data.contact.frame[:, :3], np.tile([0, 0, 1], (count, 1)), atol=1e-6)


def test_bodies_rest_on_their_margins():
    """Level and still, though they never meet: all corners are contacts."""
    model = model_of("<geom mesh='floor' margin='0.004'/>" + free("box", "0 0 0.21"), floor=solids.box(1, 1, 0.1), box=solids.box(0.1, 0.05, 0.1))
    data = run(model, 1, tandem.mujoco.MeshContacts(model).step)
    assert data.ncon == 4 and 0 < data.contact.dist.min() and data.contact.dist.max() < 0.004
    assert abs(data.qpos[3]) > 1 - 1e-6 and np.abs(data.qvel).max() < 1e-3


def test_what_is_met_only_on_the_way_is_no_contact():
    """A box over the edge of another: moved down by the margin it is deep beside it, and shallow sideways."""
    model = model_of(f"<geom mesh='box' margin='0.01'/>{free('box', '0.199 0 0.203')}", box=solids.box(0.1, 0.1, 0.1))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    assert tandem.mujoco.MeshContacts(model).collide(data) > 0
    np.testing.assert_allclose(data.contact.dist, 0.003, atol=1e-6)
    np.testing.assert_allclose(data.contact.frame[:, :3], np.tile([0, 0, 1], (data.ncon, 1)), atol=1e-6)


# ---- The page


def test_the_program_of_the_page_runs():
    page = pathlib.Path(__file__).parents[2] / "docs" / "python_simulators.md"
    program = page.read_text().split("## MuJoCo")[1].split("```python\n")[1].split("```")[0]
    scene = model_of("<geom type='plane' size='2 2 0.1'/>" + free("cup", "0 0 0") + free("ball", "0.01 0 0.4"),
                     cup=solids.cup(0.15, 0.18, 0.04, 0.25), ball=solids.ball(0.1))
    mujoco.mj_saveLastXML("scene.xml", scene)
    names = {"mujoco": mujoco, "tandem": tandem}
    exec(program, names)
    assert names["data"].body("ball").xpos[2] == pytest.approx(0.14, abs=0.01)


# ---- Errors


def test_what_cannot_be_done_is_said():
    shapes = {"ball": solids.ball(0.1), "floor": solids.box(1, 1, 0.1)}
    scene = "<geom mesh='floor'/>" + free("ball", "0 0 0.199")
    with pytest.raises(ValueError, match="no mesh geom of the model may collide"):
        tandem.mujoco.MeshContacts(model_of(free("ball", "0 0 0"), ball=shapes["ball"]))
    for count in (0, 8):
        with pytest.raises(ValueError, match=f"most_points {count}: is not from 1 to 7"):
            tandem.mujoco.MeshContacts(model_of(scene, **shapes), most_points=count)
    for tolerance in (0, 0.6, np.nan):
        with pytest.raises(ValueError, match=f"tolerance {tolerance}: is not from 1e-6 to 0.5"):
            tandem.mujoco.MeshContacts(model_of(scene, **shapes), tolerance=tolerance)
    for option, extra, message in (("integrator='RK4'", "", "RK4"), ("", "<option><flag sleep='enable'/></option>", "sleep")):
        model = model_of(scene, option, extra, **shapes)
        with pytest.raises(ValueError, match=message):
            tandem.mujoco.MeshContacts(model).step(mujoco.MjData(model))


def test_data_of_another_model_are_refused():
    shapes = {"ball": solids.ball(0.1), "floor": solids.box(1, 1, 0.1)}
    contacts = tandem.mujoco.MeshContacts(model_of("<geom mesh='floor'/>" + free("ball", "0 0 0.199"), **shapes))
    with pytest.raises(ValueError, match="another number of geoms"):
        contacts.collide(mujoco.MjData(model_of("<geom mesh='floor'/>", **shapes)))


def test_no_contact_is_dropped_where_there_is_no_room():
    model = model_of("<geom mesh='floor'/>" + "".join(f"<body pos='{0.21 * i - 0.9} 0 0.199'><freejoint/><geom mesh='box'/></body>" for i in range(9)),
                     memory="20K", floor=solids.box(1, 1, 0.1), box=solids.box(0.1, 0.1, 0.1))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    with pytest.raises(MemoryError, match="36 contacts"):
        tandem.mujoco.MeshContacts(model).collide(data)
    assert data.ncon == 0


def test_a_pose_that_is_not_a_number_is_an_error():
    model = model_of("<geom mesh='floor'/>" + free("ball", "0 0 0.199"), floor=solids.box(1, 1, 0.1), ball=solids.ball(0.1))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    data.geom_xpos[1, 0] = np.nan
    with pytest.raises(tandem.Error):
        tandem.mujoco.MeshContacts(model).collide(data)
