"""MuJoCo's arrays as samples and built models."""

import mujoco
import numpy as np

from proofroll import load_scene
from proofroll.adapter import MujocoArrays, mechanism_of
from proofroll.engines.mujoco import Mujoco, mjspec
from proofroll.engines.mujoco.settings import PRESETS


def test_arrays_give_what_the_adapter_of_mujoco_gives() -> None:
    """A model of ``mjspec`` has the state and the numbers of MuJoCo's own adapter, of a tree on a free body too."""
    for name in ("double_pendulum", "leg_in_the_air"):
        scene = load_scene(name)
        model = mjspec(scene, portable=True, sensors=False).compile()
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
        mujoco.mj_forward(model, data)
        assert model.nsensor == 0
        arrays, own = MujocoArrays.of(mechanism_of(scene), model), Mujoco.build(scene, PRESETS["joints"]["matched"])
        for given, expected in (
            (arrays.sample(lambda field, data=data: getattr(data, field)), own.sample()),
            (arrays.built(lambda field, model=model: getattr(model, field), model.opt.gravity), own.built()),
        ):
            for field in ("p_WB", "v_WB", "w_WB", "q_WB", "mass", "com", "inertia", "gravity"):
                if hasattr(given, field):
                    assert np.allclose(getattr(given, field), getattr(expected, field), rtol=0, atol=1e-12), field
