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


@cache
def log(payload: float, friction: float, seconds: float) -> tuple[np.ndarray, ...]:
    """Coordinates, rates and efforts of the arm as it follows sines, moved by another program in parts of a row."""
    model = mujoco.MjModel.from_xml_string(arm(payload))
    model.opt.timestep, model.opt.integrator = 1 / RATE / SUBSTEPS, mujoco.mjtIntegrator.mjINT_RK4
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data, rows = mujoco.MjData(model), []
    data.qpos[:] = [0.1, 0.4, -0.5]
    for t in np.arange(int(seconds * RATE)) / RATE:
        target = [0.9 * np.sin(3.1 * t), 0.8 * np.sin(4.3 * t + 1), 1.1 * np.sin(5.9 * t + 2) - 0.4]
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
        seed: int, payload: float = 0.0, friction: float = 0.0, seconds: float = SECONDS, filtered: int = 1
    ) -> RecordJudgement:
        random, noisy = np.random.default_rng(seed), []
        for item, part in zip(log(payload, friction, seconds), (STATES, STATES, EFFORTS), strict=True):
            noise = random.normal(size=(len(item) + filtered - 1, item.shape[1]))
            alike = sum(noise[k : k + len(item)] for k in range(filtered)) / np.sqrt(filtered)
            noisy.append(item + part * np.ptp(item, axis=0) * alike)
        names = [f"{kind}.{joint}" for kind in ("q", "v", "effort") for joint in JOINTS]
        table = np.column_stack([np.arange(len(noisy[0])) / RATE, *noisy]).tolist()
        lines = [",".join(["time", *names]), *(",".join(map(repr, row)) for row in table)]
        (tmp_path / "log.csv").write_text("\n".join(lines))
        return judge_record(tmp_path / "log.csv", tmp_path / "arm.urdf", None)

    return judgement


def sizes(judgement: RecordJudgement) -> dict[str, tuple[float, float, str]]:
    """Cause of the layer of accelerations, which is not decided -> its number, its bar, and its sentence."""
    layer = judgement.layers[-1]
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
