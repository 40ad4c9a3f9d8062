"""Published numbers of robots, as files of URDF.

The KUKA LBR iiwa 14 R820 as in the package iiwa_stack (C. Hennersperger et al., Towards MRI-based
autonomous robotic US acquisitions: a first feasibility study, IEEE Transactions on Medical Imaging
36, 538 (2017); BSD licence), its lower part without the base. Universal Robots' UR5 as in the
package universal_robot of ROS-Industrial (BSD licence).
"""

from __future__ import annotations

#: Of each link: origin and turn of its joint, limit, mass, centre, moments of inertia.
_IIWA = (
    ("0 0 0.1575", "0 0 0", 170, "4", "0 -0.03 0.12", "0.1 0.09 0.02"),
    ("0 0 0.2025", "P2 0 P", 120, "4", "0.0003 0.059 0.042", "0.05 0.018 0.044"),
    ("0 0.2045 0", "P2 0 P", 170, "3", "0 0.03 0.13", "0.08 0.075 0.01"),
    ("0 0 0.2155", "P2 0 0", 120, "2.7", "0 0.067 0.034", "0.03 0.01 0.029"),
    ("0 0.1845 0", "-P2 P 0", 170, "1.7", "0.0001 0.021 0.076", "0.02 0.018 0.005"),
    ("0 0 0.2155", "P2 0 0", 120, "1.8", "0 0.0006 0.0004", "0.005 0.0036 0.0047"),
    ("0 0.081 0", "-P2 P 0", 175, "0.3", "0 0 0.02", "0.001 0.001 0.001"),
)

#: Of each link: name of its joint, its own, origin, turn and axis of the joint, mass, height of the
#: centre, moments across and along.
_UR5 = (
    ("shoulder_pan", "shoulder", "0 0 0.089159", "0", "z", "3.7", "0", "0.010267495893", "0.00666"),
    (
        "shoulder_lift",
        "upper_arm",
        "0 0.13585 0",
        "P2",
        "y",
        "8.393",
        "0.28",
        "0.22689067591",
        "0.0151074",
    ),
    (
        "elbow",
        "forearm",
        "0 -0.1197 0.425",
        "0",
        "y",
        "2.275",
        "0.25",
        "0.049443313556",
        "0.004095",
    ),
    ("wrist_1", "wrist_1", "0 0 0.39225", "P2", "y", "1.219", "0", "0.111172755531", "0.21942"),
    ("wrist_2", "wrist_2", "0 0.093 0", "0", "z", "1.219", "0", "0.111172755531", "0.21942"),
    ("wrist_3", "wrist_3", "0 0 0.09465", "0", "y", "0.1879", "0", "0.0171364731454", "0.033822"),
)

_RIGHT, _HALF = "1.5707963267948966", "3.141592653589793"


def _turn(text: str) -> str:
    return text.replace("P2", _RIGHT).replace("P", _HALF)


def _link(name: str, mass: str, centre: str, moments: str) -> str:
    xx, yy, zz = moments.split()
    return (
        f'<link name="{name}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
        f'<inertia ixx="{xx}" ixy="0" ixz="0" iyy="{yy}" iyz="0" izz="{zz}"/></inertial></link>'
    )


def _joint(name: str, ends: tuple[str, str], xyz: str, rpy: str, more: str) -> str:
    return (
        f'<joint name="{name}" type="revolute"><parent link="{ends[0]}"/><child link="{ends[1]}"/>'
        f'<origin xyz="{xyz}" rpy="{_turn(rpy)}"/>{more}</joint>'
    )


def iiwa() -> str:
    parts = ['<link name="iiwa_link_0"/>']
    for k, (xyz, rpy, degrees, mass, centre, moments) in enumerate(_IIWA, 1):
        limit = f"{degrees * 3.141592653589793 / 180:.12f}"
        more = (
            f'<axis xyz="0 0 1"/><limit lower="-{limit}" upper="{limit}" effort="300"'
            ' velocity="10"/><dynamics damping="0.5"/>'
        )
        ends = (f"iiwa_link_{k - 1}", f"iiwa_link_{k}")
        parts.append(_link(ends[1], mass, centre, moments))
        parts.append(_joint(f"iiwa_joint_{k}", ends, xyz, rpy, more))
    parts.append('<link name="iiwa_link_ee"/>')
    parts.append(
        '<joint name="tool0_joint" type="fixed"><parent link="iiwa_link_7"/>'
        '<child link="iiwa_link_ee"/><origin xyz="0 0 0.045"/></joint>'
    )
    return f'<robot name="kuka_iiwa">{chr(10).join(parts)}</robot>'


def ur5() -> str:
    parts, before = ['<link name="base_link"/>'], "base_link"
    for joint, link, xyz, pitch, axis, mass, height, across, along in _UR5:
        ends = (before, f"{link}_link")
        more = (
            f'<axis xyz="{"0 0 1" if axis == "z" else "0 1 0"}"/>'
            '<limit lower="-6.28318530718" upper="6.28318530718" effort="150" velocity="3.15"/>'
        )
        parts.append(_link(ends[1], mass, f"0 0 {height}", f"{across} {across} {along}"))
        parts.append(_joint(f"{joint}_joint", ends, xyz, f"0 {pitch} 0", more))
        before = ends[1]
    parts.append('<link name="tool0"/>')
    parts.append(
        '<joint name="tool0_joint" type="fixed"><parent link="wrist_3_link"/><child link="tool0"/>'
        '<origin xyz="0 0.0823 0"/></joint>'
    )
    return f'<robot name="ur5">{chr(10).join(parts)}</robot>'
