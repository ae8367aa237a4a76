"""Small URDF and MJCF files of an arm, without equal numbers or symmetries, with optional parts inserted."""

from __future__ import annotations

_LINK = """
<link name="{name}">{inertial}{extra}</link>"""
_INERTIAL = """<inertial><origin xyz="{com}" rpy="{rpy}"/><mass value="{mass}"/>
<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="{ixy}" ixz="0.002" iyz="-0.001"/></inertial>"""
_MOMENTS = {"ixx": "0.03", "iyy": "0.04", "izz": "0.05", "ixy": "0.003"}


def inertial(**changes: str) -> str:
    """An inertial element."""
    values = {"com": "0.1 0.02 -0.05", "rpy": "0 0 0", "mass": "1.3"} | _MOMENTS | changes
    return _INERTIAL.format(**values)


def spherical(mass: str, moment: str, com: str = "0.1 0.02 -0.05") -> str:
    """An inertial element with three equal moments."""
    plain = inertial(mass=mass, com=com, ixx=moment, iyy=moment, izz=moment, ixy="0")
    return plain.replace('ixz="0.002" iyz="-0.001"', 'ixz="0" iyz="0"')


def urdf(
    *,
    tip: str | None = None,
    tool: str = "",
    first: str = "",
    second: str = "",
    third: str = "",
    kinds: tuple[str, str, str] = ("revolute", "prismatic", "continuous"),
    extra: str = "",
) -> str:
    """A URDF: base, shoulder, slide, tip, and a tool fixed to the tip.

    Args:
        tip: <inertial> of the tip; None: an ordinary one.
        tool: content of the tool's link.
        first: content added to the first joint.
        second: content added to the second joint.
        third: content added to the third joint.
        kinds: types of the joints.
        extra: content added to <robot>.
    """
    limit = '<limit lower="-1.5" upper="1.2" effort="10" velocity="3"/>'
    return f"""<robot name="arm">
{_LINK.format(name="base", inertial=inertial(mass="4"), extra="")}
{_LINK.format(name="shoulder", inertial=inertial(mass="2.1", com="0 0.1 0.03"), extra="")}
{_LINK.format(name="slide", inertial=inertial(mass="0.9", com="-0.03 0 0.2"), extra="")}
{_LINK.format(name="tip", inertial=inertial() if tip is None else tip, extra="")}
<link name="tool">{tool}</link>
<joint name="j1" type="{kinds[0]}"><parent link="base"/><child link="shoulder"/>
<origin xyz="0.1 0 0.4" rpy="0.3 -0.2 0.5"/><axis xyz="0 0.6 0.8"/>{limit}{first}</joint>
<joint name="j2" type="{kinds[1]}"><parent link="shoulder"/><child link="slide"/>
<origin xyz="0 0.2 0.3" rpy="-0.4 0.1 0.2"/><axis xyz="1 0 0"/>{limit}{second}</joint>
<joint name="j3" type="{kinds[2]}"><parent link="slide"/><child link="tip"/>
<origin xyz="0.3 0.1 0" rpy="0.2 0.7 -0.3"/><axis xyz="0 -0.8 0.6"/>{third}</joint>
<joint name="weld" type="fixed"><parent link="tip"/><child link="tool"/>
<origin xyz="0.05 0.1 0.2" rpy="0.5 0.4 0.1"/></joint>{extra}
</robot>"""


def mjcf(
    *,
    compiler: str = "",
    option: str = "",
    joint: str = "",
    second: str = '<joint name="k2" type="hinge" axis="1 0 0" pos="0.02 0 0.1"/>',
    shape: str = "",
    base: str = "",
    extra: str = "",
    actuator: str = "",
) -> str:
    """An MJCF: an arm of two bodies with shapes.

    Args:
        compiler: attributes of <compiler>.
        option: attributes of <option>.
        joint: attributes of the first joint.
        second: joints of the second body.
        shape: attributes of the second body's shape.
        base: content added to the first body.
        extra: content added to <worldbody>.
        actuator: content of <actuator>.
    """
    return f"""<mujoco model="arm"><compiler {compiler}/><option {option}/>
<worldbody><body name="upper" pos="0.1 0.2 0.3" euler="10 20 30">{base}
<joint name="k1" type="hinge" axis="0 0.6 0.8" {joint}/>
<geom type="capsule" fromto="0 0 0 0.1 0.2 0.4" size="0.05"/>
<body name="lower" pos="0.1 0.2 0.4" euler="-20 5 40">{second}
<geom type="box" pos="0.05 0 0.1" size="0.05 0.07 0.11" {shape}/></body></body>{extra}</worldbody>
<actuator>{actuator}</actuator></mujoco>"""
