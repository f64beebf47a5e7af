"""MuJoCo's compiled models, in the shape of Marathon's `Model` as JSON.

Reads {"files": [path, ...], "texts": [xml, ...]} from stdin and prints {"files": [...], "texts": [...]} with, for
each model, either its fields or {"error": message}.
"""

import json
import sys

import mujoco
import numpy as np

JOINTS = ["Free", "Ball", "Slide", "Hinge"]
SHAPES = ["Plane", "Hfield", "Sphere", "Capsule", "Ellipsoid", "Cylinder", "Box", "Mesh"]
MODES = ["Fixed", "Track", "TrackCom", "TargetBody", "TargetBodyCom"]
INTEGRATORS = {0: "Euler", 1: "Rk4", 2: "Implicit", 3: "ImplicitFast"}
CONES = ["Pyramidal", "Elliptic"]
FLAGS = [
    "constraint", "limit", "contact", "frictionloss", "spring", "damper", "gravity", "clampctrl", "warmstart",
    "actuation", "refsafe", "eulerdamp", "filterparent",
]
SENSORS = {
    "TOUCH": "Touch", "FRAMEPOS": "FramePos", "FRAMEQUAT": "FrameQuat", "FRAMEXAXIS": "FrameXAxis",
    "FRAMEYAXIS": "FrameYAxis", "FRAMEZAXIS": "FrameZAxis", "FRAMELINVEL": "FrameLinVel",
    "FRAMEANGVEL": "FrameAngVel", "FRAMELINACC": "FrameLinAcc", "FRAMEANGACC": "FrameAngAcc",
    "SUBTREECOM": "SubtreeCom", "SUBTREELINVEL": "SubtreeLinVel", "VELOCIMETER": "Velocimeter", "GYRO": "Gyro",
    "ACCELEROMETER": "Accelerometer", "JOINTPOS": "JointPos", "JOINTVEL": "JointVel", "ACTUATORFRC": "ActuatorFrc",
}
OBJECTS = {
    "BODY": "Body", "XBODY": "XBody", "GEOM": "Geom", "SITE": "Site", "CAMERA": "Camera", "JOINT": "Joint",
    "ACTUATOR": "Actuator",
}
GRAY = [0.5, 0.5, 0.5, 1.0]


def first(values):
    """The linear coefficient of a polynomial, or the number itself."""
    values = np.atleast_1d(values)
    return values[0]


def color(m, rgba, material):
    """A shape's color: its own, else its material's."""
    if material >= 0 and list(rgba) == GRAY:
        return m.mat_rgba[material]
    return rgba


def name(m, kind, i):
    return mujoco.mj_id2name(m, kind, i) or ""


def options(m):
    o, bit = m.opt, mujoco.mjtDisableBit
    disabled = {f: bool(o.disableflags & int(getattr(bit, "mjDSBL_" + f.upper()))) for f in FLAGS}
    return {
        "timestep": o.timestep, "gravity": o.gravity, "integrator": INTEGRATORS[int(o.integrator)],
        "cone": CONES[int(o.cone)], "impratio": o.impratio, "iterations": o.iterations,
        "ls_iterations": o.ls_iterations, "tolerance": o.tolerance, "flags": {f: not disabled[f] for f in FLAGS},
    }


def body(m, i):
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_BODY, i), "parent": m.body_parentid[i], "pos": m.body_pos[i],
        "quat": m.body_quat[i], "ipos": m.body_ipos[i], "iquat": m.body_iquat[i], "mass": m.body_mass[i],
        "inertia": m.body_inertia[i], "subtree_mass": m.body_subtreemass[i],
        "joint_start": m.body_jntadr[i] if m.body_jntnum[i] else None, "joint_count": m.body_jntnum[i],
        "dof_start": m.body_dofadr[i] if m.body_dofnum[i] else None, "dof_count": m.body_dofnum[i],
        "geom_start": m.body_geomadr[i] if m.body_geomnum[i] else None, "geom_count": m.body_geomnum[i],
        "weld_id": m.body_weldid[i], "root_id": m.body_rootid[i], "invweight0": m.body_invweight0[i],
        "gravcomp": m.body_gravcomp[i], "mocap": bool(m.body_mocapid[i] >= 0),
    }


def joint(m, i):
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_JOINT, i), "kind": JOINTS[m.jnt_type[i]], "body": m.jnt_bodyid[i],
        "pos": m.jnt_pos[i], "axis": m.jnt_axis[i], "qpos_adr": m.jnt_qposadr[i], "dof_adr": m.jnt_dofadr[i],
        "limited": bool(m.jnt_limited[i]), "range": m.jnt_range[i], "margin": m.jnt_margin[i],
        "stiffness": first(m.jnt_stiffness[i]), "solref_limit": m.jnt_solref[i], "solimp_limit": m.jnt_solimp[i],
        "actuator_force_range": m.jnt_actfrcrange[i] if m.jnt_actfrclimited[i] else "none",
        "group": m.jnt_group[i],
    }


def dof(m, i):
    return {
        "body": m.dof_bodyid[i], "joint": m.dof_jntid[i],
        "parent": m.dof_parentid[i] if m.dof_parentid[i] >= 0 else "none", "armature": m.dof_armature[i],
        "damping": first(m.dof_damping[i]), "frictionloss": m.dof_frictionloss[i],
        "solref_friction": m.dof_solref[i], "solimp_friction": m.dof_solimp[i], "invweight0": m.dof_invweight0[i],
    }


