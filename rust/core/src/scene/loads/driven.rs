//! A scene with the coordinates that carry its loads.

use std::sync::Arc;

use crate::linalg::sparse::{SparseMatrix, summed};
use crate::scene::dependent::slaved_coordinates::{Slaved, SlavedCoordinates};
use crate::scene::inertia::border::Terms;
use crate::scene::inertia::coupled_mass::coupled_mass;
use crate::scene::loads::input::Loads;
use crate::scene::loads::oscillators::{Carried, Drive, Force, Oscillator, Switch};
use crate::scene::model::Scene;

/// (column, entry) by row: what loads add to K, and to C, at the coordinates that carry them.
type Couplings = [Vec<Vec<(usize, f64)>>; 2];

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
            let entries = couplings.iter_mut().flatten().flatten();
            entries.filter(|entry| entry.0 == coordinate).for_each(|entry| entry.1 /= scale);
        }
        let n = scene.size;
        let carriers = drive.oscillators.len() + drive.switches.len();
        let size = n + carriers;
        let extended = |matrix: &SparseMatrix,
                        further: Option<&Vec<Vec<(usize, f64)>>>,
                        own: &dyn Fn(usize) -> f64| {
            SparseMatrix::from_rows(size, |row, entries| {
                if row >= n {
                    entries.push((row, own(row - n)));
                    return;
                }
                entries.extend(matrix.row(row));
                entries.extend(further.into_iter().flat_map(|rows| &rows[row]));
            })
        };
        let spring =
            |k: usize| drive.oscillators.get(k).map_or(0.0, |one| mass * one.rate * one.rate);
        let mass_matrix = extended(&scene.mass, None, &|_| mass);
        let damping = extended(&scene.damping, Some(&couplings[1]), &|_| 0.0);
        let stiffness = extended(&scene.stiffness, Some(&couplings[0]), &spring);
        // Held coordinates have no velocity; oscillators are not damped.
        let proportional = scene.proportional.filter(|_| drive.oscillators.is_empty());
        let coupled_mass = coupled_mass(
            &mass_matrix,
            &damping,
            &stiffness,
            Some(Terms { proportional: scene.felt(), structure: n, massless: &scene.massless }),
            &scene.coordinates.slots,
        )
        .expect("a positive definite mass with more of its diagonal");
        Arc::new(Self {
            size,
            dependents: carried_along(&scene.dependents, &drive),
            mass: mass_matrix,
            coupled_mass,
            damping,
            proportional,
            stiffness,
            energy_parts: None,
            force: [&scene.force[..], &vec![0.0; carriers]].concat(),
            loads: Loads::default(),
            drive: Some(drive),
            bare: Some(Arc::clone(&scene)),
            ..Self::clone(&scene)
        })
    }

    /// Whether switched loads act on some coordinates.
    pub(crate) fn switches(&self, coordinates: &[usize]) -> bool {
        let mut switches = self.drive.iter().flat_map(|drive| &drive.switches);
        switches.any(|switch| {
            coordinates.iter().any(|&row| self.stiffness.get(row, switch.coordinate) != 0.0)
        })
    }

    /// The coordinates that carry loads, one for each frequency and each switched load.
    fn drive_of(&self, loads: &Loads) -> Drive {
        let n = self.size;
        let mut drive = Drive { structure: n, ..Drive::default() };
        let oscillator = |drive: &mut Drive, frequency: f64, phase: f64| {
            let rate = std::f64::consts::TAU * frequency;
            let known = drive.oscillators.iter().find(|one| (one.rate, one.phase) == (rate, phase));
            known.cloned().unwrap_or_else(|| {
                let coordinate = n + drive.oscillators.len();
                let added = Oscillator { coordinate, rate, phase, scale: 1.0 };
                drive.oscillators.push(added.clone());
                added
            })
        };
        let whole = self.nodes.as_ref().map_or(self.dofs, |nodes| nodes.size);
        let rows = |direction: &[(usize, f64)]| {
            let mut force = vec![0.0; whole];
            direction.iter().for_each(|&(dof, entry)| force[dof] += entry);
            let force = self.coordinates.forces_of_dofs(&force);
            force.into_iter().enumerate().filter(|entry| entry.1 != 0.0).collect::<Vec<_>>()
        };
        for load in &loads.harmonics {
            let rows = rows(&load.direction);
            if rows.is_empty() {
                continue;
            }
            let Oscillator { coordinate, .. } = oscillator(&mut drive, load.frequency, load.phase);
            let forces = rows.into_iter().map(|(row, factor)| Force { row, coordinate, factor });
            drive.forces.extend(forces);
        }
        for load in loads.vibrations.iter().filter(|load| load.amplitude != 0.0) {
            let phase = load.phase - std::f64::consts::FRAC_PI_2;
            let oscillator = oscillator(&mut drive, load.frequency, phase);
            drive.carried.push(Carried {
                tangential: self.contacts[load.contact].tangential,
                factor: load.amplitude / oscillator.rate,
                oscillator,
            });
        }
        for load in &loads.steps {
            let coordinate = n + drive.oscillators.len() + drive.switches.len();
            let rows = rows(&load.direction).into_iter();
            drive.forces.extend(rows.map(|(row, factor)| Force { row, coordinate, factor }));
            drive.switches.push(Switch {
                coordinate,
                times: load.times.clone(),
                values: load.values.iter().map(|value| value - load.values[0]).collect(),
            });
        }
        drive
    }

    /// Ascending by column, one entry for each.
    fn couplings(&self, drive: &Drive) -> Couplings {
        let mut couplings = [(); 2].map(|()| vec![Vec::new(); self.size]);
        let [stiffness, damping] = &mut couplings;
        for force in &drive.forces {
            stiffness[force.row].push((force.coordinate, -force.factor));
        }
        for carried in &drive.carried {
            let Oscillator { coordinate, rate, .. } = carried.oscillator;
            for row in 0..self.size {
                let at =
                    |matrix: &SparseMatrix| carried.factor * matrix.get(row, carried.tangential);
                // M y'' + C y' + K y with y'' = -rate^2 y.
                let spring = at(&self.stiffness) - rate * rate * at(&self.mass);
                stiffness[row].push((coordinate, spring));
                damping[row].push((coordinate, at(&self.damping)));
            }
        }
        couplings.iter_mut().flatten().for_each(summed);
        couplings
    }

    /// How far an oscillator moves in mass-weighted coordinates, in which series are bounded: about as much as the
    /// structure would under its load at rest. Nothing feels it.
    fn scale(&self, couplings: &Couplings, coordinate: usize, rate: f64) -> f64 {
        let weighted = |row: usize| {
            let mass = self.mass.get(row, row);
            if mass > 0.0 { self.stiffness.get(row, row).abs() / mass } else { 0.0 }
        };
        let stiffest = (0..self.size).map(weighted).fold(0.0, f64::max);
        let heaviest = (0..self.size).map(|row| self.mass.get(row, row)).fold(0.0, f64::max);
        let load = |row: usize| {
            let [spring, damper] = couplings.each_ref().map(|rows| {
                rows[row].iter().find(|entry| entry.0 == coordinate).map_or(0.0, |entry| entry.1)
            });
            let size = spring.abs() + rate * damper.abs();
            let (mass, stiffness) = (self.mass.get(row, row), self.stiffness.get(row, row));
            if mass > 0.0 {
                size / mass.sqrt() / stiffest.max(rate * rate)
            } else if stiffness > 0.0 {
                size / stiffness * heaviest.sqrt()
            } else {
                0.0
            }
        };
        let scale = (0..self.size).map(load).fold(0.0, f64::max);
        if scale > 0.0 && scale.is_finite() { scale } else { 1.0 }
    }
}

/// Sums of coordinates, some of which vibrating sliders carry along: the sums hold for `q + y`.
fn carried_along(dependents: &SlavedCoordinates, drive: &Drive) -> SlavedCoordinates {
    let along = |one: &Slaved| {
        let mut moved = one.clone();
        for carried in &drive.carried {
            let own = (carried.tangential == one.coordinate).then_some(-1.0);
            let of = one.terms.iter().find(|term| term.0 == carried.tangential);
            if let Some(weight) = own.or(of.map(|term| term.1)) {
                moved.terms.push((carried.oscillator.coordinate, weight * carried.factor));
            }
        }
        summed(&mut moved.terms);
        moved
    };
    SlavedCoordinates::new(dependents.iter().map(along).collect())
}
