"""Actuators of an MJCF in a robot's scene, against MuJoCo's own reading of the file."""

import numpy as np
import pytest
from robot_templates import mjcf

from proofroll import simulate
from proofroll.core.errors import Refused
from proofroll.core.truth import truth
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.files.scene_file import load_scene

mujoco = pytest.importorskip("mujoco")

DEFAULTS = (
    '<default><position kp="7" kv="0.5"/><default class="weak"><position forcerange="-0.1 0.1"/></default></default>'
)
ACTUATORS = {
    "motor": '<motor name="m" joint="k1" gear="3"/>',
    "position": '<position name="m" joint="k1" kp="20" kv="2" gear="-3"/>',
    "position of a class": '<position name="m" joint="k2"/>',
    "limited by its class": '<position name="m" joint="k2" class="weak" gear="2"/>',
    "limited, but not": '<position name="m" joint="k2" class="weak" forcelimited="false"/>',
    "velocity": '<velocity name="m" joint="k2" kv="4" gear="2"/>',
    "general": '<general name="m" joint="k2" gainprm="30" biastype="affine" biasprm="0 -30 -2"/>',
    "control in a range": '<position name="m" joint="k2" ctrlrange="0.3 1"/>',
    "two": '<position name="m" joint="k1" kp="20" kv="0"/><velocity name="v" joint="k1" kv="3"/>',
    "general, by the default of positions": '<general name="m" joint="k2"/>',
    "motor, by the limit of positions": '<motor name="m" joint="k2" class="weak" ctrlrange="0.5 1"/>',
    "effort of the joint": '<position name="m" joint="k1" kp="2000"/>',
    "damping ratio": '<position name="m" joint="k1" kp="40" dampratio="1.5"/>',
    "range of the joint": '<position name="m" joint="k1" kp="20" inheritrange="0.5"/>',
    "a group that is off": '<position name="m" joint="k1" kp="20" group="2"/>',
    "constant push": '<general name="m" joint="k1" gainprm="30" biastype="affine" biasprm="5 -20 -2" gear="2"/>',
    "several": '<position name="m" joint="k1" kp="20" gear="2"/><general joint="k1" gainprm="3" gear="-1"/>'
    '<general joint="k1" gainprm="2" biastype="affine" biasprm="1 -30 -2" gear="3"/>',
    "two limits": '<motor name="m" joint="k1" gear="80"/><motor joint="k1" gear="90"/>',
    "rotor": '<motor name="m" joint="k1" gear="3" armature="0.02" damping="0.3"/>',
}
JOINT = 'actuatorfrcrange="-50 50" ref="15" range="20 60" limited="true"'


FLAGS = ("", '<flag clampctrl="disable"/>', '<flag actuation="disable"/>')
# Each actuator under one flag in turns, at both controls, before a change lands.
CASES = [
    pytest.param(
        text,
        flag,
        keyframe,
        id=f"{name}-{flag}-{keyframe}",
        marks=() if (place + number) % len(FLAGS) == 0 else pytest.mark.nightly,
    )
    for place, (name, text) in enumerate(ACTUATORS.items())
    for number, flag in enumerate(FLAGS)
    for keyframe in (0, 1)
]


