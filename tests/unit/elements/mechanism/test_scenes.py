import tomllib
from pathlib import Path

import numpy as np
import pytest

from proofroll.elements.mechanism import Tree
from proofroll.elements.mechanism.dynamics.analysis import analyse
from proofroll.elements.mechanism.reading.reader import KINDS

MODELS = Path(__file__).parents[4] / "models"

# rows of loops, their rank, degrees of freedom, determinate components of the wrenches of joints and loops
EXPECTED = {
    "pendulum": (0, 0, 1, 6),
    "double_pendulum": (0, 0, 2, 12),
    "free_body": (0, 0, 6, 6),
    "heavy_top": (0, 0, 3, 6),
    "slider_crank": (5, 2, 1, 12),
    "four_bar": (10, 4, 1, 21),
    "bricard": (5, 4, 1, None),
    "andrews_squeezer": (15, 6, 1, 30),
    "chain": (0, 0, 10, 60),
    "oscillators": (0, 0, 2, 12),
    "gyroscope_cart": (0, 0, 4, 18),
}


@pytest.mark.parametrize("name", EXPECTED)
def test_rank_and_mobility(scene, name):
    """Each scene has the rank, redundancy, mobility and determinate reactions that mechanics gives it."""
    rows, rank, mobility, determinate = EXPECTED[name]
    found = analyse(scene(name))
    assert (found.rows, found.rank, found.mobility) == (rows, rank, mobility)
    assert found.redundant == rows - rank
    assert determinate is None or found.determinate.sum() == determinate


def test_no_reaction_of_bricards_mechanism_is_determinate(scene):
    """Of each hinge, only the moment about its own axis is known, where that axis keeps a direction of the world."""
    mechanism = scene("bricard")
    mask = analyse(mechanism).determinate
    assert not mask[:, :3].any()
    assert mask[0].tolist() == [False, False, False, False, True, False]  # hinge0 turns about -y of the world


@pytest.mark.parametrize("name", EXPECTED)
def test_scene_says_what_it_is_for(name):
    """Each scene has a title, a reason, a source, a duration, and a unit, meaning and source for each parameter."""
    content = tomllib.loads((MODELS / name / "scene.toml").read_text())
    assert all(content[key] for key in ("title", "reason", "source", "duration"))
    for parameter in content["parameters"].values():
        assert all(parameter[key] for key in ("unit", "meaning", "source"))
    assert any(kind in content or "repeat" in content for kind in KINDS)


def test_reactions_at_rest_carry_the_weight(scene):
    """The ground's joints together carry the weight of a mechanism at rest in its lowest position."""
    from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates

    equations = JointCoordinates(scene("chain", angle=0.0, links=4, mass=2.0))
    wrench = equations.sample(*equations.mechanism.start())["wrench"]
    assert wrench[:, 1] == pytest.approx(9.81 * 2.0 * np.array([4, 3, 2, 1]), rel=1e-14)


def test_andrews_initial_accelerations_and_multipliers(scene):
    """β̈ and Θ̈ at the start are the literature's, so all parameters are."""
    from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates

    mechanism = scene("andrews_squeezer")
    acceleration = JointCoordinates(mechanism).solve(*mechanism.start()).acceleration
    assert acceleration[:2] == pytest.approx([14222.4439199541, -10666.8329399656], rel=1e-12)


def test_windows_and_links_are_parameters(scene):
    """N windows have 3N + 1 bodies... each its own loop; a chain of n links hangs together."""
    assert len(scene("four_bar", windows=5).loops) == 5
    assert len(scene("four_bar", windows=5).bodies) == 11
    chain = scene("chain", links=7, angle=0.0)
    motion = Tree(chain).at(*chain.start())
    assert motion.p_WB[6, 1] == pytest.approx(-0.6)
