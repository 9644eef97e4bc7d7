//! Loads in time as a user states them.

use crate::error::input::Error;
use crate::scene::contact_law::check_finite;

/// The force `direction cos(2 pi frequency t + phase)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Harmonic {
    /// (dof, amplitude), N.
    pub direction: Vec<(usize, f64)>,
    /// Hz, positive.
    pub frequency: f64,
    /// rad
    pub phase: f64,
}

/// The force `direction factor(t)` with a factor that is constant between the times and right-continuous.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps {
    /// (dof, force at factor 1), N.
    pub direction: Vec<(usize, f64)>,
    /// Ascending and positive, s.
    pub times: Vec<f64>,
    /// The factor from 0 on, and from each time on.
    pub values: Vec<f64>,
}

/// A slider that vibrates: `amplitude cos(2 pi frequency t + phase)` is added to its speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Vibration {
    /// Index of the contact.
    pub contact: usize,
    /// m/s
    pub amplitude: f64,
    /// Hz, positive.
    pub frequency: f64,
    /// rad
    pub phase: f64,
}

/// All loads in time of a scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Loads {
    /// Forces that oscillate.
    pub harmonics: Vec<Harmonic>,
    /// Forces that are switched.
    pub steps: Vec<Steps>,
    /// Sliders that vibrate, at most one entry per contact.
    pub vibrations: Vec<Vibration>,
}

impl Loads {
    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.harmonics.is_empty() && self.steps.is_empty() && self.vibrations.is_empty()
    }

    /// Refuses numbers that make no load of a scene with so many dofs and contacts.
    pub(crate) fn validate(&self, dofs: usize, contacts: usize) -> Result<(), Error> {
        for (index, load) in self.harmonics.iter().enumerate() {
            let named = |field: &str| format!("harmonic load {index}: {field}");
            check_direction(&named("direction"), &load.direction, dofs)?;
            check_wave(&named, load.frequency, load.phase)?;
        }
        for (index, load) in self.steps.iter().enumerate() {
            let named = |field: &str| format!("steps load {index}: {field}");
            check_direction(&named("direction"), &load.direction, dofs)?;
            check_finite(&named("times"), &load.times)?;
            check_finite(&named("values"), &load.values)?;
            let mut before = 0.0;
            for &time in &load.times {
                if !(time > before) {
                    return Err(Error::Range {
                        argument: named("times"),
                        requirement: "positive and ascending",
                        value: time,
                    });
                }
                before = time;
            }
            if load.values.len() != load.times.len() + 1 {
                let expected = format!("{} numbers, one more than times", load.times.len() + 1);
                let got = load.values.len().to_string();
                return Err(Error::shape(&named("values"), &expected, got));
            }
        }
        for load in &self.vibrations {
            if load.contact >= contacts {
                let expected = format!("a contact below {contacts}");
                return Err(Error::shape("slider_vibration", &expected, load.contact.to_string()));
            }
            let named =
                |field: &str| format!("contact {}: slider_vibration: {field}", load.contact);
            check_finite(&named("amplitude"), &[load.amplitude])?;
            check_wave(&named, load.frequency, load.phase)?;
        }
        Ok(())
    }
}

fn check_wave(named: &impl Fn(&str) -> String, frequency: f64, phase: f64) -> Result<(), Error> {
    check_finite(&named("phase"), &[phase])?;
    match frequency > 0.0 && frequency.is_finite() {
        true => Ok(()),
        false => Err(Error::Range {
            argument: named("frequency"),
            requirement: "positive and finite",
            value: frequency,
        }),
    }
}

fn check_direction(argument: &str, entries: &[(usize, f64)], dofs: usize) -> Result<(), Error> {
    if let Some(&(dof, _)) = entries.iter().find(|entry| entry.0 >= dofs) {
        let expected = format!("a dof index below {dofs}");
        return Err(Error::shape(argument, &expected, dof.to_string()));
    }
    check_finite(argument, &entries.iter().map(|entry| entry.1).collect::<Vec<_>>())
}
