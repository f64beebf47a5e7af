"""MuJoCo's compiled models, in the shape of Marathon's `Model` as JSON.

Reads {"files": [path, ...], "texts": [xml, ...]} from stdin and prints {"files": [...], "texts": [...]} with, for
each model, either its fields or {"error": message}.
"""

import json
import sys

import mujoco
import numpy as np

JOINTS = ["Free", "Ball", "Slide", "Hinge"]
SHAPES = ["Plane", "Hfield", "Sphere", "Capsule", "Ellipsoid", "Cylinder", "Box", "Mesh", "Sdf"]
MODES = ["Fixed", "Track", "TrackCom", "TargetBody", "TargetBodyCom"]
INTEGRATORS = {0: "Euler", 1: "Rk4", 2: "Implicit", 3: "ImplicitFast"}
CONES = ["Pyramidal", "Elliptic"]
SOLVERS = ["Pgs", "Cg", "Newton"]
FLAGS = [
    "constraint", "equality", "limit", "contact", "frictionloss", "spring", "damper", "gravity", "clampctrl", "warmstart",
    "actuation", "refsafe", "eulerdamp", "filterparent", "multiccd", "nativeccd", "island", "midphase",
]
SENSORS = {
    "TOUCH": "Touch", "ACCELEROMETER": "Accelerometer", "VELOCIMETER": "Velocimeter", "GYRO": "Gyro",
    "FORCE": "Force", "TORQUE": "Torque", "MAGNETOMETER": "Magnetometer", "RANGEFINDER": "RangeFinder",
    "JOINTPOS": "JointPos", "JOINTVEL": "JointVel", "TENDONPOS": "TendonPos", "TENDONVEL": "TendonVel",
    "ACTUATORPOS": "ActuatorPos", "ACTUATORVEL": "ActuatorVel", "ACTUATORFRC": "ActuatorFrc",
    "JOINTACTFRC": "JointActuatorFrc", "TENDONACTFRC": "TendonActuatorFrc", "BALLQUAT": "BallQuat",
    "BALLANGVEL": "BallAngVel", "JOINTLIMITPOS": "JointLimitPos", "JOINTLIMITVEL": "JointLimitVel",
    "JOINTLIMITFRC": "JointLimitFrc", "TENDONLIMITPOS": "TendonLimitPos", "TENDONLIMITVEL": "TendonLimitVel",
    "TENDONLIMITFRC": "TendonLimitFrc", "FRAMEPOS": "FramePos", "FRAMEQUAT": "FrameQuat",
    "FRAMEXAXIS": "FrameXAxis", "FRAMEYAXIS": "FrameYAxis", "FRAMEZAXIS": "FrameZAxis",
    "FRAMELINVEL": "FrameLinVel", "FRAMEANGVEL": "FrameAngVel", "FRAMELINACC": "FrameLinAcc",
    "FRAMEANGACC": "FrameAngAcc", "SUBTREECOM": "SubtreeCom", "SUBTREELINVEL": "SubtreeLinVel",
    "SUBTREEANGMOM": "SubtreeAngMom", "INSIDESITE": "InsideSite", "GEOMDIST": "Distance", "GEOMNORMAL": "Normal",
    "GEOMFROMTO": "FromTo", "CONTACT": "Contact", "E_POTENTIAL": "PotentialEnergy", "E_KINETIC": "KineticEnergy",
    "CLOCK": "Clock",
}
OBJECTS = {
    "BODY": "Body", "XBODY": "XBody", "GEOM": "Geom", "SITE": "Site", "CAMERA": "Camera", "JOINT": "Joint",
    "TENDON": "Tendon", "ACTUATOR": "Actuator",
}
GRAY = [0.5, 0.5, 0.5, 1.0]


