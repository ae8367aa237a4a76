"""Logs with the noise of a real robot end in sizes with their bars, and name nothing that is not there."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
import pytest

from proofroll.robots.control.judge import RecordJudgement, judge_record

JOINTS = ("yaw", "shoulder", "elbow")
AXES, PLACES = ("0 0 1", "0 1 0", "0 1 0"), ("0 0 0", "0 0.05 -0.1", "0 0 -0.4")
MASSES, CENTRES = (3.0, 2.0, 1.0), ((0.0, 0.01, -0.1), (0.01, 0.0, -0.2), (0.0, 0.0, -0.15))
INERTIA = np.diag([0.02, 0.025, 0.008])  # of each kilogram
STATES, EFFORTS = 1e-3, 3e-3  # noise in parts of the range of a column
PAYLOAD, PLACE, FRICTION = 0.52, np.array([0.0, 0.02, -0.3]), 0.11
RATE, SUBSTEPS, SECONDS = 1000, 4, 4.0
KP, KD = np.array([60.0, 80.0, 40.0]), np.array([4.0, 5.0, 2.0])
TARGETS = ("0.9*sin(3.1*t)", "0.8*sin(4.3*t+1)", "1.1*sin(5.9*t+2)-0.4")
SEEDS = 20
Judged = Callable[..., RecordJudgement]


def inertial(mass: float, centre: np.ndarray, inertia: np.ndarray) -> str:
    """Inertial of a link."""
    moments = " ".join(
        f'i{a}{b}="{float(inertia["xyz".index(a), "xyz".index(b)])!r}"' for a in "xyz" for b in "xyz" if a <= b
    )
    place = " ".join(map(repr, centre.tolist()))
    return f'<inertial><origin xyz="{place}"/><mass value="{mass}"/><inertia {moments}/></inertial>'


def point(mass: float, arm: np.ndarray) -> np.ndarray:
    """Inertia of a mass at the end of an arm."""
    return np.asarray(mass * (arm @ arm * np.eye(3) - np.outer(arm, arm)))


def arm(payload: float = 0.0) -> str:
    """URDF of an arm of three joints whose last link carries a mass at a point."""
    parts, parent = ['<link name="base"/>'], "base"
    for k, joint in enumerate(JOINTS):
        mass, centre, inertia = MASSES[k], np.array(CENTRES[k]), INERTIA * MASSES[k]
        if joint == JOINTS[-1]:
            whole = (mass * centre + payload * PLACE) / (mass + payload)
            inertia = inertia + point(mass, centre - whole) + point(payload, PLACE - whole)
            mass, centre = mass + payload, whole
        parts.append(f'<link name="link{k}">{inertial(mass, centre, inertia)}</link>')
        ends = f'<origin xyz="{PLACES[k]}"/><parent link="{parent}"/><child link="link{k}"/><axis xyz="{AXES[k]}"/>'
        limit = '<limit lower="-9" upper="9" effort="500" velocity="99"/>'
        parts.append(f'<joint name="{joint}" type="revolute">{ends}{limit}</joint>')
        parent = f"link{k}"
    return f'<robot name="arm">{"".join(parts)}</robot>'


def targets(t: np.ndarray | float) -> np.ndarray:
    """Targets of the joints at a time [s]."""
    return np.stack([0.9 * np.sin(3.1 * t), 0.8 * np.sin(4.3 * t + 1), 1.1 * np.sin(5.9 * t + 2) - 0.4], axis=-1)


def controller(folder: Path, kp: float) -> Path:
    """File of the arm's controller, with a factor on its gains kp."""
    gains = (f'[[gains]]\njoints = "{j}"\nkp = {kp * p}\nkd = {d}' for j, p, d in zip(JOINTS, KP, KD, strict=True))
    goals = "\n".join(f'{joint} = "= {target}"' for joint, target in zip(JOINTS, TARGETS, strict=True))
    path = folder / "control.toml"
    path.write_text("\n".join([f'rate = {RATE}\nheld = "effort"', *gains, "[targets]", goals]))
    return path


@cache
def log(payload: float, friction: float, seconds: float) -> tuple[np.ndarray, ...]:
    """Coordinates, rates and efforts of the arm as it follows sines, moved by another program in parts of a row."""
    model = mujoco.MjModel.from_xml_string(arm(payload))
    model.opt.timestep, model.opt.integrator = 1 / RATE / SUBSTEPS, mujoco.mjtIntegrator.mjINT_RK4
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data, rows = mujoco.MjData(model), []
    data.qpos[:] = [0.1, 0.4, -0.5]
    for t in np.arange(int(seconds * RATE)) / RATE:
        target = targets(t)
        effort = KP * (target - data.qpos) - KD * data.qvel
        rows.append((data.qpos.copy(), data.qvel.copy(), effort))
        for _ in range(SUBSTEPS):
            data.qfrc_applied[:] = effort - [0.0, friction * np.sign(data.qvel[1]), 0.0]
            mujoco.mj_step(model, data)
    return tuple(np.array(part) for part in zip(*rows, strict=True))


