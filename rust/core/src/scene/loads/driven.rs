//! A scene with the coordinates that carry its loads.

use std::sync::Arc;

use crate::linalg::sparse::SparseMatrix;
use crate::scene::loads::input::Loads;
use crate::scene::loads::oscillators::{Carried, Drive, Force, Oscillator, Switch};
use crate::scene::massless::coordinates::Massless;
use crate::scene::model::{Scene, coupled_mass};

/// What loads add to the equation of a row: to K and to C, at a coordinate that carries them.
struct Coupling {
    row: usize,
    coordinate: usize,
    stiffness: f64,
    damping: f64,
}

impl Scene {
    /// The scene in which the loads of this one move as coordinates of their own; itself without loads.
    pub(crate) fn driven(scene: Arc<Self>) -> Arc<Self> {
        if scene.loads.is_empty() || scene.drive.is_some() {
            return scene;
        }
        let mut drive = scene.drive_of(&scene.loads);
        let mut couplings = scene.couplings(&drive);
        let mass = (0..scene.size).map(|k| scene.mass.get(k, k)).fold(0.0, f64::max);
        for Oscillator { coordinate, rate, .. } in drive.oscillators.clone() {
            let scale = scene.scale(&couplings, coordinate, rate) / mass.sqrt();
            drive.rescale(coordinate, scale);
            let own = couplings.iter_mut().filter(|coupling| coupling.coordinate == coordinate);
            own.for_each(|coupling| {
                coupling.stiffness /= scale;
                coupling.damping /= scale;
            });
        }
        let n = scene.size;
        let carriers = drive.oscillators.len() + drive.switches.len();
        let size = n + carriers;
        let extended = |matrix: &SparseMatrix,
                        entry: fn(&Coupling) -> f64,
                        own: &dyn Fn(usize) -> f64| {
            SparseMatrix::from_rows(size, |row, entries| {
                if row >= n {
                    entries.push((row, own(row - n)));
                    return;
                }
                entries.extend(matrix.row(row));
                let first = couplings.partition_point(|coupling| coupling.row < row);
                let of_row = couplings[first..].iter().take_while(|coupling| coupling.row == row);
                entries.extend(of_row.map(|coupling| (coupling.coordinate, entry(coupling))));
            })
        };
        let spring =
            |k: usize| drive.oscillators.get(k).map_or(0.0, |one| mass * one.rate * one.rate);
        let mass_matrix = extended(&scene.mass, |_| 0.0, &|_| mass);
        let damping = extended(&scene.damping, |coupling| coupling.damping, &|_| 0.0);
        let stiffness = extended(&scene.stiffness, |coupling| coupling.stiffness, &spring);
        let coupled_mass =
            coupled_mass(&mass_matrix, &damping, &stiffness, &scene.coordinates.slots)
                .expect("a positive definite mass with more of its diagonal");
        Arc::new(Self {
            size,
            dofs: scene.dofs,
            // Beside loads in time, every dof has mass.
            nodes: None,
            massless: Massless::default(),
            condensed: false,
            contacts: scene.contacts.clone(),
            laws: scene.laws.clone(),
            impact_friction: scene.impact_friction,
            dependents: scene.dependents.clone(),
            coordinates: scene.coordinates.clone(),
            mass: mass_matrix,
            coupled_mass,
            damping,
            // Held coordinates have no velocity; oscillators are not damped.
            proportional: scene.proportional.filter(|_| drive.oscillators.is_empty()),
            stiffness,
            energy_parts: None,
            force: [&scene.force[..], &vec![0.0; carriers]].concat(),
            loads: Loads::default(),
            drive: Some(drive),
            bare: Some(scene),
        })
    }