def actuated(m, kind, i):
    """Return the actuators' contribution to a joint or tendon: armature, damping and its two higher coefficients.

    MuJoCo keeps them with the actuators and adds them, times the square of the gear, whenever it uses them.
    """
    transmissions = {
        "joint": [mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT], "tendon": [mujoco.mjtTrn.mjTRN_TENDON],
    }[kind]
    total = np.zeros(4)
    for a in range(m.nactuator):
        if mujoco.mjtTrn(m.actuator_trntype[a]) in transmissions and m.actuator_trnid[a, 0] == i:
            own = [m.actuator_armature[a], m.actuator_damping[a], *m.actuator_dampingpoly[a]]
            total += np.array(own) * m.actuator_gear[m.actuator_outadr[a], 0] ** 2
    return total


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
        "ls_iterations": o.ls_iterations, "tolerance": o.tolerance, "ls_tolerance": o.ls_tolerance,
        "noslip_iterations": o.noslip_iterations, "noslip_tolerance": o.noslip_tolerance,
        "ccd_iterations": o.ccd_iterations, "ccd_tolerance": o.ccd_tolerance,
        "solver": SOLVERS[int(o.solver)], "flags": {f: not disabled[f] for f in FLAGS},
        "density": o.density, "viscosity": o.viscosity, "wind": o.wind, "magnetic": o.magnetic,
        "contact_override": {
            "margin": o.o_margin, "solref": o.o_solref, "solimp": o.o_solimp, "friction": o.o_friction,
        } if o.enableflags & int(mujoco.mjtEnableBit.mjENBL_OVERRIDE) else "none",
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
        "stiffness": m.jnt_stiffness[i], "stiffness_poly": m.jnt_stiffnesspoly[i],
        "actuator_gravcomp": bool(m.jnt_actgravcomp[i]), "solref_limit": m.jnt_solref[i], "solimp_limit": m.jnt_solimp[i],
        "actuator_force_range": m.jnt_actfrcrange[i] if m.jnt_actfrclimited[i] else "none",
        "group": m.jnt_group[i],
    }


def dof(m, i):
    armature, damping, *poly = actuated(m, "joint", m.dof_jntid[i])
    return {
        "body": m.dof_bodyid[i], "joint": m.dof_jntid[i],
        "parent": m.dof_parentid[i] if m.dof_parentid[i] >= 0 else "none", "armature": m.dof_armature[i] + armature,
        "damping": m.dof_damping[i] + damping, "damping_poly": m.dof_dampingpoly[i] + poly, "frictionloss": m.dof_frictionloss[i],
        "geared": m.jnt_actuatorid[m.dof_jntid[i]] != -1,
        "solref_friction": m.dof_solref[i], "solimp_friction": m.dof_solimp[i], "invweight0": m.dof_invweight0[i],
    }


def geom(m, i):
    material = m.geom_matid[i]
    kind = SHAPES[m.geom_type[i]]
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_GEOM, i), "kind": kind, "body": m.geom_bodyid[i],
        "pos": m.geom_pos[i], "quat": m.geom_quat[i], "size": m.geom_size[i],
        "hfield": m.geom_dataid[i] if kind == "Hfield" else "none",
        "contype": int(m.geom_contype[i]) % 2**32, "conaffinity": int(m.geom_conaffinity[i]) % 2**32,
        "condim": m.geom_condim[i], "priority": m.geom_priority[i], "friction": m.geom_friction[i],
        "solmix": m.geom_solmix[i], "solref": m.geom_solref[i], "solimp": m.geom_solimp[i],
        "margin": m.geom_margin[i], "gap": m.geom_gap[i], "rgba": color(m, m.geom_rgba[i], material),
        "material": name(m, mujoco.mjtObj.mjOBJ_MATERIAL, material) if material >= 0 else "none",
        "group": m.geom_group[i], "fluid": fluid(m, i),
    }


def fluid(m, i):
    """Coefficients of the medium's forces on a geom."""
    on, *drag_and_lift = m.geom_fluid[i][:6]
    if not on:
        return "none"
    return {
        "drag": drag_and_lift[:3], "lift": drag_and_lift[3:], "virtual_mass": m.geom_fluid[i][6:9],
        "virtual_inertia": m.geom_fluid[i][9:12],
    }


def site(m, i):
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_SITE, i), "kind": SHAPES[m.site_type[i]], "body": m.site_bodyid[i],
        "pos": m.site_pos[i], "quat": m.site_quat[i], "size": m.site_size[i],
        "rgba": color(m, m.site_rgba[i], m.site_matid[i]), "group": m.site_group[i],
    }


def tracking(mode, target):
    """How a camera or light moves; without a target it stays where it is."""
    return "Fixed" if MODES[mode].startswith("Target") and target < 0 else MODES[mode]


def camera(m, i):
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_CAMERA, i), "body": m.cam_bodyid[i], "pos": m.cam_pos[i],
        "quat": m.cam_quat[i], "mode": tracking(m.cam_mode[i], m.cam_targetbodyid[i]), "fovy": m.cam_fovy[i],
    }


def light(m, i):
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_LIGHT, i), "body": m.light_bodyid[i], "pos": m.light_pos[i],
        "dir": m.light_dir[i], "mode": tracking(m.light_mode[i], m.light_targetbodyid[i]), "diffuse": m.light_diffuse[i],
        "directional": int(m.light_type[i]) == int(mujoco.mjtLightType.mjLIGHT_DIRECTIONAL),
    }


def hfield(m, i):
    start, size = m.hfield_adr[i], m.hfield_nrow[i] * m.hfield_ncol[i]
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_HFIELD, i), "nrow": m.hfield_nrow[i], "ncol": m.hfield_ncol[i],
        "size": m.hfield_size[i], "data": m.hfield_data[start : start + size],
    }


