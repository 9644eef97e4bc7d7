//! The numbers of a scene that a parameter can set.

#[cfg(doc)]
use crate::scene::chain::{Link, Subsystem};
#[cfg(doc)]
use crate::scene::contact_law::ContactInput;

/// Defines the fields with their names in Python.
macro_rules! fields {
    ($($(#[$doc:meta])* $field:ident = $name:literal,)*) => {
        /// A number of a scene that a parameter can set.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Field {
            $($(#[$doc])* $field,)*
        }

        impl Field {
            /// The field of that name in Python, None where there is none.
            pub fn named(name: &str) -> Option<Self> {
                match name {
                    $($name => Some(Field::$field),)*
                    _ => None,
                }
            }
        }
    };
}

fields! {
    /// [`Subsystem::upper_mass`], kg.
    UpperMass = "upper_mass",
    /// [`Subsystem::contact_mass`], kg.
    ContactMass = "contact_mass",
    /// [`Subsystem::inclination`], rad.
    Inclination = "inclination",
    /// [`Subsystem::vertical_stiffness`], N/m.
    VerticalStiffness = "vertical_stiffness",
    /// [`Subsystem::horizontal_stiffness`], N/m.
    HorizontalStiffness = "horizontal_stiffness",
    /// [`Subsystem::ceiling_stiffness`], N/m.
    CeilingStiffness = "ceiling_stiffness",
    /// [`Subsystem::preload_displacement`], m.
    PreloadDisplacement = "preload_displacement",
    /// [`Subsystem::external_force`], N.
    ExternalForce = "external_force",
    /// [`Link::horizontal_stiffness`], N/m.
    LinkHorizontalStiffness = "link_horizontal_stiffness",
    /// [`Link::vertical_stiffness`], N/m.
    LinkVerticalStiffness = "link_vertical_stiffness",
    /// [`Chain::wall_stiffness`](crate::study::Chain::wall_stiffness), N/m.
    WallStiffness = "wall_stiffness",
    /// beta of `C = beta K`.
    Damping = "damping",
    /// [`ContactInput::friction`], -.
    Friction = "friction",
    /// [`ContactInput::static_friction`], -.
    StaticFriction = "static_friction",
    /// [`ContactInput::slider_speed`], m/s.
    SliderSpeed = "slider_speed",
    /// [`ContactInput::restitution`], -.
    Restitution = "restitution",
    /// [`ContactInput::gap`], m.
    Gap = "gap",
    /// [`ContactInput::normal_force`], N.
    NormalForce = "normal_force",
    /// Of the normal spring of a compliant contact, N/m.
    NormalStiffness = "normal_stiffness",
    /// Of its tangential spring, N/m.
    TangentialStiffness = "tangential_stiffness",
    /// Of a [`Harmonic`](crate::scene::Harmonic) load along one dof, N.
    HarmonicAmplitude = "harmonic_amplitude",
    /// Of a harmonic load, Hz.
    HarmonicFrequency = "harmonic_frequency",
    /// Of a harmonic load, rad.
    HarmonicPhase = "harmonic_phase",
    /// Of a [`Steps`](crate::scene::Steps) load along one dof, N.
    StepsAmplitude = "steps_amplitude",
    /// A time of a switched load, s; places count those of all such loads.
    StepsTimes = "steps_times",
    /// A factor of a switched load; places count those of all such loads.
    StepsValues = "steps_values",
    /// Of the [`Vibration`](crate::scene::Vibration) of a slider, m/s.
    VibrationAmplitude = "vibration_amplitude",
    /// Of a vibration, Hz.
    VibrationFrequency = "vibration_frequency",
    /// Of a vibration, rad.
    VibrationPhase = "vibration_phase",
}

/// A field at one place (subsystem, link or contact), or at all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot {
    /// The field that is set.
    pub field: Field,
    /// Index of the subsystem, link or contact; None: all of them, or the chain itself.
    pub place: Option<usize>,
}