def geom(m, i):
    material = m.geom_matid[i]
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_GEOM, i), "kind": SHAPES[m.geom_type[i]], "body": m.geom_bodyid[i],
        "pos": m.geom_pos[i], "quat": m.geom_quat[i], "size": m.geom_size[i],
        "contype": int(m.geom_contype[i]) % 2**32, "conaffinity": int(m.geom_conaffinity[i]) % 2**32,
        "condim": m.geom_condim[i], "priority": m.geom_priority[i], "friction": m.geom_friction[i],
        "solmix": m.geom_solmix[i], "solref": m.geom_solref[i], "solimp": m.geom_solimp[i],
        "margin": m.geom_margin[i], "gap": m.geom_gap[i], "rgba": color(m, m.geom_rgba[i], material),
        "material": name(m, mujoco.mjtObj.mjOBJ_MATERIAL, material) if material >= 0 else "none",
        "group": m.geom_group[i],
    }


def site(m, i):
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_SITE, i), "kind": SHAPES[m.site_type[i]], "body": m.site_bodyid[i],
        "pos": m.site_pos[i], "quat": m.site_quat[i], "size": m.site_size[i],
        "rgba": color(m, m.site_rgba[i], m.site_matid[i]), "group": m.site_group[i],
    }


def camera(m, i):
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_CAMERA, i), "body": m.cam_bodyid[i], "pos": m.cam_pos[i],
        "quat": m.cam_quat[i], "mode": MODES[m.cam_mode[i]], "fovy": m.cam_fovy[i],
    }


def light(m, i):
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_LIGHT, i), "body": m.light_bodyid[i], "pos": m.light_pos[i],
        "dir": m.light_dir[i], "mode": MODES[m.light_mode[i]], "diffuse": m.light_diffuse[i],
        "directional": int(m.light_type[i]) == int(mujoco.mjtLightType.mjLIGHT_DIRECTIONAL),
    }


def actuator(m, i):
    affine_gain = m.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_AFFINE
    affine_bias = m.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_AFFINE
    gain, bias = m.actuator_gainprm[i, :3], m.actuator_biasprm[i, :3]
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_ACTUATOR, i), "joint": m.actuator_trnid[i, 0],
        "gear": m.actuator_gear[i], "ctrl_limited": bool(m.actuator_ctrllimited[i]),
        "ctrl_range": m.actuator_ctrlrange[i], "force_limited": bool(m.actuator_forcelimited[i]),
        "force_range": m.actuator_forcerange[i],
        "gain": gain if affine_gain else [gain[0], 0, 0], "bias": bias if affine_bias else [0, 0, 0],
    }


def sensor(m, i):
    kind = mujoco.mjtSensor(m.sensor_type[i]).name.removeprefix("mjSENS_")
    supported = kind in SENSORS and m.sensor_refid[i] < 0
    target = mujoco.mjtObj(m.sensor_objtype[i]).name.removeprefix("mjOBJ_")
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_SENSOR, i), "kind": SENSORS[kind] if supported else "Unsupported",
        "object": {OBJECTS[target]: m.sensor_objid[i]} if supported else "None",
        "adr": m.sensor_adr[i], "dim": m.sensor_dim[i], "cutoff": m.sensor_cutoff[i],
    }


def keyframe(m, i):
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_KEY, i), "time": m.key_time[i], "qpos": m.key_qpos[i],
        "qvel": m.key_qvel[i], "ctrl": m.key_ctrl[i],
    }


def pair(m, i):
    return {
        "geoms": [m.pair_geom1[i], m.pair_geom2[i]], "condim": m.pair_dim[i], "friction": m.pair_friction[i],
        "solref": m.pair_solref[i], "solimp": m.pair_solimp[i], "margin": m.pair_margin[i], "gap": m.pair_gap[i],
    }


def exclude(m, i):
    return [int(m.exclude_signature[i]) >> 16, int(m.exclude_signature[i]) & 0xFFFF]


def numeric(m, i):
    start = m.numeric_adr[i]
    return [name(m, mujoco.mjtObj.mjOBJ_NUMERIC, i), m.numeric_data[start : start + m.numeric_size[i]]]


def dump(m):
    def each(function, count):
        return [function(m, i) for i in range(count)]

    return {
        "name": bytes(m.names).split(b"\0")[0].decode(), "opt": options(m), "nq": m.nq, "nv": m.nv, "nu": m.nu,
        "bodies": each(body, m.nbody), "joints": each(joint, m.njnt), "dofs": each(dof, m.nv),
        "geoms": each(geom, m.ngeom), "sites": each(site, m.nsite), "cameras": each(camera, m.ncam),
        "lights": each(light, m.nlight), "actuators": each(actuator, m.nu), "sensors": each(sensor, m.nsensor),
        "keyframes": each(keyframe, m.nkey), "pairs": each(pair, m.npair), "excludes": each(exclude, m.nexclude),
        "numerics": each(numeric, m.nnumeric), "qpos0": m.qpos0, "qpos_spring": m.qpos_spring,
        "stat": {
            "mean_inertia": m.stat.meaninertia, "mean_mass": m.stat.meanmass, "extent": m.stat.extent,
            "center": m.stat.center,
        },
    }


def compiled(load, source):
    try:
        return dump(load(source))
    except ValueError as error:
        return {"error": str(error)}


def plain(value):
    """NumPy values as JSON."""
    return value.tolist()


def main():
    job = json.load(sys.stdin)
    result = {
        "files": [compiled(mujoco.MjModel.from_xml_path, f) for f in job.get("files", [])],
        "texts": [compiled(mujoco.MjModel.from_xml_string, t) for t in job.get("texts", [])],
    }
    json.dump(result, sys.stdout, default=plain)


if __name__ == "__main__":
    main()
