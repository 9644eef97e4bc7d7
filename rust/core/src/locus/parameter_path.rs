//! A reduced problem along one parameter p: `P(lambda, p) = lambda^2 M(p) + lambda C(p) + K(p)`.
//!
//! Entries are piecewise Chebyshev series in p. Friction enters linearly (design of the left basis), so a path over
//! friction is one piece of degree one and exact; any other parameter of a model is interpolated to rounding by
//! whoever samples the model. A series can be evaluated at complex p and differentiated, as sensitivities and exceptional
//! points require.

use nalgebra::DMatrix;

use crate::error::input::Error;
use crate::linalg::sparse::SparseMatrix;
use crate::locus::series::{ChebyshevSeries, Number, StaticSeries};
use crate::modes::quadratic_pencil::{Pencil, PencilDamping};
use crate::scene::contact_law::Contact;
use crate::scene::model::Scene;
use crate::scene::reduction::bases::Reduction;
use crate::scene::reduction::reduced_system::Reduced;
use crate::scene::statics::margins::Statics;
use crate::scene::status::Combination;

/// Damping along a path.
#[derive(Debug, Clone)]
pub enum PathDamping {
    /// `C = alpha M + beta K`; series of one entry.
    Proportional {
        /// alpha, 1/s, as a 1 by 1 series.
        alpha: ChebyshevSeries,
        /// beta, s, as a 1 by 1 series.
        beta: ChebyshevSeries,
    },
    /// Any damping matrix, N s/m, m by m.
    General(ChebyshevSeries),
}

/// The problem on `lower <= p <= upper`, in `t = (p - centre) / half_width`.
#[derive(Debug, Clone)]
pub struct Piece {
    /// Lower end of the piece, in the unit of the parameter.
    pub lower: f64,
    /// Upper end of the piece, in the unit of the parameter.
    pub upper: f64,
    /// Parameter at t = 0.
    pub centre: f64,
    /// Change of the parameter from t = 0 to t = 1.
    pub half_width: f64,
    /// m by m, row-major.
    pub mass: ChebyshevSeries,
    /// Reduced stiffness, N/m, m by m; not symmetric with friction.
    pub stiffness: ChebyshevSeries,
    /// Reduced damping, N s/m.
    pub damping: PathDamping,
    /// The series on which the sliding equilibrium depends.
    pub statics: StaticSeries,
}

/// One status combination along one parameter.
#[derive(Debug, Clone)]
pub struct Path {
    /// Status of every contact all along the path.
    pub combination: Combination,
    /// m, the number of coordinates left free.
    pub size: usize,
    pieces: Vec<Piece>,
}

/// M, C, K and their derivatives to p at one real or complex p.
#[derive(Debug, Clone)]
pub(crate) struct Expansion<T> {
    pub matrices: [DMatrix<T>; 3],
    pub slopes: [DMatrix<T>; 3],
}

impl Path {
    /// From `pieces`, ascending and adjacent, at least one.
    pub fn new(combination: Combination, size: usize, pieces: Vec<Piece>) -> Result<Self, Error> {
        let contacts = combination.statuses().len();
        let adjacent = pieces.windows(2).all(|pair| pair[0].upper == pair[1].lower);
        let complete = |series: &ChebyshevSeries, shape: (usize, usize)| {
            !series.0.is_empty() && series.0.iter().all(|coefficient| coefficient.shape() == shape)
        };
        let consistent = pieces.iter().all(|piece| {
            piece.half_width > 0.0
                && complete(&piece.mass, (size, size))
                && complete(&piece.stiffness, (size, size))
                && match &piece.damping {
                    PathDamping::Proportional { alpha, beta } => {
                        complete(alpha, (1, 1)) && complete(beta, (1, 1))
                    }
                    PathDamping::General(series) => complete(series, (size, size)),
                }
                && complete(&piece.statics.load, (size, 1))
                && complete(&piece.statics.rows, (contacts, size))
                && complete(&piece.statics.offsets, (contacts, 1))
                && complete(&piece.statics.speeds, (contacts, 1))
        });
        if pieces.is_empty() || !adjacent || !consistent {
            return Err(Error::Shape {
                argument: "pieces".into(),
                expected: format!("adjacent intervals with series of ({size}, {size}) matrices"),
                got: format!("{} pieces", pieces.len()),
            });
        }
        Ok(Self { combination, size, pieces })
    }

    /// (M, C, K, M', C', K') at a real p.
    pub fn matrices(&self, p: f64) -> [DMatrix<f64>; 6] {
        let Expansion { matrices: [m, c, k], slopes: [dm, dc, dk] } = self.expansion(p);
        [m, c, k, dm, dc, dk]
    }

