//! The numbers of a scene that a parameter can set.

#[cfg(doc)]
use crate::scene::chain::{Link, Subsystem};
#[cfg(doc)]
use crate::scene::contact_law::ContactInput;

/// A number of a scene that a parameter can set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Field {
    /// [`Subsystem::upper_mass`], kg.
    UpperMass,
    /// [`Subsystem::contact_mass`], kg.
    ContactMass,
    /// [`Subsystem::inclination`], rad.
    Inclination,
    /// [`Subsystem::vertical_stiffness`], N/m.
    VerticalStiffness,
    /// [`Subsystem::horizontal_stiffness`], N/m.
    HorizontalStiffness,
    /// [`Subsystem::ceiling_stiffness`], N/m.
    CeilingStiffness,
    /// [`Subsystem::preload_displacement`], m.
    PreloadDisplacement,
    /// [`Subsystem::external_force`], N.
    ExternalForce,
    /// [`Link::horizontal_stiffness`], N/m.
    LinkHorizontalStiffness,
    /// [`Link::vertical_stiffness`], N/m.
    LinkVerticalStiffness,
    /// [`Chain::wall_stiffness`](crate::study::Chain::wall_stiffness), N/m.
    WallStiffness,
    /// beta of `C = beta K`.
    Damping,
    /// [`ContactInput::friction`], -.
    Friction,
    /// [`ContactInput::static_friction`], -.
    StaticFriction,
    /// [`ContactInput::slider_speed`], m/s.
    SliderSpeed,
    /// [`ContactInput::restitution`], -.
    Restitution,
    /// [`ContactInput::gap`], m.
    Gap,
    /// [`ContactInput::normal_force`], N.
    NormalForce,
    /// Of the normal spring of a compliant contact, N/m.
    NormalStiffness,
    /// Of its tangential spring, N/m.
    TangentialStiffness,
    /// Of a [`Harmonic`](crate::scene::Harmonic) load along one dof, N.
    HarmonicAmplitude,
    /// Of a harmonic load, Hz.
    HarmonicFrequency,
    /// Of a harmonic load, rad.
    HarmonicPhase,
    /// Of a [`Steps`](crate::scene::Steps) load along one dof, N.
    StepsAmplitude,
    /// A time of a switched load, s; places count those of all such loads.
    StepsTimes,
    /// A factor of a switched load; places count those of all such loads.
    StepsValues,
    /// Of the [`Vibration`](crate::scene::Vibration) of a slider, m/s.
    VibrationAmplitude,
    /// Of a vibration, Hz.
    VibrationFrequency,
    /// Of a vibration, rad.
    VibrationPhase,
}

impl Field {
    /// The field of that name in Python, None where there is none.
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "upper_mass" => Field::UpperMass,
            "contact_mass" => Field::ContactMass,
            "inclination" => Field::Inclination,
            "vertical_stiffness" => Field::VerticalStiffness,
            "horizontal_stiffness" => Field::HorizontalStiffness,
            "ceiling_stiffness" => Field::CeilingStiffness,
            "preload_displacement" => Field::PreloadDisplacement,
            "external_force" => Field::ExternalForce,
            "link_horizontal_stiffness" => Field::LinkHorizontalStiffness,
            "link_vertical_stiffness" => Field::LinkVerticalStiffness,
            "wall_stiffness" => Field::WallStiffness,
            "damping" => Field::Damping,
            "friction" => Field::Friction,
            "static_friction" => Field::StaticFriction,
            "slider_speed" => Field::SliderSpeed,
            "restitution" => Field::Restitution,
            "gap" => Field::Gap,
            "normal_force" => Field::NormalForce,
            "harmonic_amplitude" => Field::HarmonicAmplitude,
            "harmonic_frequency" => Field::HarmonicFrequency,
            "harmonic_phase" => Field::HarmonicPhase,
            "steps_amplitude" => Field::StepsAmplitude,
            "steps_times" => Field::StepsTimes,
            "steps_values" => Field::StepsValues,
            "normal_stiffness" => Field::NormalStiffness,
            "tangential_stiffness" => Field::TangentialStiffness,
            "vibration_amplitude" => Field::VibrationAmplitude,
            "vibration_frequency" => Field::VibrationFrequency,
            "vibration_phase" => Field::VibrationPhase,
            _ => return None,
        })
    }
}

/// A field at one place (subsystem, link or contact), or at all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot {
    /// The field that is set.
    pub field: Field,
    /// Index of the subsystem, link or contact; None: all of them, or the chain itself.
    pub place: Option<usize>,
}
