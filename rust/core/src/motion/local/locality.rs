//! The data of a scene that a local march needs: the kinds of its coordinates, and norms that hold in every combination.

use crate::contact::functional::Functional;
use crate::error::input::Error;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_law::Directions;
use crate::scene::model::Scene;
use crate::scene::status::Status;

/// Norm of the first-order system times the width of a panel. Row sums overestimate the fastest mode about twofold, and
/// terms up to e^3 cancel.
pub(super) const WIDTH: f64 = 6.0;

/// The kind of a coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Free,
    /// Of a contact.
    Tangential(usize),
    /// Of a contact.
    Normal(usize),
    /// A switched load, held between its steps.
    Held,
}

/// How a coordinate moves in a combination.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Course {
    /// By its own row and, times a factor, that of the normal force that rubs on it.
    Free(Option<(usize, f64)>),
    /// At a given speed.
    Carried(f64),
    /// At zero.
    Closed,
}

/// The scene of a local march.
#[derive(Debug)]
pub(crate) struct Locality {
    pub kinds: Vec<Kind>,
    /// Square root of the mass of each coordinate; 0 of what never moves.
    pub(super) weight: Vec<f64>,
    /// omega of the norm `max(omega |q|, |q'|)` over mass-weighted coordinates.
    pub(super) omega: f64,
    /// Norm of the first-order system in any combination, 1/s.
    pub sigma: f64,
    /// Bounds of `M^-1 K h^2` and `M^-1 C h` in mass-weighted coordinates and any combination, by columns.
    pub(super) springs: SparseMatrix,
    pub(super) dampers: SparseMatrix,
}

impl Locality {
    /// Of a scene with lumped masses in which no direction depends on others.
    pub fn new(scene: &Scene) -> Result<Self, Error> {
        let refused = |reason| Err(Error::NotLocal { reason });
        if !scene.mass.is_diagonal() || scene.contacts_coupled() {
            return refused("mass couples coordinates");
        }
        if !scene.dependents.is_empty() {
            return refused("directions of contacts depend on each other");
        }
        if !scene.massless.is_empty() {
            return refused("contacts act on coordinates without mass");
        }
        if (0..scene.contacts.len()).any(|contact| scene.friction_law(contact).is_some()) {
            return refused("friction depends on slip speed");
        }
        if scene.planes().next().is_some() {
            return refused("friction acts in a plane");
        }
        if scene.has_elements() {
            return refused("springs or dampers are nonlinear");
        }
        let n = scene.size;
        let mut kinds = vec![Kind::Free; n];
        for (contact, law) in scene.contacts.iter().enumerate() {
            kinds[law.tangential] = Kind::Tangential(contact);
            kinds[law.normal] = Kind::Normal(contact);
        }
        for switch in scene.drive.iter().flat_map(|drive| &drive.switches) {
            kinds[switch.coordinate] = Kind::Held;
        }
        let moves = |k: usize| match kinds[k] {
            Kind::Free => true,
            Kind::Held => false,
            Kind::Tangential(contact) => scene.contacts[contact].directions != Directions::Normal,
            Kind::Normal(contact) => scene.contacts[contact].directions != Directions::Tangential,
        };
        let weigh = |k: usize| if moves(k) { scene.mass.get(k, k).sqrt() } else { 0.0 };
        let weight: Vec<f64> = (0..n).map(weigh).collect();
        let [springs, dampers] =
            [&scene.stiffness, &scene.damping].map(|matrix| bounds(scene, &kinds, &weight, matrix));
        let norm = |matrix: &SparseMatrix| {
            let sum = |row| matrix.row(row).map(|entry| entry.1).sum::<f64>();
            (0..n).map(sum).fold(0.0, f64::max)
        };
        let (stiffness, damping) = (norm(&springs), norm(&dampers));
        let omega = if stiffness > 0.0 { stiffness.sqrt() } else { damping.max(1.0) };
        let sigma = omega + damping;
        let width = WIDTH / sigma;
        Ok(Self {
            kinds,
            weight,
            omega,
            sigma,
            springs: springs.scaled(width * width).transposed(),
            dampers: dampers.scaled(width).transposed(),
        })
    }

    /// Width of a panel before what its series leave out may shorten it, s.
    pub fn width(&self) -> f64 {
        WIDTH / self.sigma
    }

    /// What a series of degree D and width h leaves out, relative to its last term.
    pub(super) fn tail(&self, h: f64, coefficients: usize) -> f64 {
        let rho = self.sigma * h / coefficients as f64;
        rho / (1.0 - rho)
    }

    /// Factor from the norm of a state to a bound of a functional of it.
    pub(super) fn functional_norm(&self, functional: &Functional) -> f64 {
        let dual = |terms: &[(usize, f64)]| -> f64 {
            let moving = terms.iter().filter(|term| self.weight[term.0] > 0.0);
            moving.map(|&(k, weight)| weight.abs() / self.weight[k]).sum()
        };
        dual(&functional.position) / self.omega + dual(&functional.velocity)
    }

    /// The contacts in whose rows a velocity of coordinate k acts at once.
    pub fn contacts_felt_at_once(&self, k: usize) -> impl Iterator<Item = usize> + '_ {
        self.dampers.row(k).filter_map(|(row, _)| match self.kinds[row] {
            Kind::Tangential(contact) | Kind::Normal(contact) => Some(contact),
            _ => None,
        })
    }

    /// How a coordinate moves.
    pub(super) fn course(&self, scene: &Scene, statuses: &[Status], k: usize) -> Course {
        match self.kinds[k] {
            Kind::Free => Course::Free(None),
            Kind::Held => Course::Carried(0.0),
            Kind::Normal(contact) if statuses[contact].is_closed() => {
                let at_zero = scene.contacts[contact].gap == 0.0;
                if at_zero { Course::Closed } else { Course::Carried(0.0) }
            }
            Kind::Normal(_) => Course::Free(None),
            Kind::Tangential(contact) => {
                let law = &scene.contacts[contact];
                match statuses[contact] {
                    _ if law.directions == Directions::Normal => Course::Closed,
                    Status::Sticking => Course::Carried(law.slider_speed),
                    Status::Detached => Course::Free(None),
                    sliding => {
                        let factor = -sliding.friction_sign() * law.friction;
                        Course::Free((factor != 0.0).then_some((law.normal, factor)))
                    }
                }
            }
        }
    }
}

/// `|M^-1 matrix|` in mass-weighted coordinates with all friction that any combination brings along.
fn bounds(scene: &Scene, kinds: &[Kind], weight: &[f64], matrix: &SparseMatrix) -> SparseMatrix {
    let mut sums = vec![0.0; scene.size];
    let mut touched: Vec<usize> = Vec::new();
    SparseMatrix::from_rows(scene.size, |row, entries| {
        if weight[row] == 0.0 {
            return;
        }
        let own = std::iter::once((row, 1.0));
        let rubbed = match kinds[row] {
            Kind::Tangential(contact) => {
                let law = &scene.contacts[contact];
                Some((law.normal, law.friction))
            }
            _ => None,
        };
        for (source, factor) in own.chain(rubbed) {
            for (k, value) in matrix.row(source).filter(|entry| weight[entry.0] > 0.0) {
                sums[k] += factor * value.abs() / (weight[row] * weight[k]);
                touched.push(k);
            }
        }
        touched.sort_unstable();
        touched.dedup();
        entries.extend(touched.drain(..).map(|k| (k, std::mem::take(&mut sums[k]))));
    })
}
