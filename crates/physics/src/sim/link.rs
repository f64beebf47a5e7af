//! Moving bodies ("links"), their joints, and the frames that they carry.

use super::weld::{BodyMount, lump};
use crate::algebra::rigid;
use crate::lanes::Real;
use crate::model::{JointType, Model};

/// A moving body.
#[derive(Clone, Debug)]
pub(crate) struct Link<C> {
    /// Index of the parent link; `None` for the root of a tree.
    pub parent: Option<usize>,
    /// Tree that it belongs to.
    pub tree: usize,
    /// Number of the mocap body that carries the root of a tree.
    pub mocap: Option<usize>,
    pub pos: [C; 3],
    pub rot: [[C; 3]; 3],
    pub rot_is_identity: bool,
    pub mass: C,
    pub com: [C; 3],
    /// Inertia about the center of mass in the link's frame: xx yy zz xy xz yz.
    pub inertia: [C; 6],
    pub inertia_is_diagonal: bool,
    pub joints: std::ops::Range<usize>,
    pub dofs: std::ops::Range<usize>,
    /// Last child, and the child of the same parent before this one.
    pub last_child: Option<usize>,
    pub sibling: Option<usize>,
    /// Whether it is a free joint whose six diagonal entries are equal in groups: solved as one 6x6 block.
    pub free_block: bool,
    /// Whether it is a free body without moving children.
    pub alone: bool,
}

/// A joint.
#[derive(Clone, Debug)]
pub(crate) struct LinkJoint<C> {
    pub kind: JointType,
    pub qpos: usize,
    pub dof: usize,
    pub pos: [C; 3],
    pub centered: bool,
    pub axis: [C; 3],
    /// Set if the axis is +-x, +-y or +-z of the link: rotation then changes only two columns.
    pub aligned: Option<(usize, bool)>,
    pub q0: C,
    pub stiffness: C,
    pub spring: [C; 4],
    pub has_spring: bool,
}

/// Pose of a body on its link, for reading poses of welded bodies.
#[derive(Clone, Debug)]
pub(crate) struct Mount<C> {
    /// Link, or `None` for static bodies.
    pub link: Option<usize>,
    /// Number of the mocap body that carries it.
    pub mocap: Option<usize>,
    pub pos: [C; 3],
    pub rot: [[C; 3]; 3],
}

/// Link numbers of the moving bodies.
pub(super) fn number_links(model: &Model) -> Vec<Option<usize>> {
    let mut count = 0;
    let moves = |(i, body): (usize, &crate::model::Body)| {
        let link = (i > 0 && body.dof_count > 0).then_some(count);
        count += usize::from(link.is_some());
        link
    };
    model.bodies.iter().enumerate().map(moves).collect()
}

/// The links, and the number of their trees.
pub(super) fn links<T: Real>(
    model: &Model,
    mounts: &[BodyMount],
    link_of: &[Option<usize>],
) -> (Vec<Link<T::Scalar>>, usize) {
    let c = T::scalar;
    let mut trees = 0;
    let mut links: Vec<Link<T::Scalar>> = Vec::new();
    for (b, body) in model.bodies.iter().enumerate().filter(|(b, _)| link_of[*b].is_some()) {
        let parent = link_of[model.bodies[body.parent].weld_id];
        let carrier = &mounts[body.parent];
        let (pos, rot) = rigid::compose(&(carrier.pos, carrier.rot), &(body.pos, rigid::quat_to_rot(&body.quat)));
        let lump = lump(model, mounts, b);
        let tree = match parent {
            Some(p) => links[p].tree,
            None => {
                trees += 1;
                trees - 1
            }
        };
        let joints = body.joint_start..body.joint_start + body.joint_count;
        let dofs = body.dof_start..body.dof_start + body.dof_count;
        let free = model.joints[joints.start].kind == JointType::Free;
        let lossless = model.dofs[dofs.clone()].iter().all(|d| d.frictionloss == 0.0);
        links.push(Link {
            parent,
            tree,
            mocap: carrier.mocap,
            pos: pos.map(c),
            rot: rot.map(|r| r.map(c)),
            rot_is_identity: rigid::is_identity(&rot),
            mass: c(lump.mass),
            com: lump.com.map(c),
            inertia: lump.inertia.map(c),
            inertia_is_diagonal: lump.inertia[3..].iter().all(|x| x.abs() < 1e-12 * lump.inertia[0].abs()),
            joints,
            dofs,
            last_child: None,
            sibling: None,
            free_block: free && lossless,
            alone: free,
        });
        if let Some(p) = parent {
            let me = links.len() - 1;
            links[me].sibling = links[p].last_child.replace(me);
            links[p].alone = false;
        }
    }
    (links, trees)
}

/// The joints, in the model's order.
pub(super) fn joints<T: Real>(model: &Model) -> Vec<LinkJoint<T::Scalar>> {
    let c = T::scalar;
    let joint = |j: &crate::model::Joint| {
        let aligned = (0..3).find(|&a| j.axis[a].abs() > 1.0 - 1e-12).map(|a| (a, j.axis[a] < 0.0));
        let width = if matches!(j.kind, JointType::Ball | JointType::Free) { 4 } else { 1 };
        let mut spring = [c(0.0); 4];
        let offset = if j.kind == JointType::Free { 3 } else { 0 };
        for (s, q) in spring.iter_mut().zip(&model.qpos_spring[j.qpos_adr + offset..]).take(width) {
            *s = c(*q);
        }
        LinkJoint {
            kind: j.kind,
            qpos: j.qpos_adr,
            dof: j.dof_adr,
            pos: j.pos.map(c),
            centered: j.pos == [0.0; 3],
            axis: j.axis.map(c),
            aligned,
            q0: c(model.qpos0[j.qpos_adr]),
            stiffness: c(j.stiffness),
            spring,
            has_spring: j.stiffness != 0.0 && model.opt.flags.spring,
        }
    };
    model.joints.iter().map(joint).collect()
}

impl<C: Copy> Mount<C> {
    /// A frame fixed to a body, relative to the link that the body moves with.
    pub(super) fn new<T: Real<Scalar = C>>(
        mounts: &[BodyMount],
        link_of: &[Option<usize>],
        body: usize,
        pos: &[f64; 3],
        quat: &[f64; 4],
    ) -> Self {
        let m = &mounts[body];
        let (pos, rot) = rigid::compose(&(m.pos, m.rot), &(*pos, rigid::quat_to_rot(quat)));
        Mount { link: link_of[m.body], mocap: m.mocap, pos: pos.map(T::scalar), rot: rot.map(|r| r.map(T::scalar)) }
    }
}

/// Whether every joint slides in the x-z plane or turns about y, and no link is rotated out of that plane: exactly, in
/// the lanes' precision.
pub(super) fn is_planar<C: Copy + PartialEq + Default>(model: &Model, links: &[Link<C>]) -> bool {
    let zero = C::default();
    let in_plane = |c: &[C; 3]| c[1] == zero;
    let upright =
        |l: &Link<C>| in_plane(&l.rot[0]) && in_plane(&l.rot[2]) && l.rot[1][0] == zero && l.rot[1][2] == zero;
    links.iter().all(|l| l.mocap.is_none() && upright(l))
        && model.joints.iter().all(|j| match j.kind {
            JointType::Hinge => j.axis[0] == 0.0 && j.axis[2] == 0.0,
            JointType::Slide => j.axis[1] == 0.0,
            JointType::Ball | JointType::Free => false,
        })
}