    /// The coordinates that carry loads, one for each frequency and each switched load.
    fn drive_of(&self, loads: &Loads) -> Drive {
        let n = self.size;
        let mut drive = Drive { structure: n, ..Drive::default() };
        let oscillator = |drive: &mut Drive, frequency: f64| {
            let rate = std::f64::consts::TAU * frequency;
            let known = drive.oscillators.iter().find(|one| one.rate == rate).cloned();
            known.unwrap_or_else(|| {
                let coordinate = n + drive.oscillators.len();
                let added = Oscillator { coordinate, rate, scale: 1.0 };
                drive.oscillators.push(added.clone());
                added
            })
        };
        let rows = |direction: &[(usize, f64)]| {
            let mut force = vec![0.0; self.dofs];
            direction.iter().for_each(|&(dof, entry)| force[dof] += entry);
            let force = self.coordinates.forces_of_dofs(&force);
            force.into_iter().enumerate().filter(|entry| entry.1 != 0.0).collect::<Vec<_>>()
        };
        for load in &loads.harmonics {
            let rows = rows(&load.direction);
            if rows.is_empty() {
                continue;
            }
            let Oscillator { coordinate, rate, .. } = oscillator(&mut drive, load.frequency);
            let (sine, cosine) = load.phase.sin_cos();
            drive.forces.extend(rows.into_iter().map(|(row, amplitude)| Force {
                row,
                coordinate,
                of_position: amplitude * cosine,
                of_velocity: amplitude * sine / rate,
            }));
        }
        for load in loads.vibrations.iter().filter(|load| load.amplitude != 0.0) {
            let oscillator = oscillator(&mut drive, load.frequency);
            let (sine, cosine) = load.phase.sin_cos();
            drive.carried.push(Carried {
                tangential: self.contacts[load.contact].tangential,
                of_position: load.amplitude * sine / oscillator.rate,
                of_velocity: -load.amplitude * cosine / (oscillator.rate * oscillator.rate),
                oscillator,
            });
        }
        for load in &loads.steps {
            let coordinate = n + drive.oscillators.len() + drive.switches.len();
            drive.forces.extend(rows(&load.direction).into_iter().map(|(row, force)| Force {
                row,
                coordinate,
                of_position: force,
                of_velocity: 0.0,
            }));
            drive.switches.push(Switch {
                coordinate,
                times: load.times.clone(),
                values: load.values.iter().map(|value| value - load.values[0]).collect(),
            });
        }
        drive
    }

    /// Ascending by row and coordinate, one entry for each pair.
    fn couplings(&self, drive: &Drive) -> Vec<Coupling> {
        let mut couplings: Vec<Coupling> = drive
            .forces
            .iter()
            .map(|force| Coupling {
                row: force.row,
                coordinate: force.coordinate,
                stiffness: -force.of_position,
                damping: -force.of_velocity,
            })
            .collect();
        for carried in &drive.carried {
            let (a, b) = (carried.of_position, carried.of_velocity);
            let Oscillator { coordinate, rate, .. } = carried.oscillator;
            let square = rate * rate;
            let at = |matrix: &SparseMatrix, row| matrix.get(row, carried.tangential);
            couplings.extend((0..self.size).map(|row| {
                let (m, c, k) =
                    (at(&self.mass, row), at(&self.damping, row), at(&self.stiffness, row));
                // M y'' + C y' + K y with y = a h + b h' and h'' = -rate^2 h.
                Coupling {
                    row,
                    coordinate,
                    stiffness: a * (k - square * m) - b * square * c,
                    damping: b * (k - square * m) + a * c,
                }
            }));
        }
        couplings.retain(|coupling| (coupling.stiffness, coupling.damping) != (0.0, 0.0));
        couplings.sort_by_key(|coupling| (coupling.row, coupling.coordinate));
        couplings.dedup_by(|next, kept| {
            let same = (next.row, next.coordinate) == (kept.row, kept.coordinate);
            if same {
                kept.stiffness += next.stiffness;
                kept.damping += next.damping;
            }
            same
        });
        couplings
    }

    /// How far an oscillator moves in mass-weighted coordinates, in which series are bounded: about as much as the
    /// structure would under its load at rest. Nothing feels it.
    fn scale(&self, couplings: &[Coupling], coordinate: usize, rate: f64) -> f64 {
        let weighted = |row: usize| {
            let mass = self.mass.get(row, row);
            if mass > 0.0 { self.stiffness.get(row, row).abs() / mass } else { 0.0 }
        };
        let stiffest = (0..self.size).map(weighted).fold(0.0, f64::max);
        let load = |coupling: &Coupling| {
            let mass = self.mass.get(coupling.row, coupling.row);
            let size = coupling.stiffness.abs() + rate * coupling.damping.abs();
            if mass > 0.0 { size / mass.sqrt() } else { 0.0 }
        };
        let own = couplings.iter().filter(|coupling| coupling.coordinate == coordinate);
        let scale = own.map(load).fold(0.0, f64::max) / stiffest.max(rate * rate);
        if scale > 0.0 && scale.is_finite() { scale } else { 1.0 }
    }
}