    /// The contact law of a scene: the friction of `contacts` from `lower` to `upper`, one value for all of them, or
    /// what else differs between the scenes at both ends and does not enter the matrices (slider speeds, clearances).
    pub fn contact_law(
        [scene, other]: [&Scene; 2],
        combination: &Combination,
        contacts: &[usize],
        lower: f64,
        upper: f64,
    ) -> Result<Self, Error> {
        if scene.has_massless() {
            // Friction does not enter linearly where it moves what has no mass.
            return Err(Error::Shape {
                argument: "scene".into(),
                expected: "mass on every dof and no compliant contact".into(),
                got: "dofs without mass".into(),
            });
        }
        let reduced = Reduced::new(scene, combination)?;
        let m = reduced.size();
        let scene = reduced.scene(scene);
        let moved = |contact: usize| contacts.contains(&contact);
        let fixed = Reduction::with_friction(scene, combination, |contact, law| {
            if moved(contact) { 0.0 } else { law.friction }
        });
        let unit = |contact: usize, _: &Contact| f64::from(u8::from(moved(contact)));
        let unit = Reduction::with_friction(scene, combination, unit);
        let series = |matrix: &SparseMatrix| {
            ChebyshevSeries::linear(fixed.matrix(matrix), unit.merged_matrix(matrix))
        };
        let load = || {
            let mut slope = vec![0.0; m];
            unit.add_merged(&scene.force, &mut slope);
            let column = |values| DMatrix::from_vec(m, 1, values);
            ChebyshevSeries::linear(column(fixed.force(&scene.force)), column(slope))
        };
        let ends = [
            Statics::new(scene, &reduced),
            Statics::new(other, &Reduced::new(other, combination)?),
        ];
        let load = (!contacts.is_empty()).then(load);
        let piece = Piece {
            lower,
            upper,
            statics: StaticSeries::linear(ends, [lower, upper], load),
            centre: 0.0,
            half_width: 1.0,
            mass: series(&scene.mass),
            stiffness: series(&scene.stiffness),
            damping: match scene.proportional {
                Some((alpha, beta)) => PathDamping::Proportional {
                    alpha: ChebyshevSeries::scalar(alpha),
                    beta: ChebyshevSeries::scalar(beta),
                },
                None => PathDamping::General(series(&scene.damping)),
            },
        };
        Ok(Self { combination: combination.clone(), size: m, pieces: vec![piece] })
    }

    /// Smallest and largest parameter of the path; NaN where it has no piece.
    pub fn range(&self) -> (f64, f64) {
        match (self.pieces.first(), self.pieces.last()) {
            (Some(first), Some(last)) => (first.lower, last.upper),
            _ => (f64::NAN, f64::NAN),
        }
    }

    /// The piece that is all of the path, where its mass does not change.
    pub(crate) fn piece_of_constant_mass(&self) -> Option<&Piece> {
        match self.pieces.as_slice() {
            [piece] if piece.mass.is_constant() => Some(piece),
            _ => None,
        }
    }

    /// The piece at p, and its t there.
    pub(crate) fn place(&self, p: f64) -> (&Piece, f64) {
        let piece = self.piece(p);
        (piece, (p - piece.centre) / piece.half_width)
    }

    fn piece(&self, p: f64) -> &Piece {
        let index = self.pieces.partition_point(|piece| piece.upper < p);
        &self.pieces[index.min(self.pieces.len() - 1)]
    }

    /// The problem at a real p.
    pub(crate) fn pencil(&self, p: f64) -> Pencil {
        let (piece, t) = self.place(p);
        Pencil {
            combination: self.combination.clone(),
            size: self.size,
            mass: piece.mass.rows(t),
            stiffness: piece.stiffness.rows(t),
            damping: match &piece.damping {
                PathDamping::Proportional { alpha, beta } => {
                    PencilDamping::Proportional { alpha: alpha.value(t), beta: beta.value(t) }
                }
                PathDamping::General(series) => PencilDamping::General(series.rows(t)),
            },
        }
    }

    /// The problem and its derivative at p.
    pub(crate) fn expansion<T: Number>(&self, p: T) -> Expansion<T> {
        let piece = self.piece(p.real());
        let t = (p - T::from_real(piece.centre)).unscale(piece.half_width);
        let scaled = |series: &ChebyshevSeries| {
            let (value, slope) = series.expanded(t);
            (value, slope.unscale(piece.half_width))
        };
        let (mass, mass_slope) = scaled(&piece.mass);
        let (stiffness, stiffness_slope) = scaled(&piece.stiffness);
        let (damping, damping_slope) = match &piece.damping {
            PathDamping::General(series) => scaled(series),
            PathDamping::Proportional { alpha, beta } => {
                let ((alpha, alpha_slope), (beta, beta_slope)) = (scaled(alpha), scaled(beta));
                let (alpha, beta) = (alpha[0], beta[0]);
                let moved = &mass * alpha_slope[0] + &stiffness * beta_slope[0];
                let slope = &mass_slope * alpha + &stiffness_slope * beta + moved;
                (&mass * alpha + &stiffness * beta, slope)
            }
        };
        Expansion {
            matrices: [mass, damping, stiffness],
            slopes: [mass_slope, damping_slope, stiffness_slope],
        }
    }
}