def fixed_part(m, k):
    return [m.wrap_objid[k], m.wrap_prm[k]]


def spatial_part(m, k):
    kind, index = m.wrap_type[k], m.wrap_objid[k]
    if kind == mujoco.mjtWrap.mjWRAP_SITE:
        return {"Site": index}
    if kind == mujoco.mjtWrap.mjWRAP_PULLEY:
        return {"Pulley": {"divisor": m.wrap_prm[k]}}
    side = int(m.wrap_prm[k])
    return {"Geom": {"geom": index, "side": "none" if side < 0 else side}}


def tendon(m, i):
    start, count = m.tendon_adr[i], m.tendon_num[i]
    fixed = m.wrap_type[start] == mujoco.mjtWrap.mjWRAP_JOINT
    part = fixed_part if fixed else spatial_part
    path = [part(m, k) for k in range(start, start + count)]
    armature, damping, *poly = actuated(m, "tendon", i)
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_TENDON, i), "kind": {"Fixed" if fixed else "Spatial": path},
        "limited": bool(m.tendon_limited[i]), "range": m.tendon_range[i], "margin": m.tendon_margin[i],
        "stiffness": m.tendon_stiffness[i], "stiffness_poly": m.tendon_stiffnesspoly[i],
        "spring_length": m.tendon_lengthspring[i], "damping": m.tendon_damping[i] + damping,
        "damping_poly": m.tendon_dampingpoly[i] + poly, "frictionloss": m.tendon_frictionloss[i],
        "armature": m.tendon_armature[i] + armature, "solref_limit": m.tendon_solref_lim[i],
        "solimp_limit": m.tendon_solimp_lim[i], "solref_friction": m.tendon_solref_fri[i],
        "solimp_friction": m.tendon_solimp_fri[i], "group": m.tendon_group[i],
        "actuator_force_range": m.tendon_actfrcrange[i] if m.tendon_actfrclimited[i] else "none",
        "length0": m.tendon_length0[i],
        "invweight0": m.tendon_invweight0[i],
    }


def equality_kind(m, i):
    kind, data = int(m.eq_type[i]), m.eq_data[i]
    ends = [int(m.eq_obj1id[i]), int(m.eq_obj2id[i])]
    optional = "none" if ends[1] < 0 else ends[1]
    if kind == mujoco.mjtEq.mjEQ_JOINT:
        return {"Joint": {"joint1": ends[0], "joint2": optional, "polycoef": data[:5]}}
    if kind == mujoco.mjtEq.mjEQ_TENDON:
        return {"Tendon": {"tendon1": ends[0], "tendon2": optional, "polycoef": data[:5]}}
    weld = kind == mujoco.mjtEq.mjEQ_WELD
    if m.eq_objtype[i] == mujoco.mjtObj.mjOBJ_SITE:
        joined = {
            "bodies": m.site_bodyid[ends], "sites": ends, "anchors": m.site_pos[ends], "quats": m.site_quat[ends],
        }
    else:
        # the first point of a connect belongs to the first body, that of a weld to the second
        points = [data[0:3], data[3:6]]
        joined = {
            "bodies": ends, "sites": "none", "anchors": points[::-1] if weld else points,
            "quats": [data[6:10], np.array([1.0, 0, 0, 0])],
        }
    if weld:
        return {"Weld": {**joined, "torquescale": data[10]}}
    del joined["quats"]
    return {"Connect": joined}


def equality(m, i):
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_EQUALITY, i), "kind": equality_kind(m, i),
        "active": bool(m.eq_active0[i]), "solref": m.eq_solref[i], "solimp": m.eq_solimp[i],
    }


def dynamics(m, i):
    constant = {"time_constant": m.actuator_dynprm[i, 0]}
    return {
        mujoco.mjtDyn.mjDYN_NONE: "None", mujoco.mjtDyn.mjDYN_INTEGRATOR: "Integrator",
        mujoco.mjtDyn.mjDYN_FILTER: {"Filter": constant}, mujoco.mjtDyn.mjDYN_FILTEREXACT: {"FilterExact": constant},
        mujoco.mjtDyn.mjDYN_MUSCLE: {
            "Muscle": dict(zip(("activation", "deactivation", "smoothing"), m.actuator_dynprm[i, :3]))
        },
    }.get(mujoco.mjtDyn(m.actuator_dyntype[i]), "Unsupported")


def muscle(m, i, numbers):
    low, high, force, scale, lmin, lmax, vmax, fpmax, fvmax = numbers[:9]
    out = m.actuator_outadr[i]
    return {
        "length_range": m.actuator_lengthrange[out], "range": [low, high],
        "force": force if force >= 0 else scale / max(1e-15, m.actuator_acc0[out]), "lmin": lmin, "lmax": lmax,
        "vmax": vmax, "fpmax": fpmax, "fvmax": fvmax,
    }


