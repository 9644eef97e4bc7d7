//! A frictional unilateral contact with a rigid moving slider.

use crate::error::Error;

/// A direction whose part independent of the others is smaller than this is refused.
pub(crate) const INDEPENDENCE: f64 = 1e-10;

/// A direction in the space of x.
#[derive(Debug, Clone, PartialEq)]
pub enum Direction {
    /// Along one dof.
    Dof(usize),
    /// Any vector, one entry per dof.
    Vector(Vec<f64>),
}

impl Direction {
    /// (dof, entry) of every entry that is not zero.
    pub(crate) fn nonzero(&self) -> Vec<(usize, f64)> {
        match self {
            Direction::Dof(dof) => vec![(*dof, 1.0)],
            Direction::Vector(entries) => {
                entries.iter().copied().enumerate().filter(|entry| entry.1 != 0.0).collect()
            }
        }
    }
}

/// A contact as a user states it: two directions in the space of x, and its law.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactInput {
    /// t: the slip velocity is `t . x' - slider_speed`.
    pub tangential: Direction,
    /// n: the gap is `n . x + gap`.
    pub normal: Direction,
    /// mu, the coefficient of kinetic friction, -, not negative: |T| = mu N while the contact slides.
    pub friction: f64,
    /// Coefficient up to which a sticking contact holds, -, at least `friction`.
    pub static_friction: f64,
    /// Speed of the slider along t, m/s, of either sign.
    pub slider_speed: f64,
    /// Normal velocity after an impact over that before it, -, in [0, 1].
    pub restitution: f64,
    /// Clearance at x = 0, m; negative where the contact is pressed in at x = 0.
    pub gap: f64,
}

/// A contact in contact coordinates: its slip and gap are coordinates of their own.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// Index of the tangential coordinate.
    pub tangential: usize,
    /// Index of the normal coordinate, which *is* the gap.
    pub normal: usize,
    /// mu, the coefficient of kinetic friction, -: |T| = mu N while the contact slides.
    pub friction: f64,
    /// Coefficient up to which a sticking contact holds, -, at least `friction`.
    pub static_friction: f64,
    /// Speed of the slider along the tangential coordinate, m/s, of either sign.
    pub slider_speed: f64,
    /// Normal velocity after an impact over that before it, -, in [0, 1].
    pub restitution: f64,
    /// Initial clearance, m.
    pub gap: f64,
}

impl ContactInput {
    pub(crate) fn validate(&self, contact: usize, size: usize) -> Result<(), Error> {
        let named = |field: &str| format!("contact {contact}: {field}");
        for (field, direction) in [("tangential", &self.tangential), ("normal", &self.normal)] {
            match direction {
                Direction::Dof(dof) if *dof >= size => {
                    return Err(Error::Shape {
                        argument: named(field),
                        expected: format!("a dof index below {size}"),
                        got: dof.to_string(),
                    });
                }
                Direction::Dof(_) => {}
                Direction::Vector(entries) if entries.len() != size => {
                    return Err(Error::Shape {
                        argument: named(field),
                        expected: format!("shape ({size},)"),
                        got: format!("({},)", entries.len()),
                    });
                }
                Direction::Vector(entries) => check_finite(&named(field), entries)?,
            }
        }
        let checks: [(&str, f64, &'static str, bool); 5] = [
            ("friction", self.friction, ">= 0", self.friction >= 0.0),
            (
                "static_friction",
                self.static_friction,
                ">= friction",
                self.static_friction >= self.friction,
            ),
            ("slider_speed", self.slider_speed, "finite", true),
            ("restitution", self.restitution, "in [0, 1]", (0.0..=1.0).contains(&self.restitution)),
            ("gap", self.gap, "finite", true),
        ];
        for (field, value, requirement, holds) in checks {
            let requirement = if value.is_finite() { requirement } else { "finite" };
            if !value.is_finite() || !holds {
                return Err(Error::Range { argument: named(field), requirement, value });
            }
        }
        self.check_directions(contact)
    }
}

impl ContactInput {
    /// Refuses a zero direction, and a normal that is a multiple of the tangential direction.
    fn check_directions(&self, contact: usize) -> Result<(), Error> {
        let [t, n] = [&self.tangential, &self.normal].map(Direction::nonzero);
        let largest = |entries: &[(usize, f64)]| {
            let largest = entries.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            largest.map(|entry| entry.1)
        };
        let of = |direction| Error::ZeroDirection { contact, direction };
        let t_largest = largest(&t).ok_or_else(|| of("tangential"))?;
        let n_largest = largest(&n).ok_or_else(|| of("normal"))?;
        // Scaled to the same largest entry, multiples of each other differ by rounding or by sign alone.
        let entry = |entries: &[(usize, f64)], dof: usize| {
            entries.binary_search_by_key(&dof, |entry| entry.0).map_or(0.0, |k| entries[k].1)
        };
        let parallel = |sign: f64| {
            t.iter().chain(&n).all(|&(dof, _)| {
                let difference = entry(&t, dof) / t_largest - sign * entry(&n, dof) / n_largest;
                difference.abs() <= INDEPENDENCE
            })
        };
        if parallel(1.0) || parallel(-1.0) {
            return Err(Error::NormalIsTangential { contact });
        }
        Ok(())
    }
}

/// Refuses the first entry that is not finite.
pub(crate) fn check_finite(argument: &str, values: &[f64]) -> Result<(), Error> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(Error::NotFinite {
            argument: argument.to_owned(),
            place: format!("index {index}"),
            value: values[index],
        }),
        None => Ok(()),
    }
}