@pytest.mark.one_in(4)
@pytest.mark.parametrize(("actuators", "flag", "keyframe"), CASES)
def test_efforts_are_those_of_the_file(tmp_path, actuators, flag, keyframe):
    """Each joint has the effort that MuJoCo gives it in the pose of release, at zero and at a keyframe's controls."""
    text = mjcf(actuator=actuators, joint=JOINT, option='actuatorgroupdisable="2"')
    text = text.replace("<worldbody>", f"<option>{flag}</option>{DEFAULTS}<worldbody>")
    controls = " ".join(["0.7", "0", "-2"][: actuators.count("joint=")])
    text = text.replace("</mujoco>", f'<keyframe><key ctrl="{controls}"/></keyframe></mujoco>')
    path = tmp_path / "arm.xml"
    path.write_text(text)
    made = load_scene(str(path), actuators=1, keyframe=keyframe).elements[0].mechanism
    q, v = made.start()
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = model.qpos0 + q, v
    data.ctrl[:] = keyframe * model.key_ctrl[0]
    mujoco.mj_forward(model, data)
    found = np.zeros(2)
    for actuator, effort in zip(made.actuators, JointCoordinates(made).efforts(0.0, q, v), strict=True):
        found[made.joint_index[actuator.joint]] += effort
    assert found == pytest.approx(data.qfrc_actuator, rel=1e-12, abs=1e-15)
    assert made.actuators
    assert load_scene(str(path)).elements[0].mechanism.actuators == ()


@pytest.mark.nightly
def test_an_arm_of_a_file_moves_under_its_servos(tmp_path):
    """A robot whose servos act has a truth, which MuJoCo's run of the scene agrees with."""
    path = tmp_path / "arm.xml"
    path.write_text(mjcf(actuator='<position name="m" joint="k1" kp="20" kv="2" forcerange="-5 5"/>'))
    scene = load_scene(str(path), actuators=1)
    true = truth(scene, np.array([0.0, 0.2, 0.4]))
    run = simulate(scene, "mujoco", until=0.4, every=0.2)
    assert float(np.abs(run["positions"] - true["positions"]).max()) < 1e-5
    assert float(np.abs(run["effort.m"] - true["effort.m"]).max()) < 1e-3


UNLIKE = {
    "dyntype integrator": '<general name="m" joint="k1" dyntype="integrator"/>',
    "dyntype filterexact, a time constant": '<position name="m" joint="k1" timeconst="0.1"/>',
    "forcerange of two sizes": '<motor name="m" joint="k1" forcerange="-1 2"/>',
    "actuatorfrcrange of two sizes": '<motor name="m" joint="k2"/>',
    "transmission site": '<motor name="m" site="s"/>',
    "gaintype affine": '<damper name="m" joint="k1" kv="3" ctrlrange="0 1"/>',
    "dyntype user": '<plugin name="m" joint="k1" plugin="mujoco.pid" actdim="1"><config key="kp" value="4"/></plugin>',
    "delay 0.1": '<motor name="m" joint="k1" delay="0.1" nsample="3"/>',
    "biasprm, which pushes onward": '<general name="m" joint="k1" biastype="affine" biasprm="0 3 0"/>',
    "joint of several coordinates": '<motor name="m" joint="k3"/>',
}
SECOND = '<joint name="k2" axis="1 0 0" actuatorfrcrange="-1 2"/>'
LOOSE = '<body><joint name="k3" type="ball"/><geom size="0.1"/></body>'


@pytest.mark.parametrize(("law", "actuator"), UNLIKE.items(), ids=UNLIKE)
def test_an_actuator_that_no_scene_has_is_named(tmp_path, law, actuator):
    """An actuator with a law that no scene has, of activation, delay, ends or place: one line names it and the law."""
    path = tmp_path / "arm.xml"
    path.write_text(mjcf(actuator=actuator, second=SECOND, base='<site name="s"/>', extra=LOOSE))
    with pytest.raises(Refused, match=rf"the actuator m with its {law}.* \(actuators=0 leaves all out\)"):
        truth(load_scene(str(path), actuators=1), np.array([0.0, 0.1]))


def test_two_limits_at_one_joint_are_not_added(tmp_path):
    """Two actuators of one joint, one with a limit of its own, have no common law: the second is named."""
    path = tmp_path / "arm.xml"
    path.write_text(mjcf(actuator='<motor name="n" joint="k1" forcerange="-2 2"/><motor name="m" joint="k1"/>'))
    with pytest.raises(Refused, match=r"the actuator m beside another of its joint, with a limit of one alone"):
        truth(load_scene(str(path), actuators=1), np.array([0.0, 0.1]))
