//! Analytic Jacobians: each column is the twist of one elementary transform, so a pose costs O(joints).

use nalgebra::{Matrix6xX, Point3, Vector3};

use super::forward::LinkAxes;
use super::joint_error::harmonics;
use super::{ForwardKinematics, JointTerm, JointType, LinkParameter, ParameterId, Place, PreparedArm};

/// Evaluates `B = ∂p/∂(parameters)`, equations (17)–(20) of the method paper, for a fixed list of parameters.
///
/// Derivative of the point `p = A_1 … A_N · target` by an angle about the axis `u` through `o` is `u × (p − o)`, by a
/// length along `u` it is `u`, and by a target coordinate it is that axis of the flange.
#[derive(Clone, Debug)]
pub struct IdentificationJacobian {
    parameters: Vec<ParameterId>,
    links: Vec<LinkAxes>,
    /// Highest order of a harmonic of each joint.
    orders: Vec<usize>,
    /// `sin(h q)` and `cos(h q)` of each joint at the configuration, h from 1.
    harmonics: Vec<Vec<(f64, f64)>>,
    needs_loads: bool,
}

impl IdentificationJacobian {
    /// Prepares the derivatives by these parameters, in this order.
    pub fn new(parameters: &[ParameterId]) -> Self {
        let mut orders = Vec::new();
        let mut needs_loads = false;
        for id in parameters {
            if let ParameterId::Joint { joint, term } = *id {
                let order = match term {
                    JointTerm::Sine(order) | JointTerm::Cosine(order) => usize::from(order),
                    JointTerm::Compliance | JointTerm::Tilt(_) => {
                        needs_loads = true;
                        0
                    }
                };
                if orders.len() <= joint {
                    orders.resize(joint + 1, 0);
                }
                orders[joint] = orders[joint].max(order);
            }
        }
        let harmonics = vec![Vec::new(); orders.len()];
        Self { parameters: parameters.to_vec(), links: Vec::new(), orders, harmonics, needs_loads }
    }

    /// Number of parameters `n`.
    pub fn len(&self) -> usize {
        self.parameters.len()
    }

    /// Whether there is no parameter at all.
    pub fn is_empty(&self) -> bool {
        self.parameters.is_empty()
    }

    /// Position in the base of the target at a place (m), and its derivatives: see [`Self::evaluate`].
    #[inline]
    pub fn at(&mut self, arm: &PreparedArm<'_>, place: &Place, rows: &mut [f64]) -> Point3<f64> {
        self.evaluate(&arm.forward, &place.configuration, place.target, &arm.targets[place.target], rows)
    }

    /// Position of the target in the base (m) at configuration `q`, and its derivatives.
    ///
    /// `rows` receives the 3 × n Jacobian row by row: `n` entries for x, then y, then z ((m) per (m) or (rad)); it must hold
    /// `3 n` numbers. `target` is the index of the observed target: the coordinates of other targets have no effect.
    #[inline]
    pub fn evaluate(
        &mut self,
        arm: &ForwardKinematics<'_>,
        q: &[f64],
        target: usize,
        target_in_flange: &Point3<f64>,
        rows: &mut [f64],
    ) -> Point3<f64> {
        let n = self.parameters.len();
        let links = &mut self.links;
        links.resize(arm.chain().dof(), LinkAxes::default());
        let flange = arm.flange_frame(q, |index, axes| links[index] = *axes);
        for (joint, (orders, values)) in self.orders.iter().zip(&mut self.harmonics).enumerate() {
            values.clear();
            values.extend(harmonics(q.get(joint).copied().unwrap_or(0.0), *orders));
        }
        let loads = if self.needs_loads { arm.relative_loads(q) } else { Vec::new() };
        let axes = flange.axes();
        let point = flange.origin + axes * target_in_flange.coords;
        let (x_row, rest) = rows.split_at_mut(n);
        let (y_row, z_row) = rest.split_at_mut(n);
        for (column, id) in self.parameters.iter().enumerate() {
            let derivative = match *id {
                ParameterId::Link { joint, parameter } => {
                    let link = &links[joint];
                    match parameter {
                        LinkParameter::Alpha => link.x.cross(&(point - link.x_origin)),
                        LinkParameter::A => link.x,
                        LinkParameter::D => link.z,
                        LinkParameter::Theta => link.z.cross(&(point - link.z_origin)),
                        LinkParameter::Beta => link.y.cross(&(point - link.y_origin)),
                    }
                }
                ParameterId::Joint { joint, term } => {
                    let link = &links[joint];
                    let harmonic = |order: u8| self.harmonics[joint].get(usize::from(order).wrapping_sub(1));
                    let load = loads.get(joint);
                    let (axis, part) = match term {
                        JointTerm::Compliance => (&link.z, load.map_or(0.0, |load| load.torque)),
                        JointTerm::Tilt(axis) => {
                            (&link.tilt[axis.index()], load.map_or(0.0, |load| load.moment[axis.index()]))
                        }
                        JointTerm::Sine(order) => (&link.z, harmonic(order).map_or(0.0, |(sine, _)| *sine)),
                        JointTerm::Cosine(order) => (&link.z, harmonic(order).map_or(0.0, |(_, cosine)| *cosine)),
                    };
                    axis.cross(&(point - link.z_origin)) * part
                }
                ParameterId::Target { target: of, axis } if of == target => axes.column(axis.index()).into(),
                ParameterId::Target { .. } => Vector3::zeros(),
            };
            x_row[column] = derivative.x;
            y_row[column] = derivative.y;
            z_row[column] = derivative.z;
        }
        Point3::from(point)
    }
}

/// Geometric Jacobian by the pendant joints: velocity of a point and angular velocity, in the base.
#[derive(Clone, Debug, PartialEq)]
pub struct ConfigurationJacobian {
    /// 6 × dof: rows 0–2 linear (m per rad or m), rows 3–5 angular (rad per rad or m).
    pub matrix: Matrix6xX<f64>,
    /// Position of the target in the base (m).
    pub point_in_base: Point3<f64>,
}

impl ForwardKinematics<'_> {
    /// The configuration Jacobian of a point fixed to the flange, by the pendant values (directions and couplings included).
    pub fn configuration_jacobian(&self, q: &[f64], target_in_flange: &Point3<f64>) -> ConfigurationJacobian {
        let chain = self.chain();
        let mut links = vec![LinkAxes::default(); chain.dof()];
        let flange = self.flange_frame(q, |index, axes| links[index] = *axes);
        let point = flange.origin + flange.axes() * target_in_flange.coords;
        let mut matrix = Matrix6xX::zeros(chain.dof());
        for (index, (joint, link)) in chain.joints().iter().zip(&links).enumerate() {
            let (linear, angular) = match joint.joint_type {
                JointType::Revolute => (link.z.cross(&(point - link.z_origin)), link.z),
                JointType::Prismatic => (link.z, Vector3::zeros()),
            };
            for pendant in 0..chain.dof() {
                let gain = joint.variable_by_pendant(index, pendant);
                if gain != 0.0 {
                    let mut column = matrix.column_mut(pendant);
                    column.fixed_rows_mut::<3>(0).axpy(gain, &linear, 1.0);
                    column.fixed_rows_mut::<3>(3).axpy(gain, &angular, 1.0);
                }
            }
        }
        ConfigurationJacobian { matrix, point_in_base: Point3::from(point) }
    }
}