def actuator(m, i):
    affine_gain = m.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_AFFINE
    affine_bias = m.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_AFFINE
    muscle_gain = m.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_MUSCLE
    muscle_bias = m.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_MUSCLE
    gain, bias = m.actuator_gainprm[i, :3], m.actuator_biasprm[i, :3]
    transmission = {
        mujoco.mjtTrn.mjTRN_JOINT: "Joint", mujoco.mjtTrn.mjTRN_JOINTINPARENT: "JointInParent",
        mujoco.mjtTrn.mjTRN_TENDON: "Tendon", mujoco.mjtTrn.mjTRN_SITE: "Site",
        mujoco.mjtTrn.mjTRN_SLIDERCRANK: "SliderCrank", mujoco.mjtTrn.mjTRN_BODY: "Body",
    }.get(mujoco.mjtTrn(m.actuator_trntype[i]), "Unsupported")
    target, other = m.actuator_trnid[i]
    target = {
        "Site": {"site": target, "reference": other if other >= 0 else "none"},
        "SliderCrank": {"crank": target, "slider": other, "rod": m.actuator_cranklength[m.actuator_outadr[i]]},
    }.get(transmission, target)
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_ACTUATOR, i), "transmission": {transmission: target},
        "gear": m.actuator_gear[i], "ctrl_limited": bool(m.actuator_ctrllimited[i]),
        "ctrl_range": m.actuator_ctrlrange[i], "force_limited": bool(m.actuator_forcelimited[i]),
        "force_range": m.actuator_forcerange[i],
        "gain": gain if affine_gain else [0 if muscle_gain else gain[0], 0, 0], "bias": bias if affine_bias else [0, 0, 0],
        "gain_muscle": muscle(m, i, m.actuator_gainprm[i]) if muscle_gain else "none",
        "bias_muscle": muscle(m, i, m.actuator_biasprm[i]) if muscle_bias else "none",
        "dynamics": dynamics(m, i), "act": m.actuator_actadr[i] if m.actuator_actadr[i] >= 0 else "none",
        "act_limited": bool(m.actuator_actlimited[i]), "act_range": m.actuator_actrange[i],
        "act_early": bool(m.actuator_actearly[i]),
    }


def sensor_object(kind, i):
    kind = mujoco.mjtObj(kind).name.removeprefix("mjOBJ_")
    return {OBJECTS[kind]: i} if i >= 0 else "None"


def sensor(m, i):
    kind = mujoco.mjtSensor(m.sensor_type[i]).name.removeprefix("mjSENS_")
    ends = [(m.sensor_objtype[i], m.sensor_objid[i]), (m.sensor_reftype[i], m.sensor_refid[i])]
    supported = kind in SENSORS
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_SENSOR, i), "kind": SENSORS[kind] if supported else "Unsupported",
        "object": sensor_object(*ends[0]) if supported else "None",
        "reference": sensor_object(*ends[1]) if supported else "None",
        "intprm": m.sensor_intprm[i, :3] if supported else [0, 0, 0],
        "adr": m.sensor_adr[i], "dim": m.sensor_dim[i], "cutoff": m.sensor_cutoff[i],
    }


def keyframe(m, i):
    return {
        "name": name(m, mujoco.mjtObj.mjOBJ_KEY, i), "time": m.key_time[i], "qpos": m.key_qpos[i],
        "qvel": m.key_qvel[i], "ctrl": m.key_ctrl[i], "act": m.key_act[i],
        "mpos": m.key_mpos[i].reshape(-1, 3), "mquat": m.key_mquat[i].reshape(-1, 4),
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
        "na": m.na, "hfields": each(hfield, m.nhfield), "tendons": each(tendon, m.ntendon),
        "equalities": each(equality, m.neq),
        "bodies": each(body, m.nbody), "joints": each(joint, m.njnt), "dofs": each(dof, m.nv),
        "geoms": each(geom, m.ngeom), "sites": each(site, m.nsite), "cameras": each(camera, m.ncam),
        "lights": each(light, m.nlight), "actuators": each(actuator, m.nactuator), "sensors": each(sensor, m.nsensor),
        "keyframes": each(keyframe, m.nkey), "pairs": each(pair, m.npair), "excludes": each(exclude, m.nexclude),
        "numerics": each(numeric, m.nnumeric), "qpos0": m.qpos0, "qpos_spring": m.qpos_spring,
        "stat": {
            "mean_inertia": m.stat.meaninertia, "mean_mass": m.stat.meanmass,
            "extent": m.stat.extent, "center": m.stat.center,
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