@pytest.fixture
def judged(tmp_path: Path) -> Judged:
    """Judgement of a log with seeded noise, against the arm without payload and friction."""
    (tmp_path / "arm.urdf").write_text(arm())

    def judgement(
        seed: int,
        payload: float = 0.0,
        friction: float = 0.0,
        seconds: float = SECONDS,
        filtered: int = 1,
        kinds: tuple[str, ...] = (),
        kp: float = 1.0,
    ) -> RecordJudgement:
        random, noisy = np.random.default_rng(seed), []
        for item, part in zip(log(payload, friction, seconds), (STATES, STATES, EFFORTS), strict=True):
            noise = random.normal(size=(len(item) + filtered - 1, item.shape[1]))
            alike = sum(noise[k : k + len(item)] for k in range(filtered)) / np.sqrt(filtered)
            noisy.append(item + part * np.ptp(item, axis=0) * alike)
        times = np.arange(len(noisy[0])) / RATE
        columns = dict(zip(("q", "v", "effort", "target"), (*noisy, targets(times)), strict=True))
        shown = kinds or ("q", "v", "effort")
        names = [f"{kind}.{joint}" for kind in shown for joint in JOINTS]
        table = np.column_stack([times, *(columns[kind] for kind in shown)]).tolist()
        lines = [",".join(["time", *names]), *(",".join(map(repr, row)) for row in table)]
        (tmp_path / "log.csv").write_text("\n".join(lines))
        control = controller(tmp_path, kp) if kinds else None
        return judge_record(tmp_path / "log.csv", tmp_path / "arm.urdf", control)

    return judgement


def sizes(judgement: RecordJudgement) -> dict[str, tuple[float, float, str]]:
    """Cause of the layer of accelerations, which is not decided -> its number, its bar, and its sentence."""
    layer = next(item for item in judgement.layers if item.name == "acceleration")
    if not layer.noise:  # its noise is not white by chance: it tells nothing
        assert not layer.causes
        return {}
    assert layer.undecided
    assert layer.noise > STATES
    assert not judgement.decided
    found = {}
    for cause in layer.causes:
        value, bar = re.search(r"(\S+) ± (\S+)", cause.sentence).groups()  # type: ignore[union-attr]  # all have bars
        found[cause.id] = float(value), float(bar), cause.sentence
    return found


@pytest.mark.drill
def test_a_second_of_a_noisy_log_tells_a_payload(judged: Judged) -> None:
    """A second of a noisy log is undecided, and tells the payload of the last link with a bar that covers it."""
    found = sizes(judged(0, PAYLOAD, seconds=1.0))
    assert set(found) == {"payload"}
    value, bar, words = found["payload"]
    assert abs(value - PAYLOAD) <= bar < PAYLOAD / 2
    assert "link2" in words


CONTROLLED = [("q", "v", "effort", "target"), ("q", "v")]  # columns of a log under a controller


@pytest.mark.drill
@pytest.mark.parametrize("kinds", CONTROLLED)
def test_a_noisy_log_under_a_controller_tells_a_payload(kinds: tuple[str, ...], judged: Judged) -> None:
    """The controller's own layers are not accused of noise, and the payload is told with a bar that covers it."""
    judgement = judged(0, PAYLOAD, seconds=1.0, kinds=kinds)
    assert judgement.agrees
    value, bar, words = sizes(judgement)["payload"]
    assert round(abs(value - PAYLOAD), 9) <= bar < PAYLOAD / 2  # both are told to two digits
    assert "link2" in words
    assert not [cause for layer in judgement.layers if layer.name != "acceleration" for cause in layer.causes]


@pytest.mark.drill
def test_noise_hides_no_gain_that_is_another(judged: Judged) -> None:
    """Efforts of another kp than the file's do not hold, however noisy the log is."""
    judgement = judged(0, seconds=1.0, kinds=CONTROLLED[0], kp=0.8)
    assert not judgement.agrees
    assert next(layer for layer in judgement.layers if not layer.holds).name == "effort"


@pytest.mark.nightly
@pytest.mark.parametrize("kinds", CONTROLLED)
@pytest.mark.parametrize(("payload", "friction"), [(0.0, 0.0), (PAYLOAD, FRICTION)])
def test_bars_of_logs_under_a_controller_cover_what_is_there(
    payload: float, friction: float, kinds: tuple[str, ...], judged: Judged
) -> None:
    """Of twenty seeded logs at least 19 name what is there and nothing else, within three standard deviations."""
    there, right = {name: size for name, size in (("payload", payload), ("friction", friction)) if size}, 0
    for seed in range(SEEDS):
        judgement = judged(seed, payload, friction, kinds=kinds)
        found = sizes(judgement)
        covered = all(
            round(abs(found[name][0] - size), 9) <= found[name][1] for name, size in there.items() if name in found
        )
        right += judgement.agrees and set(found) == set(there) and covered
    assert right >= 19


@pytest.mark.drill
def test_a_noisy_log_of_a_base_that_floats_tells_no_size(tmp_path: Path) -> None:
    """In free flight little but noise is left of accelerations: they are not decided, and no mass is told."""
    base = inertial(6.0, np.array([0.01, 0.0, 0.02]), 6 * INERTIA)
    (tmp_path / "arm.urdf").write_text(arm().replace('<link name="base"/>', f'<link name="base">{base}</link>'))
    spec = mujoco.MjSpec.from_file(str(tmp_path / "arm.urdf"))
    spec.compiler.fusestatic = False
    spec.worldbody.first_body().add_freejoint()
    model = spec.compile()
    model.opt.timestep = 1 / RATE
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data, rows = mujoco.MjData(model), []
    data.qvel[:6] = [0.3, 0.2, 6.0, 0.5, -0.3, 0.4]
    for t in np.arange(RATE) / RATE:
        effort = KP * (targets(t) - data.qpos[7:]) - KD * data.qvel[6:]
        mujoco.mj_forward(model, data)
        spin = data.xmat[1].reshape(3, 3) @ data.qvel[3:6]
        rows.append([*data.qpos[7:], *data.qvel[6:], *effort, *data.qpos[:7], *data.qvel[:3], *spin])
        data.qfrc_applied[6:] = effort
        mujoco.mj_step(model, data)
    table = np.array(rows)
    table += STATES * np.ptp(table, axis=0) * np.random.default_rng(0).normal(size=table.shape)
    table[:, 12:16] /= np.linalg.norm(table[:, 12:16], axis=1)[:, None]
    names = [f"{kind}.{joint}" for kind in ("q", "v", "effort") for joint in JOINTS]
    names += [f"{kind}.{axis}" for kind in ("p_WB", "q_WB", "v_WB", "w_WB") for axis in ("xyz", "wxyz")[kind == "q_WB"]]
    lines = [
        ",".join(["time", *names]),
        *(",".join(map(repr, [k / RATE, *row])) for k, row in enumerate(table.tolist())),
    ]
    (tmp_path / "log.csv").write_text("\n".join(lines))
    judgement = judge_record(tmp_path / "log.csv", tmp_path / "arm.urdf", None)
    assert judgement.agrees
    assert not judgement.decided
    assert not [cause for layer in judgement.layers for cause in layer.causes]


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("payload", "friction", "seconds"),
    [(PAYLOAD, 0.0, SECONDS), (PAYLOAD, 0.0, 1.0), (PAYLOAD, FRICTION, SECONDS), (0.0, 0.0, SECONDS)],
)
def test_bars_of_noisy_logs_cover_what_is_there(
    payload: float, friction: float, seconds: float, judged: Judged
) -> None:
    """Of twenty seeded logs at least 17 bars cover each true size, and at least 18 logs name no cause more."""
    there = {name: size for name, size in (("payload", payload), ("friction", friction)) if size}
    logs = [sizes(judged(seed, payload, friction, seconds)) for seed in range(SEEDS)]
    assert sum(set(found) <= set(there) for found in logs) >= 18
    for name, size in there.items():
        told = [found[name] for found in logs if name in found]
        assert len(told) >= 18
        assert sum(abs(value - size) <= bar for value, bar, _ in told) >= 17
        assert max(bar for _, bar, _ in told) < size / 2
        assert all(("link2" if name == "payload" else "shoulder") in words for *_, words in told)


@pytest.mark.drill
def test_noise_that_is_not_white_tells_no_size(judged: Judged) -> None:
    """Noise whose neighbours are alike is no measure of an error: no size is told from it."""
    layer = judged(0, PAYLOAD, seconds=1.0, filtered=8).layers[-1]
    assert layer.noise == 0.0
    assert not any("±" in cause.sentence for cause in layer.causes)
